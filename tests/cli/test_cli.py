"""The command line as a user meets it: outputs, exit codes, bad input, interruption."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from scruton.cli import main
from scruton.report.figures import all_figures
from scruton.report.figures.griffin import griffin_plot
from scruton.report.figures.records import record_figures

CARD = """extends = "paper"
name = "quick"
[sampler]
walkers = 64
draws = 16
min_ess = {min_ess}
"""


@pytest.fixture
def campaign(small_campaign, tmp_path):
    """A copy that may be spoilt."""
    return shutil.copytree(small_campaign, tmp_path / "campaign")


def run(*arguments, capsys):
    code = main([str(one) for one in arguments])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_check_prints_rigs_tests_and_records(small_campaign, capsys):
    code, out, _ = run("check", small_campaign, capsys=capsys)
    assert code == 0
    for word in ("6#", "Sc 21.7", "decay.csv", "7.87", "0.65 +/- 0.04", "free-decay", "No warnings."):
        assert word in out


def test_check_shows_every_record_that_cannot_be_used(campaign, capsys):
    (campaign / "decay.csv").write_text("time [s],displacement [mm]\n0,1\n1,nan\n2,3\n3,1\n", encoding="utf-8")
    (campaign / "still.csv").unlink()
    code, out, _ = run("check", campaign, capsys=capsys)
    assert code == 2
    assert "2 records cannot be used" in out
    assert "growth.csv" in out


def test_predict_table_and_json(small_results, capsys):
    code, out, _ = run("predict", small_results, "--sc", 30, "--sc", 21.7, "--damping", "0.01 +/- 0.002", capsys=capsys)
    assert code == 0
    assert len(out.splitlines()) >= 5
    code, out, _ = run("predict", small_results, "--sc", 30, "--json", capsys=capsys)
    entry = json.loads(out)["predictions"][0]
    assert code == 0
    assert entry["sc"] == 30
    amplitude = entry["amplitude"]
    assert amplitude["unit"] == "A/D"
    assert set(amplitude["interval"]) == {"0.50", "0.90", "0.95"}
    low, high = amplitude["interval"]["0.90"]
    assert low < amplitude["median"] < high
    assert amplitude["median"] == pytest.approx(0.0247, rel=0.05)
    assert entry["damping_ratio"] == pytest.approx(30 / 21.7 * 0.0065, rel=0.02)


def test_predict_with_another_law_is_another_prediction(small_results, capsys):
    medians = []
    for law in ("-1", "2"):
        _, out, _ = run("predict", small_results, "--sc", 60, "--law", law, "--json", capsys=capsys)
        entry = json.loads(out)["predictions"][0]
        assert entry["laws"] == {f"n={law}": 1.0}
        medians.append(entry["amplitude"]["median"])
    assert medians[1] < 0.8 * medians[0]


def test_predictions_say_how_the_laws_were_weighed(small_results, capsys):
    _, out, _ = run("predict", small_results, "--sc", 30, "--json", capsys=capsys)
    entry = json.loads(out)["predictions"][0]
    assert sum(entry["laws"].values()) == pytest.approx(1.0)
    assert 0.8 < entry["laws"]["n=-1"] < 0.9, "one rig: a fifth of the weight is shared out evenly"
    grown = 0.07 * (1.0 + abs(entry["extrapolation_index"])) ** 0.5
    assert entry["discrepancy_sd"] == pytest.approx(grown, rel=0.1), "one rig: the median of the prior, and distance"


def few_figures(fit, *_):
    """Figures are what takes the time."""
    return [griffin_plot(fit), *record_figures(fit)]


@pytest.mark.parametrize("drawn", [few_figures, pytest.param(all_figures, marks=pytest.mark.slow)])
def test_report_ends_with_the_paths(small_campaign, tmp_path, capsys, monkeypatch, drawn):
    monkeypatch.setattr("scruton.report.figures.all_figures", drawn)
    (tmp_path / "card.toml").write_text(CARD.format(min_ess=400), encoding="utf-8")
    code, out, _ = run(
        "report", small_campaign, "-o", tmp_path / "r", "--sc", 40, "--quiet", "--model", tmp_path / "card.toml",
        capsys=capsys,
    )  # fmt: skip
    assert code == 0
    *_, report, griffin = out.splitlines()
    assert report == str(tmp_path / "r" / "report.html")
    assert (tmp_path / "r" / "report.html").stat().st_size < 5e6
    assert griffin.startswith(str(tmp_path / "r"))
    page = (tmp_path / "r" / "report.html").read_text(encoding="utf-8")
    assert "漢字" in page
    assert "&lt;b&gt;with" in page
    assert "<b>with" not in page


def refused(code, out, err, *words):
    assert code == 2
    assert out == ""
    assert "Traceback" not in err
    assert err.count("\n") == 1, "one paragraph"
    for word in ("found", "wanted", *words):
        assert word in err, err


BAD_FILES = {
    "missing file": (None, ["decay.csv"]),
    "empty file": ("", ["decay.csv", "empty"]),
    "header without units": ("time,displacement\n0,1\n1,2\n", ["decay.csv", "unit"]),
    "wrong unit": ("time [s],displacement [kg]\n0,1\n1,2\n", ["decay.csv", "kg"]),
    "text in a number column": ("time [s],displacement [mm]\n0,1\n1,abc\n2,3\n", ["decay.csv", "abc"]),
    "NaN": ("time [s],displacement [mm]\n0,1\n1,nan\n2,3\n", ["decay.csv", "NaN"]),
    "one sample": ("time [s],displacement [mm]\n0,1\n", ["decay.csv"]),
    "constant signal": (
        "time [s],displacement [mm]\n" + "".join(f"{i},2\n" for i in range(500)),
        ["decay.csv", "constant"],
    ),
    "non-monotonic time": ("time [s],displacement [mm]\n0,1\n2,2\n1,3\n3,1\n4,2\n5,3\n6,1\n", ["decay.csv", "time"]),
}


@pytest.mark.parametrize("fault", BAD_FILES)
def test_bad_records(campaign, tmp_path, capsys, fault):
    text, words = BAD_FILES[fault]
    (campaign / "decay.csv").unlink()
    if text is not None:
        (campaign / "decay.csv").write_text(text, encoding="utf-8")
    refused(*run("fit", campaign, "-o", tmp_path / "o", capsys=capsys), *words)
    assert not (tmp_path / "o").exists(), "nothing half-written"


BAD_TOML = {
    "negative mass": ('mean = "7.292 kg/m"', 'mean = "-7.292 kg/m"', ["mass"]),
    "zero density": ('"1.22 kg/m^3"', '"0 kg/m^3"', ["air_density"]),
    "damping above 1": ("mean = 0.0065", "mean = 1.3", ["damping_ratio"]),
    "unknown motion": ('"heaving"', '"swaying"', ["motion", "swaying"]),
    "unknown key": ("air_density", "air_densty", ["air_densty", "air_density"]),
    "no unit": ('"7.87 Hz"', "7.87", ["frequency", "Hz"]),
    "broken TOML": ("[section]", "[section", ["TOML"]),
}


@pytest.mark.parametrize("fault", BAD_TOML)
def test_bad_campaigns(campaign, tmp_path, capsys, fault):
    old, new, words = BAD_TOML[fault]
    text = (campaign / "campaign.toml").read_text(encoding="utf-8")
    assert old in text
    (campaign / "campaign.toml").write_text(text.replace(old, new, 1), encoding="utf-8")
    refused(*run("fit", campaign, "-o", tmp_path / "o", capsys=capsys), "campaign.toml", *words)
    assert not (tmp_path / "o").exists()


def test_a_record_that_never_oscillates(campaign, tmp_path, capsys):
    noise = np.random.default_rng(0).normal(size=900)
    lines = ["time [s],displacement [mm]", *(f"{i / 100},{y:.5f}" for i, y in enumerate(noise))]
    (campaign / "decay.csv").write_text("\n".join(lines), encoding="utf-8")
    strictly = run("fit", campaign, "-o", tmp_path / "o", "--strict", capsys=capsys)
    refused(*strictly, "decay.csv", "tests[0].records[0]")
    (tmp_path / "card.toml").write_text(CARD.format(min_ess=100), encoding="utf-8")
    code, _, said = run("fit", campaign, "-o", tmp_path / "o", "--model", tmp_path / "card.toml", capsys=capsys)
    assert code in (0, 1)
    assert "decay.csv" in said
    assert "set aside" in said


def test_other_bad_arguments(small_campaign, small_results, tmp_path, capsys):
    refused(*run("fit", tmp_path / "nowhere", "-o", tmp_path / "o", capsys=capsys), "nowhere")
    refused(*run("fit", small_campaign, "-o", small_results, capsys=capsys), "earlier run", "--force")
    refused(*run("fit", small_campaign, "-o", tmp_path / "o", "--model", "nothing", capsys=capsys), "model card")
    refused(*run("fit", small_campaign, "-o", tmp_path / "o", "--tests", "Sc 22", capsys=capsys), "Sc 22", "Sc 21.7")
    refused(*run("fit", small_campaign, "-o", tmp_path / "o", "--seed", "-1", capsys=capsys), "--seed")
    refused(*run("predict", small_results, capsys=capsys), "--sc")
    refused(*run("report", small_campaign, "-o", tmp_path / "o", "--sc", "nan", capsys=capsys), "--sc", "nan")
    refused(*run("predict", small_results, "--sc", "15/40", capsys=capsys), "15/40", "--sc 15,40")
    other = run("fit", small_campaign, "-o", small_results, "--resume", "--seed", 5, capsys=capsys)
    refused(*other, "--resume", "other seed")
    refused(*run("predict", small_results, "--sc", 30, "--rig", "7#", capsys=capsys), "7#", "6#")
    refused(*run("predict", tmp_path, "--sc", 30, capsys=capsys), "posterior.nc")
    refused(*run("predict", small_results, "--damping", "much", capsys=capsys), "--damping", "much")
    refused(*run("simulate", tmp_path / "no.toml", "-o", tmp_path / "o", capsys=capsys), "no.toml")
    assert not (tmp_path / "o").exists()


@pytest.mark.thorough
def test_killed_and_resumed_is_bit_for_bit_the_uninterrupted_run(small_campaign, tmp_path, capsys):
    card = tmp_path / "card.toml"
    card.write_text(CARD.format(min_ess=400), encoding="utf-8")

    def arguments(out):
        return ["fit", str(small_campaign), "-o", str(out), "--model", str(card), "--quiet"]

    assert main(arguments(tmp_path / "whole")) == 0
    out = tmp_path / "killed"  # of two processes, on which results do not depend
    process = subprocess.Popen(
        [sys.executable, "-m", "scruton", *arguments(out), "--jobs", "2"], stdout=subprocess.DEVNULL
    )
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and len(list((out / ".scruton/fit/checkpoints").glob("*.npz"))) < 3:
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert not (out / "posterior.nc").exists(), "it was killed before the end"
    assert len(list((out / ".scruton/fit/checkpoints").glob("*.npz"))) >= 2
    capsys.readouterr()
    assert main(arguments(out)) == 2
    assert "--resume" in capsys.readouterr().err
    assert main([*arguments(out), "--resume"]) == 0
    for name in ("posterior.nc", "fit.json"):
        assert (out / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    assert not (out / ".scruton/fit/checkpoints").exists()


def test_numbers_with_commas_between_them_are_as_good_as_a_repeated_option(small_results, capsys):
    code, once, _ = run("predict", small_results, "--sc", "15,40", "--json", capsys=capsys)
    assert code == 0
    assert run("predict", small_results, "--sc", 15, "--sc", 40, "--json", capsys=capsys)[1] == once
    assert [one["sc"] for one in json.loads(once)["predictions"]] == [15.0, 40.0]
