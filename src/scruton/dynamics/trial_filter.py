"""The likelihood of the second-order exponential (Eq. 4) with a correlated residual about it."""

import numpy as np
from numba import njit

from scruton.arrays import FloatArray
from scruton.dynamics.cycles import EnvelopeData
from scruton.dynamics.likelihood import contiguous
from scruton.dynamics.moments import LOG_2PI


@njit(cache=True, error_model="numpy")
def trial_filter(y, se, gap, period, b, d, sd, rate, r, mean, spread, log_like, root):  # type: ignore[no-untyped-def]
    """Marginal log likelihood of one record, and the square root of the information on a and c.

    The filter of the residual is linear: its innovations are those of the data less a and c times those of e^(bt) and
    e^(dt).  Each cycle is one more row of a triangular least-squares problem that begins with the prior; what a row
    has left once it is rotated in is its misfit (Givens), so that nothing is found as a difference of large squares.
    """
    for w in range(b.size):
        var = sd[w] * sd[w]
        first, second = 1.0, 1.0
        state, state_first, state_second, p = 0.0, 0.0, 0.0, var
        diagonal, beside, last = 1.0 / spread, 0.0, 1.0 / spread
        right, below = mean / spread, mean / spread
        total, prod, step = LOG_2PI * y.size, 1.0, -1.0
        forget, grow_first, grow_second = 0.0, 0.0, 0.0
        for k in range(y.size):
            if k > 0:
                if gap[k] + 0.5 * (period[k] + period[k - 1]) != step:
                    step = gap[k] + 0.5 * (period[k] + period[k - 1])
                    forget = np.exp(-rate[w] * step)
                    grow_first, grow_second = np.exp(b[w] * step), np.exp(d[w] * step)
                first *= grow_first
                second *= grow_second
                state *= forget
                state_first *= forget
                state_second *= forget
                p = var + forget * forget * (p - var)
            noise = r[w] * se[k]
            s = p + noise * noise
            prod *= s
            if k % 8 == 7:
                total += np.log(prod)
                prod = 1.0
            weight = 1.0 / np.sqrt(s)
            v, v_first, v_second = y[k] - state, first - state_first, second - state_second
            gain = p * weight * weight
            state += gain * v
            state_first += gain * v_first
            state_second += gain * v_second
            p *= 1.0 - gain
            v *= weight
            v_first *= weight
            v_second *= weight
            squared = diagonal * diagonal + v_first * v_first
            shrink = 1.0 / np.sqrt(squared)
            c, t = diagonal * shrink, v_first * shrink
            diagonal = squared * shrink
            beside, v_second = c * beside + t * v_second, c * v_second - t * beside
            right, v = c * right + t * v, c * v - t * right
            squared = last * last + v_second * v_second
            shrink = 1.0 / np.sqrt(squared)
            c, t = last * shrink, v_second * shrink
            last = squared * shrink
            below, v = c * below + t * v, c * v - t * below
            total += v * v
        log_like[w] = -0.5 * (total + np.log(prod)) - np.log(diagonal * spread) - np.log(last * spread)
        root[w, 0], root[w, 1], root[w, 2], root[w, 3], root[w, 4] = diagonal, beside, right, last, below


def _filtered(
    data: EnvelopeData, theta: tuple[FloatArray, ...], prior: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    walkers = contiguous(*theta)
    log_like, root = np.empty(walkers[0].size), np.empty((walkers[0].size, 5))
    trial_filter(data.amplitude, data.standard_error, data.gap, data.period, *walkers, *prior, log_like, root)
    return log_like, root


def trial_log_likelihood(data: EnvelopeData, theta: tuple[FloatArray, ...], prior: tuple[float, float]) -> FloatArray:
    """Log density of the envelope of one record about the second-order exponential, a and c integrated out, (W,).

    Parameters
    ----------
    data : EnvelopeData
        Of a single record.
    theta : five (W,) arrays
        b and d of Eq. (4) [1/s], time from the first cycle; standard deviation (A/D or rad) and rate [1/s] of the
        correlated residual; factor on the standard errors.
    prior : (float, float)
        Mean and standard deviation of the normal prior of a and of c, A/D or rad.
    """
    return _filtered(data, theta, prior)[0]


def trial_amplitudes(
    data: EnvelopeData, theta: tuple[FloatArray, ...], prior: tuple[float, float], z: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Draw a and c of Eq. (4) from their normal distribution given all else, (W,) each.

    Parameters
    ----------
    data, theta, prior
        As of `trial_log_likelihood`.
    z : (W, 2) array
        Standard normal; zeros give the means.
    """
    diagonal, beside, right, last, below = _filtered(data, theta, prior)[1].T
    c = (below + z[:, 1]) / last
    return (right + z[:, 0] - beside * c) / diagonal, c
