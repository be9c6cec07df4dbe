"""What is in no catalogue: generic terms that compete under the name `unknown`."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import (
    DAMPING_RATIO,
    Effect,
    Extent,
    Parameter,
    Scope,
    Values,
    Variant,
    add,
    size_prior,
)
from scruton.dynamics.effects.terms import HATS, Belongs, Layout, Term


def hats(table: FloatArray, values: Values, layout: Layout) -> None:
    """Excess damping at the knots."""
    for k in range(HATS):
        table[:, :, int(Term.HAT) + k] += values[f"hat{k}"] * layout.rate


def discrepancy(members: np.ndarray, scale: float = 0.3) -> tuple[Parameter, ...]:
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


def _forms(layout: Layout) -> list[Variant]:
    shared = [Scope(Extent.EVERYWHERE, layout.everywhere(), "everywhere")]
    wind = Scope(Extent.IN_WIND, layout.in_wind(), "in wind")
    if layout.wind.any():
        shared.append(wind)
    if np.unique(layout.test[layout.wind]).size > 1:
        shared.append(Scope(Extent.EACH_TEST, layout.by_test(), "of every test by its own"))
    damping = "damping against amplitude, {scope}"
    found = [Variant(damping, discrepancy(scope.members), hats, scope) for scope in shared]
    if not layout.wind.any():
        return found
    bend = tuple(size_prior(name, wind.members, scale=0.2) for name in ("linear", "square"))
    # Rare: small changes of frequency in wind are everywhere, and no gap.
    found.append(Variant("frequency against amplitude, in wind alone", bend, _bend, wind, 0.003))
    own = Scope(Extent.EACH_RECORD, layout.each(layout.wind), "in every record")
    jump = (
        size_prior("drive", own.members),
        size_prior("rate", own.members),
        Parameter("moment", 0.5, 0.3, own.members, unit="record", starts=(0.5,)),
    )
    found.append(Variant("a jump {scope}", jump, _jump, own, scan="moment"))
    return found


EFFECT = Effect(
    "unknown",
    "Something that is not in the catalogue",
    "A damping that varies with amplitude in any smooth way, by test or everywhere, a jump in time, or records whose "
    "innovations are not white.",
    "Discrepancy of Kennedy and O'Hagan (2001), put into the damping rather than onto the reading.",
    "Whatever the catalogued effects leave.",
    "amplitude",
    Belongs.WIND,
    (Term.HAT, Term.JUMP, Term.JUMP_RATE, Term.JUMP_TIME, Term.STIFFNESS, Term.STIFFNESS_LINEAR),
    DAMPING_RATIO,
    _forms,
)
