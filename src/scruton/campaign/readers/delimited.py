"""Reader of delimited text (.csv, .txt, .dat) in the dialects that laboratories write."""

import codecs
import csv
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.bounded import begins_as_utf16
from scruton.campaign.readers.columns import Column, Container
from scruton.campaign.spelling import folded, nearest
from scruton.campaign.thresholds import LONGEST_HEADING, LONGEST_LINE, MOST_COLUMNS
from scruton.errors import InputError

# "displacement [mm]" or "displacement (mm)": a name, then a unit at the end.
_HEADING = re.compile(r"^(?P<name>.*?)\s*(?:\[(?P<unit>[^\[\]]*)\]|\((?P<unit2>[^()]*)\))\s*$")
_COMMENT = re.compile(r"^ *[#%][#% ]*")
_LINE_END = re.compile(r"\r\n|\r|\n")
_WHITESPACE_SPLIT = re.compile(r"\s++(?![\[(])")  # keeps "time [s]" together


@dataclass(frozen=True)
class CsvDialect:
    """How a text file is laid out."""

    skip_rows: int = 0  # lines before the header
    delimiter: str = ""  # a space stands for any run of white space; empty: a comma, or a semicolon beside decimal ones
    decimal: str = "."
    encoding: str = "utf-8"  # a byte-order mark is always understood

    @property
    def separator(self) -> str:
        """The delimiter in force."""
        return self.delimiter or (";" if self.decimal == "," else ",")


class Heading(NamedTuple):
    """Name and unit of one column; `text` is both, as the file spells them."""

    text: str
    name: str
    unit: str | None


@dataclass(frozen=True, eq=False)
class Delimited(Container):
    """A text file whose header has been read; columns go by name, by full heading, or by position from 0."""

    text: str  # what follows the header
    first_line: int  # the number of its first line in the file, from 1
    dialect: CsvDialect
    headings: tuple[Heading, ...]  # empty where the file has no header line
    width: int
    parsed: dict[int, FloatArray] = field(default_factory=dict)  # columns by position, once they were read

    def read(self, names: Sequence[str | int]) -> tuple[Column, ...]:
        """Read columns in one pass."""
        positions = [self._position(name) for name in names]
        self._parse(sorted(set(positions) - set(self.parsed)))
        plain = [Heading(f"column {position}", "", None) for position in range(self.width)]
        heads = self.headings or plain
        return tuple(Column(heads[i].text, self.parsed[i], heads[i].unit, self._where) for i in positions)

    def _position(self, name: str | int) -> int:
        if isinstance(name, int):
            if not 0 <= name < self.width:
                raise self.error(f"column {name}", f"{self.width} columns", "a position counted from 0")
            return name
        column, headings = f'column "{name}"', self.headings
        if not headings:
            wanted = 'a header line such as "time [s],displacement [m]", or columns by position: '
            wanted += "columns = { time = 0, displacement = 1 }"
            raise self.error(column, "no header line: the first line holds numbers", wanted)
        exact = [i for i, heading in enumerate(headings) if name in heading[:2]]
        alike = exact or [i for i, heading in enumerate(headings) if folded(name) in map(folded, heading[:2])]
        if not alike:
            wanted = nearest(name, self.names)
            if len(headings) == 1 and (other := [sign for sign in (";", "\t", ",", " ") if sign in headings[0].text]):
                shown = "\\t" if other[0] == "\t" else other[0]
                wanted += f'; the columns may want another delimiter, such as delimiter = "{shown}"'
            raise self.error(column, "no such column", wanted)
        if len(alike) > 1:
            wanted = "one, or its position counted from 0: columns = { displacement = 1 }"
            raise self.error(column, f"{len(alike)} columns of this name", wanted)
        return alike[0]

    def _parse(self, needed: list[int]) -> None:
        """Parse columns to the nearest double, by numpy; what numpy does not read, by pandas, which takes more."""
        if next(self._rows(), None) is None:
            raise self.error("", "a header and no numbers", "one line of numbers a sample")
        if not needed:
            return
        separator = self.dialect.separator
        # All columns: lines that are too long are then complained of, and let pass otherwise.
        chosen = None if len(needed) == self.width else needed
        try:
            if self.dialect.decimal != ".":
                raise ValueError("numpy knows the decimal point alone")
            read = np.loadtxt(
                io.StringIO(self.text),
                delimiter=None if separator == " " else separator,
                comments=None,
                usecols=chosen,
                unpack=True,
                ndmin=2,
            )
            columns = list(read)
            if len(columns) != len(needed):
                raise ValueError("lines shorter than the header")
        except (ValueError, TypeError):
            columns = self._taken_apart(needed, chosen)
        self.parsed.update(zip(needed, columns, strict=True))

    def _taken_apart(self, needed: list[int], chosen: list[int] | None) -> list[FloatArray]:
        """Parse columns with decimal commas, quotes, empty cells or short lines, by pandas' C engine."""
        import pandas as pd

        separator = self.dialect.separator
        try:
            frame = pd.read_csv(
                io.StringIO(self.text),
                sep=r"\s+" if separator == " " else separator,
                decimal=self.dialect.decimal,
                header=None,
                names=list(range(self.width)),
                usecols=chosen,
                index_col=False,
                dtype=np.float64,
                engine="c",
            )
        except (ValueError, OverflowError) as error:  # pandas' ParserError is a ValueError
            raise self._bad_cell(needed, error) from None
        return [frame[position].to_numpy(dtype=np.float64) for position in needed]

    def _rows(self) -> Iterator[tuple[int, list[str]]]:
        return ((number, split_line(line, self.dialect)) for number, line in self._lines())

    def _lines(self) -> Iterator[tuple[int, str]]:
        """Go through the lines that are not blank, with their numbers in the file."""
        for number, (line, *_) in enumerate(_lines(self.text), start=self.first_line):
            if line.strip():
                yield number, line

    def _bad_cell(self, needed: Sequence[int], error: Exception) -> InputError:
        """Find what pandas could not read, and say its line and column."""
        decimal = self.dialect.decimal
        for line, cells in self._rows():
            if len(_strip_empty(cells)) > self.width:
                wanted = f"{self.width}, as in the line of the header"
                return self.error(f"line {line}", f"{len(cells)} columns", wanted)
            for position in needed:
                cell = cells[position].strip() if position < len(cells) else ""
                if cell and not _is_number(cell, decimal):
                    column = f'column "{self.headings[position].text}"' if self.headings else f"column {position}"
                    shown = "".join(sign if sign.isprintable() else "?" for sign in cell[:60])
                    wanted = "a number"
                    if decimal == "." and re.fullmatch(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?", cell):
                        wanted = 'a number with a decimal point, or decimal = "," in the record\'s table'
                    return self.error(f"line {line}, {column}", f'the text "{shown}"', wanted)
        reason = str(error).strip().splitlines()[0]
        return self.error("", f"text that cannot be read ({reason})", "columns of numbers")

    def _where(self, index: int) -> str:
        """Place of a sample: pandas leaves blank lines out, so lines are counted again."""
        line = next(islice(self._lines(), index, None), None)
        return f"row {index}" if line is None else f"line {line[0]}"


def open_delimited(data: bytes, path: Path, dialect: CsvDialect) -> Delimited:
    """Read the header of a text file (InputError: wrong encoding, no header, fewer names than columns)."""
    try:
        text = data.decode("utf-8-sig" if codecs.lookup(dialect.encoding).name == "utf-8" else dialect.encoding)
    except UnicodeError as error:
        place = f" (at byte {error.start})" if isinstance(error, UnicodeDecodeError) else ""
        wanted = f'the encoding of the file in the record\'s table, such as encoding = "{_likely_encoding(data)}"'
        raise InputError(path, "", f"bytes that are not {dialect.encoding}{place}", wanted) from None
    text = text.removeprefix("\ufeff").removeprefix("ï»¿")  # a byte-order mark, and one read as Latin letters
    _check_lines(text, path)
    lines = enumerate(_lines(text), start=1)
    full = ((number, *line) for number, line in lines if number > dialect.skip_rows and line[0].strip())
    number, line, start, end = next(full, (0, "", 0, 0))
    _, after, *_ = next(full, (0, ""))
    if not line:
        what = f"nothing after the {dialect.skip_rows} lines to skip" if dialect.skip_rows else "only blank lines"
        raise InputError(path, "", what, 'a header line such as "time [s],displacement [m]"')
    dialect = _numbers_parted_by(line, dialect)
    line = uncommented(line)
    cells = [cell.strip() for cell in _strip_empty(split_line(line, dialect))]
    if len(cells) <= MOST_COLUMNS and _are_numbers(cells, dialect.decimal):
        return Delimited(path, (), text[start:], number, dialect, (), len(cells))
    if len(cells) > MOST_COLUMNS:
        raise InputError(path, f"line {number}", f"{len(cells):,} columns", f"at most {MOST_COLUMNS:,}")
    width = len(_strip_empty(split_line(after, dialect)))
    if width > len(cells):
        found = f"{width} columns under a header of {len(cells)}"
        wanted = 'as many as in the header (a decimal comma wants decimal = "," and delimiter = ";")'
        raise InputError(path, f"line {number + 1}", found, wanted)
    there = len(split_line(after, dialect))
    headings = tuple(map(_heading, cells[:there] if there > 1 else cells))  # LabVIEW names comments that are not there
    names = tuple(heading.name for heading in headings)
    return Delimited(path, names, text[end:], number + 1, dialect, headings, len(headings))


def _likely_encoding(data: bytes) -> str:
    """What a text that is no UTF-8 may be in: Chinese has its bytes above ASCII in pairs, an umlaut stands alone."""
    if begins_as_utf16(data):
        return "utf-16"
    runs = [len(run) % 2 for run in re.findall(rb"[\x80-\xff]+", data)]
    return "latin-1" if 2 * sum(runs) > len(runs) else "gbk"


def _numbers_parted_by(line: str, dialect: CsvDialect) -> CsvDialect:
    """The dialect with the delimiter that a first line of numbers shows, where none is stated and no comma parts it."""
    if dialect.delimiter or len(split_line(line, dialect)) > 1:
        return dialect
    for delimiter in ("\t", ";", " "):
        other = replace(dialect, delimiter=delimiter)
        cells = [cell.strip() for cell in _strip_empty(split_line(line, other))]
        if len(cells) > 1 and _are_numbers(cells, dialect.decimal):
            return other
    return dialect


def _are_numbers(cells: Sequence[str], decimal: str) -> bool:
    """Whether a line is one of numbers, no header: cells may be empty, as a delimiter at its beginning leaves one."""
    full = [cell for cell in cells if cell]
    return bool(full) and all(_is_number(cell, decimal) for cell in full)


def _check_lines(text: str, path: Path) -> None:
    """Raise InputError for a line that is longer than twice `LONGEST_LINE`, at the latest, without splitting any."""
    for start in range(0, len(text) - LONGEST_LINE, LONGEST_LINE):
        if text.find("\n", start, start + LONGEST_LINE) < 0 and text.find("\r", start, start + LONGEST_LINE) < 0:
            line = 1 + text.count("\n", 0, start)
            raise InputError(path, f"line {line}", f"more than {LONGEST_LINE:,} characters", "one line a sample")


def _lines(text: str) -> Iterator[tuple[str, int, int]]:
    """Go through the lines of a text, whichever way they end: the line without its end, its start and the next's."""
    position = 0
    for match in _LINE_END.finditer(text):
        yield text[position : match.start()], position, match.end()
        position = match.end()
    if position < len(text):
        yield text[position:], position, len(text)


def uncommented(line: str) -> str:
    """Take away the sign with which numpy.savetxt or MATLAB makes a header a comment."""
    return _COMMENT.sub("", line)


def split_line(line: str, dialect: CsvDialect) -> list[str]:
    """Split a line into cells."""
    if dialect.separator == " ":
        return _WHITESPACE_SPLIT.split(line.strip())
    return next(csv.reader([line.rstrip("\r\n")], delimiter=dialect.separator), [])


def _heading(text: str) -> Heading:
    match = _HEADING.match(text) if len(text) <= LONGEST_HEADING else None
    if match is None or not match["name"]:
        return Heading(text, text, None)
    unit = match["unit"] if match["unit"] is not None else match["unit2"]
    return Heading(text, match["name"].strip(), unit.strip() or None)


def _strip_empty(cells: list[str]) -> list[str]:
    """Drop the empty cells that trailing delimiters leave."""
    full = [i for i, cell in enumerate(cells, start=1) if cell.strip()]
    return cells[: full[-1] if full else 0]


def _is_number(cell: str, decimal: str) -> bool:
    if "_" in cell or (decimal == "," and "." in cell):
        return False
    try:
        float(cell.replace(decimal, "."))
    except ValueError:
        return False
    return True
