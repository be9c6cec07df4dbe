"""How heavy the tail of importance weights is: whether the error of their mean can be believed."""

from math import inf, nan, sqrt

import numpy as np
from scipy.special import softmax

from scruton.arrays import FloatArray

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
    By the empirical Bayes estimate of Zhang and Stephens (Technometrics 51, 316, 2009): arviz's number, without the
    second that arviz takes to import.
    """
    if log_weights.size < FEWEST:
        return inf
    ordered = np.sort(log_weights - log_weights.max())
    n = int(min(0.2 * ordered.size, 3.0 * sqrt(ordered.size)))
    excess = np.exp(ordered[-n:]) - np.exp(ordered[-n - 1])
    quartile = excess[int(n / 4.0 + 0.5) - 1]
    if quartile <= excess[0]:
        return nan
    # The density is 1/s (1 - theta x)^(1/k - 1) with theta = k/s; theta on a grid, its posterior by the profile of k.
    grid = 30 + int(sqrt(n))
    theta = 1.0 / excess[-1] + (1.0 - np.sqrt(grid / (np.arange(grid) + 0.5))) / (3.0 * quartile)
    profile = np.log1p(-theta[:, None] * excess).mean(axis=1)
    share = softmax(n * (np.log(-theta / profile) - profile - 1.0))
    shape = float(np.log1p(-(share @ theta) * excess).mean())
    return (n * shape + AS_MANY * TOWARDS) / (n + AS_MANY)
