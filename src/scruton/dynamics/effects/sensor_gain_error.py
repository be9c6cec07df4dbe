"""A channel that scales its reading."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.terms import Effect, Layout, Term, Values, Variant, add, size_prior


def _apply(table: FloatArray, values: Values, layout: Layout) -> None:
    del layout
    add(table, Term.GAIN, values["size"])


def _variants(layout: Layout) -> tuple[Variant, ...]:
    found = []
    if not layout.wind.any():
        return ()
    rigs = np.unique(layout.rig[layout.wind])
    names = np.arange(len(layout.records))
    if rigs.size > 1:
        for i in rigs:
            members = layout.only(layout.rig == i)
            parameters = (size_prior("size", members, scale=0.2),)
            found.append(Variant(f"of one rig#{i}", parameters, _apply, members >= 0, 2.0 / rigs.size))
    wind = np.flatnonzero(layout.wind)
    if wind.size > 1:
        for i in wind:
            members = layout.only(names == i)
            parameters = (size_prior("size", members, scale=0.2),)
            found.append(Variant(f"of one record#{i}", parameters, _apply, members >= 0, 2.0 / wind.size))
    return tuple(found)


EFFECT = Effect(
    "sensor_gain_error",
    "Gain of a channel wrong",
    "One record or rig reads too large or too small by a factor: a wrong range, a target that moved, two "
    "springs' sensors "
    "averaged where one had failed.",
    "Static calibration, or a second sensor.",
    "A stable amplitude that differs from the others by a factor while the relaxation rate agrees; a gain of "
    "all channels "
    "alike cannot be seen.",
    "signal",
    _variants,
)
