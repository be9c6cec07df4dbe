"""The step filter for many walkers of one law: blocks of them side by side, so that the processor takes them at once.

Everything that a walker carries is a row of one small array with a place for each of `BLOCK` walkers.  Rows and width
are constants: only so can the compiler see that no row is another one, and the loops over walkers become vectors.
"""

import numpy as np

from scruton.compiled import njit
from scruton.dynamics.departure import COLUMNS, ROUGH, STATIC, factor, factor_at, faded, place_of, ramp
from scruton.dynamics.equation import flow_above_floor
from scruton.dynamics.moments import (
    LOG_2PI,
    gust_moments,
    mean_weight,
    moments_along,
    near_one,
    near_zero,
    noise_moments,
    short_moments,
)
from scruton.dynamics.step_filter import LEAST, advance, carried, gust_hold

BLOCK = 16
_LOST = 1e300  # of -2 ln(likelihood): no infinity, which fast arithmetic need not know
(
    A, LAM, Q2, R2, G2, FADE, OFFSET2, DEPARTURE2,  # what is sampled
    M, P, H, P_H, P_HH, LEVEL, QUAD, PROD,  # state and gust, ln(m/a*) for n = 0; the likelihood
    DECAY, HALF, KEEP, PUSH, WEIGHT_H, REST, DD, DH, HH, DM, HM, MM,  # of a period
    HOLD, HERE, HERE_HALF, RATE, RATIO, RATIO_HALF, BACK, BACK_HALF, END, MIDDLE, SLOPE, SLOPE_HALF,
    LOSS, Q_END, Q_CROSS, Q_MEAN, V, S, GAIN, GAIN_H, WEIGHT, CHANGE, STEP, INNOVATION, VARIANCE, THETA,
) = range(54)  # fmt: skip
# The statics: their means, what a unit of each has moved (amplitude, gust), how the observation feels it, their
# covariance times that, and the columns of the departure here; then half of the covariance.
C_D, C_H, FELT, P_FELT, SHAPE, COV = (THETA + STATIC * i for i in range(1, 7))
ROWS = COV + STATIC * (STATIC + 1) // 2


@njit(cache=True, fastmath=True, error_model="numpy")
def block_filter(  # type: ignore[no-untyped-def]
    y, se, gap, period, a_star, lam, q, r, gust, fade, offset, departure, known, own, n, m0, p0, log_like,
    innovation, variance,
):  # fmt: skip
    """Log likelihood, (W,), of walkers of one law: `step_filter` with vectors.

    Innovations and their variances go to (N, W) arrays, where these are not empty.
    """
    x = np.zeros((ROWS, BLOCK))
    for first in range(0, a_star.size, BLOCK):
        for w in range(BLOCK):
            at = min(first + w, a_star.size - 1)  # the last walker fills its block
            x[A, w], x[LAM, w], x[Q2, w], x[R2, w] = a_star[at], lam[at], q[at] * q[at], r[at] * r[at]
            x[G2, w], x[FADE, w] = gust[at] * gust[at], fade[at]
            x[OFFSET2, w], x[DEPARTURE2, w] = offset[at] * offset[at], departure[at] * departure[at]
            x[THETA + 1 : C_D, w] = known[at]
        _block(x, y, se, gap, period, own, n, m0, p0, innovation[:, first:], variance[:, first:])
        for w in range(min(BLOCK, a_star.size - first)):
            log_like[first + w] = x[QUAD, w]  # about -1e300 where the filter lost its way


@njit(cache=True, inline="always")
def _block(x, y, se, gap, period, own, n, m0, p0, innovation, variance):  # type: ignore[no-untyped-def]
    """Fill the row `QUAD` with the log likelihoods, and columns of the innovations where they are wanted."""
    wanted = min(innovation.shape[1], BLOCK)
    x[QUAD], x[PROD], x[THETA], x[C_D:] = 0.0, 1.0, 0.0, 0.0
    for i in range(1, STATIC):
        x[COV + i * (i + 1) // 2 + i] = own * x[DEPARTURE2]
    total = np.zeros(BLOCK)
    dt, stale = -1.0, True
    departs = np.any(x[DEPARTURE2] > 0.0) or np.any(x[THETA + 1 : C_D] != 0.0)
    for k in range(y.size):
        if period[k] != dt:
            dt = period[k]
            _period(x, dt)
        yk, s2 = y[k], se[k] * se[k]
        first = gap[k] < 0.0
        if gap[k] != 0.0:
            stale = True
            x[STEP] = 0.0
            if first:
                _new_record(x)
                if n != -1.0:
                    _first(x, yk, s2, n, m0, p0, dt)
                    for w in range(wanted):
                        innovation[k, w], variance[k, w] = yk - m0, x[VARIANCE, w]
                    continue
                x[M], x[P], x[H], x[P_H] = m0, p0, 0.0, 0.0
                at_start = x[DEPARTURE2] * x[A]
                x[P_HH] = x[G2] + at_start * at_start
            else:
                _unseen(x, n, gap[k])
        if departs:
            for w in range(BLOCK):  # at the middle of the cycle
                place, g = place_of(yk if first else x[M, w] + 0.5 * x[STEP, w], x[A, w]), 0.0
                for i in range(COLUMNS):
                    x[SHAPE + 1 + i, w] = ramp(place, i)
                    g += x[THETA + 1 + i, w] * x[SHAPE + 1 + i, w]
                whole = factor(g, place)
                inverse = 1.0 / whole
                for i in range(COLUMNS):
                    x[SHAPE + 1 + i, w] *= inverse
                excess = x[LAM, w] * (whole - 1.0)
                more = faded(excess, 0.5 * dt)
                x[HERE_HALF, w] = x[HALF, w] * more
                x[HERE, w] = x[DECAY, w] * more * more
                x[RATE, w] = x[LAM, w] + excess
        else:
            for w in range(BLOCK):
                x[HERE_HALF, w], x[HERE, w], x[RATE, w] = x[HALF, w], x[DECAY, w], x[LAM, w]
        stale = _flow(x, n, stale)
        _noise(x, n, dt)
        _observe(x, yk, s2, n, dt, first, departs)
        for w in range(wanted):
            innovation[k, w] = x[INNOVATION, w]
            variance[k, w] = np.inf if x[QUAD, w] >= _LOST else x[VARIANCE, w]
        if n == 0.0:
            largest = 0.0
            for w in range(BLOCK):
                u = 1.0 - x[M, w] / max(x[END, w], 1e-300)
                largest = max(largest, abs(u))
                x[LEVEL, w] = x[LEVEL, w] * x[HERE, w] - near_one(u)
            stale = largest > 0.3
        if k % 8 == 7:  # one logarithm for eight cycles; eight variances cannot underflow
            for w in range(BLOCK):
                total[w] += np.log(x[PROD, w])
                x[PROD, w] = 1.0
    for w in range(BLOCK):
        x[QUAD, w] = -0.5 * (total[w] + np.log(x[PROD, w]) + x[QUAD, w] + y.size * LOG_2PI)


@njit(cache=True, fastmath=True, error_model="numpy", forceinline=True)
def _period(x, dt):  # type: ignore[no-untyped-def]
    """What does not change while the period does not."""
    for w in range(BLOCK):
        x[HALF, w] = np.exp(-0.5 * x[LAM, w] * dt)
        x[DECAY, w] = x[HALF, w] * x[HALF, w]
        x[KEEP, w], x[PUSH, w], x[WEIGHT_H, w], dd, dh, hh, dm, hm, mm = gust_moments(x[LAM, w], x[FADE, w], dt)
        x[REST, w] = 1.0 - mean_weight(x[LAM, w], dt)
        g2 = x[G2, w]
        x[DD, w], x[DH, w], x[HH, w], x[DM, w], x[HM, w], x[MM, w] = (
            g2 * dd, g2 * dh, g2 * hh, g2 * dm, g2 * hm, g2 * mm,
        )  # fmt: skip


@njit(cache=True, forceinline=True)
def _new_record(x):  # type: ignore[no-untyped-def]
    """A set-point of its own; of the departure is known what was known, and it has moved nothing yet."""
    x[THETA], x[COV] = 0.0, x[OFFSET2]
    x[C_D : C_D + 2 * STATIC] = 0.0
    for i in range(1, STATIC):
        x[COV + i * (i + 1) // 2] = 0.0


@njit(cache=True, error_model="numpy", forceinline=True)
def _first(x, y, s2, n, m0, p0, dt):  # type: ignore[no-untyped-def]
    """A diffuse state cannot be linearised: the first cycle fixes the state at its middle."""
    for w in range(BLOCK):
        prior = p0 + x[R2, w] * s2
        part, at_start = p0 / prior, x[DEPARTURE2, w] * x[A, w]
        x[M, w], x[P, w], x[H, w], x[P_H, w], x[P_HH, w] = (
            m0 + part * (y - m0), part * x[R2, w] * s2, 0.0, 0.0,
            x[G2, w] + at_start * at_start,
        )  # fmt: skip
        x[QUAD, w] += (y - m0) * (y - m0) / prior
        x[PROD, w] *= prior
        x[VARIANCE, w] = prior
        x[STEP, w] = -x[M, w]
    _unseen(x, n, 0.5 * dt)
    for w in range(BLOCK):
        x[STEP, w] = 2.0 * (x[M, w] + x[STEP, w])


@njit(cache=True, error_model="numpy", forceinline=True)
def _unseen(x, n, dt):  # type: ignore[no-untyped-def]
    """Move everything on by dt without observation."""
    c_d, c_h, theta = np.empty(STATIC), np.empty(STATIC), np.empty(STATIC)
    for w in range(BLOCK):
        for i in range(STATIC):
            theta[i], c_d[i], c_h[i] = x[THETA + i, w], x[C_D + i, w], x[C_H + i, w]
        rate = x[LAM, w] * factor_at(x[M, w], x[A, w], theta)
        moved = carried(c_d, c_h, x[M, w], x[A, w], x[LAM, w], rate, x[FADE, w], n, dt, theta)
        x[M, w], x[P, w], x[H, w], x[P_H, w], x[P_HH, w] = advance(
            x[M, w], x[P, w], x[H, w], x[P_H, w], x[P_HH, w], x[A, w], x[LAM, w], rate, x[Q2, w], x[G2, w], x[FADE, w],
            n, dt,
        )  # fmt: skip
        x[M, w] += moved
        for i in range(STATIC):
            x[C_D + i, w], x[C_H + i, w] = c_d[i], c_h[i]


@njit(cache=True, inline="always")
def _flow(x, n, stale):  # type: ignore[no-untyped-def]
    """End and middle of the cycle, the slopes there, and how much of a gust is felt; whether ln(m/a*) is stale.

    The flow is a -> a B^(-1/n), B = E + (a/a*)^n (1 - E), E = exp(-lambda dt); its slope E B^(-1/n - 1).
    """
    if n == -1.0:
        for w in range(BLOCK):
            x[HOLD, w] = 1.0
            x[END, w] = x[A, w] + (x[M, w] - x[A, w]) * x[HERE, w]
            x[SLOPE, w] = x[HERE, w]
        return stale
    if n == 2.0:
        for w in range(BLOCK):
            rel = max(x[M, w] / x[A, w], 1e-6)
            part = min(rel, 3.0)
            x[HOLD, w] = part * part * part
            x[BACK, w] = 1.0 / (x[HERE, w] + rel * rel * (1.0 - x[HERE, w]))
            x[BACK_HALF, w] = 1.0 / (x[HERE_HALF, w] + rel * rel * (1.0 - x[HERE_HALF, w]))
            x[RATIO, w], x[RATIO_HALF, w] = np.sqrt(x[BACK, w]), np.sqrt(x[BACK_HALF, w])
    elif n == 1.0:
        for w in range(BLOCK):
            rel = max(x[M, w] / x[A, w], 1e-6)
            part = min(rel, 3.0)
            x[HOLD, w] = part * part
            x[BACK, w] = 1.0 / (x[HERE, w] + rel * (1.0 - x[HERE, w]))
            x[BACK_HALF, w] = 1.0 / (x[HERE_HALF, w] + rel * (1.0 - x[HERE_HALF, w]))
            x[RATIO, w], x[RATIO_HALF, w] = x[BACK, w], x[BACK_HALF, w]
    elif n == 0.0:
        largest = 0.0
        for w in range(BLOCK):
            rel = x[M, w] / x[A, w]
            x[HOLD, w] = min(max(rel, 1e-6), 3.0)
            if stale or rel < 1e-5:
                x[LEVEL, w] = np.log(max(rel, 1e-6))
            largest = max(largest, abs(x[LEVEL, w] * (1.0 - x[HERE, w])))
        if largest < 0.5:
            for w in range(BLOCK):
                x[RATIO, w] = near_zero(-x[LEVEL, w] * (1.0 - x[HERE, w]))
                x[RATIO_HALF, w] = near_zero(-x[LEVEL, w] * (1.0 - x[HERE_HALF, w]))
        else:
            for w in range(BLOCK):
                x[RATIO, w] = np.exp(-x[LEVEL, w] * (1.0 - x[HERE, w]))
                x[RATIO_HALF, w] = np.exp(-x[LEVEL, w] * (1.0 - x[HERE_HALF, w]))
        for w in range(BLOCK):
            x[BACK, w], x[BACK_HALF, w] = 1.0, 1.0
    else:
        for w in range(BLOCK):
            rel = max(x[M, w] / x[A, w], 1e-6)
            x[HOLD, w] = gust_hold(x[M, w], x[A, w], n)
            end, slope = flow_above_floor(rel, 1.0, x[HERE, w], n)
            middle, slope_half = flow_above_floor(rel, 1.0, x[HERE_HALF, w], n)
            x[RATIO, w], x[RATIO_HALF, w] = end / rel, middle / rel
            x[BACK, w], x[BACK_HALF, w] = (
                slope / (end / rel * x[HERE, w]),
                slope_half / (middle / rel * x[HERE_HALF, w]),
            )
    for w in range(BLOCK):
        a = max(x[M, w], 1e-6 * x[A, w])
        x[END, w], x[MIDDLE, w] = a * x[RATIO, w], a * x[RATIO_HALF, w]
        x[SLOPE, w] = x[RATIO, w] * x[BACK, w] * x[HERE, w]
        x[SLOPE_HALF, w] = x[RATIO_HALF, w] * x[BACK_HALF, w] * x[HERE_HALF, w]
    return stale


@njit(cache=True, inline="always")
def _noise(x, n, dt):  # type: ignore[no-untyped-def]
    """Moments of unit broad-band noise over the cycle, by a series where that may be trusted."""
    largest = 0.0
    if n == -1.0:
        for w in range(BLOCK):
            x[LOSS, w] = x[RATE, w] * dt
            largest = max(largest, x[LOSS, w])
    else:
        for w in range(BLOCK):
            u = 1.0 - x[SLOPE, w]
            x[LOSS, w] = near_one(u)
            largest = max(largest, abs(u))
    for w in range(BLOCK):
        x[Q_END, w], x[Q_CROSS, w], x[Q_MEAN, w] = short_moments(x[LOSS, w], dt)
    if largest >= 0.3:
        for w in range(BLOCK):
            x[Q_END, w], x[Q_CROSS, w], x[Q_MEAN, w] = (
                noise_moments(x[RATE, w], dt) if n == -1.0 else moments_along(x[SLOPE, w], dt)
            )


@njit(cache=True, inline="always")
def _observe(x, y, s2, n, dt, first, departs):  # type: ignore[no-untyped-def]
    """One cycle: predict its mean, learn from what is seen, go to its end."""
    bent, kick = 0.5 * (n + 1.0), 0.0 if n == -1.0 else 0.5
    for w in range(BLOCK):
        m, p, hold = x[M, w], x[P, w], x[HOLD, w]
        slope, end = x[SLOPE, w], x[END, w]
        if n == -1.0:
            weight = (1.0 - slope) / (x[RATE, w] * dt)
            change, bend, bend_half = (weight - 1.0) * (m - x[A, w]), 0.0, 0.0
            start = x[A, w] + (y - x[A, w]) / weight if first else m
            x[CHANGE, w], x[STEP, w] = (weight - 1.0) * (start - x[A, w]), (slope - 1.0) * (start - x[A, w])
        else:
            # Simpson's rule; curvature of the flow to second order, and the drift that noise induces
            weight = (1.0 + 4.0 * x[SLOPE_HALF, w] + slope) * (1.0 / 6.0)
            change = (m + 4.0 * x[MIDDLE, w] + end) * (1.0 / 6.0) - m
            x[CHANGE, w], x[STEP, w] = change, end - m
            far = 1.0 / max(m, 3.0 * np.sqrt(p), 1e-300)
            bend = bent * p * slope * (slope / max(end, 1e-300) - far)
            bend_half = bent * p * x[SLOPE_HALF, w] * (x[SLOPE_HALF, w] / max(x[MIDDLE, w], 1e-300) - far)
        drift = kick * x[Q2, w] * dt * m / (m * m + p + 1e-300)
        push, weight_h, keep = hold * x[PUSH, w], hold * x[WEIGHT_H, w], x[KEEP, w]
        at_d = weight * p + weight_h * x[P_H, w]
        at_h = weight * x[P_H, w] + weight_h * x[P_HH, w]
        rough = ROUGH * ROUGH * x[DEPARTURE2, w] * x[STEP, w] * x[STEP, w]
        s = weight * at_d + weight_h * at_h + x[Q2, w] * x[Q_MEAN, w] + hold * hold * x[MM, w] + x[R2, w] * s2
        s += 0.25 * rough
        cross = slope * at_d + push * at_h + x[Q2, w] * x[Q_CROSS, w] + hold * hold * x[DM, w] + 0.5 * rough
        cross_h = keep * at_h + hold * x[HM, w]
        gain, gain_h = cross / s, cross_h / s
        at_once, by_end = hold * x[REST, w], hold * (1.0 - x[DECAY, w])
        v = y - m - change - (4.0 * bend_half + bend) * (1.0 / 6.0) - 0.5 * drift
        v -= weight_h * x[H, w] + at_once * x[THETA, w]
        x[M, w] = end + push * x[H, w] + by_end * x[THETA, w] + drift + bend + gain * v
        x[H, w] = keep * x[H, w] + gain_h * v
        mixed = slope * x[P_H, w] + push * x[P_HH, w]
        x[P, w] = slope * (slope * p + push * x[P_H, w]) + push * mixed - gain * cross
        x[P, w] += x[Q2, w] * x[Q_END, w] + hold * hold * x[DD, w] + rough
        x[P_H, w] = keep * mixed + hold * x[DH, w] - gain * cross_h
        x[P_HH, w] = keep * keep * x[P_HH, w] + x[HH, w] - gain_h * cross_h
        # The set-point: how it is felt in the mean, and where it is by the end.
        x[FELT, w] = weight * x[C_D, w] + weight_h * x[C_H, w] + at_once
        x[C_D, w] = slope * x[C_D, w] + push * x[C_H, w] + by_end - gain * x[FELT, w]
        x[C_H, w] = keep * x[C_H, w] - gain_h * x[FELT, w]
        x[V, w], x[S, w], x[GAIN, w], x[GAIN_H, w], x[INNOVATION, w] = v, s, gain, gain_h, v
        x[WEIGHT, w] = weight
    if departs:
        _learn(x, s2)
        return
    for w in range(BLOCK):
        p_felt, least = x[COV, w] * x[FELT, w], LEAST * x[R2, w] * s2
        total = x[S, w] + x[FELT, w] * p_felt
        lost, total = total < least, max(total, least)
        inverse = 1.0 / total
        learned = p_felt * x[V, w] * inverse
        x[QUAD, w] += _LOST if lost else x[V, w] * x[V, w] * inverse
        x[PROD, w] *= total
        x[VARIANCE, w] = total
        x[THETA, w] += learned
        x[M, w] += x[C_D, w] * learned
        x[H, w] += x[C_H, w] * learned
        x[COV, w] -= p_felt * p_felt * inverse


@njit(cache=True, inline="always")
def _learn(x, s2):  # type: ignore[no-untyped-def]
    """What the innovation says of the statics.  Loops over statics stay small enough to be unrolled."""
    for w in range(BLOCK):
        push, weight_h = x[HOLD, w] * x[PUSH, w], x[HOLD, w] * x[WEIGHT_H, w]
        for i in range(1, STATIC):
            felt = x[WEIGHT, w] * x[C_D + i, w] + weight_h * x[C_H + i, w] + x[SHAPE + i, w] * x[CHANGE, w]
            moved = x[SLOPE, w] * x[C_D + i, w] + push * x[C_H + i, w] + x[SHAPE + i, w] * x[STEP, w]
            x[C_D + i, w] = moved - x[GAIN, w] * felt
            x[C_H + i, w] = x[KEEP, w] * x[C_H + i, w] - x[GAIN_H, w] * felt
            x[FELT + i, w] = felt
    for w in range(BLOCK):
        for i in range(STATIC):
            p_felt = 0.0
            for j in range(STATIC):
                p_felt += x[COV + (i * (i + 1) // 2 + j if j <= i else j * (j + 1) // 2 + i), w] * x[FELT + j, w]
            x[P_FELT + i, w] = p_felt
    for w in range(BLOCK):
        total, least = x[S, w], LEAST * x[R2, w] * s2
        for i in range(STATIC):
            total += x[FELT + i, w] * x[P_FELT + i, w]
        lost, total = total < least, max(total, least)
        inverse = 1.0 / total
        x[QUAD, w] += _LOST if lost else x[V, w] * x[V, w] * inverse
        x[PROD, w] *= total
        x[VARIANCE, w] = total
        x[V, w] *= inverse
        x[S, w] = inverse
    for w in range(BLOCK):
        m, h = x[M, w], x[H, w]
        for i in range(STATIC):
            learned = x[P_FELT + i, w] * x[V, w]
            x[THETA + i, w] += learned
            m += x[C_D + i, w] * learned
            h += x[C_H + i, w] * learned
        x[M, w], x[H, w] = m, h
    for w in range(BLOCK):
        at = COV
        for i in range(STATIC):
            for j in range(i + 1):
                x[at, w] -= x[P_FELT + i, w] * x[P_FELT + j, w] * x[S, w]
                at += 1
