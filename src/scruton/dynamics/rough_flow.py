"""The way of the amplitude through a cycle where terms are no polynomial of it, of the walkers that stand side by side.

Every term adds to da/dt by itself, in a loop of its own over all walkers; the wake that remembers, whose terms are
those of another amplitude, goes through them one by one.
"""

import numpy as np

from scruton.compiled import njit
from scruton.dynamics import row
from scruton.dynamics.effect_drift import (
    drift_of,
    excess,
    friction,
    incoherence,
    polynomial,
    power_growth,
    rise,
    smooth_friction,
)
from scruton.dynamics.effects.terms import Term

_F, _FS, _FP, _HUMP = (
    int(Term.FRICTION), int(Term.FRICTION_SPRING), int(Term.FRICTION_POWER), int(Term.FRICTION_HUMP)
)  # fmt: skip
_RISE, _COH, _LAW, _EXPONENT = (
    int(Term.STRUCTURAL_RISE), int(Term.COHERENCE), int(Term.LAW_POWER), int(Term.LAW_EXPONENT)
)  # fmt: skip
_LAG, _LATE = int(Term.LAG), int(Term.LATE)


@njit(cache=True)
def kinds(x):  # type: ignore[no-untyped-def]
    """Whether any walker has a wake that remembers, friction that is sudden, that is not, and each other rough term."""
    lagging = dry = odd = rising = incoherent = by_power = hats = False
    for w in range(row.LANES):
        special = x[_FS, w] != 0.0 or x[_FP, w] != 0.0 or x[_HUMP, w] != 0.0
        lagging |= x[_LAG, w] > 0.0 or x[_LATE, w] != 0.0
        dry |= x[_F, w] != 0.0 and not special
        odd |= x[_F, w] != 0.0 and special
        rising |= x[_RISE, w] != 0.0
        incoherent |= x[_COH, w] > 0.0
        by_power |= x[_LAW, w] != 0.0
        hats |= x[row.ROUGH, w] > 1.5
    return lagging, dry and not odd, odd, rising, incoherent, by_power, hats


@njit(cache=True, error_model="numpy")
def rough_flow(x, lanes, dt, knots, acting):  # type: ignore[no-untyped-def]
    """End and middle of the cycle by Runge-Kutta, and how fast deviations fade on the way; `acting` are the `kinds`."""
    if acting[0]:
        _remembering(x, lanes, dt, knots)
        return
    for w in range(row.LANES):
        k0, k1, k2, k3, k5 = polynomial(x, w, x[row.WIND, w], x[row.STILL, w], x[row.DRIVE, w], x[row.FORCE, w])
        x[row.K0, w], x[row.K1, w], x[row.K2, w], x[row.K3, w], x[row.K5, w] = k0, k1, k2, k3, k5
        x[row.AT, w] = x[row.M, w]
    _rates(x, lanes, knots, acting)
    for w in range(row.LANES):
        x[row.RISES_0, w], x[row.BENDS_0, w] = x[row.RISES, w], x[row.BENDS, w]
        x[row.AT, w] = x[row.M, w] + 0.5 * dt * x[row.RISES, w]
    _rates(x, lanes, knots, acting)
    for w in range(row.LANES):
        x[row.RISES_1, w] = x[row.RISES, w]
        x[row.AT, w] = x[row.M, w] + 0.5 * dt * x[row.RISES, w]
    _rates(x, lanes, knots, acting)
    for w in range(row.LANES):
        x[row.RISES_2, w] = x[row.RISES, w]
        x[row.AT, w] = x[row.M, w] + dt * x[row.RISES, w]
    _rates(x, lanes, knots, acting)
    for w in range(row.LANES):
        f = x[row.RISES_0, w] + 2.0 * (x[row.RISES_1, w] + x[row.RISES_2, w]) + x[row.RISES, w]
        x[row.END, w] = x[row.M, w] + dt / 6.0 * f
        x[row.AT, w] = x[row.END, w]
    _rates(x, lanes, knots, acting)
    for w in range(row.LANES):
        x[row.BENDS_1, w] = x[row.BENDS, w]
        bow = 0.125 * dt * (x[row.RISES_0, w] - x[row.RISES, w])
        x[row.MIDDLE, w] = 0.5 * (x[row.M, w] + x[row.END, w]) + bow
        x[row.AT, w] = x[row.MIDDLE, w]
    _rates(x, lanes, knots, acting)
    for w in range(row.LANES):
        x[row.HALF_LOSS, w] = -0.25 * dt * (x[row.BENDS_0, w] + x[row.BENDS, w])
        x[row.RATE, w] = (x[row.BENDS_0, w] + 4.0 * x[row.BENDS, w] + x[row.BENDS_1, w]) * (-1.0 / 6.0)


@njit(cache=True, error_model="numpy")
def _rates(x, lanes, knots, acting):  # type: ignore[no-untyped-def]
    """da/dt of every walker at the amplitude `AT`, and its derivative."""
    _, dry, odd, rising, incoherent, by_power, hats = acting
    for w in range(row.LANES):
        a, k1, k2, k3, k5 = x[row.AT, w], x[row.K1, w], x[row.K2, w], x[row.K3, w], x[row.K5, w]
        x[row.RISES, w] = x[row.K0, w] + a * (k1 + a * (k2 + a * (k3 + a * a * k5)))
        x[row.BENDS, w] = k1 + a * (2.0 * k2 + a * (3.0 * k3 + 5.0 * a * a * k5))
    if dry:
        for w in range(row.LANES):
            loss, steep = smooth_friction(x, w, x[row.AT, w])
            x[row.RISES, w] -= loss
            x[row.BENDS, w] -= steep
    for w in range(lanes if odd else 0):
        if x[_F, w] != 0.0:
            loss, steep = friction(x, w, x[row.AT, w])
            x[row.RISES, w] -= loss
            x[row.BENDS, w] -= steep
    for w in range(lanes if rising else 0):
        if x[_RISE, w] != 0.0:
            loss, steep = rise(x, w, x[row.AT, w])
            x[row.RISES, w] -= loss
            x[row.BENDS, w] -= steep
    for w in range(lanes if incoherent else 0):
        if x[_COH, w] > 0.0:
            wind2 = x[row.WIND, w] * x[row.WIND, w]
            lost, slope = incoherence(x, w, x[row.AT, w], x[row.DRIVE, w])
            x[row.RISES, w] -= wind2 * lost
            x[row.BENDS, w] += wind2 * slope
    for w in range(lanes if by_power else 0):
        if x[_LAW, w] != 0.0:
            faster = x[row.WIND, w] * power_growth(x, w, x[row.AT, w])
            x[row.RISES, w] += faster * x[row.AT, w]
            x[row.BENDS, w] += (1.0 + x[_EXPONENT, w]) * faster
    for w in range(lanes if hats else 0):
        if x[row.ROUGH, w] > 1.5:
            loss, steep = excess(x, w, x[row.AT, w], knots)
            x[row.RISES, w] -= loss
            x[row.BENDS, w] -= steep


@njit(cache=True, error_model="numpy")
def _remembering(x, lanes, dt, knots):  # type: ignore[no-untyped-def]
    """The same, and where the wake's amplitude comes to, of walkers one by one."""
    for w in range(lanes):
        m, lagged = x[row.M, w], x[row.LAGGED, w]
        lag_mid = lag_end = lagged
        if x[_LAG, w] > 0.0:
            lag_mid = lagged + (m - lagged) * (1.0 - np.exp(-0.5 * dt / x[_LAG, w]))
        f0, d0 = drift_here(x, w, m, lagged, knots)
        f1, _ = drift_here(x, w, m + 0.5 * dt * f0, lag_mid, knots)
        f2, _ = drift_here(x, w, m + 0.5 * dt * f1, lag_mid, knots)
        if x[_LAG, w] > 0.0:
            middle = m + 0.5 * dt * f2
            lag_end = lagged + (middle - lagged) * (1.0 - np.exp(-dt / x[_LAG, w]))
        f3, _ = drift_here(x, w, m + dt * f2, lag_end, knots)
        end = m + dt / 6.0 * (f0 + 2.0 * f1 + 2.0 * f2 + f3)
        fe, de = drift_here(x, w, end, lag_end, knots)
        middle = 0.5 * (m + end) + 0.125 * dt * (f0 - fe)
        _, dm = drift_here(x, w, middle, lag_mid, knots)
        x[row.END, w], x[row.MIDDLE, w], x[row.LAGGED, w] = end, middle, lag_end
        x[row.HALF_LOSS, w], x[row.RATE, w] = -0.25 * dt * (d0 + dm), -(d0 + 4.0 * dm + de) / 6.0


@njit(cache=True)
def drift_here(x, w, a, lagged, knots):  # type: ignore[no-untyped-def]
    """da/dt of one walker in the weather of the cycle, and its derivative."""
    return drift_of(
        a, lagged, x, w, x[row.WIND, w], x[row.STILL, w], x[row.DRIVE, w], x[row.FORCE, w], x[row.ROUGH, w] > 1.5, knots
    )
