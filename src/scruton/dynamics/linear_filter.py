"""The exact filter of the paper's law, whose equation is linear: all walkers side by side."""

import numpy as np
from numba import njit

from scruton.dynamics.moments import (
    LOG_2PI,
    gust_covariance,
    gust_moments,
    gust_response,
    mean_weight,
    noise_moments,
)


@njit(cache=True, fastmath=True, error_model="numpy")
def linear_filter(y, se, gap, period, a_star, lam, q, r, gust, fade, offset, m0, p0, log_like):  # type: ignore[no-untyped-def]
    """Exact log likelihood for n = -1; all walkers in the inner loop, so that it vectorises."""
    size = a_star.size
    d = np.empty(size)  # deviation of the filtered mean from a_star
    h = np.empty(size)  # mean of the gust, in amplitude
    p, p_dh, p_hh = np.empty(size), np.empty(size), np.empty(size)
    phi, keep, push = np.empty(size), np.empty(size), np.empty(size)
    weight, weight_h = np.empty(size), np.empty(size)
    q_end, q_cross, q_mean = np.empty(size), np.empty(size), np.empty(size)
    g_dh, g_hh, g_hm = np.empty(size), np.empty(size), np.empty(size)
    r2 = r * r
    # The set-point of the record: its mean and variance, and what it moves (state, gust).
    mean_c, p_c, c_d, c_h = np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size)
    quad = np.zeros(size)
    prod = np.ones(size)
    log_like[:] = 0.0
    last = -1.0
    for k in range(y.size):
        if period[k] != last:
            last = period[k]
            for w in range(size):
                phi[w] = np.exp(-lam[w] * last)
                weight[w] = mean_weight(lam[w], last)
                e, c, z = noise_moments(lam[w], last)
                keep[w], push[w], weight_h[w], dd, dh, hh, dm, hm, mm = gust_moments(lam[w], fade[w], last)
                q2, g2 = q[w] * q[w], gust[w] * gust[w]
                q_end[w], q_cross[w], q_mean[w] = q2 * e + g2 * dd, q2 * c + g2 * dm, q2 * z + g2 * mm
                g_dh[w], g_hh[w], g_hm[w] = g2 * dh, g2 * hh, g2 * hm
        if gap[k] < 0.0:
            for w in range(size):
                d[w], h[w] = m0 - a_star[w], 0.0
                p[w], p_dh[w], p_hh[w] = p0, 0.0, gust[w] * gust[w]
                mean_c[w], p_c[w], c_d[w], c_h[w] = 0.0, offset[w] * offset[w], 0.0, 0.0
        elif gap[k] > 0.0:
            for w in range(size):
                f, g = np.exp(-lam[w] * gap[k]), np.exp(-fade[w] * gap[k])
                u = gust_response(lam[w], fade[w], gap[k])
                e, _, _ = noise_moments(lam[w], gap[k])
                dd, dh = gust_covariance(lam[w], fade[w], gap[k])
                g2 = gust[w] * gust[w]
                d[w] = f * d[w] + u * h[w]
                h[w] *= g
                c_d[w] = f * c_d[w] + u * c_h[w] + 1.0 - f
                c_h[w] *= g
                p[w] = f * f * p[w] + 2.0 * f * u * p_dh[w] + u * u * p_hh[w] + q[w] * q[w] * e + g2 * dd
                p_dh[w] = g * (f * p_dh[w] + u * p_hh[w]) + g2 * dh
                p_hh[w] = g2 + g * g * (p_hh[w] - g2)
        s2 = se[k] * se[k]
        yk = y[k]
        for w in range(size):
            # covariance of (state, gust) at the start with the mean over the cycle
            at_d = weight[w] * p[w] + weight_h[w] * p_dh[w]
            at_h = weight[w] * p_dh[w] + weight_h[w] * p_hh[w]
            s = weight[w] * at_d + weight_h[w] * at_h + q_mean[w] + r2[w] * s2
            cross = phi[w] * at_d + push[w] * at_h + q_cross[w]
            cross_h = keep[w] * at_h + g_hm[w]
            v = yk - a_star[w] - weight[w] * d[w] - weight_h[w] * h[w]
            inv = 1.0 / s
            gain = cross * inv
            gain_h = cross_h * inv
            felt = weight[w] * c_d[w] + weight_h[w] * c_h[w] + 1.0 - weight[w]
            c_d[w] = phi[w] * c_d[w] + push[w] * c_h[w] + 1.0 - phi[w] - gain * felt
            c_h[w] = keep[w] * c_h[w] - gain_h * felt
            d[w] = phi[w] * d[w] + push[w] * h[w] + gain * v
            h[w] = keep[w] * h[w] + gain_h * v
            mixed = phi[w] * p_dh[w] + push[w] * p_hh[w]
            p[w] = phi[w] * (phi[w] * p[w] + push[w] * p_dh[w]) + push[w] * mixed + q_end[w] - gain * cross
            p_dh[w] = keep[w] * mixed + g_dh[w] - gain * cross_h
            p_hh[w] = keep[w] * keep[w] * p_hh[w] + g_hh[w] - gain_h * cross_h
            # the set-point is known from the cycles so far
            v -= felt * mean_c[w]
            s += felt * felt * p_c[w]
            inv = 1.0 / s
            gain = p_c[w] * felt * inv
            mean_c[w] += gain * v
            p_c[w] -= gain * felt * p_c[w]
            quad[w] += v * v * inv
            prod[w] *= s
        if k % 8 == 7:  # one logarithm for eight cycles; eight variances cannot underflow
            for w in range(size):
                log_like[w] -= 0.5 * np.log(prod[w])
                prod[w] = 1.0
    for w in range(size):
        log_like[w] -= 0.5 * (np.log(prod[w]) + quad[w] + y.size * LOG_2PI)
