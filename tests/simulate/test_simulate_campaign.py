"""Synthetic campaigns on disk: the shipped example is what its specification makes; bad ones are named."""

from pathlib import Path

import numpy as np
import pytest

from scruton.campaign import Kind, Motion, load_campaign
from scruton.errors import InputError
from scruton.simulate import write_campaign
from scruton.workspace import Workspace, digest, read_manifest

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "rectangle-4to1"


def test_the_shipped_example_is_made_by_its_specification(tmp_path):
    write_campaign(EXAMPLE / "simulation.toml", tmp_path / "made", seed=4)
    made = sorted(path.name for path in (tmp_path / "made").iterdir() if path.name != ".scruton")
    beside = ("README.md", "simulation.toml", "bridge.toml")
    assert made == sorted(path.name for path in EXAMPLE.iterdir() if path.name not in beside)
    for name in made:
        assert (tmp_path / "made" / name).read_bytes() == (EXAMPLE / name).read_bytes(), name


def test_the_shipped_example_says_that_it_is_simulated():
    campaign = load_campaign(EXAMPLE)
    assert "SIMULATED" in campaign.source
    assert "simulated" in campaign.title
    assert [test.stable_amplitude.mean for test in campaign.tests] == [0.06551, 0.0292, 0.01106]


def changed(tmp_path, old, new):
    text = (EXAMPLE / "simulation.toml").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "spec.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[simulation]", "[simulaton]", "simulation: found None; wanted a table"),
        ("turbulence = 0.01", "turbulenc = 0.01", "simulation.turbulenc: found an unknown key"),
        ('sample_rate = "200 Hz"', 'sample_rate = "fast"', "simulation.sample_rate: found 'fast'"),
        ("truth = { Y1", "truth = { Y2", r"tests\[0\].truth"),
        ("truth = { Y1 = -", "truth = { Y1 = ", r"tests\[0\].records\[0\]: found a record that cannot be simulated"),
        ('duration = "60 s"', 'duration = "-60 s"', r"rigs\[0\].records\[0\].duration"),
        ('wind_speed = "5.7', 'wind_sped = "5.7', "wind_sped.*wind_speed"),
        ('file = "rig1_still_air_1.csv"', 'file = "../x.csv"', r"rigs\[0\].records\[0\].file.*a plain name"),
        ('file = "rig1_still_air_1.csv"', 'file = "campaign.toml"', r"rigs\[0\].records\[0\].file.*a plain name"),
        ('file = "rig1_still_air_1.csv"', 'file = "a\\u0000.csv"', r"rigs\[0\].records\[0\].file.*a plain name"),
        ('file = "rig1_still_air_1.csv"', 'file = ""', r"rigs\[0\].records\[0\].file.*a plain name"),
        ('duration = "60 s"', "duration = 1e14", r"rigs\[0\].records\[0\].duration: found 1.*at most 1e\+12"),
        ('duration = "60 s"', "duration = 1e12", r"rigs\[0\].records\[0\].duration: found 2e\+14 samples"),
        ('duration = "60 s"', "duration = 0.001", r"rigs\[0\].records\[0\].duration: found 0.2 samples"),
        ('duration = "60 s"', "duration = " + "9" * 400, "duration: found a number of 400 digits"),
        ("truth = { Y1 = -", "truth = { Y1 = -1e15, Y2 = -", r"tests\[0\].truth.Y1"),
        ("turbulence = 0.01", "turbulence = nan", "simulation.turbulence: found nan"),
        ('motion = "heaving"', "motion = 3", "section.motion"),
        ('name = "1#"', 'name = ["1#"]', r"rigs\[0\].name: found a list"),
    ],
)
def test_bad_specifications(tmp_path, old, new, message):
    with pytest.raises(InputError, match=message):
        write_campaign(changed(tmp_path, old, new), tmp_path / "out", seed=1)
    assert not (tmp_path / "out").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["spec.toml"], "nothing half-written"


@pytest.mark.parametrize("key", ["rigs", "tests"])
@pytest.mark.parametrize("value", ["3", '"1#"', "[3]", "[[]]", "{}", '[{ name = "a", records = 3 }]', "[{ name = 1 }]"])
def test_lists_of_another_type_are_named(tmp_path, key, value):
    (tmp_path / "spec.toml").write_text(
        f"format = 1\n{key} = {value}\n[simulation]\nsample_rate = 1\n", encoding="utf-8"
    )
    with pytest.raises(InputError, match=key):
        write_campaign(tmp_path / "spec.toml", tmp_path / "out", seed=1)
    assert [path.name for path in tmp_path.iterdir()] == ["spec.toml"]


def test_a_campaign_is_not_overwritten(tmp_path):
    spec = changed(tmp_path, "sensor_noise = 0.0001", "sensor_noise = 0")
    write_campaign(spec, tmp_path / "out", seed=1)
    with pytest.raises(InputError, match="--force"):
        write_campaign(spec, tmp_path / "out", seed=1)
    write_campaign(spec, tmp_path / "out", seed=2, force=True)
    run = read_manifest(tmp_path / "out")["runs"]["simulate"]
    assert run["settings"]["seed"] == 2
    assert run["inputs"] == {"spec.toml": digest(spec)}
    assert set(run["files"]) == {path.name for path in (tmp_path / "out").iterdir() if path.is_file()}


def test_two_simulations_do_not_write_into_one_folder(tmp_path):
    spec = changed(tmp_path, "sensor_noise = 0.0001", "sensor_noise = 0")
    with (
        Workspace(tmp_path / "out", "another", inputs={}, settings={}),
        pytest.raises(InputError, match="is at work in it"),
    ):
        write_campaign(spec, tmp_path / "out", seed=1)


def test_torsional(tmp_path):
    (tmp_path / "spec.toml").write_text(
        """
format = 1
title = "Deck, torsional"
source = "simulated"
[section]
motion = "torsional"
width = "1.08 m"
depth = "0.0908 m"
[simulation]
sample_rate = 60
[[rigs]]
name = "1#"
mass = "2.110 kg*m^2/m"
frequency = "3.162 Hz"
damping_ratio = 0.00096
true_damping_ratio = 0.0012
[[rigs.records]]
file = "still.csv"
kind = "free-decay"
initial_amplitude = 0.05
duration = 30
[[tests]]
name = "Sc 0.18"
rig = "1#"
air_density = "1.228 kg/m^3"
wind_speed = "3.4 m/s"
truth = { Y1 = -0.02, epsilon = 0.04 }
[[tests.records]]
file = "growth.csv"
kind = "growth"
initial_amplitude = 0.2
duration = 20
""",
        encoding="utf-8",
    )
    campaign = load_campaign(write_campaign(tmp_path / "spec.toml", tmp_path / "out", seed=1))
    assert campaign.section.motion is Motion.TORSIONAL
    record = campaign.tests[0].records[0]
    assert record.kind is Kind.GROWTH
    still = campaign.rigs[0].records[0]
    early, late = (np.abs(still.response[part]).max() for part in (slice(0, 60), slice(-60, None)))
    seconds = still.time[-1] - 0.5
    assert np.log(early / late) / (2 * np.pi * 3.162 * seconds) == pytest.approx(0.0012, rel=0.05)
