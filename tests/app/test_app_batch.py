"""Many campaigns at once: what one does not do to another, and that nobody can tell who computed what."""

import csv
import io
import json
import os
import re
import shutil
from argparse import Namespace
from pathlib import Path

import pytest
from distributed.client import _get_global_client as default_client

from scruton.app.batch import Batch, Job, _planned, _required, names, run_one, summarise
from scruton.app.batch_tables import batch_csv, batch_page, batch_text
from scruton.app.fit import FitTask
from scruton.cli import main, parser
from scruton.documents import write_document
from scruton.infer.fit import fit_campaign
from scruton.simulate import write_campaign
from scruton.workers import connected, finished
from tests.conftest import CARD, SPEC


@pytest.fixture(scope="module")
def room(small_campaign, tmp_path_factory):
    """A folder with a campaign in wind, one in still air, one that is broken, and a quick model card."""
    folder = tmp_path_factory.mktemp("room")
    (folder / "still.toml").write_text(SPEC[: SPEC.index("[[tests]]")], encoding="utf-8")
    write_campaign(folder / "still.toml", folder / "still", seed=1)
    for name in ("wind", "broken"):
        shutil.copytree(small_campaign, folder / name)
    (folder / "broken" / "decay.csv").write_text("nothing\n", encoding="utf-8")
    (folder / "card.toml").write_text(CARD, encoding="utf-8")
    return folder


def batch(*arguments):
    return main(["batch", *map(str, arguments)])


@pytest.fixture(scope="module")
def whole(room):
    """A batch under a scheduler whose one worker is this process: what the others are compared with."""
    from distributed import LocalCluster

    cluster = LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, protocol="tcp", host="127.0.0.1",
        dashboard_address="127.0.0.1:0", local_directory=room / "spill",
    )  # fmt: skip
    with cluster, pytest.MonkeyPatch.context() as patch:
        patch.chdir(room)
        code = batch(
            "wind", "broken", "still", "nowhere", "-o", "whole", "--model", "card.toml", "--sc", 40, "--quiet",
            "--scheduler", cluster.scheduler_address,
        )  # fmt: skip
        assert len(cluster.workers) == 1, "it goes on after the batch"
    assert code == 1, "two are bad input"
    return room / "whole"


def entries(folder: Path):
    return {one["name"]: one for one in json.loads((folder / "batch.json").read_text(encoding="utf-8"))["campaigns"]}


def test_a_broken_campaign_is_told_and_stops_nothing(whole):
    found = entries(whole)
    assert [one["state"] for one in found.values()] == ["done", "failed", "done", "failed"]
    assert re.match(r"broken/decay\.csv: .*found .*wanted", found["broken"]["reason"])
    assert found["nowhere"]["reason"].startswith("nowhere: found no such file")
    assert (found["wind"]["tests"], found["still"]["tests"], found["still"]["rigs"]) == (1, 0, 1)
    (peak,) = found["wind"]["peaks"]
    low, high = peak["a_star"]["interval"]["0.90"]
    assert low < peak["a_star"]["median"] < high
    assert peak["a_star"]["median"] == pytest.approx(0.0292, rel=0.05)
    (prediction,) = found["wind"]["predictions"]
    assert prediction["sc"] == 40
    assert found["still"]["predictions"] == []
    assert not (whole / "broken").exists()
    assert sorted(one.name for one in whole.parent.iterdir() if "dask" in one.name) == [], "no litter"


def test_the_files_are_those_of_fit(room, whole, monkeypatch):
    monkeypatch.chdir(room)
    assert main(["fit", "still", "-o", "alone", "--model", "card.toml", "--quiet"]) == 0
    for name in ("posterior.nc", "fit.json"):
        assert (room / "alone" / name).read_bytes() == (whole / "still" / name).read_bytes()


def test_tests_are_those_of_every_campaign(room, monkeypatch):
    monkeypatch.chdir(room)
    asked = parser().parse_args(["batch", "wind", "-o", "none", "--model", "card.toml", "--test", "none"])
    ((job,), _) = _planned(asked)
    entry = run_one(job)
    assert (entry["state"], entry["bad_input"]) == ("failed", True)
    assert 'no test "none"' in entry["reason"]


class StoppedError(Exception):
    pass


@pytest.mark.thorough
def test_an_interrupted_batch_goes_on_in_two_processes_to_the_same_bytes(room, whole, monkeypatch):
    monkeypatch.chdir(room)
    resumed = room / "resumed"
    shutil.copytree(whole / "still", resumed / "still")
    kept = (resumed / "still" / "posterior.nc").stat().st_mtime_ns
    told = []

    def stop(name, fraction):
        told.append(name)
        if len(set(told)) == 3:
            raise StoppedError

    asked = Namespace(
        campaign=Path("wind"), out=resumed / "wind", model="card.toml", tests=None, seed=0, effect=None, quiet=True,
        force=False,
    )  # fmt: skip
    task = FitTask.of(asked)
    with pytest.raises(StoppedError), task.claim(asked) as work:
        fit_campaign(task.campaign, task.card, checkpoints=work.checkpoints, report=stop)
    assert len(list(work.checkpoints.glob("*.npz"))) >= 2
    code = batch(
        "wind", "broken", "still", "nowhere", "-o", "resumed", "--model", "card.toml", "--sc", 40, "--jobs", 2,
        "--resume", "--quiet",
    )  # fmt: skip
    assert code == 1
    assert (resumed / "still" / "posterior.nc").stat().st_mtime_ns == kept, "what was finished is not run again"
    for name in ("wind/posterior.nc", "wind/fit.json", "batch.csv", "batch.json", "batch.html"):
        assert (resumed / name).read_bytes() == (whole / name).read_bytes(), name
    assert not work.checkpoints.exists()


@pytest.mark.slow
def test_one_process_writes_what_many_write(room, whole, monkeypatch):
    monkeypatch.chdir(room)
    assert batch("wind", "still", "-o", "one", "--model", "card.toml", "--jobs", 1, "--report", "--quiet") == 0
    assert batch("wind", "still", "-o", "two", "--model", "card.toml", "--jobs", 2, "--report", "--quiet") == 0
    for name in ("wind/posterior.nc", "wind/report.html", "still/report.html", "batch.json", "batch.html"):
        assert (room / "one" / name).read_bytes() == (room / "two" / name).read_bytes()
    assert (room / "one/wind/posterior.nc").read_bytes() == (whole / "wind/posterior.nc").read_bytes()
    assert entries(room / "one")["wind"]["report"] == "wind/report.html"


BRIDGE = """format = 1
title = "A bridge"
width = "12 m"
depth = "3 m"
air_density = "1.22 kg/m^3"
limits = ["0.05 m"]
[[modes]]
name = "V1"
frequency = "0.3 Hz"
mass = "20000 kg/m"
damping_ratio = 0.003
"""


def test_what_a_batch_says_a_bridge_needs_is_for_any_mode_where_it_asks_that(tmp_path):
    mode = {"governing": "jtg", "limits": [{"rule": "jtg", "required": {"0.95": 0.004}, "probability": 0.5}]}
    mode["damper"] = {"asked": {"risk_of": "any"}, "achievable": False}
    together = {"names": ["V1", "V2"], "required_for_any": {"required": [0.005, 0.006], "reach": [None, None]}}
    content = {"modes": [mode | {"name": "V1"}, mode | {"name": "V2"}], "all_modes": together}
    write_document(tmp_path / "sizing.json", content)
    assert [one["damping_ratio"] for one in _required(tmp_path)] == [0.005, 0.006]


@pytest.mark.thorough
def test_a_batch_sizes_a_bridge_and_counts_steps(room, monkeypatch, capsys):
    monkeypatch.chdir(room)
    (room / "bridge.toml").write_text(BRIDGE, encoding="utf-8")
    seen = []
    monkeypatch.setattr("scruton.progress.Bar.__call__", lambda _, *said: seen.append(said))
    code = batch("wind", "still", "-o", "sized", "--model", "card.toml", "--bridge", "bridge.toml", "--jobs", 1)
    text = capsys.readouterr().out
    assert code == 1, "still air says nothing of a bridge"
    assert seen[-1] == ("steps", 1.0, ", 4 of 4; campaigns, 2 of 2, 1 failed")
    assert ("steps", 0.25, ", 1 of 4; campaigns, 0 of 2") in seen, "what a worker tells within a campaign"
    found = entries(room / "sized")
    sizing = json.loads((room / "sized/wind/sizing.json").read_text(encoding="utf-8"))
    (mode,) = sizing["modes"]
    (needed,) = found["wind"]["required"]
    assert (needed["mode"], needed["damping_ratio"]) == ("V1", mode["limits"][0]["required"]["0.95"])
    assert "bridge.toml" in found["still"]["reason"]
    assert "needs" in text
    assert "Damping that the bridge needs" in (room / "sized/batch.html").read_text(encoding="utf-8")
    (row,) = [
        one for one in csv.DictReader((room / "sized/batch.csv").open(encoding="utf-8")) if one["campaign"] == "wind"
    ]
    assert float(row["required damping ratio at 0.95 confidence"]) == needed["damping_ratio"]
    kept = (room / "sized/wind/sizing.json").stat().st_mtime_ns
    of_the_bridge = {"name": "wind", "campaign": str(room / "wind"), "bridge": str(room / "bridge.toml")}
    again = run_one(job(room, room / "sized/wind", **of_the_bridge))
    assert (again["state"], (room / "sized/wind/sizing.json").stat().st_mtime_ns) == ("done", kept)
    (room / "bridge.toml").write_text(BRIDGE.replace("0.05 m", "0.06 m"), encoding="utf-8")
    assert batch("wind", "-o", "sized", "--model", "card.toml", "--bridge", "bridge.toml", "--resume", "--quiet") == 2


def test_a_worker_that_dies_takes_nothing_with_it():
    def work(task):  # no function of a module: the worker need not import the tests
        if task == 1:
            os._exit(3)
        if task == 2:
            raise ZeroDivisionError("by nought")
        return 10 * task

    with connected(None, 1, quiet=True) as client:
        found = dict(finished(client, work, range(4)))
    assert (found[0].value, found[3].value) == (0, 30)
    assert "died" in found[1].fault
    assert found[2].fault == "unexpected ZeroDivisionError: by nought"


def test_bad_arguments(room, whole, monkeypatch, capsys):
    monkeypatch.chdir(room)
    monkeypatch.setattr("scruton.workers.REACH", 1)

    def refused(arguments, *words):
        assert batch(*arguments) == 2
        captured = capsys.readouterr()
        assert captured.out == ""
        assert captured.err.count("\n") == 1
        for word in ("found", "wanted", *words):
            assert word in captured.err

    new = ("-o", "new", "--model", "card.toml")
    refused(["still", "./still/campaign.toml", *new], "still/campaign.toml", "again")
    refused(["still", *new, "--jobs", 0], "--jobs", "0")
    refused(["still", *new, "--seed", -1], "--seed", "-1")
    refused(["still", *new, "--sc", "inf"], "--sc")
    refused(["still", "-o", "new", "--model", "no-such-card"], "model card")
    refused(["still", *new, "--bridge", "none.toml"], "none.toml")
    refused(["still", *new, "--effect", "friction"], "--effect", "coulomb_friction")
    refused(["still", "-o", "card.toml"], "a file")
    refused(["still", *new, "--scheduler", "tcp://127.0.0.1:1"], "--scheduler", "tcp://127.0.0.1:1")
    refused(["still", *new, "--scheduler", "carrier-pigeon://loft"], "--scheduler", "carrier-pigeon")
    assert default_client() is None, "what writes a file would ask it for a lock"
    refused(["still", "-o", "whole", "--model", "card.toml"], "whole", "--resume", "--force")
    refused(["still", "-o", "whole", "--model", "card.toml", "--seed", 3, "--resume"], "other seed")
    assert not (room / "new").exists()
    shutil.copytree(whole / "still", room / "left/still")
    refused(["still", "-o", "left", "--model", "card.toml"], "left/still", "earlier run")
    assert [one.name for one in (room / "left").iterdir()] == ["still"]


def test_jobs_and_scheduler_exclude_each_other(capsys):
    with pytest.raises(SystemExit, match="2"):
        batch("one", "-o", "out", "--jobs", 2, "--scheduler", "tcp://127.0.0.1:1")
    assert "not allowed with" in capsys.readouterr().err


def job(room, folder, **changes):
    from scruton import __version__

    values = {
        "name": "still", "campaign": str(room / "still"), "folder": str(folder), "model": str(room / "card.toml"),
        "seed": 0, "design": (), "report": False, "quiet": True, "version": __version__,
    }  # fmt: skip
    return Job(**values | changes)


def test_results_of_another_run_are_not_taken_for_finished_ones(room, whole, tmp_path):
    folder = shutil.copytree(whole / "still", tmp_path / "still")
    assert run_one(job(room, folder))["state"] == "done"
    other = run_one(job(room, folder, seed=4))
    assert (other["state"], other["bad_input"]) == ("failed", True)
    assert "other seed" in other["reason"]
    assert "version of scruton" in run_one(job(room, folder, version="0.0.0"))["reason"]
    assert (folder / "fit.json").read_bytes() == (whole / "still/fit.json").read_bytes()


def test_a_bug_is_the_failure_of_one_campaign(room, tmp_path, monkeypatch):
    def fall(*_, **__):
        raise RuntimeError("a bug")

    monkeypatch.setattr(FitTask, "fit", fall)
    found = run_one(job(room, tmp_path / "new"))
    assert (found["state"], found["bad_input"], found["reason"]) == ("failed", False, "unexpected RuntimeError: a bug")


def test_what_did_not_converge_says_so(room, whole, tmp_path):
    folder = shutil.copytree(whole / "wind", tmp_path / "wind")
    summary = json.loads((folder / "fit.json").read_text(encoding="utf-8"))
    summary |= {"converged": False, "flags": ["rig 6#: R-hat of xi is 1.2", "another"]}
    write_document(folder / "fit.json", summary)
    found = summarise(job(room, folder))
    assert (found["state"], found["reason"]) == ("not converged", "rig 6#: R-hat of xi is 1.2")
    result = batch_of([found])
    assert not result.good
    assert not result.none_ran
    assert "R-hat of xi is 1.2" in batch_page(result)


def test_names():
    def named(*paths):
        return names([Path(one) for one in paths])

    assert named("/a/deck", "/tower/campaign.toml") == ["deck", "tower"]
    assert named("/a/deck", "/b/deck", "/b/Tower") == ["a-deck", "b-deck", "Tower"]
    assert named("/x/a/deck", "/y/a/deck", "/a/deck") == ["x-a-deck", "y-a-deck", "a-deck"]
    assert named("/a/deck", "/b/Deck") == ["a-deck", "b-Deck"], "file systems that do not tell them apart"
    assert named("/a-b/c", "/x/b/c", "/a/b-c", "/y/b-c") == ["a-b-c", "b-c", "a-b-c-2", "y-b-c"]
    assert named("/a/batch.html") == ["batch.html-2"]
    assert named("/") == ["campaign"]
    assert named("/b/deck", "/a/deck") == ["b-deck", "a-deck"], "whatever the order"


HOSTILE = """<script>alert('1')</script> "B/D = 4" & 漢字 ξ₀ 🌉"""


def batch_of(campaigns, design=()):
    provenance = {
        "versions": {"scruton": "1"},
        "seed": 0,
        "card": {"name": "x", "sha256": "y"},
        "sc": [],
        "report": False,
    }
    return Batch(Path("out"), tuple(campaigns), design, provenance)


def test_titles_names_and_reasons_are_text(room, whole):
    good = entries(whole)["wind"]
    peak = good["peaks"][0] | {"test": HOSTILE, "Y1": None, "epsilon": None}
    shown = good | {"title": HOSTILE, "name": 'a "b" ö#?', "flags": [HOSTILE], "peaks": [peak, peak]}
    failed = entries(whole)["broken"] | {"reason": HOSTILE}
    result = batch_of([shown, failed], (40.0,))
    page = batch_page(result)
    assert "<script" not in page
    assert page.count("&lt;script&gt;alert(&#39;1&#39;)&lt;/script&gt; &#34;B/D = 4&#34; &amp; 漢字 ξ₀ 🌉") == 5
    assert 'href="a%20%22b%22%20%C3%B6%23%3F/fit.json"' in page
    assert not re.search(r'(src|href)="(https?:)?//', page), "self-contained"
    rows = list(csv.DictReader(io.StringIO(batch_csv(result))))
    assert [one["peak test"] for one in rows] == [HOSTILE, HOSTILE, ""]
    assert rows[0]["Y1"] == ""
    assert float(rows[0]["a*"]) == peak["a_star"]["median"]
    assert float(rows[0]["amplitude at Sc 40 q95"]) == good["predictions"][0]["amplitude"]["interval"]["0.90"][1]
    assert rows[2]["reason"] == HOSTILE
    assert "2 campaigns: 1 done, 1 failed." in batch_text(result)


def test_an_interval_without_an_upper_end(whole):
    good = entries(whole)["wind"]
    amplitude = good["predictions"][0]["amplitude"]
    endless = amplitude | {"interval": amplitude["interval"] | {"0.90": [0.01, None]}}
    result = batch_of([good | {"predictions": [good["predictions"][0] | {"amplitude": endless}]}], (40.0,))
    assert "∞" in batch_page(result)
    assert next(csv.DictReader(io.StringIO(batch_csv(result))))["amplitude at Sc 40 q95"] == ""


def test_nothing_but_bad_input_is_bad_input(room):
    bad = run_one(job(room, room / "none", campaign=str(room / "broken")))
    assert batch_of([bad]).none_ran
    assert not batch_of([bad, bad | {"bad_input": False}]).none_ran


def test_no_campaign_at_all(tmp_path, capsys):
    with pytest.raises(SystemExit, match="2"):
        batch("-o", tmp_path / "out")
    assert "the following arguments are required: CAMPAIGN" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
