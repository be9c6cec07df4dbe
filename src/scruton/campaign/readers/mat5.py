"""A walk over a MATLAB 5 file before SciPy builds anything of it: SciPy trusts the sizes and depths that it states."""

import io
import struct
import zlib
from dataclasses import dataclass
from math import prod
from pathlib import Path

from scruton.campaign.readers.claims import allowance, check_claim
from scruton.errors import InputError

DEEPEST = 32  # structs and cells within each other
_HEADER = 128  # bytes
_VERSION = 1  # of the format that came with MATLAB 5
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCT, _OBJECT, _CHAR = 1, 2, 3, 4  # classes of arrays
_CHUNK = 1 << 20


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
                    if inner == _MATRIX:
                        self.matrix(unpacked, first, last)
            elif kind == _MATRIX:
                self.matrix(data, start, stop)

    def unpacked(self, packed: bytes) -> bytes:
        most = allowance(len(packed))
        unpacker = zlib.decompressobj()
        found = bytearray(unpacker.decompress(packed, _CHUNK))
        while unpacker.unconsumed_tail and len(found) <= most:
            found += unpacker.decompress(unpacker.unconsumed_tail, _CHUNK)
        check_claim(len(found), len(packed), self.path, "")
        return bytes(found)

    def elements(self, data: bytes, start: int, stop: int) -> list[tuple[int, int, int]]:
        """Kind, start and end of each element between two places."""
        parts = []
        while start + 8 <= stop:
            kind, size = struct.unpack_from(f"{self.order}II", data, start)
            if kind >> 16:  # a small element: its size stands beside its kind, its data behind
                kind, size, first, after = kind & 0xFFFF, kind >> 16, start + 4, start + 8
            else:
                first = start + 8
                after = first + (size if kind == _COMPRESSED else -(-size // 8) * 8)
            if first + size > stop:
                found = "a file that cannot be read (it ends in the middle of its data)"
                raise InputError(self.path, "", found, "a whole file")
            parts.append((kind, first, first + size))
            start = after
        return parts

    def matrix(self, data: bytes, start: int, stop: int, depth: int = 0) -> None:
        """Check that an array has room for the elements that it states, and those in it."""
        if depth > DEEPEST:
            raise InputError(self.path, "", "structs within structs without end", f"at most {DEEPEST} of them")
        parts = self.elements(data, start, stop)
        if len(parts) < 3:  # an empty array, or none
            return
        (_, flags, _), (_, first, last) = parts[:2]
        kind = data[flags] if self.order == "<" else data[flags + 3]
        count = prod(struct.unpack_from(f"{self.order}{(last - first) // 4}i", data, first))
        if kind in (_CELL, _STRUCT, _OBJECT, _CHAR):  # of these SciPy makes every element before it reads one
            least = 1 if kind == _CHAR else 8
            if count < 0 or count * least > max(stop - start, 0):
                found = f"{count:,} elements in {stop - start:,} bytes"
                raise InputError(self.path, "", found, "an array that holds all of its elements")
        for inner, one, other in parts[2:]:
            if inner == _MATRIX:
                self.matrix(data, one, other, depth + 1)


def check_mat5(data: bytes, path: Path) -> None:
    """Refuse a MATLAB 5 file that unpacks to too much, states more than it holds, or nests without end.

    Raises
    ------
    InputError
        As said; nothing for a file of another version, whose arrays are as large as they are in the file.
    """
    from scipy.io.matlab import matfile_version

    if matfile_version(io.BytesIO(data))[0] == _VERSION:  # type: ignore[arg-type]  # takes streams, too
        _Walk(path, "<" if data[_HEADER - 2 : _HEADER] == b"IM" else ">").file(data)
