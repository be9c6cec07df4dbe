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

from typing import NamedTuple

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.block_filter import block_filter
from scruton.dynamics.cycles import EnvelopeData
from scruton.dynamics.departure import COLUMNS, STATIC
from scruton.dynamics.moments import LOG_2PI
from scruton.dynamics.step_filter import step_filter

_LOST = -1e290  # below: the filter lost its way


class Wind(NamedTuple):
    """What else moves the amplitude; floats or (W,) arrays.

    Attributes
    ----------
    gust, gust_rate
        Standard deviation of the slow fluctuation of the stable amplitude, and its rate [1/s].
    set_point
        Standard deviation of the stable amplitude from record to record.
    departure
        Standard deviation of the drift about the law, over it, one e-fold from the stable amplitude: s of
        `scruton.dynamics.departure`.
    known : (W, COLUMNS) array or None
        Prior means of the columns of the departure; None where they are zero.
    own : float
        Of the variance of a column, s^2, the part by which it scatters about that mean.
    """

    gust: FloatArray | float = 0.0
    gust_rate: FloatArray | float = 1.0
    set_point: FloatArray | float = 0.0
    departure: FloatArray | float = 0.0
    known: FloatArray | None = None
    own: float = 1.0

    @property
    def sizes(self) -> tuple[FloatArray | float, ...]:
        """All that is one number a walker."""
        return self.gust, self.gust_rate, self.set_point, self.departure


def innovations(
    data: EnvelopeData,
    a_star: FloatArray,
    lam: FloatArray,
    q: FloatArray,
    r: FloatArray,
    wind: Wind | None = None,
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
    wind : Wind, optional
        Gusts, set-points and departures from the law; none where it is left out.
    n : float or (W,) array
        The law: -1 is the paper's.
    initial_sd : float
        Standard deviation of the normal prior, mean 0, of each record's initial amplitude.

    Returns
    -------
    innovation, variance : (N, W) arrays
    """
    wind = wind or Wind()
    walkers = contiguous(a_star, lam, q, r, *wind.sizes, n)
    if _one_law(walkers[-1]):
        shape = (data.size, walkers[0].size)
        innovation, variance = np.empty(shape), np.empty(shape)
        _in_blocks(data, walkers, initial_sd, innovation, variance, wind)
        return innovation, variance
    innovation, variance, _, _ = _filtered(data, walkers, initial_sd, wind)
    return innovation, variance


def statics(
    data: EnvelopeData,
    a_star: FloatArray,
    lam: FloatArray,
    q: FloatArray,
    r: FloatArray,
    wind: Wind,
    *,
    n: float | FloatArray = -1.0,
    initial_sd: float = 1.0,
) -> tuple[FloatArray, FloatArray]:
    """Mean (W, COLUMNS) and covariance (W, COLUMNS, COLUMNS) of the columns of the departure, given all records.

    Arguments as of `innovations`.
    """
    _, _, mean, cov = _filtered(data, contiguous(a_star, lam, q, r, *wind.sizes, n), initial_sd, wind)
    return mean[:, 1:], cov[:, 1:, 1:]


def _filtered(data: EnvelopeData, walkers: list[FloatArray], initial_sd: float, wind: Wind) -> tuple[FloatArray, ...]:
    size = walkers[0].size
    innovation, variance = np.empty((data.size, size)), np.empty((data.size, size))
    mean, cov = np.empty((size, STATIC)), np.empty((size, STATIC, STATIC))
    arrays = (data.amplitude, data.standard_error, data.gap, data.period)
    *parameters, exponents = walkers
    departure = _means(wind.known, size), wind.own
    step_filter(*arrays, *parameters, *departure, exponents, 0.0, initial_sd**2, innovation, variance, mean, cov)
    return innovation, variance, mean, cov


def _means(known: FloatArray | None, size: int) -> FloatArray:
    """Prior means of the columns of the departure as the compiled filters take them, (W, COLUMNS)."""
    return np.zeros((size, COLUMNS)) if known is None else np.array(known, dtype=np.float64, order="C")


def pointwise_log_likelihood(innovation: FloatArray, variance: FloatArray) -> FloatArray:
    """Conditional log density of every cycle given those before it, same shape as the arguments."""
    return -0.5 * (innovation**2 / variance + np.log(variance) + LOG_2PI)


def log_likelihood(
    data: EnvelopeData,
    a_star: FloatArray,
    lam: FloatArray,
    q: FloatArray,
    r: FloatArray,
    wind: Wind | None = None,
    *,
    n: float | FloatArray = -1.0,
    initial_sd: float = 1.0,
) -> FloatArray:
    """Joint log density of all cycles of all records, (W,); see `innovations` for the arguments."""
    wind = wind or Wind()
    walkers = contiguous(a_star, lam, q, r, *wind.sizes, n)
    if not _one_law(walkers[-1]):
        terms = pointwise_log_likelihood(*_filtered(data, walkers, initial_sd, wind)[:2])
        return np.asarray(terms.sum(axis=0))
    nothing = np.empty((0, 0))
    out = _in_blocks(data, walkers, initial_sd, nothing, nothing, wind)
    return np.where(out > _LOST, out, -np.inf)


def _one_law(exponents: FloatArray) -> bool:
    """Whether n is given: where it is free, every walker has a law of its own."""
    return bool(exponents.size and np.all(exponents == exponents[0]))


def _in_blocks(
    data: EnvelopeData,
    walkers: list[FloatArray],
    initial_sd: float,
    innovation: FloatArray,
    variance: FloatArray,
    wind: Wind,
) -> FloatArray:
    """Log likelihoods, (W,), of walkers of one law; innovations and variances where these arrays are not empty."""
    out = np.empty(walkers[0].size)
    arrays = (data.amplitude, data.standard_error, data.gap, data.period)
    *parameters, exponents = walkers
    departure, n = (_means(wind.known, out.size), wind.own), float(exponents[0])
    block_filter(*arrays, *parameters, *departure, n, 0.0, initial_sd**2, out, innovation, variance)
    return out


def contiguous(first: FloatArray, *others: FloatArray | float) -> list[FloatArray]:
    """Parameters as the compiled filters take them, (W,) each, W the size of the first.

    They are copied into rows of one array: a view that numpy made read-only is to numba another type, for which it
    compiles the filter anew.
    """
    rows = np.empty((1 + len(others), np.size(first)))
    for row, values in zip(rows, (first, *others), strict=True):
        row[:] = values
    return list(rows)
