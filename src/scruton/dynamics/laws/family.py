r"""The amplitude equation and its laws: one family, ordered by an exponent n.

.. math:: \dot a = \frac{\lambda}{n}\, a\, \left[1 - (a/a^*)^n\right]

n = -1 is the law of Gao et al. (Eq. 10 of the Griffin-plot paper: linear in a), n -> 0 is Gompertz, n = 1 quadratic,
n = 2 Ehsan and Scanlan (Van der Pol, Rayleigh), and n = 2 nu Larsen's with his exponent nu.  lambda is the rate at
which a small deviation from the stable amplitude dies out, in 1/s, the same under every law.  The equation itself
stands in `scruton.dynamics.equation`, compiled.
"""

import numpy as np
from numpy.typing import ArrayLike

from scruton.arrays import FloatArray
from scruton.dynamics.scruton_number import floats

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
    from scruton.dynamics.equation import drifts

    arrays, (derivative,) = _flat(1, a, a_star, lam, n)
    drifts(*arrays, derivative.ravel())
    return derivative


def closed_form(t: ArrayLike, a0: ArrayLike, a_star: ArrayLike, lam: ArrayLike, n: ArrayLike) -> FloatArray:
    """Amplitude at time t [s] after a0: a* [1 + ((a*/a0)^n - 1) exp(-lambda t)]^(-1/n).

    `a0` may be zero for n = -1; for n >= 0 the amplitude never leaves zero.
    """
    return _flow(t, a0, a_star, lam, n)[0]


def flow_derivative(t: ArrayLike, a0: ArrayLike, a_star: ArrayLike, lam: ArrayLike, n: ArrayLike) -> FloatArray:
    """Derivative of `closed_form` with respect to a0: (a/a0)^(n+1) exp(-lambda t)."""
    return _flow(t, a0, a_star, lam, n)[1]


def _flow(t: ArrayLike, a0: ArrayLike, a_star: ArrayLike, lam: ArrayLike, n: ArrayLike) -> list[FloatArray]:
    from scruton.dynamics.equation import flows

    decay = np.exp(-floats(lam) * floats(t))
    arrays, results = _flat(2, a0, a_star, decay, n)
    flows(*arrays, *(out.ravel() for out in results))
    return results


def _flat(outputs: int, *arguments: ArrayLike) -> tuple[list[FloatArray], list[FloatArray]]:
    """Arguments broadcast and in one row, as compiled functions take them, and arrays for what comes out."""
    arrays = np.broadcast_arrays(*(floats(value) for value in arguments))
    return [np.array(value).ravel() for value in arrays], [np.empty(arrays[0].shape) for _ in range(outputs)]


def extrapolation_index(scruton_number: ArrayLike, tested: ArrayLike, relaxation: ArrayLike) -> FloatArray:
    """How far a setting lies from the tested one: x = (Sc' - Sc)/Sc_lambda = omega0 (xi' - xi)/lambda.

    Laws from n = -1 to 2 agree to 2 % for abs(x) < 0.1, to 8 % for abs(x) < 0.2, and part beyond 0.3.  `relaxation` is
    the Scruton number that belongs to lambda, Sc_lambda = Sc lambda/(omega0 xi).
    """
    return (floats(scruton_number) - floats(tested)) / floats(relaxation)


def amplitude_ratio(x: ArrayLike, n: ArrayLike) -> FloatArray:
    """Stable amplitude at another damping over the tested one: (1 - n x)^(1/n), exp(-x) at n = 0.

    Zero where the vibration dies (n > 0 and x >= 1/n); infinite where no amplitude is stable (n < 0 and
    x <= 1/n: for the paper's law below x = -1).
    """
    x, n = np.broadcast_arrays(floats(x), floats(n))
    base = -n * x
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.exp(np.where(n == 0.0, -x, np.log1p(np.maximum(base, -1.0)) / np.where(n == 0.0, 1.0, n)))
    return np.where(base > -1.0, ratio, np.where(n > 0.0, 0.0, np.inf))


def index_of(log_ratio: ArrayLike, n: ArrayLike) -> FloatArray:
    """Inverse of `amplitude_ratio`: the index x at which the amplitude is exp(`log_ratio`) times the tested one.

    x = (1 - r^n)/n, and -ln r at n = 0.
    """
    n, log_ratio = floats(n), floats(log_ratio)
    return -np.where(n == 0.0, log_ratio, np.expm1(n * log_ratio) / np.where(n == 0.0, 1.0, n))
