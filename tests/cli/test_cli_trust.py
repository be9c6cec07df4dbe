"""Nothing is lost, nothing is mixed up: what a user may do to a folder of results, and what the commands say of it."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import psutil
import pytest

from scruton.cli import main
from scruton.documents import write_document
from scruton.workspace import digest

CARD = """extends = "paper"
name = "quick"
[sampler]
walkers = 64
draws = 16
min_ess = 400
"""
STATE = ".scruton/fit/checkpoints"


@pytest.fixture
def campaign(small_campaign, tmp_path):
    return shutil.copytree(small_campaign, tmp_path / "campaign")


@pytest.fixture
def results(quick_results, tmp_path):
    return shutil.copytree(quick_results, tmp_path / "results")


@pytest.fixture
def card(tmp_path):
    (tmp_path / "card.toml").write_text(CARD, encoding="utf-8")
    return tmp_path / "card.toml"


def refused(*arguments, capsys, words):
    assert main([str(one) for one in arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    for word in ("found", "wanted", *words):
        assert word in err, err
    return err


def contents(folder):
    return {path.relative_to(folder): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def spoil(campaign):
    """Make one record noise."""
    noise = np.random.default_rng(0).normal(size=900)
    lines = ["time [s],displacement [mm]", *(f"{i / 100},{y:.5f}" for i, y in enumerate(noise))]
    (campaign / "decay.csv").write_text("\n".join(lines), encoding="utf-8")


def test_a_bad_campaign_does_not_cost_the_good_results(campaign, results, capsys):
    (results / "figures").mkdir()
    (results / "figures" / "mine.png").write_bytes(b"of the user")
    before = contents(results)
    spoil(campaign)
    for more in (["--force", "--strict"], ["--force", "--strict", "--effect", "auto"]):
        refused("fit", campaign, "-o", results, *more, capsys=capsys, words=["decay.csv"])
        assert contents(results) == before
    refused("report", campaign, "-o", results, "--force", "--strict", capsys=capsys, words=["decay.csv"])
    assert contents(results) == before


def begun(*arguments, out, chunks=2):
    """Start a command, and wait until it has left some checkpoints."""
    process = subprocess.Popen(
        [sys.executable, "-m", "scruton", *map(str, arguments), "-o", str(out)],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and len(list((out / STATE).glob("*.npz"))) < chunks:
        time.sleep(0.02)
    return process


@pytest.mark.thorough
def test_a_campaign_that_was_edited_is_not_resumed(campaign, card, tmp_path, capsys):
    out = tmp_path / "out"
    arguments = ("fit", campaign, "--model", card)
    process = begun(*arguments, out=out)
    process.kill()
    process.wait()
    text = (campaign / "campaign.toml").read_text(encoding="utf-8")
    assert "7.87 Hz" in text
    (campaign / "campaign.toml").write_text(text.replace("7.87 Hz", "8.26 Hz"), encoding="utf-8")
    refused(*arguments, "-o", out, "--resume", capsys=capsys, words=["--resume", "a run with other campaign.toml;"])
    (campaign / "campaign.toml").write_text(text, encoding="utf-8")
    card.write_text(CARD.replace("400", "500"), encoding="utf-8")
    refused(*arguments, "-o", out, "--resume", capsys=capsys, words=["other model card quick"])
    card.write_text(CARD, encoding="utf-8")
    assert list((out / STATE).glob("*.npz")), "a refusal costs nothing"
    assert main([*map(str, arguments), "-o", str(out), "--resume", "--quiet"]) == 0


@pytest.mark.thorough
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_run_that_is_ended_in_good_order_goes_on(small_campaign, card, tmp_path, capsys, number, code):
    out = tmp_path / "out"
    arguments = ("report", small_campaign, "--model", card, "--no-gap")
    process = begun(*arguments, out=out)
    beside = psutil.Process(process.pid).children(recursive=True)
    process.send_signal(number)
    _, err = process.communicate(timeout=60)
    assert process.returncode == code
    assert "--resume goes on" in err
    assert "Traceback" not in err
    assert not psutil.wait_procs(beside, timeout=20)[1]
    assert not (out / "fit.json").exists()
    assert list((out / STATE).glob("*.npz"))


@pytest.mark.thorough
def test_a_report_that_is_killed_leaves_no_process(small_campaign, card, tmp_path):
    process = begun("report", small_campaign, "--model", card, out=tmp_path / "out")
    beside = psutil.Process(process.pid).children(recursive=True)
    assert beside, "a second process shares the work"
    os.kill(process.pid, signal.SIGKILL)
    process.communicate(timeout=60)
    assert not psutil.wait_procs(beside, timeout=20)[1]


def test_a_second_run_into_the_folder_is_told_of_the_first(small_campaign, card, tmp_path, capsys):
    out = tmp_path / "out"
    process = begun("fit", small_campaign, "--model", card, out=out)
    words = [f"process {process.pid}", "is at work in it"]
    for more in ([], ["--resume"], ["--force"]):
        refused("fit", small_campaign, "--model", card, "-o", out, *more, capsys=capsys, words=words)
    process.kill()
    process.communicate(timeout=60)


@pytest.mark.parametrize("place", [0.1, 0.3, 0.5, 0.7, 0.9])
def test_a_bit_that_flipped_is_found(results, capsys, place):
    for name in ("posterior.nc", "fit.json"):
        path = results / name
        good = path.read_bytes()
        data = bytearray(good)
        data[int(place * len(data))] ^= 1
        path.write_bytes(bytes(data))
        refused("predict", results, "--sc", 30, capsys=capsys, words=[name])
        refused("size", results, "--limit", "0.05", capsys=capsys, words=[name])
        refused("criticise", results, capsys=capsys, words=[name])
        path.write_bytes(good)


@pytest.mark.parametrize(
    ("content", "word"),
    [({}, "format"), ([], "list"), ({"format": 7}, "format"), ({"format": 1, "tests": 3}, "title")],
)
def test_a_summary_of_another_kind_is_refused(results, capsys, content, word):
    if isinstance(content, dict):
        write_document(results / "fit.json", content)
    else:
        (results / "fit.json").write_text(json.dumps(content), encoding="utf-8")
    refused("predict", results, "--sc", 30, capsys=capsys, words=["fit.json", word])


def test_files_of_two_fits_do_not_go_together(results, capsys):
    summary = json.loads((results / "fit.json").read_text(encoding="utf-8"))
    write_document(results / "fit.json", summary | {"files": {"posterior.nc": "0" * 64}})
    refused("predict", results, "--sc", 30, capsys=capsys, words=["posterior.nc", "of another fit"])


@pytest.mark.usefixtures("no_figures")
def test_what_is_computed_from_a_fit_names_it(results, capsys):
    assert main(["size", str(results), "--limit", "0.05", "--quiet"]) == 0
    sizing = json.loads((results / "sizing" / "sizing.json").read_text(encoding="utf-8"))
    assert sizing["provenance"]["fit_sha256"] == {name: digest(results / name) for name in ("fit.json", "posterior.nc")}


def test_a_simulation_does_not_write_over_a_measured_record(tmp_path, capsys):
    from tests.conftest import SPEC

    (tmp_path / "spec.toml").write_text(SPEC, encoding="utf-8")
    out = tmp_path / "tunnel"
    out.mkdir()
    (out / "decay.csv").write_text("measured", encoding="utf-8")
    refused("simulate", tmp_path / "spec.toml", "-o", out, capsys=capsys, words=["decay.csv", "--force"])
    assert contents(out).keys() == {(out / "decay.csv").relative_to(out)}
    assert (out / "decay.csv").read_text(encoding="utf-8") == "measured"
    assert main(["simulate", str(tmp_path / "spec.toml"), "-o", str(out), "--force"]) == 0
    assert (out / "decay.csv").read_text(encoding="utf-8") != "measured"
    assert (out / "decay.csv.~1~").read_text(encoding="utf-8") == "measured", "kept, though it was in the way"
