r"""The amplitude equation and its laws: one family, ordered by an exponent n.

.. math:: \dot a = \frac{\lambda}{n}\, a\, \left[1 - (a/a^*)^n\right]

n = -1 is the law of Gao et al. (Eq. 10 of the Griffin-plot paper: linear in a), n -> 0 is Gompertz, n = 1 quadratic,
n = 2 Ehsan and Scanlan (Van der Pol, Rayleigh), and n = 2 nu Larsen's with his exponent nu.  lambda is the rate at
which a small deviation from the stable amplitude dies out, in 1/s, the same under every law.
"""

import numpy as np
from numpy.typing import ArrayLike

from scruton.arrays import FloatArray

LAWS: dict[str, float] = {"paper": -1.0, "gompertz": 0.0, "quadratic": 1.0, "ehsan-scanlan": 2.0}


def larsen(nu: float) -> float:
    """Exponent n of Larsen's law, whose damping varies as abs(y/D)^(2 nu) (Larsen, 1995)."""
    return 2.0 * nu


def rate(a: ArrayLike, a_star: ArrayLike, lam: ArrayLike, n: ArrayLike) -> FloatArray:
    """Right-hand side of the amplitude equation, da/dt.

    Parameters
    ----------
    a : array_like
        Amplitude, > 0 (>= 0 for n = -1), A/D or rad.
    a_star, lam, n : array_like
        Stable amplitude, relaxation rate [1/s], exponent; all broadcast.
    """
    a, a_star, lam, n = (np.asarray(one, dtype=np.float64) for one in (a, a_star, lam, n))
    # a^(n+1) keeps n = -1 finite at a = 0; expm1 keeps n -> 0 exact.
    with np.errstate(divide="ignore", invalid="ignore"):
        log_ratio = np.log(a / a_star)
        general = -lam * a * _expm1_over(n, log_ratio)
    linear: FloatArray = lam * (a_star - a)
    return np.where(n == -1.0, linear, general)


def closed_form(t: ArrayLike, a0: ArrayLike, a_star: ArrayLike, lam: ArrayLike, n: ArrayLike) -> FloatArray:
    """Amplitude at time t [s] after a0: a* [1 + ((a*/a0)^n - 1) exp(-lambda t)]^(-1/n).

    `a0` may be zero for n = -1; under the other laws the amplitude never leaves zero.
    """
    t, a0, a_star, lam, n = (np.asarray(one, dtype=np.float64) for one in (t, a0, a_star, lam, n))
    decay = np.exp(-lam * t)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        deviation = np.log(a0 / a_star)
        # ln(a/a*) = -ln(1 + (exp(-n L) - 1) E)/n with L = ln(a0/a*), E = exp(-lambda t).
        shape = np.expm1(-n * deviation) * decay
        general = a_star * np.exp(np.where(n == 0.0, deviation * decay, -np.log1p(shape) / np.where(n == 0.0, 1.0, n)))
    linear: FloatArray = a_star + (a0 - a_star) * decay
    return np.where(n == -1.0, linear, general)


def flow_derivative(t: ArrayLike, a0: ArrayLike, a_star: ArrayLike, lam: ArrayLike, n: ArrayLike) -> FloatArray:
    """Derivative of `closed_form` with respect to a0: (a/a0)^(n+1) exp(-lambda t)."""
    a = closed_form(t, a0, a_star, lam, n)
    with np.errstate(divide="ignore", invalid="ignore"):
        power = np.where(np.asarray(n) == -1.0, 1.0, (a / np.asarray(a0)) ** (np.asarray(n) + 1.0))
    derivative: FloatArray = power * np.exp(-np.asarray(lam) * np.asarray(t))
    return derivative


def extrapolation_index(scruton_number: ArrayLike, tested: ArrayLike, relaxation: ArrayLike) -> FloatArray:
    """How far a setting lies from the tested one: x = (Sc' - Sc)/Sc_lambda = omega0 (xi' - xi)/lambda.

    Laws agree for abs(x) < 0.2 and part beyond 0.3.  `relaxation` is the Scruton number that belongs to lambda,
    Sc_lambda = Sc lambda/(omega0 xi).
    """
    index: FloatArray = (np.asarray(scruton_number) - np.asarray(tested)) / np.asarray(relaxation)
    return index


def amplitude_ratio(x: ArrayLike, n: ArrayLike) -> FloatArray:
    """Stable amplitude at another damping over the tested one: (1 - n x)^(1/n), exp(-x) at n = 0.

    Zero where the vibration dies (n > 0 and x >= 1/n); infinite where no amplitude is stable (n < 0 and
    x <= 1/n: for the paper's law below x = -1).
    """
    x, n = np.broadcast_arrays(np.asarray(x, dtype=np.float64), np.asarray(n, dtype=np.float64))
    base = -n * x
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.exp(np.where(n == 0.0, -x, np.log1p(np.maximum(base, -1.0)) / np.where(n == 0.0, 1.0, n)))
    end: FloatArray = np.where(base > -1.0, ratio, np.where(n > 0.0, 0.0, np.inf))
    return end


def index_of(log_ratio: ArrayLike, n: ArrayLike) -> FloatArray:
    """Inverse of `amplitude_ratio`: the index x at which the amplitude is exp(`log_ratio`) times the tested one.

    x = (1 - r^n)/n, and -ln r at n = 0.
    """
    return -_expm1_over(np.asarray(n, dtype=np.float64), np.asarray(log_ratio, dtype=np.float64))


def _expm1_over(n: FloatArray, log_ratio: FloatArray) -> FloatArray:
    """(exp(n L) - 1)/n, and L at n = 0."""
    value: FloatArray = np.where(n == 0.0, log_ratio, np.expm1(n * log_ratio) / np.where(n == 0.0, 1.0, n))
    return value
