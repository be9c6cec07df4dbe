"""An offset that wanders within single cycles: slow drift of a sensor, or what integrating an acceleration leaves."""

import numpy as np

from scruton.arrays import FloatArray


def wandering_offset(time: FloatArray, response: FloatArray, frequency: float) -> FloatArray | None:
    """Offset of every sample: the response averaged twice over a whole cycle, of which a steady motion leaves nothing.

    Parameters
    ----------
    time, response : (N,) array
        Seconds, strictly increasing, and y/D or rotation [rad].
    frequency : float
        Of the response [Hz].

    Returns
    -------
    (N,) array or None
        In the response's unit; within a cycle of either end that of a cycle from it.  None where the record is shorter
        than three cycles or has a gap of a third of one, which no average bridges.
    """
    period = 1.0 / frequency
    inside = (time > time[0] + period) & (time < time[-1] - period)
    if np.count_nonzero(inside) < 2 or np.max(np.diff(time)) > period / 3.0:
        return None
    offset = response
    for _ in range(2):
        area = np.concatenate([[0.0], np.cumsum(0.5 * (offset[1:] + offset[:-1]) * np.diff(time))])
        ends = (np.interp(time + half, time, area) for half in (0.5 * period, -0.5 * period))
        offset = np.subtract(*ends) / period
    first, last = np.flatnonzero(inside)[[0, -1]]
    return np.asarray(np.interp(time, time[first : last + 1], offset[first : last + 1]))
