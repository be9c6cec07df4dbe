"""Reading files that somebody else wrote: nothing is read before it is known to be a file, and of a bounded size."""

import math
import os
import re
import stat
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from scruton.errors import InputError

LARGEST_RECORD = 4 * 10**9  # bytes of one file of records: 20 million samples as text are half of a GB
LARGEST_TOML = 10**7  # bytes of one TOML file: thousands of tests
LARGEST_TABLE = 10**7  # bytes of a CSV file beside a bridge: a mode shape, a wind rose
LONGEST_LINE = 10**6  # characters of a line of text: ten thousand columns or more
LARGEST_NUMBER = 1e15  # of any number in a TOML file; whole numbers beyond are no longer exact as doubles
DEEPEST = 16  # tables and lists within each other in a TOML file; campaigns, cards and bridges have four

MISSING = "no such file"

_KINDS = (
    (stat.S_ISDIR, "a folder"), (stat.S_ISFIFO, "a pipe"), (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"), (stat.S_ISBLK, "a device"),
)  # fmt: skip
# tomllib's work grows with the square of the parts of a dotted key.
_DOTTED = re.compile(r"(?<![\w-])(?:[\w-]+[ \t]*\.[ \t]*){64}")


def read_bytes(path: Path, largest: int, wanted: str = "a file that is there") -> bytes:
    """Read a regular file of at most `largest` bytes.

    Parameters
    ----------
    path : Path
    largest : int
        Bytes.
    wanted : str
        What an error says where there is no such file.

    Raises
    ------
    InputError
        No such file; a folder, pipe, socket or device; a file that is too large, or not to be opened.
    """
    try:
        with open(path, "rb", opener=_without_waiting) as file:  # Path.open takes no opener
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                raise _no_file(path, status.st_mode)
            data = file.read(status.st_size + 1) if status.st_size <= largest else b""
    except FileNotFoundError:
        raise InputError(path, "", MISSING, wanted) from None
    except IsADirectoryError:
        raise InputError(path, "", "a folder", "a file") from None
    except InputError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a path with a null character
        if _mode(path) is not None and not stat.S_ISREG(_mode(path) or 0):
            raise _no_file(path, _mode(path) or 0) from None
        reason = getattr(error, "strerror", None) or error
        raise InputError(path, "", f"a file that cannot be opened ({reason})", "one that can be read") from None
    if status.st_size > largest:
        raise InputError(path, "", f"a file of {_bytes(status.st_size)}", f"one of up to {_bytes(largest)}")
    if len(data) != status.st_size:
        raise InputError(path, "", "a file that changes while it is read", "one that is complete")
    return data


def _without_waiting(name: str, flags: int) -> int:
    """Open at once, also a pipe that nobody writes to."""
    return os.open(name, flags | getattr(os, "O_NONBLOCK", 0))


def _mode(path: Path) -> int | None:
    try:
        return path.stat().st_mode
    except (OSError, ValueError):
        return None


def _no_file(path: Path, mode: int) -> InputError:
    kind = next((name for test, name in _KINDS if test(mode)), "something else")
    return InputError(path, "", kind, "a file" if kind == "a folder" else "a regular file")


def _bytes(count: int) -> str:
    return f"{count / 1e9:.3g} GB" if count >= 1e9 else f"{count / 1e6:.3g} MB" if count >= 1e6 else f"{count} bytes"


def check_lines(text: str, path: Path) -> None:
    """Raise InputError for a line that is longer than twice `LONGEST_LINE`, at the latest, without splitting any."""
    for start in range(0, len(text) - LONGEST_LINE, LONGEST_LINE):
        if text.find("\n", start, start + LONGEST_LINE) < 0 and text.find("\r", start, start + LONGEST_LINE) < 0:
            line = 1 + text.count("\n", 0, start)
            raise InputError(path, f"line {line}", f"more than {LONGEST_LINE:,} characters", "one line a sample")


def toml_text(data: bytes, path: Path) -> str:
    """Decode a TOML file (InputError where it is not UTF-8)."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        found = f"bytes that are not UTF-8 (at byte {error.start})"
        raise InputError(path, "", found, "a TOML file in UTF-8") from None


def parse_toml(text: str, path: Path, wanted: str = "a TOML file") -> dict[str, Any]:
    """Parse TOML whose numbers a double holds and whose tables are not nested without end.

    Raises
    ------
    InputError
        Text that is not TOML; a number that is not finite or beyond `LARGEST_NUMBER`; tables nested too deeply.
    """
    try:
        if _DOTTED.search(text):
            raise RecursionError("a key of too many parts")
        content = tomllib.loads(text)
        for place, value in _numbers(content, ""):
            if not abs(value) <= LARGEST_NUMBER:  # nor is NaN
                raise InputError(path, place, _spelt(value), f"a number between {-LARGEST_NUMBER:g} and 1e+15")
    except InputError:
        raise
    except RecursionError:
        raise InputError(path, "", "tables within tables without end", f"at most {DEEPEST} within each other") from None
    except ValueError as error:  # TOMLDecodeError is one; so is a number of more digits than Python reads
        raise InputError(path, "", f"text that is not TOML: {error}", wanted) from None
    return content


def _numbers(value: object, place: str, depth: int = 0) -> Iterator[tuple[str, int | float]]:
    """Every number of parsed TOML, with its place (RecursionError where it lies too deep)."""
    if depth > DEEPEST:
        raise RecursionError
    if isinstance(value, int | float):
        yield place, value
    elif isinstance(value, Mapping):
        for key, one in value.items():
            yield from _numbers(one, f"{place}.{key}" if place else key, depth + 1)
    elif isinstance(value, list):
        for i, one in enumerate(value):
            yield from _numbers(one, f"{place}[{i}]", depth + 1)


def _spelt(value: float) -> str:
    if isinstance(value, float) and not math.isfinite(value):
        return f"{value} (not a finite number)"
    text = str(value)
    return text if len(text) <= 24 else f"a number of {len(text.lstrip('-'))} digits"
