"""The optimum of a posterior that offers scores: its gradient and Fisher information come with every value.

The information is positive whatever the point, so that scoring with a damped step climbs from anywhere; steps of
several dampings are tried side by side.  Among them is one of a damping of each coordinate's own: where the gradient
turned by more than the information foretold, a full step swings to and fro, and what holds it back need not hold all.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from scruton.arrays import FloatArray

MOST_DAMPED = 1e3  # relative to the information's diagonal: where no step helps any more, the search ends
MOST_BENT = 10.0  # curvature beyond the information, over it, that a single step is believed to tell
TELLS = 0.1  # of the gradient of a coordinate, that a step has to take away to tell its curvature


def climb[Scores: tuple[Any, ...]](
    scores: Callable[[FloatArray], Scores],
    log_prob: Callable[[FloatArray], FloatArray],
    start: FloatArray,
    *,
    limit: Callable[[FloatArray], FloatArray] | None = None,
    free: FloatArray | slice = slice(None),
    tolerance: float = 5e-3,
    enough: float = 0.0,
    iterations: int = 40,
) -> tuple[FloatArray, Scores]:
    """Climb from a point by damped Fisher scoring.

    Parameters
    ----------
    scores : callable
        Value, gradient (k,) and information (k, k) in the free coordinates, and whatever else, at a point (d,).
    log_prob : callable
        Values (W,) at points (W, d).
    start : (d,) array
    limit : callable, optional
        Longest step in each coordinate at a point, (k,); where there is one a very short step is tried, too.
    free : (k,) array of int, optional
        Coordinates that move; all by default.
    tolerance : float
        Gain of a step, in nats, below which it was the last.
    enough : float
        Gain that a full step foretells, below which none is taken; what a short one gains tells nothing of that.
    iterations : int
        At most so many steps.

    Returns
    -------
    point : (d,) array
    scores : tuple
        As `scores` gives them there.
    """
    u, current, damping = start, scores(start), 0.0
    bent = np.zeros(current[1].size)  # curvature beyond the information, over its diagonal
    for _ in range(iterations):
        value, gradient, information = current[:3]
        ridge = np.diag(np.diag(information))
        dampings = (damping, 10.0 * damping + 0.3, 100.0 * damping + 10.0)
        steps = [solved(information + m * ridge, gradient) for m in (*dampings, bent)]
        if damping == 0.0 and 0.5 * float(gradient @ steps[0]) < max(tolerance, enough):
            break  # what a full step would gain
        if limit is not None:
            longest = limit(u)
            steps = [np.clip(s, -longest, longest) for s in steps]
        steps += [0.3 * steps[0]] + ([0.05 * steps[2]] if limit is not None else [])
        trials = np.repeat(u[None], len(steps), axis=0)
        trials[:, free] += np.array(steps)
        total = log_prob(trials)
        best = int(np.argmax(total))
        gain = total[best] - value
        if not gain > 0.0:
            if damping > MOST_DAMPED:
                break
            damping = 100.0 * damping + 30.0
            continue
        u = trials[best]
        damping = (0.0, 0.1 * damping, damping, 0.0, damping, 10.0 * damping + 1.0)[best]
        current = scores(u)
        bent = _bent(bent, gradient, current[1], information @ steps[best])
        if gain < tolerance:
            break
    return u, current


def _bent(bent: FloatArray, before: FloatArray, after: FloatArray, foretold: FloatArray) -> FloatArray:
    """How much more a posterior bends than the information says, by a step from one gradient to another, (k,) each."""
    tells = np.abs(foretold) > TELLS * np.abs(before)
    more = np.divide(before - after, foretold, out=np.ones_like(foretold), where=tells) - 1.0
    learnt = 0.5 * (bent + np.clip(np.nan_to_num(more), 0.0, MOST_BENT))
    return np.where(tells, learnt, bent)


def solved(information: FloatArray, gradient: FloatArray) -> FloatArray:
    """Newton's step of a gradient, (k,) or (k, m); the shortest one of an information too uneven to be solved for."""
    try:
        return np.linalg.solve(information, gradient)
    except np.linalg.LinAlgError:
        root = np.sqrt(np.maximum(np.diag(information), np.finfo(float).tiny))
        with np.errstate(invalid="ignore", over="ignore"):
            scaled = information / root / root[:, None]
        if not np.isfinite(scaled).all():  # nowhere to go from here
            return np.zeros_like(gradient)
        return np.asarray((np.linalg.lstsq(scaled, (gradient.T / root).T, rcond=None)[0].T / root).T)


def inverse(information: FloatArray, scale: FloatArray) -> FloatArray:
    """The covariance of an information; of one that is too uneven what it tells, in units of a prior's scales, (k,)."""
    try:
        return np.linalg.inv(information)
    except np.linalg.LinAlgError:
        units = scale * scale[:, None]
        if not np.isfinite(information).all():
            return np.diag(scale**2)
        return np.asarray(np.linalg.pinv(information * units, hermitian=True) * units)
