"""What every reader hands back: columns of numbers, each with its name, unit and a way to say where a sample stands."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from scruton.arrays import FloatArray
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


class Container(Protocol):
    """An open file that gives columns by name."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns that stand at the top of the file, without units."""

    def read(self, names: Sequence[str | int]) -> tuple[Column, ...]:
        """Read columns (InputError for a name that is not there)."""


def as_column(array: NDArray[Any], path: Path, name: str) -> FloatArray:
    """Flatten a vector of any real type, (N,), (1, N) or (N, 1), to float64.

    Raises
    ------
    InputError
        Not numbers, complex numbers, or a matrix.
    """
    array = np.asarray(array)
    if array.dtype.kind not in "biuf":
        kind = {"c": "complex numbers", "U": "text", "S": "text", "O": "cells or objects"}.get(array.dtype.kind)
        raise InputError(path, name, kind or f"data of type {array.dtype}", "real numbers, one column")
    if array.size != max(array.shape, default=1):
        shape = " x ".join(str(n) for n in array.shape)
        raise InputError(path, name, f"a matrix, {shape}", f'one column, such as "{name}[:,1]" (counted from 0)')
    return array.reshape(-1).astype(np.float64)


@contextmanager
def readable(path: Path, wanted: str) -> Iterator[None]:
    """Turn whatever a library raises on a damaged file, which may be anything, into an InputError."""
    try:
        yield
    except InputError:
        raise
    except MemoryError:
        raise InputError(path, "", "a file that takes more memory than there is", wanted) from None
    except Exception as error:
        reason = str(error).strip().splitlines()
        what = f"a file that cannot be read ({reason[0][:200] if reason else type(error).__name__})"
        raise InputError(path, "", what, wanted) from None
