"""From what a sensor reads to displacement: a band kept, a derivative integrated, both in the frequency domain."""

import math

import numpy as np

from scruton.arrays import ComplexArray, FloatArray
from scruton.campaign.thresholds import BAND_EDGE, END_CYCLES, GAP, JITTER, PREDICTOR


def band_limited(
    time: FloatArray, signal: FloatArray, band: tuple[float, float], order: int = 0
) -> tuple[FloatArray, FloatArray]:
    r"""Keep a band of a signal, and integrate it as often as it is a derivative.

    Parameters
    ----------
    time : (N,) array
        Seconds, strictly increasing; steps that vary are interpolated to even ones.
    signal : (N,) array
        Displacement (or rotation), or its derivative by time.
    band : (low, high)
        Edges [Hz], low > 0.
    order : int
        0 for a displacement, 1 for a velocity, 2 for an acceleration.

    Returns
    -------
    time, response : (N,) arrays
        Even times [s], and the displacement without anything outside the band, phase and amplitude inside untouched.

    Raises
    ------
    ValueError
        If there is a gap in the record.

    Notes
    -----
    Each line of the spectrum is multiplied by :math:`w(\nu)/(2\pi i\nu)^{\rm order}`; w is one from low to high and
    falls to zero within a fifth of either edge beyond it.  So drift, which double integration would blow up, is gone by
    the lower edge.  The spectrum takes a record for periodic, which a decay is not: at both ends it is led on by the
    oscillation and the drift of its first and last cycles and by a linear prediction of the rest (hum), fading.
    """
    from scipy import fft

    time, signal = _even(time, signal)
    n, step = len(signal), float(time[-1] - time[0]) / (len(signal) - 1)
    x = signal - np.mean(signal)
    ramp = np.linspace(-1.0, 1.0, n)
    x -= ramp * (np.dot(ramp, x) / np.dot(ramp, ramp))
    frequency = _line(x, step, band, order)
    pad = min(n - 1, max(16, math.ceil(END_CYCLES / (frequency * step))))
    turn = 2.0 * np.pi * frequency * step
    extended = np.concatenate([_led_on(x, pad, turn)[::-1], x, _led_on(x[::-1], pad, turn)])
    size = fft.next_fast_len(len(extended), real=True)
    grid = fft.rfftfreq(size, step)
    kept = fft.irfft(fft.rfft(extended, size) * _weight(grid, band, order), size)
    return time, np.ascontiguousarray(kept[pad : pad + n])


def _even(time: FloatArray, signal: FloatArray) -> tuple[FloatArray, FloatArray]:
    steps = np.diff(time)
    usual = float(np.median(steps))
    if np.max(steps) > GAP * usual:
        raise ValueError(f"a gap of {np.max(steps):.4g} s after {time[int(np.argmax(steps))]:.6g} s")
    if max(np.max(steps) - usual, usual - np.min(steps)) <= JITTER * usual:
        return time, signal
    from scipy.interpolate import CubicSpline

    even = np.linspace(time[0], time[-1], len(time))
    return even, np.asarray(CubicSpline(time, signal)(even), dtype=float)


def _weight(grid: FloatArray, band: tuple[float, float], order: int) -> ComplexArray:
    """Factor of every frequency [Hz] of a spectrum."""
    low, high = band
    below = np.clip((grid / low - 1.0 + BAND_EDGE) / BAND_EDGE, 0.0, 1.0)
    above = np.clip((1.0 + BAND_EDGE - grid / high) / BAND_EDGE, 0.0, 1.0)
    window = np.sin(0.5 * np.pi * below) ** 2 * np.sin(0.5 * np.pi * above) ** 2
    turn = 2j * np.pi * np.maximum(grid, (1.0 - BAND_EDGE) * low)  # the window is zero below
    weight: ComplexArray = window / turn**order
    return weight


def _line(x: FloatArray, step: float, band: tuple[float, float], order: int) -> float:
    """Frequency [Hz] of the highest line in the band, of the displacement."""
    from scipy import fft

    size = fft.next_fast_len(2 * len(x), real=True)
    grid = fft.rfftfreq(size, step)
    height = np.abs(fft.rfft(x * np.hanning(len(x)), size) * _weight(grid, band, order))
    return float(grid[max(1, int(np.argmax(height)))])


def _led_on(x: FloatArray, count: int, turn: float) -> FloatArray:
    """Lead a signal on beyond its first sample, going away from it; it turns by `turn` [rad] a sample."""

    def columns(at: FloatArray) -> FloatArray:
        wave = np.stack([np.cos(turn * at), np.sin(turn * at), np.ones_like(at)])
        return np.concatenate([wave, wave * (at / count)]).T

    inside = np.arange(count + 1, dtype=float)
    course = np.linalg.lstsq(columns(inside), x[: count + 1], rcond=None)[0]
    away = inside[1:]
    rest = _predicted(x[: count + 1] - columns(inside) @ course, count)
    faded: FloatArray = np.cos(0.5 * np.pi * away / (count + 1.0)) ** 2 * (columns(-away) @ course + rest)
    return faded


def _predicted(x: FloatArray, count: int) -> FloatArray:
    """So many samples before the first: linear prediction by Burg's method, which carries hum on and lets noise go."""
    from scipy.signal import lfilter, lfiltic

    forward, backward = x[1:].copy(), x[:-1].copy()
    coefficients = np.ones(1)
    for _ in range(min(len(x) // 3, PREDICTOR)):
        power = np.dot(forward, forward) + np.dot(backward, backward)
        if not power > 1e-20 * np.dot(x, x):
            break
        reflection = -2.0 * np.dot(forward, backward) / power
        padded = np.append(coefficients, 0.0)
        coefficients = padded + reflection * padded[::-1]
        forward, backward = (forward + reflection * backward)[1:], (backward + reflection * forward)[:-1]
    order = len(coefficients) - 1
    if order == 0:
        return np.zeros(count)
    predicted, _ = lfilter([1.0], coefficients, np.zeros(count), zi=lfiltic([1.0], coefficients, x[:order]))
    result: FloatArray = predicted
    return result
