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
from scruton.campaign.schema import Record
from scruton.envelope.flat_tops import flat_sides
from scruton.envelope.lines import WANDER, harmonics, mains_seen
from scruton.envelope.sampling import quantum_of, sampling
from scruton.envelope.thresholds import (
    CUT_OFF,
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

OTHER_MODE = "other mode"  # kind of the remarks
_LONGEST = 2**17  # samples that are looked at
_RATES = np.geomspace(0.5, 64.0, 8)  # of decay, per length of the record
_LOWEST, _HIGHEST = 0.08, 0.4  # frequencies that are looked at: of the motion's, and of the sample rate
_STEPS, _FARTHEST_STEP, _FARTHEST = 8, 0.3, 0.1  # of refining a pole, and how far it may move, of its frequency
_ROUNDS = 3  # of looking at what is left
_BESIDE = 0.3  # of the largest, that another has to have to be taken out with it
_SAME = 0.03  # of the frequency, by which one mode's may be off in the first round
_FEWEST = 64  # samples
_DRIFT = 5  # order of the polynomial that an offset wanders by
_PROMISES = 0.2  # of MODE_NATS: with what a damped line has of its own on either side counted as noise


def without_other_modes(record: Record, cycles: Cycles, again: Callable[[Record], Cycles]) -> tuple[Record, Cycles]:
    """A record without the free vibrations beside its motion, and its cycles, which tell them.

    Parameters
    ----------
    record : Record
    cycles : Cycles
        Its demodulation.
    again : callable
        Demodulates what is left.

    Returns
    -------
    Record, Cycles
        As they were where there are none, where the file holds an amplitude or a filter's band, or where readings stand
        at the end of a sensor's range: less a vibration they would no longer stand there.
    """
    left, told, known = record, cycles, tuple[OtherMode, ...]()
    if record.is_envelope or record.band is not None:
        return record, cycles
    for _ in range(_ROUNDS):
        modes = other_modes(left, told)
        if not modes:
            break
        if not known and any(
            side.nats > CUT_OFF for side in flat_sides(record.time, record.response, cycles.reference_frequency)
        ):
            return record, cycles
        left = without_modes(left, told, modes)
        told = again(left)
        # what is left of one that was taken out already is none of its own
        known += tuple(one for one in modes if all(abs(one.frequency / k.frequency - 1.0) > _SAME for k in known))
    return left, replace(told, released=known)


def other_modes(record: Record, cycles: Cycles) -> tuple[OtherMode, ...]:
    """Find the free vibrations beside the motion in a record, given its demodulation, largest first.

    The smaller ones beside a large one have to wait until it is gone: it moves the amplitude of every cycle, too.
    """
    end = cycles.time[-1] + 0.5 / cycles.reference_frequency
    inside = np.flatnonzero((record.time >= cycles.begin) & (record.time <= end))[:_LONGEST]
    if inside.size < _FEWEST:
        return ()
    time = record.time[inside]
    t = np.arange(time[0], time[-1], sampling(record.time).step)
    drift = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, t.size), _DRIFT)
    known = np.linalg.qr(np.column_stack([drift, harmonics(t, cycles)]))[0]
    now = _Rest(t - cycles.begin, np.interp(t, time, record.response[inside]), cycles.reference_frequency, known)
    now, motion = replace(now, left=now.beside(now.left)), float(np.max(cycles.smoothed()))
    found: list[OtherMode] = []
    for _ in range(MODES):
        mode = now.largest()
        size = abs(mode.amplitude) / motion if mode else 0.0
        least = max(MODE_SIZES[0], _BESIDE * found[0].relative if found else 0.0)
        if mode is None or not least < size < MODE_SIZES[1]:
            break
        found.append(replace(mode, relative=size))
        now = now.less(mode)
    return tuple(found)


def without_modes(record: Record, cycles: Cycles, modes: Sequence[OtherMode]) -> Record:
    """The record less these vibrations, in steps of its rounding, which it keeps."""
    motion = np.sum([mode.motion(record.time - cycles.begin) for mode in modes], axis=0)
    quantum = quantum_of(record.response)
    return replace(record, response=record.response - (quantum * np.round(motion / quantum) if quantum else motion))


def told(record: Record, modes: Sequence[OtherMode]) -> Remark:
    """What is remarked of the record that they were taken out of."""
    lines = ", ".join(f"{mode.frequency:.3g} Hz" for mode in modes)
    largest = 100.0 * max(mode.relative for mode in modes)
    what = "another mode, {}% of the motion at first, dies away beside it"
    text = f"{what.format(f'{largest:.2g} ')} ({lines}): set going by the release, and taken out."
    return Remark(Severity.NOTE, OTHER_MODE, "record", record.name, text, f"{what.format('{} ')} (taken out)", largest)


@dataclass(frozen=True, eq=False)
class _Rest:
    """What is left beside a motion of frequency `f` [Hz], at equal steps `t` from where its cycles begin [s], (N,).

    `known` is what may be in the record anyhow, the motion with its harmonics and a drift, orthonormal, (N, K): modes
    are fitted together with it.
    """

    t: FloatArray
    left: FloatArray
    f: float
    known: FloatArray

    def beside(self, x: FloatArray) -> FloatArray:
        """What of (N, ...) is none of what is known."""
        return np.asarray(x - self.known @ (self.known.T @ x))

    @cached_property
    def size(self) -> int:
        return 1 << int(np.ceil(np.log2(2 * self.t.size)))

    @cached_property
    def frequency(self) -> FloatArray:
        return np.asarray(np.fft.rfftfreq(self.size, float(self.t[1] - self.t[0])))

    @cached_property
    def allowed(self) -> BoolArray:
        """Frequencies that another mode may have: away from the motion, its harmonics and the mains."""
        length, rate = float(self.t[-1]), 1.0 / float(self.t[1] - self.t[0])
        order = np.round(self.frequency / self.f)
        apart = np.where(order == 1, MODE_APART, MODE_OF_HARMONIC) * self.f
        allowed = (self.frequency > max(MODE_TURNS / length, _LOWEST * self.f)) & (self.frequency < _HIGHEST * rate)
        allowed &= (np.abs(self.frequency - order * self.f) > apart) | (order == 0)
        for hum in mains_seen(rate).values():
            allowed &= np.abs(self.frequency - hum) > WANDER + 1.0 / length
        return np.asarray(allowed)

    def powers(self, rate: float) -> FloatArray:
        """By frequency, what a vibration that decays at a rate [1/s] would explain."""
        fall = np.exp(-rate * self.t)
        return np.asarray(np.abs(np.fft.rfft(self.left * fall, self.size)) ** 2 / np.sum(fall**2))

    def less(self, mode: OtherMode) -> "_Rest":
        return replace(self, left=self.left - self.beside(mode.motion(self.t)))

    def largest(self) -> OtherMode | None:
        """The free vibration that explains most, None where there is none."""
        if not self.allowed.any():
            return None
        best = (0.0, 0.0, 0)
        for rate in _RATES / self.t[-1]:
            power = self.powers(rate)
            at = int(np.argmax(np.where(self.allowed, power, 0.0)))
            best = max(best, (float(power[at]) / _by_chance(power, at), rate, at))
        if best[0] < _PROMISES * MODE_NATS:
            return None
        pole = first = complex(-best[1], 2.0 * np.pi * self.frequency[best[2]])
        for _ in range(_STEPS):
            amplitude, change = self.fitted(pole)
            if amplitude == 0.0 or abs(change) > _FARTHEST_STEP * first.imag:
                return None
            pole += change
        mode = OtherMode(pole.imag / (2.0 * np.pi), -pole.real, self.fitted(pole)[0])
        return mode if abs(pole - first) < _FARTHEST * first.imag and self._is_free(mode) else None

    def fitted(self, pole: complex) -> tuple[complex, complex]:
        """Amplitude of exp(pole t) in what is left, and by how much the pole has to change (Gauss-Newton)."""
        wave: ComplexArray = np.exp(pole * self.t)
        columns = np.stack([wave.real, -wave.imag, self.t * wave.real, -self.t * wave.imag], axis=1)
        a, b, c, d = np.linalg.lstsq(self.beside(columns), self.left, rcond=None)[0].tolist()
        amplitude = complex(a, b)
        return amplitude, complex(c, d) / amplitude if amplitude else 0j

    def _is_free(self, mode: OtherMode) -> bool:
        """Whether a vibration dies away, is no more damped than a mode, and is what makes its line."""
        at = int(np.argmin(np.abs(self.frequency - mode.frequency)))
        dies = mode.rate * self.t[-1] > MODE_FALLS and mode.rate < MODE_DAMPING * 2.0 * np.pi * mode.frequency
        if not (dies and self.allowed[at]):
            return False
        width = max(4.0 / self.t[-1], 4.0 * mode.rate / (2.0 * np.pi), 0.05 * self.f)
        near = np.abs(self.frequency - mode.frequency) < width
        before, after = self.powers(mode.rate), self.less(mode).powers(mode.rate)
        explained = np.sum(after[near]) < MODE_LEAVES * np.sum(before[near])
        return bool(explained and before[at] > MODE_NATS * _by_chance(after, at))


def _by_chance(power: FloatArray, at: int) -> float:
    """The power that noise has about a place of a spectrum."""
    return max(float(np.median(power[at - at // 3 : at + at // 3 + 2])) / math.log(2.0), 1e-300)
