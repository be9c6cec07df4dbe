"""Paths into nested data: "DATA[7].y", "run.sub[2].y", "data[:,1]"; indices count from 0."""

import re
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from scruton.errors import InputError

_PART = re.compile(r"\s*\.?\s*(?:(?P<name>[^.\[\]]+)|\[(?P<index>[^\[\]]*)\])\s*")
_SLOT = re.compile(r"\s*(?::|\d+)\s*")

Index = tuple[int | slice, ...]


def parse_path(text: str, path: Path) -> tuple[str, tuple[str | Index, ...]]:
    """Split a path into a name, and names of fields and indices in the order in which they apply.

    Raises
    ------
    InputError
        If it is malformed.
    """
    wanted = 'a path such as "y", "DATA[7].y" or "data[:,1]" (counted from 0)'
    steps: list[str | Index] = []
    position = 0
    while position < len(text):
        match = _PART.match(text, position)
        if match is None or (not steps and match["name"] is None):
            raise InputError(path, text, "a path that cannot be followed", wanted)
        steps.append(match["name"].strip() if match["name"] is not None else _index(match["index"], text, path))
        position = match.end()
    if not steps or not isinstance(steps[0], str):
        raise InputError(path, text, "an empty path", wanted)
    return steps[0], tuple(steps[1:])


def _index(text: str, whole: str, path: Path) -> Index:
    slots = text.split(",")
    if not all(_SLOT.fullmatch(slot) for slot in slots):
        raise InputError(path, whole, f"the index [{text}]", "whole numbers counted from 0, or a colon: [7], [:,1]")
    return tuple(slice(None) if slot.strip() == ":" else int(slot) for slot in slots)


def element(array: NDArray[Any], index: Index, path: Path, text: str) -> Any:
    """Apply one index; a single number counts through an array of any shape, column by column as MATLAB does.

    Raises
    ------
    InputError
        If the index lies outside.
    """
    try:
        if len(index) == 1:
            return array.reshape(-1, order="F")[index[0]]
        return array[index]
    except IndexError:
        size = array.size if len(index) == 1 else " x ".join(str(n) for n in array.shape)
        raise InputError(path, text, f"an index outside the array of {size}", "an index counted from 0") from None
