r"""The amplitude equation, once: its drift and its closed form, compiled for one amplitude; callable from Python too.

.. math:: \dot a = \frac{\lambda}{n}\, a\, \left[1 - (a/a^*)^n\right], \qquad
   a(t) = a^* \left[1 + ((a^*/a_0)^n - 1)\,e^{-\lambda t}\right]^{-1/n}
"""

import numpy as np

from scruton.compiled import njit
from scruton.dynamics.thresholds import FLOOR


@njit(cache=True, error_model="numpy")
def drift(a, a_star, lam, n):  # type: ignore[no-untyped-def]
    """da/dt at an amplitude, and its derivative in a."""
    if n == -1.0:
        return lam * (a_star - a), -lam
    level = np.log(a / a_star)
    if n == 0.0:
        return -lam * a * level, -lam * (level + 1.0)
    departure = np.expm1(n * level)
    return -lam * a * (departure / n), -lam * (departure / n + departure + 1.0)


@njit(cache=True, inline="always", error_model="numpy")
def flow(a, a_star, decay, n):  # type: ignore[no-untyped-def]
    """Amplitude after a time with exp(-lambda t) = `decay`, and its derivative in a."""
    if n == -1.0:
        return a_star + (a - a_star) * decay, decay
    if n == 2.0:
        start = a_star / a
        end = a_star / np.sqrt(1.0 + (start * start - 1.0) * decay)
        ratio = end / a
        return end, ratio * ratio * ratio * decay
    if n == 1.0:
        end = a_star / (1.0 + (a_star / a - 1.0) * decay)
        ratio = end / a
        return end, ratio * ratio * decay
    deviation = np.log(a / a_star)
    if n == 0.0:
        end = a_star * np.exp(deviation * decay)
        return end, end / a * decay
    shape = np.expm1(-n * deviation) * decay
    if shape <= -1.0:  # n < 0 and far below: the state has no real image; hold it at the floor
        return FLOOR * a_star, decay
    log_end = -np.log1p(shape) / n
    return a_star * np.exp(log_end), np.exp((n + 1.0) * (log_end - deviation)) * decay


@njit(cache=True, inline="always", error_model="numpy")
def flow_above_floor(a, a_star, decay, n):  # type: ignore[no-untyped-def]
    """`flow` from where the law lives: what a filter steps along."""
    return flow(a if n == -1.0 else max(a, FLOOR * a_star), a_star, decay, n)


@njit(cache=True, error_model="numpy")
def drifts(a, a_star, lam, n, rate):  # type: ignore[no-untyped-def]
    """`drift` into `rate`; arrays of one shape, (N,)."""
    for i in range(a.size):
        rate[i] = drift(a[i], a_star[i], lam[i], n[i])[0]


@njit(cache=True, error_model="numpy")
def flows(a, a_star, decay, n, end, slope):  # type: ignore[no-untyped-def]
    """`flow` into `end` and `slope`; arrays of one shape, (N,)."""
    for i in range(a.size):
        end[i], slope[i] = flow(a[i], a_star[i], decay[i], n[i])
