"""Dry friction in the suspension or in a damper."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import (
    DAMPING_RATIO,
    Effect,
    Extent,
    Parameter,
    Values,
    Variant,
    add,
    scopes,
    size_prior,
)
from scruton.dynamics.effects.terms import Belongs, Layout, Term

_WIDTH = 0.003  # of the reference amplitude: below it friction sticks and acts like a spring


def _apply(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.FRICTION, values["size"] * layout.rate * layout.reference_amplitude)
    width = values.get("width")
    own = _WIDTH if width is None else width
    table[:, :, Term.FRICTION_WIDTH] = np.where(values["size"] != 0.0, own * layout.reference_amplitude, 0.0)


def _forms(layout: Layout) -> list[Variant]:
    sudden = {
        Extent.EVERYWHERE: (2.0, "in every rig alike"),
        Extent.ONE_RIG: (2.0, "in one rig"),
        Extent.EACH_RIG: (1.0, "in every rig, each its own"),
        Extent.ALL_RIGS_BUT_ONE: (1.0, "in all rigs but one"),
    }
    presliding = {Extent.EVERYWHERE: (1.0, "in every rig"), Extent.ONE_RIG: (1.0, "in one rig")}
    found = []
    for scope in scopes(layout, sudden):
        size = size_prior("size", scope.members, positive=True)
        found.append(Variant("{scope}", (size,), _apply, scope, scope.weight))
    centre = float(np.log(0.05))
    for scope in scopes(layout, presliding):
        size = size_prior("size", scope.members, positive=True)
        width = Parameter("width", centre, 1.0, scope.members, log=True, starts=(centre,))
        found.append(Variant("with presliding, {scope}", (size, width), _apply, scope, scope.weight))
    return found


EFFECT = Effect(
    "coulomb_friction",
    "Dry friction",
    "A force of constant size against the motion. Averaged over a cycle it takes 2F/(pi omega) from the amplitude in "
    "unit time whatever the amplitude, so that the damping grows as 1/A and a free decay ends in a straight line.",
    "Den Hartog, Mechanical Vibrations; Dowell and Schwartz (1983) for the average.",
    "In wind it has the form of a smaller epsilon: only still-air records, or rigs with different friction, tell it.",
    "amplitude",
    Belongs.RIG,
    (Term.FRICTION, Term.FRICTION_WIDTH),
    DAMPING_RATIO,
    _forms,
)
