"""A structural damping ratio that is stated wrongly, by a constant."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import (
    DAMPING_RATIO,
    Effect,
    Extent,
    Scope,
    Values,
    Variant,
    add,
    scopes,
    size_prior,
)
from scruton.dynamics.effects.terms import Belongs, Layout, Term


def _apply(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.STRUCTURAL, values["size"] * layout.rate)


def _forms(layout: Layout) -> list[Variant]:
    one = (2.0, "of one rig")
    shares = {
        Extent.ONE_RIG: one,
        Extent.EVERYWHERE: (1.0, "of all rigs alike"),
        Extent.EACH_RIG: (1.0, "of every rig by its own"),
    }
    stated = scopes(layout, shares)
    if np.unique(layout.rig).size == 1:
        stated = [Scope(Extent.ONE_RIG, layout.everywhere(), one[1], int(layout.rig[0]), one[0])]
    choices = [("stated damping {scope}", scope) for scope in stated]
    if layout.wind.any() and not layout.wind.all():
        in_wind = scopes(layout, {Extent.ONE_RIG_IN_WIND: (0.1, "of one rig")})
        choices += [("in wind other than in still air, {scope}", scope) for scope in in_wind]
    return [Variant(form, (size_prior("size", scope.members),), _apply, scope, scope.weight) for form, scope in choices]


EFFECT = Effect(
    "structural_damping_error",
    "Stated structural damping wrong",
    "The damping ratio that the laboratory states for a rig is off by a constant: taken at another amplitude, on "
    "another day, or before a clamp was tightened.",
    "Any free-decay test repeated.",
    "One rig relaxes faster or slower than its statement says, at every amplitude alike; its still-air decays show it.",
    "amplitude",
    Belongs.RIG,
    (Term.STRUCTURAL,),
    DAMPING_RATIO,
    _forms,
)
