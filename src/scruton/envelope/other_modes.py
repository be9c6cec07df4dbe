"""Other modes that the release of a model sets going: free vibrations that die away beside the motion in question.

They are of the initial condition, no part of the damping and none of the gap, but shorter windows than theirs take them
for scatter of the amplitude, for a third harmonic or for a second line.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from scruton.arrays import BoolArray, ComplexArray, FloatArray
from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.schema import Kind, Record
from scruton.envelope.cycles import misread
from scruton.envelope.flat_tops import cut_off_sides
from scruton.envelope.lines import apart_from_mains, folded, harmonics
from scruton.envelope.sampling import sampling
from scruton.envelope.thresholds import (
    COARSE,
    GAP,
    MODE_APART,
    MODE_DAMPING,
    MODE_FALLS,
    MODE_LEAVES,
    MODE_NATS,
    MODE_OF_HARMONIC,
    MODE_SIZES,
    MODE_TURNS,
    MODES,
)
from scruton.envelope.types import Cycles, OtherMode
from scruton.errors import InputError

OTHER_MODE = "other mode"  # kind of the remarks
_LONGEST = 2**17  # samples that are looked at
_RATES = np.geomspace(0.5, 64.0, 5)  # of decay, per length of the record
_LOWEST, _HIGHEST = 0.08, 0.4  # frequencies that are looked at: of the motion's, and of the sample rate
_ORDERS = 12  # of harmonics
_FEW_CYCLES = 9  # whose mean frequency counts
_STRONG, _WANDERS = 0.1, (0.02, 0.98)  # of the largest amplitude; quantiles of the frequency above it
_STEPS, _FARTHEST_STEP, _FARTHEST = 8, 0.3, 0.1  # of refining a pole, and how far it may move, of its frequency
_TRIES = 3  # of lines, largest first, of which one may be none
_EXPONENTS = (-50.0, 700.0)  # of what falls within a record
_ROUNDS = 3  # of looking at what is left
_BESIDE = 0.3  # of the largest, that another has to have to be taken out with it
_SAME = 0.03  # of the frequency, by which one mode's may be off in the first round
_NEAR = 0.03  # of the frequency, from a harmonic: where a mode is not looked for by itself
_AS_SUSPECTED = 0.02, 4.0  # of the frequency, and factor of the rate, by which one mode's may differ between records
_SUSPECTED_NATS = 8.0  # as MODE_NATS, of a mode that is sought at one place
_FEWEST = 64  # samples
_DRIFT = 5  # order of the polynomial that an offset wanders by
_PROMISES = 0.2  # of MODE_NATS: with what a damped line has of its own on either side counted as noise


@dataclass(frozen=True, eq=False)
class Tracked:
    """A record and its demodulation."""

    record: Record
    cycles: Cycles

    @cached_property
    def rest(self) -> "Rest | None":
        """What the record holds beside its motion; None of one that is too short."""
        return rest_of(self.record, self.cycles)

    @cached_property
    def tells_modes(self) -> bool:
        """Whether other modes show in it: none in an amplitude, nor in what a filter has left of a motion.

        Nor in coarse steps: harmonics of a rounded sine come and go with its amplitude.
        """
        if self.record.is_envelope or self.record.band is not None:
            return False
        return misread(self.record.response, self.cycles) < COARSE

    @property
    def is_cut_off(self) -> bool:
        """Whether readings stand at the end of a sensor's range: less a vibration they would no longer stand there."""
        return bool(cut_off_sides(self.record.time, self.record.response, self.cycles.reference_frequency))

    def less(self, parts: Sequence[FloatArray], again: Callable[[Record], Cycles]) -> "Tracked":
        """The record without parts of it, (N,) each, demodulated again.

        Raises
        ------
        InputError
            If without them nothing moves: they were the motion.
        """
        left = replace(self.record, response=self.record.response - np.sum(parts, axis=0))
        return Tracked(left, again(left).also_without(self.cycles.released, self.cycles.lasting))


def without_other_modes(tracked: Tracked, again: Callable[[Record], Cycles]) -> Tracked:
    """A record without the free vibrations beside its motion, and its cycles, which tell them.

    Parameters
    ----------
    tracked : Tracked
    again : callable
        Demodulates what is left.

    Returns
    -------
    Tracked
        As it was where there are none, or none can be told or taken out.
    """
    now = tracked
    for _ in range(_ROUNDS if tracked.tells_modes else 0):
        modes = other_modes(now)
        if not modes or (now is tracked and now.is_cut_off):
            break
        try:
            left = now.less([mode.motion(now.record.time) for mode in modes], again)
        except InputError:
            break
        # What is left of one that was taken out already is none of its own.
        told = [
            one for one in modes if all(abs(one.frequency / k.frequency - 1.0) > _SAME for k in left.cycles.released)
        ]
        now = replace(left, cycles=left.cycles.also_without(told))
    return now


def without_suspected_modes(
    tracked: Tracked, again: Callable[[Record], Cycles], suspected: Sequence[OtherMode]
) -> Tracked:
    """The same, of free vibrations that other records show, where they lie so near a harmonic that none is looked for.

    A harmonic of the motion dies away with it, and is no mode by itself; but a mode that is known to be there is one.
    """
    record, cycles = tracked.record, tracked.cycles
    if not tracked.tells_modes or record.kind is Kind.STEADY:
        return tracked
    nearest = [round(mode.frequency / cycles.reference_frequency) * cycles.reference_frequency for mode in suspected]
    near = [
        mode for mode, line in zip(suspected, nearest, strict=True)
        if abs(mode.frequency - line) < _NEAR * mode.frequency
        and all(abs(mode.frequency / one.frequency - 1.0) > _SAME for one in cycles.released)
    ]  # fmt: skip
    if not near or tracked.is_cut_off or tracked.rest is None:
        return tracked
    motion = float(np.max(cycles.smoothed()))
    for suspect in near:
        mode = tracked.rest.as_suspected(suspect)
        size = abs(mode.amplitude) / motion if mode else 0.0
        if mode is None or size > MODE_SIZES[1]:
            continue
        mode = replace(mode, since=cycles.begin, relative=size)
        left = tracked.less([mode.motion(record.time)], again)
        return replace(left, cycles=left.cycles.also_without([mode]))
    return tracked


def other_modes(tracked: Tracked) -> tuple[OtherMode, ...]:
    """Find the free vibrations beside the motion in a record, largest first.

    The smaller ones beside a large one have to wait until it is gone: it moves the amplitude of every cycle, too.
    """
    now, cycles = tracked.rest, tracked.cycles
    if now is None:
        return ()
    motion = float(np.max(cycles.smoothed()))
    found: list[OtherMode] = []
    for _ in range(MODES):
        mode = now.largest()
        size = abs(mode.amplitude) / motion if mode else 0.0
        least = max(MODE_SIZES[0], _BESIDE * found[0].relative if found else 0.0)
        if mode is None or not least < size < MODE_SIZES[1]:
            break
        now = now.less(mode)
        found.append(replace(mode, since=cycles.begin, relative=size))
    return tuple(found)


def remark_on(record: Record, modes: Sequence[OtherMode]) -> Remark:
    """What is remarked of the record that they were taken out of."""
    lines = ", ".join(f"{mode.frequency:.3g} Hz" for mode in modes)
    largest = 100.0 * max(mode.relative for mode in modes)
    what = "another mode, {}% of the motion at first, dies away beside it"
    text = f"{what.format(f'{largest:.2g} ')} ({lines}): set going by the release, and taken out."
    return Remark(Severity.NOTE, OTHER_MODE, "record", record.name, text, f"{what.format('{} ')} (taken out)", largest)


def rest_of(record: Record, cycles: Cycles) -> "Rest | None":
    """What a record holds beside its motion, None of one that is too short."""
    inside = np.flatnonzero((record.time >= cycles.begin) & (record.time <= cycles.end))[:_LONGEST]
    if inside.size < _FEWEST:
        return None
    time, step = record.time[inside], sampling(record.time).step
    t = time[0] + step * np.arange(min(int((time[-1] - time[0]) / step) + 1, _LONGEST))
    after = np.clip(np.searchsorted(time, t), 1, time.size - 1)
    held = time[after] - time[after - 1] < GAP * step
    drift = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, t.size), _DRIFT)
    waves = harmonics(t, cycles)
    level = np.hypot(waves[:, 0], waves[:, 1]) / float(np.max(cycles.smoothed()))
    bent = waves[:, 2:] * level[:, None] ** 2  # of a sensor or a spring, harmonics whose share follows the amplitude
    known = np.linalg.qr(held[:, None] * np.column_stack([drift, waves, bent]))[0]
    few = min(_FEW_CYCLES, cycles.time.size)
    means = np.convolve(cycles.frequency, np.ones(few) / few, mode="valid")
    strong = np.convolve(cycles.amplitude, np.ones(few) / few, mode="valid") > _STRONG * np.max(cycles.amplitude)
    low, high = np.quantile(means[strong], _WANDERS).tolist() if strong.any() else 2 * [cycles.reference_frequency]
    rest = Rest(t - cycles.begin, held * np.interp(t, time, record.response[inside]), held, known, (low, high))
    return replace(rest, left=rest.beside(rest.left))


@dataclass(frozen=True, eq=False)
class Rest:
    """What is left beside a motion, at equal steps `t` from where its cycles begin [s], (N,); zero where not `held`.

    `known` is what may be in the record anyhow, the motion with its harmonics and a drift, orthonormal, (N, K): modes
    are fitted together with it.  `range` is that of the motion's frequency [Hz].
    """

    t: FloatArray
    left: FloatArray
    held: BoolArray
    known: FloatArray
    range: tuple[float, float]

    def beside(self, x: FloatArray) -> FloatArray:
        """What of (N, ...) is recorded, and none of what is known."""
        x = (x.T * self.held).T
        return np.asarray(x - self.known @ (self.known.T @ x))

    @property
    def sample_rate(self) -> float:
        """Hz."""
        return 1.0 / float(self.t[1] - self.t[0])

    @cached_property
    def size(self) -> int:
        """Samples of the transform, zeros included."""
        from scipy.fft import next_fast_len

        return int(next_fast_len(self.t.size, real=True))

    @cached_property
    def frequency(self) -> FloatArray:
        """Of the spectrum [Hz]."""
        return np.asarray(np.fft.rfftfreq(self.size, float(self.t[1] - self.t[0])))

    @cached_property
    def allowed(self) -> BoolArray:
        """Frequencies that another mode may have: away from the motion and the mains."""
        low, high = self.range
        allowed = (self.frequency > max(MODE_TURNS / self.t[-1], _LOWEST * low)) & (
            self.frequency < _HIGHEST * self.sample_rate
        )
        allowed &= (self.frequency < (1.0 - MODE_APART) * low) | (self.frequency > (1.0 + MODE_APART) * high)
        allowed &= apart_from_mains(self.frequency, self.sample_rate, 1.0 / float(self.t[-1]))
        return np.asarray(allowed & ~self.harmonic(self.frequency))

    def harmonic(self, frequency: FloatArray) -> BoolArray:
        """Whether lines may be harmonics of the motion, as themselves or folded, wherever that wanders."""
        found = np.zeros(np.shape(frequency), dtype=bool)
        for order in range(2, _ORDERS + 1):
            ends = [folded(order * f, self.sample_rate) for f in self.range]
            margin = MODE_OF_HARMONIC * order * self.range[0]
            found |= (frequency > min(ends) - margin) & (frequency < max(ends) + margin)
        return found

    def powers(self, rate: float) -> FloatArray:
        """By frequency, what a vibration that decays at a rate [1/s] would explain."""
        fall = np.exp(-rate * self.t)
        return np.asarray(np.abs(np.fft.rfft(self.left * fall, self.size)) ** 2 / np.sum((self.held * fall) ** 2))

    def less(self, mode: OtherMode) -> "Rest":
        """The same without a vibration."""
        return replace(self, left=self.left - self.beside(mode.motion(self.t)))

    def largest(self) -> OtherMode | None:
        """The free vibration that explains most, None where there is none."""
        allowed = self.allowed.copy()
        spectra = [(rate, self.powers(rate)) for rate in _RATES / self.t[-1]]
        for _ in range(_TRIES):
            best = (0.0, 0.0, 0)
            for rate, power in spectra:
                at = int(np.argmax(np.where(allowed, power, 0.0)))
                best = max(best, (float(power[at]) / by_chance(power, at), rate, at))
            if not allowed.any() or best[0] < _PROMISES * MODE_NATS:
                break
            first = complex(-best[1], 2.0 * np.pi * self.frequency[best[2]])
            mode = self._climbed(first)
            if mode is not None and self._is_free(mode):
                return mode
            allowed &= np.abs(self.frequency - self.frequency[best[2]]) > _FARTHEST * self.frequency[best[2]]
        return None

    def as_suspected(self, suspect: OtherMode) -> OtherMode | None:
        """A vibration that is the one of another record, and no harmonic of the motion; None where there is none."""
        mode = self._climbed(complex(-suspect.rate, 2.0 * np.pi * suspect.frequency))
        if mode is None:
            return None
        off, low, high = abs(mode.frequency - suspect.frequency), *self.range
        order = max(round(2.0 * mode.frequency / (low + high)), 1)
        harmonic = float(np.clip(mode.frequency, order * low, order * high))
        alike = 1.0 / _AS_SUSPECTED[1] < mode.rate / suspect.rate < _AS_SUSPECTED[1]
        alike &= off < min(_AS_SUSPECTED[0] * suspect.frequency, abs(mode.frequency - harmonic))
        return mode if alike and self._is_free(mode, suspected=True) else None

    def _climbed(self, first: complex) -> OtherMode | None:
        """The vibration whose pole is nearest, None where the search leads away."""
        pole = first
        for _ in range(_STEPS):
            amplitude, change = self.fitted(pole)
            if amplitude == 0.0 or abs(change) > _FARTHEST_STEP * first.imag:
                return None
            pole += change
        if abs(pole - first) > _FARTHEST * first.imag:
            return None
        return OtherMode(pole.imag / (2.0 * np.pi), -pole.real, self.fitted(pole)[0])

    def fitted(self, pole: complex) -> tuple[complex, complex]:
        """Amplitude of exp(pole t) in what is left, and by how much the pole is off (Gauss-Newton); 0 of no mode."""
        if not _EXPONENTS[0] < -pole.real * self.t[-1] < _EXPONENTS[1]:
            return 0j, 0j
        wave: ComplexArray = np.exp(pole * self.t)
        columns = np.stack([wave.real, -wave.imag, self.t * wave.real, -self.t * wave.imag], axis=1)
        a, b, c, d = np.linalg.lstsq(self.beside(columns), self.left, rcond=None)[0].tolist()
        amplitude = complex(a, b)
        return amplitude, complex(c, d) / amplitude if amplitude else 0j

    def _is_free(self, mode: OtherMode, *, suspected: bool = False) -> bool:
        """Whether a vibration dies away, is no more damped than a mode, and is what makes its line."""
        at = int(np.argmin(np.abs(self.frequency - mode.frequency)))
        dies = mode.rate * self.t[-1] > MODE_FALLS and mode.rate < MODE_DAMPING * 2.0 * np.pi * mode.frequency
        if not (dies and (suspected or self.allowed[at])):
            return False
        width = max(4.0 / self.t[-1], 4.0 * mode.rate / (2.0 * np.pi), 0.05 * self.range[0])
        near = np.abs(self.frequency - mode.frequency) < width
        before, after = self.powers(mode.rate), self.less(mode).powers(mode.rate)
        explained = np.sum(after[near]) < MODE_LEAVES * np.sum(before[near])
        nats = _SUSPECTED_NATS if suspected else MODE_NATS
        return bool(explained and before[at] > nats * by_chance(after, at))


def by_chance(power: FloatArray, at: int) -> float:
    """The power that noise has about a place of a spectrum."""
    return max(float(np.median(power[at - at // 3 : at + at // 3 + 2])) / math.log(2.0), 1e-300)
