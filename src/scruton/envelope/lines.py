"""A second line in a record's spectrum: another mode close by (beating), or elsewhere, or a harmonic."""

from dataclasses import dataclass, replace

import numpy as np

from scruton.arrays import BoolArray, FloatArray
from scruton.envelope.sampling import sampling
from scruton.envelope.thresholds import CLOSE_LINE, ONE_SIDED, STANDS_OUT, STANDS_OUT_OF_NOISE
from scruton.envelope.types import Cycles

_LONGEST = 2**19  # samples that the spectrum looks at
_FOLDED_WANDER = 1e-3  # of its frequency, by which a harmonic may be off
_MOST_FOLDED = 25  # order of the highest harmonic of which an alias is looked for: a wave that is cut off has such

_MAINS, MAINS_WANDER = (50.0, 60.0), 0.15  # Hz, and how far from it a line may be seen


@dataclass(frozen=True)
class Line:
    """A spectral line besides the main one.

    `relative` is its height over the main line's; `harmonic` is its order where it is a multiple of the main
    frequency, or an alias of one (a distorted wave rather than another motion), otherwise 0.
    """

    frequency: float
    relative: float
    harmonic: int = 0

    def mains(self, sample_rate: float) -> float:
        """Frequency of the mains [Hz] that the line is, or is an alias of, at this sample rate; 0 of any other."""
        seen = mains_seen(sample_rate)
        return next((hum for hum, line in seen.items() if abs(self.frequency - line) < MAINS_WANDER), 0.0)


def mains_seen(sample_rate: float) -> dict[float, float]:
    """Where the hum of each mains frequency shows in a record of this sample rate, as itself or folded [Hz]."""
    return {hum: folded(hum, sample_rate) for hum in _MAINS}


def folded(frequency: float, sample_rate: float) -> float:
    """Where a frequency shows at a sample rate, as itself or as an alias [Hz]."""
    return abs(frequency - sample_rate * round(frequency / sample_rate))


def folded_harmonics(main: float, sample_rate: float) -> dict[int, float]:
    """Where the harmonics of a line that a sample rate is too low for show in a record, by their order [Hz]."""
    orders = range(int(0.5 * sample_rate / main) + 1, _MOST_FOLDED + 1)
    return {k: folded(k * main, sample_rate) for k in orders}


def apart_from_folded(frequency: FloatArray, main: float, sample_rate: float, resolution: float) -> BoolArray:
    """Which frequencies of a spectrum are none of the harmonics that a sample rate is too low for."""
    seen = folded_harmonics(main, sample_rate).items()
    apart = [np.abs(frequency - line) > _FOLDED_WANDER * k * main + resolution for k, line in seen]
    return np.all(apart, axis=0) if apart else np.ones(frequency.shape, dtype=bool)


def apart_from_mains(frequency: FloatArray, sample_rate: float, resolution: float) -> BoolArray:
    """Which frequencies of a spectrum are none of the hum of the mains, which is in the reading, not in the motion."""
    hums = mains_seen(sample_rate).values()
    return np.all([np.abs(frequency - hum) > MAINS_WANDER + resolution for hum in hums], axis=0)


def second_line(time: FloatArray, response: FloatArray, cycles: Cycles) -> Line | None:
    """Find the strongest line besides the main one; None where nothing stands out.

    Parameters
    ----------
    time, response : (N,) array
        Seconds, and the response.
    cycles : Cycles
        Its demodulation.

    Notes
    -----
    A decay widens the main line, and turbulence surrounds it with a pedestal on both sides: neither is a second
    line. So close by, the complex amplitudes of the cycles are divided into a smooth course (a polynomial in
    the logarithm) and a rest, and the rest must show a line on one side only. Farther away the main motion, as
    demodulated, is subtracted from the record first.
    """
    lines = [line for line in (_near(cycles), _far(time, response, cycles)) if line is not None]
    found = max(lines, key=lambda line: line.relative, default=None)
    if found is None:
        return None
    resolution = 1.5 / float(time[-1] - time[0])
    order = _order(found.frequency, cycles.reference_frequency, 1.0 / sampling(time).step, resolution)
    return replace(found, harmonic=order)


def harmonics(t: FloatArray, cycles: Cycles) -> FloatArray:
    """The motion, smooth over some cycles, and its first two harmonics in and out of phase, at times within, (N, 6)."""
    z = cycles.amplitude * np.exp(1j * cycles.phase)
    kernel = np.hanning(7)[1:-1]
    kernel /= kernel.sum()
    padded = np.concatenate([2 * z[0] - z[2:0:-1], z, 2 * z[-1] - z[-2:-4:-1]])
    smooth = np.convolve(padded, kernel, mode="valid")
    a = np.interp(t, cycles.time, np.abs(smooth))
    phase = np.interp(t, cycles.time, np.unwrap(np.angle(smooth)))
    theta = 2.0 * np.pi * cycles.reference_frequency * (t - cycles.begin) + phase
    return np.stack([f(k * theta) * a for k in (1, 2, 3) for f in (np.cos, np.sin)], axis=1)


def _near(cycles: Cycles) -> Line | None:
    period = 1.0 / cycles.reference_frequency
    number = np.round((cycles.time - cycles.time[0]) / period).astype(np.intp)
    strong = cycles.amplitude > STANDS_OUT_OF_NOISE * cycles.standard_error
    if np.count_nonzero(strong) < 24:
        return None
    n = int(number[-1]) + 1
    a = np.where(strong, cycles.amplitude, 0.0)
    z = a * np.exp(1j * cycles.phase)
    x = 2.0 * (cycles.time - cycles.time[0]) / (cycles.time[-1] - cycles.time[0]) - 1.0
    # the weight is that of a logarithm under equal noise
    order = 4 if np.count_nonzero(strong) > 60 else 3
    course = np.polynomial.Polynomial.fit(x[strong], np.log(a[strong]), order, w=a[strong], domain=[-1, 1])
    turn = np.polynomial.Polynomial.fit(x[strong], cycles.phase[strong], order, w=a[strong], domain=[-1, 1])
    main = np.exp(np.where(strong, course(x), -np.inf) + 1j * turn(x))  # none where only noise is left
    rest = np.zeros(n, dtype=complex)
    # a rest that decays as the motion does would be as wide as the main line: compare like with like
    taper = np.hanning(n + 2)[1:-1]
    rest[number] = (z - main) * np.exp(-1j * turn(x)) * strong
    whole = np.zeros(n)
    whole[number] = np.abs(main)
    size = 1 << int(np.ceil(np.log2(4 * n)))
    height = np.abs(np.fft.fft(rest * taper, size)) / np.sum(whole * taper)
    frequency = np.fft.fftfreq(size)
    # the polynomial absorbs what turns fewer than three times in the record
    usable = (np.abs(frequency) > 3.0 / n) & (np.abs(frequency) < CLOSE_LINE)
    k = int(np.argmax(np.where(usable, height, 0.0)))
    around = usable & (np.abs(np.abs(frequency) - abs(frequency[k])) < 0.5 * abs(frequency[k]) + 8.0 / n)
    mirror = usable & (np.abs(frequency + frequency[k]) < 1.5 / n)
    if height[k] < STANDS_OUT * np.median(height[around]) or height[k] < ONE_SIDED * np.max(height[mirror]):
        return None
    # one cycle's regression passes a line off its frequency by the sinc of the distance
    passed = float(np.sinc(frequency[k]))
    mean_turn = float(np.average(turn.deriv()(x[strong]), weights=a[strong] ** 2)) * 2.0
    drift = mean_turn / (2.0 * np.pi * (cycles.time[-1] - cycles.time[0]))
    return Line(float(cycles.reference_frequency * (1.0 + frequency[k]) + drift), float(height[k]) / passed)


def _order(line: float, main: float, sample_rate: float, resolution: float) -> int:
    """Which multiple of the main frequency, from two on, a line is or is an alias of; 0 of none."""
    order = round(line / main)
    # the main frequency may drift by a hundredth; of a high order, that is far
    if order >= 2 and abs(line - order * main) < 0.01 * order * main + resolution:
        return order
    aliases = folded_harmonics(main, sample_rate)
    return next((k for k, seen in aliases.items() if abs(line - seen) < _FOLDED_WANDER * k * main + resolution), 0)


def _far(time: FloatArray, response: FloatArray, cycles: Cycles) -> Line | None:
    from scipy import fft

    steps = sampling(time)
    n = min(round(float(time[-1] - time[0]) / steps.step) + 1, _LONGEST)
    t = time[:n] if steps.uniform else time[0] + steps.step * np.arange(n)
    y = response[:n] if steps.uniform else np.interp(t, time, response)
    f = cycles.reference_frequency
    # amplitude and phase of the main motion between the cycles; beyond them the signal is left out
    inside = (t >= cycles.time[0]) & (t <= cycles.time[-1])
    t, y = t[inside], y[inside] - np.mean(y[inside])
    a = np.interp(t, cycles.time, cycles.amplitude)
    phase = np.interp(t, cycles.time, cycles.phase) + 2.0 * np.pi * f * (t - cycles.time[0])
    main = a * np.cos(phase)
    taper = np.hanning(len(t))
    size = fft.next_fast_len(len(t), real=True)
    height = np.abs(fft.rfft((y - main) * taper, size))
    top = float(np.max(np.abs(fft.rfft(y * taper, size))))
    grid = np.arange(len(height)) / (size * steps.step)
    outside = (np.abs(grid - f) >= CLOSE_LINE * f) & (grid > max(3.0 / (t[-1] - t[0]), 0.1 * f))
    outside[-2:] = False
    if not outside.any():
        return None
    k = int(np.argmax(np.where(outside, height, 0.0)))
    around = height[int(k * 0.7) : int(k * 1.4) + 2]
    if height[k] < STANDS_OUT * np.median(around):
        return None
    # the demodulation, interpolated, has taken a part of the line along
    taken = float(np.sinc(grid[k] / f - 1.0) ** 3)
    return Line(float(grid[k]), float(height[k]) / top / (1.0 - taken))
