"""How a record was sampled: its step, its regularity, its gaps."""

from dataclasses import dataclass

import numpy as np

from scruton.arrays import BoolArray, FloatArray, IntArray
from scruton.envelope.thresholds import GAP, JITTER


@dataclass(frozen=True, eq=False)
class Sampling:
    """The time steps of a record: the usual (median) one [s], jitter, and the times [s] about each gap, (m, 2).

    Jitter is the largest departure of a step from the usual one, gaps left out, over the usual one.
    """

    step: float
    jitter: float
    gaps: FloatArray

    @property
    def uniform(self) -> bool:
        """True where no step differs by more than 1 % and there is no gap."""
        return self.jitter <= JITTER and len(self.gaps) == 0


def sampling(time: FloatArray) -> Sampling:
    """Look at the steps of `time` (N,), N >= 2, strictly increasing [s]."""
    steps = np.diff(time)
    step = float(np.median(steps))
    if max(np.max(steps) - step, step - np.min(steps)) <= JITTER * step:
        # the mean is better rounded than any one difference of large times
        mean = float(time[-1] - time[0]) / len(steps)
        return Sampling(mean, float(np.max(np.abs(steps - step))) / step, np.empty((0, 2)))
    wide = steps > GAP * step
    jitter = float(np.max(np.abs(steps[~wide] - step)) / step)
    at = np.flatnonzero(wide)
    return Sampling(step, jitter, np.stack([time[at], time[at + 1]], axis=1))


def equal_steps(time: FloatArray, response: FloatArray, steps: Sampling) -> tuple[FloatArray, FloatArray]:
    """Interpolate a record to equal steps; a cubic, but a straight line across the gaps."""
    from scipy.interpolate import CubicSpline

    count = round(float(time[-1] - time[0]) / steps.step) + 1
    even = np.linspace(time[0], time[-1], count)
    even_response = np.asarray(CubicSpline(time, response)(even), dtype=float)
    # a cubic swings freely across a gap: draw a straight line there, and leave it out afterwards
    for begin, end in steps.gaps:
        inside = (even > begin) & (even < end)
        even_response[inside] = np.interp(even[inside], time, response)
    return even, even_response


def quantum_of(response: FloatArray) -> float:
    """Quantum of a rounded record: the step that all its steps are multiples of; 0 where there is none.

    It is the smallest step, or a half or a third of it: where samples keep step with the motion few steps differ.
    """
    steps = np.abs(np.diff(response[:20_000]))
    steps = steps[steps > 1e-7 * np.ptp(response)]
    if len(steps) == 0:
        return 0.0
    for quantum in float(np.min(steps)) / np.arange(1.0, 4.0):
        multiples = steps / quantum
        if np.median(np.abs(multiples - np.round(multiples))) < 0.02:
            return float(quantum)
    return 0.0


def held_for(response: FloatArray) -> int:
    """Number of samples that a reading stands for, as a rule: more than one where a sensor is slower than the clock.

    Readings that rounding repeats change by one quantum, those that are held by many.
    """
    changes = np.flatnonzero(np.diff(response))
    if len(changes) < 2 or np.median(np.abs(np.diff(response)[changes])) < 2.0 * quantum_of(response):
        return 1
    return int(np.median(np.diff(changes)))


def run_lengths(flag: BoolArray) -> IntArray:
    """Lengths of the runs of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flag, [False]])))
    return edges[1::2] - edges[::2]


def sines(count: int, frequency: float) -> FloatArray:
    """A constant, cosine and sine over `count` samples, (count, 3), at a frequency in cycles a sample."""
    turned = 2.0 * np.pi * frequency * np.arange(count)
    return np.stack([np.ones(count), np.cos(turned), np.sin(turned)], axis=1)


def sines_through(cycles: FloatArray, frequency: float) -> FloatArray:
    """Constant, cosine and sine, (K, 3), of least squares through cycles of samples, (K, n), at cycles a sample."""
    return np.asarray(cycles @ np.linalg.pinv(sines(cycles.shape[1], frequency)).T)
