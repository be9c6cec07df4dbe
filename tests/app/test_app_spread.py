"""Verbs on a Dask scheduler: two worker processes, one of them killed, and the bytes of one process."""

import json
import os
import signal
import threading
import time
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path

import pytest

from benchmarks.large import campaign
from scruton.calibrate import run_calibration
from scruton.calibrate.challenge.attempt import run_challenge
from scruton.calibrate.challenge.make import Plan, make_challenge
from scruton.calibrate.execution import Execution
from scruton.campaign import load_campaign
from scruton.cli import main
from scruton.errors import InputError
from scruton.griffin.validate import validate
from scruton.infer.cards import load_card
from scruton.workers import Workers

QUICK = """format = 1
name = "quick"
extends = "paper"
[sampler]
walkers = 64
draws = 16
min_ess = 100
max_rhat = 1.2
"""


@contextmanager
def scheduler():
    """A scheduler with two worker processes, each with one thread: its client."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, protocol="tcp", host="127.0.0.1",
            dashboard_address="127.0.0.1:0", memory_limit=0,
        ) as cluster,
        Client(cluster) as client,
    ):  # fmt: skip
        yield client


class Killer:
    """Kills one of the two processes as soon as something is done; a listener of progress."""

    def __init__(self, client):
        self.address, self.processes = client.scheduler.address, list(client.run(os.getpid).values())
        self.killed = None

    def __call__(self, stage, fraction):
        if self.killed is None and 0.0 < fraction < 1.0:
            self.killed = self.processes[0]
            os.kill(self.killed, signal.SIGKILL)


def interrupts(stage, fraction):
    """What a user does who has seen enough for now; a listener of progress."""
    if 0.0 < fraction < 1.0:
        raise KeyboardInterrupt


def files(folder: Path, *, but=()):
    """Digests of the results, by name; `but` hold how long it took."""
    found = (path for path in sorted(folder.rglob("*")) if path.is_file() and ".scruton" not in path.parts)
    return {
        str(path.relative_to(folder)): sha256(path.read_bytes()).hexdigest() for path in found if path.name not in but
    }


def seen(folder: Path):
    """A diagnosis that takes a while and depends on the case alone."""
    time.sleep(0.3)
    return {"verdict": "none", "sha256": sha256((folder / "campaign.toml").read_bytes()).hexdigest()}


def fails(task):
    if task == 1:
        raise InputError("a file", "a field", "one thing", "another")
    return task


@pytest.mark.thorough
def test_an_error_of_the_work_comes_back_once_the_rest_is_done():
    come = Workers(2).values(fails, range(4))
    assert sorted(next(come)[1] for _ in range(3)) == [0, 2, 3]
    with pytest.raises(InputError, match="a file: a field: found one thing"):
        next(come)
    assert list(Workers(2).values(fails, [])) == []


@pytest.mark.thorough
def test_a_challenge_is_the_same_when_a_worker_is_killed(tmp_path):
    plan = Plan(3, ["sensor_gain_error", "none"], (0.4,))
    make_challenge(Execution(tmp_path / "one"), plan, 6)
    run_challenge(tmp_path / "one", Execution(tmp_path / "ran"), seen)
    with scheduler() as client:
        killer = Killer(client)
        workers = Workers(scheduler=killer.address)
        make_challenge(Execution(tmp_path / "two", workers, progress=killer), plan, 6)
        assert killer.killed
        again = Killer(client)
        run_challenge(tmp_path / "two", Execution(tmp_path / "also", workers, progress=again), seen)
        assert again.killed
        # What was interrupted there goes on there, from what was done.
        with pytest.raises(KeyboardInterrupt):
            run_challenge(tmp_path / "two", Execution(tmp_path / "part", workers, progress=interrupts), seen)
        left = []
        goes_on = Execution(tmp_path / "part", workers, progress=lambda _, done: left.append(done), resume=True)
        run_challenge(tmp_path / "two", goes_on, seen)
        assert min(left) > 1.5 / 6.0, "one case was done already, and is counted"
    timeless = {"challenge-run.json", "challenge.json", "case.json"}
    assert files(tmp_path / "two", but=timeless) == files(tmp_path / "one", but=timeless)
    whole = files(tmp_path / "ran", but=timeless)
    assert files(tmp_path / "also", but=timeless) == files(tmp_path / "part", but=timeless) == whole
    assert len(files(tmp_path / "also", but=timeless)) == 6


@pytest.mark.slow
def test_a_calibration_is_the_same_when_a_worker_is_killed(tmp_path):
    (tmp_path / "quick.toml").write_text(QUICK, encoding="utf-8")
    how = {"regimes": ["growth"], "campaigns": 5, "seed": 3, "model": str(tmp_path / "quick.toml")}
    run_calibration(Execution(tmp_path / "one"), **how)
    with scheduler() as client:
        killer = Killer(client)
        run_calibration(Execution(tmp_path / "two", Workers(scheduler=killer.address), progress=killer), **how)
        assert killer.killed
        # what is there is kept, and more campaigns go on from it
        workers = Workers(scheduler=killer.address)
        run_calibration(Execution(tmp_path / "part", workers), **how | {"campaigns": 3})
        run_calibration(Execution(tmp_path / "part", workers, resume=True), **how)
    timed = {"growth.jsonl"}
    whole = files(tmp_path / "one", but=timed)
    assert "calibration.json" in whole
    assert files(tmp_path / "two", but=timed) == whole
    assert files(tmp_path / "part", but=timed) == whole


@pytest.mark.slow
def test_a_validation_is_the_same_when_a_worker_is_killed(tmp_path):
    (tmp_path / "quick.toml").write_text(QUICK, encoding="utf-8")
    made = load_campaign(campaign(tmp_path / "c", 3, 6, 2))
    card = load_card(str(tmp_path / "quick.toml"))

    def found(workers, place, progress=None):
        done = validate(made, card, progress=progress, checkpoints=tmp_path / place, workers=workers)
        return json.dumps(
            [{"test": one.test, "from": one.source, "z": one.z, **one.prediction.to_json()} for one in done]
        )

    alone = found(Workers(), "one")
    with scheduler() as client:
        killer = Killer(client)
        assert found(Workers(scheduler=killer.address), "two", killer) == alone
        assert killer.killed
        assert found(Workers(scheduler=killer.address), "two") == alone, "again, from the checkpoints"


@pytest.mark.parametrize(
    "words", [["validate", "{example}"], ["calibrate", "-o", "{out}"], ["challenge", "make", "-o", "{out}"]]
)
def test_a_scheduler_that_none_answers_at_is_refused_before_any_work(words, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("scruton.workers.REACH", 1)
    monkeypatch.chdir(tmp_path)
    places = {"example": Path(__file__).parents[2] / "examples" / "rectangle-4to1", "out": tmp_path / "out"}
    asked = [word.format(**places) for word in words]
    assert main([*asked, "--scheduler", "tcp://127.0.0.1:1"]) == 2
    assert "--scheduler: found tcp://127.0.0.1:1, where none answers" in capsys.readouterr().err
    assert main([*asked, "--tls-ca", "ca.pem"]) == 2
    assert "--tls-ca: found no --scheduler" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_batch_is_the_same_when_a_worker_is_killed(tmp_path):
    (tmp_path / "quick.toml").write_text(QUICK, encoding="utf-8")
    campaigns = [str(campaign(tmp_path / f"c{k}", 1, 2, k)) for k in range(1, 5)]
    words = ["batch", *campaigns, "--model", str(tmp_path / "quick.toml"), "--seed", "3", "--quiet"]
    assert main([*words, "-o", str(tmp_path / "one")]) in (0, 1)
    with scheduler() as client:
        killer = Killer(client)

        def kill_once_one_is_done():
            while not list((tmp_path / "two").rglob("posterior.nc")):
                time.sleep(0.05)
            killer("batch", 0.5)

        watching = threading.Thread(target=kill_once_one_is_done, daemon=True)
        watching.start()
        assert main([*words, "-o", str(tmp_path / "two"), "--scheduler", killer.address]) in (0, 1)
        watching.join(1.0)
        assert killer.killed
        # Of a batch that was interrupted there what is left is done there.
        part = ["-o", str(tmp_path / "part"), "--scheduler", killer.address]
        assert main([*words[:3], *words[5:], *part]) in (0, 1)
        first = {path: path.stat().st_mtime_ns for path in (tmp_path / "part").rglob("posterior.nc")}
        assert main([*words, *part, "--resume"]) in (0, 1)
        assert {path: path.stat().st_mtime_ns for path in first} == first
    fitted = {name: found for name, found in files(tmp_path / "one").items() if name.endswith("posterior.nc")}
    assert len(fitted) == 4
    for place in ("two", "part"):
        again = files(tmp_path / place)
        assert {name: again[name] for name in fitted} == fitted
