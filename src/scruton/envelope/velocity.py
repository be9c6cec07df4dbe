"""Transient velocity by high-order finite differences: Eq. (2) of the paper."""

import numpy as np

from scruton.arrays import FloatArray


def velocity(response: FloatArray, time_step: float) -> FloatArray:
    """Differentiate a uniformly sampled response: Eq. (2).

    Parameters
    ----------
    response : (N,) array
        Displacement or rotation, N >= 5.
    time_step : float
        Sampling interval [s].

    Returns
    -------
    (N,) array
        Velocity, in the response's unit per second.

    Raises
    ------
    ValueError
        If there are fewer than five samples.

    Notes
    -----
    Counted from 1 as in the paper, the fourth-order central difference holds for 3 <= i <= N - 2 and the
    second-order one-sided differences for i = 1, 2 and i = N - 1, N. The ranges printed with Eq. (2) differ
    (2 < i < N and N - 2 <= i <= N): they overlap, and they reach beyond the record.
    """
    y, n = response, len(response)
    if n < 5:
        raise ValueError(f"Eq. (2) differentiates over five samples; found {n}")
    rate = np.empty(n)
    inside = rate[2:-2]
    np.subtract(y[3:-1], y[1:-3], out=inside)
    inside *= 8.0
    inside -= y[4:]
    inside += y[:-4]
    inside /= 12.0
    rate[:2] = (-y[2:4] + 4.0 * y[1:3] - 3.0 * y[:2]) / 2.0
    rate[-2:] = (3.0 * y[-2:] - 4.0 * y[-3:-1] + y[-4:-2]) / 2.0
    rate /= time_step
    return rate
