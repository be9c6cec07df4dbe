"""Noise of a record that was filtered to a band, or integrated: it lies in the band, where the motion is."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.envelope.sampling import sampling
from scruton.envelope.thresholds import BAND_LENGTH, BAND_OUTLIER, BAND_SKIRT

_WINDOW = (0.35875, -0.48829, 0.14128, -0.01168)  # Blackman-Harris: 92 dB above its side lobes, 4 lines wide


def line_noise(time: FloatArray, response: FloatArray, band: tuple[float, float], frequency: float) -> float:
    """Standard deviation per sample of the white noise that is as strong at the line as the band's noise is there.

    Parameters
    ----------
    time, response : (N,) array
        Seconds, evenly spaced, and a response that holds only the band.
    band : (low, high)
        Edges [Hz].
    frequency : float
        Of the line [Hz], inside the band.

    Notes
    -----
    What is left of the noise looks, inside one cycle, like the motion: no residual shows it.  So it is read off the
    spectrum on both sides of the line, where three parts add up: noise that is white as displacement, noise that is
    white as acceleration and falls with the fourth power of the frequency, and the skirts of a motion that turbulence
    shakes, which fall with the square of the distance from the line and are no noise of the sensor.  Their strengths,
    none of them negative, are those of largest likelihood; lines that stand out of all three are left out.

    Averages over many cycles have the variance of white noise of this strength; one cycle alone differs, by the part
    of its width that the band leaves and by the slope of its noise.  A record too short to part the line from the edges
    is taken for noisier than it is.
    """
    step = sampling(time).step
    low, high = band
    apart = max(min(frequency - low, high - frequency), 0.01 * frequency)
    length = int(min(len(response), max(16.0, BAND_LENGTH / (BAND_SKIRT * apart * step))))
    angle = 2.0 * np.pi * (np.arange(length) + 0.5) / length
    taper = sum(weight * np.cos(k * angle) for k, weight in enumerate(_WINDOW))
    starts = np.linspace(0, len(response) - length, max(1, 2 * (len(response) // length) - 1), dtype=np.intp)
    blocks = np.stack([response[start : start + length] for start in starts])
    power = np.mean(np.abs(np.fft.rfft((blocks - blocks.mean(axis=1, keepdims=True)) * taper, axis=1)) ** 2, axis=0)
    grid = np.fft.rfftfreq(length, step)
    off = np.abs(grid - frequency)
    used = (grid >= low) & (grid <= high) & (off >= min(BAND_LENGTH / (length * step), 0.7 * apart))
    if not used.any():
        return float(np.std(response))
    relative, skirt, power = grid[used] / frequency, (off[used] / apart) ** -2.0, power[used] / np.sum(taper**2)
    parts = np.stack([np.ones_like(relative), relative**-4.0, skirt])
    strength = np.zeros(3)
    for _ in range(3):
        strength = _strengths(parts, power)
        quiet = power < BAND_OUTLIER * (strength @ parts)
        parts, power = parts[:, quiet], power[quiet]
    return float(np.sqrt(strength[0] + strength[1]))


def _strengths(parts: FloatArray, power: FloatArray) -> FloatArray:
    """Strengths, zero or more, of the parts (K, M) that add up to the expected periodogram (M,): largest likelihood."""
    strength = np.full(len(parts), np.median(power) / len(parts)) / np.median(parts, axis=1)
    for _ in range(200):  # each step increases the likelihood
        expected = np.maximum(strength @ parts, np.finfo(float).tiny)
        strength = strength * np.sqrt((parts @ (power / expected**2)) / (parts @ (1.0 / expected)))
    return strength
