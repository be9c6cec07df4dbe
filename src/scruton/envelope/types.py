"""What the envelope room hands on: arrays with their meaning, frozen."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scruton.arrays import FloatArray
from scruton.envelope.thresholds import LARGE_MODE
from scruton.shown import fields_in_brief, shown


@dataclass(frozen=True)
class OtherMode:
    """One free vibration beside the motion of a record.

    Attributes
    ----------
    frequency : float
        Hz.
    rate : float
        It dies away as exp(-rate t) [1/s].
    amplitude : complex
        Where it is first seen, with its phase: the motion is the real part of amplitude exp((i omega - rate) t).
    since : float
        When that is, by the record's clock [s].
    relative : float
        Its amplitude there over the largest of the motion.
    """

    frequency: float
    rate: float
    amplitude: complex
    since: float = 0.0
    relative: float = float("nan")

    @property
    def is_large(self) -> bool:
        """Whether it is more than a release sets going by chance."""
        return self.relative > LARGE_MODE

    def motion(self, time: FloatArray) -> FloatArray:
        """Its part of the record at times by the record's clock, (N,) [s]."""
        t = time - self.since
        pole = 2j * np.pi * self.frequency - self.rate
        return np.asarray((self.amplitude * np.exp(pole * np.maximum(t, 0.0))).real * (t >= 0.0))


@dataclass(frozen=True)
class LastingMode:
    """What stands in a narrow band beside the motion of a record.

    Attributes
    ----------
    frequency : float
        Hz.
    amplitude : float
        A/D or rad, of a steady line of that power.
    relative : float
        Over the largest amplitude of the motion.
    nats : float
        Its power over the noise about it, less what chance makes of as many frequencies.
    """

    frequency: float
    amplitude: float
    relative: float
    nats: float

    @property
    def is_large(self) -> bool:
        """Whether it is more than is beside any motion."""
        return self.relative > LARGE_MODE


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class Cycles:
    """The envelope that feeds inference: one least-squares demodulation per cycle.

    Attributes
    ----------
    time : (n,) array
        Middle of each cycle [s], equally spaced by 1/`reference_frequency` except across gaps.
    amplitude : (n,) array
        Amplitude (A/D or rad), unbiased: may be slightly negative when noise exceeds motion.
    standard_error : (n,) array
        Standard error of each amplitude from the residual of its own neighbourhood, > 0.
    phase : (n,) array
        Phase against the reference frequency, unwrapped [rad].
    frequency : (n,) array
        Local frequency [Hz], from the slope of the phase.
    frequency_error : (n,) array
        Standard error of `frequency` [Hz].
    reference_frequency : float
        Frequency of the demodulation [Hz].
    noise_sd : float
        Standard deviation of the broadband residual per sample, in the record's unit; of a record that holds only a
        band, that of white noise as strong as its own at the response's frequency.
    released : tuple of OtherMode
        What was taken out of the record before, largest first; of a fit that is loaded nobody knows any more.
    lasting : tuple of LastingMode
        Likewise, of what stands beside the motion to the end.
    """

    time: FloatArray
    amplitude: FloatArray
    standard_error: FloatArray
    phase: FloatArray
    frequency: FloatArray
    frequency_error: FloatArray
    reference_frequency: float
    noise_sd: float
    released: tuple[OtherMode, ...] = ()
    lasting: tuple[LastingMode, ...] = ()

    def smoothed(self) -> FloatArray:
        """Amplitude, as means of five cycles in a row: four fewer than there are cycles."""
        return np.convolve(self.amplitude, np.ones(5) / 5.0, mode="valid")

    @property
    def begin(self) -> float:
        """Where the first cycle begins [s]."""
        return float(self.time[0]) - 0.5 / self.reference_frequency

    @property
    def end(self) -> float:
        """Where the last cycle ends [s]."""
        return float(self.time[-1]) + 0.5 / self.reference_frequency

    @property
    def amplitude_range(self) -> tuple[float, float]:
        """Smallest and largest amplitude of a cycle; none below zero, as noise makes it."""
        return max(float(self.amplitude.min()), 0.0), float(self.amplitude.max())

    @property
    def settled_amplitude(self) -> float:
        """Mean amplitude of the last fifth."""
        return float(self.amplitude[-max(5, self.amplitude.size // 5) :].mean())

    def also_without(self, released: Sequence[OtherMode] = (), lasting: Sequence[LastingMode] = ()) -> "Cycles":
        """These cycles, of a record that these modes were taken out of, too."""
        return replace(self, released=(*self.released, *released), lasting=(*self.lasting, *lasting))

    def part(self, keep: slice) -> "Cycles":
        """These cycles alone."""
        names = ("time", "amplitude", "standard_error", "phase", "frequency", "frequency_error")
        return replace(self, **{name: getattr(self, name)[keep] for name in names})
