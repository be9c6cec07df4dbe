"""Moments of the state and of its mean over a cycle under white noise: what all filters have in common."""

import numpy as np

from scruton.compiled import njit

# In kernels a square is written x * x: numba makes a product of x ** 2 or a call of pow, whichever function it happened
# to compile first, and the last bit differs.

LOG_2PI = float(np.log(2.0 * np.pi))
# Gauss's rule on (0, 1).
NODES, WEIGHTS = (0.5 * (1.0 + x) if i == 0 else 0.5 * x for i, x in enumerate(np.polynomial.legendre.leggauss(5)))


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
def gust_response(lam, k, u):  # type: ignore[no-untyped-def]
    """Amplitude after u by a unit of gust at its start: lam (e^{-lam u} - e^{-k u}) / (k - lam), smooth at k = lam."""
    x = (lam - k) * u
    return lam * u * np.exp(-lam * u) * (np.expm1(x) / x if abs(x) > 1e-8 else 1.0 + 0.5 * x)


@njit(cache=True, fastmath=False, error_model="numpy")  # else those of the kernel that happens to call it first
def gust_moments(lam, k, dt):  # type: ignore[no-untyped-def]
    """What a gust does over one interval: its own decay, its response (state, mean), and six covariances for unit sd.

    The gust is an Ornstein-Uhlenbeck process of rate k towards which the amplitude relaxes at the rate lam.  The
    covariances are those of (state, state), (state, gust), (gust, gust), (state, mean), (gust, mean), (mean, mean),
    by Gauss's rule: exact to 1e-8 for lam dt, k dt < 1.
    """
    keep = np.exp(-k * dt)
    response = gust_response(lam, k, dt)
    weight = (-np.expm1(-k * dt) / k - response / lam) / dt
    dd = dg = dm = gm = mm = 0.0
    for j in range(NODES.size):
        u = dt * NODES[j]
        part = 2.0 * k * dt * WEIGHTS[j]
        d, g = gust_response(lam, k, u), np.exp(-k * u)
        m = ((1.0 - g) / k - d / lam) / dt
        dd += part * d * d
        dg += part * d * g
        dm += part * d * m
        gm += part * g * m
        mm += part * m * m
    return keep, response, weight, dd, dg, -np.expm1(-2.0 * k * dt), dm, gm, mm


@njit(cache=True, inline="always")
def gust_covariance(lam, k, dt):  # type: ignore[no-untyped-def]
    """Covariances (state, state), (state, gust) that a gust of unit sd builds up over any time: stationary less kept.

    The stationary covariance of state and gust is lam/(lam + k), of both kinds.
    """
    still = lam / (lam + k)
    f, e, r = np.exp(-lam * dt), np.exp(-k * dt), gust_response(lam, k, dt)
    dd = still - (f * f * still + 2.0 * f * r * still + r * r)
    dg = still - e * (f * still + r)
    return max(dd, 0.0), dg


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
