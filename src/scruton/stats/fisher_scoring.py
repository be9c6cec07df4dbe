"""The optimum of a posterior that offers scores: its gradient and Fisher information come with every value.

The information is positive whatever the point, so that scoring with a damped step climbs from anywhere; steps of
several dampings are tried side by side.  What bends the density beside the information is learnt from the gradients
along the way, by the symmetric rank-one update (Nocedal and Wright, Numerical Optimization, 2nd ed., section 6.2); a
step by both is tried, too.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from scruton.arrays import FloatArray

MOST_DAMPED = 1e3  # relative to the information's diagonal: where no step helps any more, the search ends


def climb[Scores: tuple[Any, ...]](
    scores: Callable[[FloatArray], Scores],
    log_prob: Callable[[FloatArray], FloatArray],
    start: FloatArray,
    *,
    limit: Callable[[FloatArray], FloatArray] | None = None,
    free: FloatArray | slice = slice(None),
    tolerance: float = 5e-3,
    iterations: int = 40,
    cautious: bool = True,
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
        Longest step in each coordinate at a point, (k,).
    free : (k,) array of int, optional
        Coordinates that move; all by default.
    tolerance : float
        Gain of a step, in nats, below which it was the last.
    iterations : int
        At most so many steps.
    cautious : bool
        Whether to try a very short step, too.

    Returns
    -------
    point : (d,) array
    scores : tuple
        As `scores` gives them there.
    """
    u, current, damping = start, scores(start), 0.0
    beside = np.zeros_like(current[2])
    for _ in range(iterations):
        value, gradient, information = current[:3]
        ridge = np.diag(np.diag(information))
        dampings = (damping, 10.0 * damping + 0.3, 100.0 * damping + 10.0)
        steps = [np.linalg.solve(information + m * ridge, gradient) for m in dampings]
        if damping == 0.0 and 0.5 * float(gradient @ steps[0]) < tolerance:
            break  # what a full step would gain
        bent = _solved(information + beside, gradient, steps[0])
        if limit is not None:
            longest = limit(u)
            steps, bent = [np.clip(s, -longest, longest) for s in steps], np.clip(bent, -longest, longest)
        steps += [0.3 * steps[0], 0.05 * steps[2], bent, 0.6 * steps[0]]
        trials = np.repeat(u[None], len(steps), axis=0)
        trials[:, free] += np.array(steps)
        total = log_prob(trials)
        if not cautious:
            total[4] = -np.inf
        best = int(np.argmax(total))
        gain = total[best] - value
        if not gain > 0.0:
            if damping > MOST_DAMPED:
                break
            damping = 100.0 * damping + 30.0
            continue
        u = trials[best]
        damping = (0.0, 0.1 * damping, damping, damping, 10.0 * damping + 1.0, damping, damping)[best]
        current = scores(u)
        beside = _learnt(beside, steps[best], gradient - current[1] - current[2] @ steps[best])
        if gain < tolerance:
            break
    return u, current


def _learnt(beside: FloatArray, step: FloatArray, missing: FloatArray) -> FloatArray:
    """Curvature beside the information, once a step has shown that `missing` of the change of the gradient."""
    wrong = missing - beside @ step
    along = float(wrong @ step)
    # Where one is at right angles to the other, or the gradient is none, there is nothing to learn.
    if np.isfinite(along) and abs(along) > 1e-8 * float(np.linalg.norm(wrong) * np.linalg.norm(step)):
        beside = beside + np.outer(wrong, wrong) / along
    return beside


def _solved(curvature: FloatArray, gradient: FloatArray, otherwise: FloatArray) -> FloatArray:
    """The step to where the gradient vanishes; another where the curvature is that of no optimum at all."""
    try:
        return np.linalg.solve(curvature, gradient)
    except np.linalg.LinAlgError:
        return otherwise
