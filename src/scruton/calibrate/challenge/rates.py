"""Rates with their intervals, medians with theirs, and how well probabilities are calibrated."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binom, binomtest

from scruton.arrays import FloatArray
from scruton.calibrate.thresholds import RELIABILITY_BINS


def wilson(hits: int, trials: int) -> tuple[float, float]:
    """95 % interval of a rate (E. B. Wilson, J. Am. Stat. Assoc. 22, 1927); (0, 1) without trials."""
    if trials == 0:
        return 0.0, 1.0
    interval = binomtest(hits, trials).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)


def median_interval(values: Sequence[float]) -> tuple[float, float]:
    """95 % interval of a median by order statistics, which assumes no distribution; all values if there are few."""
    ordered = np.sort(np.asarray(values, dtype=float))
    n = ordered.size
    if n == 0:
        return np.nan, np.nan
    low = max(int(binom.ppf(0.025, n, 0.5)) - 1, 0)
    return float(ordered[low]), float(ordered[n - 1 - low])


@dataclass(frozen=True, eq=False)
class Reliability:
    """How often verdicts of a probability are right.

    Attributes
    ----------
    probability, accuracy : (B,) arrays
        Means over the bins.
    count : (B,) array
        Cases in each.
    error : float
        Mean distance of the two, weighted by the cases.
    chance : float
        What the error would be on average, were the probabilities right: bins are finite.
    """

    probability: FloatArray
    accuracy: FloatArray
    count: np.ndarray
    error: float
    chance: float


def reliability(probability: Sequence[float], right: Sequence[bool], bins: int = RELIABILITY_BINS) -> Reliability:
    """Sort by probability, cut into bins of equal count, and compare mean probability with accuracy.

    Parameters
    ----------
    probability : (N,) floats
        Of the verdict. Ties keep the order in which they come.
    right : (N,) bools
    bins : int
        Fewer if there are fewer cases.
    """
    p, hit = np.asarray(probability, dtype=float), np.asarray(right, dtype=float)
    if p.size == 0:
        empty = np.zeros(0)
        return Reliability(empty, empty, np.zeros(0, dtype=int), np.nan, np.nan)
    parts = np.array_split(np.argsort(p, kind="stable"), min(bins, p.size))
    count = np.array([part.size for part in parts])
    mean_p = np.array([p[part].mean() for part in parts])
    accuracy = np.array([hit[part].mean() for part in parts])
    spread = np.array([np.sqrt(np.sum(p[part] * (1.0 - p[part]))) / part.size for part in parts])
    error, chance = np.abs(mean_p - accuracy), np.sqrt(2.0 / np.pi) * spread
    return Reliability(mean_p, accuracy, count, *(float(np.sum(count * one) / p.size) for one in (error, chance)))
