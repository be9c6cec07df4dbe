"""A reading that saturates at large amplitude."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.terms import Effect, Layout, Parameter, Term, Values, Variant


def _form(soft: float, by_rig: bool):  # type: ignore[no-untyped-def]
    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        # Over the largest reading: of the rig, whose channel it is, or of all.
        scope = values["level"][0] > 0.0
        largest = np.full(scope.shape, np.max(np.where(scope, layout.largest, 0.0)))
        if by_rig:
            for i in np.unique(layout.rig):
                largest[layout.rig == i] = layout.largest[layout.rig == i].max()
        table[:, :, Term.CLIP] = values["level"] * largest
        table[:, :, Term.CLIP_SOFT] = np.where(values["level"] > 0.0, soft, 0.0)

    return apply


def _variants(layout: Layout) -> tuple[Variant, ...]:
    found = []
    rigs = np.unique(layout.rig)
    scopes = [("of every channel", layout.everywhere(), 2.0)]
    if rigs.size > 1:
        scopes += [("of every rig at its own", layout.by_rig(), 1.0), ("of every rig alike", layout.everywhere(), 1.0)]
        scopes += [(f"of one rig#{i}", layout.only(layout.rig == i), 2.0 / rigs.size) for i in rigs]
    count = len(layout.records)
    if count > 1:
        scopes += [(f"of one record#{i}", layout.only(np.arange(count) == i), 2.0 / count) for i in range(count)]
    for form, soft, centre in (("hard", 0.0, 0.95), ("rounded", 2.0, 1.0), ("soft", 1.0, 1.6)):
        for where, members, weight in scopes:
            level = Parameter("level", float(np.log(centre)), 0.4, members, log=True, unit="largest reading",
                              starts=tuple(float(np.log(centre * x)) for x in (0.97, 0.8)))  # fmt: skip
            found.append(
                Variant(f"{form} saturation {where}", (level,), _form(soft, "every rig" in where), members >= 0, weight)
            )
    return tuple(found)


EFFECT = Effect(
    "sensor_clipping",
    "The reading saturates",
    "Above some level the sensor, its amplifier or its target range flattens the reading.",
    "Describing function of a saturation; any text on control.",
    "The largest cycles have flat tops: a third harmonic in phase, of minus some per cent, and an amplitude too small.",
    "signal",
    _variants,
)
