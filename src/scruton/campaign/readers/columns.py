"""What every reader hands back, columns of numbers with name and unit, and what readers of binary files share."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scruton.arrays import FloatArray
from scruton.campaign.thresholds import LARGEST_ARRAY, PACKED, SLACK, SMALL_ARRAY, TIGHTEST
from scruton.errors import InputError

RESAVE_OBJECT = (
    "numbers: in MATLAB put the columns into a struct or arrays (t = T.time; y = T.y) and save those, "
    "or write a CSV with writetable"
)


def sample(index: int) -> str:
    """Say where sample `index` stands in a file that has no lines."""
    return f"sample {index} (the first is 0)"


@dataclass(frozen=True, eq=False)
class Clock:
    """An even time axis that a channel carries with it: `start` and `step`, in seconds."""

    start: float
    step: float


@dataclass(frozen=True, eq=False)
class Column:
    """One column of a file.

    Attributes
    ----------
    name : str
        As the file spells it.
    values : (N,) array
        As the file holds them.
    unit : str or None
        As the file states it.
    where : callable
        From the index of a sample to its place in the file, in words.
    clock : Clock or None
        The time axis, where the file ties one to the column.
    """

    name: str
    values: FloatArray
    unit: str | None = None
    where: Callable[[int], str] = sample
    clock: Clock | None = None


@dataclass(frozen=True, eq=False)
class Container:
    """An open file that gives columns by name.

    Attributes
    ----------
    path : Path
    names : tuple of str
        Of the columns that stand at the top of the file, without units.
    """

    path: Path
    names: tuple[str, ...]

    def read(self, names: Sequence[str | int]) -> tuple[Column, ...]:
        """Read columns (InputError for a name that is not there)."""
        return tuple(self.column(str(name)) for name in names)

    def column(self, name: str) -> Column:
        """Read one column."""
        raise NotImplementedError

    def error(self, name: str, found: str, wanted: str) -> InputError:
        """Build an error about the column `name`."""
        return InputError(self.path, name, found, wanted)

    def vector(self, name: str, array: NDArray[Any]) -> FloatArray:
        """Flatten a vector of any real type, (N,), (1, N) or (N, 1), to float64.

        Raises
        ------
        InputError
            Not numbers, complex numbers, or a matrix.
        """
        array = np.asarray(array)
        if array.dtype.kind not in "biuf":
            kind = {"c": "complex numbers", "U": "text", "S": "text", "O": "cells or objects"}.get(array.dtype.kind)
            raise self.error(name, kind or f"data of type {array.dtype}", "real numbers, one column")
        if array.size != max(array.shape, default=1):
            shape = " x ".join(str(n) for n in array.shape)
            raise self.error(name, f"a matrix, {shape}", f'one column, such as "{name}[:,1]" (counted from 0)')
        return array.reshape(-1).astype(np.float64)


def check_claim(claimed: int, stored: int, path: Path, name: str) -> None:
    """Refuse, before memory is taken, what unpacks to more than so many stored bytes can hold.

    Parameters
    ----------
    claimed, stored : int
        Bytes once read, and bytes in the file.
    path : Path
    name : str
        Of the array.

    Raises
    ------
    InputError
        A claim beyond `allowance`.
    """
    if claimed > allowance(stored):
        found = f"{claimed:,} bytes of data in {stored:,} of the file"
        raise InputError(path, name, found, "a file that holds all of its samples")


def allowance(stored: int) -> int:
    """Bytes that so many stored bytes may unpack to."""
    return min(LARGEST_ARRAY, TIGHTEST * stored + SLACK, max(SMALL_ARRAY, PACKED * stored))
