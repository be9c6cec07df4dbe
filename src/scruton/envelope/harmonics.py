"""The third harmonic of every cycle: flat tops of a saturated sensor, or of a spring that stiffens."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.envelope.thresholds import LEAKS, THIRD_HARMONIC
from scruton.envelope.types import Cycles


def third_harmonic(time: FloatArray, response: FloatArray, cycles: Cycles) -> tuple[FloatArray, FloatArray]:
    """In-phase third harmonic of every cycle of a record as `demodulate` gives them, and its standard error, (K,) each.

    It is the coefficient of cos(3 theta) where the response is A cos(theta), negative for flat tops; the error is
    infinite where there are fewer than twelve samples per cycle.  A force that follows the velocity (friction, drag, a
    wind that damps far beyond the law) bends the wave in quadrature; where that changes within a cycle a part of it
    shows in phase, and counts as error.  Each cycle is regressed on a constant, a slope, three
    harmonics and the fundamental times time, so that growth leaks into none of them.
    """
    count = cycles.time.size
    third, error, quadrature = np.zeros(count), np.full(count, np.inf), np.zeros(count)
    omega = 2.0 * np.pi * cycles.reference_frequency
    half = 0.5 / cycles.reference_frequency
    if (len(time) - 1) / (time[-1] - time[0]) / cycles.reference_frequency < THIRD_HARMONIC:
        return third, error
    first = np.searchsorted(time, cycles.time - half)
    stop = np.searchsorted(time, cycles.time + half)
    sizes = stop - first
    for size in np.unique(sizes):
        if size < THIRD_HARMONIC - 1:
            continue
        which = np.flatnonzero(sizes == size)
        index = first[which][:, None] + np.arange(size)
        tau = time[index] - cycles.time[which][:, None]
        theta = omega * tau
        scaled = tau / half
        columns = np.stack(
            [np.ones_like(theta), np.cos(theta), np.sin(theta), np.cos(2 * theta), np.sin(2 * theta), np.cos(3 * theta),
             np.sin(3 * theta), scaled * np.cos(theta), scaled * np.sin(theta)], axis=2,
        )  # fmt: skip
        normal = np.einsum("kni,knj->kij", columns, columns)
        right = np.einsum("kni,kn->ki", columns, response[index])
        inverse = np.linalg.pinv(normal)
        beta = np.einsum("kij,kj->ki", inverse, right)
        residual = response[index] - np.einsum("kni,ki->kn", columns, beta)
        variance = np.sum(residual**2, axis=1) / max(size - 9, 1)
        # response = Re[z exp(i theta)] = Re z cos - Im z sin
        z = beta[:, 1] - 1j * beta[:, 2]
        three = beta[:, 5] - 1j * beta[:, 6]
        unit = z / np.maximum(np.abs(z), 1e-300)
        turned = three * np.conj(unit) ** 3
        third[which], quadrature[which] = np.real(turned), np.imag(turned)
        error[which] = np.sqrt(variance * 0.5 * (inverse[:, 5, 5] + inverse[:, 6, 6]))
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
