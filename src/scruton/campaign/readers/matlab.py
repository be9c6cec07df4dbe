"""Reader of MATLAB files: version 5 and older through SciPy; version 7.3 is HDF5 and goes to that reader."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scruton.campaign.readers.columns import RESAVE_OBJECT, Column, Container, as_column, readable
from scruton.campaign.readers.hdf5 import open_hdf5
from scruton.campaign.readers.mat5 import check_mat5
from scruton.campaign.readers.variables import element, parse_path
from scruton.campaign.tables import nearest
from scruton.errors import InputError

_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_HDF5_OFFSET = 512  # MATLAB puts its own header before the HDF5 data


@dataclass(frozen=True, eq=False)
class MatFile:
    """Variables by name; "DATA[7].y" reaches into structs, struct arrays and cells."""

    path: Path
    variables: Mapping[str, Any]
    objects: tuple[str, ...]  # variables that MATLAB stores as objects: table, string, datetime, ...

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables."""
        return tuple(self.variables)

    def read(self, names: Sequence[str | int]) -> tuple[Column, ...]:
        """Read variables by path."""
        return tuple(self._column(str(name)) for name in names)

    def _column(self, name: str) -> Column:
        where = parse_path(name, self.path)
        if where.root in self.objects:
            raise InputError(self.path, name, "a MATLAB object (table, string, datetime, ...)", RESAVE_OBJECT)
        if where.root not in self.variables:
            raise InputError(self.path, name, "no such variable", nearest(where.root, (*self.names, *self.objects)))
        value = self.variables[where.root]
        for step in where.steps:
            self._refuse_sparse(value, name)
            value = self._field(value, step, name) if isinstance(step, str) else element(value, step, self.path, name)
        self._refuse_sparse(value, name)
        if _is_object(value) or (
            isinstance(value, np.ndarray) and value.dtype == object and any(map(_is_object, value.flat))
        ):
            raise InputError(self.path, name, "a MATLAB object (table, string, datetime, ...)", RESAVE_OBJECT)
        names = getattr(value, "dtype", np.dtype(float)).names
        if names is not None:
            what = f"a struct with fields {', '.join(names)}"
            raise InputError(self.path, name, what, f'one of its fields, such as "{name}.{names[0]}"')
        return Column(name, as_column(value, self.path, name))

    def _refuse_sparse(self, value: Any, name: str) -> None:
        from scipy.sparse import issparse

        if issparse(value):  # its indices are not checked by anyone
            raise InputError(self.path, name, "a sparse matrix", "a full one: in MATLAB y = full(y), and save that")

    def _field(self, value: Any, field: str, name: str) -> Any:
        """Take a field of a struct, of a struct array of one, or of one element of a struct array."""
        names = getattr(getattr(value, "dtype", None), "names", None)
        if names is None or _is_object(value):
            raise InputError(self.path, name, f'no struct to take the field "{field}" from', "a path into a struct")
        if field not in names:
            raise InputError(self.path, name, f'no field "{field}"', nearest(field, names))
        if isinstance(value, np.ndarray):
            if value.size != 1:
                last = value.size - 1
                raise InputError(
                    self.path, name, f"a struct array of {value.size} before .{field}",
                    f'an index before ".{field}": [0] to [{last}]',
                )  # fmt: skip
            value = value.reshape(-1)[0]
        return value[field]


def _is_object(value: Any) -> bool:
    from scipy.io.matlab import MatlabFunction, MatlabOpaque

    return isinstance(value, MatlabOpaque | MatlabFunction)


def open_matlab(data: bytes, path: Path) -> Container:
    """Open a MATLAB file of any version (InputError if it cannot be)."""
    if data.startswith(_HDF5_SIGNATURE) or data.startswith(_HDF5_SIGNATURE, _HDF5_OFFSET):
        return open_hdf5(data, path)
    from scipy.io import loadmat

    with readable(path, "a MATLAB file, version 5 or 7.3"):
        check_mat5(data, path)
        content = loadmat(io.BytesIO(data), struct_as_record=True)
    variables = {key: value for key, value in content.items() if not key.startswith("__") and not _is_object(value)}
    objects = tuple(_object_name(key, value) for key, value in content.items() if _is_object(value))
    return MatFile(path, variables, objects)


def _object_name(key: str, value: Any) -> str:
    """Name of an object: older SciPy files it under "None" and keeps its name in the first field."""
    if value.dtype.names is None or "s0" not in value.dtype.names:
        return key
    name = value.reshape(-1)[0]["s0"]
    return name.decode(errors="replace") if isinstance(name, bytes) else str(name)
