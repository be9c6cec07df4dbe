"""Reader of NumPy archives (.npz): arrays by name; "data[:,1]" takes a column of a matrix."""

import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.npyio import NpzFile as Archive

from scruton.campaign.readers.columns import Column, Container, check_claim, element, parse_path
from scruton.campaign.spelling import nearest


@dataclass(frozen=True, eq=False)
class NpzFile(Container):
    """An archive of arrays."""

    arrays: Archive

    def column(self, name: str) -> Column:
        """Read an array by its name or path."""
        root, steps = parse_path(name, self.path)
        if name in self.arrays:  # a name may hold dots or brackets itself
            root, steps = name, ()
        if root not in self.arrays:
            raise self.error(name, "no such array", nearest(root, self.arrays))
        self._check_size(root)
        try:
            value: Any = self.arrays[root]
        except ValueError as error:
            if "Object arrays" not in str(error):
                raise
            # They need pickle, which runs code: never.
            raise self.error(name, "an array of objects", "an array of numbers") from None
        for step in steps:
            if isinstance(step, str):
                raise self.error(name, f'the field "{step}" of a plain array', "a name, perhaps an index")
            value = element(value, step, self.path, name)
        return Column(name, self.vector(name, value))

    def _check_size(self, root: str) -> None:
        """Refuse an array that claims more than its part of the archive holds, before it is unpacked."""
        archive = self.arrays.zip
        assert archive is not None
        entry = archive.getinfo(root if root in archive.namelist() else f"{root}.npy")
        with archive.open(entry) as file:
            version = np.lib.format.read_magic(file)
            reader = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
            shape, _, dtype = reader(file)
        count = math.prod(shape)
        if count * dtype.itemsize > entry.file_size and not dtype.hasobject:
            found = f"{count:,} values in {entry.file_size:,} bytes"
            raise self.error(root, found, "an array that holds all of its values")
        check_claim(entry.file_size, entry.compress_size, self.path, root)


def open_npz(data: bytes, path: Path) -> NpzFile:
    """Open an archive."""
    if not data.startswith(b"PK"):  # numpy would speak of pickles
        raise ValueError("not a ZIP archive")
    arrays = np.load(io.BytesIO(data), allow_pickle=False)
    return NpzFile(path, tuple(arrays), arrays)
