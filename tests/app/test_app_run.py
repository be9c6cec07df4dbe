"""What every verb has in common: its declaration, its claim on a folder, and the provenance of what it writes."""

import inspect
import json
import shutil
from argparse import Namespace
from importlib import import_module

import pytest

from scruton.app.run import Run
from scruton.app.verbs import VERBS, Verb
from scruton.cli import main
from scruton.documents import read_document
from scruton.errors import InputError
from scruton.provenance import PACKAGES, provenance
from scruton.workspace import read_manifest

BLOCK = {"command", "versions", "seed", "sha256", "card", "settings"}


def every(verbs: tuple[Verb, ...]) -> list[Verb]:
    return [each for verb in verbs for each in (verb, *every(verb.steps))]


@pytest.mark.parametrize("verb", [verb for verb in every(VERBS) if verb.work], ids=lambda verb: verb.work)
def test_every_verb_is_a_function_of_its_arguments(verb: Verb) -> None:
    module, name = verb.work.split(":")
    work = getattr(import_module(f"scruton.app.{module}"), name)
    assert len(inspect.signature(work).parameters) == 1


def test_a_verb_without_a_function_needs_a_step(capsys) -> None:
    for verb in (verb for verb in VERBS if not verb.work):
        with pytest.raises(SystemExit, match="2"):
            main([verb.name])
        assert "the following arguments are required: STEP" in capsys.readouterr().err


def claim(folder, *, quiet=True, force=False, resume=False, seed=3, settings=None):
    arguments = Namespace(seed=seed, quiet=quiet, force=force, resume=resume)
    return Run(
        folder, "fit", arguments, sha256={"a.csv": "12"}, settings=settings or {"tests": []}, results=("fit.json",)
    )


def test_what_a_run_writes_says_what_it_was_made_from(tmp_path) -> None:
    with claim(tmp_path) as work:
        work.write("fit.json", {"format": 1, "provenance": {"more": 2}})
        (path,) = work.published([work.new / "fit.json"])
    block = read_document(path, "a fit")["provenance"]
    assert set(block) == BLOCK | {"more"}
    assert (block["command"], block["seed"], block["sha256"]) == ("fit", 3, {"a.csv": "12"})
    assert set(block["versions"]) == {"python", *PACKAGES}
    run = read_manifest(tmp_path)["runs"]["fit"]
    assert run["settings"] == {"seed": 3, "version": block["versions"]["scruton"], "tests": []}


@pytest.mark.parametrize(("change", "words"), [({"seed": 4}, "other seed"), ({"settings": {"tests": ["a"]}}, "tests")])
def test_another_run_does_not_go_on_with_it(tmp_path, change, words) -> None:
    with claim(tmp_path) as work:
        work.write("fit.json", {})
        work.publish()
    with pytest.raises(InputError, match=words), claim(tmp_path, resume=True, **change):
        pass


@pytest.mark.usefixtures("no_figures")
def test_every_json_has_the_same_block(quick_results, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.setattr("scruton.app.criticise._figures", lambda *_: [])
    results = shutil.copytree(quick_results, tmp_path / "fit")
    assert main(["size", str(results), "--limit", "0.05", "--seed", "5", "--quiet"]) == 0
    main(["criticise", str(results), "--seed", "5", "--quiet"])
    capsys.readouterr()
    for name, seed in (("fit.json", 0), ("sizing/sizing.json", 5), ("criticism/criticism.json", 5)):
        block = json.loads((results / name).read_text(encoding="utf-8"))["provenance"]
        assert set(block) >= BLOCK, name
        assert block["seed"] == seed
        assert set(block["versions"]) == {"python", *PACKAGES}
        assert block["sha256"]


def test_the_picture_of_a_card_is_on_record(tmp_path, capsys, monkeypatch) -> None:
    def save(_figure, folder, stem, *, formats):
        paths = [folder / f"{stem}.{kind}" for kind in formats]
        for path in paths:
            path.write_text("drawn", encoding="utf-8")
        return paths

    monkeypatch.setattr("scruton.report.figures.save", save)
    monkeypatch.setattr("scruton.report.figures.predictions.prior_plot", lambda *_, **__: None)
    for name in ("default", "paper", "default"):
        assert main(["models", "show", name, "--prior-predictive", str(tmp_path), "--seed", "2"]) == 0
    assert capsys.readouterr().out.splitlines()[:2] == [str(tmp_path / f"default.{kind}") for kind in ("svg", "png")]
    assert {path.name for path in tmp_path.iterdir()} == {
        ".scruton", "default.png", "default.svg", "paper.png", "paper.svg"
    }  # fmt: skip
    runs = read_manifest(tmp_path)["runs"]
    assert runs["prior of paper"]["settings"]["seed"] == 2
    assert list(runs["prior of paper"]["inputs"]) == ["model card paper"]


def test_the_block_is_what_json_can_hold() -> None:
    block = provenance(None, seed=1, sha256={}, settings={"sc": [30.0]})
    assert json.loads(json.dumps(block)) == block
    assert set(block) == BLOCK


def test_what_was_asked_for_stands_in_the_provenance_of_a_fit(small_results):
    summary = json.loads((small_results / "fit.json").read_text(encoding="utf-8"))
    assert summary["provenance"]["command"] == "fit --seed 0 --model default"
    assert summary["provenance"]["settings"]["tests"] == []
