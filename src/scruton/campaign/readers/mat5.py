"""A walk over a MATLAB 5 file before SciPy builds anything of it: SciPy trusts what it states, with its own memory."""

import io
import struct
import zlib
from dataclasses import dataclass
from math import prod
from pathlib import Path

from scruton.campaign.readers.columns import allowance, check_claim
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


@dataclass(frozen=True)
class _Walk:
    path: Path
    order: str  # "<" or ">"

    def file(self, data: bytes) -> None:
        """Check every variable; what is compressed is unpacked, up to what it may hold."""
        total = 0
        for kind, start, stop in self.elements(data, _HEADER, len(data)):
            if kind == _COMPRESSED:
                unpacked = self.unpacked(data[start:stop])
                total += len(unpacked)
                check_claim(total, len(data), self.path, "")
                for inner, first, last in self.elements(unpacked, 0, len(unpacked)):
                    self.variable(unpacked, inner, first, last)
            else:
                self.variable(data, kind, start, stop)

    def variable(self, data: bytes, kind: int, start: int, stop: int) -> None:
        if kind != _MATRIX:
            raise self.damaged("a variable that is no array")
        self.matrix(data, start, stop)

    def unpacked(self, packed: bytes) -> bytes:
        most = allowance(len(packed))
        unpacker = zlib.decompressobj()
        found = bytearray(unpacker.decompress(packed, _CHUNK))
        while unpacker.unconsumed_tail and len(found) <= most:
            found += unpacker.decompress(unpacker.unconsumed_tail, _CHUNK)
        check_claim(len(found), len(packed), self.path, "")
        return bytes(found)

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
        count = self.count(data, parts[1])
        if kind == _CHAR:
            if count > max(parts[-1][2] - parts[-1][1], LONGEST_BLANK):
                raise self.damaged("a text without its letters")
            return [_TEXTS], 0
        if kind == _CELL:
            return [], count
        if kind in (_STRUCT, _OBJECT):
            names = parts[4 if kind == _OBJECT else 3 :][:2]
            head = [_NAME] if kind == _OBJECT else []
            return [*head, {_INT32}, _NAME], count * self.fields(data, names)
        if kind == _FUNCTION:
            return [], 1
        if kind == _SPARSE:
            return [_NUMBERS] * (2 + pairs), 0
        if 6 <= kind <= 15:
            return [_NUMBERS] * pairs, 0
        raise self.damaged("an array of a class that is not known")

    def count(self, data: bytes, dimensions: Element) -> int:
        """Number of elements of an array."""
        _, first, last = dimensions
        sizes = struct.unpack_from(f"{self.order}{(last - first) // 4}i", data, first)
        if not 2 <= len(sizes) <= 32 or min(sizes) < 0:
            raise self.damaged("an array of impossible dimensions")
        return prod(sizes)

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

    Raises
    ------
    InputError
        As said; nothing for a file of another version, whose arrays are as large as they are in the file.
    """
    from scipy.io.matlab import matfile_version

    if matfile_version(io.BytesIO(data))[0] == _VERSION:  # type: ignore[arg-type]  # takes streams, too
        _Walk(path, "<" if data[_HEADER - 2 : _HEADER] == b"IM" else ">").file(data)
