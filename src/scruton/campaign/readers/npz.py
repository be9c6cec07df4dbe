"""Reader of NumPy archives (.npz)."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scruton.campaign.readers.columns import Column, as_column, readable
from scruton.campaign.readers.variables import element, parse_path
from scruton.campaign.tables import nearest
from scruton.errors import InputError


@dataclass(frozen=True, eq=False)
class NpzFile:
    """An archive of arrays by name; "data[:,1]" takes a column of a matrix."""

    path: Path
    arrays: Mapping[str, NDArray[Any]]

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


def open_npz(data: bytes, path: Path) -> NpzFile:
    """Open an archive (InputError if it cannot be)."""
    with readable(path, "a NumPy archive written by numpy.savez"):
        if not data.startswith(b"PK"):  # numpy would speak of pickles
            raise ValueError("not a ZIP archive")
        return NpzFile(path, np.load(io.BytesIO(data), allow_pickle=False))
