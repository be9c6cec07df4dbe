"""One least-squares demodulation per cycle: the record cut into cycles, and a small regression in each."""

from dataclasses import dataclass

import numpy as np

from scruton.arrays import ComplexArray, FloatArray, IntArray

_BLOCK = 40_000  # samples that are worked on at once: small enough to stay in the processor's cache


@dataclass(frozen=True, eq=False)
class Windows:
    """A record cut into K windows of one cycle of the reference frequency [Hz].

    Gaps leave out numbers on the grid of cycles; a window has samples `first <= i < stop` and its middle [s].
    """

    number: IntArray
    first: IntArray
    stop: IntArray
    middle: FloatArray
    frequency: float


def cut(time: FloatArray, frequency: float) -> Windows:
    """Cut a record into whole cycles; a cycle with a hole of a third of its length, or an end missing, is left out."""
    period = 1.0 / frequency
    # half a step early, so that each sample stands in the middle of its share of the cycle
    origin = float(time[0]) - 0.5 * float(time[-1] - time[0]) / (len(time) - 1)
    end = 2.0 * float(time[0]) - origin + float(time[-1] - time[0])
    count = int(np.floor((end - origin) * frequency * (1.0 + 1e-9)))
    edges = np.searchsorted(time, origin + period * np.arange(count + 1))
    first, stop = edges[:-1].astype(np.intp), edges[1:].astype(np.intp)
    good = stop > first
    wide = np.flatnonzero(np.diff(time) > period / 3.0)
    for begin, finish in zip(time[wide], time[wide + 1], strict=True):
        good[int((begin - origin) * frequency) : int((finish - origin) * frequency) + 1] = False
    number = np.flatnonzero(good)
    middle = origin + period * (number.astype(float) + 0.5)
    return Windows(number, first[number], stop[number], middle, float(frequency))


@dataclass(frozen=True, eq=False)
class CycleFit:
    """The regression of each window, (K,) arrays.

    `z` is the complex amplitude at mid-cycle, response = Re[z exp(i omega (t - middle))]; `offset` the mean;
    `second` and `third` the complex amplitudes of those harmonics (zero if not fitted). `squares` is the residual sum
    of squares, `freedom` its degrees of freedom. `cov_rr`, `cov_ii`, `cov_ri` are the (co)variances of Re z and
    Im z for unit noise, `cov_offset` and `cov_second` (both components together) those of the others.
    """

    z: ComplexArray
    offset: FloatArray
    second: ComplexArray
    third: ComplexArray
    squares: FloatArray
    freedom: FloatArray
    cov_rr: FloatArray
    cov_ii: FloatArray
    cov_ri: FloatArray
    cov_offset: FloatArray
    cov_second: FloatArray


def fit_cycles(
    time: FloatArray,
    response: FloatArray,
    windows: Windows,
    *,
    rate: ComplexArray | None = None,
    drift: FloatArray | None = None,
    harmonics: int = 1,
) -> CycleFit:
    """Regress each window on [cos, sin, 1], and further harmonics, so many in all, times their own growth.

    By normal equations.

    `rate` [1/s] is the growth plus i times the departure of the circular frequency from the reference: inside the
    window the response is Re[z exp((rate + i omega) tau)], tau counted from mid-cycle.  `drift`, the slope of the
    offset [1/s], is subtracted beforehand and not fitted: over one cycle a slope and a sine have a correlation of 0.78,
    so that fitting both would cost most of the precision.
    """
    count, p = len(windows.number), 1 + 2 * harmonics
    coefficient, covariance = np.zeros((count, max(p, 7))), np.zeros((count, 5))
    squares, n = np.empty(count), windows.stop - windows.first
    omega = 2.0j * np.pi * windows.frequency
    exponent = np.full(count, omega) if rate is None else rate + omega
    upper = [(i, j) for i in range(p + 1) for j in range(i, p + 1)]
    per_block = max(1, int(_BLOCK / max(1.0, float(np.mean(n)))))
    for begin in range(0, count, per_block):
        block = slice(begin, begin + per_block)
        first, stop = windows.first[block], windows.stop[block]
        low, high = int(first[0]), int(stop[-1])
        # window of every sample, also of samples between windows, which `bounds` leaves out below
        owner = np.repeat(np.arange(len(first)), np.diff(first, append=high))
        tau = time[low:high] - windows.middle[block][owner]
        wave = np.exp(exponent[block][owner] * tau)
        columns = np.empty((p + 1, high - low))
        columns[0], columns[1], columns[2] = wave.real, -wave.imag, 1.0
        whole = wave
        for k in range(3, p, 2):
            whole = whole * wave
            columns[k], columns[k + 1] = whole.real, -whole.imag
        columns[p] = response[low:high]
        if drift is not None:
            columns[p] -= drift[block][owner] * tau
        bounds = np.stack([first - low, stop - low], axis=1).ravel()
        last = bounds[-1] == high - low
        sums = np.empty((len(first), p + 1, p + 1))
        for i, j in upper:
            total = np.add.reduceat(columns[i] * columns[j], bounds[:-1] if last else bounds)[::2]
            sums[:, i, j] = sums[:, j, i] = total
        inv = np.linalg.inv(sums[:, :p, :p])
        covariance[block, :4] = np.stack([inv[:, 0, 0], inv[:, 1, 1], inv[:, 0, 1], inv[:, 2, 2]], axis=1)
        if harmonics > 1:
            covariance[block, 4] = inv[:, 3, 3] + inv[:, 4, 4]
        right = sums[:, :p, p]
        coefficient[block, :p] = c = np.einsum("kij,kj->ki", inv, right)
        squares[block] = np.maximum(sums[:, p, p] - np.einsum("ki,ki->k", c, right), 1e-14 * sums[:, p, p])
    z, second, third = (coefficient[:, k] + 1j * coefficient[:, k + 1] for k in (0, 3, 5))
    return CycleFit(z, coefficient[:, 2], second, third, squares, (n - p).astype(float), *covariance.T)
