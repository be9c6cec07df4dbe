"""Other modes that the wind keeps up beside the motion in question: narrow bands of noise.

A cycle is too short to tell them from it: they scatter its amplitude, and its phase, from one cycle to the next.
"""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from scruton.arrays import BoolArray, FloatArray
from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.schema import Record
from scruton.envelope.lines import MAINS_WANDER, mains_seen
from scruton.envelope.other_modes import OTHER_MODE, Tracked, by_chance
from scruton.envelope.thresholds import LASTING_APART, LASTING_NATS, LASTING_SIZES, LASTING_WIDTH, MODES
from scruton.envelope.types import Cycles, LastingMode
from scruton.errors import InputError


def without_lasting_modes(tracked: Tracked, again: Callable[[Record], Cycles]) -> Tracked:
    """A record without what stands in narrow bands beside its motion, and its cycles, which tell of it.

    Parameters and results as of `without_other_modes`.
    """
    found, parts = lasting_modes(tracked) if tracked.tells_modes else ([], [])
    if not parts or tracked.is_cut_off:
        return tracked
    try:
        left = tracked.less(parts, again)
    except InputError:
        return tracked
    return replace(left, cycles=left.cycles.also_without(lasting=found))


def lasting_modes(tracked: Tracked) -> tuple[list[LastingMode], list[FloatArray]]:
    """The narrow bands beside the motion in a record, strongest first, and the parts of it, (N,) each, that they are.

    The hum of the mains is a part, and no mode.
    """
    now, record, cycles = tracked.rest, tracked.record, tracked.cycles
    if now is None:
        return [], []
    motion = float(np.max(cycles.smoothed()))
    modes, parts = list[LastingMode](), list[FloatArray]()
    power, frequency, spectrum = now.powers(0.0), now.frequency, np.fft.rfft(now.left, now.size)
    apart = np.abs(frequency / cycles.reference_frequency - 1.0) > LASTING_APART
    turn = 1.0 / float(now.t[-1])

    def part_of(allowed: BoolArray, width: float) -> tuple[int, float, FloatArray]:
        """Where most stands, by how many nats it does, and what stands there."""
        at = int(np.argmax(np.where(allowed, power, 0.0)))
        nats = float(power[at]) / by_chance(power, at) - math.log(max(int(np.count_nonzero(allowed)), 1))
        off = np.abs(frequency - frequency[at]) / max(width * frequency[at], 4.0 * turn)
        gate = apart * np.clip(2.0 - off, 0.0, 1.0)  # no wider: what modulates the motion fast is there, too
        part = np.fft.irfft(spectrum * gate, now.size)[: now.t.size] * now.held
        return at, nats if allowed[at] else 0.0, part

    def keep(part: FloatArray) -> None:
        parts.append(np.interp(record.time - cycles.begin, now.t, part, left=0.0, right=0.0))

    allowed = now.allowed & apart
    for _ in range(MODES):
        at, nats, part = part_of(allowed, LASTING_WIDTH)
        if nats < LASTING_NATS:
            break
        size = float(np.sqrt(2.0 * np.mean(part**2))) / motion
        allowed = allowed & (np.abs(frequency / frequency[at] - 1.0) > 2.0 * LASTING_WIDTH)
        if LASTING_SIZES[0] < size < LASTING_SIZES[1]:
            modes.append(LastingMode(float(frequency[at]), size * motion, size, nats))
            keep(part)
    for hum in mains_seen(now.sample_rate).values():
        near = (np.abs(frequency - hum) < MAINS_WANDER + turn) & apart & ~now.harmonic(frequency)
        _, nats, part = part_of(near, 0.0)
        if nats > LASTING_NATS:
            keep(part)
    return modes, parts


def remark_on_lasting(record: Record, cycles: Cycles) -> Remark:
    """What is remarked of the record that they were taken out of."""
    lines = ", ".join(f"{mode.frequency:.3g} Hz" for mode in cycles.lasting)
    largest = 100.0 * max(mode.relative for mode in cycles.lasting)
    what = "another mode, {}% of the motion, stands beside it"
    text = f"{what.format(f'{largest:.2g} ')} ({lines}): kept up by the wind or the floor, and taken out."
    return Remark(Severity.NOTE, OTHER_MODE, "record", record.name, text, f"{what.format('{} ')} (taken out)", largest)
