"""MATLAB files, version 5."""

import io
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from tests.fuzz.case import ANY, REFUSED, Case
from tests.fuzz.damage import one
from tests.fuzz.kinds.records import DEPTH, PER_UNIT, Written, flipped, intact, ring_down, spoiled
from tests.fuzz.stock import Stock

NAME = "record.mat"


def mat5(content: dict[str, Any], *, compressed: bool = False) -> bytes:
    """Write a file of version 5."""
    from scipy.io import savemat

    stream = io.BytesIO()
    savemat(stream, content, do_compression=compressed)
    return stream.getvalue()


def struct_array(fields: list[dict[str, Any]]) -> np.ndarray:
    """Build a MATLAB struct array."""
    array = np.empty((1, len(fields)), dtype=[(name, object) for name in fields[0]])
    for i, row in enumerate(fields):
        array[0, i] = tuple(row.values())
    return array


def make(rng: Generator, number: int, folder: Path, _: Stock) -> Case:
    """One third intact in a random layout, one third damaged in a known way, one third spoiled bytes."""
    time, displacement = ring_down(rng)
    unit = one(rng, tuple(PER_UNIT))
    values = displacement * PER_UNIT[unit]
    written = Written(b"", time, displacement / DEPTH, {"units": {"time": "s", "displacement": unit}})
    layout = one(rng, LAYOUTS)
    content, paths = layouts(time, values)[layout]
    written.table["variables"] = dict(zip(("time", "displacement"), paths, strict=True))
    if number % 3 == 0:
        if layout == "single":
            content["y"] = content["y"].astype(np.float32)
            written.response = content["y"].astype(np.float64).ravel() / PER_UNIT[unit] / DEPTH
        written.data = mat5(content, compressed=rng.random() < 0.5)
        return intact("MATLAB 5", f"{layout}, {unit}", folder, NAME, written)
    if number % 3 == 1:
        names = tuple(SPOILED)
        about = names[number // 3 % len(names)]
        written.data, allowed = SPOILED[about](time, values, written.table)
        return spoiled(f"MATLAB 5: {about}", folder, NAME, written, allowed, ("campaign.toml",))
    written.data = mat5(content, compressed=rng.random() < 0.5)
    return flipped(rng, "MATLAB 5", folder, NAME, written)


LAYOUTS = ("plain", "column", "single", "struct", "struct array", "matrix", "cell")


def layouts(time: np.ndarray, y: np.ndarray) -> dict[str, tuple[dict[str, Any], tuple[str, str]]]:
    """Content and the paths of time and displacement, by the name of the layout."""
    cell = np.empty((1, 2), dtype=object)
    cell[0, 0], cell[0, 1] = time, y
    return {
        "plain": ({"t": time, "y": y, "note": "text"}, ("t", "y")),
        "column": ({"t": time[:, None], "y": y[:, None]}, ("t", "y")),
        "single": ({"t": time, "y": y}, ("t", "y")),
        "struct": ({"S": {"run": {"t": time, "y": y}}}, ("S.run.t", "S.run.y")),
        "struct array": (
            {"D": struct_array([{"t": time[:9], "y": y[:9]}, {"t": time, "y": y}])},
            ("D[1].t", "D[1].y"),
        ),
        "matrix": ({"M": np.column_stack([time, y])}, ("M[:,0]", "M[:,1]")),
        "cell": ({"C": cell}, ("C[0]", "C[1]")),
    }


def _with(**changed: Any) -> Any:
    """Replace t or y."""

    def spoil(time: np.ndarray, y: np.ndarray, table: dict[str, Any]) -> tuple[bytes, frozenset[int]]:
        table["variables"] = {"time": "t", "displacement": "y"}
        content = {"t": time, "y": y} | {name: one(time, y) for name, one in changed.items()}
        return mat5(content), REFUSED

    return spoil


def _path(y_path: str) -> Any:
    """Name another path."""

    def spoil(time: np.ndarray, y: np.ndarray, table: dict[str, Any]) -> tuple[bytes, frozenset[int]]:
        content: dict[str, Any] = {}
        for some, _ in layouts(time, y).values():
            content |= some
        table["variables"] = {"time": "t", "displacement": y_path}
        return mat5(content), ANY

    return spoil


def bomb(_t: np.ndarray, _y: np.ndarray, table: dict[str, Any]) -> tuple[bytes, frozenset[int]]:
    """A compressed variable of 4 GB of zeros in some hundred kilobytes."""
    count = 500_000_000
    table["variables"] = {"time": "y", "displacement": "y"}
    head = (
        struct.pack("<IIII", 6, 8, 6, 0)  # flags: double
        + struct.pack("<IIii", 5, 8, count, 1)  # dimensions
        + struct.pack("<HHi", 1, 1, ord("y"))  # name, small element
        + struct.pack("<II", 9, (8 * count) & 0xFFFFFFFF)
    )
    whole = struct.pack("<II", 14, (len(head) + 8 * count) & 0xFFFFFFFF) + head
    packer = zlib.compressobj(9)
    start = packer.compress(whole) + packer.flush(zlib.Z_FULL_FLUSH)
    block = packer.compress(bytes(1 << 24)) + packer.flush(zlib.Z_FULL_FLUSH)
    packed = start + block * (8 * count >> 24) + packer.flush()
    return mat5({})[:128] + struct.pack("<II", 15, len(packed)) + packed, REFUSED


SPOILED: dict[str, Any] = {
    "no such variable": _path("x"),
    "a struct for a number": _path("S"),
    "a struct array without an index": _path("D.y"),
    "an index outside": _path("D[7].y"),
    "a negative index": _path("D[-1].y"),
    "an index of 400 digits": _path(f"D[{'9' * 400}].y"),
    "an index of 20 digits": _path(f"D[{'9' * 20}].y"),
    "full-width digits in an index": _path("D[１].y"),
    "three indices": _path("M[0,1,2]"),
    "no index": _path("M[]"),
    "a path of dots": _path("S..run"),
    "a path of 5,000 steps": _path("S" + ".run" * 5000),
    "a cell of cells": _path("C"),
    "ESC in a path": _path("\x1b[31my"),
    "text": _with(y=lambda _t, _y: "text"),
    "complex": _with(y=lambda _t, y: y + 1j),
    "empty": _with(y=lambda _t, _y: np.empty((0, 0))),
    "logical": _with(y=lambda _t, y: np.zeros(y.size, dtype=bool)),
    "shorter time": _with(t=lambda t, _y: t[:-3]),
    "nan": _with(y=lambda _t, y: np.where(np.arange(y.size) == 5, np.nan, y)),
    "three dimensions": _with(y=lambda _t, y: np.zeros((3, 3, y.size))),
    "a scalar": _with(y=lambda _t, _y: 1.0),
    "a sparse matrix": _with(y=lambda _t, y: __import__("scipy.sparse").sparse.csc_matrix(y[None, :])),
    "uint64 above 2**53": _with(y=lambda _t, y: np.full(y.size, 2**63, dtype=np.uint64)),
    "a bomb": bomb,
    "a header alone": lambda _t, _y, _: (mat5({})[:128], REFUSED),
    "a version 4 file": lambda t, _y, _: (struct.pack("<5i", 0, 1, t.size, 0, 2) + b"y\0" + t.tobytes(), ANY),
    "a CSV by another name": lambda _t, _y, _: (b"time [s],displacement [m]\n0,1\n", REFUSED),
}
