"""Reader of HDF5 (.h5), and of MATLAB 7.3 files, which are HDF5 with structs as groups and references."""

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from scruton.campaign.readers.columns import RESAVE_OBJECT, Column, Container, Index, check_claim, element, parse_path
from scruton.campaign.spelling import nearest
from scruton.campaign.thresholds import MOST_LINKS

_INTEGERS = tuple(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))
_MATLAB_ARRAYS = frozenset(("double", "single", "logical", "struct", "cell", "char", *_INTEGERS))


class StructElement(NamedTuple):
    """One element of a MATLAB struct array: each field is a data set of references, one an element."""

    group: h5py.Group
    slot: Index


@dataclass(frozen=True, eq=False)
class Hdf5(Container):
    """Data sets by path: "group/y", "DATA[7].y", "data[:,1]"; MATLAB's arrays are stored transposed."""

    file: h5py.File

    def column(self, name: str) -> Column:
        """Read a data set by its path."""
        root, steps = parse_path(name, self.path)
        value: Any = self._member(self.file, root, name)
        for step in steps:
            value = self._member(value, step, name) if isinstance(step, str) else self._element(value, step, name)
        group = value.group if isinstance(value, StructElement) else value
        if isinstance(group, h5py.Group):
            what = f"a group or struct with {', '.join(list(group)[:12])}"
            raise self.error(name, what, f'such as "{name}.{next(iter(group), "y")}"')
        unit = None
        if isinstance(value, h5py.Dataset):
            unit = _attribute(value, "units") or _attribute(value, "unit")
            value = self._array(value, name)
        return Column(name, self.vector(name, value), None if unit is None else _text(unit))

    def _member(self, parent: Any, member: str, name: str) -> Any:
        """Take a member of a group, or a field of a struct."""
        group = parent.group if isinstance(parent, StructElement) else parent
        if not isinstance(group, h5py.Group):
            raise self.error(name, f'no struct or group to take "{member}" from', "a path into a struct")
        try:
            child = self._follow(group, member, name)
        except KeyError:
            known = [key for key in group if not key.startswith("#")]
            raise self.error(name, f'no "{member}"', nearest(member, known)) from None
        self._refuse_objects(child, name)
        if isinstance(parent, StructElement):
            return self._element(child, parent.slot, name)
        if isinstance(child, h5py.Dataset) and _is_struct_array(group):
            index = f'an index before ".{member}": [0] to [{child.size - 1}]'
            raise self.error(name, f"a struct array of {child.size} before .{member}", index)
        return child

    def _follow(self, group: h5py.Group, path: str, name: str, links: int = MOST_LINKS) -> Any:
        """Take what lies at a path in this very file (KeyError where nothing does): no link leads out of it."""
        child: Any = self.file if path.startswith("/") else group
        for part in filter(None, path.split("/")):
            link = child.get(part, getlink=True) if isinstance(child, h5py.Group) else None
            if link is None:
                raise KeyError(part)
            if isinstance(link, h5py.SoftLink) and links > 0:
                child = self._follow(child, link.path, name, links - 1)
            elif isinstance(link, h5py.HardLink):
                child = child[part]
            else:
                raise self.error(name, "a link to another file, or to itself", "data in the file itself")
        return child

    def _element(self, value: Any, index: Index, name: str) -> Any:
        """Apply an index, following references."""
        if isinstance(value, h5py.Group):
            if _is_struct_array(value):
                return StructElement(value, index)
            if all(slot == 0 for slot in index):  # a struct of one, stored without references
                return value
            raise self.error(name, "an index outside the one struct", "no index, or [0]")
        array = self._array(value, name) if isinstance(value, h5py.Dataset) else np.asarray(value)
        item = element(array, index, self.path, name)
        if isinstance(item, h5py.Reference):
            item = self.file[item]
            self._refuse_objects(item, name)
        return item

    def _array(self, dataset: h5py.Dataset, name: str) -> Any:
        """Read a data set, turned the way MATLAB shows it where MATLAB wrote it."""
        if _attribute(dataset, "MATLAB_empty"):
            return np.empty(0)
        if _attribute(dataset, "MATLAB_class") == b"char":
            raise self.error(name, "text", "real numbers, one column")
        if dataset.external or dataset.is_virtual:
            raise self.error(name, "data that lie in another file", "data in the file itself")
        check_claim(dataset.nbytes, dataset.id.get_storage_size(), self.path, name)
        array = np.asarray(dataset[()])
        hard = [root for root in self.names if isinstance(self.file.get(root, getlink=True), h5py.HardLink)]
        return array.T if any("MATLAB_class" in self.file[root].attrs for root in hard) else array

    def _refuse_objects(self, item: Any, name: str) -> None:
        """Raise InputError for table, string, datetime and other objects of MATLAB, whose layout is not public."""
        kind = _text(_attribute(item, "MATLAB_class") or b"")
        if "MATLAB_object_decode" in item.attrs and kind not in _MATLAB_ARRAYS:
            raise self.error(name, f"a MATLAB object of class {kind}", RESAVE_OBJECT)


def _is_struct_array(group: h5py.Group) -> bool:
    """Whether a MATLAB struct has several elements: its fields are then data sets of references without a class."""
    if _attribute(group, "MATLAB_class") != b"struct" or not len(group):
        return False
    if not all(isinstance(group.get(key, getlink=True), h5py.HardLink) for key in group):
        return False
    fields = list(group.values())
    references = all(isinstance(item, h5py.Dataset) and h5py.check_ref_dtype(item.dtype) is not None for item in fields)
    return references and not any("MATLAB_class" in item.attrs for item in fields)


def _attribute(item: Any, key: str) -> Any:
    """A single value that is attached to an item; None where there is none, or an array."""
    if key not in item.attrs or item.attrs.get_id(key).shape not in ((), (1,)):
        return None
    value = item.attrs[key]
    return value[0] if isinstance(value, np.ndarray) else value


def _text(value: Any) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)


def open_hdf5(data: bytes, path: Path) -> Hdf5:
    """Open an HDF5 or MATLAB 7.3 file; MATLAB's store of references is none of its names."""
    file = h5py.File(io.BytesIO(data), "r")
    return Hdf5(path, tuple(name for name in file if not name.startswith("#")), file)
