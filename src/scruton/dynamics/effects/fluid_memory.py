"""The wake lags behind the amplitude."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import Apply, Effect, Extent, Parameter, Scope, Size, Station, Values, Variant
from scruton.dynamics.effects.terms import Belongs, Layout, Term


def _form(kind: float, start: float) -> Apply:
    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        cycles = values["lag"]
        table[:, :, Term.LAG] = cycles * 2.0 * np.pi / layout.omega
        table[:, :, Term.LAG_KIND] = np.where(cycles > 0.0, kind, 0.0)
        table[:, :, Term.LAG_START] = np.where(cycles > 0.0, start, 0.0)

    return apply


def _read(rows: FloatArray, _without: FloatArray, station: Station) -> FloatArray:
    # growth through half the stable amplitude, where da/dt = rate a: the wake's amplitude is (1 - lag rate) a
    aero, rate = rows[:, Term.AERO], rows[:, Term.AERO] + rows[:, Term.STRUCTURAL]
    pull = np.where(rows[:, Term.LAG_KIND] > 0.5, 2.0 * rate, -aero)
    return np.asarray(-pull * rows[:, Term.LAG] * rate / station.omega)


def _forms(layout: Layout) -> list[Variant]:
    if not layout.wind.any():
        return []
    scope = Scope(Extent.IN_WIND, layout.in_wind())
    centre = float(np.log(0.15 * layout.reference_omega / (2.0 * np.pi * layout.reference_rate)))
    lag = Parameter(
        "lag", centre, 1.0, scope.members, log=True, unit="cycles", starts=(centre - 1.0, centre + 0.3),
    )  # fmt: skip
    return [
        Variant("the wake's amplitude sets the damping", (lag,), _form(1.0, 1.0), scope),
        Variant("the wake's amplitude sets the force", (lag,), _form(0.0, 1.0), scope),
        Variant("the wake's amplitude sets the force, from rest", (lag,), _form(0.0, 0.0), scope),
    ]


EFFECT = Effect(
    "fluid_memory",
    "The wake lags",
    "The wake needs some cycles to follow the amplitude. The force is that of the amplitude a time tau ago, a "
    "first-order lag: the simplest of the wake oscillators.",
    "Hartlen and Currie (1970); Facchinetti, de Langre and Biolley (2004).",
    "Growth and decay through the same amplitude differ in damping, with opposite signs; the stable amplitude "
    "is untouched.",
    "amplitude",
    Belongs.WIND,
    (Term.LAG, Term.LAG_KIND, Term.LAG_START),
    Size("branch", "damping ratio of growth through half the stable amplitude, to first order in the lag", _read),
    _forms,
)
