"""The tuned mass dampers of one mode of a bridge: from the posterior of the section to what can be ordered."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scruton.arrays import BoolArray, FloatArray
from scruton.shown import fields_in_brief, shown
from scruton.sizing.bridge import Cost
from scruton.sizing.damper_request import DamperRequest, Delivered, delivered
from scruton.sizing.model import Draws, ModeModel, Spread, unit_cube
from scruton.sizing.thresholds import COST_RESOLVED, MODAL_MASS_COV, RISK_MARGIN, STROKE_TOLERANCE
from scruton.sizing.tmd import TunedMass
from scruton.sizing.tmd_design import BuiltDamper, Design, Detuned, design
from scruton.sizing.tmd_draws import DamperDraws, Reality, frequency_power
from scruton.sizing.tmd_real import Flaws
from scruton.sizing.tmd_tuning import TuningDraws

TUNING_DRAWS, CHECK_DRAWS = 1 << 11, 1 << 15
_CORRECTIONS = 4
_LEAST_RISK = 0.5 / CHECK_DRAWS  # that is aimed at: none of the draws exceeds the limit
_LIGHTER, _HEAVIER = 5, 3  # masses that are looked at, from a tenth of the dampers' to theirs and on to three times
_COST_POINTS = 12  # more masses at the most, about that of least cost
_STEP = 1.02  # of the mass, once it is a matter of little


@dataclass(frozen=True)
class Asked:
    """What was asked of the dampers and what they were taken to be, as of `scruton.sizing.damper_request`."""

    risk: float
    number: int
    largest_mass_ratio: float
    largest_stroke: float | None
    risk_of: str = "mode"
    smallest_mass_ratio: float = 0.0
    kept_detuning: float = 0.0
    frequency_tolerance: float = 0.0
    damping_tolerance: float = 0.0
    mass_tolerance: float = 0.0
    temperature_detuning: float = 0.0
    start_acceleration: float = 0.0
    end_stop: float | None = None
    stop_stiffness: float | None = None


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class MassMap:
    """Risk and stroke of the best tuned dampers against their mass, (M,) arrays.

    Attributes
    ----------
    mass_ratio, mass : (M,) array
        Of all dampers together, the second [kg], where the mode's is stated.
    probability : (M,) array
        Of exceeding the limit, on draws that neither tuned nor checked.
    stroke, stroke_high, added_damping : (M,) array
        Median and 95 % quantile [m], and the median.
    """

    mass_ratio: FloatArray
    mass: FloatArray | None
    probability: FloatArray
    stroke: FloatArray
    stroke_high: FloatArray
    added_damping: FloatArray

    def allowed(self, asked: Asked) -> BoolArray:
        """Whether dampers of each mass are within the mass ratios and the stroke that were asked for, (M,)."""
        smallest, largest = _mass_ratios(asked)
        within = (self.mass_ratio <= largest) & (self.mass_ratio >= (1.0 - 1e-9) * smallest)
        if asked.largest_stroke is not None:
            within &= self.stroke_high <= (1.0 + STROKE_TOLERANCE) * asked.largest_stroke
        return np.asarray(within)


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class Damper:
    """The lightest tuned mass dampers of one mode, and what they leave.

    Attributes
    ----------
    position : float
        Fraction of the span where they stand; the first of `positions`.
    achievable, reason, dampers, detuned
        As of `scruton.sizing.tmd_design.Design`.
    mass_ratio, mass, probability
        As of `MassMap`; the probability on draws that neither tuned nor checked.
    added_damping, stroke : Spread
        In the limit cycle; the largest relative stroke [m].
    positions : tuple of float
        Of every damper.
    probability_worst : float or None
        Where friction or end stops count: of any limit cycle beyond the limit, also one that growth does not lead to.
    struck : float or None
        Probability that the dampers strike their end stops, where they have some.
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
    positions: tuple[float, ...] | None = None
    probability_worst: float | None = None
    struck: float | None = None


def damper(model: ModeModel, limit: float, seed: int, *, risk: float | None = None) -> Damper:
    """Tune the lightest dampers that keep a mode's amplitude below a limit [m] or [rad], and those of other masses.

    `risk` is that of this mode alone, where it is not the one that the bridge asks for.
    """
    request, mode = model.bridge.damper, model.mode
    positions, asked_risk = model.damper_positions, risk or request.risk
    shape = shapes(model, positions)
    stroke, kept = request.largest_stroke, request.kept_detuning

    def over(count: int, place: int) -> tuple[Draws, Reality]:
        draws = model.draws(unit_cube(count, seed + place))
        return draws, reality(model, draws, delivered(request, shape.size, count, seed + place), seed + place)

    (tuned, real), checked, told = over(TUNING_DRAWS, 4), over(CHECK_DRAWS, 5), over(CHECK_DRAWS, 14)
    tuning = TuningDraws(tuned.amplitude, limit, tuned.detuning, shape.size, shape, stroke, real, kept)
    check, fresh = (DamperDraws(draws.amplitude, limit, draws.detuning, shape, real) for draws, real in (checked, told))

    # A design is best for the draws that it was made with: on others it leaves more.  It is held to the risk on draws
    # that check it, less what those may err by; what is told is of a third set.
    most = max(asked_risk - RISK_MARGIN * float(np.sqrt(asked_risk * (1.0 - asked_risk) / CHECK_DRAWS)), 0.0)

    def left_by(dampers: tuple[TunedMass, ...]) -> float:
        return max(check.probability(dampers, error) for error in (tuning.errors if dampers else (None,)))

    asked, ratios = _asked(model, asked_risk), _mass_ratios(request)
    aim, found = max(most, _LEAST_RISK), None
    for _ in range(_CORRECTIONS):
        found = design(
            tuning, risk=aim, frequency=mode.frequency.mean, modal_mass=mode.modal_mass, mass_ratios=ratios,
            near=found.dampers if found else (),
        )  # fmt: skip
        left = left_by(found.dampers)
        if left <= most or not found.achievable:
            break
        aim = max(aim * most / left, _LEAST_RISK)
    assert found is not None
    if found.achievable:
        found = _until_kept(found, lambda dampers: left_by(dampers) <= most, ratios[1])
    total = sum(each.mass_ratio for each in found.dampers)
    scale = None if mode.modal_mass is None else mode.modal_mass / np.sum(shape**2) * shape.size
    tuned_at: dict[float, tuple[TunedMass, ...]] = {total: found.dampers} if found.dampers else {}
    told_of: dict[float, tuple[float, ...]] = {}

    def chart(ratios: FloatArray) -> MassMap:
        """What the best dampers of these masses leave, and those that were found, which are of the chart."""
        for ratio in map(float, ratios):
            if ratio not in tuned_at:
                near = min(tuned_at, key=lambda other: abs(np.log(other / ratio)), default=None)
                tuned_at[ratio] = tuning.best(ratio, aim, () if near is None else tuned_at[near])
        for ratio in tuned_at.keys() - told_of.keys():
            one = tuning.outcome(tuned_at[ratio])
            left = fresh.probability(tuned_at[ratio])
            told_of[ratio] = left, one.stroke, one.stroke_high, one.added_damping
        columns = np.array([(ratio, *told_of[ratio]) for ratio in sorted(told_of)]).T
        return MassMap(columns[0], None if scale is None else columns[0] * scale, *columns[1:])

    ends = max(0.1 * total, 2e-4), min(max(3.0 * total, 2e-3), 0.1)
    about = total if ends[0] < total < ends[1] else float(np.sqrt(ends[0] * ends[1]))
    masses = chart(np.unique([*np.geomspace(ends[0], about, _LIGHTER), *np.geomspace(about, ends[1], _HEAVIER)]))
    for _ in range(_COST_POINTS):
        between = cheaper_between(model.bridge.cost, masses, asked, fresh.probability(()))
        if between is None:
            break
        masses = chart(np.array([between]))
    outcome = tuning.outcome(found.dampers)
    detuned = tuple(
        Detuned(each.detuning, fresh.probability(found.dampers, each.detuning), each.stroke, each.stroke_high)
        for each in found.detuned
    )
    left, worst = fresh.probability(found.dampers), None
    if found.dampers and not real.flaws.none:
        # what counts beside the growing ones, draw by draw: over draws of their own the two could not be compared
        worst = left + max(tuning.probability_worst(found.dampers) - tuning.probability(found.dampers), 0.0)
    return Damper(
        asked, positions[0], found.achievable, found.reason, found.dampers, total,
        None if scale is None else total * scale, left,
        Spread(outcome.added_damping, low=outcome.added_damping_low), Spread(outcome.stroke, high=outcome.stroke_high),
        detuned, masses, positions, worst, None if request.end_stop is None else outcome.struck,
    )  # fmt: skip


def cheaper_between(cost: Cost | None, chart: MassMap, asked: Asked, without: float) -> float | None:
    """Mass ratio to look at next for the least expected cost; None where none can be noticeably less than the chart's.

    Notes
    -----
    The risk falls with the mass, so between two masses nothing costs less than the lighter with the risk of the
    heavier: the pair with the least of that is halved.
    """
    if cost is None or chart.mass is None or not (cost.per_kg > 0.0 and cost.failure > 0.0):
        return None
    per_ratio, allowed = cost.per_kg * chart.mass[-1] / chart.mass_ratio[-1], chart.allowed(asked)
    total = cost.fixed + per_ratio * chart.mass_ratio + cost.failure * chart.probability
    best = min([cost.failure * without, *total[allowed]])
    smallest, largest = _mass_ratios(asked)
    low, high = np.maximum(chart.mass_ratio[:-1], smallest), np.minimum(chart.mass_ratio[1:], largest)
    least = cost.fixed + per_ratio * low + cost.failure * chart.probability[1:]
    least = np.where((high > low) & allowed[1:], least, np.inf)
    place = int(np.argmin(least))
    return float(np.sqrt(low[place] * high[place])) if least[place] < (1.0 - COST_RESOLVED) * best else None


def _mass_ratios(asked: Asked | DamperRequest) -> tuple[float, float]:
    """The smallest and the largest that is allowed."""
    return min(asked.smallest_mass_ratio, asked.largest_mass_ratio), asked.largest_mass_ratio


def struck_flag(name: str, found: Damper) -> list[str]:
    """What has to be said where vibrations reach the end stops, as they are or from above."""
    worse = (found.probability_worst or 0.0) > found.probability
    if found.struck is None or not (found.struck or worse):
        return []
    above = "; a vibration from above may stay on them in more" if worse else ""
    return [
        f"mode {name}: the dampers strike their end stops in {found.struck:.2%} of the draws{above}. What stops do is "
        "by harmonic balance, which is off by more than 3 % in one case of five and by 23 % at the worst: integrate "
        "the equations of motion before such a damper is ordered"
    ]


def withheld(model: ModeModel, reason: str) -> Damper:
    """No damper, where nothing may be built on the fit, and why."""
    none, empty = Spread(np.nan), np.zeros(0)
    return Damper(
        _asked(model, model.bridge.damper.risk), model.damper_positions[0], False, reason, (), 0.0, None, np.nan, none,
        none, (), MassMap(empty, None, empty, empty, empty, empty),
    )  # fmt: skip


def _asked(model: ModeModel, risk: float) -> Asked:
    request = model.bridge.damper
    asked = {key: getattr(request, key) for key in Asked.__dataclass_fields__ if key not in ("risk", "number")}
    return Asked(risk, len(model.damper_positions), **asked)


def shapes(model: ModeModel, positions: Sequence[float]) -> FloatArray:
    """Movement of dampers at these fractions of the span, over the mode's largest: times the lever arm for torsion."""
    return np.array([abs(model.mode.shape.at(position)) * model.lever_arm for position in positions])


def reality(model: ModeModel, draws: Draws, made: Delivered, seed: int) -> Reality:
    """What dampers are to a mode: as delivered, over a modal mass that is uncertain, with friction and end stops."""
    request, mode = model.bridge.damper, model.mode
    flaws = Flaws(
        request.start_acceleration / (2.0 * np.pi * mode.frequency.mean) ** 2,
        np.inf if request.end_stop is None else request.end_stop,
        request.stop_stiffness,
    )
    if mode.modal_mass_cov is None and mode.mass is not None and not mode.mass.certain:
        modal = draws.factor / np.mean(draws.factor)  # the Scruton number goes with the mass
    else:
        spread = MODAL_MASS_COV if mode.modal_mass_cov is None else mode.modal_mass_cov
        modal = np.exp(spread * np.random.default_rng([seed, 0x3A55]).standard_normal(len(draws)))
    return Reality(made.frequency, made.damping, made.mass / modal, flaws, frequency_power(draws.curve.n))


def _until_kept(found: Design, kept: Callable[[tuple[BuiltDamper, ...]], bool], largest: float) -> Design:
    """Add mass, a little at a time, until the risk is kept, or the largest mass ratio is reached."""
    while not kept(found.dampers):
        factor = min(_STEP, largest / sum(each.mass_ratio for each in found.dampers))
        if factor < 1.0 + 1e-9:
            short = f"not achievable with a mass ratio up to {100.0 * largest:g} % on draws that it was not tuned with"
            return replace(found, achievable=False, reason=short)
        found = replace(found, dampers=tuple(each.heavier(factor) for each in found.dampers))
    return found
