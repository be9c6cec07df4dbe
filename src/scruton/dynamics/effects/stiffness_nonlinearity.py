"""Frequency that varies with amplitude."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.terms import Effect, Layout, Term, Values, Variant, add, size_prior

_UNIT = 0.1  # the prior of the relative change of frequency is N(0, (0.3 times this)^2)


def _largest(layout: Layout) -> float:
    return float(layout.largest.max())


def _square(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.STIFFNESS, _UNIT * values["size"] / _largest(layout) ** 2)


def _linear(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.STIFFNESS_LINEAR, _UNIT * values["size"] / _largest(layout))


def _variants(layout: Layout) -> tuple[Variant, ...]:
    scopes = [("in every record", layout.everywhere(), 2.0)]
    if np.unique(layout.rig).size > 1:
        scopes.append(("of every rig by its own", layout.by_rig(), 1.0))
    found = []
    for form, apply, share in (("A^2", _square, 1.0), ("A", _linear, 0.5)):
        for where, members, weight in scopes:
            found.append(
                Variant(f"frequency changes as {form}, {where}", (size_prior("size", members),), apply, members >= 0,
                        share * weight)
            )  # fmt: skip
    return tuple(found)


EFFECT = Effect(
    "stiffness_nonlinearity",
    "Frequency varies with amplitude",
    "Springs that stiffen or soften, slack, or a pendulum: the frequency changes as A^2 (cubic stiffness), "
    "less often as A.",
    "Nayfeh and Mook, Nonlinear Oscillations, section 2.3 (Duffing).",
    "The local frequency follows the amplitude; damping is untouched.",
    "frequency",
    _variants,
)
