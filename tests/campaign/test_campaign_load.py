"""campaign.toml as a whole: what it says, and every way to get it wrong."""

import contextlib
import hashlib
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from campaign_room import DEPTH, DISPLACEMENT, HEAVING, TIME, TORSIONAL, Room, csv, record
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from scruton.campaign import Kind, Motion, Quantity, files, load_campaign
from scruton.errors import InputError


def test_everything_that_a_campaign_says_arrives_in_si(room: Room) -> None:
    toml = (
        HEAVING.replace('source = "made up"', 'source = "made up"')
        + record("decay.csv")
        + record("growth.csv", kind="growth")
    )
    toml = toml.replace("[[tests]]", record("still.csv", kind="free-decay", owner="rigs") + "[[tests]]", 1)
    files = {"decay.csv": csv(), "growth.csv": csv("time [s],displacement [mm]"), "still.csv": csv()}
    campaign = room.load(toml, files)
    assert campaign.path == room.folder / "campaign.toml"
    assert (campaign.title, campaign.source) == ("A rectangle", "made up")
    assert campaign.section.motion is Motion.HEAVING
    assert (campaign.section.width, campaign.section.depth) == (0.3, DEPTH)
    rig, test = campaign.rig("1#"), campaign.test("Sc 1.9")
    assert (rig.mass, rig.frequency) == (Quantity(7.089, 0.03), Quantity(7.97))
    assert rig.damping_ratio == Quantity(0.00058, 0.00003)
    assert [one.kind for one in rig.records] == [Kind.FREE_DECAY]
    assert (test.air_density, test.wind_speed) == (Quantity(1.19), Quantity(5.735))
    assert test.stable_amplitude == Quantity(0.06551)
    assert test.peak is None
    decay, growth = test.records
    assert (decay.name, decay.kind, decay.field) == ("decay.csv", Kind.DECAY, "tests[0].records[0]")
    np.testing.assert_array_equal(decay.time, TIME)
    np.testing.assert_allclose(decay.response, DISPLACEMENT / DEPTH, rtol=1e-12)
    np.testing.assert_allclose(growth.response, DISPLACEMENT / 1000 / DEPTH, rtol=1e-12)
    assert campaign.sha256 == {
        name: hashlib.sha256((room.folder / name).read_bytes()).hexdigest() for name in ("campaign.toml", *files)
    }


def test_a_campaign_goes_by_its_folder_or_its_file(room: Room) -> None:
    room.load(HEAVING)
    assert load_campaign(room.folder / "campaign.toml").title == load_campaign(room.folder).title


def test_byte_order_mark_and_windows_line_ends(room: Room) -> None:
    (room.folder / "campaign.toml").write_bytes(b"\xef\xbb\xbf" + HEAVING.replace("\n", "\r\n").encode())
    assert load_campaign(room.folder).title == "A rectangle"


def test_reduced_velocity_in_place_of_wind_speed(room: Room) -> None:
    test = room.load(TORSIONAL).tests[0]
    assert test.wind_speed.mean == pytest.approx(10.0 * 7.257 * 0.060)
    uncertain = TORSIONAL.replace("reduced_velocity = 10.0", "reduced_velocity = { mean = 10.0, sd = 0.1 }")
    assert room.load(uncertain).tests[0].wind_speed.sd == pytest.approx(0.1 * 7.257 * 0.060)


def test_torsional_records_are_in_radians(room: Room) -> None:
    toml = TORSIONAL + record("r.csv")
    found = room.load(toml, {"r.csv": csv("time [s],rotation [deg]")}).tests[0].records[0]
    np.testing.assert_allclose(found.response, np.radians(DISPLACEMENT), rtol=1e-12)
    with pytest.raises(InputError, match="rotation or amplitude: found no such column"):
        room.load(toml, {"r.csv": csv()})
    with pytest.raises(InputError, match="not that of an angle"):
        room.load(toml, {"r.csv": csv("time [s],rotation [m]")})


def test_a_campaign_of_still_air_only(room: Room) -> None:
    head, _, _ = HEAVING.partition("[[tests]]")
    head = head.replace('mass = "7.089 +/- 0.03 kg/m"\n', "").replace(
        "damping_ratio = { mean = 0.00058, sd = 0.00003 }", ""
    )
    campaign = room.load(head + record("r.csv", kind="free-decay", owner="rigs"), {"r.csv": csv()})
    assert campaign.tests == ()
    assert campaign.rigs[0].mass is None
    assert campaign.rigs[0].damping_ratio is None


CHANGES = [
    # what, by what, message
    ("format = 1", "format = 2", r"format: found 2; wanted format = 1"),
    ("format = 1", "", r"format: found nothing"),
    ("format = 1", "format = true", r"format: found true"),
    ("[section]", "[secton]", r'secton: found a key that is not known; wanted "section"'),
    ('motion = "heaving"', 'motion = "heavy"', r'section.motion: found "heavy"; wanted "heaving"'),
    ('motion = "heaving"', 'motion = "surging"', r'section.motion: found "surging"; wanted .*heaving, torsional'),
    ('motion = "heaving"', "", r"section.motion: found nothing; wanted one of: heaving, torsional"),
    ('depth = "75 mm"', "depth = 0.075", r'section.depth: found 0.075 without a unit; wanted .*depth = "0.075 m"'),
    ('depth = "75 mm"', 'depth = "0 mm"', r"section.depth: found \"0 mm\"; .*greater than zero"),
    ('depth = "75 mm"', 'depth = "75 +/- 1 mm"', r"section.depth: found a standard deviation"),
    ('depth = "75 mm"', 'height = "75 mm"', r"section.height: found a key that is not known; wanted"),
    ('frequency = "7.97 Hz"', "", r'rigs\[0\].frequency: found nothing; wanted .*frequency = "7.97 Hz"'),
    ('frequency = "7.97 Hz"', "frequency = 7.97", r'frequency = "7.97 Hz"'),
    ('mass = "7.089 +/- 0.03 kg/m"', 'mass = "-7 kg/m"', r"rigs\[0\].mass: .*greater than zero"),
    ('mass = "7.089 +/- 0.03 kg/m"', 'mas = "7 kg/m"', r'rigs\[0\].mas: .*wanted "mass"'),
    ('mass = "7.089 +/- 0.03 kg/m"', "", r'tests\[0\].rig: found "1#", which has no mass; wanted .*rig "1#"'),
    ('mass = "7.089 +/- 0.03 kg/m"', 'mass = "0.183 kg*m^2/m"', r"not that of a mass per unit length"),
    ("{ mean = 0.00058, sd = 0.00003 }", "1.2", r"damping_ratio: found 1.2; wanted a ratio below 1, not in percent"),
    ("{ mean = 0.00058, sd = 0.00003 }", "0.0", r"damping_ratio: .*greater than zero"),
    ("{ mean = 0.00058, sd = 0.00003 }", "-0.1", r"damping_ratio: .*greater than zero"),
    ("{ mean = 0.00058, sd = 0.00003 }", "nan", r"damping_ratio: .*not a finite number"),
    ("{ mean = 0.00058, sd = 0.00003 }", "true", r"damping_ratio: found true"),
    ("damping_ratio = { mean = 0.00058, sd = 0.00003 }", "", r"damping_ratio: found nothing, and no free-decay record"),
    ('name = "1#"', "name = 1", r"rigs\[0\].name: found 1; wanted a name"),
    ('name = "1#"', 'name = " "', r"rigs\[0\].name: found"),
    ('name = "1#"', "", r"rigs\[0\].name: found nothing"),
    ('rig = "1#"', 'rig = "1"', r'tests\[0\].rig: found "1"; wanted the name of a rig'),
    ('rig = "1#"', "", r"tests\[0\].rig: found nothing"),
    ('air_density = "1.19 kg/m^3"', 'air_density = "0 kg/m^3"', r"tests\[0\].air_density: .*greater than zero"),
    ('air_density = "1.19 kg/m^3"', "", r"tests\[0\].air_density: found nothing"),
    ('wind_speed = "5.735 m/s"', "", r"tests\[0\].wind_speed: found nothing"),
    ('wind_speed = "5.735 m/s"', 'wind_speed = "5.735 m"', r"tests\[0\].wind_speed: .*not that of a speed"),
    ("stable_amplitude = 0.06551", "reduced_velocity = 9.594", r"both wind_speed and reduced_velocity"),
    ("stable_amplitude = 0.06551", "stable_amplitude = -1", r"stable_amplitude: .*greater than zero"),
    ("stable_amplitude = 0.06551", 'peak = "yes"', r'tests\[0\].peak: found "yes"; wanted true or false'),
    (
        "stable_amplitude = 0.06551",
        "records = 3",
        r"records: found 3; wanted a list of tables, .*\[\[tests.records\]\]",
    ),
    ('title = "A rectangle"', "title = 3", r"title: found 3"),
    ("[[rigs]]", "[rigs]", r"rigs: found .*; wanted a list of tables, each under \[\[rigs\]\]"),
    ("[section]", "[[section]]", r"section: found a list; wanted one table, \[section\]"),
    ("[section]", "[section", r"not TOML.*line"),
    # slips that a parser of TOML has no words for
    ('"1.19 kg/m^3"', ".19", r"line 20: found .*Invalid value.*; wanted a digit before the point: 0\.19"),
    ('"1.19 kg/m^3"', "1.", r"line 20: .*wanted a digit after the point, or none: 1\.0"),
    ('"1.19 kg/m^3"', "1,19", r"line 20: .*wanted a point in place of the comma: 1\.19"),
    ('"1.19 kg/m^3"', "1.19 kg/m^3", r'line 20: .*wanted a quantity with its unit in quotes: "1\.19 kg/m\^3"'),
    ('"1.19 kg/m^3"', "\u201c1.19 kg/m^3\u201d", r'line 20: .*wanted straight quotes, "\.\.\."'),
    ('rig = "1#"', "rig = A", r'line 19: .*wanted a text in quotes: "A"'),
    ('rig = "1#"', 'rig = "1#"\nrig = "2#"', r"line 20: .*overwrite.*wanted rig once"),
    ('name = "Sc 1.9"', 'name = "Sc\\n1.9"', r"tests\[0\].name: found 'Sc\\n1.9'; wanted a name on one line"),
    ("[[tests]]", "[section]", r"line 17: .*twice.*wanted section once"),
]


@pytest.mark.parametrize(("old", "new", "message"), CHANGES, ids=[f"{i}" for i in range(len(CHANGES))])
def test_bad_campaigns_name_field_found_and_wanted(room: Room, old: str, new: str, message: str) -> None:
    assert old in HEAVING
    with pytest.raises(InputError, match=message) as caught:
        room.load(HEAVING.replace(old, new, 1))
    assert "campaign.toml" in caught.value.file
    assert "\n" not in str(caught.value).strip()


def test_names_are_unique(room: Room) -> None:
    head, _, test = HEAVING.partition("[[tests]]")
    with pytest.raises(InputError, match=r'tests\[1\].name: found "Sc 1.9", as in tests\[0\].name'):
        room.load(HEAVING + "[[tests]]" + test)
    rig = head[head.index("[[rigs]]") :]
    with pytest.raises(InputError, match=r'rigs\[1\].name: found "1#", as in rigs\[0\].name'):
        room.load(head + rig)


def test_one_peak_test_a_rig(room: Room) -> None:
    _, _, test = HEAVING.partition("[[tests]]")
    second = "[[tests]]" + test.replace("Sc 1.9", "other") + "peak = true\n"
    with pytest.raises(
        InputError, match=r'tests\[1\].peak: found true, as in test "Sc 1.9"|test "Sc 1.9" of the same rig'
    ):
        room.load(HEAVING + "peak = true\n" + second)
    assert room.load(HEAVING + second).tests[1].peak is True


@pytest.mark.parametrize(
    ("owner", "kind", "message"),
    [
        ("rigs", "decay", r'rigs\[0\].records\[0\].kind: found "decay" in still air, below a rig; wanted "free-decay"'),
        (
            "tests",
            "free-decay",
            r'tests\[0\].records\[0\].kind: found "free-decay" in wind, below a test; wanted "growth"',
        ),
        ("tests", "decai", r'kind: found "decai"; wanted "decay"'),
    ],
)
def test_kinds_stand_where_they_belong(room: Room, owner: str, kind: str, message: str) -> None:
    table = record("r.csv", kind=kind, owner=owner)
    head, tests = HEAVING.split("[[tests]]")
    toml = f"{head}{table}[[tests]]{tests}" if owner == "rigs" else HEAVING + table
    with pytest.raises(InputError, match=message):
        room.load(toml, {"r.csv": csv()})


def test_problems_are_collected_and_bad_records_left_out(room: Room) -> None:
    toml = HEAVING + record("a.csv") + record("good.csv") + record("c.csv") + '[[sweeps]]\nrig = "1#"\nfile = "s.csv"\n'
    problems: list[InputError] = []
    campaign = room.load(toml, {"a.csv": "", "good.csv": csv(), "c.csv": csv("time,displacement")}, problems)
    assert [one.name for one in campaign.tests[0].records] == ["good.csv"]
    assert [Path(one.file).name for one in problems] == ["a.csv", "c.csv", "campaign.toml"]
    assert "air_density" in str(problems[2])
    with pytest.raises(InputError, match="an empty file"):
        room.load(toml)


def test_records_of_one_file_have_names_of_their_own(room: Room) -> None:
    toml = (
        HEAVING
        + record("r.csv", 'stop = "0.9 s"')
        + record("r.csv", 'start = "1 s"')
        + record("x/q.csv")
        + record("q.csv")
    )
    campaign = room.load(toml, {"r.csv": csv(), "q.csv": csv(), "x/q.csv": csv()})
    assert [one.name for one in campaign.tests[0].records] == ["r.csv#1", "r.csv#2", "x/q.csv", "q.csv"]
    assert set(campaign.sha256 or {}) == {"campaign.toml", "r.csv", "x/q.csv", "q.csv"}


def test_the_same_samples_do_not_count_twice(room: Room) -> None:
    toml = HEAVING + record("r.csv") + record("./r.csv", kind="growth")
    with pytest.raises(InputError, match=r"tests\[0\].records\[1\]: found the same record as tests\[0\].records\[0\]"):
        room.load(toml, {"r.csv": csv()})


def test_files_are_read_and_hashed_once(room: Room, monkeypatch: pytest.MonkeyPatch) -> None:
    reads: list[str] = []
    plain = files.read_bytes
    monkeypatch.setattr(files, "read_bytes", lambda path, *more: reads.append(path.name) or plain(path, *more))
    toml = HEAVING + "".join(record("r.csv", f'start = "{i / 10} s"') for i in range(5))
    room.load(toml + record("r.csv", 'encoding = "ascii"'), {"r.csv": csv()})
    assert sorted(reads) == ["campaign.toml", "r.csv"]


def test_files_outside_the_folder(room: Room) -> None:
    outside = room.folder.parent / "elsewhere.csv"
    outside.write_text(csv())
    campaign = room.load(HEAVING + record("../elsewhere.csv") + record(str(outside), 'stop = "1 s"'))
    assert [one.name for one in campaign.tests[0].records] == ["elsewhere.csv#1", "elsewhere.csv#2"]
    assert "../elsewhere.csv" in (campaign.sha256 or {})


def test_files_that_are_not_there(room: Room) -> None:
    with pytest.raises(InputError, match=r'decay.csv: found no such file; wanted .*"decoy.csv" perhaps'):
        room.load(HEAVING + record("decay.csv"), {"decoy.csv": csv()})
    with pytest.raises(InputError, match=r"its folder .* is not there either"):
        room.load(HEAVING + record("no/decay.csv"))
    (room.folder / "folder.csv").mkdir()
    with pytest.raises(InputError, match="found a folder; wanted a file"):
        room.load(HEAVING + record("folder.csv"))
    with pytest.raises(InputError, match=r"records\[0\].file: found nothing"):
        room.load(HEAVING + '[[tests.records]]\nkind = "decay"\n')
    with pytest.raises(InputError, match=r"records\[0\].fil: found a key that is not known; wanted \"file\""):
        room.load(HEAVING + '[[tests.records]]\nfil = "decay.csv"\nkind = "decay"\n')


def test_campaigns_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"campaign.toml: found no such file; wanted a folder with a campaign.toml"):
        load_campaign(tmp_path)
    with pytest.raises(InputError, match="found no such file"):
        load_campaign(tmp_path / "nowhere")
    (tmp_path / "campaign.toml").write_bytes('title = "Brücke"'.encode("latin-1"))
    with pytest.raises(InputError, match="not UTF-8"):
        load_campaign(tmp_path)
    (tmp_path / "campaign.toml").write_bytes(b"")
    with pytest.raises(InputError, match="format: found nothing"):
        load_campaign(tmp_path)
    (tmp_path / "campaign.toml").unlink()
    (tmp_path / "campaign.toml").mkdir()
    with pytest.raises(InputError, match="found a folder"):
        load_campaign(tmp_path)


SWEEP = """
[[sweeps]]
rig = "1#"
air_density = "1.19 kg/m^3"
file = "sweep.csv"
"""


@pytest.mark.parametrize(
    ("header", "speed", "amplitude"),
    [
        ("wind speed [m/s],amplitude [mm]", 1.0, 1e-3 / DEPTH),
        ("wind speed [km/h],amplitude [m]", 1 / 3.6, 1 / DEPTH),
        ("reduced velocity,A/D", 7.97 * DEPTH, 1.0),
        ("Reduced velocity [-],amplitude [A/D]", 7.97 * DEPTH, 1.0),
    ],
)
def test_sweeps(room: Room, header: str, speed: float, amplitude: float) -> None:
    first, second = np.array([5.0, 5.5, 6.0]), np.array([0.01, 0.06, 0.0])
    (sweep,) = room.load(HEAVING + SWEEP, {"sweep.csv": csv(header, first, second)}).sweeps
    assert (sweep.rig, sweep.air_density) == ("1#", Quantity(1.19))
    np.testing.assert_allclose(sweep.wind_speed, first * speed, rtol=1e-12)
    np.testing.assert_allclose(sweep.amplitude, second * amplitude, rtol=1e-12)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("wind speed [m/s],amplitude\n5,1\n", "no unit"),
        ("wind speed [m/s],amplitude [kg]\n5,1\n", "not that of a length"),
        ("wind speed [m],amplitude [mm]\n5,1\n", "not that of a speed"),
        ("wind speed [m/s],amplitude [mm]\n5,-1\n", "line 2; wanted numbers of zero or more"),
        ("wind speed [m/s],amplitude [mm]\n5,\n", "no finite number.*line 2"),
        ("wind speed [m/s],amplitude [mm]\n", "a header and no numbers"),
        ("wind speed [m/s],reduced velocity,amplitude [mm]\n5,9,1\n", "both wind_speed and reduced_velocity"),
        ("time [s],displacement [mm]\n5,1\n", "wind_speed or reduced_velocity: found no such column"),
    ],
)
def test_bad_sweeps(room: Room, content: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        room.load(HEAVING + SWEEP, {"sweep.csv": content})


def test_sweep_of_a_rig_that_is_not_there(room: Room) -> None:
    with pytest.raises(InputError, match=r'sweeps\[0\].rig: found "2#"; wanted the name of a rig'):
        room.load(HEAVING + SWEEP.replace("1#", "2#"), {"sweep.csv": "wind speed [m/s],amplitude [mm]\n5,1\n"})


def test_import_stays_light() -> None:
    """Heavy packages are imported by what needs them, so that help and errors are quick."""
    heavy = ["pint", "pandas", "scipy", "h5py", "nptdms"]
    code = f"import sys, scruton.campaign; print([m for m in {heavy} if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


LINES = [line for line in (HEAVING + record("r.csv", 'start = "0 s"', 'units = { time = "s" }')).splitlines() if line]
VALUES = st.sampled_from(
    [
        *["0", "-1", "1e400", "nan", "inf", "true", '""', '"x"', "[]", "{}", "[[1]]", "1979-05-27"],
        *['"1 m"', '"-1 s"', "{ mean = 1 }", '{ mean = "1 m", sd = "x" }', '"±"', '"1 +/- 1 +/- 1 kg/m"'],
        *['"1 kg/m/"', '"\\u0000"'],
    ]
)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, len(LINES) - 1), VALUES, st.booleans())
def test_no_value_breaks_the_loader(room: Room, index: int, value: str, drop: bool) -> None:
    """Any one line of a good campaign dropped or given a strange value: it loads, or an InputError says why not."""
    lines = list(LINES)
    key, equals, _ = lines[index].partition(" = ")
    lines[index] = "" if drop else f"{key} = {value}" if equals else value
    with contextlib.suppress(InputError):
        room.load("\n".join(lines) + "\n", {"r.csv": csv()})


def test_an_inertia_goes_by_its_own_name_too(room: Room) -> None:
    line = next(one for one in TORSIONAL.splitlines() if one.startswith("mass"))
    own = TORSIONAL.replace(line, line.replace("mass", "inertia", 1))
    assert room.load(own).rigs[0].mass == room.load(TORSIONAL).rigs[0].mass
    with pytest.raises(InputError, match="inertia: found both mass and inertia; wanted one of the two"):
        room.load(TORSIONAL.replace(line, line + "\n" + line.replace("mass", "inertia", 1)))
    heaving = next(one for one in HEAVING.splitlines() if one.startswith("mass"))
    with pytest.raises(InputError, match="inertia: found the inertia of a heaving section; wanted its mass"):
        room.load(HEAVING.replace(heaving, heaving.replace("mass", "inertia", 1)))
