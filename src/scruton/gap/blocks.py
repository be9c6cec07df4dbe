"""Which of all cycles, channels and coordinates belong to one record."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from scruton.arrays import FloatArray

PHASE = 1  # of the channels amplitude, phase and third harmonic


def by_channel(values: FloatArray) -> FloatArray:
    """Values (..., 3 N) by channel and cycle, (..., 3, N): a view of them."""
    return values.reshape(*values.shape[:-1], 3, -1)


@dataclass(frozen=True, eq=False)
class Block:
    """One record: its cycles in every channel, the parameters that it takes, and the coordinates of these."""

    cycles: slice
    rows: np.ndarray
    where: np.ndarray

    @cached_property
    def square(self) -> tuple[np.ndarray, ...]:
        """Its coordinates with each other."""
        return np.ix_(self.where, self.where)

    def of(self, values: FloatArray) -> FloatArray:
        """What belongs to the record of values (..., 3 N), all channels end to end."""
        return np.asarray(by_channel(values)[..., self.cycles].reshape(*values.shape[:-1], -1))


def blocks(places: np.ndarray, record: np.ndarray) -> tuple[Block, ...]:
    """Every record's, of coordinates (P, R) that it takes each parameter from, -1 for none, and the cycles' records."""
    ends = np.searchsorted(record, np.arange(places.shape[1] + 1))
    found = []
    for coordinates, low, high in zip(places.T, ends[:-1], ends[1:], strict=True):
        rows = np.flatnonzero(coordinates >= 0)
        found.append(Block(slice(int(low), int(high)), rows, coordinates[rows]))
    return tuple(found)
