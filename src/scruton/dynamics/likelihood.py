r"""The state-space likelihood of an envelope: O(N), compiled, many walkers side by side.

The amplitude of a record is a state, not a curve plus white noise.  Turbulence pushes it about and it
relaxes at its own rate; the sensor adds noise on top:

.. math:: da = f(a)\,dt + q\,dW, \qquad y_k = \frac1T\int_{t_k-T/2}^{t_k+T/2} a\,dt + r\,s_k\,e_k

with the amplitude equation of the n-family, :math:`f(a) = (\lambda/n)\,a\,[1-(a/a^*)^n]`.  A demodulated
amplitude is the mean over its cycle, so the observation shares the process noise of that cycle with the state
at its end.  For the paper's law (n = -1) the equation is linear and the filter is exact.  For the other laws it
is linearised along the filtered mean; there the SDE carries the drift :math:`q^2/2a` that broad-band
forcing induces, which matters only at small amplitude.  The initial state has a normal prior and is integrated out.
"""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.curved_filter import curved_filter, step_filter
from scruton.dynamics.cycles import EnvelopeData
from scruton.dynamics.linear_filter import linear_filter
from scruton.dynamics.moments import LOG_2PI


def innovations(
    data: EnvelopeData,
    a_star: FloatArray,
    lam: FloatArray,
    q: FloatArray,
    r: FloatArray,
    gust: FloatArray | float = 0.0,
    gust_rate: FloatArray | float = 1.0,
    set_point: FloatArray | float = 0.0,
    *,
    n: float | FloatArray = -1.0,
    initial_sd: float = 1.0,
) -> tuple[FloatArray, FloatArray]:
    """One-step prediction errors of the filter and their variances.

    Parameters
    ----------
    data : EnvelopeData
    a_star, lam, q, r : (W,) arrays
        Stable amplitude (A/D or rad), relaxation rate [1/s], process noise [amplitude per sqrt(s)], and
        the factor on the cycles' standard errors.
    gust, gust_rate : float or (W,) array
        Standard deviation of the slow fluctuation of the stable amplitude, and its rate [1/s].
    set_point : float or (W,) array
        Standard deviation of the stable amplitude from record to record.
    n : float or (W,) array
        The law: -1 is the paper's.
    initial_sd : float
        Standard deviation of the normal prior, mean 0, of each record's initial amplitude.

    Returns
    -------
    innovation, variance : (N, W) arrays
    """
    shape = (data.size, np.size(a_star))
    innovation, variance = np.empty(shape), np.empty(shape)
    step_filter(
        data.amplitude, data.standard_error, data.gap, data.period,
        *contiguous(a_star, lam, q, r, gust, gust_rate, set_point, n), 0.0, initial_sd**2, innovation, variance,
    )  # fmt: skip
    return innovation, variance


def pointwise_log_likelihood(innovation: FloatArray, variance: FloatArray) -> FloatArray:
    """Conditional log density of every cycle given those before it, same shape as the arguments."""
    return -0.5 * (innovation**2 / variance + np.log(variance) + LOG_2PI)


def log_likelihood(
    data: EnvelopeData,
    a_star: FloatArray,
    lam: FloatArray,
    q: FloatArray,
    r: FloatArray,
    gust: FloatArray | float = 0.0,
    gust_rate: FloatArray | float = 1.0,
    set_point: FloatArray | float = 0.0,
    *,
    n: float | FloatArray = -1.0,
    initial_sd: float = 1.0,
) -> FloatArray:
    """Joint log density of all cycles of all records, (W,); see `innovations` for the arguments."""
    out = np.empty(np.size(a_star))
    exponents = np.broadcast_to(np.asarray(n, dtype=np.float64), out.shape)
    if out.size and np.any(exponents != exponents[0]):  # n is free: every walker has a law of its own
        wind = (gust, gust_rate, set_point)
        terms = pointwise_log_likelihood(*innovations(data, a_star, lam, q, r, *wind, n=n, initial_sd=initial_sd))
        return np.asarray(terms.sum(axis=0))
    walkers = contiguous(a_star, lam, q, r, gust, gust_rate, set_point)
    arrays = (data.amplitude, data.standard_error, data.gap, data.period)
    if np.all(exponents == -1.0):
        linear_filter(*arrays, *walkers, 0.0, initial_sd**2, out)
    else:
        curved_filter(*arrays, *walkers, float(exponents[0]), 0.0, initial_sd**2, out)
    return out


def contiguous(first: FloatArray, *others: FloatArray | float) -> list[FloatArray]:
    """Parameters as the compiled filters take them, (W,) each, W the size of the first."""
    size = np.size(first)
    return [np.ascontiguousarray(np.broadcast_to(values, size), dtype=np.float64) for values in (first, *others)]
