"""Probability of exceeding a limit against added damping, and the added damping that a confidence asks for."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.sizing.model import LAW, SECTION, Draws, ModeModel, unit_cube

CONFIDENCES = (0.50, 0.84, 0.95, 0.99)
LARGEST_ADDED = 0.05  # damping ratio; more cannot be added to a bridge
POINTS = 1 << 15
_CURVES, _INNER = 256, 1024  # of the band: curves of the section, and draws of all else for each
_GRID = 81


@dataclass(frozen=True, eq=False)
class Risk:
    """One mode against one limit.

    Attributes
    ----------
    limit : float
        [m] or [rad].
    added : (K,) array
        Added damping ratio.
    scruton_number : (K,) array
        Median Scruton number there.
    probability : (K,) array
        P(amplitude > limit).
    band : (2, K) array
        5 and 95 % points of that probability over the section's posterior and the laws: what testing could change.
    by_law : mapping
        The same probability under each law alone.
    amplitude : (3, K) array
        5, 50 and 95 % points of the amplitude.
    exceedance : (K,) array
        E[max(A - limit, 0)]; nan where a draw has no stable amplitude.
    required : mapping
        Added damping by confidence; None where more than `LARGEST_ADDED` would be needed.
    needed : (N,) array
        Added damping that brings each draw down to the limit.
    """

    limit: float
    added: FloatArray
    scruton_number: FloatArray
    probability: FloatArray
    band: FloatArray
    by_law: Mapping[str, FloatArray]
    amplitude: FloatArray
    exceedance: FloatArray
    required: Mapping[float, float | None]
    needed: FloatArray

    def text(self, confidence: float) -> str:
        """What is required, in words."""
        value = self.required[confidence]
        if value is None:
            return f"not achievable with added damping up to {100 * LARGEST_ADDED:g} %"
        return "none" if value == 0.0 else f"{100 * value:.3f} %"


def risk(model: ModeModel, limit: float, *, seed: int = 0, points: int = POINTS) -> Risk:
    """Probability of exceeding `limit` [m] or [rad], against added damping.

    Parameters
    ----------
    model : ModeModel
    limit : float
        Above zero.
    seed : int
    points : int
        Draws, a power of two.
    """
    u = unit_cube(points, seed)
    draws = model.draws(u)
    needed = draws.needed(limit)
    found = required(needed)
    top = max(LARGEST_ADDED if one is None else one for one in found.values())
    added = np.linspace(0.0, min(max(1.4 * top, 0.002), LARGEST_ADDED), _GRID)
    few = model.draws(u[: points // 4])
    amplitude = few.amplitude(added[None])
    with np.errstate(invalid="ignore"):
        excess = np.maximum(amplitude - limit, 0.0).mean(axis=0)
        quantiles = np.quantile(amplitude, [0.05, 0.5, 0.95], axis=0, method="inverted_cdf")
    by_law = {}
    for k, label in enumerate(model.laws.labels):
        if model.laws.weights[k] > 1e-6:
            v = u.copy()
            v[:, LAW] = model.laws.weights[:k].sum() + 0.5 * model.laws.weights[k]
            by_law[label] = probability(model.draws(v).needed(limit), added)
    return Risk(
        limit, added, np.median(few.scruton_number(added[None]), axis=0), probability(needed, added),
        _band(model, limit, added, seed), by_law, quantiles, np.where(np.isfinite(excess), excess, np.nan), found,
        needed,
    )  # fmt: skip


def probability(needed: FloatArray, added: FloatArray) -> FloatArray:
    """Fraction of draws that need more than is added."""
    return np.asarray(1.0 - np.searchsorted(np.sort(needed), added, side="right") / needed.size)


def required(needed: FloatArray) -> dict[float, float | None]:
    """Added damping by confidence, from what each draw needs."""
    found: dict[float, float | None] = {}
    for confidence in CONFIDENCES:
        # An order statistic: what is needed may be infinite.
        value = float(np.quantile(needed, confidence, method="inverted_cdf"))
        found[confidence] = max(value, 0.0) if value <= LARGEST_ADDED else None
    return found


def _band(model: ModeModel, limit: float, added: FloatArray, seed: int) -> FloatArray:
    outer, inner = unit_cube(_CURVES, seed + 1), unit_cube(_INNER, seed + 2)
    both = np.tile(inner, (_CURVES, 1))
    for source in (SECTION, LAW):
        both[:, source] = np.repeat(outer[:, source], _INNER)
    needed = np.sort(model.draws(both).needed(limit).reshape(_CURVES, _INNER), axis=1)
    each = np.array([1.0 - np.searchsorted(row, added, side="right") / _INNER for row in needed])
    found: FloatArray = np.quantile(each, [0.05, 0.95], axis=0)
    return found


def flags(model: ModeModel, draws: Draws) -> list[str]:
    """What the reader must know of a mode before trusting its numbers."""
    found = []
    # at the structural damping of the bridge itself: what is added goes further still
    x = np.median((draws.scruton_number(0.0) - draws.curve.reference) / draws.curve.relaxation)
    if abs(x) > 0.3:
        found.append(
            f"mode {model.mode.name}: the bridge's own damping lies {x:.2f} from the tests (extrapolation index): "
            "beyond 0.3 the answer is the law's as much as the records'"
        )
    if draws.table is not None:
        found.append(
            f"mode {model.mode.name}: the amplitude along the span is that of the reference law; the effect in the "
            "curve is not integrated along the span"
        )
    return found
