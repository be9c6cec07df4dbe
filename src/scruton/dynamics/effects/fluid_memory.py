"""The wake lags behind the amplitude."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.terms import Effect, Layout, Parameter, Term, Values, Variant


def _form(kind: float, start: float):  # type: ignore[no-untyped-def]
    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        cycles = values["lag"]
        table[:, :, Term.LAG] = cycles * 2.0 * np.pi / layout.omega
        table[:, :, Term.LAG_KIND] = np.where(cycles > 0.0, kind, 0.0)
        table[:, :, Term.LAG_START] = np.where(cycles > 0.0, start, 0.0)

    return apply


def _variants(layout: Layout) -> tuple[Variant, ...]:
    if not layout.wind.any():
        return ()
    members = layout.in_wind()
    centre = float(np.log(0.15 * layout.reference_omega / (2.0 * np.pi * layout.reference_rate)))
    lag = Parameter(
        "lag", centre, 1.0, members, log=True, unit="cycles", starts=(centre - 1.0, centre + 0.3),
    )  # fmt: skip
    return (
        Variant("the wake's amplitude sets the damping", (lag,), _form(1.0, 1.0), members >= 0, 1.0),
        Variant("the wake's amplitude sets the force", (lag,), _form(0.0, 1.0), members >= 0, 1.0),
        Variant("the wake's amplitude sets the force, from rest", (lag,), _form(0.0, 0.0), members >= 0, 1.0),
    )


EFFECT = Effect(
    "fluid_memory",
    "The wake lags",
    "The wake needs some cycles to follow the amplitude. The force is that of the amplitude a time tau ago, a "
    "first-order "
    "lag: the simplest of the wake oscillators.",
    "Hartlen and Currie (1970); Facchinetti, de Langre and Biolley (2004).",
    "Growth and decay through the same amplitude differ in damping, with opposite signs; the stable amplitude "
    "is untouched.",
    "amplitude",
    _variants,
)
