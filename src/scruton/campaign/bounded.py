"""Reading files that somebody else wrote: nothing is read before it is known to be a file, and of a bounded size."""

import codecs
import os
import stat
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from scruton.errors import InputError

_KINDS = (
    (stat.S_ISDIR, "a folder"), (stat.S_ISFIFO, "a pipe"), (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"), (stat.S_ISBLK, "a device"),
)  # fmt: skip


def read_bytes(path: Path, largest: int, wanted: str | Callable[[Path], str] = "a file that is there") -> bytes:
    """Read a regular file of at most `largest` bytes; `wanted` is what an error says where there is no such file.

    InputError, too, for a folder, pipe, socket or device; for a file that is too large, or not to be opened.
    """
    try:
        with open(path, "rb", opener=_without_waiting) as file:  # Path.open takes no opener
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                raise _no_file(path, status.st_mode)
            data = file.read(status.st_size + 1) if status.st_size <= largest else b""
    except FileNotFoundError:
        raise InputError(path, "", "no such file", wanted if isinstance(wanted, str) else wanted(path)) from None
    except IsADirectoryError:
        raise InputError(path, "", "a folder", "a file") from None
    except InputError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a path with a null character
        mode = stat.S_IFREG
        with suppress(OSError, ValueError):
            mode = path.stat().st_mode
        if not stat.S_ISREG(mode):
            raise _no_file(path, mode) from None
        reason = getattr(error, "strerror", None) or error
        raise InputError(path, "", f"a file that cannot be opened ({reason})", "one that can be read") from None
    if status.st_size > largest:
        raise InputError(path, "", f"a file of {_bytes(status.st_size)}", f"one of up to {_bytes(largest)}")
    if len(data) != status.st_size:
        raise InputError(path, "", "a file that changes while it is read", "one that is complete")
    return data


def begins_as_utf16(data: bytes) -> bool:
    """Whether a text begins with the byte-order mark of UTF-16."""
    return data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))


def wide_encoding(data: bytes) -> str | None:
    """UTF-16 or UTF-32 where a text begins as one does, with its mark or with a Latin letter; else None."""
    if data.startswith((codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE)):
        return "UTF-32"
    return "UTF-16" if begins_as_utf16(data) or data[:2].count(0) == 1 else None


def _without_waiting(name: str, flags: int) -> int:
    """Open at once, also a pipe that nobody writes to."""
    return os.open(name, flags | getattr(os, "O_NONBLOCK", 0))


def _no_file(path: Path, mode: int) -> InputError:
    kind = next((name for test, name in _KINDS if test(mode)), "something else")
    return InputError(path, "", kind, "a file" if kind == "a folder" else "a regular file")


def _bytes(count: int) -> str:
    return f"{count / 1e9:.3g} GB" if count >= 1e9 else f"{count / 1e6:.3g} MB" if count >= 1e6 else f"{count} bytes"


def relative_to(path: Path, folder: Path) -> str:
    """A path relative to a folder, perhaps through its parents, with forward slashes."""
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:  # another drive
        return path.as_posix()
