"""What stands in a file of records: its layout and its channels, as a record's table would name them."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.bounded import begins_as_utf16
from scruton.campaign.files import Files
from scruton.campaign.readers import READERS, Container, CsvDialect, is_delimited
from scruton.campaign.readers.delimited import split_line, uncommented
from scruton.errors import InputError

_RUN = 5  # lines of numbers in a row are data
_HEAD = 400  # lines among which the numbers begin
# A unit at the end of a name: "heave_mm", "t_ms".
_SUFFIX = re.compile(r"(?<=[a-z0-9])[_ ](ms|s|sec|mm|cm|m|um|µm|deg|rad|g|mps2)$", re.IGNORECASE)
# A line between names and numbers that holds one of these holds units: names such as t and y are units, too.
_UNITS = {"s", "sec", "ms", "m", "mm", "cm", "um", "µm", "μm", "deg", "°", "rad", "mrad", "g", "m/s2", "m/s^2", "m/s²"}
_UNITLESS = ("", "-", "1")
_NARROW = 16  # rows or columns: a matrix of more is no set of channels
_DIALECTS = (("\t", "."), ("\t", ","), (";", "."), (";", ","), (",", "."), (" ", "."), (" ", ","))


@dataclass(frozen=True, eq=False)
class Channel:
    """One column of a file: `key` as the record's table names it, and what the file says of it."""

    key: str | int
    name: str
    values: FloatArray
    unit: str | None = None
    clock: tuple[float, float] | None = None  # start and step [s]
    told: bool = False  # whether the reader finds the unit by itself

    @property
    def group(self) -> str:
        """The struct that it is a field of: "DATA[3]" of "DATA[3].y"; empty where it is none."""
        return str(self.key).rpartition(".")[0]


@dataclass(frozen=True, eq=False)
class Source:
    """A file, the keys of its layout that differ from the usual, and its channels."""

    path: Path
    layout: dict[str, Any] = field(default_factory=dict)
    channels: tuple[Channel, ...] = ()


def is_record(path: Path) -> bool:
    """Whether a file may hold records, by its ending."""
    return is_delimited(path) or path.suffix.lower() in READERS


def look(path: Path, files: Files) -> Source:
    """Open a file in the layout that it shows (InputError where nothing in it can be read)."""
    layout, headings = _layout(files.read(path), path) if is_delimited(path) else ({}, [])
    container = files.open(path, CsvDialect(**layout))
    keys: list[str | int] = list(container.names)
    if is_delimited(path):
        if not keys or len(set(keys)) < len(keys) or "" in keys:
            keys = list(range(getattr(container, "width", 0)))
    else:
        keys = list(_paths(container))
    found = [channel for key in keys if (channel := _channel(container, key)) is not None]
    if headings:
        found = [replace(one, name=headings[i][0], unit=headings[i][1]) for i, one in enumerate(found)]
    return Source(path, layout, tuple(found))


def _channel(container: Container, key: str | int) -> Channel | None:
    try:
        (column,) = container.read([key])
    except InputError:
        return None
    clock = None if column.clock is None else (column.clock.start, column.clock.step)
    leaf = column.name if isinstance(key, int) else re.split(r"[./]", str(key))[-1]
    name = re.sub(r"\[.*?\]|\(.*?\)", "", leaf).strip() or str(key)
    behind = _SUFFIX.search(name) if column.unit is None else None
    unit = behind[1].replace("sec", "s").replace("mps2", "m/s^2") if behind else column.unit
    return Channel(key, name[: behind.start()] if behind else name, column.values, unit, clock, column.unit is not None)


def _layout(data: bytes, path: Path) -> tuple[dict[str, Any], list[tuple[str, str | None]]]:
    """Find the encoding, the delimiter, the decimal sign and the line of the header.

    Where the line above the numbers holds nothing but units, the names of the line above and the units are given back,
    too: a reader knows no such header, so columns go by position.
    """
    encoding, text = _decoded(data)
    lines = re.split(r"\r\n|\r|\n", text)[:_HEAD]
    best: tuple[int, int, str, str] | None = None
    for delimiter, decimal in _DIALECTS:
        widths = [_numbers(line, delimiter, decimal) for line in lines]
        for start in range(len(widths) - _RUN + 1):
            run = widths[start : start + _RUN]
            if run[0] and len(set(run)) == 1:
                if best is None or run[0] > best[0] or (run[0] == best[0] and start < best[1]):
                    best = (run[0], start, delimiter, decimal)
                break
    if best is None:
        raise InputError(path, "", "no lines of numbers", "text with one line of numbers a sample")
    width, start, delimiter, decimal = best
    above = [i for i in range(start) if lines[i].strip()]
    fits = [i for i in above[-2:] if len(_cells(lines[i], delimiter)) in (width, width + 1)]  # a column of comments
    header = fits[-1] if fits and fits[-1] == above[-1] else start
    headings: list[tuple[str, str | None]] = []
    if len(fits) == 2 and (of_line := _units(_cells(lines[fits[1]], delimiter))):
        names = [cell.strip().strip('"') for cell in _cells(lines[fits[0]], delimiter)]
        headings, header = list(zip(names, of_line, strict=False)), start
    found: dict[str, Any] = {"encoding": encoding} if encoding != "utf-8" else {}
    found |= {"skip_rows": header} if any(lines[i].strip() for i in range(header)) else {}
    found |= {"decimal": ","} if decimal == "," else {}
    usual = ";" if decimal == "," else ","
    return found | ({"delimiter": delimiter} if delimiter != usual and width > 1 else {}), headings


def _units(cells: list[str]) -> list[str | None]:
    """Units that a line holds, None for a column without one; empty where it does not look like a line of units."""
    found: list[str | None] = []
    for cell in cells:
        text = cell.strip().strip('"').strip("[]()").strip()
        found.append(None if text in _UNITLESS else text)
    return found if _UNITS.intersection(filter(None, found)) and max(map(len, filter(None, found))) < 10 else []


def _decoded(data: bytes) -> tuple[str, str]:
    if begins_as_utf16(data):
        return "utf-16", data.decode("utf-16", errors="replace")
    try:
        return "utf-8", data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return "latin-1", data.decode("latin-1")


def _cells(line: str, delimiter: str) -> list[str]:
    cells = split_line(uncommented(line), CsvDialect(delimiter=delimiter))
    while cells and not cells[-1].strip():
        cells.pop()
    return cells


def _numbers(line: str, delimiter: str, decimal: str) -> int:
    """Number of cells of a line of numbers; 0 of any other."""
    cells = _cells(line, delimiter)
    for cell in cells:
        if decimal == "," and "." in cell:
            return 0
        try:
            float(cell.replace(decimal, "."))
        except ValueError:
            return 0
    return len(cells)


def _paths(container: Container) -> Iterator[str]:
    """Paths of what may be a column in a binary file, in the order of the file."""
    stores = (getattr(container, name, None) for name in ("variables", "arrays", "file"))
    store: Any = next((one for one in stores if one is not None), None)
    for name in container.names:
        if store is None:  # TDMS: channels by name
            yield name
        else:
            yield from _below(name, store[name])


def _below(path: str, value: Any) -> Iterator[str]:
    names = getattr(getattr(value, "dtype", None), "names", None)
    if names:  # a struct, or a struct array, of MATLAB 5
        for i, one in enumerate(np.asarray(value).reshape(-1, order="F")):
            for name in names:
                yield from _below(f"{path}[{i}].{name}" if value.size > 1 else f"{path}.{name}", one[name])
    elif hasattr(value, "keys"):  # a group of HDF5, a struct array where its fields hold references
        for name in value:
            member = value[name]
            if getattr(getattr(member, "dtype", None), "kind", "") == "O":
                yield from (f"{path}[{i}].{name}" for i in range(member.size))
            else:
                yield from _below(f"{path}.{name}", member)
    elif len(shape := tuple(getattr(value, "shape", ()))) == 2 and 1 < min(shape) <= _NARROW:
        if "MATLAB_class" in getattr(value, "attrs", ()):
            shape = shape[::-1]
        rows = shape[0] < shape[-1]
        yield from (f"{path}[{i},:]" if rows else f"{path}[:,{i}]" for i in range(min(shape)))
    else:
        yield path
