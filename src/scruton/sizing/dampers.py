"""The tuned mass dampers of one mode of a bridge: from the posterior of the section to what can be ordered."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scruton.arrays import FloatArray
from scruton.shown import fields_in_brief, shown
from scruton.sizing.damper_request import Delivered, delivered
from scruton.sizing.model import Draws, ModeModel, Spread, unit_cube
from scruton.sizing.thresholds import MODAL_MASS_COV, RISK_MARGIN
from scruton.sizing.tmd import TunedMass
from scruton.sizing.tmd_design import BuiltDamper, Design, Detuned, design
from scruton.sizing.tmd_draws import DamperDraws, Reality, frequency_power
from scruton.sizing.tmd_real import Flaws
from scruton.sizing.tmd_tuning import TuningDraws

TUNING_DRAWS, CHECK_DRAWS = 1 << 11, 1 << 15
_CORRECTIONS, _MAP_POINTS = 4, 7
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
    most = asked_risk - RISK_MARGIN * float(np.sqrt(asked_risk * (1.0 - asked_risk) / CHECK_DRAWS))

    def left_by(dampers: tuple[TunedMass, ...]) -> float:
        return max(check.probability(dampers, error) for error in (tuning.errors if dampers else (None,)))

    ratios = (min(request.smallest_mass_ratio, request.largest_mass_ratio), request.largest_mass_ratio)
    aim, found = most, None
    for _ in range(_CORRECTIONS):
        found = design(
            tuning, risk=aim, frequency=mode.frequency.mean, modal_mass=mode.modal_mass, mass_ratios=ratios,
            near=found.dampers if found else (),
        )  # fmt: skip
        left = left_by(found.dampers)
        if left <= most or not found.achievable:
            break
        aim *= most / left
    assert found is not None
    if found.achievable:
        found = _until_kept(found, lambda dampers: left_by(dampers) <= most, ratios[1])
    total = sum(each.mass_ratio for each in found.dampers)
    mass = masses = None
    chart_ratios = np.geomspace(max(0.1 * total, 2e-4), min(max(3.0 * total, 2e-3), 0.1), _MAP_POINTS)
    if total > 0.0:
        chart_ratios = np.unique(np.append(chart_ratios, total))
    charted: list[tuple[TunedMass, ...]] = []
    last: tuple[TunedMass, ...] = found.dampers
    for ratio in chart_ratios:
        last = tuning.least_risk(float(ratio), last)
        charted.append(last)
    outcomes = [tuning.outcome(dampers) for dampers in charted]
    columns = np.array([(result.stroke, result.stroke_high, result.added_damping) for result in outcomes]).T
    if mode.modal_mass is not None:
        scale = mode.modal_mass / np.sum(shape**2) * shape.size
        mass, masses = total * scale, chart_ratios * scale
    outcome = tuning.outcome(found.dampers)
    detuned = tuple(
        Detuned(each.detuning, fresh.probability(found.dampers, each.detuning), each.stroke, each.stroke_high)
        for each in found.detuned
    )
    worst = None
    if found.dampers and not real.flaws.none:
        worst = tuning.probability_worst(found.dampers)
    return Damper(
        _asked(model, asked_risk), positions[0], found.achievable, found.reason, found.dampers, total,
        mass, fresh.probability(found.dampers), Spread(outcome.added_damping, low=outcome.added_damping_low),
        Spread(outcome.stroke, high=outcome.stroke_high), detuned,
        MassMap(chart_ratios, masses, np.array([check.probability(dampers) for dampers in charted]), *columns),
        positions, worst, None if request.end_stop is None else outcome.struck,
    )  # fmt: skip


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
