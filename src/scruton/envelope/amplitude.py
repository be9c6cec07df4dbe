"""Transient velocity and amplitude, Eqs. (2) and (3) of the paper, and what they need beforehand."""

import numpy as np

from scruton.arrays import FloatArray


def detrend(time: FloatArray, response: FloatArray, frequency: float) -> FloatArray:
    """Subtract offset and linear drift, without touching the oscillation.

    Parameters
    ----------
    time, response : (N,) array
        Seconds, and displacement or rotation.
    frequency : float
        Frequency of the oscillation [Hz]; the line is fitted to the means of whole cycles.

    Returns
    -------
    (N,) array
        The response about its own mean line.

    Notes
    -----
    A line fitted to the samples themselves would lean towards the first swings of a decay. With fewer
    than four whole cycles only the mean is subtracted.
    """
    samples = max(1, round(len(time) / ((time[-1] - time[0]) * frequency)))
    cycles = len(time) // samples
    if cycles < 4:
        return response - np.mean(response)
    whole = slice(cycles * samples)
    means = response[whole].reshape(cycles, samples).mean(axis=1)
    middles = time[whole].reshape(cycles, samples).mean(axis=1)
    middle = middles.mean()
    slope = np.sum((middles - middle) * means) / np.sum((middles - middle) ** 2)
    line = time - middle
    line *= -slope
    line -= means.mean()
    line += response
    return line


def band_pass(response: FloatArray, time_step: float, low: float, high: float) -> FloatArray:
    """Keep the band around the oscillation, without phase shift (second-order Butterworth, both ways).

    Parameters
    ----------
    response : (N,) array
        Uniformly sampled.
    time_step : float
        Sampling interval [s].
    low, high : float
        Edges of the band [Hz]; `high` is cut to just below half of the sampling rate.

    Notes
    -----
    Not in the paper. Eq. (2) multiplies sensor noise by (130^0.5/12) fs/(2 pi f), 9.5 times at 8 Hz and
    500 Hz, and Eq. (3) turns it into an amplitude that is too large where the motion is small. A band of
    0.6 to 1.4 times the frequency takes most of it away, at the price of rounded ends of the record.
    """
    from scipy.signal import butter, sosfiltfilt

    half = 0.5 / time_step
    sos = butter(2, [low / half, min(high / half, 0.99)], btype="bandpass", output="sos")
    filtered: FloatArray = sosfiltfilt(sos, response)
    return filtered


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


def amplitude(response: FloatArray, time_step: float, omega: float) -> FloatArray:
    """Transient amplitude from displacement and velocity: Eq. (3).

    Parameters
    ----------
    response : (N,) array
        Displacement or rotation about its mean (see `detrend`), uniformly sampled.
    time_step : float
        Sampling interval [s].
    omega : float
        Circular frequency of the oscillation in the wind [rad/s], not the one in still air.

    Returns
    -------
    (N,) array
        A = [y^2 + (dy/dt / omega)^2]^0.5, in the response's unit.

    Notes
    -----
    Neglects the rate of the amplitude itself, an error of the order of the damping ratio squared plus a
    ripple at twice the frequency of the order of the damping ratio.
    """
    squared = velocity(response, time_step)
    squared /= omega
    squared *= squared
    squared += response * response
    return np.sqrt(squared, out=squared)
