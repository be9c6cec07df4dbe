"""Probability of exceeding a limit against added damping, and the added damping that a confidence asks for."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.griffin.thresholds import X_TRUSTED
from scruton.sizing.limits import Limit
from scruton.sizing.model import LAW, SECTION, Draws, ModeModel, unit_cube
from scruton.sizing.thresholds import LARGEST_ADDED

CONFIDENCES = ("0.50", "0.84", "0.95", "0.99")
POINTS = 1 << 15
_CURVES, _INNER = 256, 1024  # of the band: curves of the section, and draws of all else for each
_GRID = 81


@dataclass(frozen=True, eq=False)
class RiskCurve:
    """One mode against one limit, along the damping ratio that is added.

    Attributes
    ----------
    added_damping : (K,) array
    scruton_number : (K,) array
        Median there.
    probability : (K,) array
        P(amplitude > limit).
    probability_05, probability_95 : (K,) array
        5 and 95 % points of that probability over the section's posterior and the laws: what testing could change.
    by_law : mapping
        The same probability under each law alone.
    amplitude_05, amplitude_50, amplitude_95 : (K,) array
        Points of the amplitude [m] or [rad].
    expected_exceedance : (K,) array
        E[max(A - limit, 0)]; NaN where a draw has no stable amplitude.
    """

    added_damping: FloatArray
    scruton_number: FloatArray
    probability: FloatArray
    probability_05: FloatArray
    probability_95: FloatArray
    by_law: Mapping[str, FloatArray]
    amplitude_05: FloatArray
    amplitude_50: FloatArray
    amplitude_95: FloatArray
    expected_exceedance: FloatArray


@dataclass(frozen=True, eq=False)
class Risk:
    """One mode against one limit.

    Attributes
    ----------
    rule, title, source, confirm : str
        As the user wrote it, and as of `scruton.sizing.limits.rule.Rule`.
    limit : float
        [m] or [rad].
    probability, expected_exceedance : float
        P(amplitude > limit) and E[max(A - limit, 0)] without added damping.
    required : mapping
        Added damping ratio by confidence ("0.95"); None where more than `LARGEST_ADDED` would be needed.
    required_text : mapping
        The same in words.
    curve : RiskCurve
    """

    rule: str
    title: str
    source: str
    confirm: str
    limit: float
    probability: float
    expected_exceedance: float
    required: Mapping[str, float | None]
    required_text: Mapping[str, str]
    curve: RiskCurve


def risk(model: ModeModel, limit: Limit, *, seed: int = 0, points: int = POINTS) -> Risk:
    """Probability of exceeding a limit, against added damping.

    Parameters
    ----------
    model : ModeModel
    limit : Limit
    seed : int
    points : int
        Draws, a power of two.

    Raises
    ------
    InputError
        Where the limit says nothing of this motion.
    """
    bridge, rule = model.bridge, limit.rule
    largest = limit.amplitude(bridge.motion, model.mode.frequency.mean, bridge.width, bridge.depth)
    u = unit_cube(points, seed)
    needed = model.draws(u).needed(largest)
    wanted = required(needed)
    top = max(LARGEST_ADDED if damping is None else damping for damping in wanted.values())
    added = np.linspace(0.0, min(max(1.4 * top, 0.002), LARGEST_ADDED), _GRID)
    few = model.draws(u[: points // 4])
    amplitude = few.amplitude(added[None])
    with np.errstate(invalid="ignore"):
        excess = np.maximum(amplitude - largest, 0.0).mean(axis=0)
        low, middle, high = np.quantile(amplitude, [0.05, 0.5, 0.95], axis=0, method="inverted_cdf")
    by_law = {}
    for k, label in enumerate(model.laws.labels):
        if model.laws.weights[k] > 1e-6:
            v = u.copy()
            v[:, LAW] = model.laws.weights[:k].sum() + 0.5 * model.laws.weights[k]
            by_law[label] = probability(model.draws(v).needed(largest), added)
    curve = RiskCurve(
        added, np.median(few.scruton_number(added[None]), axis=0), probability(needed, added),
        *_band(model, largest, added, seed), by_law, low, middle, high, np.where(np.isfinite(excess), excess, np.nan),
    )  # fmt: skip
    return Risk(
        limit.text, rule.title, rule.source, rule.confirm, largest, float(np.mean(needed > 0.0)),
        float(curve.expected_exceedance[0]), wanted, {name: _text(damping) for name, damping in wanted.items()}, curve,
    )  # fmt: skip


def _text(required: float | None) -> str:
    """What is required, in words."""
    if required is None:
        return f"not achievable with added damping up to {100 * LARGEST_ADDED:g} %"
    return "none" if required == 0.0 else f"{100 * required:.3f} %"


def probability(needed: FloatArray, added: FloatArray) -> FloatArray:
    """Fraction of draws that need more than is added."""
    return np.asarray(1.0 - np.searchsorted(np.sort(needed), added, side="right") / needed.size)


def required(needed: FloatArray) -> dict[str, float | None]:
    """Added damping by confidence, from what each draw needs."""
    # Order statistics: what is needed may be infinite.
    points = np.quantile(needed, [float(name) for name in CONFIDENCES], method="inverted_cdf").tolist()
    return {
        name: max(point, 0.0) if point <= LARGEST_ADDED else None
        for name, point in zip(CONFIDENCES, points, strict=True)
    }


def _band(model: ModeModel, limit: float, added: FloatArray, seed: int) -> tuple[FloatArray, FloatArray]:
    outer, inner = unit_cube(_CURVES, seed + 1), unit_cube(_INNER, seed + 2)
    both = np.tile(inner, (_CURVES, 1))
    for source in (SECTION, LAW):
        both[:, source] = np.repeat(outer[:, source], _INNER)
    needed = np.sort(model.draws(both).needed(limit).reshape(_CURVES, _INNER), axis=1)
    each = np.array([1.0 - np.searchsorted(row, added, side="right") / _INNER for row in needed])
    low, high = np.quantile(each, [0.05, 0.95], axis=0)
    return low, high


def flags(model: ModeModel, draws: Draws) -> list[str]:
    """What the reader must know of a mode before trusting its numbers."""
    remarks = []
    # at the structural damping of the bridge itself: what is added goes further still
    x = np.median((draws.scruton_number(0.0) - draws.curve.reference) / draws.curve.relaxation)
    if abs(x) > X_TRUSTED:
        remarks.append(
            f"mode {model.mode.name}: the bridge's own damping lies {x:.2f} from the tests (extrapolation index): "
            f"beyond {X_TRUSTED:g} the answer is the law's as much as the records'"
        )
    if draws.table is not None:
        remarks.append(
            f"mode {model.mode.name}: the amplitude along the span is that of the reference law; the effect in the "
            "curve is not integrated along the span"
        )
    return remarks
