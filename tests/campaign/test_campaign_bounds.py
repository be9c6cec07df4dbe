"""What is not a file, too large, or claims more than it holds, is refused before it is read."""

import contextlib
import io
import os
import socket
import struct
import time
import tracemalloc
import zipfile
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from campaign_room import DISPLACEMENT, HEAVING, TIME, Room, csv, record
from scipy.io import savemat
from scipy.sparse import csc_matrix

from scruton.campaign import bounded, load_campaign, thresholds
from scruton.campaign.readers.tdms import open_tdms
from scruton.errors import InputError

ALONE = ('units = { displacement = "m" }', 'sample_rate = "100 Hz"', 'variables = { displacement = "y" }')
SAMPLES = 300_000_000


def hdf5(make: Any) -> bytes:
    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        make(file)
    return stream.getvalue()


def npz(shape: tuple[int, ...], content: bytes = b"") -> bytes:
    """Write an archive whose array claims a shape."""
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": shape})
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("y.npy", head.getvalue() + content)
    return stream.getvalue()


def element(kind: int, content: bytes) -> bytes:
    return struct.pack("<II", kind, len(content)) + content + b"\0" * (-len(content) % 8)


def matrix(kind: int, count: int, *parts: bytes, name: bytes = b"y") -> bytes:
    flags, size = element(6, struct.pack("<II", kind, 0)), element(5, struct.pack("<ii", count, 1))
    return element(14, flags + size + element(1, name) + b"".join(parts))


def mat5(*variables: bytes) -> bytes:
    return b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<HH", 0x0100, 0x4D49) + b"".join(variables)


def packed(content: bytes) -> bytes:
    data = zlib.compress(content, 9)
    return struct.pack("<II", 15, len(data)) + data


def nested(depth: int) -> bytes:
    found = matrix(6, 1, element(9, struct.pack("<d", 1.0)))
    for _ in range(depth):
        found = matrix(1, 1, found)
    return found


CLAIMS = {
    "chunks.h5": hdf5(lambda file: file.create_dataset("y", (SAMPLES,), "f8", chunks=(1000,), compression="gzip")),
    "zeros.h5": hdf5(lambda file: file.create_dataset("y", data=np.zeros(20_000_000), compression=9, chunks=True)),
    "claims.npz": npz((SAMPLES,)),
    "zeros.npz": npz((20_000_000,), bytes(160_000_000)),
    "bomb.mat": mat5(packed(matrix(6, 20_000_000, element(9, bytes(160_000_000))))),
    "cells.mat": mat5(matrix(1, SAMPLES)),
    "packed.mat": mat5(packed(matrix(1, SAMPLES))),
    "text.mat": mat5(matrix(4, SAMPLES, element(16, b""))),
    "deep.mat": mat5(nested(20_000)),
}


@pytest.mark.parametrize("file", CLAIMS)
def test_files_that_claim_more_than_they_hold(room: Room, file: str) -> None:
    with contextlib.suppress(InputError):  # imports
        room.record("y.npz", npz((3,)), *ALONE)
    tracemalloc.start()
    began = time.process_time()
    with pytest.raises(InputError):
        room.record(file, CLAIMS[file], *ALONE)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert time.process_time() - began < 10
    assert peak < 2.5e8


@pytest.mark.parametrize("link", [h5py.ExternalLink("secret.h5", "/y"), h5py.SoftLink("/out"), h5py.SoftLink("/y")])
def test_links_do_not_lead_out_of_the_file(room: Room, link: Any) -> None:
    def make(file: h5py.File) -> None:
        file["out"] = h5py.ExternalLink(str(room.folder / "secret.h5"), "/y")
        file["y"] = link

    (room.folder / "secret.h5").write_bytes(hdf5(lambda file: file.create_dataset("y", data=DISPLACEMENT)))
    with pytest.raises(InputError, match="found a link to another file, or to itself"):
        room.record("r.h5", hdf5(make), *ALONE)


def test_links_within_the_file_are_followed(room: Room) -> None:
    def make(file: h5py.File) -> None:
        file["run/data"] = DISPLACEMENT
        file["y"] = h5py.SoftLink("/run/data")

    assert len(room.record("r.h5", hdf5(make), *ALONE).response) == len(DISPLACEMENT)


@pytest.mark.parametrize("kind", ["external", "virtual"])
def test_data_in_other_files_are_not_read(room: Room, kind: str) -> None:
    def make(file: h5py.File) -> None:
        if kind == "external":
            file.create_dataset("y", (100,), "f8", external=[(str(room.folder / "raw"), 0, 800)])
            return
        layout = h5py.VirtualLayout((100,), "f8")
        layout[:] = h5py.VirtualSource(str(room.folder / "secret.h5"), "y", (100,))
        file.create_virtual_dataset("y", layout)

    (room.folder / "raw").write_bytes(np.arange(100.0).tobytes())
    with pytest.raises(InputError, match="found data that lie in another file"):
        room.record("r.h5", hdf5(make), *ALONE)


@pytest.mark.parametrize("name", ["campaign.toml", "r.csv"])
@pytest.mark.parametrize("kind", ["pipe", "socket", "device", "folder"])
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes in the file system")
def test_what_is_no_file_is_refused_at_once(room: Room, name: str, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    room.load(HEAVING)
    (room.folder / "campaign.toml").write_text(HEAVING + record("r.csv"), encoding="utf-8")
    path = room.folder / name
    path.unlink(missing_ok=True)
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "socket":
        monkeypatch.chdir(room.folder)
        socket.socket(socket.AF_UNIX).bind(name)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    else:
        path.mkdir()
    with pytest.raises(InputError, match=rf"{name}: found a {kind}"):
        load_campaign(room.folder)


def test_files_have_a_largest_size(room: Room) -> None:
    with (room.folder / "campaign.toml").open("wb") as file:
        file.truncate(thresholds.LARGEST_TOML + 1)
    with pytest.raises(InputError, match="found a file of 10 MB; wanted one of up to 10 MB"):
        bounded.read_bytes(room.folder / "campaign.toml", thresholds.LARGEST_TOML)
    with (room.folder / "r.csv").open("wb") as file:
        file.truncate(thresholds.LARGEST_RECORD + 1)
    (room.folder / "campaign.toml").write_text(HEAVING + record("r.csv"), encoding="utf-8")
    with pytest.raises(InputError, match="found a file of 4 GB"):
        load_campaign(room.folder)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x" * 20_000_000, "more than 1,000,000 characters"),
        (csv() + "1," * 2_000_000 + "\n", "more than 1,000,000 characters"),
        ("," * 900_000 + "\n1,2\n", "found"),
        ("time [s]," + " " * 100_000 + "x\n0,1\n1,2\n", "no such column"),
        ("a," * 20_000 + "\n", "20,000 columns; wanted at most 10,000"),
        ("x" * 200_000 + "\n1,2\n", "field larger than field limit"),
    ],
    ids=["one line", "a late line", "commas", "blanks", "columns", "one cell"],
)
def test_long_lines(room: Room, text: str, message: str) -> None:
    began = time.process_time()
    with pytest.raises(InputError, match=message) as caught:
        room.record("r.csv", text)
    assert time.process_time() - began < 10
    assert len(str(caught.value)) < 5_000


HUGE = "9" * 400


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"75 mm"', HUGE, "section.depth: found a number of 400 digits"),
        ('"75 mm"', "9" * 5000, "not TOML"),
        ('"75 mm"', f'"{HUGE} mm"', "section.depth: .*not a finite number"),
        ('"75 mm"', '"1e300 m"', 'section.depth: found "1e300 m", which no measurement has'),
        ('"75 mm"', '"1e-300 m"', "which no measurement has"),
        ('"75 mm"', '"1e8 Gm"', "which no measurement has"),
        ('"75 mm"', '"-0.0 m"', "greater than zero"),
        ('"75 mm"', '{ mean = "1 m", sd = "1e300 m" }', "which no measurement has"),
        ('"75 mm"', '"1 m^9^9^9^9"', "a unit|the unit"),
        ('"75 mm"', "1979-05-27", "neither a number nor a text"),
        ('"75 mm"', "[" * 5000 + "]" * 5000, "without end"),
        ('"75 mm"', "[" * 30 + "1" + "]" * 30, "at most 16 within each other"),
        ('"75 mm"', "1\n" + ".".join("a" * 100_000) + " = 1", "without end"),
        ("format = 1", f"format = {HUGE}", "format: found a number of 400 digits"),
        ("0.06551", "1e300", "tests.0..stable_amplitude: found 1e[+]300; wanted a number between"),
        ("0.06551", "inf", "not a finite number"),
        ('name = "1#"', f"name = {HUGE}", "rigs.0..name: found a number of 400 digits"),
    ],
    ids=range(17),
)
def test_numbers_out_of_all_bounds(room: Room, old: str, new: str, message: str) -> None:
    assert old in HEAVING
    began = time.process_time()
    with pytest.raises(InputError, match=message) as caught:
        room.load(HEAVING.replace(old, new, 1))
    assert time.process_time() - began < 10
    assert len(str(caught.value)) < 1_000


@pytest.mark.parametrize(
    ("time_factor", "factor", "message"),
    [
        (1.0, 1e300, "largest value"),
        (1.0, 1e308, "largest value"),
        (1.0, 1e-300, "largest value"),
        (1e300, 1.0, "largest value"),
        (1e-300, 1.0, "samples a second"),
    ],
)
def test_records_out_of_all_bounds(room: Room, time_factor: float, factor: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        room.record("r.csv", csv("time [s],displacement [m]", TIME * time_factor, DISPLACEMENT * factor))


def test_ten_thousand_tests_are_enough(room: Room) -> None:
    with pytest.raises(InputError, match="found 10,001 tables; wanted at most 10,000"):
        room.load(HEAVING + "[[sweeps]]\n" * 10_001)


def test_matlab_files_within_bounds_are_read(room: Room, tmp_path: Path) -> None:
    path = tmp_path / "deep.mat"
    savemat(path, {"y": {"a": {"b": {"c": DISPLACEMENT}}}}, do_compression=True)
    lines = (*ALONE[:2], 'variables = { displacement = "y.a.b.c" }')
    assert len(room.record("deep.mat", path.read_bytes(), *lines).response) == len(DISPLACEMENT)
    assert len(room.record("one.mat", mat5(nested(0) + matrix(6, 200, element(9, DISPLACEMENT.tobytes()), name=b"z")),
                           *ALONE[:2], 'variables = { displacement = "z" }').response) == 200  # fmt: skip


def double(content: bytes, *, flags: int = 6, kind: int = 9, dimensions: bytes = struct.pack("<ii", 200, 1)) -> bytes:
    parts = [element(6, struct.pack("<II", flags, 0)), element(5, dimensions), element(1, b"y"), element(kind, content)]
    return mat5(element(14, b"".join(parts)))


DATA = DISPLACEMENT.tobytes()
UNSOUND = {
    "a type that is not known": double(DATA, kind=0),
    "complex without its other part": double(DATA, flags=0x0806),
    "a class that is not known": double(DATA, flags=99),
    "no dimensions": double(DATA, dimensions=b""),
    "negative dimensions": double(DATA, dimensions=struct.pack("<ii", -200, -1)),
    "too many dimensions": double(DATA, dimensions=struct.pack("<40i", *[1] * 40)),
    "names of no length": mat5(matrix(2, 1, element(5, struct.pack("<i", 0)), element(1, b"ab"))),
    "a struct without its arrays": mat5(matrix(2, 3, element(5, struct.pack("<i", 1)), element(1, b"ab"))),
    "no variable": mat5(element(9, DATA)),
}


@pytest.mark.parametrize("fault", UNSOUND)
def test_unsound_matlab_files_never_reach_scipy(room: Room, monkeypatch: pytest.MonkeyPatch, fault: str) -> None:
    """It ends the whole process with several of them."""
    monkeypatch.setattr("scipy.io.loadmat", lambda *_, **__: pytest.fail("SciPy reads it"))
    with pytest.raises(InputError, match="found a file that cannot be read"):
        room.record("r.mat", UNSOUND[fault], *ALONE)


def test_the_sound_one_is_read(room: Room) -> None:
    assert len(room.record("r.mat", double(DATA), *ALONE).response) == 200


def test_sparse_matrices_are_refused(room: Room, tmp_path: Path) -> None:
    savemat(tmp_path / "s.mat", {"y": csc_matrix(np.eye(20))})
    for path in ("y", "y[:,1]"):
        lines = (*ALONE[:2], f'variables = {{ displacement = "{path}" }}')
        with pytest.raises(InputError, match="found a sparse matrix"):
            room.record("s.mat", (tmp_path / "s.mat").read_bytes(), *lines)


def test_a_tdms_channel_that_claims_more_than_the_file(room: Room) -> None:
    nptdms = pytest.importorskip("nptdms")
    stream = io.BytesIO()
    with nptdms.TdmsWriter(stream) as writer:
        writer.write_segment([nptdms.ChannelObject("g", "y", DISPLACEMENT)])
    whole = stream.getvalue()
    claimed = whole.replace(struct.pack("<Q", len(DISPLACEMENT)), struct.pack("<Q", SAMPLES), 1)
    claimed = claimed[:12] + struct.pack("<Q", 8 * SAMPLES) + claimed[20:]  # and a segment that is as long as that
    tracemalloc.start()
    assert len(room.record("r.tdms", claimed, *ALONE[:2], ALONE[2].replace('"y"', '"g/y"')).response) <= 200
    assert tracemalloc.get_traced_memory()[1] < 2.5e8
    tracemalloc.stop()
    with pytest.raises(InputError, match="200 values in a file of 10 bytes"):
        replace(open_tdms(whole, Path("r.tdms")), size=10).read(["y"])
