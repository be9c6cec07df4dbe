"""A decision can be rebuilt: every number of the bridge stands in sizing.json, stated or default, and its files do."""

from pathlib import Path

import pytest

from scruton.campaign.schema import Motion
from scruton.documents import as_json, from_json
from scruton.sizing.bridge import load_bridge
from scruton.sizing.inputs import DEFAULT, STATED, Inputs, inputs_of

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


def test_every_number_says_where_it_comes_from(bridge):
    rows = {row.name: row for row in inputs_of(bridge, ("jtg",)).numbers}
    for name in ("width", "modes[0].frequency.mean", "modes[0].mass.sd", "modes[0].damping_ratio.mean", "damper.risk"):
        assert rows[name].origin == STATED, name
    for name, source in {
        "air_density": "sea level",
        "modes[0].frequency.sd": "2 %",
        "modes[0].damping_ratio.sd": "45 %",
        "modes[0].modal_mass": "mass times length",
        "transfer.details.sd": "10 %",
        "damper.largest_stroke": "girder webs",
    }.items():
        assert rows[name].origin == DEFAULT, name
        assert source in rows[name].source, name
    assert rows["modes[0].damping_ratio.sd"].value == pytest.approx(0.45 * rows["modes[0].damping_ratio.mean"].value)
    assert all(row.source for row in rows.values() if row.origin == DEFAULT)


def test_the_bridge_comes_back_from_what_is_kept(bridge, tmp_path):
    kept = from_json(Inputs, as_json(inputs_of(bridge, ("jtg",))))
    again = tmp_path / "again"
    again.mkdir()
    for name, text in kept.documents.items():
        (again / name).write_text(text)
    rebuilt = load_bridge(again, Motion.HEAVING)
    assert rebuilt.sha256 == bridge.sha256
    assert inputs_of(rebuilt, ("jtg",)).numbers[1:] == kept.numbers[1:], "but for the title, which is the folder's"
