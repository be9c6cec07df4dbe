"""The one mechanism for every kind of TOML: tables that know where they stand, and fields that are declared as data.

A kind of table is a mapping of its keys to `Field`s, made by the functions at the end of this file.  `Table.read`
refuses keys that are not declared and reads the others in the order of the declaration.
"""

import math
import re
import tomllib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, TypeGuard

from scruton.campaign.bounded import read_bytes, wide_encoding
from scruton.campaign.quantity import Quantity
from scruton.campaign.spelling import digits, nearest, show
from scruton.campaign.thresholds import DEEPEST_TOML, LARGEST_NUMBER, LARGEST_TOML, MOST_TABLES
from scruton.campaign.units import Dimension, parse_quantity
from scruton.errors import InputError

# tomllib's work grows with the square of the parts of a dotted key.
_DOTTED = re.compile(r"(?<![\w-])(?:[\w-]+[ \t]*\.[ \t]*){64}")
_REQUIRED: Any = object()


def read_toml(path: Path, wanted: str = "a file that is there") -> tuple[bytes, dict[str, Any]]:
    """Read a TOML file: its bytes and what it says (InputError as `parse_toml`, or where there is no such file)."""
    data = read_bytes(path, LARGEST_TOML, wanted)
    return data, parse_toml(data, path, wanted)


def toml_text(data: bytes, path: Path) -> str:
    """Decode a TOML file (InputError where it is not UTF-8)."""
    if (encoding := wide_encoding(data)) is not None:
        raise InputError(path, "", f"text in {encoding}", "a TOML file in UTF-8")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        found = f"bytes that are not UTF-8 (at byte {error.start})"
        raise InputError(path, "", found, "a TOML file in UTF-8") from None


def parse_toml(data: bytes, path: Path, wanted: str = "a TOML file") -> dict[str, Any]:
    """Parse TOML whose numbers a double holds and whose tables are not nested without end (else InputError)."""
    text = toml_text(data, path)
    try:
        if _DOTTED.search(text):
            raise RecursionError("a key of too many parts")
        content = tomllib.loads(text)
        for place, value in _numbers(content, ""):
            if not abs(value) <= LARGEST_NUMBER:  # nor is NaN
                endless = isinstance(value, float) and not math.isfinite(value)
                found = f"{value} (not a finite number)" if endless else digits(value)
                raise InputError(path, place, found, f"a number between {-LARGEST_NUMBER:g} and 1e+15")
    except InputError:
        raise
    except RecursionError:
        wanted = f"at most {DEEPEST_TOML} within each other"
        raise InputError(path, "", "tables within tables without end", wanted) from None
    except ValueError as error:  # TOMLDecodeError is one; so is a number of more digits than Python reads
        line, meant = _slip(text, str(error))
        raise InputError(path, line, f"text that is not TOML: {error}", meant or wanted) from None
    return content


# What people write, and how TOML has it; a slip that the parser's own words do not tell.
_SLIPS: tuple[tuple[re.Pattern[str], Callable[[re.Match[str]], str]], ...] = (
    (re.compile("[\u201c\u201d\u201e\u2018\u2019]"), lambda _: 'straight quotes, "..."'),
    (re.compile(r"=\s*([-+]?)(\.\d+)"), lambda m: f"a digit before the point: {m[1]}0{m[2]}"),
    (re.compile(r"=\s*([-+]?\d+)\.(?=\s|,|\}|$)"), lambda m: f"a digit after the point, or none: {m[1]}.0"),
    (re.compile(r"=\s*([-+]?\d+),(\d+)\s*(?:#|$)"), lambda m: f"a point in place of the comma: {m[1]}.{m[2]}"),
    (
        re.compile(r"=\s*([-+]?\d[\d.]*\s*(?:[A-Za-z%\u00b0\u00b1+][^\"'#,\]}]*))"),
        lambda m: f'a quantity with its unit in quotes: "{m[1].strip()}"',
    ),
    (
        re.compile(r"=\s*(?!true|false)([A-Za-z_\u00c0-\uffff][^\"'#,\]}=]*)"),
        lambda m: f'a text in quotes: "{m[1].strip()}"',
    ),
    (re.compile(r'=\s*"[^"]*\\'), lambda _: "forward slashes, or a text in single quotes: 'records\\run1.csv'"),
)


def _slip(text: str, said: str) -> tuple[str, str]:
    """The line that a parser's words are about, and what is wanted there; empty where nobody can tell."""
    lines = text.removesuffix("\n").split("\n")  # TOML's line breaks; splitlines knows others
    found = re.search(r"at line (\d+)", said)
    number = int(found[1]) if found else len(lines)
    if not 0 < number <= len(lines) or "Unclosed" in said:
        return "", ""
    line = lines[number - 1]
    if "overwrite" in said or "twice" in said:
        key = re.match(r"\s*\[*\s*([^\]=]*?)\s*[\]=]", line)
        return f"line {number}", f"{key[1] if key else 'each key'} once; the other lines of that name gone"
    return f"line {number}", next((meant(slip) for wrong, meant in _SLIPS if (slip := wrong.search(line))), "")


def _numbers(value: object, place: str, depth: int = 0) -> Iterator[tuple[str, int | float]]:
    """Every number of parsed TOML, with its place (RecursionError where it lies too deep)."""
    if depth > DEEPEST_TOML:
        raise RecursionError
    if isinstance(value, int | float):
        yield place, value
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _numbers(inner, f"{place}.{key}" if place else key, depth + 1)
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from _numbers(inner, f"{place}[{i}]", depth + 1)


@dataclass(frozen=True)
class Wording:
    """How the errors of one kind of file are put: a value that stands there, and a key that is not known."""

    shown: Callable[[object], str] = show
    unknown: str = "a key that is not known"
    hint: Callable[[str, Iterable[str]], str] = nearest


@dataclass(frozen=True)
class Field:
    """How the value of one key is read, and what it is where the key is left out (an error, unless said)."""

    reader: Callable[["Table", str], Any]
    default: Any = _REQUIRED

    def read(self, table: "Table", key: str) -> Any:
        """Read the value of `key` (InputError where it is wrong, or absent and required)."""
        return self.default if key not in table and self.default is not _REQUIRED else self.reader(table, key)


@dataclass(frozen=True)
class Table:
    """A TOML table, the file it stands in and its place there ("tests[0].records[1]"; empty for the whole file)."""

    file: Path
    field: str
    values: Mapping[str, Any]
    wording: Wording = Wording()

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def at(self, key: str) -> str:
        """Return the place of `key`."""
        return f"{self.field}.{key}" if self.field else key

    def error(self, key: str, found: str, wanted: str) -> InputError:
        """Build an error about `key`."""
        return InputError(self.file, self.at(key), found, wanted)

    def refusal(self, key: str, wanted: str) -> InputError:
        """Build an error about the value of `key` as it stands."""
        return self.error(key, self.wording.shown(self.values.get(key)), wanted)

    def read(self, fields: Mapping[str, Field]) -> dict[str, Any]:
        """Read what is declared, in that order; InputError for a key that is not, and for the first that is wrong."""
        self.check_keys(fields)
        return {key: field.read(self, key) for key, field in fields.items()}

    def check_keys(self, known: Collection[str]) -> None:
        """Raise InputError for the first key that is not known, with the nearest that is."""
        for key in self.values:
            if key not in known:
                raise self.error(key, self.wording.unknown, self.wording.hint(key, known))

    def check_format(self, version: int) -> None:
        """Raise InputError unless the file says that it is of this version."""
        stated = self.required("format", f"format = {version}")
        if stated != version or isinstance(stated, bool | float):
            raise self.error("format", show(stated), f"format = {version}, the one that this version reads")

    def required(self, key: str, wanted: str) -> Any:
        """Return a value of any type (InputError where it is absent)."""
        if key not in self:
            raise self.error(key, "nothing", wanted)
        return self.values[key]

    def text(self, key: str, wanted: str, *, blank: bool = False) -> str:
        """Return a text, which may be blank only where that is said."""
        value = self.required(key, wanted)
        if not isinstance(value, str) or not (blank or value.strip()):
            raise self.error(key, show(value), wanted)
        return value

    def choice(self, key: str, known: Collection[str]) -> str:
        """Return one of the `known` words."""
        value = self.required(key, f"one of: {', '.join(known)}")
        if not isinstance(value, str) or value not in known:
            raise self.error(key, show(value), nearest(value if isinstance(value, str) else "", known))
        return value

    def quantity(self, key: str, dimension: Dimension) -> Quantity:
        """Return a quantity that must be there."""
        value = self.required(key, f"{dimension.name}, such as {key} = {dimension.spelling}")
        return parse_quantity(value, dimension, self.file, self.at(key))

    def number(self, key: str, dimension: Dimension) -> float:
        """Return the value [SI] of a quantity that must be there and carries no uncertainty."""
        value = self.quantity(key, dimension)
        if value.sd is not None:
            raise self.error(key, "a standard deviation", f"{dimension.name} without one")
        return value.mean

    def inner(self, key: str, wanted: str, absent: str | None = None) -> "Table":
        """Return the table `key`, which must be there; `absent` is what is found where it is not."""
        if absent is not None and key not in self:
            raise self.error(key, absent, wanted)
        if not isinstance(self.values.get(key), Mapping):
            raise self.refusal(key, wanted)
        return Table(self.file, self.at(key), self.values[key], self.wording)

    def table(self, key: str) -> "Table":
        """Return the table `key`, empty where it is absent."""
        value = self.values.get(key, {})
        if not isinstance(value, Mapping):
            raise self.error(key, show(value), f"one table, [{self._header(key)}] or {key} = {{ ... }}")
        return Table(self.file, self.at(key), value, self.wording)

    def tables(self, key: str) -> "tuple[Table, ...]":
        """Return the list of tables `key`, empty where it is absent."""
        values = self.values.get(key, [])
        if not isinstance(values, list) or not all(isinstance(value, Mapping) for value in values):
            raise self.error(key, show(values), f"a list of tables, each under [[{self._header(key)}]]")
        if len(values) > MOST_TABLES:
            raise self.error(key, f"{len(values):,} tables", f"at most {MOST_TABLES:,}")
        return tuple(Table(self.file, f"{self.at(key)}[{i}]", value, self.wording) for i, value in enumerate(values))

    def _header(self, key: str) -> str:
        return re.sub(r"\[\d+\]", "", self.at(key))


def text(wanted: str = "a text", default: Any = _REQUIRED, *, blank: bool = False) -> Field:
    """Declare a text."""
    return Field(lambda table, key: table.text(key, wanted, blank=blank), default)


def choice(words: type[StrEnum], default: Any = _REQUIRED) -> Field:
    """Declare a word that names a member of an enumeration."""
    return Field(lambda table, key: words(table.choice(key, [member.value for member in words])), default)


def stated(dimension: Dimension) -> Field:
    """Declare a quantity that may carry a standard deviation."""
    return Field(lambda table, key: table.quantity(key, dimension))


def number(
    dimension: Dimension, default: Any = _REQUIRED, *, good: Callable[[float], bool] | None = None, wanted: str = ""
) -> Field:
    """Declare a quantity without a standard deviation, in SI; `good` says which values are, `wanted` what is."""

    def read(table: Table, key: str) -> float:
        value = table.number(key, dimension)
        if good is not None and not good(value):
            raise table.error(key, f"{value:g}", wanted)
        return value

    return Field(read, default)


def valid(
    good: Callable[[Any], bool], wanted: str, default: Any = _REQUIRED, then: Callable[[Any], Any] | None = None
) -> Field:
    """Declare a value of any type that passes a test, None being one that is left out; `then` converts it."""

    def read(table: Table, key: str) -> Any:
        if not good(table.values.get(key)):
            raise table.refusal(key, wanted)
        value = table.values.get(key)
        return then(value) if then is not None else value

    return Field(read, default)


def bare(low: float = -math.inf, high: float = math.inf, default: Any = _REQUIRED, wanted: str = "") -> Field:
    """Declare a bare number between two bounds, both included."""
    wanted = wanted or f"a number from {low:g} to {high:g}"
    return valid(lambda value: is_number(value) and low <= value <= high, wanted, default, float)


def whole(low: int, high: float, default: Any = _REQUIRED, wanted: str = "") -> Field:
    """Declare a whole number between two bounds, both included."""
    wanted = wanted or f"a whole number from {low} to {high}"
    return valid(lambda value: is_number(value) and isinstance(value, int) and low <= value <= high, wanted, default)


def flag(default: Any = _REQUIRED) -> Field:
    """Declare true or false."""
    return valid(lambda value: isinstance(value, bool), "true or false", default)


def anything() -> Field:
    """Declare a value that its owner reads; None where it is left out."""
    return valid(lambda value: True, "")


def is_number(value: object) -> TypeGuard[int | float]:
    """Whether a value of TOML is a number: true and false are none."""
    return isinstance(value, int | float) and not isinstance(value, bool)
