"""The tables of a document as an Excel file: a sheet each, numbers as numbers, units in the heading."""

import io
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.report.document import Document, Table
from scruton.report.office import plain, same_bytes

if TYPE_CHECKING:
    import pandas as pd

_RANGE = re.compile(r"(.+?) (?:to|\.\.) (.+)")
_NUMBER = re.compile(r"([+\-−]?\d[\d,]*(?:\.\d+)?|[+\-−]?\.\d+)(?: × 10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))?( ?%)?")
_WITH_UNIT = re.compile(r"([+\-−]?[\d.,]*\d) (°|[a-zA-Zµ][\w/²³·*^]{0,9})")
_LOWERED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
_MISSING = ("–", "-", "")
_LONGEST, _WIDEST = 31, 60  # letters of a sheet's name; of a column


class Share(float):
    """A number that is read in per cent."""


Cell = str | float | int | bool | None


def render_xlsx(document: Document, frames: "Mapping[str, pd.DataFrame]") -> bytes:
    """Render the tables of a numbered document: all digits where a frame has them; the same one gives the same bytes.

    ImportError where openpyxl is not installed; `scruton.report.office.check_office` says so beforehand.
    """
    from openpyxl import Workbook
    from openpyxl.styles import Font

    book = Workbook()
    front = book.active
    front.title = "Contents"
    for line in ([document.title], [document.about], *document.title_block, [], ["Sheet", "Table", "What it holds"]):
        front.append([plain(text) for text in line])
    bold = Font(bold=True)
    front["A1"].font = Font(bold=True, size=14)
    for cell in front[front.max_row]:
        cell.font = bold
    used = {"contents"}
    shown = [(table.name, table.number, table.caption, _contents(table, frames)) for table in document.every(Table)]
    seen = {table.data for table in document.every(Table)}
    shown += [
        (name, "", name.replace("_", " "), _of_frame(frame)) for name, frame in frames.items() if name not in seen
    ]
    for name, number, caption, rows in shown:
        title = _title(name, used)
        front.append([title, int(number) if number.isdigit() else plain(number), plain(caption)])
        front.cell(front.max_row, 1).hyperlink = f"#'{title}'!A1"
        sheet = book.create_sheet(title)
        for i, values in enumerate(rows, start=1):
            for j, value in enumerate(values, start=1):
                _fill(sheet.cell(i, j), value)
        for cell in sheet[1]:
            cell.font = bold
        sheet.freeze_panes = "A2"
        _fit(sheet)
    _fit(front)
    stream = io.BytesIO()
    book.save(stream)
    return same_bytes(stream.getvalue())


def _title(name: str, used: set[str]) -> str:
    """A name of a sheet that no other has."""
    short = re.sub(r"[\[\]:*?/\\']", "-", name)[:_LONGEST] or "table"
    title, count = short, 1
    while title.casefold() in used:
        count += 1
        title = f"{short[: _LONGEST - len(str(count)) - 1]}-{count}"
    used.add(title.casefold())
    return title


def _contents(table: Table, frames: "Mapping[str, pd.DataFrame]") -> list[list[Cell]]:
    """Heading and rows of a table: of its frame, or as shown, ranges in two columns."""
    if table.data in frames:
        return _of_frame(frames[table.data])
    head: list[Cell] = []
    columns: list[list[Cell]] = []
    for i, name in enumerate(table.header):
        texts = [row[i] for row in table.rows]
        ranges = [_RANGE.fullmatch(text) for text in texts]
        if all(text in _MISSING or (match and _both(match)) for text, match in zip(texts, ranges, strict=True)) and any(
            ranges
        ):
            head += [f"{name}, lower", f"{name}, upper"]
            columns += [[match and read(match[k]) for match in ranges] for k in (1, 2)]
        else:
            unit, texts = _unit(texts)
            head.append(f"{name} [{unit}]" if unit else name)
            columns.append([read(text) for text in texts])
    return [head, *(list(row) for row in zip(*columns, strict=True))]


def _unit(texts: list[str]) -> tuple[str, list[str]]:
    """The unit behind every number of a column, and its cells without it; empty where there is none, or another."""
    matches = [_WITH_UNIT.fullmatch(text) for text in texts]
    units = {match[2] for match in matches if match}
    numbers = sum(isinstance(read(text), float | int) for text in texts)
    if len(units) != 1 or numbers:
        return "", texts
    return units.pop(), [match[1] if match else text for match, text in zip(matches, texts, strict=True)]


def _both(match: re.Match[str]) -> bool:
    return all(not isinstance(read(match[k]), str) or match[k] in ("∞", "−∞") for k in (1, 2))


def _of_frame(frame: "pd.DataFrame") -> list[list[Cell]]:
    rows: list[list[Cell]] = [[str(name) for name in frame.columns]]
    for line in frame.itertuples(index=False):
        rows.append([value.item() if isinstance(value, np.generic) else value for value in line])
    return rows


def read(text: str) -> Cell:
    """A number as a table shows it, "−0.01", "3 × 10⁻⁷", "12 %"; the text itself where it is none."""
    if text in _MISSING:
        return None
    match = _NUMBER.fullmatch(text)
    if match is None:
        return plain(text)
    value = float(match[1].replace(",", "").replace("−", "-"))
    value *= 10.0 ** int(match[2].translate(_LOWERED)) if match[2] else 1.0
    if match[3]:
        return Share(float(f"{value / 100.0:.12g}"))
    return int(value) if value.is_integer() and "." not in match[1] and not match[2] else value


def _fill(cell: Any, value: Cell) -> None:
    """Write a value; a text stays one, whatever it begins with."""
    if isinstance(value, float) and not np.isfinite(value):
        value = None if np.isnan(value) else ("∞" if value > 0.0 else "−∞")
    if isinstance(value, str):
        cell.value = plain(value)
        cell.data_type = "s"
    else:
        cell.value = value
        if isinstance(value, Share):
            cell.value, cell.number_format = float(value), "0.0###%"


def _fit(sheet: Any) -> None:
    """Make columns as wide as what they hold."""
    from openpyxl.utils import get_column_letter

    for i, column in enumerate(sheet.iter_cols(values_only=True), start=1):
        letters = max((len(f"{value:.6g}" if isinstance(value, float) else str(value)) for value in column
                       if value is not None), default=4)  # fmt: skip
        sheet.column_dimensions[get_column_letter(i)].width = min(letters + 2, _WIDEST)
