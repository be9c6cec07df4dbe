"""A decision can be rebuilt: every number of the bridge stands in sizing.json, stated or default, and its files do."""

from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import pytest

from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.documents import as_json, from_json
from scruton.sizing.bridge import load_bridge, with_damping
from scruton.sizing.existing import as_built
from scruton.sizing.inputs import COMPUTED, DEFAULT, STATED, Inputs, inputs_of
from scruton.sizing.limits import limit

BRIDGE = """
format = 1
width = "12 m"
depth = "3 m"
limits = ["jtg"]
[[modes]]
name = "V1"
frequency = "0.30 Hz"
mass = "20000 +/- 400 kg/m"
length = "400 m"
shape = "shape.csv"
damping_ratio = { median = 0.003 }
[damper]
risk = 0.02
[wind]
rose = "rose.csv"
"""
SHAPE = "x,phi\n0,0\n1,0.7\n2,1\n3,0.7\n4,0\n"


@pytest.fixture
def bridge(tmp_path: Path):
    (tmp_path / "bridge.toml").write_text(BRIDGE)
    (tmp_path / "shape.csv").write_text(SHAPE)
    (tmp_path / "rose.csv").write_text("speed,hours\n5,100\n10,50\n")
    return load_bridge(tmp_path, Motion.HEAVING)


def test_a_shape_goes_by_the_name_that_is_stated(bridge):
    assert bridge.modes[0].shape.name == "shape.csv"
    assert bridge.sha256["shape.csv"] == sha256(SHAPE.encode()).hexdigest()


def test_every_number_says_where_it_comes_from(bridge):
    rows = {row.name: row for row in inputs_of(bridge, ("jtg",)).numbers}
    for name in ("width", "modes[0].frequency.mean", "modes[0].mass.sd", "modes[0].damping_ratio.mean", "damper.risk"):
        assert rows[name].origin == STATED, name
    for name, source in {
        "air_density": "sea level",
        "modes[0].frequency.sd": "2 %",
        "modes[0].damping_ratio.sd": "45 %",
        "wind.share": "all of the time",
        "program.largest_added_damping": "more cannot be added",
        "program.one_rig_discrepancy": "settings of one body",
        "program.lock_in_margin": "peak test",
        "transfer.details.sd": "10 %",
        "damper.largest_stroke": "girder webs",
    }.items():
        assert rows[name].origin == DEFAULT, name
        assert source in rows[name].source, name
    for name, value in {"modes[0].modal_mass": 4e6, "modes[0].modal_mass_cov": 0.02}.items():
        assert rows[name].origin == COMPUTED
        assert rows[name].value == pytest.approx(value, rel=0.1)
        assert "mass" in rows[name].source
    assert (rows["modes[0].length"].value, rows["modes[0].length"].origin) == (400.0, STATED)
    assert (rows["modes[0].shape"].value, rows["wind.rose"].value) == ("shape.csv", "rose.csv")
    assert (rows["coherence.family"].value, rows["coherence.family"].origin) == ("known", DEFAULT)
    assert rows["modes[0].damping_ratio.sd"].value == pytest.approx(0.45 * rows["modes[0].damping_ratio.mean"].value)
    assert all(row.source for row in rows.values() if row.origin != STATED)


def test_a_limit_says_what_value_it_has_and_who_says_so(bridge):
    """The value of a rule that is named alone is the code's, and decides as much as one that is stated."""
    texts = ("jtg", "kd", "kd: acceptable", "iso2631: 0.4 m/s^2")
    bridge = replace(bridge, limits=tuple(map(limit, texts[:3])))
    rows = [row for row in inputs_of(bridge, texts).numbers if row.name.startswith("limits[")]
    assert [row.value for row in rows] == ["jtg: 1", "kd: 30 mm/s^2", *texts[2:]]
    assert [row.origin for row in rows] == [DEFAULT, DEFAULT, STATED, "command line"]
    assert [row.source.split(" (")[0] for row in rows[1:]] == [
        "K_D = f^2 y, an acceleration over 4 pi^2, by BD 49/01", "2 mm/s^2, by BD 49/01", "--limit iso2631: 0.4 m/s^2",
    ]  # fmt: skip
    assert rows[0].source.startswith("the partial factor gamma_v, a bare number, by JTG/T 3360-01-2018")
    assert [limit(row.value).value for row in rows] == [limit(text).value for text in texts], "as it can be read again"


def test_what_the_command_line_and_the_finished_bridge_say_is_marked_as_theirs(bridge):
    by_option = with_damping(bridge, Quantity(0.004, 0.001), "--damping 0.004 +/- 0.001")
    both = as_built(by_option, ["V1: 0.296 Hz, 0.0042"])
    rows = {row.name: row for row in inputs_of(both, ()).numbers}
    wanted = {
        "modes[0].frequency.mean": (0.296, "identified", "--identified V1: 0.296 Hz, 0.0042"),
        "modes[0].frequency.sd": (0.005 * 0.296, DEFAULT, "0.5 % once it is identified"),
        "modes[0].damping_ratio.mean": (0.0042, "identified", "--identified V1: 0.296 Hz, 0.0042"),
        "modes[0].damping_ratio.sd": (0.15 * 0.0042, DEFAULT, "15 %"),
        "modes[0].designed[0].mean": (0.30, STATED, ""),
        "modes[0].designed[0].sd": (0.006, DEFAULT, "2 %"),
        "modes[0].designed[1].mean": (0.004, "command line", "--damping 0.004 +/- 0.001"),
        "modes[0].designed[1].sd": (0.001, "command line", "--damping 0.004 +/- 0.001"),
    }
    for name, (value, origin, source) in wanted.items():
        assert rows[name].value == pytest.approx(value), name
        assert rows[name].origin == origin, name
        assert source in rows[name].source, name
    rows = {row.name: row for row in inputs_of(with_damping(bridge, Quantity(0.004), "--damping 0.004"), ()).numbers}
    assert rows["modes[0].damping_ratio.mean"].origin == "command line"
    assert rows["modes[0].damping_ratio.sd"].origin == DEFAULT
    assert "45 %" in rows["modes[0].damping_ratio.sd"].source


@pytest.mark.parametrize(("spread", "origin"), [("", DEFAULT), (" +/- 0.002", "identified")])
def test_what_a_bridge_s_file_says_was_identified_is_marked_as_that(tmp_path, spread, origin):
    said = BRIDGE.replace("[damper]", f'identified_frequency = "0.31{spread} Hz"\n[damper]')
    (tmp_path / "bridge.toml").write_text(said.replace('"shape.csv"', '"sine"').split("[wind]")[0])
    rows = {row.name: row for row in inputs_of(load_bridge(tmp_path, Motion.HEAVING), ()).numbers}
    assert (rows["modes[0].frequency.mean"].origin, rows["modes[0].frequency.mean"].value) == ("identified", 0.31)
    assert rows["modes[0].frequency.sd"].origin == origin
    assert (rows["modes[0].designed[0].mean"].value, rows["modes[0].designed[0].mean"].origin) == (0.30, STATED)
    assert rows["modes[0].damping_ratio.mean"].origin == STATED
    assert (rows["modes[0].half_waves"].value, rows["modes[0].half_waves"].source) == (1, "one")


def test_what_torsion_takes_by_default_is_told_too(tmp_path):
    said = BRIDGE.replace('mass = "20000 +/- 400 kg/m"', 'inertia = "4e5 kg*m^2/m"').replace('"shape.csv"', '"uniform"')
    (tmp_path / "bridge.toml").write_text(said.split("[wind]")[0])
    rows = {row.name: row for row in inputs_of(load_bridge(tmp_path, Motion.TORSIONAL), ()).numbers}
    assert (rows["damper.lever_arm"].value, rows["damper.lever_arm"].origin) == (6.0, DEFAULT)
    assert (rows["modes[0].inertia.mean"].value, rows["modes[0].inertia.mean"].origin) == (4e5, STATED)
    assert (rows["modes[0].modal_mass_cov"].value, rows["modes[0].modal_mass_cov"].origin) == (0.05, DEFAULT)
    assert rows["modes[0].shape"].origin == STATED


def test_the_bridge_comes_back_from_what_is_kept(bridge, tmp_path):
    kept = from_json(Inputs, as_json(inputs_of(bridge, ("jtg",))))
    again = tmp_path / "again"
    again.mkdir()
    for name, text in kept.documents.items():
        (again / name).write_text(text)
    rebuilt = load_bridge(again, Motion.HEAVING)
    assert rebuilt.sha256 == bridge.sha256
    assert inputs_of(rebuilt, ("jtg",)).numbers[1:] == kept.numbers[1:], "but for the title, which is the folder's"
