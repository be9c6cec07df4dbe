"""The likelihood of the second-order exponential (Eq. 4) with a correlated residual about it."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.compiled import njit
from scruton.dynamics.cycles import EnvelopeData
from scruton.dynamics.likelihood import contiguous
from scruton.dynamics.moments import LOG_2PI

BLOCK = 16  # walkers side by side: the processor takes several at once
(
    VAR, R2, DECAY, GROW, GROWS, FORGET, GROW_FIRST, GROW_SECOND,
    STATE, STATE_FIRST, STATE_SECOND, P, FIRST, SECOND, DIAGONAL, BESIDE, RIGHT, LAST, BELOW, TOTAL, PROD,
) = range(21)  # fmt: skip


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "arcp", "nsz"})
def trial_filter(y, se, gap, period, b, d, sd, rate, r, mean, spread, log_like, root):  # type: ignore[no-untyped-def]
    """Marginal log likelihood of one record, and the square root of the information on a and c.

    The filter of the residual is linear: its innovations are those of the data less a and c times those of e^(bt) and
    e^(dt).  Each cycle is one more row of a triangular least-squares problem that begins with the prior; what a row
    has left once it is rotated in is its misfit (Givens), so that nothing is found as a difference of large squares.
    """
    x = np.zeros((21, BLOCK))
    for start in range(0, b.size, BLOCK):
        for w in range(BLOCK):
            at = min(start + w, b.size - 1)  # the last walker fills its block
            x[VAR, w], x[R2, w] = sd[at] * sd[at], r[at] * r[at]
            x[DECAY, w], x[GROW, w], x[GROWS, w] = -rate[at], b[at], d[at]
        _block(x, y, se, gap, period, mean / spread, 1.0 / spread)
        for w in range(min(BLOCK, b.size - start)):
            at = start + w
            ends = np.log(x[DIAGONAL, w] * spread) + np.log(x[LAST, w] * spread)
            log_like[at] = -0.5 * x[TOTAL, w] - ends
            root[at, 0], root[at, 1], root[at, 2] = x[DIAGONAL, w], x[BESIDE, w], x[RIGHT, w]
            root[at, 3], root[at, 4] = x[LAST, w], x[BELOW, w]


@njit(cache=True, inline="always")
def _block(x, y, se, gap, period, right, diagonal):  # type: ignore[no-untyped-def]
    """Fill the rows from `STATE` on; inlined, as rows of an array from outside might be one another to the compiler."""
    x[STATE], x[STATE_FIRST], x[STATE_SECOND], x[P] = 0.0, 0.0, 0.0, x[VAR]
    x[FIRST], x[SECOND], x[DIAGONAL], x[BESIDE], x[LAST] = 1.0, 1.0, diagonal, 0.0, diagonal
    x[RIGHT], x[BELOW], x[TOTAL], x[PROD] = right, right, LOG_2PI * y.size, 1.0
    x[FORGET], x[GROW_FIRST], x[GROW_SECOND] = 1.0, 1.0, 1.0
    step = 0.0
    for k in range(y.size):
        if k > 0 and gap[k] + 0.5 * (period[k] + period[k - 1]) != step:
            step = gap[k] + 0.5 * (period[k] + period[k - 1])
            for w in range(BLOCK):
                x[FORGET, w] = np.exp(x[DECAY, w] * step)
                x[GROW_FIRST, w], x[GROW_SECOND, w] = np.exp(x[GROW, w] * step), np.exp(x[GROWS, w] * step)
        squared_error = se[k] * se[k]
        for w in range(BLOCK):
            forget = x[FORGET, w]
            first, second = x[FIRST, w] * x[GROW_FIRST, w], x[SECOND, w] * x[GROW_SECOND, w]
            state = x[STATE, w] * forget
            state_first, state_second = x[STATE_FIRST, w] * forget, x[STATE_SECOND, w] * forget
            p = x[VAR, w] + forget * forget * (x[P, w] - x[VAR, w])
            s = p + x[R2, w] * squared_error
            weight = 1.0 / np.sqrt(s)
            v, v_first, v_second = y[k] - state, first - state_first, second - state_second
            gain = p * weight * weight
            x[STATE, w] = state + gain * v
            x[STATE_FIRST, w] = state_first + gain * v_first
            x[STATE_SECOND, w] = state_second + gain * v_second
            x[P, w] = p * (1.0 - gain)
            x[FIRST, w], x[SECOND, w] = first, second
            v *= weight
            v_first *= weight
            v_second *= weight
            diagonal, beside, last, right, below = x[DIAGONAL, w], x[BESIDE, w], x[LAST, w], x[RIGHT, w], x[BELOW, w]
            squared = diagonal * diagonal + v_first * v_first
            shrink = 1.0 / np.sqrt(squared)
            c, t = diagonal * shrink, v_first * shrink
            x[DIAGONAL, w] = squared * shrink
            x[BESIDE, w], v_second = c * beside + t * v_second, c * v_second - t * beside
            x[RIGHT, w], v = c * right + t * v, c * v - t * right
            squared = last * last + v_second * v_second
            shrink = 1.0 / np.sqrt(squared)
            c, t = last * shrink, v_second * shrink
            x[LAST, w] = squared * shrink
            x[BELOW, w], v = c * below + t * v, c * v - t * below
            x[TOTAL, w] += v * v
            x[PROD, w] *= s
        if k % 8 == 7 or k == y.size - 1:
            for w in range(BLOCK):
                x[TOTAL, w] += np.log(x[PROD, w])
                x[PROD, w] = 1.0


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
