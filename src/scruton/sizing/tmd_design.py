"""The lightest tuned mass damper that keeps the risk of too large a vibration low.

The risk is taken over joint draws of whatever is uncertain: the Griffin curve, the damping of the bridge, its frequency
and modal mass, and what the damper turns out to be.  A damper is tuned once, so its tuning has to be robust against
all of that, and the risk is kept at an error of the frequency of 2 % either way, too.

The amplitude comes in to `design` as a function of the added damping, draw by draw, so it knows neither law nor bridge;
`scruton.sizing.dampers` brings it the mode of a bridge.
"""

from dataclasses import dataclass, replace

import numpy as np

from scruton.errors import InputError
from scruton.sizing.tmd import TunedMass, positive
from scruton.sizing.tmd_draws import Outcome
from scruton.sizing.tmd_tuning import TuningDraws

DETUNINGS = (-0.05, -0.02, 0.02, 0.05)
_LIGHTEST = 1e-6  # mass ratio below which no search goes


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
        if near:
            dampers, lack = draws.tune(sum(each.mass_ratio for each in near), risk, near)
        if not near or lack > 0.0:
            dampers, lack = draws.tune(largest_mass_ratio, risk)
        achievable = not lack > 0.0
        if achievable:
            dampers = _lightest(draws, dampers, lack, risk, (smallest, largest_mass_ratio))
            stroke, largest = draws.outcome(dampers).stroke_high, draws.largest_stroke
            by_stroke = largest is not None and stroke > 0.99 * largest
            reason = f"the {'stroke' if by_stroke else 'risk'} decides on the mass"
            if (total := sum(each.mass_ratio for each in dampers)) < 1.01 * smallest:
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


def _lightest(
    draws: TuningDraws, dampers: tuple[TunedMass, ...], lack: float, risk: float, mass_ratios: tuple[float, float]
) -> tuple[TunedMass, ...]:
    """Lighten dampers that keep the limits until they just do.

    What lacks falls nearly linearly with the logarithm of the mass, with a slope between a half and one: regula falsi.
    """
    heavy, surplus, best = float(np.log(sum(d.mass_ratio for d in dampers))), lack, dampers
    light, shortage, bottom = None, 0.0, float(np.log(mass_ratios[0]))
    for _ in range(30):
        if surplus > -2e-3 or heavy <= bottom or (light is not None and heavy - light < 1e-3):
            break
        if light is None:
            middle = heavy + surplus / 0.6
        else:
            share = np.clip(shortage / (shortage - surplus), 0.1, 0.9)
            # A little to the heavy side: it is from there that dampers come.
            middle = light + (heavy - light) * share + 5e-4
        middle = max(float(middle), bottom)
        lighter, lack = draws.tune(float(np.exp(middle)), risk, best)
        if lack <= 0.0:
            heavy, surplus, best = middle, lack, lighter
        else:
            light, shortage = middle, lack
    # Tuning reads a table; the answer must hold without it.
    for step in range(60):
        if draws.keeps(best, risk):
            return best
        best = tuple(replace(each, mass_ratio=(1.0 + 0.002 * (step + 1)) * each.mass_ratio) for each in best)
    raise InputError("damper", "amplitude", "an amplitude that rises with damping", "one that never does")


def _why_not(draws: TuningDraws, dampers: tuple[TunedMass, ...], risk: float, largest: float) -> str:
    """What stands in the way of the heaviest dampers."""
    never = float(np.mean(np.isinf(draws.needed)))
    if never > risk:
        return f"not achievable with any damper: {100.0 * never:.3g} % of the draws exceed it at critical damping"
    outcome = draws.outcome(dampers)
    left = [f"a risk of {outcome.probability:.2g}"] if outcome.probability > risk else []
    if draws.largest_stroke is not None and outcome.stroke_high > draws.largest_stroke:
        left.append(f"a stroke of {outcome.stroke_high:.2g} m")
    return f"not achievable with a mass ratio up to {100.0 * largest:g} %: {' and '.join(left)} left at best"
