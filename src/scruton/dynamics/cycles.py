"""The cycles of several records, end to end: what every filter reads."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.thresholds import MISSING_CYCLE
from scruton.envelope.types import Cycles

ABSENT = 1e6  # standard error of a third harmonic that cannot be told


@dataclass(frozen=True, eq=False)
class EnvelopeData:
    """The envelopes of several records, end to end, as the filter reads them.

    Attributes
    ----------
    amplitude, standard_error : (N,) arrays
        One value per cycle, in A/D or rad.
    gap : (N,) array
        Time between the end of the cycle before and the start of this one [s], 0 for adjacent cycles,
        negative at the first cycle of a record.
    period : (N,) array
        Duration of the cycle that the amplitude is the mean of [s].
    time : (N,) array
        Middle of each cycle [s].
    record : (N,) array of str
        Name of the record that the cycle belongs to.
    """

    amplitude: FloatArray
    standard_error: FloatArray
    gap: FloatArray
    period: FloatArray
    time: FloatArray
    record: np.ndarray

    @staticmethod
    def join(cycles: dict[str, Cycles]) -> "EnvelopeData":
        """Put the envelopes of several records end to end; keys are the records' names."""
        parts = {name: record for name, record in cycles.items() if record.time.size}
        if not parts:
            empty = np.empty(0)
            return EnvelopeData(empty, empty, empty, empty, empty, np.empty(0, dtype=str))
        return EnvelopeData(
            amplitude=np.concatenate([part.amplitude for part in parts.values()]),
            standard_error=np.concatenate([part.standard_error for part in parts.values()]),
            gap=np.concatenate([gaps(part) for part in parts.values()]),
            period=np.concatenate([np.full(part.time.size, 1.0 / part.reference_frequency) for part in parts.values()]),
            time=np.concatenate([part.time for part in parts.values()]),
            record=np.concatenate([np.full(part.time.size, name) for name, part in parts.items()]),
        )

    def without(self, record: str) -> Self:
        """Leave one record out."""
        return self.keep(self.record != record)

    def keep(self, cycles: np.ndarray) -> Self:
        """Only the cycles of a mask, (N,) of bool."""
        return replace(self, **{name: value[cycles] for name, value in vars(self).items()})

    @property
    def size(self) -> int:
        """Number of cycles."""
        return int(self.amplitude.size)


@dataclass(frozen=True, eq=False)
class Channels(EnvelopeData):
    """The cycles of all records, by number and from 0 s each, with the other channels that diagnosis reads, end to end.

    Phase [rad] and omega [rad/s] are those of the demodulation; `third` is the in-phase third harmonic of the reading
    (A/D or rad), `place` the time in the record from -1/2 to 1/2, `knots` (HATS,) the ln(amplitude) of the generic
    discrepancy.  An envelope has no phase.
    """

    phase: FloatArray
    third: FloatArray
    third_error: FloatArray
    place: FloatArray
    omega: FloatArray
    has_phase: np.ndarray
    knots: FloatArray

    def keep(self, cycles: np.ndarray) -> Self:
        """Only the cycles of a mask, (N,) of bool."""
        return replace(self, **{name: value[cycles] for name, value in vars(self).items() if name != "knots"})


def gaps(cycles: Cycles) -> FloatArray:
    """Time before each cycle of one record that no cycle covers [s], negative at the first, (N,)."""
    period = 1.0 / cycles.reference_frequency
    steps = np.diff(cycles.time) - period
    return np.asarray(np.r_[-1.0, np.where(steps > MISSING_CYCLE * period, steps, 0.0)])
