"""HDF5, and MATLAB 7.3 files, which are HDF5."""

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from tests.fuzz.case import ANY, REFUSED, Case
from tests.fuzz.damage import ESCAPE, one
from tests.fuzz.kinds.records import DEPTH, PER_UNIT, Written, flipped, intact, ring_down, spoiled
from tests.fuzz.stock import Stock


def hdf5(fill: Callable[[Any], None], *, matlab: bool = False) -> bytes:
    """Write a file in memory."""
    import h5py

    stream = io.BytesIO()
    with h5py.File(stream, "w", userblock_size=512 if matlab else 0) as file:
        fill(file)
    data = bytearray(stream.getvalue())
    if matlab:
        data[:19] = b"MATLAB 7.3 MAT-file"
    return bytes(data)


def matlab73(content: dict[str, Any]) -> bytes:
    """Write what MATLAB writes: arrays transposed, structs as groups."""

    def fill(file: Any) -> None:
        def write(parent: Any, name: str, value: Any) -> None:
            if isinstance(value, dict):
                group = parent.create_group(name)
                group.attrs["MATLAB_class"] = np.bytes_("struct")
                for key, inner in value.items():
                    write(group, key, inner)
            else:
                data = parent.create_dataset(name, data=np.atleast_2d(value).T)
                data.attrs["MATLAB_class"] = np.bytes_("double")

        for name, value in content.items():
            write(file, name, value)

    return hdf5(fill, matlab=True)


def mat73(rng: Generator, number: int, folder: Path, _: Stock) -> Case:
    """MATLAB 7.3: half intact, half spoiled bytes."""
    time, y = ring_down(rng)
    paths, content = one(
        rng,
        (
            (("t", "y"), {"t": time, "y": y}),
            (("t", "y"), {"t": time[:, None], "y": y[:, None]}),
            (("S.run.t", "S[0].run.y"), {"S": {"run": {"t": time, "y": y}}}),
            (("M[:,0]", "M[:,1]"), {"M": np.column_stack([time, y])}),
        ),
    )
    table = {"variables": {"time": paths[0], "displacement": paths[1]}, "units": {"time": "s", "displacement": "m"}}
    written = Written(matlab73(content), time, y / DEPTH, table)
    if number % 2 == 0:
        return intact("MATLAB 7.3", f"{paths[1]}", folder, "record.mat", written)
    return flipped(rng, "MATLAB 7.3", folder, "record.mat", written)


def make(rng: Generator, number: int, folder: Path, _: Stock) -> Case:
    """One third intact in a random layout, one third damaged in a known way, one third spoiled bytes."""
    time, y = ring_down(rng)
    unit = one(rng, tuple(PER_UNIT))
    name = one(rng, ("record.h5", "record.hdf5"))
    options = one(
        rng, ({}, {"compression": "gzip"}, {"chunks": (100,)}, {"shuffle": True, "chunks": (64,)}, {"fletcher32": True})
    )
    kind = one(rng, (np.float64, np.float64, np.float32, ">f8"))
    stored = (y * PER_UNIT[unit]).astype(kind)

    def fill(file: Any) -> None:
        file.create_dataset("run/t", data=time)
        file.create_dataset("run/y", data=stored, **options).attrs["units"] = unit

    table = {"variables": {"time": one(rng, ("run/t", "run.t")), "displacement": "run/y"}, "units": {"time": "s"}}
    written = Written(hdf5(fill), time, stored.astype(np.float64) / PER_UNIT[unit] / DEPTH, table)
    if number % 3 == 0:
        return intact("HDF5", f"{np.dtype(kind)}, {options}, {unit}", folder, name, written)
    if number % 3 == 1:
        about, spoil, allowed = SPOILED[number // 3 % len(SPOILED)]
        (folder / "case").mkdir()
        (folder / "case" / "beside.bin").write_bytes(stored.astype(np.float64).tobytes())
        (folder / "case" / "beside.h5").write_bytes(written.data)
        written.data = hdf5(lambda file: spoil(file, time, y))
        table["variables"] = {"time": "t", "displacement": "y"}
        table["units"] = {"time": "s", "displacement": "m"}
        return spoiled(f"HDF5: {about}", folder, name, written, allowed)
    return flipped(rng, "HDF5", folder, name, written)


def _data(change: Callable[[np.ndarray], Any]) -> Callable[[Any, np.ndarray, np.ndarray], None]:
    def spoil(file: Any, time: np.ndarray, y: np.ndarray) -> None:
        file["t"], file["y"] = time, change(y)

    return spoil


def _made(make_y: Callable[[Any, np.ndarray], None]) -> Callable[[Any, np.ndarray, np.ndarray], None]:
    def spoil(file: Any, time: np.ndarray, y: np.ndarray) -> None:
        file["t"] = time
        make_y(file, y)

    return spoil


def _link(kind: str, *arguments: str) -> Callable[[Any, np.ndarray], None]:
    def link(file: Any, _: np.ndarray) -> None:
        import h5py

        file["y"] = getattr(h5py, kind)(*arguments)

    return link


def _external(file: Any, y: np.ndarray) -> None:
    file.create_dataset("y", (y.size,), "f8", external=[("case/beside.bin", 0, y.nbytes)])


def _virtual(file: Any, y: np.ndarray) -> None:
    import h5py

    layout = h5py.VirtualLayout((y.size,), "f8")
    layout[:] = h5py.VirtualSource("case/beside.h5", "run/y", (y.size,))
    file.create_virtual_dataset("y", layout)


def _declared(shape: tuple[int, ...], **options: Any) -> Callable[[Any, np.ndarray], None]:
    return lambda file, _: file.create_dataset("y", shape, "f8", **options)


def _both_declared(file: Any, _t: np.ndarray, _y: np.ndarray) -> None:
    for name in ("t", "y"):
        file.create_dataset(name, (300_000_000,), "f8", chunks=(1_000_000,), compression="gzip")


def _loop(file: Any, _: np.ndarray) -> None:
    group = file.create_group("y")
    group["y"] = group


def _attribute(name: str, value: Any) -> Callable[[Any, np.ndarray], None]:
    def spoil(file: Any, y: np.ndarray) -> None:
        file["y"] = y
        file["y"].attrs[name] = value

    return spoil


Spoil = Callable[[Any, np.ndarray, np.ndarray], None]
SPOILED: tuple[tuple[str, Spoil, frozenset[int]], ...] = (
    ("a dataset declared huge", _made(_declared((300_000_000,), chunks=(1_000_000,), compression="gzip")), REFUSED),
    ("two datasets declared huge", _both_declared, REFUSED),
    ("a dataset of 1e15", _made(_declared((10**15,), chunks=(1000,))), REFUSED),
    ("a dataset of 1e6 x 1e6", _made(_declared((10**6, 10**6), chunks=(1000, 10))), REFUSED),
    ("an empty dataset", _made(_declared((0,))), REFUSED),
    ("a scalar", _data(lambda y: y[0]), REFUSED),
    ("a matrix", _data(lambda y: np.column_stack([y, y])), REFUSED),
    ("three dimensions", _data(lambda y: np.zeros((2, 2, y.size))), REFUSED),
    ("complex", _data(lambda y: y + 1j), REFUSED),
    ("text", _data(lambda y: ["x"] * y.size), REFUSED),
    ("bytes", _data(lambda y: np.array([b"1.0"] * y.size)), REFUSED),
    ("compound", _data(lambda y: np.array([(v, v) for v in y], dtype=[("a", "f8"), ("b", "f8")])), REFUSED),
    ("boolean", _data(lambda y: y > 0), ANY),
    ("nan", _data(lambda y: np.where(np.arange(y.size) == 7, np.nan, y)), REFUSED),
    ("shorter", _data(lambda y: y[:-1]), REFUSED),
    ("an array type", _made(lambda f, y: f.create_dataset("y", (y.size,), dtype=np.dtype(("f8", (2,))))), REFUSED),
    ("an enumeration", _made(lambda f, y: f.create_dataset("y", (y.size,), dtype=np.dtype("?"))), ANY),
    ("opaque", _data(lambda y: np.array([b"abc"] * y.size, dtype="V3")), REFUSED),
    ("references", _made(lambda f, y: f.create_dataset("y", (y.size,), __import__("h5py").ref_dtype)), REFUSED),
    (
        "lists of lists",
        _made(lambda f, y: f.create_dataset("y", (y.size,), __import__("h5py").vlen_dtype("f8"))),
        REFUSED,
    ),
    ("no data", _made(lambda f, _: f.create_dataset("y", data=__import__("h5py").Empty("f8"))), REFUSED),
    ("a group", _made(lambda f, _: f.create_group("y")), REFUSED),
    ("a group in itself", _made(_loop), REFUSED),
    ("a soft link", _made(_link("SoftLink", "/t")), ANY),
    ("a soft link to itself", _made(_link("SoftLink", "/y")), REFUSED),
    ("a soft link to nothing", _made(_link("SoftLink", "/nothing")), REFUSED),
    ("an external link", _made(_link("ExternalLink", "case/beside.h5", "run/y")), REFUSED),
    ("an external link to nothing", _made(_link("ExternalLink", "/nothing.h5", "y")), REFUSED),
    ("external storage", _made(_external), REFUSED),
    ("a virtual dataset", _made(_virtual), REFUSED),
    ("a unit with ESC", _made(_attribute("units", ESCAPE)), ANY),
    ("a unit that is a number", _made(_attribute("units", 7.0)), ANY),
    ("a unit that is an array", _made(_attribute("units", np.arange(5.0))), ANY),
    ("MATLAB_empty of text", _made(_attribute("MATLAB_empty", "yes")), ANY),
    ("MATLAB_empty of an array", _made(_attribute("MATLAB_empty", np.ones(3))), ANY),
    ("MATLAB_class of an array", _made(_attribute("MATLAB_class", np.ones(3))), ANY),
)
