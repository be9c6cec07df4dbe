"""The dominant frequency of a record, from its spectrum."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.envelope.sampling import sampling
from scruton.envelope.thresholds import NEAR, OVERTOPS


def dominant_frequency(time: FloatArray, response: FloatArray, near: float | None = None) -> float:
    """Frequency of the highest line of the spectrum [Hz]; NaN where there is none.

    Parameters
    ----------
    time, response : (N,) array
        Seconds, and the response; slightly unequal steps and gaps are interpolated linearly.
    near : float, optional
        Frequency [Hz] that is expected: the highest line within a fifth of it is taken, unless it is a thirtieth of
        the highest of all, or less.

    Notes
    -----
    A line is a local maximum that stands out of the median of the two octaves around it by more than noise
    does; the highest such line is taken. So neither slow drift (a spectrum that falls) nor sensor noise wins
    over a weaker oscillation. Lines of fewer than three cycles in the record do not count. A parabola through the
    logarithms of the three highest values places the line between the bins: a decay widens the line but
    keeps it symmetric.
    """
    from scipy import fft

    n = len(time)
    if n < 8 or np.ptp(response) == 0.0:
        return float("nan")
    steps = sampling(time)
    if steps.uniform:
        x = response - np.mean(response)
    else:
        n = round(float(time[-1] - time[0]) / steps.step) + 1
        x = np.interp(np.linspace(time[0], time[-1], n), time, response)
        x -= np.mean(x)
    ramp = np.linspace(-1.0, 1.0, n)
    ramp *= np.dot(ramp, x) / np.dot(ramp, ramp)
    x -= ramp
    # zeros behind a short record draw the line with more points
    size = fft.next_fast_len(2 * n if n < 200_000 else n, real=True)
    height = np.abs(fft.rfft(x, size))
    first = max(2, int(np.ceil(3.0 * size / n)))
    inner = height[first:-1]
    peaks = np.flatnonzero((inner > height[first - 1 : -2]) & (inner >= height[first + 1 :])) + first
    # out of flat noise, and out of noise that falls with frequency as drift does
    for weight in (np.ones(len(height)), np.arange(len(height), dtype=float)):
        peaks = peaks[(height * weight)[peaks] > _noise_ceiling(height * weight, first)[peaks]]
    if len(peaks) == 0:
        return float("nan")
    top = int(peaks[np.argmax(height[peaks])])
    if near is not None:
        close = peaks[np.abs(peaks / (size * steps.step) - near) <= NEAR * near]
        first_choice = int(close[np.argmax(height[close])]) if len(close) else top
        top = first_choice if OVERTOPS * height[first_choice] > height[top] else top
    tiny = 1e-12 * height[top]
    left, middle, right = np.log(height[top - 1 : top + 2] + tiny)
    shift = 0.5 * (left - right) / (left - 2.0 * middle + right)
    return float((top + np.clip(shift, -0.5, 0.5)) / (size * steps.step))


def _noise_ceiling(height: FloatArray, first: int) -> FloatArray:
    """Height that noise hardly reaches: its median over two octaves, times the largest of so many Rayleigh draws."""
    octaves = np.arange(np.log2(first), np.log2(len(height)), 0.5)
    ceiling = []
    for centre in 2.0**octaves:
        part = height[max(first, int(centre / 2.0)) : int(centre * 2.0) + 1]
        ceiling.append(np.median(part) * (1.0 + np.sqrt(np.log(len(part) + 1) / np.log(2.0))))
    place = np.log2(np.maximum(np.arange(len(height)), first))
    result: FloatArray = np.interp(place, octaves, ceiling)
    return result
