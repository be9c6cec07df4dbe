"""The third harmonic of every cycle: flat tops of a saturated sensor, or of a spring that stiffens."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.envelope.thresholds import LEAKS, MOST_CHANGE, THIRD_HARMONIC
from scruton.envelope.types import Cycles


def third_harmonic(time: FloatArray, response: FloatArray, cycles: Cycles) -> tuple[FloatArray, FloatArray]:
    """In-phase third harmonic of every cycle of a record as `demodulate` gives them, and its standard error, (K,) each.

    It is the coefficient of cos(3 theta) where the response is A cos(theta), negative for flat tops; the error is
    infinite where there are fewer than twelve samples per cycle.  A force that follows the velocity (friction, drag, a
    wind that damps far beyond the law) bends the wave in quadrature; where that changes within a cycle a part of it
    shows in phase, and counts as error.  Each cycle is regressed on a constant and three harmonics, the first of which
    grows and turns as from the cycle before to the one behind: a growth that is regressed, too, takes up what tops that
    are cut off leave in higher harmonics.
    """
    count, period = cycles.time.size, 1.0 / cycles.reference_frequency
    third, error, quadrature = np.zeros(count), np.full(count, np.inf), np.zeros(count)
    if (len(time) - 1) / (time[-1] - time[0]) * period < THIRD_HARMONIC:
        return third, error
    first = np.searchsorted(time, cycles.time - 0.5 * period)
    sizes = np.searchsorted(time, cycles.time + 0.5 * period) - first
    fundamental, growth, turn = np.full(count, np.nan, dtype=complex), np.zeros(count), np.zeros(count)
    for again in (False, True):
        for size in np.unique(sizes[sizes >= THIRD_HARMONIC - 1]):
            which = np.flatnonzero(sizes == size)
            index = first[which][:, None] + np.arange(size)
            tau = (time[index] - cycles.time[which][:, None]) / period
            turned = np.exp(1j * (2.0 * np.pi + turn[which][:, None]) * tau)
            waves = (1.0 + growth[which][:, None] * tau) * turned, turned**2, turned**3
            columns = np.stack([np.ones_like(tau), *(part for w in waves for part in (w.real, w.imag))], axis=2)
            inverse = np.linalg.pinv(columns.transpose(0, 2, 1) @ columns)
            y = response[index][:, :, None]
            beta = inverse @ (columns.transpose(0, 2, 1) @ y)
            # response = Re[z exp(i theta)] = Re z cos - Im z sin
            _, one, _, three = np.split(beta[:, :, 0], [1, 3, 5], axis=1)
            fundamental[which] = z = one[:, 0] - 1j * one[:, 1]
            if again:
                in_phase = (three[:, 0] - 1j * three[:, 1]) * np.conj(z / np.maximum(np.abs(z), 1e-300)) ** 3
                third[which], quadrature[which] = np.real(in_phase), np.imag(in_phase)
                variance = np.sum((y - columns @ beta)[:, :, 0] ** 2, axis=1) / max(size - 9, 1)
                error[which] = np.sqrt(variance * 0.5 * (inverse[:, 5, 5] + inverse[:, 6, 6]))
        growth, turn = _changes(fundamental, cycles.time / period)
    # the noise of one cycle is known poorly; that of its neighbourhood well
    finite = np.isfinite(error)
    if finite.any():
        window = np.ones(17) / 17.0
        power = np.where(finite, error, np.median(error[finite])) ** 2
        padded = np.pad(power, 8, mode="edge")
        error = np.where(finite, np.sqrt(np.convolve(padded, window, mode="valid")), np.inf)
        beyond = np.maximum(np.abs(quadrature) - 2.0 * np.where(finite, error, 0.0), 0.0)
        error = np.hypot(error, LEAKS * beyond)
    return third, error


def _changes(z: np.ndarray, cycle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Relative growth, and turn [rad], in a cycle of complex amplitudes, (K,): between neighbours, where there are."""
    beside = np.append(np.diff(cycle) < 1.5, False) & np.isfinite(z) & np.isfinite(np.append(z[1:], np.nan))
    place = np.arange(z.size)
    behind, before = place + beside, place - np.append(False, beside[:-1])
    steps = np.maximum(cycle[behind] - cycle[before], 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        growth = (np.abs(z[behind]) - np.abs(z[before])) / (steps * np.abs(z))
        turn = np.angle(z[behind] * np.conj(z[before])) / steps
    growth, turn = (np.clip(np.nan_to_num(x), -MOST_CHANGE, MOST_CHANGE) for x in (growth, turn))
    return growth, turn
