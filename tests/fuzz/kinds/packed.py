"""NumPy archives and LabVIEW's TDMS."""

import io
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from tests.fuzz.case import ANY, REFUSED, Case
from tests.fuzz.damage import ESCAPE, one
from tests.fuzz.kinds.records import DEPTH, PER_UNIT, Written, flipped, intact, ring_down, spoiled
from tests.fuzz.stock import Stock


def npz(rng: Generator, number: int, folder: Path, _: Stock) -> Case:
    """One third intact in a random layout, one third damaged in a known way, one third spoiled bytes."""
    time, y = ring_down(rng)
    unit = one(rng, tuple(PER_UNIT))
    stored = (y * PER_UNIT[unit]).astype(one(rng, (np.float64, np.float32, ">f8")))
    paths, content = one(
        rng,
        (
            (("t", "y"), {"t": time, "y": stored}),
            (("M[:,0]", "M[:,1]"), {"M": np.column_stack([time, stored.astype(np.float64)])}),
            (("t", "y"), {"t": time[:, None], "y": stored[None, :]}),
            (("a.b", "y[0]"), {"a.b": time, "y[0]": stored}),
        ),
    )
    save = one(rng, (np.savez, np.savez_compressed))
    stream = io.BytesIO()
    save(stream, **content)
    table = {"variables": {"time": paths[0], "displacement": paths[1]}, "units": {"time": "s", "displacement": unit}}
    written = Written(stream.getvalue(), time, stored.astype(np.float64) / PER_UNIT[unit] / DEPTH, table)
    name = "record.npz"
    if number % 3 == 0:
        return intact("npz", f"{paths[1]}, {stored.dtype}, {save.__name__}", folder, name, written)
    if number % 3 == 1:
        about, spoil, allowed = SPOILED_NPZ[number // 3 % len(SPOILED_NPZ)]
        table["variables"] = {"time": "t", "displacement": "y"}
        written.data = spoil(time, y)
        return spoiled(f"npz: {about}", folder, name, written, allowed)
    return flipped(rng, "npz", folder, name, written)


def _saved(**changed: Callable[[np.ndarray], Any]) -> Callable[[np.ndarray, np.ndarray], bytes]:
    def spoil(time: np.ndarray, y: np.ndarray) -> bytes:
        stream = io.BytesIO()
        np.savez(stream, **({"t": time, "y": y} | {name: change(y) for name, change in changed.items()}))
        return stream.getvalue()

    return spoil


def _members(**members: bytes) -> Callable[[np.ndarray, np.ndarray], bytes]:
    def spoil(time: np.ndarray, _: np.ndarray) -> bytes:
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w") as file:
            file.writestr("t.npy", npy_header(time.size) + time.tobytes())
            for name, data in members.items():
                file.writestr(f"{name}.npy", data)
        return stream.getvalue()

    return spoil


def npy_header(size: int, dtype: str = "'<f8'", shape: str = "") -> bytes:
    """Spell the header of a .npy file."""
    text = f"{{'descr': {dtype}, 'fortran_order': False, 'shape': {shape or f'({size},)'}, }}".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text) + 1) + text + b"\n"


def bomb(_t: np.ndarray, _y: np.ndarray) -> bytes:
    """An archive of two arrays of 4 GB of zeros, each in 4 MB."""
    count = 500_000_000
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    head = packer.compress(npy_header(count)) + packer.flush(zlib.Z_FULL_FLUSH)
    block = packer.compress(bytes(1 << 24)) + packer.flush(zlib.Z_FULL_FLUSH)
    packed = head + block * (8 * count // (1 << 24) + 1) + packer.flush()
    size = 8 * count + 128
    body, directory = b"", b""
    for name in (b"t.npy", b"y.npy"):
        common = struct.pack("<HHHHHIIIHH", 20, 0, 8, 0, 0x21, 0, len(packed), size & 0xFFFFFFFF, len(name), 0)
        directory += (
            b"PK\x01\x02" + struct.pack("<H", 20) + common + struct.pack("<HHHII", 0, 0, 0, 0, len(body)) + name
        )
        body += b"PK\x03\x04" + common + name + packed
    return body + directory + b"PK\x05\x06" + struct.pack("<HHHHIIH", 0, 0, 2, 2, len(directory), len(body), 0)


SPOILED_NPZ: tuple[tuple[str, Callable[[np.ndarray, np.ndarray], bytes], frozenset[int]], ...] = (
    ("an array of objects", _saved(y=lambda y: np.array([{}] * y.size, dtype=object)), REFUSED),
    ("complex", _saved(y=lambda y: y + 1j), REFUSED),
    ("text", _saved(y=lambda y: np.array(["x"] * y.size)), REFUSED),
    ("dates", _saved(y=lambda y: np.arange(y.size).astype("M8[s]")), REFUSED),
    ("compound", _saved(y=lambda y: np.zeros(y.size, dtype=[("a", "f8")])), REFUSED),
    ("a scalar", _saved(y=lambda y: y[0]), REFUSED),
    ("a matrix", _saved(y=lambda y: np.column_stack([y, y])), REFUSED),
    ("boolean", _saved(y=lambda y: y > 0), ANY),
    ("nan", _saved(y=lambda y: np.where(np.arange(y.size) == 7, np.nan, y)), REFUSED),
    ("shorter", _saved(y=lambda y: y[:-1]), REFUSED),
    ("long doubles", _saved(y=lambda y: y.astype(np.longdouble)), ANY),
    ("half precision", _saved(y=lambda y: y.astype(np.float16)), ANY),
    ("no arrays", lambda _t, _y: b"PK\x05\x06" + bytes(18), REFUSED),
    ("a bomb", bomb, REFUSED),
    ("more declared than there is", _members(y=npy_header(10**9) + bytes(800)), REFUSED),
    ("1e18 declared", _members(y=npy_header(10**18) + bytes(800)), REFUSED),
    ("a negative shape", _members(y=npy_header(-5) + bytes(800)), REFUSED),
    ("a shape of text", _members(y=npy_header(0, shape="('a',)") + bytes(800)), REFUSED),
    ("a shape that is code", _members(y=npy_header(0, shape="__import__('os').getcwd()") + bytes(800)), REFUSED),
    ("a type that does not exist", _members(y=npy_header(100, dtype="'<q99'") + bytes(800)), REFUSED),
    ("a header that is cut", _members(y=npy_header(100)[:30]), REFUSED),
    ("a member that is no array", _members(y=b"hello"), REFUSED),
    ("a pickle in a member", _members(y=b"\x80\x04cos\nsystem\n(X\x04\x00\x00\x00true\x85R."), REFUSED),
    ("a pickle", lambda _t, _y: b"\x80\x04cos\nsystem\n(X\x04\x00\x00\x00true\x85R.", REFUSED),
    ("a bare array", lambda _t, y: npy_header(y.size) + y.tobytes(), REFUSED),
)  # fmt: skip


def tdms(rng: Generator, number: int, folder: Path, _: Stock) -> Case:
    """One third intact, one third damaged in a known way, one third spoiled bytes."""
    import nptdms

    time, y = ring_down(rng)
    unit = one(rng, tuple(PER_UNIT))
    values = y * PER_UNIT[unit]
    step = float(time[1])
    clock: dict[str, Any] = {"wf_increment": step, "wf_start_offset": 0.0, "unit_string": unit}
    channels: list[tuple[str, np.ndarray, dict[str, Any]]] = [("y", values, clock), ("idle", time, {})]
    table: dict[str, Any] = {"variables": {"displacement": one(rng, ("laser/y", "y"))}}
    if rng.random() < 0.5:
        channels = [("t", time, {"unit_string": "s"}), ("y", values, {"unit_string": unit})]
        table["variables"]["time"] = "t"
    about, allowed = "intact", ANY
    if number % 3 == 1:
        about, change, allowed = SPOILED_TDMS[number // 3 % len(SPOILED_TDMS)]
        channels = change(time, values)
        table = {"variables": {"displacement": "y"}, "units": {"displacement": unit}}
    stream = io.BytesIO()
    with nptdms.TdmsWriter(stream) as writer:
        for part in np.array_split(np.arange(time.size), int(rng.integers(1, 4))) if number % 3 == 0 else [slice(None)]:
            writer.write_segment([nptdms.ChannelObject("laser", n, v[part], p) for n, v, p in channels])
    seconds = np.arange(time.size) / (1.0 / step) if "time" not in table["variables"] else time
    written = Written(stream.getvalue(), seconds, y / DEPTH, table)
    name = "record.tdms"
    if number % 3 == 0:
        return intact("TDMS", f"{list(table['variables'])}, {unit}", folder, name, written)
    if number % 3 == 1:
        return spoiled(f"TDMS: {about}", folder, name, written, allowed)
    return flipped(rng, "TDMS", folder, name, written)


Channels = list[tuple[str, np.ndarray, dict[str, Any]]]


def _channel(change: Callable[[np.ndarray], Any], **properties: Any) -> Callable[[np.ndarray, np.ndarray], Channels]:
    return lambda time, y: [("y", change(y), {"wf_increment": float(time[1]), **properties})]


SPOILED_TDMS: tuple[tuple[str, Callable[[np.ndarray, np.ndarray], Channels], frozenset[int]], ...] = (
    ("text", _channel(lambda y: ["x"] * y.size), REFUSED),
    ("dates", _channel(lambda y: np.arange(y.size).astype("M8[us]")), REFUSED),
    ("complex", _channel(lambda y: y + 1j), REFUSED),
    ("empty", _channel(lambda y: y[:0]), REFUSED),
    ("nan", _channel(lambda y: np.where(np.arange(y.size) == 7, np.nan, y)), REFUSED),
    ("a step of nan", _channel(lambda y: y, wf_increment=float("nan")), ANY),
    ("a step of inf", _channel(lambda y: y, wf_increment=float("inf")), ANY),
    ("a step of text", _channel(lambda y: y, wf_increment="fast"), ANY),
    ("a negative step", _channel(lambda y: y, wf_increment=-0.01), REFUSED),
    ("a step of 1e-300", _channel(lambda y: y, wf_increment=1e-300), ANY),
    ("a start of nan", _channel(lambda y: y, wf_start_offset=float("nan")), ANY),
    ("a start of text", _channel(lambda y: y, wf_start_offset="noon"), ANY),
    ("a unit with ESC", _channel(lambda y: y, unit_string=ESCAPE), ANY),
    ("another channel", lambda _t, y: [("z", y, {})], REFUSED),
    ("ESC in a channel's name", lambda _t, y: [(ESCAPE, y, {})], REFUSED),
)  # fmt: skip
