"""One reader per container of records, by the file's ending: a new one is a file here and a line in `READERS`.

A reader is a function of the bytes and the path that gives a `Container`.  It may raise what it likes on a file that it
cannot read: `open_container` and `read_columns` turn that into an InputError, here and nowhere else.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

from scruton.campaign.readers.columns import Clock, Column, Container
from scruton.campaign.readers.delimited import CsvDialect, open_delimited
from scruton.errors import InputError

__all__ = [
    "COMPANIONS",
    "READERS",
    "Clock",
    "Column",
    "Container",
    "CsvDialect",
    "is_delimited",
    "open_container",
    "read_columns",
]

_DELIMITED = (".csv", ".txt", ".dat", ".tsv", ".asc", ".lvm")
_SIGNATURE = b"\x89HDF\r\n\x1a\n"  # of HDF5; MATLAB puts 512 bytes of its own before it

Reader = Callable[[bytes, Path], Container]


def _from(name: str) -> Reader:
    """The reader of a file here: it and its libraries are loaded when they are needed."""

    def read(data: bytes, path: Path) -> Container:
        reader: Reader = getattr(import_module(f"{__name__}.{name}"), f"open_{name}")
        return reader(data, path)

    return read


_HDF5 = (_from("hdf5"), "an HDF5 or MATLAB 7.3 file")

# By the file's ending: the reader, and what its files are, for the error about one that is not.
READERS: dict[str, tuple[Reader, str]] = {
    ".mat": (_from("matlab"), "a MATLAB file, version 5 or 7.3"),
    ".h5": _HDF5,
    ".hdf5": _HDF5,
    ".npz": (_from("npz"), "a NumPy archive written by numpy.savez"),
    ".sts": (_from("dasp"), "a channel as DASP writes it, with its .tsp beside it"),
    ".vxp": (_from("vxp"), "a data set as VIVyD writes it"),
    ".tdms": (_from("tdms"), "a TDMS file as LabVIEW writes it"),
}

COMPANIONS = {".sts": ".tsp"}  # files that a reader takes beside the one that is named


def is_delimited(path: Path) -> bool:
    """Whether a file is text with columns, by its ending."""
    return path.suffix.lower() in _DELIMITED


def open_container(data: bytes, path: Path, dialect: CsvDialect) -> Container:
    """Open a file by its ending; InputError where it is empty or unknown, or whatever its reader raises."""
    if not data:
        raise InputError(path, "", "an empty file", "a record")
    ending = path.suffix.lower()
    if is_delimited(path):
        with _readable(path, "text in columns"):
            return open_delimited(data, path, dialect)
    if ending not in READERS:
        known = ", ".join([*_DELIMITED, *READERS])
        raise InputError(path, "", f'the file ending "{path.suffix}"', f"one of {known}; save the record as CSV, say")
    reader, wanted = _HDF5 if ending == ".mat" and _SIGNATURE in (data[:8], data[512:520]) else READERS[ending]
    with _readable(path, wanted):
        return reader(data, path)


def read_columns(container: Container, names: Sequence[str | int]) -> tuple[Column, ...]:
    """Read columns of an open file (InputError whatever its reader raises: some damage shows only now)."""
    with _readable(container.path, "a whole file"):
        return container.read(names)


@contextmanager
def _readable(path: Path, wanted: str) -> Iterator[None]:
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
