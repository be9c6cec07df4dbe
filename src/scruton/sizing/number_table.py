"""CSV tables of numbers beside a bridge.toml: a rose, a mode shape, a supplier's dampers."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.bounded import read_bytes
from scruton.campaign.spelling import show
from scruton.campaign.thresholds import LARGEST_TABLE
from scruton.campaign.units import Dimension, is_unit, unit_factor
from scruton.errors import InputError

_BRACKETS = re.compile(r"\[\s*([^\]]*?)\s*\]|\(\s*([^)]*?)\s*\)")
_WORDS = re.compile(r"[\s;:]+")


def read_table(path: Path, wanted: str, dimensions: Sequence[Dimension] = ()) -> FloatArray:
    """Read the numbers below the header line of a CSV file, (rows, columns).

    Parameters
    ----------
    path : Path
    wanted : str
        What the file should hold, for the errors.
    dimensions : sequence of Dimension
        Of the columns, which are in SI unless their headings state another unit in brackets; of further ones none.

    Raises
    ------
    InputError
        A file that is not there or holds something else, or begins with numbers: they would be taken for the header.
    """
    try:
        text = read_bytes(path, LARGEST_TABLE, wanted).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(path, "", f"bytes that are not UTF-8 (at byte {error.start})", f"{wanted}, in UTF-8") from None
    lines = [(number, line.split(",")) for number, line in enumerate(text.splitlines(), 1) if line.strip()]
    lines = [row for k, row in enumerate(lines) if k == 0 or not row[1][0].lstrip().startswith("#")]
    if len(lines) < 2:
        raise InputError(path, "", f"{len(lines) or 'no'} line{'s' if not lines else ''}", wanted)
    (first, header), *below = lines
    if _number(header[0]) is not None:
        raise InputError(path, f"line {first}", f"numbers ({show(','.join(header))})", wanted)
    rows = []
    for number, cells in below:
        row = [_number(cell) for cell in cells]
        for k, (cell, value) in enumerate(zip(cells, row, strict=True), 1):
            if value is None:
                commas = "; commas between the columns, and points in the numbers" if ";" in cell else ""
                raise InputError(path, f"line {number}, column {k}", show(cell.strip()), f"a number; {wanted}{commas}")
        if len(row) != len(below[0][1]):
            found = f"{len(row)} numbers, where the line before has {len(below[0][1])}"
            raise InputError(path, f"line {number}", found, wanted)
        rows.append(row)
    return np.array(rows, dtype=float) * _factors(path, header, len(rows[0]), dimensions)


def _number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None


def _factors(path: Path, header: Sequence[str], columns: int, dimensions: Sequence[Dimension]) -> FloatArray:
    """Factors to SI of the columns, by the units that their headings state."""
    factors = np.ones(columns)
    for k, (heading, dimension) in enumerate(zip(header[:columns], dimensions, strict=False)):
        units = [
            square or word for square, word in _BRACKETS.findall(heading) if square or not _remark(word, dimension)
        ]
        try:
            if len(units) > 1:
                raise ValueError("more than one unit")
            factors[k] = _factor(units[0] if units else "", dimension)
        except ValueError as error:
            wanted = f"the unit of {dimension.name}, such as [{dimension.unit or '-'}]"
            raise InputError(path, f"header, column {k + 1}", f"{show(heading.strip())} ({error})", wanted) from None
    return factors


def _factor(unit: str, dimension: Dimension) -> float:
    """Factor to SI of a unit as a heading has it; ValueError for one of another dimension, or that is not known."""
    if unit in ("", "-", dimension.unit):
        return 1.0
    return 0.01 if unit == "%" and not dimension.unit else unit_factor(unit, dimension)


def _remark(inside: str, dimension: Dimension) -> bool:
    """Whether round brackets hold a remark: several words that are no unit together, none of them one of the column.

    A number among them makes them no unit: "10 min".
    """
    words = _WORDS.split(inside)
    if len(words) < 2:
        return not inside
    named = [word for word in words if _number(word) is None]
    together = len(named) == len(words) and is_unit(inside)
    return not together and not any(_states(word, dimension) for word in named)


def _states(unit: str, dimension: Dimension) -> bool:
    """Whether a text is a unit of the dimension."""
    try:
        _factor(unit, dimension)
    except ValueError:
        return False
    return True
