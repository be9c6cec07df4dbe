"""A channel that scales its reading."""

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import Effect, Extent, Size, Station, Values, Variant, add, scopes, size_prior
from scruton.dynamics.effects.terms import Belongs, Layout, Term


def _apply(table: FloatArray, values: Values, layout: Layout) -> None:
    del layout
    add(table, Term.GAIN, values["size"])


def _read(rows: FloatArray, without: FloatArray, _station: Station) -> FloatArray:
    return rows[:, Term.GAIN] - without[:, Term.GAIN]


def _forms(layout: Layout) -> list[Variant]:
    if not layout.wind.any():
        return []
    shares = {Extent.ONE_RIG: (2.0, "of one rig"), Extent.ONE_RECORD: (2.0, "of one record")}
    return [
        Variant("{scope}", (size_prior("size", scope.members, scale=0.2),), _apply, scope, scope.weight)
        for scope in scopes(layout, shares, wind=True)
    ]


EFFECT = Effect(
    "sensor_gain_error",
    "Gain of a channel wrong",
    "One record or rig reads too large or too small by a factor: a wrong range, a target that moved, two springs' "
    "sensors averaged where one had failed.",
    "Static calibration, or a second sensor.",
    "A stable amplitude that differs from the others by a factor while the relaxation rate agrees; a gain of all "
    "channels alike cannot be seen.",
    "signal",
    Belongs.SENSOR,
    (Term.GAIN,),
    Size("signal", "relative error of the reading at the largest amplitude", _read),
    _forms,
)
