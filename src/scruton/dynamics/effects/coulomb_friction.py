"""Dry friction in the suspension or in a damper."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.terms import Effect, IntArray, Layout, Parameter, Term, Values, Variant, add, size_prior

_WIDTH = 0.003  # of the reference amplitude: below it friction sticks and acts like a spring


def _apply(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.FRICTION, values["size"] * layout.rate * layout.reference_amplitude)
    width = values.get("width")
    own = _WIDTH if width is None else width
    table[:, :, Term.FRICTION_WIDTH] = np.where(values["size"] != 0.0, own * layout.reference_amplitude, 0.0)


def _variants(layout: Layout) -> tuple[Variant, ...]:
    rigs = np.unique(layout.rig)
    found = [_variant("in every rig alike", layout.everywhere(), 2.0)]
    if rigs.size > 1:
        found += [_variant(f"in one rig#{i}", layout.only(layout.rig == i), 2.0 / rigs.size) for i in rigs]
        found += [_variant("in every rig, each its own", layout.by_rig(), 1.0)]
        found += [_variant(f"in all rigs but one#{i}", layout.only(layout.rig != i), 1.0 / rigs.size) for i in rigs]
    scopes = [("in every rig", layout.everywhere(), 1.0)]
    if rigs.size > 1:
        scopes += [(f"in one rig#{i}", layout.only(layout.rig == i), 1.0 / rigs.size) for i in rigs]
    centre = float(np.log(0.05))
    for where, members, weight in scopes:
        width = Parameter("width", centre, 1.0, members, log=True, starts=(centre,))
        size = size_prior("size", members, positive=True)
        found.append(Variant(f"with presliding, {where}", (size, width), _apply, members >= 0, weight))
    return tuple(found)


def _variant(label: str, members: IntArray, weight: float) -> Variant:
    return Variant(label, (size_prior("size", members, positive=True),), _apply, members >= 0, weight)


EFFECT = Effect(
    "coulomb_friction",
    "Dry friction",
    "A force of constant size against the motion. Averaged over a cycle it takes 2F/(pi omega) from the "
    "amplitude in unit "
    "time whatever the amplitude, so that the damping grows as 1/A and a free decay ends in a straight line.",
    "Den Hartog, Mechanical Vibrations; Dowell and Schwartz (1983) for the average.",
    "In wind it has the form of a smaller epsilon: only still-air records, or rigs with different friction, tell it.",
    "amplitude",
    _variants,
)
