"""Reader of HDF5 (.h5), and of MATLAB 7.3 files, which are HDF5 with structs as groups and references."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.campaign.readers.columns import RESAVE_OBJECT, Column, as_column, readable
from scruton.campaign.readers.variables import Index, element, parse_path
from scruton.campaign.tables import nearest
from scruton.errors import InputError

if TYPE_CHECKING:
    import h5py

_INTEGERS = tuple(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))
_MATLAB_ARRAYS = frozenset(("double", "single", "logical", "struct", "cell", "char", *_INTEGERS))


@dataclass(frozen=True, eq=False)
class StructElement:
    """One element of a MATLAB struct array: each field is a data set of references, one an element."""

    group: "h5py.Group"
    index: Index


@dataclass(frozen=True, eq=False)
class Hdf5:
    """Data sets by path: "group/y", "DATA[7].y", "data[:,1]"; MATLAB's arrays are stored transposed."""

    path: Path
    file: "h5py.File"

    @property
    def names(self) -> tuple[str, ...]:
        """Names at the top of the file, without MATLAB's store of references."""
        return tuple(name for name in self.file if not name.startswith("#"))

    def read(self, names: Sequence[str | int]) -> tuple[Column, ...]:
        """Read data sets by path."""
        return tuple(self._column(str(name)) for name in names)

    def _column(self, name: str) -> Column:
        import h5py

        where = parse_path(name, self.path)
        value: Any = self._member(self.file, where.root, name)
        for step in where.steps:
            value = self._member(value, step, name) if isinstance(step, str) else self._element(value, step, name)
        unit = None
        if isinstance(value, h5py.Dataset):
            unit = value.attrs.get("units", value.attrs.get("unit"))
            value = self._array(value, name)
        if isinstance(value, h5py.Group | StructElement):
            group = value if isinstance(value, h5py.Group) else value.group
            raise InputError(
                self.path,
                name,
                f"a group or struct with {', '.join(group)}",
                f'such as "{name}.{next(iter(group), "y")}"',
            )
        text = unit.decode(errors="replace") if isinstance(unit, bytes) else unit
        return Column(name, as_column(value, self.path, name), str(text) if text is not None else None)

    def _member(self, parent: Any, member: str, name: str) -> Any:
        """Take a member of a group, or a field of a struct."""
        import h5py

        group = parent.group if isinstance(parent, StructElement) else parent
        if not isinstance(group, h5py.Group):
            raise InputError(self.path, name, f'no struct or group to take "{member}" from', "a path into a struct")
        known = [one for one in group if not one.startswith("#")]
        try:
            child = group[member]
        except (KeyError, ValueError):
            raise InputError(self.path, name, f'no "{member}"', nearest(member, known)) from None
        self._refuse_objects(child, name)
        if isinstance(parent, StructElement):
            return self._element(child, parent.index, name)
        if isinstance(child, h5py.Dataset) and _is_struct_array(group):
            raise InputError(
                self.path, name, f"a struct array of {child.size} before .{member}",
                f'an index before ".{member}": [0] to [{child.size - 1}]',
            )  # fmt: skip
        return child

    def _element(self, value: Any, index: Index, name: str) -> Any:
        """Apply an index, following references."""
        import h5py

        if isinstance(value, h5py.Group):
            if _is_struct_array(value):
                return StructElement(value, index)
            if all(slot == 0 for slot in index):  # a struct of one, stored without references
                return value
            raise InputError(self.path, name, "an index outside the one struct", "no index, or [0]")
        array = self._array(value, name) if isinstance(value, h5py.Dataset) else value
        found = element(np.asarray(array), index, self.path, name)
        if isinstance(found, h5py.Reference):
            child = self.file[found]
            self._refuse_objects(child, name)
            return child
        return found

    def _array(self, dataset: "h5py.Dataset", name: str) -> Any:
        """Read a data set, turned the way MATLAB shows it where MATLAB wrote it."""
        if dataset.attrs.get("MATLAB_empty", 0):
            return np.empty(0)
        if dataset.attrs.get("MATLAB_class") == b"char":
            raise InputError(self.path, name, "text", "real numbers, one column")
        array = dataset[()]
        return np.asarray(array).T if self._is_matlab() else np.asarray(array)

    def _is_matlab(self) -> bool:
        return any("MATLAB_class" in self.file[name].attrs for name in self.names)

    def _refuse_objects(self, item: Any, name: str) -> None:
        """Raise InputError for table, string, datetime and other objects of MATLAB, whose layout is not public."""
        kind = item.attrs.get("MATLAB_class", b"")
        kind = kind.decode(errors="replace") if isinstance(kind, bytes) else str(kind)
        if "MATLAB_object_decode" in item.attrs and kind not in _MATLAB_ARRAYS:
            raise InputError(self.path, name, f"a MATLAB object of class {kind}", RESAVE_OBJECT)


def _is_struct_array(group: "h5py.Group") -> bool:
    """Whether a MATLAB struct has several elements: its fields are then data sets of references without a class."""
    import h5py

    if group.attrs.get("MATLAB_class") != b"struct" or not len(group):
        return False
    return all(
        isinstance(one, h5py.Dataset)
        and h5py.check_ref_dtype(one.dtype) is not None
        and "MATLAB_class" not in one.attrs
        for one in group.values()
    )


def open_hdf5(data: bytes, path: Path) -> Hdf5:
    """Open an HDF5 or MATLAB 7.3 file (InputError if it cannot be)."""
    import h5py

    with readable(path, "an HDF5 or MATLAB 7.3 file"):
        return Hdf5(path, h5py.File(io.BytesIO(data), "r"))
