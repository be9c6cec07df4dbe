"""Reader of MATLAB files of version 5 and older, through SciPy; version 7.3 is HDF5, which has a reader of its own."""

import io
from collections.abc import Mapping
from dataclasses import dataclass
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np

from scruton.campaign.readers.columns import RESAVE_OBJECT, Column, Container
from scruton.campaign.readers.mat5 import check_mat5
from scruton.campaign.readers.variables import element, parse_path
from scruton.campaign.spelling import nearest

_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_HDF5_OFFSET = 512  # MATLAB puts its own header before the HDF5 data


@dataclass(frozen=True, eq=False)
class MatFile(Container):
    """Variables by name; "DATA[7].y" reaches into structs, struct arrays and cells."""

    variables: Mapping[str, Any]
    objects: tuple[str, ...]  # variables that MATLAB stores as objects: table, string, datetime, ...

    def column(self, name: str) -> Column:
        """Read a variable by its path."""
        root, steps = parse_path(name, self.path)
        if root in self.objects:
            raise self.error(name, "a MATLAB object (table, string, datetime, ...)", RESAVE_OBJECT)
        if root not in self.variables:
            raise self.error(name, "no such variable", nearest(root, (*self.names, *self.objects)))
        value = self.variables[root]
        for step in steps:
            self._refuse_sparse(value, name)
            value = self._field(value, step, name) if isinstance(step, str) else element(value, step, self.path, name)
        self._refuse_sparse(value, name)
        if _is_object(value) or (
            isinstance(value, np.ndarray) and value.dtype == object and any(map(_is_object, value.flat))
        ):
            raise self.error(name, "a MATLAB object (table, string, datetime, ...)", RESAVE_OBJECT)
        names = getattr(value, "dtype", np.dtype(float)).names
        if names is not None:
            what = f"a struct with fields {', '.join(names)}"
            raise self.error(name, what, f'one of its fields, such as "{name}.{names[0]}"')
        return Column(name, self.vector(name, value))

    def _refuse_sparse(self, value: Any, name: str) -> None:
        from scipy.sparse import issparse

        if issparse(value):  # its indices are not checked by anyone
            raise self.error(name, "a sparse matrix", "a full one: in MATLAB y = full(y), and save that")

    def _field(self, value: Any, field: str, name: str) -> Any:
        """Take a field of a struct, of a struct array of one, or of one element of a struct array."""
        names = getattr(getattr(value, "dtype", None), "names", None)
        if names is None or _is_object(value):
            raise self.error(name, f'no struct to take the field "{field}" from', "a path into a struct")
        if field not in names:
            raise self.error(name, f'no field "{field}"', nearest(field, names))
        if isinstance(value, np.ndarray):
            if value.size != 1:
                index = f'an index before ".{field}": [0] to [{value.size - 1}]'
                raise self.error(name, f"a struct array of {value.size} before .{field}", index)
            value = value.reshape(-1)[0]
        return value[field]


def _is_object(value: Any) -> bool:
    from scipy.io.matlab import MatlabFunction, MatlabOpaque

    return isinstance(value, MatlabOpaque | MatlabFunction)


def is_hdf5(data: bytes) -> bool:
    """Whether a MATLAB file is of version 7.3."""
    return data.startswith(_HDF5_SIGNATURE) or data.startswith(_HDF5_SIGNATURE, _HDF5_OFFSET)


def open_matlab(data: bytes, path: Path) -> MatFile:
    """Open a MATLAB file of version 5 or older."""
    from scipy.io import loadmat

    check_mat5(data, path)
    # Newer versions of SciPy warn unless they are told which kind of sparse matrix to make; none is read here.
    sparse: dict[str, Any] = {"spmatrix": False} if "spmatrix" in signature(loadmat).parameters else {}
    content = loadmat(io.BytesIO(data), struct_as_record=True, **sparse)
    variables = {key: value for key, value in content.items() if not key.startswith("__") and not _is_object(value)}
    objects = tuple(_object_name(key, value) for key, value in content.items() if _is_object(value))
    return MatFile(path, tuple(variables), variables, objects)


def _object_name(key: str, value: Any) -> str:
    """Name of an object: older SciPy files it under "None" and keeps its name in the first field."""
    if value.dtype.names is None or "s0" not in value.dtype.names:
        return key
    name = value.reshape(-1)[0]["s0"]
    return name.decode(errors="replace") if isinstance(name, bytes) else str(name)
