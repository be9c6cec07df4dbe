"""The filter of the other laws of the family, linearised along the mean; its steps in closed form."""

import numpy as np
from numba import njit

from scruton.dynamics.equation import flow_above_floor
from scruton.dynamics.moments import (
    LOG_2PI,
    gust_covariance,
    gust_moments,
    gust_response,
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
def gust_hold(a, a_star, n):  # type: ignore[no-untyped-def]
    """How much of a gust the amplitude feels, (a/a*)^(n + 1): one at the stable amplitude."""
    return 1.0 if n == -1.0 else min(max(a / a_star, 1e-6), 3.0) ** (n + 1.0)


@njit(cache=True, inline="always")
def advance(m, p, h, p_h, p_hh, a_star, lam, q2, g2, fade, n, dt):  # type: ignore[no-untyped-def]
    """Means and covariances of amplitude and gust after dt without observation (linearised unless n = -1)."""
    end, slope = flow_above_floor(m, a_star, np.exp(-lam * dt), n)
    e, _, _ = moments_along(slope, dt)
    keep, hold = np.exp(-fade * dt), gust_hold(m, a_star, n)
    push = hold * gust_response(lam, fade, dt)
    dd, dh = gust_covariance(lam, fade, dt)
    if n != -1.0:
        end += noise_drift(m, p, q2, dt) + curvature(m, end, slope, n, p)
    mixed = slope * p_h + push * p_hh
    p = slope * (slope * p + push * p_h) + push * mixed + q2 * e + g2 * hold * hold * dd
    return end + push * h, p, keep * h, keep * mixed + g2 * hold * dh, g2 + keep * keep * (p_hh - g2)


@njit(cache=True, inline="always")
def carried(c_d, c_h, m, a_star, lam, fade, n, dt):  # type: ignore[no-untyped-def]
    """What a unit of the record's set-point has moved (amplitude, gust) after dt without observation."""
    _, slope = flow_above_floor(m, a_star, np.exp(-lam * dt), n)
    hold = gust_hold(m, a_star, n)
    c_d = slope * c_d + hold * (gust_response(lam, fade, dt) * c_h + 1.0 - np.exp(-lam * dt))
    return c_d, np.exp(-fade * dt) * c_h


@njit(cache=True, error_model="numpy")
def step_filter(  # type: ignore[no-untyped-def]
    y, se, gap, period, a_star, lam, q, r, gust, fade, offset, n, m0, p0, innovation, variance
):
    """Innovations and their variances, (N, W), for any law: the plain form, one walker after another."""
    for w in range(a_star.size):
        q2, g2 = q[w] * q[w], gust[w] * gust[w]
        m, p, h, p_h, p_hh = m0, p0, 0.0, 0.0, g2
        c_mean, p_c, c_d, c_h = 0.0, 0.0, 0.0, 0.0
        dt, decay, decay_middle = -1.0, 1.0, 1.0
        moments = gust_moments(lam[w], fade[w], 1.0)
        for k in range(y.size):
            noise = r[w] * se[k]
            r2 = noise * noise
            if period[k] != dt:
                dt = period[k]
                decay_middle = np.exp(-0.5 * lam[w] * dt)
                decay = decay_middle * decay_middle
                moments = gust_moments(lam[w], fade[w], dt)
            if gap[k] < 0.0:
                m, p, h, p_h, p_hh = m0, p0, 0.0, 0.0, g2
                c_mean, p_c, c_d, c_h = 0.0, offset[w] * offset[w], 0.0, 0.0
                if n[w] != -1.0:
                    # A diffuse state cannot be linearised: the first cycle fixes the state at its start.
                    innovation[k, w] = y[k] - m0
                    variance[k, w] = p0 + r2
                    gain = p0 / (p0 + r2)
                    m = m0 + gain * (y[k] - m0)
                    c_d, c_h = carried(c_d, c_h, m, a_star[w], lam[w], fade[w], n[w], 0.5 * dt)
                    m, p, h, p_h, p_hh = advance(
                        m, gain * r2, h, p_h, p_hh, a_star[w], lam[w], q2, g2, fade[w], n[w], 0.5 * dt
                    )
                    continue
            elif gap[k] > 0.0:
                c_d, c_h = carried(c_d, c_h, m, a_star[w], lam[w], fade[w], n[w], gap[k])
                m, p, h, p_h, p_hh = advance(m, p, h, p_h, p_hh, a_star[w], lam[w], q2, g2, fade[w], n[w], gap[k])
            hold = gust_hold(m, a_star[w], n[w])
            keep, push, weight_h, dd, dh, hh, dm, hm, mm = moments
            push, weight_h = hold * push, hold * weight_h
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
            at_d = weight * p + weight_h * p_h
            at_h = weight * p_h + weight_h * p_hh
            s = weight * at_d + weight_h * at_h + q2 * z + g2 * hold * hold * mm + r2
            cross = phi * at_d + push * at_h + q2 * c + g2 * hold * hold * dm
            cross_h = keep * at_h + g2 * hold * hm
            v = y[k] - mean - weight_h * h
            felt = weight * c_d + weight_h * c_h + hold * (1.0 - mean_weight(lam[w], dt))
            c_d = phi * c_d + push * c_h + hold * (1.0 - decay) - cross / s * felt
            c_h = keep * c_h - cross_h / s * felt
            m = end + push * h + cross / s * v
            h = keep * h + cross_h / s * v
            mixed = phi * p_h + push * p_hh
            p = phi * (phi * p + push * p_h) + push * mixed + q2 * e + g2 * hold * hold * dd - cross * cross / s
            p_h = keep * mixed + g2 * hold * dh - cross * cross_h / s
            p_hh = keep * keep * p_hh + g2 * hh - cross_h * cross_h / s
            innovation[k, w] = v - felt * c_mean
            variance[k, w] = s + felt * felt * p_c
            gain = p_c * felt / variance[k, w]
            c_mean += gain * innovation[k, w]
            p_c -= gain * felt * p_c


@njit(cache=True, fastmath=True, error_model="numpy")
def curved_filter(  # type: ignore[no-untyped-def]
    y, se, gap, period, a_star, lam, q, r, gust, fade, offset, n, m0, p0, log_like
):
    """Log likelihood for one law n != -1: `step_filter` with all walkers in the inner loops, which vectorise."""
    size = a_star.size
    inverse_star = 1.0 / a_star
    q2 = q * q
    r2 = r * r
    g2 = gust * gust
    h, p_h, p_hh, hold = np.empty(size), np.empty(size), np.empty(size), np.ones(size)
    keep, push, weight_h = np.empty(size), np.empty(size), np.empty(size)
    c, p_c, c_d, c_h, rest = np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size), np.empty(size)
    g_dd, g_dh, g_hh = np.empty(size), np.empty(size), np.empty(size)
    g_dm, g_hm, g_mm = np.empty(size), np.empty(size), np.empty(size)
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
                keep[w], push[w], weight_h[w], dd, dh, hh, dm, hm, mm = gust_moments(lam[w], fade[w], dt)
                rest[w] = 1.0 - mean_weight(lam[w], dt)
                g_dd[w], g_dh[w], g_hh[w] = g2[w] * dd, g2[w] * dh, g2[w] * hh
                g_dm[w], g_hm[w], g_mm[w] = g2[w] * dm, g2[w] * hm, g2[w] * mm
        yk, s2 = y[k], se[k] * se[k]
        if gap[k] != 0.0:
            stale = True
        if gap[k] < 0.0:
            for w in range(size):
                s = p0 + r2[w] * s2
                gain = p0 / s
                start = m0 + gain * (yk - m0)
                c[w], p_c[w] = 0.0, offset[w] * offset[w]
                c_d[w], c_h[w] = carried(0.0, 0.0, start, a_star[w], lam[w], fade[w], n, 0.5 * dt)
                m[w], p[w], h[w], p_h[w], p_hh[w] = advance(
                    start, gain * r2[w] * s2, 0.0, 0.0, g2[w], a_star[w], lam[w], q2[w], g2[w], fade[w], n, 0.5 * dt
                )
                quad[w] += (yk - m0) * (yk - m0) / s
                prod[w] *= s
        else:
            if gap[k] > 0.0:
                for w in range(size):
                    c_d[w], c_h[w] = carried(c_d[w], c_h[w], m[w], a_star[w], lam[w], fade[w], n, gap[k])
                    m[w], p[w], h[w], p_h[w], p_hh[w] = advance(
                        m[w], p[w], h[w], p_h[w], p_hh[w], a_star[w], lam[w], q2[w], g2[w], fade[w], n, gap[k]
                    )
            if n == 2.0:
                for w in range(size):
                    rel = min(max(m[w] * inverse_star[w], 1e-6), 3.0)
                    hold[w] = rel * rel * rel
            elif n == 1.0:
                for w in range(size):
                    rel = min(max(m[w] * inverse_star[w], 1e-6), 3.0)
                    hold[w] = rel * rel
            elif n == 0.0:
                for w in range(size):
                    hold[w] = min(max(m[w] * inverse_star[w], 1e-6), 3.0)
            else:
                for w in range(size):
                    hold[w] = gust_hold(m[w], a_star[w], n)
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
                b = hold[w]
                wh, pu = b * weight_h[w], b * push[w]
                at_d = weight * pw + wh * p_h[w]
                at_h = weight * p_h[w] + wh * p_hh[w]
                s = weight * at_d + wh * at_h + q2[w] * q_mean[w] + b * b * g_mm[w] + r2[w] * s2
                cross = phi * at_d + pu * at_h + q2[w] * q_cross[w] + b * b * g_dm[w]
                cross_h = keep[w] * at_h + b * g_hm[w]
                v = yk - mean - wh * h[w]
                inverse = 1.0 / s
                gain = cross * inverse
                gain_h = cross_h * inverse
                felt = weight * c_d[w] + wh * c_h[w] + b * rest[w]
                c_d[w] = phi * c_d[w] + pu * c_h[w] + b * (1.0 - decay[w]) - gain * felt
                c_h[w] = keep[w] * c_h[w] - gain_h * felt
                m[w] = end + pu * h[w] + drift + bend + gain * v
                h[w] = keep[w] * h[w] + gain_h * v
                mixed = phi * p_h[w] + pu * p_hh[w]
                p[w] = phi * (phi * pw + pu * p_h[w]) + pu * mixed + q2[w] * q_end[w] + b * b * g_dd[w] - gain * cross
                p_h[w] = keep[w] * mixed + b * g_dh[w] - gain * cross_h
                p_hh[w] = keep[w] * keep[w] * p_hh[w] + g_hh[w] - gain_h * cross_h
                v -= felt * c[w]
                s += felt * felt * p_c[w]
                inverse = 1.0 / s
                gain = p_c[w] * felt * inverse
                c[w] += gain * v
                p_c[w] -= gain * felt * p_c[w]
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
