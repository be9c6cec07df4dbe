"""Importance weights: how heavy their tail is, whether the error of their mean can be believed, and smoothed ones.

They are arviz's numbers, without the seconds that arviz takes to import (Vehtari et al., JMLR 25, 2024).
"""

from math import inf, nan, sqrt

import numpy as np
from scipy.special import logsumexp, softmax

from scruton.arrays import FloatArray
from scruton.stats.ranks import effective_draws_of_mean

FEWEST = 25  # weights, that a tail may be told from the rest
TOWARDS, AS_MANY = 0.5, 10  # a prior worth ten draws draws the shape to a half (Vehtari et al., 2024, Appendix G)


def tail_shape(log_weights: FloatArray) -> float:
    """Shape k of the generalised Pareto distribution of the largest weights, (N,) finite logarithms.

    Returns
    -------
    float
        Infinite where the weights are too few to say; NaN where their tail is no tail.

    Notes
    -----
    By the empirical Bayes estimate of Zhang and Stephens (Technometrics 51, 316, 2009).
    """
    if log_weights.size < FEWEST:
        return inf
    ordered = np.sort(log_weights - log_weights.max())
    n = _tail_size(ordered.size)
    return _fitted(np.exp(ordered[-n:]) - np.exp(ordered[-n - 1]))[0]


def _tail_size(count: int, efficiency: float = 1.0, most: float = 1.0) -> int:
    """How many of so many weights are the tail; `efficiency` and `most` as of `smoothed`."""
    tail = int(3.0 * sqrt(count / efficiency) if count * efficiency > 225 else count // 5)
    return max(min(tail, int(most * count)), 5) if most < 1.0 else tail


def smoothed(log_weights: FloatArray, *, efficiency: float = 1.0, most: float = 1.0) -> tuple[FloatArray, float]:
    """Logarithms of weights, (N,), the largest of them smoothed by their tail, and its shape k.

    Parameters
    ----------
    log_weights : (N,) array
    efficiency : float
        Effective number of draws over theirs.
    most : float
        Part of the draws that the tail holds at most.

    Raises
    ------
    ValueError
        Where there are too few for a tail, or the tail has no spread.
    """
    n = log_weights.size
    tail = _tail_size(n, efficiency, most)
    if tail < 5:
        raise ValueError("too few draws for a tail")
    found = log_weights - log_weights.max()
    order = np.argsort(found)
    last = order[n - tail :]
    largest, cutoff = found[last], np.exp(found[order[n - tail - 1]])
    if abs(largest[-1] - largest[0]) < np.finfo(float).tiny:
        raise ValueError("a tail without any spread")
    shape, scale = _fitted(np.exp(largest) - cutoff)
    if np.isfinite(shape):
        share = np.arange(0.5, tail) / tail
        if shape == 0.0:
            new = cutoff - scale * np.log1p(-share)
        else:
            new = cutoff + scale * np.expm1(-shape * np.log1p(-share)) / shape
        found[last] = np.minimum(np.log(new), largest[-1])
    if np.isfinite(found).all():
        found = found - logsumexp(found)
    return found, shape


def scaled(log_density: FloatArray, alpha: float) -> FloatArray:
    """Smoothed logarithms of the weights of draws where a factor of this density is raised to a power alpha."""
    below = (log_density <= np.quantile(log_density, q) for q in (0.05, 0.95))
    efficiency = min(effective_draws_of_mean(one[None].astype(float)) for one in below) / log_density.size
    return smoothed((alpha - 1.0) * log_density, efficiency=efficiency, most=0.5)[0]


def _fitted(excess: FloatArray) -> tuple[float, float]:
    """Shape and scale of the generalised Pareto distribution of what exceeds a threshold, (n,), rising."""
    n = excess.size
    quartile = excess[int(n / 4.0 + 0.5) - 1]
    if quartile <= excess[0]:
        return nan, nan
    # The density is 1/s (1 - theta x)^(1/k - 1) with theta = k/s; theta on a grid, its posterior by the profile of k.
    grid = 30 + int(sqrt(n))
    theta = 1.0 / excess[-1] + (1.0 - np.sqrt(grid / (np.arange(grid) + 0.5))) / (3.0 * quartile)
    profile = np.log1p(-theta[:, None] * excess).mean(axis=1)
    share = softmax(n * (np.log(-theta / profile) - profile - 1.0))
    middle = float(share @ theta)
    shape = float(np.log1p(-middle * excess).mean())
    return (n * shape + AS_MANY * TOWARDS) / (n + AS_MANY), -shape / middle
