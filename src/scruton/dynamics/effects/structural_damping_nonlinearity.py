"""Structural damping that varies with amplitude, in still air as in wind."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.terms import Effect, IntArray, Layout, Term, Values, Variant, add, size_prior


def _linear(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.STRUCTURAL_LINEAR, values["size"] * layout.rate / layout.reference_amplitude)


def _square(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.STRUCTURAL_SQUARE, values["size"] * layout.rate / layout.reference_amplitude**2)


def _quadratic(table: FloatArray, values: Values, layout: Layout) -> None:
    _linear(table, {"size": values["linear"]}, layout)
    _square(table, {"size": values["square"]}, layout)


def _variants(layout: Layout) -> tuple[Variant, ...]:
    found = []
    rigs = np.unique(layout.rig)
    for form, apply in (("A", _linear), ("A^2", _square)):
        scopes: list[tuple[str, IntArray, float]] = [("in every rig alike", layout.everywhere(), 2.0)]
        if rigs.size > 1:
            scopes.append(("in every rig, each its own", layout.by_rig(), 1.0))
            scopes += [(f"in one rig#{i}", layout.only(layout.rig == i), 1.0 / rigs.size) for i in rigs]
        for where, members, weight in scopes:
            parameters = (size_prior("size", members),)
            found.append(Variant(f"as {form}, {where}", parameters, apply, members >= 0, weight))
    everywhere = layout.everywhere()
    pair = (size_prior("linear", everywhere), size_prior("square", everywhere))
    found.append(Variant("as A and A^2, in every rig alike", pair, _quadratic, everywhere >= 0, 0.7))
    return tuple(found)


EFFECT = Effect(
    "structural_damping_nonlinearity",
    "Structural damping that varies with amplitude",
    "Springs, clamps and air drag of the arms dissipate more (or less) at large amplitude: a damping ratio "
    "that has a part "
    "proportional to A (quadratic drag) or to A^2.",
    "Nayfeh and Mook, Nonlinear Oscillations, section 3.3 (averaged quadratic and cubic damping).",
    "The same curve of damping against amplitude in still air and in wind, in growth and in decay.",
    "amplitude",
    _variants,
)
