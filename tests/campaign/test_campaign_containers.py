"""Records in MATLAB files (5 and 7.3), HDF5, NumPy archives and TDMS."""

import io
import re
import struct
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from campaign_room import DEPTH, DISPLACEMENT, HEAVING, TIME, Room, record
from scipy.io import savemat
from scipy.sparse import csc_matrix

from scruton.campaign import files, readers
from scruton.errors import InputError

OVER_D = DISPLACEMENT / DEPTH
BOTH = 'units = { time = "s", displacement = "m" }'
ALONE = ('units = { displacement = "m" }', 'sample_rate = "100 Hz"')


def variables(displacement: str, time: str = "") -> str:
    named = f'time = "{time}", ' if time else ""
    return f'variables = {{ {named}displacement = "{displacement}" }}'


def mat5(**content: Any) -> bytes:
    stream = io.BytesIO()
    savemat(stream, content)
    return stream.getvalue()


def struct_array(*rows: Any) -> np.ndarray:
    """Build a MATLAB struct array with fields y and t."""
    array = np.empty((1, len(rows)), dtype=[("y", object), ("t", object)])
    for i, row in enumerate(rows):
        array[0, i] = (row, TIME)
    return array


def mat73(content: dict[str, Any]) -> bytes:
    """Write what MATLAB 7.3 writes: arrays transposed, structs as groups, struct arrays as references."""
    stream = io.BytesIO()
    with h5py.File(stream, "w", userblock_size=512) as file:
        references = file.create_group("#refs#")

        def write(parent: h5py.Group, name: str, value: Any) -> h5py.Dataset | h5py.Group:
            if isinstance(value, dict):
                group = parent.create_group(name)
                group.attrs["MATLAB_class"] = np.bytes_("struct")
                for key, one in value.items():
                    write(group, key, one)
                return group
            if isinstance(value, list):  # struct array
                group = parent.create_group(name)
                group.attrs["MATLAB_class"] = np.bytes_("struct")
                for key in value[0]:
                    fields = [write(references, f"r{len(references)}", one[key]).ref for one in value]
                    data = group.create_dataset(key, (len(value), 1), dtype=h5py.ref_dtype)
                    data[:, 0] = fields
                return group
            data = parent.create_dataset(name, data=np.atleast_2d(value).T)
            data.attrs["MATLAB_class"] = np.bytes_("double")
            return data

        for name, value in content.items():
            write(file, name, value)
    data = bytearray(stream.getvalue())
    data[:19] = b"MATLAB 7.3 MAT-file"
    return bytes(data)


ROWS = [np.cos(TIME), DISPLACEMENT, np.sin(TIME)]
MATLAB_FILES = {
    "5": mat5(
        t=TIME,
        y=DISPLACEMENT[:, None],
        DATA=struct_array(*ROWS),
        S={"run": {"y": DISPLACEMENT, "t": TIME}},
        M=np.column_stack([TIME, DISPLACEMENT]),
        note="text",
        empty=np.empty((0, 0)),
        z=DISPLACEMENT + 1j,
    ),
    "7.3": mat73(
        {
            "t": TIME,
            "y": DISPLACEMENT[:, None],
            "DATA": [{"y": row, "t": TIME[:, None]} for row in ROWS],
            "S": {"run": {"y": DISPLACEMENT, "t": TIME}},
            "M": np.column_stack([TIME, DISPLACEMENT]),
        }
    ),
}


@pytest.mark.parametrize("version", MATLAB_FILES)
@pytest.mark.parametrize(
    ("y", "t"),
    [("y", "t"), ("DATA[1].y", "DATA[1].t"), ("S.run.y", "S.run.t"), ("S[0].run[0].y", "t"), ("M[:,1]", "M[:,0]")],
)
def test_matlab(room: Room, version: str, y: str, t: str) -> None:
    found = room.record("r.mat", MATLAB_FILES[version], variables(y, t), BOTH)
    np.testing.assert_array_equal(found.time, TIME)
    np.testing.assert_allclose(found.response, OVER_D, rtol=1e-14)
    found = room.record("r.mat", MATLAB_FILES[version], variables(y), *ALONE, 'start = "0.5 s"')
    np.testing.assert_allclose(found.response, OVER_D[50:], rtol=1e-14)


def test_one_index_counts_down_the_columns_as_in_matlab(room: Room) -> None:
    """DATA[1] is MATLAB's DATA(2), which in a 2 x 2 array stands below DATA(1)."""
    array = struct_array(*ROWS, DISPLACEMENT).reshape(2, 2)
    array[0, 1], array[1, 0] = array[1, 0].copy(), array[0, 1].copy()
    for path, row in (
        ("DATA[1].y", ROWS[1]),
        ("DATA[1,0].y", ROWS[1]),
        ("DATA[2].y", ROWS[2]),
        ("DATA[0,1].y", ROWS[2]),
    ):
        found = room.record("r.mat", mat5(DATA=array), variables(path), *ALONE)
        np.testing.assert_allclose(found.response, row / DEPTH, rtol=1e-14)


@pytest.mark.parametrize("version", MATLAB_FILES)
@pytest.mark.parametrize(
    ("y", "message"),
    [
        ("x", r"x: found no .*; wanted one of: .*DATA"),
        ("DATA[1].Y", r'found no (field )?"Y"; wanted "y"'),
        ("DATA[3].y", r"found an index outside the array of 3; wanted an index counted from 0"),
        ("DATA.y", r'found a struct array of 3 before .y; wanted an index before ".y": \[0\] to \[2\]'),
        ("DATA[1]", r"found a (group or )?struct with .*y"),
        ("S.run", r"found a (group or )?struct with .*y"),
        ("y.z", r"found no struct .*to take .*z"),
        ("M", r'found a matrix, 200 x 2; wanted one column, such as "M\[:,1\]"'),
        ("M[:,2]", r"found an index outside the array of 200 x 2"),
        ("DATA[one].y", r"found the index \[one\]; wanted whole numbers counted from 0"),
        ("DATA[1", r"found a path that cannot be followed"),
        ("[1].y", r"found a path that cannot be followed"),
        ("DATA[1]..y", r"found a path that cannot be followed"),
        ("y[3]", r"found 1 sample; wanted 5 or more"),
    ],
)
def test_bad_paths_into_matlab(room: Room, version: str, y: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        room.record("r.mat", MATLAB_FILES[version], variables(y), *ALONE)
    assert caught.value.file.endswith("r.mat")


@pytest.mark.parametrize(
    ("y", "message"),
    [("note", "found text"), ("z", "found complex numbers"), ("empty", "found 0 samples; wanted 5 or more")],
)
def test_matlab_variables_that_are_no_numbers(room: Room, y: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        room.record("r.mat", MATLAB_FILES["5"], variables(y), *ALONE)


def test_matlab_needs_units_and_lengths_that_agree(room: Room) -> None:
    with pytest.raises(InputError, match=r'column "y": found no unit; wanted .*units = { displacement = "..." }'):
        room.record("r.mat", MATLAB_FILES["5"], variables("y", "t"))
    with pytest.raises(InputError, match='found 100 values in "t" and 200 in "y"; wanted columns of one length'):
        room.record("r.mat", mat5(t=TIME[:100], y=DISPLACEMENT), variables("y", "t"), BOTH)
    broken = np.where(np.arange(200) == 7, np.nan, DISPLACEMENT)
    with pytest.raises(InputError, match=r"found 1 value that is no finite number .* sample 7 \(the first is 0\)"):
        room.record("r.mat", mat5(y=broken), variables("y"), *ALONE)
    with pytest.raises(InputError, match=r'skip_rows: found a key that does not go .*"variables"'):
        room.record("r.mat", MATLAB_FILES["5"], "skip_rows = 1")
    with pytest.raises(InputError, match=r"variables.displacement: found 1; wanted the path of a variable"):
        room.record("r.mat", MATLAB_FILES["5"], "variables = { displacement = 1 }")


def test_variables_may_go_by_their_own_names(room: Room) -> None:
    found = room.record("r.mat", mat5(time=TIME, displacement=DISPLACEMENT), BOTH)
    np.testing.assert_allclose(found.response, OVER_D, rtol=1e-14)


def opaque(name: str, kind: str) -> bytes:
    """Spell a MATLAB object as version 5 stores it: array class 17, then names, then a reference."""

    def element(type_: int, data: bytes) -> bytes:
        return struct.pack("<II", type_, len(data)) + data + b"\0" * (-len(data) % 8)

    reference = element(6, struct.pack("<II", 13, 0)) + element(5, struct.pack("<ii", 1, 1)) + element(1, b"")
    inner = element(14, reference + element(6, struct.pack("<I", 0)))
    names = b"".join(element(1, text.encode()) for text in (name, "MCOS", kind))
    return element(14, element(6, struct.pack("<II", 17, 0)) + names + inner)


@pytest.mark.parametrize("kind", ["table", "string", "datetime"])
def test_matlab_objects_ask_to_be_saved_anew(room: Room, kind: str) -> None:
    content = mat5(y=DISPLACEMENT) + opaque("T", kind)
    assert len(room.record("r.mat", content, variables("y"), *ALONE).time) == 200  # the rest of the file can be read
    for path in ("T", "T.y", "T[0].y"):
        with pytest.raises(InputError, match=r"found a MATLAB object .*; wanted numbers: in MATLAB put the columns"):
            room.record("r.mat", content, variables(path), *ALONE)


@pytest.mark.parametrize("kind", ["table", "string", "datetime"])
def test_matlab_objects_in_version_73(room: Room, kind: str) -> None:
    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        data = file.create_dataset("T", data=np.zeros((6, 1), dtype=np.uint32))
        data.attrs["MATLAB_class"] = np.bytes_(kind)
        data.attrs["MATLAB_object_decode"] = np.int32(3)
    with pytest.raises(InputError, match=f"found a MATLAB object of class {kind}; wanted numbers: in MATLAB"):
        room.record("r.mat", stream.getvalue(), variables("T"), *ALONE)


def test_text_and_empty_arrays_in_version_73(room: Room) -> None:
    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        text = file.create_dataset("note", data=np.zeros((6, 1), dtype=np.uint16))
        text.attrs["MATLAB_class"] = np.bytes_("char")
        empty = file.create_dataset("empty", data=np.array([0, 7], dtype=np.uint64))
        empty.attrs["MATLAB_class"] = np.bytes_("double")
        empty.attrs["MATLAB_empty"] = np.uint8(1)
    with pytest.raises(InputError, match="found text"):
        room.record("r.mat", stream.getvalue(), variables("note"), *ALONE)
    with pytest.raises(InputError, match="found 0 samples"):
        room.record("r.mat", stream.getvalue(), variables("empty"), *ALONE)


def test_hdf5(room: Room) -> None:
    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        file["run/t"], file["run/y"], file["M"] = TIME, DISPLACEMENT, np.column_stack([TIME, DISPLACEMENT])
        file["run/y"].attrs["units"] = "mm"
    found = room.record("r.h5", stream.getvalue(), variables("run/y", "run/t"), 'units = { time = "s" }')
    np.testing.assert_array_equal(found.time, TIME)
    np.testing.assert_allclose(found.response, OVER_D / 1000, rtol=1e-14)
    found = room.record("r.h5", stream.getvalue(), variables("M[:,1]", "run.t"), BOTH)
    np.testing.assert_allclose(found.response, OVER_D, rtol=1e-14)
    with pytest.raises(InputError, match='run/Y: found no "run/Y"'):
        room.record("r.h5", stream.getvalue(), variables("run/Y"), *ALONE)
    with pytest.raises(InputError, match="found a group or struct with t, y"):
        room.record("r.h5", stream.getvalue(), variables("run"), *ALONE)


def test_npz(room: Room) -> None:
    stream = io.BytesIO()
    matrix = np.column_stack([TIME, DISPLACEMENT])
    np.savez(stream, t=TIME, y=DISPLACEMENT.astype(np.float32), M=matrix, o=np.array([{}] * 9, dtype=object))
    content = stream.getvalue()
    found = room.record("r.npz", content, variables("y", "t"), BOTH)
    np.testing.assert_allclose(found.response, OVER_D, rtol=1e-6)
    assert found.response.dtype == np.float64
    np.testing.assert_allclose(room.record("r.npz", content, variables("M[:,1]", "M[:,0]"), BOTH).response, OVER_D)
    for path, message in [
        ("x", "no such array; wanted one of: t, y, M, o"),
        ("o", "an array of objects"),
        ("y.z", 'the field "z" of a plain array'),
        ("M", "a matrix, 200 x 2"),
    ]:
        with pytest.raises(InputError, match=message):
            room.record("r.npz", content, variables(path), *ALONE)


def tdms(*channels: tuple[str, str, np.ndarray, dict[str, Any]]) -> bytes:
    nptdms = pytest.importorskip("nptdms")
    stream = io.BytesIO()
    with nptdms.TdmsWriter(stream) as writer:
        writer.write_segment([nptdms.ChannelObject(*channel) for channel in channels])
    return stream.getvalue()


def test_tdms_with_a_clock_of_its_own(room: Room) -> None:
    clock = {"wf_increment": 0.01, "wf_start_offset": 2.0, "wf_samples": 200, "unit_string": "mm"}
    content = tdms(("laser", "heave", DISPLACEMENT, clock), ("laser", "idle", TIME, {}))
    for path in ("laser/heave", "heave"):
        found = room.record("r.tdms", content, variables(path))
        np.testing.assert_allclose(found.time, 2.0 + TIME, rtol=1e-14)
        np.testing.assert_allclose(found.response, OVER_D / 1000, rtol=1e-14)
    with pytest.raises(InputError, match="found 200 Hz, while the file's own time says 100 Hz"):
        room.record("r.tdms", content, variables("heave"), 'sample_rate = "200 Hz"')
    with pytest.raises(InputError, match='lasr/heave: found no such channel; wanted "laser/heave"'):
        room.record("r.tdms", content, variables("lasr/heave"))
    with pytest.raises(InputError, match="time: found no time column"):
        room.record("r.tdms", content, variables("idle"), 'units = { displacement = "mm" }')


def test_tdms_with_a_time_channel(room: Room) -> None:
    content = tdms(("g", "t", TIME, {}), ("g", "y", DISPLACEMENT, {}), ("h", "y", TIME, {}))
    np.testing.assert_array_equal(room.record("r.tdms", content, variables("g/y", "g/t"), BOTH).time, TIME)
    with pytest.raises(InputError, match="y: found 2 channels of this name"):
        room.record("r.tdms", content, variables("y", "g/t"), BOTH)


def test_tdms_without_its_package_says_what_to_install(room: Room, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "nptdms", None)
    with pytest.raises(InputError, match=r"no package that reads it; wanted nptdms: pip install 'scruton\[tdms\]'"):
        room.record("r.tdms", b"TDSm", variables("heave"))


@pytest.mark.parametrize("file", ["r.mat", "r.h5", "r.npz", "r.tdms"])
def test_damaged_containers(room: Room, file: str) -> None:
    whole = {"r.mat": MATLAB_FILES["5"], "r.h5": MATLAB_FILES["7.3"], "r.npz": b"PK\x03\x04", "r.tdms": b"TDSm"}[file]
    for content in (b"garbage" * 100, b"g", whole[: len(whole) // 2]):
        with pytest.raises(InputError, match=r"found a file that cannot be read \(.*\); wanted a") as caught:
            room.record(file, content, variables("y"), *ALONE)
        assert caught.value.file.endswith(file)
    with pytest.raises(InputError, match="found an empty file"):
        room.record(file, b"", variables("y"), *ALONE)


@pytest.mark.parametrize("version", MATLAB_FILES)
def test_one_file_with_many_records_is_opened_once(room: Room, version: str, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    plain = files.open_container
    monkeypatch.setattr(files, "open_container", lambda *given: opened.append("once") or plain(*given))
    toml = HEAVING + "".join(record("r.mat", variables(f"DATA[{i}].y"), *ALONE) for i in range(3))
    campaign = room.load(toml, {"r.mat": MATLAB_FILES[version]})
    assert opened == ["once"]
    assert [one.name for one in campaign.tests[0].records] == ["r.mat#1", "r.mat#2", "r.mat#3"]
    for one, row in zip(campaign.tests[0].records, ROWS, strict=True):
        np.testing.assert_allclose(one.response, row / DEPTH, rtol=1e-14)


@pytest.mark.parametrize("file", ["r.h5", "r.npz", "r.tdms"])
def test_no_flipped_bytes_break_a_reader(room: Room, file: str) -> None:
    """Damage anywhere: the record is read, or an InputError says why not."""
    stream = io.BytesIO()
    if file == "r.h5":
        with h5py.File(stream, "w") as target:
            target.create_dataset("y", data=DISPLACEMENT, chunks=(50,), compression="gzip", fletcher32=True)
    elif file == "r.npz":
        np.savez_compressed(stream, y=DISPLACEMENT)
    else:
        stream.write(tdms(("g", "y", DISPLACEMENT, {"wf_increment": 0.01})))
    rng, refused = np.random.default_rng(1), 0
    for _ in range(60):
        data = bytearray(stream.getvalue())
        for place in rng.integers(len(data), size=3):
            data[place] = rng.integers(256)
        problems: list[InputError] = []
        room.load(HEAVING + record(file, variables("y"), *ALONE), {file: bytes(data)}, problems)
        refused += len(problems)
    assert refused > 0


@pytest.mark.parametrize("fault", [KeyError("y"), ZeroDivisionError(), RecursionError("deep"), MemoryError()])
@pytest.mark.parametrize("moment", ["open", "read"])
def test_whatever_a_new_reader_raises_is_said_as_an_input_error(
    room: Room, fault: Exception, moment: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A reader is a function and a line in `READERS`; it need not catch anything."""

    class New(readers.Container):
        def column(self, name: str) -> readers.Column:
            raise fault

    def open_new(data: bytes, path: Path) -> readers.Container:
        if moment == "open":
            raise fault
        return New(path, ("y",))

    monkeypatch.setitem(readers.READERS, ".new", (open_new, "a new file"))
    wanted = "a new file" if moment == "open" else "a whole file"
    found = "takes more memory" if isinstance(fault, MemoryError) else "cannot be read"
    with pytest.raises(InputError, match=rf"r\.new: found a file that {found}.*wanted {wanted}"):
        room.record("r.new", b"anything", variables("y"), *ALONE)


def test_a_sparse_matrix_is_refused_without_a_warning(room: Room, recwarn: pytest.WarningsRecorder) -> None:
    content = mat5(y=csc_matrix(np.eye(3)))
    with pytest.raises(InputError, match="a sparse matrix"):
        room.record("r.mat", content, variables("y"), *ALONE)
    assert [str(one.message) for one in recwarn] == []


@pytest.mark.parametrize(("array", "wanted"), [("rows", "data[1,:]"), ("columns", "data[:,1]")])
def test_one_index_into_a_matrix_is_told_of_rows_and_columns(room, array, wanted):
    matrix = np.stack([TIME, DISPLACEMENT])
    stream = io.BytesIO()
    np.savez(stream, data=matrix if array == "rows" else matrix.T)
    lines = ['variables = { displacement = "data[1]" }', 'units = { displacement = "m" }', 'sample_rate = "100 Hz"']
    with pytest.raises(
        InputError,
        match=re.escape(f'one index into a matrix, {"2 x 200" if array == "rows" else "200 x 2"}; wanted "{wanted}"'),
    ):
        room.record("a.npz", stream.getvalue(), *lines)
