"""Draws looked up in posterior.nc, variable by variable as they are asked for, without xarray.

Reading all groups by xarray takes two seconds and more than a prediction; it asks for a dozen of the 295 variables.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from scruton.infer.result_schema import SCHEMA, group_faults

if TYPE_CHECKING:
    from scruton.errors import InputError

Refuse = Callable[[str], "InputError"]  # what is wrong with the file


@dataclass(frozen=True, eq=False)
class Values:
    """One variable: the part of xarray.DataArray's interface that a look-up needs.

    Attributes
    ----------
    values : array
    dims : tuple of str
    labels : mapping
        Of the dimensions that have a coordinate, by name.
    """

    values: np.ndarray[Any, Any]
    dims: tuple[str, ...]
    labels: Mapping[str, np.ndarray[Any, Any]]

    def to_numpy(self) -> np.ndarray[Any, Any]:
        """The numbers, or texts."""
        return self.values

    def isel(self, **places: int) -> "Values":
        """The values at these places."""
        found = self
        for dim, place in places.items():
            found = found._taken(dim, place)
        return found

    def sel(self, **wanted: str | Sequence[str]) -> "Values":
        """The values at these labels; KeyError where there is no such label."""
        found = self
        for dim, label in wanted.items():
            order = {name: place for place, name in enumerate(self.labels[dim].tolist())}
            place = order[label] if isinstance(label, str) else [order[one] for one in label]
            found = found._taken(dim, place)
        return found

    def _taken(self, dim: str, place: int | list[int]) -> "Values":
        values = np.take(self.values, place, axis=self.dims.index(dim))
        if isinstance(place, list):
            return replace(self, values=values, labels={**self.labels, dim: self.labels[dim][place]})
        return replace(self, values=values, dims=tuple(name for name in self.dims if name != dim))

    def __float__(self) -> float:
        return float(self.values.item())

    def __bool__(self) -> bool:
        return bool(self.values.item())


class Group:
    """One group of the file, as laid out by `SCHEMA`; InputError where it is not."""

    def __init__(self, group: h5py.Group, refuse: Refuse) -> None:
        self._group = group
        self._refuse = refuse
        self._seen: dict[str, Values] = {}
        # The library walks through the whole file for the name of a dimension that a variable refers to.
        self._at = {h5py.h5o.get_info(one.id).addr: key for key, one in group.items()}
        name = group.name.strip("/")
        stored = {key: (self._dims(key), self._dtype(key)) for key in group if hasattr(group[key], "dtype")}
        wrong = group_faults(name, SCHEMA.get(name, ()), stored)
        if wrong:
            raise refuse(f"results of another layout: {wrong[0]}")

    @cached_property
    def attrs(self) -> dict[str, Any]:
        """Attributes."""
        return {key: _plain(value) for key, value in self._group.attrs.items()}

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Length of every dimension."""
        return {
            dim: length
            for key, one in self._group.items()
            if hasattr(one, "dtype")
            for dim, length in zip(self._dims(key), one.shape, strict=True)
        }

    def __contains__(self, name: str) -> bool:
        return name in self._group

    def __getitem__(self, name: str) -> Values:
        if name not in self._seen:
            dims = self._dims(name)
            try:
                labels = {dim: self._read(dim) for dim in dims if dim in self._group}
                self._seen[name] = Values(self._read(name), dims, labels)
            except OSError as error:  # a block that cannot be unpacked
                raise self._refuse(f"a file that cannot be read ({error})") from error
        return self._seen[name]

    def _read(self, name: str) -> np.ndarray[Any, Any]:
        stored = self._group[name]
        values = stored.asstr()[()] if stored.dtype.kind == "O" else stored[()]
        return np.asarray(values).astype(self._dtype(name), copy=False)

    def _dtype(self, name: str) -> "np.dtype[Any]":
        stored = self._group[name]
        return np.dtype(bool) if _plain(stored.attrs.get("dtype")) == "bool" else stored.dtype

    def _dims(self, name: str) -> tuple[str, ...]:
        stored = self._group[name]
        if "DIMENSION_LIST" in stored.attrs:
            scales = (self._group[axis[0]] for axis in stored.attrs["DIMENSION_LIST"])
            return tuple(self._at[h5py.h5o.get_info(scale.id).addr] for scale in scales)
        return (name,) if stored.shape else ()


def _plain(value: Any) -> Any:
    """An attribute as xarray gives it: text, for the file has it in bytes, an empty list, a number that is no array."""
    if isinstance(value, bytes):
        return value.decode("utf-8")
    if getattr(value, "shape", ()) is None:  # h5py's Empty
        return np.empty(0, value.dtype)
    return value[0] if isinstance(value, np.ndarray) and value.size == 1 else value


class Stored:
    """posterior.nc, its groups by name: what predictions look up in an xarray.DataTree, they find here, too.

    Parameters
    ----------
    path : Path
    refuse : callable
        Makes the error for a file that cannot be used.
    """

    def __init__(self, path: Path, refuse: Refuse) -> None:
        try:
            self._file = h5py.File(path, "r")
        except OSError as error:
            raise refuse(f"a file that cannot be read ({error})") from error
        self._refuse = refuse
        self._groups: dict[str, Group] = {}

    def __contains__(self, name: str) -> bool:
        return name in self._file

    def __getitem__(self, name: str) -> Group:
        if name not in self._groups:
            self._groups[name] = Group(self._file[name], self._refuse)
        return self._groups[name]
