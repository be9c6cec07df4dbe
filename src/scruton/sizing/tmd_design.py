"""The lightest tuned mass damper that keeps the risk of too large a vibration low.

The risk is taken over joint draws of whatever is uncertain: the Griffin curve, the damping of the bridge, and its
frequency.  A damper is tuned once, so that last one is what its tuning has to be robust against.

The amplitude comes in to `design` as a function of the added damping, draw by draw, so it knows neither law nor bridge;
`damper` brings it the mode of a bridge.
"""

from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.errors import InputError
from scruton.sizing.model import ModeModel, Spread, unit_cube
from scruton.sizing.thresholds import RISK_TOLERANCE
from scruton.sizing.tmd import TunedMass, positive, response
from scruton.sizing.tmd_tuning import Outcome, TuningDraws

DETUNINGS = (-0.05, -0.02, 0.02, 0.05)
DAMPER_DRAWS, CHECK_DRAWS = 1 << 12, 1 << 15
_CORRECTIONS, _MAP_POINTS = 4, 7
_LIGHTEST = 1e-6  # mass ratio below which no search goes


@dataclass(frozen=True)
class Detuned:
    """What a design leaves when the frequency of the bridge is off by a known amount, the rest as uncertain as before.

    Attributes
    ----------
    detuning : float
        True frequency over the nominal one, less 1.
    probability, stroke, stroke_high : float
        As of `scruton.sizing.tmd_tuning.Outcome`.
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

    dampers: tuple[TunedMass, ...] = ()
    achievable, reason = True, "no damper is needed"
    if draws.outcome(()).probability > risk:
        dampers, lack = draws.tune(largest_mass_ratio, risk)
        achievable = not lack > 0.0
        if achievable:
            dampers = _lightest(draws, dampers, lack, risk)
            stroke, largest = draws.outcome(dampers).stroke_high, draws.largest_stroke
            by_stroke = largest is not None and stroke > 0.99 * largest
            reason = f"the {'stroke' if by_stroke else 'risk'} decides on the mass"
        else:
            # The draw that decides at this risk may be out of reach for all: what is left to seek is the least risk.
            dampers = dampers if draws.largest_stroke is not None else draws.least_risk(largest_mass_ratio)
            reason = _why_not(draws, dampers, risk, largest_mass_ratio)
    built = []
    for tuned in dampers:
        natural, mass, spring, dashpot = tuned.frequency_ratio * frequency, None, None, None
        if scale is not None:
            mass, omega = tuned.mass_ratio * scale, 2.0 * np.pi * frequency * tuned.frequency_ratio
            spring, dashpot = mass * omega**2, 2.0 * tuned.damping_ratio * mass * omega
        built.append(BuiltDamper(**vars(tuned), frequency=natural, mass=mass, spring=spring, dashpot=dashpot))
    off = [draws.outcome(dampers, error) for error in DETUNINGS]
    detuned = [Detuned(e, o.probability, o.stroke, o.stroke_high) for e, o in zip(DETUNINGS, off, strict=True)]
    return Design(tuple(built), draws.outcome(dampers), tuple(detuned), achievable, reason)


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
        lighter, lack = draws.tune(float(np.exp(middle)), risk, best)
        if lack <= 0.0:
            heavy, surplus, best = middle, lack, lighter
        else:
            light, shortage = middle, lack
    # Tuning reads a table; the answer must hold without it.
    for _ in range(20):
        outcome, largest = draws.outcome(best), draws.largest_stroke
        if outcome.probability <= risk and (largest is None or outcome.stroke_high <= largest):
            return best
        best = tuple(TunedMass(1.002 * d.mass_ratio, d.frequency_ratio, d.damping_ratio) for d in best)
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


@dataclass(frozen=True)
class Asked:
    """What was asked of the dampers, as of `scruton.sizing.bridge.DamperRequest`."""

    risk: float
    number: int
    largest_mass_ratio: float
    largest_stroke: float | None


@dataclass(frozen=True, eq=False)
class MassMap:
    """Risk and stroke of the best tuned dampers against their mass, (M,) arrays.

    Attributes
    ----------
    mass_ratio, mass : (M,) array
        Of all dampers together, the second [kg], where the mode's is stated.
    probability : (M,) array
        Of exceeding the limit, on draws that the dampers were not tuned with.
    stroke, stroke_high, added_damping : (M,) array
        Median and 95 % quantile [m], and the median.
    """

    mass_ratio: FloatArray
    mass: FloatArray | None
    probability: FloatArray
    stroke: FloatArray
    stroke_high: FloatArray
    added_damping: FloatArray


@dataclass(frozen=True, eq=False)
class Damper:
    """The lightest tuned mass dampers of one mode, and what they leave.

    Attributes
    ----------
    position : float
        Fraction of the span where they stand.
    achievable, reason, dampers, detuned
        As of `Design`.
    mass_ratio, mass, probability
        As of `MassMap`.
    added_damping, stroke : Spread
        In the limit cycle; the largest relative stroke [m].
    """

    asked: Asked
    position: float
    achievable: bool
    reason: str
    dampers: tuple[BuiltDamper, ...]
    mass_ratio: float
    mass: float | None
    probability: float
    added_damping: Spread
    stroke: Spread
    detuned: tuple[Detuned, ...]
    map: MassMap


def damper(model: ModeModel, limit: float, seed: int) -> Damper:
    """Tune the lightest dampers that keep a mode's amplitude below a limit [m] or [rad], and those of other masses."""
    request, mode = model.bridge.damper, model.mode
    shape = abs(mode.shape.at(model.damper_position)) * model.lever_arm
    draws, fresh = model.draws(unit_cube(DAMPER_DRAWS, seed + 4)), model.draws(unit_cube(CHECK_DRAWS, seed + 5))
    needed = fresh.needed(limit)

    def left_by(dampers: tuple[TunedMass, ...]) -> float:
        added = response(dampers, fresh.detuning).added_damping if dampers else 0.0
        return float(np.mean(needed > added))

    tuning = TuningDraws(
        draws.amplitude, limit, draws.detuning, request.number, shape, largest_stroke=request.largest_stroke
    )
    # A design is best for the draws that it was made with: on fresh ones it leaves more risk than was asked for.
    aim = request.risk
    for _ in range(_CORRECTIONS):
        lightest = design(
            tuning, risk=aim, frequency=mode.frequency.mean, modal_mass=mode.modal_mass,
            largest_mass_ratio=request.largest_mass_ratio,
        )  # fmt: skip
        left = left_by(lightest.dampers)
        if left <= RISK_TOLERANCE * request.risk or not lightest.achievable:
            break
        aim *= request.risk / left
    total = sum(each.mass_ratio for each in lightest.dampers)
    ratios = np.geomspace(max(0.1 * total, 2e-4), min(max(3.0 * total, 2e-3), 0.1), _MAP_POINTS)
    if total > 0.0:
        ratios = np.unique(np.append(ratios, total))
    tuned = [tuning.least_risk(float(ratio)) for ratio in ratios]
    outcomes = [tuning.outcome(dampers) for dampers in tuned]
    columns = np.array([(result.stroke, result.stroke_high, result.added_damping) for result in outcomes]).T
    mass = masses = None
    if mode.modal_mass is not None:
        scale = mode.modal_mass / shape**2
        mass, masses = total * scale, ratios * scale
    outcome = lightest.outcome
    return Damper(
        Asked(request.risk, request.number, request.largest_mass_ratio, request.largest_stroke),
        model.damper_position, lightest.achievable, lightest.reason, lightest.dampers, total, mass, left,
        Spread(outcome.added_damping, low=outcome.added_damping_low), Spread(outcome.stroke, high=outcome.stroke_high),
        lightest.detuned, MassMap(ratios, masses, np.array([left_by(dampers) for dampers in tuned]), *columns),
    )  # fmt: skip


def withheld(model: ModeModel, reason: str) -> Damper:
    """No damper, where nothing may be built on the fit, and why."""
    request, none = model.bridge.damper, Spread(np.nan)
    empty = np.zeros(0)
    return Damper(
        Asked(request.risk, request.number, request.largest_mass_ratio, request.largest_stroke),
        model.damper_position, False, reason, (), 0.0, None, np.nan, none, none, (),
        MassMap(empty, None, empty, empty, empty, empty),
    )  # fmt: skip
