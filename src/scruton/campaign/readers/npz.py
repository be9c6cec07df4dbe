"""Reader of NumPy archives (.npz)."""

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.npyio import NpzFile as Archive

from scruton.campaign.readers.claims import check_claim
from scruton.campaign.readers.columns import Column, as_column, readable
from scruton.campaign.readers.variables import element, parse_path
from scruton.campaign.tables import nearest
from scruton.errors import InputError


@dataclass(frozen=True, eq=False)
class NpzFile:
    """An archive of arrays by name; "data[:,1]" takes a column of a matrix."""

    path: Path
    arrays: Archive

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the arrays."""
        return tuple(self.arrays)

    def read(self, names: Sequence[str | int]) -> tuple[Column, ...]:
        """Read arrays by name."""
        return tuple(self._column(str(name)) for name in names)

    def _column(self, name: str) -> Column:
        where = parse_path(name, self.path)
        whole = name in self.arrays  # a name may hold dots or brackets itself
        root = name if whole else where.root
        if root not in self.arrays:
            raise InputError(self.path, name, "no such array", nearest(root, self.arrays))
        with readable(self.path, "an archive that is whole"):
            self._check_size(root)
        try:
            value: Any = self.arrays[root]
        except ValueError as error:
            if "Object arrays" not in str(error):
                raise
            # They need pickle, which runs code: never.
            raise InputError(self.path, name, "an array of objects", "an array of numbers") from None
        for step in () if whole else where.steps:
            if isinstance(step, str):
                raise InputError(self.path, name, f'the field "{step}" of a plain array', "a name, perhaps an index")
            value = element(value, step, self.path, name)
        return Column(name, as_column(value, self.path, name))

    def _check_size(self, root: str) -> None:
        """Refuse an array that claims more than its part of the archive holds, before it is unpacked."""
        archive = self.arrays.zip
        assert archive is not None
        entry = archive.getinfo(root if root in archive.namelist() else f"{root}.npy")
        with archive.open(entry) as file:
            version = np.lib.format.read_magic(file)
            reader = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
            shape, _, dtype = reader(file)
        size = math.prod(shape) * dtype.itemsize
        if size > entry.file_size and not dtype.hasobject:
            found = f"{math.prod(shape):,} values in {entry.file_size:,} bytes"
            raise InputError(self.path, root, found, "an array that holds all of its values")
        check_claim(entry.file_size, entry.compress_size, self.path, root)


def open_npz(data: bytes, path: Path) -> NpzFile:
    """Open an archive (InputError if it cannot be)."""
    with readable(path, "a NumPy archive written by numpy.savez"):
        if not data.startswith(b"PK"):  # numpy would speak of pickles
            raise ValueError("not a ZIP archive")
        return NpzFile(path, np.load(io.BytesIO(data), allow_pickle=False))
