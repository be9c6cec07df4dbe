"""The filter of the family of laws, step by step: exact for n = -1, else linearised along the mean."""

import numpy as np

from scruton.compiled import njit
from scruton.dynamics.departure import ROUGH, STATIC, factor_at, faded, place_of, ramp
from scruton.dynamics.equation import flow_above_floor
from scruton.dynamics.moments import (
    gust_covariance,
    gust_moments,
    gust_response,
    mean_weight,
    moments_along,
    noise_drift,
    noise_moments,
)  # fmt: skip

# What is predicted of a cycle varies at least as the sensor does. Far from where the records are, the departure bends
# the drift more than a linearised filter can follow; a variance below this part of the sensor's says that it is lost,
# and there the likelihood is zero.
LEAST = 0.1


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
def advance(m, p, h, p_h, p_hh, a_star, lam, here, q2, g2, fade, n, dt):  # type: ignore[no-untyped-def]
    """Means and covariances of amplitude and gust after dt without observation (linearised unless n = -1).

    `here` is the rate lambda with the departure at the amplitude, which moves the mean; noise is that of lambda.
    """
    end, slope = flow_above_floor(m, a_star, np.exp(-here * dt), n)
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
def carried(c_d, c_h, m, a_star, lam, here, fade, n, dt, theta):  # type: ignore[no-untyped-def]
    """Move what a unit of every static has moved (amplitude, gust), (STATIC,) each, on by dt without observation.

    Gives what the set-point itself adds to the amplitude.
    """
    end, slope = flow_above_floor(m, a_star, np.exp(-here * dt), n)
    place = place_of(m, a_star)
    hold, keep = gust_hold(m, a_star, n), np.exp(-fade * dt)
    push, set_point = hold * gust_response(lam, fade, dt), hold * (1.0 - np.exp(-lam * dt))
    for i in range(c_d.size):
        direct = set_point if i == 0 else ramp(place, i - 1) * (end - m) * (lam / here)
        c_d[i] = slope * c_d[i] + push * c_h[i] + direct
        c_h[i] *= keep
    return set_point * theta[0]


@njit(cache=True, error_model="numpy")
def step_filter(  # type: ignore[no-untyped-def]
    y, se, gap, period, a_star, lam, q, r, gust, fade, offset, departure, known, own, n, m0, p0, innovation,
    variance, mean, cov,
):  # fmt: skip
    """Innovations and their variances, (N, W), for any law: the plain form, one walker after another.

    What the records say of the statics at their end - set-point of the last record, columns of the departure - goes to
    `mean`, (W, STATIC), and `cov`, (W, STATIC, STATIC).
    """
    c_d, c_h, felt, p_felt = np.empty(STATIC), np.empty(STATIC), np.empty(STATIC), np.empty(STATIC)
    for w in range(a_star.size):
        q2, g2 = q[w] * q[w], gust[w] * gust[w]
        theta, p_c = mean[w], cov[w]
        theta[0], theta[1:], p_c[:] = 0.0, known[w], 0.0
        for i in range(1, STATIC):
            p_c[i, i] = own * departure[w] * departure[w]
        m, p, h, p_h, p_hh = m0, p0, 0.0, 0.0, g2
        remembered = departure[w] * departure[w] * a_star[w]  # by a wake
        at_start = g2 + remembered * remembered
        moments = gust_moments(lam[w], fade[w], 1.0)
        dt, moving = -1.0, 0.0
        for k in range(y.size):
            noise = r[w] * se[k]
            r2 = noise * noise
            if period[k] != dt:
                dt = period[k]
                moments = gust_moments(lam[w], fade[w], dt)
            first = gap[k] < 0.0
            if first:
                m, p, h, p_h, p_hh = m0, p0, 0.0, 0.0, at_start
                c_d[:], c_h[:], theta[0] = 0.0, 0.0, 0.0
                p_c[0, :], p_c[:, 0] = 0.0, 0.0
                p_c[0, 0] = offset[w] * offset[w]
                if n[w] != -1.0:
                    # A diffuse state cannot be linearised: the first cycle fixes the state at its start.
                    innovation[k, w] = y[k] - m0
                    variance[k, w] = p0 + r2
                    gain = p0 / (p0 + r2)
                    m = seen = m0 + gain * (y[k] - m0)
                    here = lam[w] * factor_at(m, a_star[w], theta)
                    carried(c_d, c_h, m, a_star[w], lam[w], here, fade[w], n[w], 0.5 * dt, theta)
                    m, p, h, p_h, p_hh = advance(
                        m, gain * r2, h, p_h, p_hh, a_star[w], lam[w], here, q2, g2, fade[w], n[w], 0.5 * dt
                    )
                    moving = 2.0 * (m - seen)
                    continue
            elif gap[k] > 0.0:
                here = lam[w] * factor_at(m, a_star[w], theta)
                moved = carried(c_d, c_h, m, a_star[w], lam[w], here, fade[w], n[w], gap[k], theta)
                m, p, h, p_h, p_hh = advance(m, p, h, p_h, p_hh, a_star[w], lam[w], here, q2, g2, fade[w], n[w], gap[k])
                m += moved
                moving = 0.0
            # The departure is that of the middle of the cycle.
            at = y[k] if first else m + 0.5 * moving
            place, excess = place_of(at, a_star[w]), factor_at(at, a_star[w], theta) - 1.0
            decay_middle = np.exp(-0.5 * lam[w] * dt)
            decay = decay_middle * decay_middle
            more = faded(lam[w] * excess, 0.5 * dt)
            set_point = 1.0 - decay
            decay_middle *= more
            decay *= more * more
            hold = gust_hold(m, a_star[w], n[w])
            keep, push, weight_h, dd, dh, hh, dm, hm, mm = moments
            push, weight_h = hold * push, hold * weight_h
            end, phi = flow_above_floor(m, a_star[w], decay, n[w])
            if n[w] == -1.0:
                weight = (1.0 - decay) / (lam[w] * (1.0 + excess) * dt)
                average = a_star[w] + weight * (m - a_star[w])
                start = a_star[w] + (y[k] - a_star[w]) / weight if first else m
                change, moving = (weight - 1.0) * (start - a_star[w]), (decay - 1.0) * (start - a_star[w])
                e, c, z = noise_moments(lam[w] * (1.0 + excess), dt)
                drift = bend = bend_middle = 0.0
            else:
                # The mean over the cycle by Simpson's rule; curvature of the flow to second order.
                middle, phi_middle = flow_above_floor(m, a_star[w], decay_middle, n[w])
                drift = noise_drift(m, p, q2, dt)
                bend = curvature(m, end, phi, n[w], p)
                bend_middle = curvature(m, middle, phi_middle, n[w], p)
                average = (m + 4.0 * middle + end) / 6.0
                weight = (1.0 + 4.0 * phi_middle + phi) / 6.0
                e, c, z = moments_along(phi, dt)
                change, moving = average - m, end - m
            at_d = weight * p + weight_h * p_h
            at_h = weight * p_h + weight_h * p_hh
            rough = ROUGH * departure[w] * moving
            rough *= rough
            s = weight * at_d + weight_h * at_h + q2 * z + g2 * hold * hold * mm + r2 + 0.25 * rough
            cross = phi * at_d + push * at_h + q2 * c + g2 * hold * hold * dm + 0.5 * rough
            cross_h = keep * at_h + g2 * hold * hm
            gain, gain_h = cross / s, cross_h / s
            at_once = hold * (1.0 - mean_weight(lam[w], dt))
            v = y[k] - average - (4.0 * bend_middle + bend) / 6.0 - 0.5 * drift - weight_h * h - at_once * theta[0]
            total = s
            for i in range(STATIC):
                direct = at_once if i == 0 else ramp(place, i - 1) * change / (1.0 + excess)
                felt[i] = weight * c_d[i] + weight_h * c_h[i] + direct
            for i in range(STATIC):
                p_felt[i] = 0.0
                for j in range(STATIC):
                    p_felt[i] += p_c[i, j] * felt[j]
                total += felt[i] * p_felt[i]
            step = end + push * h + hold * set_point * theta[0] + drift + bend + gain * v
            h = keep * h + gain_h * v
            for i in range(STATIC):
                direct = hold * set_point if i == 0 else ramp(place, i - 1) * moving / (1.0 + excess)
                c_d[i] = phi * c_d[i] + push * c_h[i] + direct - gain * felt[i]
                c_h[i] = keep * c_h[i] - gain_h * felt[i]
                learned = p_felt[i] * v / total
                theta[i] += learned
                step += c_d[i] * learned
                h += c_h[i] * learned
                for j in range(STATIC):
                    p_c[i, j] -= p_felt[i] * p_felt[j] / total
            if total < LEAST * r2:
                variance[k:, w] = np.inf
                innovation[k:, w] = v
                break
            m = step
            mixed = phi * p_h + push * p_hh
            p = phi * (phi * p + push * p_h) + push * mixed + q2 * e + g2 * hold * hold * dd + rough - gain * cross
            p_h = keep * mixed + g2 * hold * dh - gain * cross_h
            p_hh = keep * keep * p_hh + g2 * hh - gain_h * cross_h
            innovation[k, w] = v
            variance[k, w] = total
