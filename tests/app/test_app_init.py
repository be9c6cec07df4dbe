"""`scruton init`: the campaigns of the examples and measured ones, found again from their files alone."""

import shutil
import tomllib
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchmarks.first_look import EXAMPLES, marks, score
from benchmarks.foreign import FOLDERS
from scruton.app import init
from scruton.app.init.write import of_quantity
from scruton.campaign import load_campaign, units
from scruton.errors import InputError
from tests.terminals import at_a_terminal

MEASURED = ("bristol-heave", "cylinder-in-wind", "pendulum-air-drag", "pendulum-dry-friction", "ship-roll-decay",
            "ship-roll-speeds")  # fmt: skip


def run(folder: Path, *, force: bool = False, rate: str | None = None) -> str:
    init.run(Namespace(folder=folder, force=force, quiet=True, sample_rate=rate))
    return (folder / "campaign.toml").read_text(encoding="utf-8")


def ring_down(path: Path, *, rate: float = 100.0) -> None:
    """Write what a German LabVIEW exports: a block above, semicolons, decimal commas, units in the header."""
    t = np.arange(2000) / rate
    y = 5.0 * np.exp(-0.1 * t) * np.cos(2.0 * np.pi * 4.0 * t)
    rows = [f"{a:.4f};{b:.5f}".replace(".", ",") for a, b in zip(t, y, strict=True)]
    path.write_text("\n".join(["LabVIEW Measurement", "Datum;2026", "", "Zeit [s];Weg [mm]", *rows]), "latin-1")


def filled(text: str) -> str:
    """Do what a user does: take away the # of every line that is marked."""
    return "\n".join(line.removeprefix("# ") if "FILL IN" in line else line for line in text.splitlines())


@pytest.mark.parametrize("name", sorted(path.parent.name for path in EXAMPLES.glob("*/campaign.toml")))
def test_nine_of_ten_records_of_an_example_are_found(name: str) -> None:
    found = score(EXAMPLES / name)
    assert found.right >= 0.9 * found.records, found.wrong
    assert found.beside == 0


@pytest.mark.real
def test_nine_of_ten_measured_records_are_found(shared_data: Callable[[str], Path]) -> None:
    scores = [score(shared_data(name)) for name in MEASURED]
    assert sum(one.right for one in scores) >= 0.9 * sum(one.records for one in scores)


def test_an_export_with_a_block_above_is_described_and_loads(tmp_path: Path) -> None:
    ring_down(tmp_path / "rig1_still_air.csv")
    text = run(tmp_path)
    (record,) = tomllib.loads(text)["rigs"][0]["records"]
    assert (record["kind"], record["skip_rows"], record["decimal"]) == ("free-decay", 3, ",")
    assert text == run(tmp_path, force=True)
    with pytest.raises(InputError, match="marked FILL IN"):
        load_campaign(tmp_path)
    (tmp_path / "campaign.toml").write_text(filled(text), encoding="utf-8")
    assert load_campaign(tmp_path).rigs[0].frequency.mean == pytest.approx(4.0, rel=0.01)


def test_a_whole_example_loads_once_its_lines_are_filled(tmp_path: Path) -> None:
    for path in (EXAMPLES / "pylon").glob("*.csv"):
        shutil.copyfile(path, tmp_path / path.name)
    text = run(tmp_path)
    (tmp_path / "campaign.toml").write_text(filled(text), encoding="utf-8")
    campaign = load_campaign(tmp_path)
    assert (len(campaign.rigs), len(campaign.tests)) == (5, 5)


def test_a_campaign_that_is_there_stays(tmp_path: Path) -> None:
    (tmp_path / "campaign.toml").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match="--force"):
        run(tmp_path)
    assert (tmp_path / "campaign.toml").read_text(encoding="utf-8") == "mine"


def test_a_folder_without_records_is_bad_input(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("nothing", encoding="utf-8")
    with pytest.raises(InputError, match="no record"):
        run(tmp_path)


def test_defaults_stand_for_what_records_and_tests_do_not_say(tmp_path: Path) -> None:
    t = np.arange(2000) / 100.0
    rows = "\n".join(f"{y:.6f}" for y in np.exp(-0.1 * t) * np.cos(8.0 * np.pi * t))
    (tmp_path / "a.csv").write_text(f"displacement\n{rows}\n", encoding="utf-8")
    (tmp_path / "b.csv").write_text(f"displacement\n{rows}\n", encoding="utf-8")
    (tmp_path / "campaign.toml").write_text(
        'format = 1\n[section]\nmotion = "heaving"\nwidth = "1 m"\ndepth = "1 m"\n'
        '[defaults.records]\nsample_rate = "100 Hz"\nunits = { displacement = "mm" }\n'
        '[defaults.tests]\nair_density = "1.2 kg/m^3"\nwind_speed = "3 m/s"\n'
        '[[rigs]]\nname = "r"\nmass = "1 kg/m"\nfrequency = "4 Hz"\n'
        'records = [{ file = "a.csv", kind = "free-decay" }]\n'
        '[[tests]]\nname = "t"\nrig = "r"\nreduced_velocity = 2\n'
        'records = [{ file = "b.csv", kind = "decay", sample_rate = "50 Hz" }]\n',
        encoding="utf-8",
    )
    campaign = load_campaign(tmp_path)
    assert campaign.tests[0].wind_speed.mean == pytest.approx(8.0)  # its own wind, not the default's
    assert campaign.tests[0].air_density.mean == pytest.approx(1.2)
    assert campaign.rigs[0].records[0].time[1] == pytest.approx(0.01)
    assert campaign.tests[0].records[0].time[1] == pytest.approx(0.02)


@pytest.mark.parametrize("name", FOLDERS)
def test_records_of_other_programs_are_found(name: str, tmp_path: Path) -> None:
    """Channel, kind and unit of every record; LabVIEW's TDMS, SciPy's and h5py's files are of their own writers."""
    FOLDERS[name](tmp_path)
    wanted = list(marks(tmp_path, tomllib.loads((tmp_path / "campaign.toml").read_text(encoding="utf-8"))))
    stated = tomllib.loads((tmp_path / "campaign.toml").read_text(encoding="utf-8"))
    rate = stated.get("defaults", {}).get("records", {}).get("sample_rate")
    found = list(marks(tmp_path, tomllib.loads(run(tmp_path, force=True, rate=rate))))
    assert sorted(one[:4] for one in found) == sorted(one[:4] for one in wanted)


def test_nine_of_ten_windows_of_other_programs_are_found(tmp_path: Path) -> None:
    right = records = 0
    for name, write in FOLDERS.items():
        folder = tmp_path / name
        folder.mkdir()
        write(folder)
        found = score(folder)
        right, records = right + found.right, records + found.records
    assert records == 40
    assert right >= 0.9 * records


def test_a_measured_wind_is_stated(tmp_path: Path) -> None:
    FOLDERS["german-logger"](tmp_path)
    made = tomllib.loads(run(tmp_path, force=True))
    assert {one["wind_speed"] for one in made["tests"]} == {"4.4 m/s"}


def test_rigs_of_tests_are_told_by_damping_only_where_there_is_no_doubt(tmp_path: Path) -> None:
    told = {}
    for name in ("pylon", "double-girder-torsional"):
        (tmp_path / name).mkdir()
        for path in (EXAMPLES / name).glob("*.csv"):
            shutil.copyfile(path, tmp_path / name / path.name)
        told[name] = [one.get("rig") for one in tomllib.loads(run(tmp_path / name))["tests"]]
    assert told["pylon"] == ["rigA", "rigB", "rigC", "rigD", "rigE"]
    assert set(told["double-girder-torsional"]) == {None}, "Sc 0.18 and 0.20 are of rigs of other inertia"


def test_at_a_terminal_it_asks_again_and_leaves_what_is_not_answered(tmp_path: Path) -> None:
    folder = tmp_path / "deck"
    folder.mkdir()
    for path in (EXAMPLES / "closed-box-torsional").glob("*.csv"):
        shutil.copyfile(path, folder / path.name)
    masses = "0.18 kg*m^2/m, 0.19 kg*m^2/m, 0.20 kg*m^2/m"
    quoted = ", ".join(f'"{one}"' for one in masses.split(", "))
    answers = ["0,3 m", "450", "-3 m", '"0.3 m"', "", "0.18 kg*m^2/m, 0.19 kg*m^2/m", quoted, "1.2 m", "1.2 kg/m^3"]
    answers += ["'5 m/s'"]
    answers += ["rig9", "rig1,rig2,rig3"]
    code, seen = at_a_terminal(["init", "deck"], answers, tmp_path)
    assert code == 0
    assert "a decimal comma" in seen
    assert "2 values; wanted one, or 3" in seen
    assert "answer: width of the section along the wind, B: found" in seen
    assert 'found "450" (no unit); wanted a length, such as 0.075 m.' in seen, "what is to be typed"
    assert 'found "-3 m"; wanted a length, such as 0.075 m, greater than zero.' in seen
    assert 'found no rig "rig9"; wanted "rig' in seen
    made = tomllib.loads((folder / "campaign.toml").read_text(encoding="utf-8"))
    assert made["section"] == {"motion": "torsional", "width": "0.3 m"}
    assert [one["inertia"] for one in made["rigs"]] == masses.split(", ")
    assert {one["wind_speed"] for one in made["tests"]} == {"5 m/s"}
    assert [one["rig"] for one in made["tests"]] == ["rig1", "rig2", "rig3"]
    assert "FILL IN: depth" in (folder / "campaign.toml").read_text(encoding="utf-8")
    code, seen = at_a_terminal(["init", "deck", "--force", "--quiet"], [], tmp_path)
    assert (code, seen) == (0, "deck/campaign.toml\n"), "nobody is asked who wants quiet"


def test_at_a_terminal_it_asks_for_a_rate_that_no_file_tells(tmp_path: Path) -> None:
    t = np.arange(3000) / 100.0
    (tmp_path / "still.csv").write_text(
        "displacement [mm]\n" + "\n".join(f"{y:.6f}" for y in 5.0 * np.exp(-0.1 * t) * np.cos(8.0 * np.pi * t)), "utf-8"
    )
    code, seen = at_a_terminal(["init", "."], ["100 Hz", "0.3 m", "0.1 m"], tmp_path)
    assert (code, seen.count("(empty: later)")) == (0, 3)
    made = tomllib.loads((tmp_path / "campaign.toml").read_text(encoding="utf-8"))
    assert made["rigs"][0]["records"][0]["sample_rate"] == "100 Hz"
    assert made["rigs"][0]["frequency"].startswith("4")


def test_without_a_rate_no_frequency_is_made_up(tmp_path: Path) -> None:
    t = np.arange(3000) / 100.0
    rows = "\n".join(f"{y:.6f}" for y in 5.0 * np.exp(-0.1 * t) * np.cos(8.0 * np.pi * t))
    (tmp_path / "still.csv").write_text(f"displacement [mm]\n{rows}", "utf-8")
    text = run(tmp_path)
    assert "frequency" not in tomllib.loads(text)["rigs"][0]
    assert '# frequency = "40 Hz"  # FILL IN: the dominant line of its records is at 0.04 of the sample rate' in text
    assert '--force and --sample-rate "1000 Hz"' in text
    (tmp_path / "campaign.toml").write_text(filled(text), encoding="utf-8")
    (record,) = load_campaign(tmp_path).rigs[0].records
    assert record.time[1] == pytest.approx(0.001), "what both lines suggest goes together"
    assert tomllib.loads(run(tmp_path, force=True, rate="100 Hz"))["rigs"][0]["frequency"] == "4 Hz"


def decaying(
    path: Path, heading: str, columns: Callable[[np.ndarray], list[np.ndarray]], seconds: float = 60.0
) -> None:
    """Write a text of columns against time at 100 Hz."""
    t = np.arange(int(100.0 * seconds)) / 100.0
    rows = [",".join(f"{value:.6g}" for value in row) for row in zip(t, *columns(t), strict=True)]
    path.write_text("\n".join([heading, *rows]) + "\n", encoding="utf-8")


def ring(t: np.ndarray, frequency: float = 4.0, rate: float = 0.1) -> np.ndarray:
    return np.asarray(np.exp(-rate * t) * np.cos(2.0 * np.pi * frequency * t))


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("7.1 kg/m,7.2 kg/m", ["7.1 kg/m", "7.2 kg/m"]),
        ("7.1 kg/m, 7.2 kg/m", ["7.1 kg/m", "7.2 kg/m"]),
        ("7.1 kg/m;7.2 kg/m", ["7.1 kg/m", "7.2 kg/m"]),
        ("7.1 +/- 0.1 kg/m", ["7.1 +/- 0.1 kg/m"]),
        ("7,1 kg/m", None),
        ("7,1 kg/m; 7,2 kg/m", None),
    ],
)
def test_commas_need_no_blank_behind(said: str, meant: list[str] | None) -> None:
    question = of_quantity("mass", "mass per unit length", units.MASS, ("a", "b"))
    if meant is None:
        with pytest.raises(InputError, match=r"answer: mass per unit length: found .*decimal comma"):
            init._values(said, question)
    else:
        assert init._values(said, question) == meant


def test_a_channel_in_volts_is_marked_and_asked_for(tmp_path: Path) -> None:
    decaying(tmp_path / "still.csv", "time [s],laser [V]", lambda t: [ring(t)])
    text = run(tmp_path)
    assert '# scale = "0.18 m/V"  # FILL IN: calibration or sensitivity' in text
    (tmp_path / "campaign.toml").write_text(filled(text), encoding="utf-8")
    (record,) = load_campaign(tmp_path).rigs[0].records
    assert record.response.max() * 0.075 == pytest.approx(0.18, rel=0.02)
    answers = ["0.3 m", "0.075 m", "3 kg/m", "0.5 m/V"]
    code, seen = at_a_terminal(["init", ".", "--force"], answers, tmp_path)
    assert code == 0
    assert 'answer: calibration or sensitivity: found "3 kg/m" for V' in seen
    assert tomllib.loads((tmp_path / "campaign.toml").read_text())["rigs"][0]["records"][0]["scale"] == "0.5 m/V"


def test_an_accelerometer_in_volts_is_one(tmp_path: Path) -> None:
    decaying(tmp_path / "still.csv", "time [s],acc 3 [V]", lambda t: [ring(t)])
    text = run(tmp_path)
    assert '# scale = "100 mV/g"' in text
    assert 'acceleration = "acc 3"' in text


def test_a_folder_of_its_own_is_a_rig(tmp_path: Path) -> None:
    for rig in ("rig_A", "rig_B"):
        (tmp_path / rig / "raw").mkdir(parents=True)
        decaying(tmp_path / rig / "still.csv", "time [s],y [mm]", lambda t: [ring(t)])
        decaying(tmp_path / rig / "raw" / "growth U5.csv", "time [s],y [mm]", lambda t: [ring(t)[::-1]])
    shutil.copytree(tmp_path / "rig_B", tmp_path / "out")
    (tmp_path / "out" / ".scruton").mkdir()
    text = run(tmp_path)
    campaign = tomllib.loads(text)
    assert [rig["name"] for rig in campaign["rigs"]] == ["rig A", "rig B"]
    files = [[one["file"] for one in rig["records"]] for rig in campaign["rigs"]]
    assert files == [["rig_A/still.csv"], ["rig_B/still.csv"]]
    assert [(test["name"], test["rig"]) for test in campaign["tests"]] == [("rig A U5", "rig A"), ("rig B U5", "rig B")]
    assert campaign["tests"][1]["records"][0]["file"] == "rig_B/raw/growth U5.csv"
    assert "# out: results of scruton" in text


def test_folders_for_still_air_and_wind_tell_no_rig(tmp_path: Path) -> None:
    for name in ("still", "wind"):
        (tmp_path / name).mkdir()
    decaying(tmp_path / "still" / "1_free.csv", "time [s],y [mm]", lambda t: [ring(t)])
    decaying(tmp_path / "wind" / "1_growth.csv", "time [s],y [mm]", lambda t: [ring(t)[::-1]])
    campaign = tomllib.loads(run(tmp_path))
    assert [rig["name"] for rig in campaign["rigs"]] == ["1"]
    assert [(test["name"], test["rig"]) for test in campaign["tests"]] == [("1", "1")]


def test_a_channel_with_a_second_motion_is_not_preferred(tmp_path: Path) -> None:
    decaying(
        tmp_path / "still.csv", "time [s],laser 1 [mm],laser 2 [mm]",
        lambda t: [ring(t) + 0.8 * ring(t, 7.0), 0.9 * ring(t)],
    )  # fmt: skip
    text = run(tmp_path)
    (record,) = tomllib.loads(text)["rigs"][0]["records"]
    assert record["columns"]["displacement"] == "laser 2"
    assert "# other channels that move: laser 1" in text


def test_the_damping_of_a_rig_without_ring_downs_is_asked_for(tmp_path: Path) -> None:
    decaying(tmp_path / "growth.csv", "time [s],y [mm]", lambda t: [np.tanh(0.1 * t) * ring(t, rate=0.0)])
    answers = ["0.3 m", "0.1 m", "7 kg/m", "1.2 kg/m^3", "5 m/s", "0.005 +/- 0.001"]
    assert at_a_terminal(["init", "."], answers, tmp_path)[0] == 0
    campaign = load_campaign(tmp_path)
    assert campaign.rigs[0].damping_ratio is not None
    assert (campaign.rigs[0].damping_ratio.mean, campaign.rigs[0].damping_ratio.sd) == (0.005, 0.001)


def held(t: np.ndarray, until: float, decay: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    rng = np.random.default_rng(1)
    amplitude = np.where(t < until, 1.0, decay(np.maximum(t - until, 0.0)))
    return np.asarray(5.0 * amplitude * np.cos(8.0 * np.pi * t) + rng.normal(0.0, 0.02, len(t)))


@pytest.mark.parametrize(
    ("name", "decay", "kind"),
    [
        ("still", lambda t: np.exp(-0.05 * t), "free-decay"),
        ("wind_decay", lambda t: 0.4 + 0.6 * np.exp(-0.1 * t), "decay"),
    ],
)
def test_a_body_that_is_held_and_then_released_begins_at_its_release(tmp_path: Path, name: str, decay, kind) -> None:
    decaying(tmp_path / f"{name}.csv", "time [s],y [mm]", lambda t: [held(t, 60.0, decay)], 120)
    made = tomllib.loads(run(tmp_path))
    (record,) = [one for owner in (*made["rigs"], *made.get("tests", [])) for one in owner.get("records", [])]
    assert record["kind"] == kind
    assert float(record["start"].split()[0]) == pytest.approx(60.0, abs=3.0)


def test_clean_plucks_are_followed_down_to_their_rest(tmp_path: Path) -> None:
    """Their noise is 0.1 % of the first amplitude: at 9 % of it, where noisy ones end, 25 of their 60 dB are left."""
    pluck = lambda t: np.where(t < 5.0, 0.0, ring(np.maximum((t - 5.0) % 60.0, 0.0), rate=0.25))  # noqa: E731
    noise = np.random.default_rng(2).normal(0.0, 0.001, 18500)
    decaying(tmp_path / "still.csv", "time [s],y [mm]", lambda t: [5.0 * (pluck(t) + noise[: len(t)])], 185)
    records = tomllib.loads(run(tmp_path))["rigs"][0]["records"]
    assert len(records) == 3
    for record, released in zip(records, (5.0, 65.0, 125.0), strict=True):
        assert float(record["start"].split()[0]) == pytest.approx(released + 1.0, abs=1.0)
        assert 18.0 < float(record["stop"].split()[0]) - released < 30.0, "9 % are left after 10 s"


@pytest.mark.parametrize("level", [0.0, 0.3, 0.6, 0.66, 0.68])
def test_a_decay_that_was_never_held_is_not_shortened(tmp_path: Path, level: float) -> None:
    decay = lambda t: level + (1.0 - level) * np.exp(-0.1 * t)  # noqa: E731
    decaying(tmp_path / "wind_decay.csv", "time [s],y [mm]", lambda t: [held(t, 0.0, decay)], 100)
    made = tomllib.loads(run(tmp_path))
    (record,) = [one for owner in (*made["rigs"], *made.get("tests", [])) for one in owner.get("records", [])]
    assert "start" not in record
