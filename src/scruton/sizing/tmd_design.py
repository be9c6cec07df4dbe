"""The lightest tuned mass damper that keeps the risk of too large a vibration low.

The risk is taken over joint draws of whatever is uncertain: the Griffin curve, the damping of the bridge, and its
frequency.  A damper is tuned once, so that last one is what its tuning has to be robust against.

The amplitude comes in as a function of the added damping, draw by draw, so nothing here knows a law or a bridge.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from scruton.arrays import FloatArray
from scruton.errors import InputError
from scruton.sizing.tmd import TunedMass, positive
from scruton.sizing.tmd_tuning import Amplitude, Draws, Outcome

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
class Design:
    """A set of dampers and what it leaves.

    Attributes
    ----------
    dampers : tuple of TunedMass
        Ratios to the nominal frequency; empty where none is needed.
    mass : float
        All dampers together [kg].
    springs, dashpots : tuple of float
        Of each damper [N/m] and [N s/m].
    probability : float
        Of exceeding the limit, over the draws.
    stroke, stroke_high : float
        Median and 95 % quantile of the largest relative stroke among the dampers [m].
    added_damping, added_damping_low : float
        Median and 5 % quantile of the damping ratio that they add in the limit cycle.
    detuned : tuple of Detuned
        At frequency errors of -5, -2, +2 and +5 %.
    achievable : bool
        Whether risk and stroke are kept.  Where they are not, the dampers are the best of the largest mass.
    reason : str
        Why they are not, or what decided on the mass.
    """

    dampers: tuple[TunedMass, ...]
    mass: float
    springs: tuple[float, ...]
    dashpots: tuple[float, ...]
    probability: float
    stroke: float
    stroke_high: float
    added_damping: float
    added_damping_low: float
    detuned: tuple[Detuned, ...]
    achievable: bool
    reason: str


@dataclass(frozen=True)
class MassMap:
    """Risk and stroke of the best tuned dampers against their mass; arrays over the mass ratios.

    Attributes
    ----------
    mass_ratio, probability, stroke, stroke_high, added_damping : (M,) array
        Total mass ratio, risk, median and 95 % quantile of the stroke [m], median of the added damping.
    dampers : tuple of tuple of TunedMass
    """

    mass_ratio: FloatArray
    probability: FloatArray
    stroke: FloatArray
    stroke_high: FloatArray
    added_damping: FloatArray
    dampers: tuple[tuple[TunedMass, ...], ...]


def design(
    amplitude: Amplitude,
    *,
    limit: float,
    risk: float,
    modal_mass: float,
    frequency: float,
    detuning: ArrayLike,
    number: int = 1,
    shape: float = 1.0,
    largest_stroke: float | None = None,
    largest_mass_ratio: float = 0.05,
    damping_range: tuple[float, float] = (0.005, 0.4),
) -> Design:
    """Find the dampers of least mass with P(amplitude > limit) <= risk.

    Parameters
    ----------
    amplitude : callable
        Stable amplitude (S,) [m, or rad with `shape` in m] of every draw at its added damping ratio (S,), where the
        mode shape is one.  More damping must never give more amplitude.
    limit : float
        Unit of the amplitude.
    risk : float
        Between 0 and 1.
    modal_mass : float
        kg (kg m^2 for an amplitude in rad), for a mode shape of one where the amplitude is taken.
    frequency : float
        Nominal frequency of the mode [Hz].
    detuning : (S,) array
        Draws of the relative error of that frequency, joint with those in `amplitude`.
    number : int
        Dampers of equal mass and damping ratio with evenly spread frequencies; the spread is found.
    shape : float
        Mode shape where the dampers hang; for torsion their distance from the axis [m].
    largest_stroke : float, optional
        m, for the 95 % quantile of the stroke.
    largest_mass_ratio : float
        Of all dampers together.
    damping_range : tuple of float
        Damping ratios that a damper can be built with.

    Returns
    -------
    Design

    Raises
    ------
    InputError
        If an argument is out of range, or `amplitude` does not return one number per draw.

    Notes
    -----
    The frequency errors are errors of stiffness: the mass ratio does not change with them.  Under the paper's law the
    amplitude is also over g, the frequency of the response over that of the mode (`Response.frequency`), under others
    it is not; here that is left out, which costs up to 5 % of the amplitude at a mass ratio of 1 %.
    """
    positive("limit", limit)
    scale = positive("modal_mass", modal_mass) / positive("shape", shape) ** 2
    omega = 2.0 * np.pi * positive("frequency", frequency)
    if not 0.0 < risk < 1.0:
        raise InputError("damper", "risk", f"{risk:g}", "a probability between 0 and 1, as 0.05")
    if largest_stroke is not None:
        positive("largest_stroke", largest_stroke)
    positive("largest_mass_ratio", largest_mass_ratio)
    draws = Draws(amplitude, limit, detuning, number, shape, damping_range, largest_stroke)

    def finish(dampers: tuple[TunedMass, ...], reason: str, achievable: bool = True) -> Design:
        outcome = draws.outcome(dampers)
        masses = [damper.mass_ratio * scale for damper in dampers]
        own = [omega * damper.frequency_ratio for damper in dampers]
        return Design(
            dampers,
            float(sum(masses)),
            tuple(m * w**2 for m, w in zip(masses, own, strict=True)),
            tuple(2.0 * d.damping_ratio * m * w for d, m, w in zip(dampers, masses, own, strict=True)),
            outcome.probability, outcome.stroke, outcome.stroke_high, outcome.added, outcome.added_low,
            tuple(_detuned(draws, dampers, error) for error in DETUNINGS),
            achievable,
            reason,
        )  # fmt: skip

    if draws.outcome(()).probability <= risk:
        return finish((), "no damper is needed")
    dampers, lack = draws.tune(largest_mass_ratio, risk)
    if lack > 0.0:
        # The draw that decides at this risk may be out of reach for all: what is left to seek is the least risk.
        best = dampers if largest_stroke is not None else draws.least_risk(largest_mass_ratio)
        return finish(best, _why_not(draws, best, risk, largest_mass_ratio), achievable=False)
    dampers = _lightest(draws, dampers, lack, risk)
    by_stroke = largest_stroke is not None and draws.outcome(dampers).stroke_high > 0.99 * largest_stroke
    return finish(dampers, f"the {'stroke' if by_stroke else 'risk'} decides on the mass")


def mass_map(
    amplitude: Amplitude,
    *,
    limit: float,
    mass_ratios: Sequence[float] | FloatArray,
    detuning: ArrayLike,
    number: int = 1,
    shape: float = 1.0,
    largest_stroke: float | None = None,
    damping_range: tuple[float, float] = (0.005, 0.4),
) -> MassMap:
    """Tune dampers of given mass for the least risk, those that can within the largest stroke.

    Parameters
    ----------
    mass_ratios : (M,) sequence of float
        Of all dampers together.
    amplitude, limit, detuning, number, shape, largest_stroke, damping_range
        As for `design`.

    Returns
    -------
    MassMap
        Dampers too light for the largest stroke are there with the stroke that they have.

    Raises
    ------
    InputError
        As `design`.
    """
    positive("limit", limit)
    positive("shape", shape)
    if largest_stroke is not None:
        positive("largest_stroke", largest_stroke)
    ratios = np.array([positive("mass_ratios", mu) for mu in mass_ratios])
    draws = Draws(amplitude, limit, detuning, number, shape, damping_range, largest_stroke)
    dampers = tuple(draws.least_risk(mu) for mu in ratios)
    results = [draws.outcome(each) for each in dampers]
    return MassMap(
        ratios,
        np.array([r.probability for r in results]),
        np.array([r.stroke for r in results]),
        np.array([r.stroke_high for r in results]),
        np.array([r.added for r in results]),
        dampers,
    )


def _lightest(draws: Draws, dampers: tuple[TunedMass, ...], lack: float, risk: float) -> tuple[TunedMass, ...]:
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


def _detuned(draws: Draws, dampers: tuple[TunedMass, ...], error: float) -> Detuned:
    outcome: Outcome = draws.outcome(dampers, error)
    return Detuned(error, outcome.probability, outcome.stroke, outcome.stroke_high)


def _why_not(draws: Draws, dampers: tuple[TunedMass, ...], risk: float, largest: float) -> str:
    """What stands in the way of the heaviest dampers."""
    never = float(np.mean(np.isinf(draws.needed)))
    if never > risk:
        return f"not achievable with any damper: {100.0 * never:.3g} % of the draws exceed it at critical damping"
    outcome = draws.outcome(dampers)
    left = [f"a risk of {outcome.probability:.2g}"] if outcome.probability > risk else []
    if draws.largest_stroke is not None and outcome.stroke_high > draws.largest_stroke:
        left.append(f"a stroke of {outcome.stroke_high:.2g} m")
    return f"not achievable with a mass ratio up to {100.0 * largest:g} %: {' and '.join(left)} left at best"
