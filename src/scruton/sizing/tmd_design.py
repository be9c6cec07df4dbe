"""The lightest tuned mass damper that keeps the risk of too large a vibration low.

The risk is taken over joint draws of whatever is uncertain: the Griffin curve, the damping of the bridge, its frequency
and modal mass, and what the damper turns out to be.  A damper is tuned once, so its tuning has to be robust against
all of that, and the risk is kept at an error of the frequency of 2 % either way, too.

The amplitude comes in to `design` as a function of the added damping, draw by draw, so it knows neither law nor bridge;
`scruton.sizing.dampers` brings it the mode of a bridge.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from scruton.errors import InputError
from scruton.sizing.tmd import TunedMass, positive
from scruton.sizing.tmd_draws import Outcome
from scruton.sizing.tmd_tuning import TuningDraws

DETUNINGS = (-0.05, -0.02, 0.02, 0.05)
_LIGHTEST = 1e-6  # mass ratio below which no search goes
_HOPELESS = 0.1  # what lacks by the table at the heaviest dampers from which on they are not looked at without it
_ATTEMPTS = 3  # at setting the table right for the heaviest dampers

# Dampers of a mass ratio, sought next to others, and what they lack.
Tune = Callable[[float, tuple[TunedMass, ...]], tuple[tuple[TunedMass, ...], float]]


@dataclass(frozen=True)
class Detuned:
    """What a design leaves when the frequency of the bridge is off by a known amount, the rest as uncertain as before.

    Attributes
    ----------
    detuning : float
        True frequency over the nominal one, less 1.
    probability, stroke, stroke_high : float
        As of `scruton.sizing.tmd_draws.Outcome`.
    """

    detuning: float
    probability: float
    stroke: float
    stroke_high: float


@dataclass(frozen=True)
class BuiltDamper(TunedMass):
    """A damper as it is built: its own frequency [Hz], mass [kg], spring [N/m] and dashpot [N s/m].

    The last three are None where the mass of the mode is not stated.
    """

    frequency: float
    mass: float | None
    spring: float | None
    dashpot: float | None

    def heavier(self, factor: float) -> "BuiltDamper":
        """The same damper with so many times the mass."""
        mass, spring, dashpot = (None if x is None else factor * x for x in (self.mass, self.spring, self.dashpot))
        return replace(self, mass_ratio=factor * self.mass_ratio, mass=mass, spring=spring, dashpot=dashpot)


@dataclass(frozen=True)
class Design:
    """A set of dampers (none where none is needed) and what it leaves, also at frequency errors of -5, -2, +2 and +5 %.

    Attributes
    ----------
    achievable : bool
        Whether risk and stroke are kept.  Where they are not, the dampers are the best of the largest mass.
    reason : str
        Why they are not, or what decided on the mass.
    """

    dampers: tuple[BuiltDamper, ...]
    outcome: Outcome
    detuned: tuple[Detuned, ...]
    achievable: bool
    reason: str


def design(
    draws: TuningDraws,
    *,
    risk: float,
    frequency: float,
    modal_mass: float | None = None,
    mass_ratios: tuple[float, float] = (_LIGHTEST, 0.05),
    near: tuple[TunedMass, ...] = (),
) -> Design:
    """Find the dampers of least mass with P(amplitude > limit) <= risk.

    Parameters
    ----------
    draws : TuningDraws
        Of the amplitude and the frequency error, with limit, number of dampers and largest stroke.
    risk : float
        Between 0 and 1.
    frequency : float
        Nominal frequency of the mode [Hz].
    modal_mass : float, optional
        kg (kg m^2 for an amplitude in rad), for a mode shape of one where the amplitude is taken; without it dampers
        are ratios only.
    mass_ratios : (float, float)
        The smallest and the largest of all dampers together.
    near : tuple of TunedMass
        A design for nearly the same, to start from.

    Raises
    ------
    InputError
        If an argument is out of range.

    Notes
    -----
    The frequency errors are errors of stiffness: the mass ratio does not change with them.
    """
    positive("frequency", frequency)
    scales = (
        [None] * draws.number if modal_mass is None else (positive("modal_mass", modal_mass) / draws.shape**2).tolist()
    )
    if not 0.0 < risk < 1.0:
        raise InputError("damper", "risk", f"{risk:g}", "a probability between 0 and 1, as 0.05")
    smallest, largest_mass_ratio = (positive("largest_mass_ratio", each) for each in mass_ratios)

    dampers: tuple[TunedMass, ...] = ()
    achievable, reason = True, "no damper is needed"
    if draws.probability(()) > risk:
        least = _near_least(draws, near, risk, (smallest, largest_mass_ratio)) or _least(
            draws, risk, (smallest, largest_mass_ratio)
        )
        achievable, dampers = least.kept, least.dampers
        if achievable:
            reason = f"the {'stroke' if _stroke_decides(draws, dampers, risk) else 'risk'} decides on the mass"
            if (total := _mass(dampers)) < 1.01 * smallest:
                reason = f"the smallest mass ratio, {100.0 * smallest:g} %, decides on the mass"
                # The search for the lightest lets spare mass shorten the stroke, which nobody asked for.
                robust, _ = draws.tune(total, risk, spare=True)
                dampers = robust if draws.keeps(robust, risk) else dampers
        else:
            # What is left to seek is the least risk.
            dampers = dampers if draws.largest_stroke is not None else draws.best(largest_mass_ratio, risk)
            reason = _why_not(draws, dampers, risk, largest_mass_ratio)
    off = [draws.outcome(dampers, error) for error in DETUNINGS]
    detuned = [Detuned(e, o.probability, o.stroke, o.stroke_high) for e, o in zip(DETUNINGS, off, strict=True)]
    built = tuple(build(each, frequency, scale) for each, scale in zip(dampers, scales, strict=False))
    return Design(built, draws.outcome(dampers), tuple(detuned), achievable, reason)


def build(damper: TunedMass, frequency: float, scale: float | None) -> BuiltDamper:
    """A damper with its own frequency [Hz], mass [kg], spring and dashpot.

    `scale` is the modal mass over the square of the mode shape where it hangs, `frequency` that of the mode [Hz].
    """
    ratios = (damper.mass_ratio, damper.frequency_ratio, damper.damping_ratio)
    natural, mass, spring, dashpot = damper.frequency_ratio * frequency, None, None, None
    if scale is not None:
        mass, omega = damper.mass_ratio * scale, 2.0 * np.pi * natural
        spring, dashpot = mass * omega**2, 2.0 * damper.damping_ratio * mass * omega
    return BuiltDamper(*ratios, natural, mass, spring, dashpot)


class _Found(NamedTuple):
    """Dampers, and whether they keep risk and stroke."""

    dampers: tuple[TunedMass, ...]
    kept: bool


def _near_least(
    draws: TuningDraws, near: tuple[TunedMass, ...], risk: float, mass_ratios: tuple[float, float]
) -> _Found | None:
    """The lightest dampers from a design for nearly the same; None where there is none, or it leads to none."""
    if not near:
        return None
    smallest, largest = mass_ratios
    if draws.number == 1:
        dampers, lack = draws.tune(_mass(near), risk, near)
        found = _Found((), kept=False) if lack > 0.0 else _lightest(draws, dampers, lack, risk, smallest)
        return found if found.kept else None
    tune, _ = _set_right(draws, near, risk)
    mass, dampers = _mass(near), near
    for _ in range(_ATTEMPTS):
        dampers, lack = tune(min(mass, largest), dampers)
        if lack <= 0.0:
            return _Found(_lighten(tune, dampers, lack, smallest), kept=True)
        mass *= float(np.exp(lack / 0.5 + 1e-3))
    return None


def _least(draws: TuningDraws, risk: float, mass_ratios: tuple[float, float]) -> _Found:
    """The lightest dampers from the heaviest that are allowed, or those where none keep risk and stroke."""
    dampers, lack = draws.tune(mass_ratios[1], risk)
    return _Found(dampers, kept=False) if lack > _HOPELESS else _lightest(draws, dampers, lack, risk, mass_ratios[0])


def _lightest(draws: TuningDraws, dampers: tuple[TunedMass, ...], lack: float, risk: float, smallest: float) -> _Found:
    """Lighten dampers that keep the limits until they just do.

    Tuning reads a table; the answer must hold without it.  Where it does not, as with several dampers, each delivered
    with errors of its own, the table is set right at the dampers of every step.
    """
    first = None
    if lack <= 0.0 and draws.number == 1:
        found = _lighten(lambda mass, near: draws.tune(mass, risk, near), dampers, lack, smallest)
        if draws.keeps(found, risk):
            return _Found(found, kept=True)
        first = _mass(found)
    tune, lack = _set_right(draws, dampers, risk)
    for _ in range(_ATTEMPTS):
        if lack <= 0.0:
            return _Found(_lighten(tune, dampers, lack, smallest, first), kept=True)
        dampers, lack = tune(_mass(dampers), dampers)
    return _Found(dampers, kept=False)


def _set_right(draws: TuningDraws, dampers: tuple[TunedMass, ...], risk: float) -> tuple[Tune, float]:
    """Tuning with a table that is set right at the dampers it was last asked for, at first at these; what these lack.

    What it tells of what lacks holds without the table.
    """
    table, lack = draws.set_right(dampers, risk)

    def tune(mass: float, near: tuple[TunedMass, ...]) -> tuple[tuple[TunedMass, ...], float]:
        nonlocal table
        tuned, _ = table.tune(mass, risk, near)
        table, lack = draws.set_right(tuned, risk)
        return tuned, lack

    return tune, lack


def _lighten(
    tune: Tune,
    dampers: tuple[TunedMass, ...],
    lack: float,
    smallest: float,
    first: float | None = None,
) -> tuple[TunedMass, ...]:
    """The lightest dampers that lack nothing, from such ones; `first` is the mass ratio that is looked at first.

    What lacks falls nearly linearly with the logarithm of the mass, with a slope between a half and one: regula falsi.
    """
    heavy, surplus, best = float(np.log(_mass(dampers))), lack, dampers
    light, shortage, bottom = None, 0.0, float(np.log(smallest))
    for step in range(30):
        if surplus > -2e-3 or heavy <= bottom or (light is not None and heavy - light < 1e-3):
            break
        if step == 0 and first is not None:
            middle = min(float(np.log(first)), heavy)
        elif light is None:
            middle = heavy + surplus / 0.6
        else:
            share = np.clip(shortage / (shortage - surplus), 0.1, 0.9)
            # A little to the heavy side: it is from there that dampers come.
            middle = light + (heavy - light) * share + 5e-4
        middle = max(float(middle), bottom)
        lighter, lack = tune(float(np.exp(middle)), best)
        if lack <= 0.0:
            heavy, surplus, best = middle, lack, lighter
        else:
            light, shortage = middle, lack
    return best


def _mass(dampers: tuple[TunedMass, ...]) -> float:
    return sum(each.mass_ratio for each in dampers)


def _stroke_decides(draws: TuningDraws, dampers: tuple[TunedMass, ...], risk: float) -> bool:
    """Whether of stroke and risk the stroke is at its limit, or nearer to it."""
    if draws.largest_stroke is None:
        return False
    *lacking, stroke = draws.shortages(dampers, risk)
    return bool(stroke > np.log(0.99) or stroke > max(lacking))


def _why_not(draws: TuningDraws, dampers: tuple[TunedMass, ...], risk: float, largest: float) -> str:
    """What stands in the way of the heaviest dampers."""
    never = float(np.mean(np.isinf(draws.needed)))
    if never > risk:
        return f"not achievable with any damper: {100.0 * never:.3g} % of the draws exceed it at critical damping"
    risks = [draws.probability(dampers, error) for error in draws.errors]
    left = ["the risk"] if max(risks) > risk else []
    if draws.largest_stroke is not None and draws.outcome(dampers).stroke_high > draws.largest_stroke:
        left.append("the stroke")
    # How much is left is told beside it, of draws that neither tuned nor checked: two numbers for one were confusing.
    what = (
        f"neither {' nor '.join(left)} is kept" if len(left) > 1 else f"{left[0] if left else 'the risk'} is not kept"
    )
    return f"not achievable with a mass ratio up to {100.0 * largest:g} %: {what}"
