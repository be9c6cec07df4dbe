"""Loss of spanwise coherence at small amplitude."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import DAMPING_RATIO, Effect, Extent, Parameter, Scope, Values, Variant
from scruton.dynamics.effects.terms import Belongs, Layout, Term


def _apply(table: FloatArray, values: Values, layout: Layout) -> None:
    table[:, :, Term.COHERENCE] = values["amplitude"] * layout.reference_amplitude


def _forms(layout: Layout) -> list[Variant]:
    if not layout.wind.any():
        return []
    scope = Scope(Extent.IN_WIND, layout.in_wind())
    amplitude = Parameter(
        "amplitude", float(np.log(0.2)), 1.0, scope.members, log=True, unit="reference amplitude",
        starts=tuple(float(np.log(x)) for x in (0.04, 0.12, 0.4)),
    )  # fmt: skip
    return [Variant("drive saturates as 1 - exp(-A/A_c)", (amplitude,), _apply, scope)]


EFFECT = Effect(
    "spanwise_coherence_loss",
    "Spanwise coherence lost at small amplitude",
    "Vortices are locked along the span by the motion. At small amplitude the force is not correlated over the whole "
    "model and the part of it that drives is smaller: c (1 - exp(-A/A_c)).",
    "Correlation lengths of 2 D at the onset of lock-in against 3.5 D and more at large amplitude (Ricciardelli 2010).",
    "Growth from rest is slower than the law says, and only there; noisier, too.",
    "amplitude",
    Belongs.WIND,
    (Term.COHERENCE,),
    DAMPING_RATIO,
    _forms,
)
