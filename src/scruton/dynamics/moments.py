"""Moments of the state and of its mean over a cycle under white noise: what all filters have in common."""

import numpy as np
from numba import njit

# In kernels a square is written x * x: numba makes a product of x ** 2 or a call of pow, whichever function it happened
# to compile first, and the last bit differs.

LOG_2PI = float(np.log(2.0 * np.pi))


@njit(cache=True, inline="always")
def mean_weight(lam, dt):  # type: ignore[no-untyped-def]
    """(1 - exp(-lam dt)) / (lam dt): weight of the state at the start in the mean over an interval."""
    x = lam * dt
    return -np.expm1(-x) / x if abs(x) > 1e-8 else 1.0 - 0.5 * x


@njit(cache=True, inline="always")
def noise_moments(lam, dt):  # type: ignore[no-untyped-def]
    """Covariance of (state at the end, mean over the interval) for unit q: exact for the linear equation.

    Series for small lam dt, where the closed forms cancel (they lose all digits below about 1e-5).
    """
    x = lam * dt
    if abs(x) < 1e-2:
        q_end = dt * (1.0 + x * (-1.0 + x * (2.0 / 3.0 - x / 3.0)))
        q_cross = dt * (0.5 + x * (-0.5 + x * (7.0 / 24.0 - x / 8.0)))
        q_mean = dt * (1.0 / 3.0 + x * (-0.25 + x * (7.0 / 60.0 - x / 24.0)))
        return q_end, q_cross, q_mean
    once = -np.expm1(-x)
    twice = -np.expm1(-2.0 * x)
    q_end = twice / (2.0 * lam)
    q_cross = once * once / (2.0 * lam * x)
    q_mean = (dt - 2.0 * once / lam + twice / (2.0 * lam)) / (x * x)
    return q_end, q_cross, q_mean


@njit(cache=True, inline="always")
def moments_along(slope, dt):  # type: ignore[no-untyped-def]
    """`noise_moments` for the local rate -ln(slope)/dt of a flow; logarithms cost more than a series near 1."""
    x = 1.0 - slope
    if abs(x) < 0.05:
        x = x * (1.0 + x * (0.5 + x * (1.0 / 3.0 + x * (0.25 + x * (0.2 + x / 6.0)))))
    else:
        x = -np.log(max(slope, 1e-300))
    if abs(x) < 0.06:
        q_end = dt * (1.0 + x * (-1.0 + x * (2.0 / 3.0 + x * (-1.0 / 3.0 + x * (2.0 / 15.0 - x * 2.0 / 45.0)))))
        q_cross = dt * (0.5 + x * (-0.5 + x * (7.0 / 24.0 + x * (-0.125 + x * (31.0 / 720.0 - x / 80.0)))))
        q_mean = dt * (1.0 / 3.0 + x * (-0.25 + x * (7.0 / 60.0 + x * (-1.0 / 24.0 + x * (31.0 / 2520.0 - x / 320.0)))))
        return q_end, q_cross, q_mean
    return noise_moments(x / dt, dt)


@njit(cache=True, inline="always")
def noise_drift(a, p, q2, dt):  # type: ignore[no-untyped-def]
    """Drift q^2/2a that broad-band forcing induces, bounded where the amplitude is lost in its variance."""
    return 0.5 * q2 * dt * a / (a * a + p + 1e-300)


@njit(cache=True, inline="always")
def short_moments(x, dt):  # type: ignore[no-untyped-def]
    """`noise_moments` as series in x = lambda dt, to 1e-9 for abs(x) < 0.36: no branch, so that loops vectorise."""
    y = -2.0 * x
    y4 = y * y * y * y
    g2 = 1.0 + y / 2 * (1.0 + y / 3 * (1.0 + y / 4 * (1.0 + y / 5 * (1.0 + y / 6 * (1.0 + y / 7 * (1.0 + y / 8))))))
    g2 += y4 * y4 / 362880.0 * (1.0 + y / 10 * (1.0 + y / 11))
    x = -x
    x3 = x * x * x
    g = 1.0 + x / 2 * (1.0 + x / 3 * (1.0 + x / 4 * (1.0 + x / 5 * (1.0 + x / 6 * (1.0 + x / 7 * (1.0 + x / 8))))))
    q_mean = 1.0 / 3.0 + x * (0.25 + x * (7.0 / 60.0 + x * (1.0 / 24.0 + x * (31.0 / 2520.0 + x * (1.0 / 320.0)))))
    q_mean += x3 * x3 * (127.0 / 181440.0 + x * (17.0 / 120960.0 + x * (73.0 / 2851200.0)))
    return dt * g2, dt * 0.5 * g * g, dt * q_mean


@njit(cache=True, inline="always")
def near_one(u):  # type: ignore[no-untyped-def]
    """-ln(1 - u) to 1e-8 for abs(u) < 0.3, without a branch."""
    u = u / (2.0 - u)
    v = u * u
    return 2.0 * u * (1.0 + v * (1.0 / 3.0 + v * (0.2 + v * (1.0 / 7.0 + v * (1.0 / 9.0)))))


@njit(cache=True, inline="always")
def near_zero(u):  # type: ignore[no-untyped-def]
    """exp(u) to 1e-10 for abs(u) < 0.5, without a branch."""
    u *= 0.25
    e = 1.0 + u * (1.0 + u / 2 * (1.0 + u / 3 * (1.0 + u / 4 * (1.0 + u / 5 * (1.0 + u / 6 * (1.0 + u / 7))))))
    e *= e
    return e * e
