"""The shedding force itself, off the response frequency."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.terms import (
    Effect,
    IntArray,
    Layout,
    Parameter,
    Term,
    Values,
    Variant,
    add,
    compact,
    size_prior,
)


def _apply(table: FloatArray, values: Values, layout: Layout) -> None:
    unit = values["size"] * layout.rate * layout.reference_amplitude
    add(table, Term.FORCE_COS, unit * np.cos(values["phase"]))
    add(table, Term.FORCE_SIN, unit * np.sin(values["phase"]))
    table[:, :, Term.FORCE_RATE] = values["detuning"] * layout.omega


def _variants(layout: Layout) -> tuple[Variant, ...]:
    if not layout.wind.any():
        return ()
    tests = layout.by_test()
    scopes = [("in every test", layout.wind, 1.0)]
    numbers = np.unique(layout.test[layout.wind])
    if numbers.size > 1:
        scopes += [(f"in one test#{i}", layout.test == i, 1.0 / numbers.size) for i in numbers]
    return tuple(_variant(layout, tests, mask, label, weight) for label, mask, weight in scopes)


def _variant(layout: Layout, tests: IntArray, mask: IntArray, label: str, weight: float) -> Variant:
    own = compact(np.where(mask, tests, -1))
    parameters = (
        size_prior("size", own, positive=True),
        # A uniform phase: a normal prior whose density at its centre is 1/(2 pi).
        Parameter("phase", 0.0, np.sqrt(2.0 * np.pi), layout.each(mask), unit="rad"),
        Parameter("detuning", 0.0, 0.05, own, starts=(0.03,)),
    )
    return Variant(label, parameters, _apply, mask, weight, scan="detuning")


EFFECT = Effect(
    "vortex_shedding_forcing",
    "Vortex-shedding force",
    "Near the edge of lock-in the wake sheds at its own Strouhal frequency too. That force does not know the "
    "motion and "
    "beats with the response at the difference of the two frequencies.",
    "The term C sin(omega_vs t + psi) of Scanlan's model, Eq. (9) of the Griffin-plot paper with it.",
    "A line in the spectrum beside the response; amplitude and phase are modulated at the difference, also at lock-in.",
    "spectrum",
    _variants,
)
