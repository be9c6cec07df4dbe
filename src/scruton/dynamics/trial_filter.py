"""The likelihood of the second-order exponential (Eq. 4) with a correlated residual about it."""

import numpy as np
from numba import njit

from scruton.arrays import FloatArray
from scruton.dynamics.cycles import EnvelopeData
from scruton.dynamics.likelihood import contiguous
from scruton.dynamics.moments import LOG_2PI


@njit(cache=True, fastmath=True, error_model="numpy")
def trial_filter(y, se, gap, period, a, b, c, d, sd, rate, r, log_like):  # type: ignore[no-untyped-def]
    """Log likelihood of one record: Eq. (4) + stationary Ornstein-Uhlenbeck residual + sensor noise."""
    for w in range(sd.size):
        var = sd[w] * sd[w]
        x, p, total, prod = 0.0, var, 0.0, 1.0
        first, second = a[w], c[w]
        forget, grow_first, grow_second, last = 0.0, 0.0, 0.0, -1.0
        for k in range(y.size):
            if k > 0:
                step = gap[k] + 0.5 * (period[k] + period[k - 1])
                if step != last:
                    last = step
                    forget = np.exp(-rate[w] * step)
                    grow_first, grow_second = np.exp(b[w] * step), np.exp(d[w] * step)
                first *= grow_first
                second *= grow_second
                x *= forget
                p = var + forget * forget * (p - var)
            noise = r[w] * se[k]
            s = p + noise * noise
            v = y[k] - first - second - x
            total += v * v / s + LOG_2PI
            prod *= s
            if k % 8 == 7:
                total += np.log(prod)
                prod = 1.0
            gain = p / s
            x += gain * v
            p *= 1.0 - gain
        log_like[w] = -0.5 * (total + np.log(prod))


def trial_log_likelihood(
    data: EnvelopeData, constants: tuple[FloatArray, ...], sd: FloatArray, rate: FloatArray, r: FloatArray
) -> FloatArray:
    """Log density of the envelope of one record about the second-order exponential, (W,).

    Parameters
    ----------
    data : EnvelopeData
        Of a single record.
    constants : four (W,) arrays
        a, b, c, d of Eq. (4), in A/D or rad and 1/s; time from the first cycle.
    sd, rate, r : (W,) arrays
        Standard deviation and rate [1/s] of the correlated residual; factor on the standard errors.
    """
    out = np.empty(np.size(sd))
    trial_filter(
        data.amplitude, data.standard_error, data.gap, data.period,
        *contiguous(*constants, sd, rate, r), out,
    )  # fmt: skip
    return out
