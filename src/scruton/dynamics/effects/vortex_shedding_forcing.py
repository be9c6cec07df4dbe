"""The shedding force itself, off the response frequency."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import (
    Effect,
    Extent,
    Parameter,
    Scope,
    Size,
    Station,
    Values,
    Variant,
    add,
    scopes,
    size_prior,
)
from scruton.dynamics.effects.terms import Belongs, Layout, Term


def _apply(table: FloatArray, values: Values, layout: Layout) -> None:
    unit = values["size"] * layout.rate * layout.reference_amplitude
    add(table, Term.FORCE_COS, unit * np.cos(values["phase"]))
    add(table, Term.FORCE_SIN, unit * np.sin(values["phase"]))
    table[:, :, Term.FORCE_RATE] = values["detuning"] * layout.omega


def _read(rows: FloatArray, _without: FloatArray, station: Station) -> FloatArray:
    return np.asarray(np.hypot(rows[:, Term.FORCE_COS], rows[:, Term.FORCE_SIN]) / station.omega)


def _forms(layout: Layout) -> list[Variant]:
    if not layout.wind.any():
        return []
    shares = {Extent.EACH_TEST: (1.0, "in every test"), Extent.ONE_TEST: (1.0, "in one test")}
    return [_variant(layout, scope) for scope in scopes(layout, shares)]


def _variant(layout: Layout, scope: Scope) -> Variant:
    parameters = (
        size_prior("size", scope.members, positive=True),
        # A uniform phase: a normal prior whose density at its centre is 1/(2 pi).
        Parameter("phase", 0.0, np.sqrt(2.0 * np.pi), layout.each(scope.records), unit="rad"),
        Parameter("detuning", 0.0, 0.05, scope.members, starts=(0.03,)),
    )
    return Variant("{scope}", parameters, _apply, scope, scope.weight, scan="detuning")


EFFECT = Effect(
    "vortex_shedding_forcing",
    "Vortex-shedding force",
    "Near the edge of lock-in the wake sheds at its own Strouhal frequency too. That force does not know the motion "
    "and beats with the response at the difference of the two frequencies.",
    "The term C sin(omega_vs t + psi) of Scanlan's model, Eq. (9) of the Griffin-plot paper with it.",
    "A line in the spectrum beside the response; amplitude and phase are modulated at the difference, also at lock-in.",
    "spectrum",
    Belongs.WIND,
    (Term.FORCE_COS, Term.FORCE_SIN, Term.FORCE_RATE),
    Size("spectrum", "amplitude that the force would add in one radian", _read),
    _forms,
)
