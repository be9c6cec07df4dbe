"""Folders of results: what survives, what is refused, and what a resumed run is compared with."""

import errno
import json
import os
import subprocess
import sys
from contextlib import suppress

import numpy as np
import pytest

from scruton.documents import read_document, sealed, write_document, write_text
from scruton.errors import InputError
from scruton.stats.sampler import Checkpoint
from scruton.workspace import Workspace, digest, read_manifest


def claim(folder, *, inputs=None, settings=None, force=False, resume=False, grows=False, name="fit"):
    return Workspace(
        folder, name, inputs=inputs or {"a.csv": "1"}, settings=settings or {"seed": 0}, results=("fit.json",),
        force=force, resume=resume, grows=grows,
    )  # fmt: skip


def test_a_byte_that_is_no_utf_8_is_kept(tmp_path):
    """As a command line gives it; `batch --test` ended in a traceback."""
    with claim(tmp_path / "out", settings={"test": "caf\udce9"}):
        pass
    with claim(tmp_path / "out", settings={"test": "caf\udce9"}, resume=True):
        pass
    write_document(tmp_path / "a.json", {"test": "caf\udce9"})
    assert read_document(tmp_path / "a.json", "a document")["test"] == "caf\udce9"


def write(folder, **files):
    for name, text in files.items():
        path = folder / name.replace("__", "/").replace("_", ".")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def publish(folder, *, how=None, **files):
    with claim(folder, **(how or {})) as work:
        write(work.new, **files)
        work.publish()
    return folder


def content(folder):
    """Every file but the program's own state."""
    paths = (path for path in folder.rglob("*") if path.is_file())
    named = {path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8") for path in paths}
    return {name: text for name, text in named.items() if not name.startswith(".scruton")}


def test_results_appear_whole_and_are_on_record(tmp_path):
    with claim(tmp_path / "o") as work:
        write(work.new, fit_json="1", figures__g_svg="2")
        assert content(tmp_path / "o") == {}
        work.publish()
    assert content(tmp_path / "o") == {"fit.json": "1", "figures/g.svg": "2"}
    run = read_manifest(tmp_path / "o")["runs"]["fit"]
    assert run["files"] == {name: digest(tmp_path / "o" / name) for name in ("figures/g.svg", "fit.json")}
    assert not (tmp_path / "o/.scruton/fit").exists()


@pytest.mark.parametrize("error", [InputError("a", "b", "c", "d"), KeyboardInterrupt(), RuntimeError()])
def test_old_results_survive_whatever_ends_the_new_run(tmp_path, error):
    out = publish(tmp_path / "o", fit_json="old", figures__g_svg="old")
    write(out, figures__mine_png="mine")
    with suppress(InputError, KeyboardInterrupt, RuntimeError), claim(out, force=True) as work:
        write(work.new, fit_json="half")
        raise error
    assert content(out) == {"fit.json": "old", "figures/g.svg": "old", "figures/mine.png": "mine"}


def test_force_removes_what_the_program_wrote_and_nothing_else(tmp_path):
    out = publish(tmp_path / "o", fit_json="old", report_html="old", figures__g_svg="old", figures__h_svg="old")
    write(out, figures__mine_png="mine", figures__h_svg="edited by hand")
    publish(out, how={"force": True}, fit_json="new")
    assert content(out) == {"fit.json": "new", "figures/mine.png": "mine", "figures/h.svg": "edited by hand"}


def test_a_file_of_the_user_in_the_way_is_kept_beside(tmp_path):
    write(tmp_path / "o", figures__g_svg="mine")
    publish(tmp_path / "o", fit_json="1", figures__g_svg="2")
    assert content(tmp_path / "o") == {"fit.json": "1", "figures/g.svg": "2", "figures/g.svg.~1~": "mine"}
    write(tmp_path / "o", figures__g_svg="edited")
    publish(tmp_path / "o", how={"force": True}, fit_json="3", figures__g_svg="4")
    assert content(tmp_path / "o")["figures/g.svg.~2~"] == "edited"


def test_bad_input_leaves_no_trace(tmp_path):
    def bad():
        with claim(tmp_path / "a" / "b") as work:
            write(work.new, fit_json="half")
            raise InputError("a", "b", "c", "d")

    with pytest.raises(InputError):
        bad()
    assert list(tmp_path.iterdir()) == []


def test_results_are_refused_without_a_word(tmp_path):
    out = publish(tmp_path / "o", fit_json="1")
    with pytest.raises(InputError, match=r"results of an earlier run \(fit.json\); wanted an empty folder, or --force"):
        publish(out, fit_json="2")
    write(tmp_path / "other", fit_json="of an older version")
    with pytest.raises(InputError, match="earlier run"):
        publish(tmp_path / "other", fit_json="2")
    with pytest.raises(InputError, match="inputs are not on record"):
        publish(tmp_path / "other", how={"resume": True}, fit_json="2")


def interrupted(folder, **how):
    with suppress(KeyboardInterrupt), claim(folder, **how) as work:
        write(work.checkpoints, a_npz="chunk")
        raise KeyboardInterrupt


def test_an_interrupted_run_is_resumed_with_its_own_inputs_alone(tmp_path):
    out = tmp_path / "o"
    interrupted(out, inputs={"campaign.toml": "1", "a.csv": "2"})
    with pytest.raises(InputError, match=r"what an interrupted run left; wanted an empty folder, --resume .*--force"):
        publish(out, how={"inputs": {"campaign.toml": "1", "a.csv": "2"}}, fit_json="1")
    for other, found in (
        ({"inputs": {"campaign.toml": "9", "a.csv": "2"}}, r"a run with other campaign\.toml; wanted"),
        ({"inputs": {"campaign.toml": "1", "a.csv": "2"}, "settings": {"seed": 5}}, r"other seed \(0, now 5\)"),
    ):
        with pytest.raises(InputError, match=found):
            publish(out, how={"resume": True, **other}, fit_json="1")
    with claim(out, inputs={"campaign.toml": "1", "a.csv": "2"}, resume=True) as work:
        assert (work.checkpoints / "a.npz").read_text() == "chunk"
        write(work.new, fit_json="1")
        work.publish()
    assert content(out) == {"fit.json": "1"}
    with pytest.raises(InputError, match=r"other a\.csv"):
        publish(out, how={"resume": True, "inputs": {"campaign.toml": "1", "a.csv": "3"}}, fit_json="2")


def test_force_gives_the_interrupted_run_back_when_its_input_is_bad(tmp_path):
    out = tmp_path / "o"
    interrupted(out)
    with pytest.raises(InputError), claim(out, inputs={"b.csv": "1"}, force=True):
        raise InputError("b.csv", "", "noise", "a record")
    with claim(out, resume=True) as work:
        assert (work.checkpoints / "a.npz").exists()


def test_nothing_half_written_becomes_a_result(tmp_path):
    out = tmp_path / "o"
    with suppress(KeyboardInterrupt), claim(out) as work:
        write(work.new, fit_json="half", left_html="from an attempt that was killed")
        raise KeyboardInterrupt
    publish(out, how={"resume": True}, fit_json="whole")
    assert content(out) == {"fit.json": "whole"}


@pytest.mark.parametrize("moves", [0, 1, 2, 3])
def test_a_swap_that_was_killed_is_completed(tmp_path, monkeypatch, moves):
    out = publish(tmp_path / "o", fit_json="old", report_html="old", a_csv="old")
    left = iter(range(moves))

    def killed(source, place):
        if next(left, None) is None:
            raise SystemExit
        os.replace(source, place)  # noqa: PTH105

    with suppress(SystemExit), claim(out, force=True) as work:
        write(work.new, fit_json="new", a_csv="new", b_csv="new")
        with monkeypatch.context() as patch:
            real = write_document
            patch.setattr("scruton.workspace.replace_file", killed)
            patch.setattr("scruton.workspace.write_document", lambda *what: real(*what))
            work.publish()
    # Whatever opens the folder next puts the rest in its place: here a run that is refused.
    with pytest.raises(InputError, match="earlier run"):
        publish(out, fit_json="other")
    assert content(out) == {"fit.json": "new", "a.csv": "new", "b.csv": "new"}
    assert not list((out / ".scruton").glob("*/swap.json"))


def test_a_second_run_is_told_that_the_folder_is_taken(tmp_path):
    with claim(tmp_path / "o"):
        code = (
            "from pathlib import Path; from scruton.workspace import Workspace; import sys\n"
            "with Workspace(Path(sys.argv[1]), 'other', inputs={}, settings={}): pass"
        )
        second = subprocess.run(
            [sys.executable, "-c", code, str(tmp_path / "o")], capture_output=True, text=True, check=False
        )
        assert second.returncode != 0
        assert f"process {os.getpid()}" in second.stderr
        assert "is at work in it" in second.stderr
    with claim(tmp_path / "o", resume=True):
        pass  # the lock ends with the run


def test_runs_that_grow_keep_what_is_whole(tmp_path):
    out = tmp_path / "o"
    with suppress(KeyboardInterrupt), claim(out, grows=True) as work:
        write(work.new, one__gap_json="1", two__part_json="not yet")
        work.keep("one")
        raise KeyboardInterrupt
    assert content(out) == {"one/gap.json": "1"}
    with claim(out, grows=True, resume=True, inputs={"a.csv": "1", "more.csv": "1"}) as work:
        assert work.find("one/gap.json") == out / "one/gap.json"
        assert work.find("two/gap.json") is None
        write(work.new, two__gap_json="2")
        work.publish()
    assert content(out) == {"one/gap.json": "1", "two/gap.json": "2", "two/part.json": "not yet"}


def test_bad_input_halfway_does_not_part_results_from_their_inputs(tmp_path):
    out = tmp_path / "o"
    with suppress(InputError), claim(out, grows=True) as work:
        write(work.new, one__gap_json="1")
        work.keep("one")
        raise InputError("two", "", "noise", "a record")
    with pytest.raises(InputError, match=r"other a\.csv"):
        publish(out, how={"grows": True, "resume": True, "inputs": {"a.csv": "9"}}, two__gap_json="2")
    publish(out, how={"grows": True, "resume": True}, two__gap_json="2")
    assert content(out) == {"one/gap.json": "1", "two/gap.json": "2"}


def test_a_forced_run_that_grows_replaces_all_at_once_even_when_resumed(tmp_path):
    out = publish(tmp_path / "o", one__gap_json="old", two__gap_json="old", how={"grows": True})
    with suppress(KeyboardInterrupt), claim(out, grows=True, force=True) as work:
        write(work.new, one__gap_json="new")
        work.keep("one")
        raise KeyboardInterrupt
    assert content(out) == {"one/gap.json": "old", "two/gap.json": "old"}
    with claim(out, grows=True, resume=True) as work:
        assert work.find("one/gap.json").read_text() == "new"
        assert work.find("two/gap.json") is None
        work.publish()
    assert content(out) == {"one/gap.json": "new"}


@pytest.mark.parametrize("place", ["file", "file/below", "x" * 300, "/" + "y" * 5000, "nul\0"])
def test_a_folder_that_cannot_be(tmp_path, place):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError), claim(tmp_path / place):
        pass


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda text: text.replace("0.25", "0.26"), "checksum: found a checksum that is not that of the content"),
        (lambda text: text[:-5], "no valid JSON"),
        (lambda text: "{}", "median: found nothing"),
        (lambda text: "[]", "JSON that is a list"),
        (lambda text: json.dumps(sealed({"format": 2, "median": 0.25})), "format: found 2; wanted 1"),
        (lambda text: "[" * 100_000, "no valid JSON"),
    ],
)
def test_documents_that_are_not_as_they_were_written(tmp_path, spoil, message):
    path = tmp_path / "fit.json"
    write_document(path, {"format": 1, "median": 0.25})
    assert read_document(path, "a fit", ("median",), version=1)["median"] == 0.25
    path.write_text(spoil(path.read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        read_document(path, "a fit", ("median",), version=1)


def test_a_full_disk_names_the_file_and_leaves_no_half_of_one(tmp_path, monkeypatch):
    """Of itself the error of a write names nothing."""
    path = tmp_path / "fit.json"
    path.write_text("before")

    def full(_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="No space left") as caught:
        write_text(path, "after")
    assert caught.value.filename == str(path)
    assert [one.name for one in tmp_path.iterdir()] == ["fit.json"]
    assert path.read_text() == "before"
    with pytest.raises(OSError, match="No space left") as caught:
        Checkpoint(tmp_path / "one.npz", "print").save({"a": np.zeros(3)})
    assert caught.value.filename == str(tmp_path / "one.npz")
    assert [one.name for one in tmp_path.iterdir()] == ["fit.json"]
