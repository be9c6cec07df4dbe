r"""What a drive, its gusts and its noise do to an amplitude over an interval: for one walker, and for several at once.

The amplitude forgets at a rate of either sign, x = rate dt, small in a cycle.  For walkers side by side all of it is
made of series of the phi functions of exponential integrators (Hochbruck & Ostermann, Acta Numerica 19, 2010) at -x,
phi_0 = exp(-x) and phi_(k+1) = (1/k! - phi_k)/x: no branch, so that the processor takes all of them at once.
"""

from math import factorial

import numpy as np
from numba import njit

from scruton.dynamics.effects.terms import COLUMNS
from scruton.dynamics.moments import gust_moments, mean_weight, moments_along

LANES = 16  # walkers side by side
NEAR = 0.3  # largest x of the series
# Rows of the array that the filter with effects carries, after the coefficients: states (amplitude, the wake's, gust,
# offset) and their covariances; what goes in here; what comes out.
(
    M, P, LAGGED, H, O, P_H, P_O, P_HH, P_HO, P_OO,
    RATE, HALF_LOSS, FADE, NODE,
) = range(COLUMNS, COLUMNS + 14)  # fmt: skip
(
    PHI, HALF, KEEP, PUSH, PUSH_MEAN, HOLD, HOLD_MEAN, DD, DH, HH, DM, HM, MM, Q_END, Q_CROSS, Q_MEAN,
    _FAR,
) = range(NODE + 5, NODE + 22)  # fmt: skip
ROWS = NODE + 22

_NODES, _WEIGHTS = (0.5 * (1.0 + x) if i == 0 else 0.5 * x for i, x in enumerate(np.polynomial.legendre.leggauss(5)))
_N0, _N1, _N2, _N3, _N4 = (float(x) for x in _NODES)
_W0, _W1, _W2, _W3, _W4 = (float(x) for x in _WEIGHTS)
_F2, _F3, _F4, _F5, _F6, _F7, _F8, _F9, _F10 = (1.0 / factorial(i) for i in range(2, 11))


@njit(cache=True)
def drive_moments(rate, fade, dt):  # type: ignore[no-untyped-def]
    """What the drive's gusts and offset do over one interval to an amplitude that forgets at a rate of either sign.

    The gust's decay, its response (state, mean), that to the offset (state, mean), and the covariances that a gust of
    unit standard deviation builds up: (state, state), (state, gust), (gust, gust), (state, mean), (gust, mean),
    (mean, mean).  Without a `fade` there is no gust.
    """
    if abs(rate * dt) < 1e-8:
        rate = 1e-8 / dt
    part = mean_weight(rate, dt)
    hold, hold_mean = part * dt, (1.0 - part) / rate
    if fade <= 0.0:
        return 1.0, 0.0, 0.0, hold, hold_mean, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    # those of a gust towards which the amplitude relaxes, which is a drive over the rate
    keep, push, push_mean, dd, dh, hh, dm, hm, mm = gust_moments(rate, fade, dt)
    each = 1.0 / rate
    return (
        keep, push * each, push_mean * each, hold, hold_mean,
        each * each * dd, each * dh, hh, each * each * dm, each * hm, each * each * mm,
    )  # fmt: skip


@njit(cache=True)
def moments_of_lane(x, w, dt):  # type: ignore[no-untyped-def]
    """Fill the rows from `PHI` on for one walker of any rate."""
    fade = x[FADE, w]
    phi = np.exp(-x[RATE, w] * dt)
    x[PHI, w], x[HALF, w] = phi, np.exp(-x[HALF_LOSS, w])
    (
        x[KEEP, w], x[PUSH, w], x[PUSH_MEAN, w], x[HOLD, w], x[HOLD_MEAN, w],
        x[DD, w], x[DH, w], x[HH, w], x[DM, w], x[HM, w], x[MM, w],
    ) = drive_moments(x[RATE, w], fade, dt)  # fmt: skip
    x[Q_END, w], x[Q_CROSS, w], x[Q_MEAN, w] = moments_along(phi, dt)


@njit(cache=True)
def gust_decay(x, dt):  # type: ignore[no-untyped-def]
    """What is left of a gust after dt, and after each of Gauss's nodes: what does not change while the period stays."""
    for w in range(LANES):
        fade = x[FADE, w]
        x[KEEP, w], x[HH, w] = np.exp(-fade * dt), -np.expm1(-2.0 * fade * dt)
        for i in range(5):
            x[NODE + i, w] = np.exp(-fade * dt * _NODES[i])


@njit(cache=True, inline="always")
def moments_of_all(x, dt, gusty):  # type: ignore[no-untyped-def]
    """Fill the rows from `PHI` on for all walkers, after `gust_decay` where any of them has gusts."""
    for w in range(LANES):
        loss = x[RATE, w] * dt
        fastest = max(abs(x[RATE, w]), abs(x[RATE, w] - x[FADE, w])) * dt
        x[_FAR, w] = 0.0 if max(fastest, abs(x[HALF_LOSS, w])) < NEAR else 1.0  # also where it is no number
        two = loss * loss
        third = (_F7 - loss * _F8) + two * (_F9 - loss * _F10)
        third = (_F3 - loss * _F4) + two * ((_F5 - loss * _F6) + two * third)
        second = 0.5 - loss * third
        first = 1.0 - loss * second
        fallen = 1.0 - loss * first
        x[PHI, w], x[HOLD, w], x[HOLD_MEAN, w] = fallen, first * dt, second * dt
        x[Q_END, w], x[Q_CROSS, w] = 0.5 * dt * first * (1.0 + fallen), 0.5 * dt * first * first
        x[Q_MEAN, w] = dt * (second - third - 0.5 * loss * second * second)
        x[HALF, w] = 1.0 - x[HALF_LOSS, w] * _phi_1(x[HALF_LOSS, w])
    if gusty:
        for w in range(LANES):
            x[DD, w] = x[DH, w] = x[DM, w] = x[HM, w] = x[MM, w] = 0.0
        _node(x, dt, 0, _N0, _W0)
        _node(x, dt, 1, _N1, _W1)
        _node(x, dt, 2, _N2, _W2)
        _node(x, dt, 3, _N3, _W3)
        _node(x, dt, 4, _N4, _W4)
        for w in range(LANES):
            push = dt * x[KEEP, w] * _phi_1((x[RATE, w] - x[FADE, w]) * dt)
            x[PUSH, w], x[PUSH_MEAN, w] = push, (x[HOLD, w] - push) / (x[FADE, w] * dt)
    far = 0.0
    for w in range(LANES):
        far += x[_FAR, w]
    if far > 0.0:
        for w in range(LANES):
            if x[_FAR, w] > 0.0:
                moments_of_lane(x, w, dt)


@njit(cache=True, inline="always")
def _phi_1(x):  # type: ignore[no-untyped-def]
    two = x * x
    end = (_F7 - x * _F8) + two * (_F9 - x * _F10)
    return (1.0 - x * _F2) + two * ((_F3 - x * _F4) + two * ((_F5 - x * _F6) + two * end))


@njit(cache=True, inline="always")
def _node(x, dt, i, node, weight):  # type: ignore[no-untyped-def]
    """One node of Gauss's rule over the time since the gust's noise, as in `gust_moments`."""
    u = node * dt
    for w in range(LANES):
        rate, fade, left = x[RATE, w], x[FADE, w], x[NODE + i, w]
        push = u * left * _phi_1((rate - fade) * u)
        mean = (u * _phi_1(rate * u) - push) / (fade * dt)
        part = 2.0 * fade * dt * weight
        x[DD, w] += part * push * push
        x[DH, w] += part * push * left
        x[DM, w] += part * push * mean
        x[HM, w] += part * left * mean
        x[MM, w] += part * mean * mean
