"""One reader per container of records; `open_container` picks it by the file's ending."""

from pathlib import Path

from scruton.campaign.readers.columns import Column, Container, readable
from scruton.campaign.readers.delimited import CsvDialect, open_delimited
from scruton.campaign.readers.hdf5 import open_hdf5
from scruton.campaign.readers.matlab import open_matlab
from scruton.campaign.readers.npz import open_npz
from scruton.campaign.readers.tdms import open_tdms
from scruton.errors import InputError

__all__ = ["Column", "Container", "CsvDialect", "is_delimited", "open_container"]

_DELIMITED = (".csv", ".txt", ".dat", ".tsv", ".asc")
_OTHERS = {
    ".mat": open_matlab,
    ".h5": open_hdf5,
    ".hdf5": open_hdf5,
    ".npz": open_npz,
    ".tdms": open_tdms,
}


def is_delimited(path: Path) -> bool:
    """Whether a file is text with columns, by its ending."""
    return path.suffix.lower() in _DELIMITED


def open_container(data: bytes, path: Path, dialect: CsvDialect) -> Container:
    """Open a file by its ending.

    Parameters
    ----------
    data : bytes
        Its contents.
    path : Path
        Its name, for the ending and for error messages.
    dialect : CsvDialect
        How text is laid out; other containers do not look at it.

    Raises
    ------
    InputError
        An empty file, an unknown ending, or one that its reader cannot open.
    """
    if not data:
        raise InputError(path, "", "an empty file", "a record")
    if is_delimited(path):
        with readable(path, "text in columns"):
            return open_delimited(data, path, dialect)
    reader = _OTHERS.get(path.suffix.lower())
    if reader is None:
        known = ", ".join([*_DELIMITED, *_OTHERS])
        raise InputError(path, "", f'the file ending "{path.suffix}"', f"one of {known}; save the record as CSV, say")
    with readable(path, f"a {path.suffix.lower()} file that is whole"):
        return reader(data, path)
