"""Flat tops: whether the extreme reading of a record repeats itself in a row more often than that of a sine would."""

from typing import NamedTuple

import numpy as np

from scruton.arrays import BoolArray, FloatArray
from scruton.envelope.sampling import quantum_of, run_lengths, sines, sines_through
from scruton.envelope.thresholds import (
    CUT_OFF,
    FEWEST_FOLDED,
    FEWEST_IN_A_CYCLE,
    FEWEST_ON_A_PLATEAU,
    FINEST_QUANTUM,
    LEVEL,
    PLATEAU_NATS,
    PLATEAUS,
    UNEVEN,
)


class FlatTop(NamedTuple):
    """Where a wave is cut off, and how surely.

    Attributes
    ----------
    levels : tuple of float
        Readings at which it is cut off above and below, from the centre of the motion, in the response's unit; inf on a
        side where it is not.
    nats : float
        Log likelihood ratio of the readings that are repeated there, over those that rounding repeats.
    """

    levels: tuple[float, float]
    nats: float


class Side(NamedTuple):
    """One side of a record: `at_top` are the samples at its extreme reading, (N,); the rest as of `FlatTop`."""

    sign: float
    level: float
    nats: float
    at_top: BoolArray


def flat_top(time: FloatArray, response: FloatArray, frequency: float) -> FlatTop:
    r"""Look at the extreme readings of a record, above and below.

    A range that ends leaves every crest beyond it at one value: its samples stand there in a row. Two beside a crest
    may agree however fine the reading is, where the sampling keeps step with the motion; but then those before and
    after them agree, too, and a third agrees only where rounding is coarse. The crest of a sine of amplitude :math:`A`,
    sampled n times a cycle, has at most :math:`m = (n/\pi) \sqrt{2q/A}` samples within a quantum q of its top, and
    three of them by chance in the part :math:`m^2/16` of crests where m is small. Of K readings too many, where that
    gives :math:`\mu`, Poisson's log likelihood ratio is :math:`K \ln(K/\mu) - K + \mu`. What a record repeats
    elsewhere (samples that are held) counts as chance.

    Parameters
    ----------
    time, response : (N,) array
    frequency : float
        Of the motion [Hz].

    Returns
    -------
    FlatTop
        With 0 nats where nothing is cut off.
    """
    sides = flat_sides(time, response, frequency)
    if not sides:
        return FlatTop((np.inf, np.inf), 0.0)
    off = _centre(time, response, frequency, np.any([side.at_top for side in sides], axis=0)) - float(np.mean(response))
    levels = {side.sign: max(side.level - side.sign * off, 0.05 * side.level) for side in sides}
    return FlatTop((levels.get(1.0, np.inf), levels.get(-1.0, np.inf)), sum(side.nats for side in sides))


def _centre(time: FloatArray, response: FloatArray, frequency: float, cut: BoolArray) -> float:
    """What the motion is about, by sines through the samples that are not `cut` of the cycles in which some are."""
    step = float(time[-1] - time[0]) / (time.size - 1)
    count = round(1.0 / (frequency * step))
    if count < FEWEST_IN_A_CYCLE:
        return float(np.mean(response))
    whole = time.size // count * count
    basis = sines(count, frequency * step)
    left = ~cut[:whole].reshape(-1, count)
    use = np.any(~left, axis=1) & (np.count_nonzero(left, axis=1) > max(3, 0.4 * count))
    if not use.any():
        return float(np.mean(response))
    cycles = response[:whole].reshape(-1, count)[use, :, None]
    weighted = (left[use, :, None] * basis).transpose(0, 2, 1)
    fitted = np.linalg.solve(weighted @ basis, weighted @ cycles)
    return float(np.median(fitted[:, 0, 0]))


def cut_off_sides(time: FloatArray, response: FloatArray, frequency: float) -> list[Side]:
    """The sides at which readings stand at an end of the range, and not by chance."""
    return [side for side in flat_sides(time, response, frequency) if side.nats > CUT_OFF]


def flat_sides(time: FloatArray, response: FloatArray, frequency: float) -> list[Side]:
    """The sides of a record whose extreme reading is repeated more often than by chance, above first."""
    mean = float(np.mean(response))
    folded = _fold(time, response - mean, frequency)
    per_cycle = (time.size - 1) / float(time[-1] - time[0]) / frequency
    quantum, sides = quantum_of(response), []
    for sign in (1.0, -1.0):
        y = sign * (response - mean)
        top = float(np.max(y))
        if not top > 0.0:
            continue
        step = max(quantum, FINEST_QUANTUM * top)
        at_top = y >= top - 0.5 * step
        below = max(int(np.count_nonzero(~at_top)), 1)
        held = int(np.count_nonzero((np.abs(np.diff(y)) < 0.5 * step) & ~at_top[1:])) / below
        rows = run_lengths(at_top)
        near = per_cycle / np.pi * np.sqrt(2.0 * step / top)
        chance = rows.size * (near * min(1.0, near * near / 16.0) + held / (1.0 - min(held, 0.99)))
        starts = np.flatnonzero(np.diff(at_top.astype(np.int8), prepend=0) > 0)
        pairs = starts[(rows == 2) & (starts > 0) & (starts + 2 < y.size)]
        lopsided = np.abs(y[pairs - 1] - y[pairs + 2]) > 4.0 * step + UNEVEN * top
        repeated = int(np.sum(np.maximum(rows - 2, 0)) + np.count_nonzero(lopsided))
        nats = float(repeated * np.log(repeated / chance) - repeated + chance) if repeated > chance else 0.0
        level = None if nats > CUT_OFF or folded is None else folded.plateau(sign)
        if level is not None:  # with noise that comes after the end of the range no reading is repeated
            sides.append(Side(sign, level.height, PLATEAU_NATS, y > level.height - 3.0 * level.scatter))
        elif nats > 0.0:
            sides.append(Side(sign, top, nats, at_top))
    return sides


class _Level(NamedTuple):
    height: float
    scatter: float


class _Folded(NamedTuple):
    """The samples of whole cycles laid over each other, (K, n) each: readings, and phases from the crest [rad].

    `size` is the amplitude of each cycle's fundamental, (K,).
    """

    reading: FloatArray
    phase: FloatArray
    size: FloatArray

    def plateau(self, sign: float) -> _Level | None:
        """Where the crests of the largest cycles bend and slope by less than a tenth of a sine; None elsewhere.

        A sensor that saturates softly rounds its crests and flattens none.
        """
        large = self.size > 0.9 * np.quantile(self.size, 0.95)
        y, size = sign * self.reading[large], float(np.mean(self.size[large]))
        phase = self.phase[large] if sign > 0.0 else self.phase[large] % (2.0 * np.pi) - np.pi
        for width in PLATEAUS:
            near = np.abs(phase) < width
            count = near.sum(axis=1, keepdims=True)
            near &= count > 1
            if np.count_nonzero(near) < FEWEST_ON_A_PLATEAU:
                continue
            columns = np.stack([y, phase, phase**2])
            own = np.sum(columns * near, axis=2, keepdims=True) / np.maximum(count, 1)
            rest, slope, bend = (columns - own)[:, near]
            basis = np.stack([slope, bend], axis=1)
            # where the sampling keeps step with the motion, samples may lie at two phases alone
            if np.linalg.cond(basis) > 100.0 / width:
                continue
            inverse = np.linalg.inv(basis.T @ basis)
            fitted = inverse @ (basis.T @ rest)
            scatter = float(np.std(rest - basis @ fitted))
            bound = LEVEL * 0.5 * size  # that of a sine is half its amplitude
            if abs(fitted[1]) + 2.0 * scatter * np.sqrt(inverse[1, 1]) < bound and abs(fitted[0]) < bound:
                return _Level(float(np.median(y[near])), scatter)
        return None


def _fold(time: FloatArray, response: FloatArray, frequency: float) -> _Folded | None:
    step = float(time[-1] - time[0]) / (time.size - 1)
    count = round(1.0 / (frequency * step))
    if count < FEWEST_IN_A_CYCLE or time.size < FEWEST_FOLDED * count:
        return None
    whole = time.size // count * count
    y = response[:whole].reshape(-1, count)
    fitted = sines_through(y, frequency * step)
    turned = 2.0 * np.pi * frequency * step * np.arange(count) - np.arctan2(fitted[:, 2], fitted[:, 1])[:, None]
    phase = (turned + np.pi) % (2.0 * np.pi) - np.pi
    size: FloatArray = np.hypot(fitted[:, 1], fitted[:, 2])
    return _Folded(y, np.asarray(phase, dtype=float), size)
