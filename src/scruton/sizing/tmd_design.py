"""The lightest tuned mass damper that keeps the risk of too large a vibration low.

The risk is taken over joint draws of whatever is uncertain: the Griffin curve, the damping of the bridge, and its
frequency.  A damper is tuned once, so that last one is what its tuning has to be robust against.

The amplitude comes in as a function of the added damping, draw by draw, so nothing here knows a law or a bridge.
"""

from dataclasses import dataclass

import numpy as np

from scruton.errors import InputError
from scruton.sizing.tmd import TunedMass, positive
from scruton.sizing.tmd_tuning import Outcome, TuningDraws

DETUNINGS = (-0.05, -0.02, 0.02, 0.05)
_LIGHTEST = 1e-6  # mass ratio below which no search goes


@dataclass(frozen=True)
class Detuned:
    """What a design leaves when the frequency of the bridge is off by a known amount, the rest as uncertain as before.

    Attributes
    ----------
    detuning : float
        True frequency over the nominal one, less 1.
    probability : float
        Of exceeding the limit.
    stroke, stroke_high : float
        Median and 95 % quantile [m].
    """

    detuning: float
    probability: float
    stroke: float
    stroke_high: float


@dataclass(frozen=True)
class BuiltDamper(TunedMass):
    """A damper as it is built; None where the mass of the mode is not stated.

    Attributes
    ----------
    frequency : float
        Its own [Hz].
    mass, spring, dashpot : float or None
        [kg], [N/m] and [N s/m].
    """

    frequency: float
    mass: float | None
    spring: float | None
    dashpot: float | None


@dataclass(frozen=True)
class Design:
    """A set of dampers and what it leaves.

    Attributes
    ----------
    dampers : tuple of BuiltDamper
        Ratios to the nominal frequency; empty where none is needed.
    outcome : Outcome
        Over the draws.
    detuned : tuple of Detuned
        At frequency errors of -5, -2, +2 and +5 %.
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
    largest_mass_ratio: float = 0.05,
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
    largest_mass_ratio : float
        Of all dampers together.

    Raises
    ------
    InputError
        If an argument is out of range.

    Notes
    -----
    The frequency errors are errors of stiffness: the mass ratio does not change with them.  Under the paper's law the
    amplitude is also over g, the frequency of the response over that of the mode (`Response.frequency`), under others
    it is not; here that is left out, which costs up to 5 % of the amplitude at a mass ratio of 1 %.
    """
    positive("frequency", frequency)
    scale = None if modal_mass is None else positive("modal_mass", modal_mass) / draws.shape**2
    if not 0.0 < risk < 1.0:
        raise InputError("damper", "risk", f"{risk:g}", "a probability between 0 and 1, as 0.05")
    positive("largest_mass_ratio", largest_mass_ratio)

    def finish(dampers: tuple[TunedMass, ...], reason: str, achievable: bool = True) -> Design:
        return Design(
            tuple(_built(damper, frequency, scale) for damper in dampers),
            draws.outcome(dampers),
            tuple(_detuned(draws, dampers, error) for error in DETUNINGS),
            achievable,
            reason,
        )

    if draws.outcome(()).probability <= risk:
        return finish((), "no damper is needed")
    dampers, lack = draws.tune(largest_mass_ratio, risk)
    if lack > 0.0:
        # The draw that decides at this risk may be out of reach for all: what is left to seek is the least risk.
        best = dampers if draws.largest_stroke is not None else draws.least_risk(largest_mass_ratio)
        return finish(best, _why_not(draws, best, risk, largest_mass_ratio), achievable=False)
    dampers = _lightest(draws, dampers, lack, risk)
    by_stroke = draws.largest_stroke is not None and draws.outcome(dampers).stroke_high > 0.99 * draws.largest_stroke
    return finish(dampers, f"the {'stroke' if by_stroke else 'risk'} decides on the mass")


def _built(damper: TunedMass, frequency: float, scale: float | None) -> BuiltDamper:
    """A damper of a mode of this frequency [Hz], whose mass is its mass ratio times `scale` [kg]."""
    own = damper.frequency_ratio * frequency
    if scale is None:
        return BuiltDamper(**vars(damper), frequency=own, mass=None, spring=None, dashpot=None)
    mass, omega = damper.mass_ratio * scale, 2.0 * np.pi * frequency * damper.frequency_ratio
    return BuiltDamper(
        **vars(damper), frequency=own, mass=mass, spring=mass * omega**2,
        dashpot=2.0 * damper.damping_ratio * mass * omega,
    )  # fmt: skip


def _lightest(draws: TuningDraws, dampers: tuple[TunedMass, ...], lack: float, risk: float) -> tuple[TunedMass, ...]:
    """Lighten dampers that keep the limits until they just do.

    What lacks falls nearly linearly with the logarithm of the mass, with a slope between a half and one: regula falsi.
    """
    heavy, surplus, best = float(np.log(sum(d.mass_ratio for d in dampers))), lack, dampers
    light, shortage = None, 0.0
    for _ in range(30):
        if surplus > -2e-3 or heavy <= np.log(_LIGHTEST) or (light is not None and heavy - light < 1e-3):
            break
        if light is None:
            middle = heavy + surplus / 0.6
        else:
            share = np.clip(shortage / (shortage - surplus), 0.1, 0.9)
            # A little to the heavy side: it is from there that dampers come.
            middle = light + (heavy - light) * share + 5e-4
        middle = float(max(middle, np.log(_LIGHTEST)))
        found, lack = draws.tune(float(np.exp(middle)), risk, best)
        if lack <= 0.0:
            heavy, surplus, best = middle, lack, found
        else:
            light, shortage = middle, lack
    # Tuning reads a table; the answer must hold without it.
    for _ in range(20):
        if draws.keeps(best, risk):
            return best
        best = tuple(TunedMass(1.002 * d.mass_ratio, d.frequency_ratio, d.damping_ratio) for d in best)
    raise InputError("damper", "amplitude", "an amplitude that rises with damping", "one that never does")


def _detuned(draws: TuningDraws, dampers: tuple[TunedMass, ...], error: float) -> Detuned:
    outcome = draws.outcome(dampers, error)
    return Detuned(error, outcome.probability, outcome.stroke, outcome.stroke_high)


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
