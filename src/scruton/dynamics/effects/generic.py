"""What is in no catalogue: generic terms that compete under the name `unknown`."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.terms import HATS, Effect, Layout, Parameter, Term, Values, Variant, add, size_prior


def hats(table: FloatArray, values: Values, layout: Layout) -> None:
    """Excess damping at the knots."""
    for k in range(HATS):
        table[:, :, int(Term.HAT) + k] += values[f"hat{k}"] * layout.rate


def discrepancy(layout: Layout, members: np.ndarray, scale: float = 0.3) -> tuple[Parameter, ...]:
    """Weights of the hat functions in ln(amplitude), in units of the reference relaxation rate."""
    return tuple(size_prior(f"hat{k}", members, scale=scale) for k in range(HATS))


def _jump(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.JUMP, values["drive"])
    add(table, Term.JUMP_RATE, values["rate"] * layout.rate)
    table[:, :, Term.JUMP_TIME] = values["moment"] * layout.duration


def _bend(table: FloatArray, values: Values, layout: Layout) -> None:
    largest = float(layout.largest.max())
    add(table, Term.STIFFNESS_LINEAR, 0.1 * values["linear"] / largest)
    add(table, Term.STIFFNESS, 0.1 * values["square"] / largest**2)


def _variants(layout: Layout) -> tuple[Variant, ...]:
    everywhere = layout.everywhere()
    found = [
        Variant("damping against amplitude, everywhere", discrepancy(layout, everywhere), hats, everywhere >= 0, 1.0)
    ]
    if not layout.wind.any():
        return tuple(found)
    wind, own = layout.in_wind(), layout.each(layout.wind)
    found.append(Variant("damping against amplitude, in wind", discrepancy(layout, wind), hats, layout.wind, 1.0))
    if np.unique(layout.test[layout.wind]).size > 1:
        shapes = discrepancy(layout, layout.by_test())
        found.append(Variant("damping against amplitude, of every test by its own", shapes, hats, layout.wind, 1.0))
    bend = (size_prior("linear", wind, scale=0.2), size_prior("square", wind, scale=0.2))
    # Rare: small changes of frequency in wind are everywhere, and no gap.
    found.append(Variant("frequency against amplitude, in wind alone", bend, _bend, layout.wind, 0.003))
    jump = (
        size_prior("drive", own),
        size_prior("rate", own),
        Parameter("moment", 0.5, 0.3, own, unit="record", starts=(0.5,)),
    )
    found.append(Variant("a jump in every record", jump, _jump, layout.wind, 1.0, scan="moment"))
    return tuple(found)


EFFECT = Effect(
    "unknown",
    "Something that is not in the catalogue",
    "A damping that varies with amplitude in any smooth way, by test or everywhere, a jump in time, or records whose "
    "innovations are not white.",
    "Discrepancy of Kennedy and O'Hagan (2001), put into the damping rather than onto the reading.",
    "Whatever the catalogued effects leave.",
    "amplitude",
    _variants,
)
