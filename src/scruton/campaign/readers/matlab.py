"""Reader of MATLAB files of version 5 and older, through SciPy; version 7.3 is HDF5, which has a reader of its own.

SciPy trusts what a file states, with its own memory: a walk over the file comes first, before anything of it is built.
"""

import io
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from inspect import signature
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse
from scipy.io.matlab import MatlabFunction, MatlabOpaque, matfile_version

from scruton.campaign.readers.columns import (
    RESAVE_OBJECT,
    Column,
    Container,
    allowance,
    check_claim,
    element,
    parse_path,
)
from scruton.campaign.spelling import nearest
from scruton.campaign.thresholds import DEEPEST_MAT5, LONGEST_BLANK
from scruton.errors import InputError

_VERSION = 1  # of the format that came with MATLAB 5
_HEADER = 128  # bytes
_CHUNK = 1 << 20
# Kinds of elements.
_INT8, _INT32, _UINT32, _MATRIX, _COMPRESSED, _UTF8 = 1, 5, 6, 14, 15, 16
_NUMBERS = {*range(1, 8), 9, 12, 13}
_NAME = {_INT8, _UTF8}
_TEXTS = {*_NAME, 2, 4, 17, 18}
# Classes of arrays; those of numbers are 6 (double) to 15 (uint64).
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 4, 5, 16, 17
_COMPLEX = 0x08  # flag

Element = tuple[int, int, int]  # kind, start and end of its data


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
        value = self._full(self.variables[root], name)
        for step in steps:
            part = self._field(value, step, name) if isinstance(step, str) else element(value, step, self.path, name)
            value = self._full(part, name)
        cells = value.flat if isinstance(value, np.ndarray) and value.dtype == object else ()
        if _is_object(value) or any(map(_is_object, cells)):
            raise self.error(name, "a MATLAB object (table, string, datetime, ...)", RESAVE_OBJECT)
        names = getattr(value, "dtype", np.dtype(float)).names
        if names is not None:
            what = f"a struct with fields {', '.join(names)}"
            raise self.error(name, what, f'one of its fields, such as "{name}.{names[0]}"')
        return Column(name, self.vector(name, value))

    def _full(self, value: Any, name: str) -> Any:
        """The value, unless it is a sparse matrix, whose indices are not checked by anyone."""
        if scipy.sparse.issparse(value):
            raise self.error(name, "a sparse matrix", "a full one: in MATLAB y = full(y), and save that")
        return value

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
    return isinstance(value, MatlabOpaque | MatlabFunction)


def open_matlab(data: bytes, path: Path) -> MatFile:
    """Open a MATLAB file of version 5 or older."""
    check_mat5(data, path)
    # Newer versions of SciPy warn unless they are told which kind of sparse matrix to make; none is read here.
    sparse: dict[str, Any] = {"spmatrix": False} if "spmatrix" in signature(scipy.io.loadmat).parameters else {}
    content = scipy.io.loadmat(io.BytesIO(data), struct_as_record=True, **sparse)
    variables = {key: value for key, value in content.items() if not key.startswith("__") and not _is_object(value)}
    objects = tuple(_object_name(key, value) for key, value in content.items() if _is_object(value))
    return MatFile(path, tuple(variables), variables, objects)


def _object_name(key: str, value: Any) -> str:
    """Name of an object: older SciPy files it under "None" and keeps its name in the first field."""
    if value.dtype.names is None or "s0" not in value.dtype.names:
        return key
    name = value.reshape(-1)[0]["s0"]
    return name.decode(errors="replace") if isinstance(name, bytes) else str(name)


@dataclass(frozen=True)
class _Walk:
    path: Path
    order: str  # "<" or ">"

    def file(self, data: bytes) -> None:
        """Check every variable; what is compressed is unpacked, up to what it may hold."""
        total = 0
        for kind, start, stop in self.elements(data, _HEADER, len(data)):
            inside, variables = data, [(kind, start, stop)]
            if kind == _COMPRESSED:
                inside = self.unpacked(data[start:stop])
                total += len(inside)
                check_claim(total, len(data), self.path, "")
                variables = self.elements(inside, 0, len(inside))
            for inner, first, last in variables:
                if inner != _MATRIX:
                    raise self.damaged("a variable that is no array")
                self.matrix(inside, first, last)

    def unpacked(self, packed: bytes) -> bytes:
        most = allowance(len(packed))
        unpacker = zlib.decompressobj()
        content = bytearray(unpacker.decompress(packed, _CHUNK))
        while unpacker.unconsumed_tail and len(content) <= most:
            content += unpacker.decompress(unpacker.unconsumed_tail, _CHUNK)
        check_claim(len(content), len(packed), self.path, "")
        return bytes(content)

    def elements(self, data: bytes, start: int, stop: int) -> list[Element]:
        """Find the elements between two places."""
        parts = []
        while start + 8 <= stop:
            kind, size = struct.unpack_from(f"{self.order}II", data, start)
            if kind >> 16:  # a small element: its size stands beside its kind, its data behind
                kind, size, first, after = kind & 0xFFFF, kind >> 16, start + 4, start + 8
                if size > 4:
                    raise self.damaged("a small element that is large")
            else:
                first = start + 8
                after = first + (size if kind == _COMPRESSED else -(-size // 8) * 8)
            if first + size > stop:
                raise self.damaged("it ends in the middle of its data")
            parts.append((kind, first, first + size))
            start = after
        return parts

    def matrix(self, data: bytes, start: int, stop: int, depth: int = 0) -> None:
        """Check that an array consists of what its class wants, and the arrays in it."""
        if depth > DEEPEST_MAT5:
            raise InputError(self.path, "", "structs within structs without end", f"at most {DEEPEST_MAT5} of them")
        if start == stop:  # an empty array
            return
        parts = self.elements(data, start, stop)
        if not parts or parts[0][0] != _UINT32 or parts[0][2] - parts[0][1] != 8:
            raise self.damaged("an array without a class")
        (flags,) = struct.unpack_from(f"{self.order}I", data, parts[0][1])
        body = parts[1:] if flags & 0xFF == _OPAQUE else parts[3:]
        head, arrays = self.wanted(data, flags, parts)
        kinds = [kind for kind, *_ in body]
        whole = len(kinds) == len(head) + arrays and set(kinds[len(head) :]) <= {_MATRIX}
        if not whole or not all(kind in known for kind, known in zip(kinds, head, strict=False)):
            raise self.damaged("an array that is not what its class wants")
        for kind, first, last in body:
            if kind == _MATRIX:
                self.matrix(data, first, last, depth + 1)

    def wanted(self, data: bytes, flags: int, parts: list[Element]) -> tuple[list[set[int]], int]:
        """What follows the flags, dimensions and name of an array: kinds of elements, then so many arrays."""
        kind, pairs = flags & 0xFF, 2 if flags >> 8 & _COMPLEX else 1
        if kind == _OPAQUE:
            return [_NAME, _NAME, _NAME, {_MATRIX}], 0
        if len(parts) < 3 or parts[1][0] not in (_INT32, _UINT32) or parts[2][0] not in _NAME:
            raise self.damaged("an array without dimensions and a name")
        _, first, last = parts[1]
        sizes = struct.unpack_from(f"{self.order}{(last - first) // 4}i", data, first)
        if not 2 <= len(sizes) <= 32 or min(sizes) < 0:
            raise self.damaged("an array of impossible dimensions")
        if kind == _CHAR and prod(sizes) > max(parts[-1][2] - parts[-1][1], LONGEST_BLANK):
            raise self.damaged("a text without its letters")
        if kind in (_STRUCT, _OBJECT):
            class_name = [_NAME] if kind == _OBJECT else []
            return [*class_name, {_INT32}, _NAME], prod(sizes) * self.fields(data, parts[3 + len(class_name) :])
        layouts = {_CHAR: ([_TEXTS], 0), _CELL: ([], prod(sizes)), _FUNCTION: ([], 1)}
        layouts[_SPARSE] = [_NUMBERS] * (2 + pairs), 0
        layouts |= dict.fromkeys(range(6, 16), ([_NUMBERS] * pairs, 0))
        if kind not in layouts:
            raise self.damaged("an array of a class that is not known")
        return layouts[kind]

    def fields(self, data: bytes, names: list[Element]) -> int:
        """Number of fields of a struct: the length of a name, and all names one behind the other."""
        if len(names) < 2 or names[0][2] - names[0][1] != 4:
            raise self.damaged("a struct without fields")
        (length,) = struct.unpack_from(f"{self.order}i", data, names[0][1])
        if length < 1:
            raise self.damaged("a struct whose fields have no names")
        return int((names[1][2] - names[1][1]) // length)

    def damaged(self, what: str) -> InputError:
        return InputError(self.path, "", f"a file that cannot be read ({what})", "a whole MATLAB file")


def check_mat5(data: bytes, path: Path) -> None:
    """Refuse a MATLAB 5 file that unpacks to too much, states what it does not hold, or nests without end.

    Arrays of another version are as large as they are in the file.
    """
    if matfile_version(io.BytesIO(data))[0] == _VERSION:  # type: ignore[arg-type]  # takes streams, too
        _Walk(path, "<" if data[_HEADER - 2 : _HEADER] == b"IM" else ">").file(data)
