"""The exact filter of the paper's law, whose equation is linear: all walkers side by side."""

import numpy as np
from numba import njit

from scruton.dynamics.moments import LOG_2PI, mean_weight, noise_moments


@njit(cache=True, fastmath=True, error_model="numpy")
def linear_filter(y, se, gap, period, a_star, lam, q, r, m0, p0, log_like):  # type: ignore[no-untyped-def]
    """Exact log likelihood for n = -1; all walkers in the inner loop, so that it vectorises."""
    n_walkers = a_star.size
    d = np.empty(n_walkers)  # deviation of the filtered mean from a_star
    p = np.empty(n_walkers)
    phi = np.empty(n_walkers)
    weight = np.empty(n_walkers)
    q_end = np.empty(n_walkers)
    q_cross = np.empty(n_walkers)
    q_mean = np.empty(n_walkers)
    r2 = r * r
    quad = np.zeros(n_walkers)
    prod = np.ones(n_walkers)
    log_like[:] = 0.0
    last = -1.0
    for k in range(y.size):
        if period[k] != last:
            last = period[k]
            for w in range(n_walkers):
                phi[w] = np.exp(-lam[w] * last)
                weight[w] = mean_weight(lam[w], last)
                e, c, z = noise_moments(lam[w], last)
                q2 = q[w] * q[w]
                q_end[w], q_cross[w], q_mean[w] = q2 * e, q2 * c, q2 * z
        if gap[k] < 0.0:
            for w in range(n_walkers):
                d[w] = m0 - a_star[w]
                p[w] = p0
        elif gap[k] > 0.0:
            for w in range(n_walkers):
                f = np.exp(-lam[w] * gap[k])
                e, _, _ = noise_moments(lam[w], gap[k])
                d[w] *= f
                p[w] = f * f * p[w] + q[w] * q[w] * e
        s2 = se[k] * se[k]
        yk = y[k]
        for w in range(n_walkers):
            s = weight[w] * weight[w] * p[w] + q_mean[w] + r2[w] * s2
            cross = phi[w] * weight[w] * p[w] + q_cross[w]
            v = yk - a_star[w] - weight[w] * d[w]
            inv = 1.0 / s
            gain = cross * inv
            d[w] = phi[w] * d[w] + gain * v
            p[w] = phi[w] * phi[w] * p[w] + q_end[w] - gain * cross
            quad[w] += v * v * inv
            prod[w] *= s
        if k % 8 == 7:  # one logarithm for eight cycles; eight variances cannot underflow
            for w in range(n_walkers):
                log_like[w] -= 0.5 * np.log(prod[w])
                prod[w] = 1.0
    for w in range(n_walkers):
        log_like[w] -= 0.5 * (np.log(prod[w]) + quad[w] + y.size * LOG_2PI)
