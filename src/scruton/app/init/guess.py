"""What the envelope of a channel says: which stretches are transients, and of which kind."""

from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Kind
from scruton.envelope import dominant_frequency

# All by judgement; the two levels of the end of a decay are those that come nearest to windows chosen by hand.
_RISE, _LONE_RISE = 3.0, 10.0  # times, within `_SUDDEN` cycles, is a release; where the record is not at rest between
_REST = 0.2  # of the largest amplitude: the middle one of a record of plucks with rest between
_SUDDEN = 4  # cycles
_LARGE = 0.25  # of the largest amplitude: a smaller release is a knock
_ONE_OF_MANY = 0.09  # of their middle first amplitude: where all plucks of a channel are let go, at one level
_ABOVE_REST = 3.0  # times the rest between plucks: where they are let go if all come to it, and that is later
_LAST = 0.01  # of its first amplitude: where a lone decay is let go
_SETTLED = 3  # cycles after the peak of a pluck: other modes have died away
_FALLEN, _GROWN = 0.7, 1.5  # of the end over the beginning
_EVEN = 1.15  # of its first half over its second: where a body is held that grows thereafter
_RELEASED = 1.05  # of the amplitude at which it was held: the last cycle before a decay
_BEYOND = 3.0  # times the scatter of its last half: how far a record has to fall or grow
_FLAT = 0.25  # of the mean slope: that of the last quarter, where a decay has come to a steady amplitude
_FEWEST = 6  # cycles of a window


@dataclass(frozen=True)
class Stretch:
    """A part of a channel: its kind, and its first and last time [s], None where it is the channel's own."""

    kind: Kind
    start: float | None
    stop: float | None
    level: float  # amplitude, the channel's unit: the largest of a transient, the root mean square of a steady state
    frequency: float  # Hz
    damping_ratio: float | None = None  # of a ring-down: from a straight line through the logarithm of its amplitude


@dataclass(frozen=True, eq=False)
class Motion:
    """The oscillation of a channel: amplitude (N,) about its frequency [Hz], and its share of the variance."""

    frequency: float
    amplitude: FloatArray
    share: float


def oscillation(values: FloatArray, step: float) -> Motion | None:
    """Find the oscillation of an evenly sampled channel; None where there is none."""
    from scipy.signal import butter, hilbert, sosfiltfilt

    if len(values) < 40 or not np.isfinite(values).all() or np.ptp(values) == 0.0:
        return None
    frequency = dominant_frequency(step * np.arange(len(values), dtype=np.float64), values)
    if not np.isfinite(frequency) or 1.4 * frequency * step >= 0.5:
        return None
    band = butter(2, [1.2 * frequency * step, 2.8 * frequency * step], btype="bandpass", output="sos")
    centred = values - np.median(values)
    try:
        motion = sosfiltfilt(band, centred)
    except ValueError:  # shorter than the filter
        return None
    amplitude = np.abs(hilbert(motion))
    share = float(np.var(motion) / np.var(values))
    return Motion(frequency, amplitude, share)


def stretches(motion: Motion, start: float, step: float, *, wind: bool | None) -> list[Stretch]:
    """Divide a channel into its transients, or take it whole; `wind` says whether there is any, None: not known."""
    cycle = max(1, round(1.0 / (motion.frequency * step)))
    a = np.asarray(motion.amplitude[: len(motion.amplitude) // cycle * cycle]).reshape(-1, cycle).mean(axis=1)
    if len(a) < _FEWEST:
        return []
    peaks = _releases(a)
    if not peaks:
        return [_whole(a, motion.frequency, start, cycle * step, wind)]
    ends = [*peaks[1:], len(a)]
    still = Kind.DECAY if wind else Kind.FREE_DECAY
    many = len(peaks) > 1
    settled = [min(peak + _SETTLED * many, len(a) - 1) for peak in peaks]
    common = _ONE_OF_MANY * float(np.median(a[settled]))
    rests = [_rest(a[peak : end - _SUDDEN]) for peak, end in zip(peaks, ends, strict=True)]
    common = min(common, _ABOVE_REST * max(rests)) if all(rests) else common
    found = []
    for peak, end in zip(peaks, ends, strict=True):
        first = peak + (_SETTLED if many else 0)
        # ahead of the next release the amplitude is at its lowest
        below = np.flatnonzero(a[first:end] < (common if many else _LAST * a[first]))
        last = first + int(below[0]) if len(below) else end - (_SUDDEN if end < len(a) else 0)
        if last - first >= _FEWEST:
            stop = None if last >= len(a) else start + last * cycle * step
            begin, level = start + first * cycle * step, float(a[peak])
            found.append(Stretch(still, begin, stop, level, motion.frequency, _damping(a[first:last])))
    return found


def _rest(a: FloatArray) -> float:
    """Amplitude to which a pluck has come at its end; zero where it still falls there."""
    tail = a[-(len(a) // 4) :]
    half = len(tail) // 2
    if half < _FEWEST:
        return 0.0
    first, last = float(np.median(tail[:half])), float(np.median(tail[half:]))
    return last if first < _GROWN * last else 0.0  # noise in a narrow band wanders


def _damping(a: FloatArray) -> float:
    """Damping ratio of a ring-down, as far down as a fifth of its first amplitude; `a` (N,) by cycle."""
    below = np.flatnonzero(a < 0.2 * a[0])
    part = a[: max(int(below[0]) if len(below) else len(a), _FEWEST)]
    slope = np.polyfit(np.arange(len(part)), np.log(np.maximum(part, 1e-12 * a[0])), 1)[0]
    return float(-slope / (2.0 * np.pi))


def _releases(a: FloatArray) -> list[int]:
    """Cycles of the peaks that follow a sudden rise out of rest."""
    peaks: list[int] = []
    rise = _RISE if float(np.median(a)) < _REST * float(a.max()) else _LONE_RISE
    for i in range(1, len(a) - _FEWEST):
        before = float(a[max(0, i - _SUDDEN) : i].min())
        highest = i + int(np.argmax(a[i : i + _SUDDEN]))
        sudden = a[i] > rise * before and a[i] >= _LARGE * a.max() and a[i] >= a[highest]
        fallen = a[i + _SUDDEN : i + 6 * _SUDDEN]
        if sudden and len(fallen) and fallen.min() < 0.95 * a[i] and (not peaks or i - peaks[-1] > 2 * _SUDDEN):
            peaks.append(i)
    return peaks


def _held(a: FloatArray, head: float) -> int:
    """Cycles at the beginning of a growth in which the body is still held; `head` is the amplitude there."""
    low = np.flatnonzero(a[: int(np.argmax(a))] < _GROWN * head)
    rest = int(low[-1]) + 1 if len(low) else 0
    half = rest // 2
    flat = half >= _FEWEST and float(np.median(a[half:rest])) < _EVEN * float(np.median(a[:half]))
    return rest if flat else 0


def _held_above(a: FloatArray, head: float) -> int:
    """Cycles at the beginning of a decay in which the body is still held; `head` is the amplitude there."""
    low = np.flatnonzero(a < head / _GROWN)
    until = int(low[0]) if len(low) else 0
    half = until // 2
    if half < _FEWEST or not head / _EVEN < float(np.median(a[half:until])) < _EVEN * head:
        return 0
    return 1 + int(np.flatnonzero(a[:until] >= float(np.median(a[:until])) / _RELEASED)[-1])


def _whole(a: FloatArray, frequency: float, start: float, cycle: float, wind: bool | None) -> Stretch:
    """Take a channel whole: what its envelope does from the first tenth to the last, beyond its own scatter.

    `start` and `cycle` [s] are of the first cycle and of each.
    """
    tenth = max(2, len(a) // 10)
    head, tail = float(np.median(a[:tenth])), float(np.median(a[-tenth:]))
    change = float(np.log(tail / head)) if min(head, tail) > 0.0 else 0.0
    steady = abs(change) < _BEYOND * float(np.std(np.log(np.maximum(a[len(a) // 2 :], 1e-3 * a.max()))))
    if not steady and tail > _GROWN * head:
        rest = _held(a, head)
        return Stretch(Kind.GROWTH, start + rest * cycle if rest else None, None, tail, frequency)
    if steady or tail > _FALLEN * head:
        return Stretch(Kind.STEADY, None, None, float(np.sqrt(np.mean(a * a))), frequency)
    quarter = a[-max(4, len(a) // 4) :]
    half = len(quarter) // 2
    fall = float(np.log(np.median(quarter[:half]) / np.median(quarter[half:])))
    settled = fall < _FLAT * -change / 8.0  # the middles of the halves lie an eighth of the record apart
    held = _held_above(a, head)
    begin = start + held * cycle if held else None
    if settled and tail < _LAST * float(a.max()) and not wind:  # it has come to rest: noise alone is left
        rest = int(np.argmax(a < _LAST * a.max()))
        stop = start + rest * cycle
        return Stretch(Kind.FREE_DECAY, begin, stop, float(a[held:].max()), frequency, _damping(a[held:rest]))
    in_wind = settled if wind is None else wind
    kind = Kind.DECAY if in_wind else Kind.FREE_DECAY
    return Stretch(kind, begin, None, float(a[held:].max()), frequency, _damping(a[held:]))
