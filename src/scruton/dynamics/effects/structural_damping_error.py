"""A structural damping ratio that is stated wrongly, by a constant."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.terms import Effect, Layout, Term, Values, Variant, add, size_prior


def _apply(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.STRUCTURAL, values["size"] * layout.rate)


def _variants(layout: Layout) -> tuple[Variant, ...]:
    rigs = np.unique(layout.rig)
    found = []
    scopes = [(f"of one rig#{i}", layout.only(layout.rig == i), 2.0 / rigs.size) for i in rigs]
    if rigs.size > 1:
        scopes += [("of all rigs alike", layout.everywhere(), 1.0), ("of every rig by its own", layout.by_rig(), 1.0)]
    for where, members, weight in scopes:
        found.append(Variant(f"stated damping {where}", (size_prior("size", members),), _apply, members >= 0, weight))
    if layout.wind.any() and not layout.wind.all():
        for i in rigs:
            mask = layout.wind & (layout.rig == i)
            if mask.any():
                members = layout.only(mask)
                found.append(
                    Variant(f"in wind other than in still air, of one rig#{i}", (size_prior("size", members),), _apply,
                            mask, 0.1 / rigs.size)
                )  # fmt: skip
    return tuple(found)


EFFECT = Effect(
    "structural_damping_error",
    "Stated structural damping wrong",
    "The damping ratio that the laboratory states for a rig is off by a constant: taken at another amplitude, "
    "on another "
    "day, or before a clamp was tightened.",
    "Any free-decay test repeated.",
    "One rig relaxes faster or slower than its statement says, at every amplitude alike; its still-air decays show it.",
    "amplitude",
    _variants,
)
