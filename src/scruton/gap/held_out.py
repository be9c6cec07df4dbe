"""Records left out, or amplitudes of the only one: what the rest says of them, and how well they are predicted."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from scruton.arrays import FloatArray
from scruton.gap.data import GapData
from scruton.gap.density import NormalPosterior, density, posterior_at_mode, posterior_without, told_by
from scruton.gap.hypothesis import FittedHypothesis
from scruton.gap.stated import clear
from scruton.gap.thresholds import FEWEST_OF_A_HALF, LEAST_SPAN_OF_HALVES


def folds(data: GapData) -> list[tuple[np.ndarray, bool]]:
    """Groups of records that make up the campaign, and whether each is left out in turn."""
    layout = data.layout
    tests = np.unique(layout.test[layout.wind])
    count = len(layout.records)
    if tests.size > 1:
        every = [(layout.test == j, True) for j in tests]
        return every + [(~layout.wind & (layout.rig == i), False) for i in np.unique(layout.rig[~layout.wind])]
    wind = layout.wind if tests.size else np.ones(count, dtype=bool)
    return [(np.arange(count) == r, bool(wind[r]) and count > 1) for r in range(count)]


def halves(data: GapData) -> tuple[np.ndarray, ...]:
    """Of a campaign of one record its large amplitudes and its small ones, two masks of its cycles, (N,) of bool each.

    It is cut in time, where the amplitude passes the middle of its range in the logarithm.  There are none of several
    records, of which one can be left out, or where so much of one holds no transient.
    """
    channels = data.channels
    seen = clear(channels)
    if len(data.layout.records) > 1 or np.count_nonzero(seen) < 2 * FEWEST_OF_A_HALF:
        return ()
    low, high = np.min(channels.amplitude[seen]), np.max(channels.amplitude)
    above = np.where(channels.amplitude >= np.sqrt(low * high), 1, -1)
    at = int(np.argmax(np.abs(2 * np.cumsum(above) - above.sum())))  # most lie above on one side, below on the other
    first = np.arange(channels.size) <= at
    parts = (first, ~first) if above[first].sum() > 0 else (~first, first)
    spans = high >= LEAST_SPAN_OF_HALVES * low
    return parts if spans and all(np.count_nonzero(seen & part) >= FEWEST_OF_A_HALF for part in parts) else ()


def without(model: FittedHypothesis, cycles: np.ndarray) -> FloatArray:
    """Where the coordinates of a model come to lie, (d,), if some cycles, (N,) of bool, are left out."""
    return told_by(model.hypothesis, ~cycles).fit(model.mode).mode


def left_out(model: FittedHypothesis, fold: np.ndarray) -> tuple[NormalPosterior, FloatArray, float]:
    """What the other records say, the density of those left out, (R,), and what a right model would lose in all."""
    known = posterior_without(model, fold)
    scored = density(known, fold)
    prior = posterior_at_mode(model, fold).covariance[np.ix_(scored.where, scored.where)]
    free = np.diag(prior) > 0.0
    alone = np.eye(int(free.sum())) + scored.information[np.ix_(free, free)] @ prior[np.ix_(free, free)]
    cost = scored.learnt - 0.5 * float(np.linalg.slogdet(alone)[1])
    return known, np.where(fold, scored.shares, 0.0), cost


def predicts_better(one: FittedHypothesis, other: FittedHypothesis, *, workers: int = 2) -> bool | None:
    """Whether the density of all records that can be left out is higher under one hypothesis; None without any."""
    held = [fold for fold, out in folds(one.hypothesis.data) if out]
    if not held:
        return None
    with ThreadPoolExecutor(workers) as pool:
        jobs = [[pool.submit(left_out, model, fold) for fold in held] for model in (one, other)]
        first, second = (sum(float(job.result()[1].sum()) for job in each) for each in jobs)
    return first > second
