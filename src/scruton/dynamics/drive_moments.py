r"""What a drive, its gusts and its noise do to an amplitude over an interval: for one walker, and for several at once.

The amplitude forgets at a rate of either sign, x = rate dt, small in a cycle.  For walkers side by side all of it is
made of series of the phi functions of exponential integrators (Hochbruck & Ostermann, Acta Numerica 19, 2010) at -x,
phi_0 = exp(-x) and phi_(k+1) = (1/k! - phi_k)/x: no branch, so that the processor takes all of them at once.
"""

from math import factorial

import numpy as np

from scruton.compiled import njit
from scruton.dynamics import row
from scruton.dynamics.moments import NODES, WEIGHTS, gust_moments, mean_weight, moments_along

NEAR = 0.3  # largest x of the series
_N0, _N1, _N2, _N3, _N4 = (float(x) for x in NODES)
_W0, _W1, _W2, _W3, _W4 = (float(x) for x in WEIGHTS)
_F2, _F3, _F4, _F5, _F6, _F7, _F8, _F9, _F10 = (1.0 / factorial(i) for i in range(2, 11))


@njit(cache=True)
def moments_of_lane(x, w, dt):  # type: ignore[no-untyped-def]
    """Fill the rows from `PHI` on for one walker of any rate."""
    rate = x[row.RATE, w]
    if abs(rate * dt) < 1e-8:
        rate = 1e-8 / dt
    part, phi, each = mean_weight(rate, dt), np.exp(-x[row.RATE, w] * dt), 1.0 / rate
    x[row.PHI, w], x[row.HALF, w] = phi, np.exp(-x[row.HALF_LOSS, w])
    x[row.HOLD, w], x[row.HOLD_MEAN, w] = part * dt, (1.0 - part) * each
    # those of a gust towards which the amplitude relaxes, which is a drive over the rate
    keep, push, push_mean, dd, dh, hh, dm, hm, mm = gust_moments(rate, x[row.FADE, w], dt)
    x[row.KEEP, w], x[row.PUSH, w], x[row.PUSH_MEAN, w] = keep, push * each, push_mean * each
    x[row.DD, w], x[row.DH, w], x[row.HH, w] = each * each * dd, each * dh, hh
    x[row.DM, w], x[row.HM, w], x[row.MM, w] = each * each * dm, each * hm, each * each * mm
    x[row.Q_END, w], x[row.Q_CROSS, w], x[row.Q_MEAN, w] = moments_along(phi, dt)


@njit(cache=True)
def gust_decay(x, dt):  # type: ignore[no-untyped-def]
    """What is left of a gust after dt, and after each of Gauss's nodes: what does not change while the period stays."""
    for w in range(row.LANES):
        fade = x[row.FADE, w]
        x[row.KEEP, w], x[row.HH, w] = np.exp(-fade * dt), -np.expm1(-2.0 * fade * dt)
        for i in range(NODES.size):
            x[row.NODE + i, w] = np.exp(-fade * dt * NODES[i])


@njit(cache=True, inline="always")
def moments_of_all(x, dt, gusty):  # type: ignore[no-untyped-def]
    """Fill the rows from `PHI` on for all walkers, after `gust_decay` where any of them has gusts.

    How much of the amplitude is left, what gust and offset do to (state, mean), and the covariances that build up.
    """
    for w in range(row.LANES):
        loss = x[row.RATE, w] * dt
        fastest = max(abs(x[row.RATE, w]), abs(x[row.RATE, w] - x[row.FADE, w])) * dt
        x[row.FAR, w] = 0.0 if max(fastest, abs(x[row.HALF_LOSS, w])) < NEAR else 1.0  # also where it is no number
        two = loss * loss
        third = (_F7 - loss * _F8) + two * (_F9 - loss * _F10)
        third = (_F3 - loss * _F4) + two * ((_F5 - loss * _F6) + two * third)
        second = 0.5 - loss * third
        first = 1.0 - loss * second
        fallen = 1.0 - loss * first
        x[row.PHI, w], x[row.HOLD, w], x[row.HOLD_MEAN, w] = fallen, first * dt, second * dt
        x[row.Q_END, w], x[row.Q_CROSS, w] = 0.5 * dt * first * (1.0 + fallen), 0.5 * dt * first * first
        x[row.Q_MEAN, w] = dt * (second - third - 0.5 * loss * second * second)
        x[row.HALF, w] = 1.0 - x[row.HALF_LOSS, w] * _phi_1(x[row.HALF_LOSS, w])
    if gusty:
        for w in range(row.LANES):
            x[row.DD, w] = x[row.DH, w] = x[row.DM, w] = x[row.HM, w] = x[row.MM, w] = 0.0
        _node(x, dt, 0, _N0, _W0)
        _node(x, dt, 1, _N1, _W1)
        _node(x, dt, 2, _N2, _W2)
        _node(x, dt, 3, _N3, _W3)
        _node(x, dt, 4, _N4, _W4)
        for w in range(row.LANES):
            push = dt * x[row.KEEP, w] * _phi_1((x[row.RATE, w] - x[row.FADE, w]) * dt)
            x[row.PUSH, w], x[row.PUSH_MEAN, w] = push, (x[row.HOLD, w] - push) / (x[row.FADE, w] * dt)
    far = 0.0
    for w in range(row.LANES):
        far += x[row.FAR, w]
    if far > 0.0:
        for w in range(row.LANES):
            if x[row.FAR, w] > 0.0:
                moments_of_lane(x, w, dt)


@njit(cache=True, inline="always")
def _phi_1(x):  # type: ignore[no-untyped-def]
    """(1 - exp(-x)) / x as a series."""
    two = x * x
    end = (_F7 - x * _F8) + two * (_F9 - x * _F10)
    return (1.0 - x * _F2) + two * ((_F3 - x * _F4) + two * ((_F5 - x * _F6) + two * end))


@njit(cache=True, inline="always")
def _node(x, dt, i, node, weight):  # type: ignore[no-untyped-def]
    """One node of Gauss's rule over the time since the gust's noise, as in `gust_moments`."""
    u = node * dt
    for w in range(row.LANES):
        rate, fade, left = x[row.RATE, w], x[row.FADE, w], x[row.NODE + i, w]
        push = u * left * _phi_1((rate - fade) * u)
        mean = (u * _phi_1(rate * u) - push) / (fade * dt)
        part = 2.0 * fade * dt * weight
        x[row.DD, w] += part * push * push
        x[row.DH, w] += part * push * left
        x[row.DM, w] += part * push * mean
        x[row.HM, w] += part * left * mean
        x[row.MM, w] += part * mean * mean
