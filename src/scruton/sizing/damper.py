"""The lightest tuned mass damper of a mode, as the bridge asks for it, and mass against risk."""

from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.sizing.model import ModeModel, Spread, unit_cube
from scruton.sizing.thresholds import RISK_TOLERANCE
from scruton.sizing.tmd import TunedMass, response
from scruton.sizing.tmd_design import BuiltDamper, Detuned, design
from scruton.sizing.tmd_tuning import TuningDraws

DAMPER_DRAWS, CHECK_DRAWS = 1 << 12, 1 << 15
_CORRECTIONS = 4
_MAP_POINTS = 7


@dataclass(frozen=True)
class Asked:
    """What was asked of the dampers, as of `scruton.sizing.bridge.DamperRequest`."""

    risk: float
    number: int
    largest_mass_ratio: float
    largest_stroke: float | None


@dataclass(frozen=True, eq=False)
class MassMap:
    """Risk and stroke of the best tuned dampers against their mass.

    Attributes
    ----------
    mass_ratio : (M,) array
        Of all dampers together.
    mass : (M,) array or None
        The same [kg], where the mode's is stated.
    probability : (M,) array
        Of exceeding the limit, on draws that the dampers were not tuned with.
    stroke, stroke_high : (M,) array
        Median and 95 % quantile [m].
    added_damping : (M,) array
        Median.
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
    asked : Asked
    position : float
        Fraction of the span where they stand.
    achievable, reason
        As of `scruton.sizing.tmd_design.Design`.
    dampers : tuple of BuiltDamper
        Empty where none is needed.
    mass_ratio : float
        Of all together.
    mass : float or None
        The same [kg], where the mode's is stated.
    probability : float
        Of exceeding the limit, on draws that the dampers were not tuned with.
    added_damping, stroke : Spread
        In the limit cycle; the largest relative stroke [m].
    detuned : tuple of Detuned
    map : MassMap
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
    request, mode, position = model.bridge.damper, model.mode, model.damper_position
    shape = abs(mode.shape.at(position)) * model.lever_arm
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
    scale = None if mode.modal_mass is None else mode.modal_mass / shape**2
    return Damper(
        Asked(request.risk, request.number, request.largest_mass_ratio, request.largest_stroke),
        position,
        lightest.achievable,
        lightest.reason,
        lightest.dampers,
        total,
        None if scale is None else total * scale,
        left,
        Spread(lightest.outcome.added_damping, low=lightest.outcome.added_damping_low),
        Spread(lightest.outcome.stroke, high=lightest.outcome.stroke_high),
        lightest.detuned,
        MassMap(
            ratios,
            None if scale is None else ratios * scale,
            np.array([left_by(dampers) for dampers in tuned]),
            np.array([outcome.stroke for outcome in outcomes]),
            np.array([outcome.stroke_high for outcome in outcomes]),
            np.array([outcome.added_damping for outcome in outcomes]),
        ),
    )
