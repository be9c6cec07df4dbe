"""What every reader hands back, columns of numbers with name and unit, and what readers of binary files share."""

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scruton.arrays import FloatArray
from scruton.campaign.thresholds import LARGEST_ARRAY, PACKED, SLACK, SMALL_ARRAY, TIGHTEST
from scruton.errors import InputError

_PART = re.compile(r"\s*\.?\s*(?:(?P<name>[^.\[\]]+)|\[(?P<index>[^\[\]]*)\])\s*")
_SLOT = re.compile(r"\s*(?::|\d+)\s*")
Index = tuple[int | slice, ...]

RESAVE_OBJECT = (
    "numbers: in MATLAB put the columns into a struct or arrays (t = T.time; y = T.y) and save those, "
    "or write a CSV with writetable"
)


@contextmanager
def optional(package: str, extra: str, path: Path, what: str) -> Iterator[None]:
    """Import a package that is an optional extra; InputError that says how to get it where it is not installed."""
    try:
        yield
    except ImportError:
        found = f"{what}, and no package that reads it"
        raise InputError(path, "", found, f"{package}: pip install 'scruton[{extra}]'") from None


class Clock(NamedTuple):
    """An even time axis that a channel carries with it: `start` and `step`, in seconds."""

    start: float
    step: float


@dataclass(frozen=True, eq=False)
class Column:
    """One column of a file: name, (N,) values and unit as the file has them, and the time axis that it ties to it."""

    name: str
    values: FloatArray
    unit: str | None = None
    where: Callable[[int], str] = "sample {} (the first is 0)".format  # the place of a sample in the file, in words
    clock: Clock | None = None


@dataclass(frozen=True, eq=False)
class Container:
    """An open file that gives columns by name."""

    path: Path
    names: tuple[str, ...]  # of the columns that stand at the top of the file, without units

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
        """Flatten a vector of any real type, (N,), (1, N) or (N, 1), to float64 (InputError for anything else)."""
        array = np.asarray(array)
        if array.dtype.kind not in "biuf":
            kind = {"c": "complex numbers", "U": "text", "S": "text", "O": "cells or objects"}.get(array.dtype.kind)
            raise self.error(name, kind or f"data of type {array.dtype}", "real numbers, one column")
        if array.size != max(array.shape, default=1):
            shape = " x ".join(str(n) for n in array.shape)
            raise self.error(name, f"a matrix, {shape}", f'one column, such as "{name}[:,1]" (counted from 0)')
        return array.reshape(-1).astype(np.float64)


def check_claim(claimed: int, stored: int, path: Path, name: str) -> None:
    """Refuse, before memory is taken, an array whose stored bytes cannot hold the bytes that it claims to be."""
    if claimed > allowance(stored):
        found = f"{claimed:,} bytes of data in {stored:,} of the file"
        raise InputError(path, name, found, "a file that holds all of its samples")


def allowance(stored: int) -> int:
    """Bytes that so many stored bytes may unpack to."""
    return min(LARGEST_ARRAY, TIGHTEST * stored + SLACK, max(SMALL_ARRAY, PACKED * stored))


def parse_path(text: str, path: Path) -> tuple[str, tuple[str | Index, ...]]:
    """Split a path into a name, and names of fields and indices in the order in which they apply (InputError)."""
    wanted = 'a path such as "y", "DATA[7].y" or "data[:,1]" (counted from 0)'
    steps: list[str | Index] = []
    position = 0
    while position < len(text):
        match = _PART.match(text, position)
        if match is None or (not steps and match["name"] is None):
            raise InputError(path, text, "a path that cannot be followed", wanted)
        position = match.end()
        if match["name"] is not None:
            steps.append(match["name"].strip())
            continue
        slots = match["index"].split(",")
        if not all(_SLOT.fullmatch(slot) for slot in slots):
            found = f"the index [{match['index']}]"
            raise InputError(path, text, found, "whole numbers counted from 0, or a colon: [7], [:,1]")
        steps.append(tuple(slice(None) if slot.strip() == ":" else int(slot) for slot in slots))
    if not steps or not isinstance(steps[0], str):
        raise InputError(path, text, "an empty path", wanted)
    return steps[0], tuple(steps[1:])


def element(array: NDArray[Any], index: Index, path: Path, text: str) -> Any:
    """Apply one index; a single number counts through an array of any shape, column by column as MATLAB does.

    Of a matrix of numbers it would be one of them, where a row or a column was meant.
    """
    if len(index) == 1 and array.ndim == 2 and min(array.shape) > 1 and array.dtype.kind in "biufc":
        (slot,), shape = index, " x ".join(str(n) for n in array.shape)
        number = ":" if isinstance(slot, slice) else slot
        row, column = (text.replace(f"[{number}]", f"[{way}]") for way in (f"{number},:", f":,{number}"))
        better, other = (row, column) if array.shape[0] < array.shape[1] else (column, row)
        raise InputError(path, text, f"one index into a matrix, {shape}", f'"{better}" (or "{other}"), counted from 0')
    try:
        if len(index) == 1:
            return array.reshape(-1, order="F")[index[0]]
        return array[index]
    except IndexError:
        size = array.size if len(index) == 1 else " x ".join(str(n) for n in array.shape)
        raise InputError(path, text, f"an index outside the array of {size}", "an index counted from 0") from None
