"""Frequency that varies with amplitude."""

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import Effect, Extent, Size, Station, Values, Variant, add, scopes, size_prior
from scruton.dynamics.effects.terms import Belongs, Layout, Term

_UNIT = 0.1  # the prior of the relative change of frequency is N(0, (0.3 times this)^2)


def _square(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.STIFFNESS, _UNIT * values["size"] / float(layout.largest.max()) ** 2)


def _linear(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.STIFFNESS_LINEAR, _UNIT * values["size"] / float(layout.largest.max()))


def _read(rows: FloatArray, without: FloatArray, station: Station) -> FloatArray:
    added, top = rows - without, station.largest
    return added[:, Term.STIFFNESS_LINEAR] * top + added[:, Term.STIFFNESS] * top**2


def _forms(layout: Layout) -> list[Variant]:
    shares = {Extent.EVERYWHERE: (2.0, "in every record"), Extent.EACH_RIG: (1.0, "of every rig by its own")}
    return [
        Variant(f"frequency changes as {power}, {{scope}}", (size_prior("size", scope.members),), apply, scope,
                share * scope.weight)
        for power, apply, share in (("A^2", _square, 1.0), ("A", _linear, 0.5))
        for scope in scopes(layout, shares)
    ]  # fmt: skip


EFFECT = Effect(
    "stiffness_nonlinearity",
    "Frequency varies with amplitude",
    "Springs that stiffen or soften, slack, or a pendulum: the frequency changes as A^2 (cubic stiffness), less often "
    "as A.",
    "Nayfeh and Mook, Nonlinear Oscillations, section 2.3 (Duffing).",
    "The local frequency follows the amplitude; damping is untouched.",
    "frequency",
    Belongs.RIG,
    (Term.STIFFNESS, Term.STIFFNESS_LINEAR),
    Size("frequency", "relative change of frequency up to the largest amplitude", _read),
    _forms,
)
