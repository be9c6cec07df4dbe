"""Other modes that the release of a model sets going: free vibrations that die away beside the motion in question.

They are of the initial condition, no part of the damping and none of the gap, but shorter windows than theirs take them
for scatter of the amplitude, for a third harmonic or for a second line.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scruton.arrays import ComplexArray, FloatArray
from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.schema import Record
from scruton.envelope.flat_tops import flat_sides
from scruton.envelope.lines import WANDER, beside_motion, mains_seen
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
_STEPS = 8  # of refining a pole
_FEWEST = 64  # samples


def other_modes(record: Record, cycles: Cycles) -> tuple[OtherMode, ...]:
    """Find the free vibrations beside the motion in a record, given its demodulation, largest first."""
    if record.is_envelope or record.band is not None:
        return ()
    time, rest = beside_motion(record.time, record.response, cycles)
    time, rest = time[:_LONGEST], rest[:_LONGEST]
    if time.size < _FEWEST:
        return ()
    begin, step, motion = cycles.begin, sampling(record.time).step, float(np.max(cycles.smoothed()))
    t = np.arange(time[0] - begin, time[-1] - begin, step)
    rest = np.interp(t, time - begin, rest)
    found: list[OtherMode] = []
    for _ in range(MODES):
        mode = _largest(t, rest, step, cycles.reference_frequency)
        if mode is None or not MODE_SIZES[0] * motion < abs(mode.amplitude) < MODE_SIZES[1] * motion:
            break
        found.append(replace(mode, relative=abs(mode.amplitude) / motion))
        rest = rest - mode.motion(t)
    # what stands at the end of a sensor's range would no longer stand there
    cut = found and any(
        side.nats > CUT_OFF for side in flat_sides(record.time, record.response, cycles.reference_frequency)
    )
    return () if cut else tuple(found)


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


def _largest(t: FloatArray, rest: FloatArray, step: float, f: float) -> OtherMode | None:
    """The free vibration that explains most of what is left, None where there is none."""
    size = 1 << int(np.ceil(np.log2(2 * t.size)))
    frequency = np.fft.rfftfreq(size, step)
    length = float(t[-1])
    use = (frequency > max(MODE_TURNS / length, 0.08 * f)) & (frequency < 0.4 / step)
    order = np.round(frequency / f)
    apart = np.where(order == 1, MODE_APART, MODE_OF_HARMONIC)
    use &= (np.abs(frequency - order * f) > apart * f) | (order == 0)
    for hum in mains_seen(1.0 / step).values():
        use &= np.abs(frequency - hum) > WANDER + 1.0 / length
    if not use.any():
        return None
    best = (0.0, 0.0, 0.0)
    for rate in _RATES / length:
        fall = np.exp(-rate * t)
        power = np.abs(np.fft.rfft(rest * fall, size)) ** 2 / np.sum(fall**2)
        at = int(np.argmax(np.where(use, power, 0.0)))
        around = power[max(0, at - at // 3) : at + at // 3 + 2]
        best = max(best, (float(power[at] / max(np.median(around) / np.log(2.0), 1e-300)), rate, float(frequency[at])))
    if best[0] < MODE_NATS:
        return None
    pole = complex(-best[1], 2.0 * np.pi * best[2])
    first = pole
    for _ in range(_STEPS):
        amplitude, change = _fitted(t, rest, pole)
        if abs(amplitude) == 0.0 or abs(change) > 0.3 * abs(first.imag):
            return None
        pole += change
    decay, turn = -pole.real, pole.imag
    if not (decay * length > MODE_FALLS and decay < MODE_DAMPING * turn and abs(pole - first) < 0.1 * first.imag):
        return None
    mode = OtherMode(turn / (2.0 * np.pi), decay, complex(_fitted(t, rest, pole)[0]))
    near = np.abs(frequency - mode.frequency) < max(4.0 / length, 4.0 * decay / (2.0 * np.pi), 0.05 * f)
    before, after = (np.sum(np.abs(np.fft.rfft(x, size)[near]) ** 2) for x in (rest, rest - mode.motion(t)))
    return mode if after < MODE_LEAVES * before else None


def _fitted(t: FloatArray, rest: FloatArray, pole: complex) -> tuple[complex, complex]:
    """Amplitude of exp(pole t) in the rest, and by how much the pole has to change (Gauss-Newton)."""
    wave: ComplexArray = np.exp(pole * t)
    columns = np.stack([wave.real, -wave.imag, t * wave.real, -t * wave.imag], axis=1)
    a, b, c, d = np.linalg.lstsq(columns, rest, rcond=None)[0].tolist()
    amplitude = complex(a, b)
    return amplitude, complex(c, d) / amplitude if amplitude else 0j
