"""The filter of the other laws of the family, linearised along the mean; its steps in closed form."""

import numpy as np
from numba import njit

from scruton.dynamics.equation import flow_above_floor
from scruton.dynamics.moments import (
    LOG_2PI,
    mean_weight,
    moments_along,
    near_one,
    near_zero,
    noise_drift,
    noise_moments,
    short_moments,
)  # fmt: skip


@njit(cache=True, inline="always")
def curvature(a, end, slope, n, p):  # type: ignore[no-untyped-def]
    """Half the second derivative of the flow times the variance: what linearising the mean leaves out."""
    a = max(a, 3.0 * np.sqrt(p), 1e-300)
    return 0.5 * p * (n + 1.0) * slope * (slope / max(end, 1e-300) - 1.0 / a)


@njit(cache=True, inline="always")
def advance(m, p, a_star, lam, q2, n, dt):  # type: ignore[no-untyped-def]
    """Mean and variance of the state after dt without observation (linearised unless n = -1)."""
    end, slope = flow_above_floor(m, a_star, np.exp(-lam * dt), n)
    e, _, _ = moments_along(slope, dt)
    if n != -1.0:
        end += noise_drift(m, p, q2, dt) + curvature(m, end, slope, n, p)
    return end, slope * slope * p + q2 * e


@njit(cache=True, error_model="numpy")
def step_filter(y, se, gap, period, a_star, lam, q, r, n, m0, p0, innovation, variance):  # type: ignore[no-untyped-def]
    """Innovations and their variances, (N, W), for any law: the plain form, one walker after another."""
    for w in range(a_star.size):
        m, p, q2 = m0, p0, q[w] * q[w]
        dt, decay, decay_middle = -1.0, 1.0, 1.0
        for k in range(y.size):
            noise = r[w] * se[k]
            r2 = noise * noise
            if period[k] != dt:
                dt = period[k]
                decay_middle = np.exp(-0.5 * lam[w] * dt)
                decay = decay_middle * decay_middle
            if gap[k] < 0.0:
                m, p = m0, p0
                if n[w] != -1.0:
                    # A diffuse state cannot be linearised: the first cycle fixes the state at its start.
                    innovation[k, w] = y[k] - m0
                    variance[k, w] = p0 + r2
                    gain = p0 / (p0 + r2)
                    m = m0 + gain * (y[k] - m0)
                    m, p = advance(m, gain * r2, a_star[w], lam[w], q2, n[w], 0.5 * dt)
                    continue
            elif gap[k] > 0.0:
                m, p = advance(m, p, a_star[w], lam[w], q2, n[w], gap[k])
            end, phi = flow_above_floor(m, a_star[w], decay, n[w])
            if n[w] == -1.0:
                weight = mean_weight(lam[w], dt)
                mean = a_star[w] + weight * (m - a_star[w])
                e, c, z = noise_moments(lam[w], dt)
            else:
                # The mean over the cycle by Simpson's rule; curvature of the flow to second order.
                middle, phi_middle = flow_above_floor(m, a_star[w], decay_middle, n[w])
                drift = noise_drift(m, p, q2, dt)
                bend = curvature(m, end, phi, n[w], p)
                mean = (m + 4.0 * middle + end + 4.0 * curvature(m, middle, phi_middle, n[w], p) + bend) / 6.0
                mean += 0.5 * drift
                end += drift + bend
                weight = (1.0 + 4.0 * phi_middle + phi) / 6.0
                e, c, z = moments_along(phi, dt)
            s = weight * weight * p + q2 * z + r2
            cross = phi * weight * p + q2 * c
            v = y[k] - mean
            m = end + cross / s * v
            p = phi * phi * p + q2 * e - cross * cross / s
            innovation[k, w] = v
            variance[k, w] = s


@njit(cache=True, fastmath=True, error_model="numpy")
def curved_filter(y, se, gap, period, a_star, lam, q, r, n, m0, p0, log_like):  # type: ignore[no-untyped-def]
    """Log likelihood for one law n != -1: `step_filter` with all walkers in the inner loops, which vectorise."""
    size = a_star.size
    inverse_star = 1.0 / a_star
    q2 = q * q
    r2 = r * r
    m, p, decay, decay_middle = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    power, ratio, ratio_middle = np.empty(size), np.empty(size), np.empty(size)
    level = np.zeros(size)  # ln(m/a*), kept up to date for n = 0
    stale = True
    back, back_middle, x = np.empty(size), np.empty(size), np.empty(size)
    q_end, q_cross, q_mean = np.empty(size), np.empty(size), np.empty(size)
    quad, prod = np.zeros(size), np.ones(size)
    log_like[:] = 0.0
    dt = -1.0
    for k in range(y.size):
        if period[k] != dt:
            dt = period[k]
            for w in range(size):
                decay_middle[w] = np.exp(-0.5 * lam[w] * dt)
                decay[w] = decay_middle[w] * decay_middle[w]
        yk, s2 = y[k], se[k] * se[k]
        if gap[k] != 0.0:
            stale = True
        if gap[k] < 0.0:
            for w in range(size):
                s = p0 + r2[w] * s2
                gain = p0 / s
                start = m0 + gain * (yk - m0)
                m[w], p[w] = advance(start, gain * r2[w] * s2, a_star[w], lam[w], q2[w], n, 0.5 * dt)
                quad[w] += (yk - m0) * (yk - m0) / s
                prod[w] *= s
        else:
            if gap[k] > 0.0:
                for w in range(size):
                    m[w], p[w] = advance(m[w], p[w], a_star[w], lam[w], q2[w], n, gap[k])
            # The flow is a -> a B^(-1/n), B = E + (a/a*)^n (1 - E), E = exp(-lambda dt); its slope E B^(-1/n - 1).
            if n == 2.0:
                for w in range(size):
                    rel = max(m[w] * inverse_star[w], 1e-6)
                    power[w] = rel * rel
                for w in range(size):
                    back[w] = 1.0 / (decay[w] + power[w] * (1.0 - decay[w]))
                    back_middle[w] = 1.0 / (decay_middle[w] + power[w] * (1.0 - decay_middle[w]))
                    ratio[w], ratio_middle[w] = np.sqrt(back[w]), np.sqrt(back_middle[w])
            elif n == 1.0:
                for w in range(size):
                    rel = max(m[w] * inverse_star[w], 1e-6)
                    back[w] = 1.0 / (decay[w] + rel * (1.0 - decay[w]))
                    back_middle[w] = 1.0 / (decay_middle[w] + rel * (1.0 - decay_middle[w]))
                    ratio[w], ratio_middle[w] = back[w], back_middle[w]
            elif n == 0.0:
                largest = 0.0
                for w in range(size):
                    if stale or m[w] * inverse_star[w] < 1e-5:
                        level[w] = np.log(max(m[w] * inverse_star[w], 1e-6))
                    largest = max(largest, abs(level[w] * (1.0 - decay[w])))
                if largest < 0.5:
                    for w in range(size):
                        ratio[w] = near_zero(-level[w] * (1.0 - decay[w]))
                        ratio_middle[w] = near_zero(-level[w] * (1.0 - decay_middle[w]))
                else:
                    for w in range(size):
                        ratio[w] = np.exp(-level[w] * (1.0 - decay[w]))
                        ratio_middle[w] = np.exp(-level[w] * (1.0 - decay_middle[w]))
                back[:] = 1.0
                back_middle[:] = 1.0
            else:
                for w in range(size):
                    rel = max(m[w] * inverse_star[w], 1e-6)
                    end, phi = flow_above_floor(rel, 1.0, decay[w], n)
                    middle, phi_middle = flow_above_floor(rel, 1.0, decay_middle[w], n)
                    ratio[w], ratio_middle[w] = end / rel, middle / rel
                    back[w] = phi / (ratio[w] * decay[w])
                    back_middle[w] = phi_middle / (ratio_middle[w] * decay_middle[w])
            largest = 0.0
            for w in range(size):
                # -ln(slope) by a series, and how far it may be trusted
                u = 1.0 - ratio[w] * back[w] * decay[w]
                largest = max(largest, abs(u))
                x[w] = near_one(u)
            if largest < 0.3:
                for w in range(size):
                    q_end[w], q_cross[w], q_mean[w] = short_moments(x[w], dt)
            else:
                for w in range(size):
                    q_end[w], q_cross[w], q_mean[w] = moments_along(ratio[w] * back[w] * decay[w], dt)
            for w in range(size):
                pw = p[w]
                a = max(m[w], 1e-6 * a_star[w])
                inverse = 1.0 / a
                # `curvature` with slope/end written out
                far = 1.0 / max(m[w], 3.0 * np.sqrt(pw), 1e-300)
                phi, phi_middle = ratio[w] * back[w] * decay[w], ratio_middle[w] * back_middle[w] * decay_middle[w]
                half = 0.5 * pw * (n + 1.0)
                bend = half * phi * (back[w] * decay[w] * inverse - far)
                bend_middle = half * phi_middle * (back_middle[w] * decay_middle[w] * inverse - far)
                drift = 0.5 * q2[w] * dt * m[w] / (m[w] * m[w] + pw + 1e-300)
                end = a * ratio[w]
                power[w] = end
                mean = (m[w] + 4.0 * (a * ratio_middle[w] + bend_middle) + end + bend) * (1.0 / 6.0) + 0.5 * drift
                weight = (1.0 + 4.0 * phi_middle + phi) * (1.0 / 6.0)
                s = weight * weight * pw + q2[w] * q_mean[w] + r2[w] * s2
                cross = phi * weight * pw + q2[w] * q_cross[w]
                v = yk - mean
                inverse = 1.0 / s
                gain = cross * inverse
                m[w] = end + drift + bend + gain * v
                p[w] = phi * phi * pw + q2[w] * q_end[w] - gain * cross
                quad[w] += v * v * inverse
                prod[w] *= s
            if n == 0.0:
                largest = 0.0
                for w in range(size):
                    end = max(power[w], 1e-300)
                    u = 1.0 - m[w] / end
                    largest = max(largest, abs(u))
                    level[w] = level[w] * decay[w] - near_one(u)
                stale = largest > 0.3
        if k % 8 == 7:
            for w in range(size):
                log_like[w] -= 0.5 * np.log(prod[w])
                prod[w] = 1.0
    for w in range(size):
        log_like[w] -= 0.5 * (np.log(prod[w]) + quad[w] + y.size * LOG_2PI)
