"""Records left out: what the others say of them, and how well they are predicted."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from scruton.arrays import FloatArray
from scruton.gap.data import GapData
from scruton.gap.density import NormalPosterior, density, posterior_at_mode, posterior_without
from scruton.gap.hypothesis import FittedHypothesis


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
