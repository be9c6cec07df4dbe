"""The verbs of the gap: diagnose, challenge, and what was found carried into predictions."""

import io
import json
from contextlib import redirect_stdout

import pytest

from scruton import load_diagnosis
from scruton.calibrate.challenge.make import Plan, make_challenge
from scruton.calibrate.execution import Execution
from scruton.cli import main
from scruton.errors import InputError
from tests.app.test_app_run import BLOCK

CARD = """extends = "paper"
name = "quick"
[sampler]
ensembles = 2
walkers = 48
draws = 16
min_ess = 200
max_steps = 400
"""


@pytest.fixture(scope="module")
def challenge(tmp_path_factory):
    folder = tmp_path_factory.mktemp("challenge")
    make_challenge(Execution(folder, force=True), Plan(3, ["aerodynamic_damping_nonlinearity"], (0.4,)), cases=1)
    return folder


def run(*arguments, capsys):
    code = main([str(one) for one in arguments])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


@pytest.fixture(scope="module")
def diagnosed(challenge, tmp_path_factory):
    """The folder that `diagnose` wrote with two threads, and what it printed."""
    out, printed = tmp_path_factory.mktemp("diagnosed") / "gap", io.StringIO()
    with redirect_stdout(printed):
        assert main(["diagnose", str(challenge / "case-0001"), "-o", str(out), "--jobs", "2"]) == 0
    return out, printed.getvalue()


def test_diagnose_writes_what_its_format_says(challenge, diagnosed, tmp_path, capsys):
    out, text = diagnosed
    assert text.startswith("Verdict: aerodynamic_damping_nonlinearity.")
    found = json.loads((out / "gap.json").read_text())
    assert found["format"] == 1
    assert found["verdict"] == "aerodynamic_damping_nonlinearity"
    assert sum(found["probability"].values()) == pytest.approx(1.0, abs=1e-4)
    assert {"none", "unknown", "coulomb_friction"} <= set(found["probability"])
    assert found["indistinguishable"][0][0] == found["verdict"]
    assert found["where"]
    assert {"quantity", "rig", "test", "record", "amplitude", "time_s", "excess", "interval90"} <= set(
        found["where"][0]
    )
    assert found["shrink"]["fraction"] > 0.8
    assert found["shrink"]["held_out"]["fraction"] > 0.5
    assert found["advice"]
    assert (out / "gap.png").stat().st_size > 10_000
    again = load_diagnosis(out)
    assert again.found == (found["verdict"], *found["also"])
    assert {
        name: getattr(again, name) for name in ("where", "shrink", "effects", "provenance")
    }.items() <= found.items()
    assert set(again.provenance) == BLOCK
    with pytest.raises(InputError, match=r"gap\.json: found no such file"):
        load_diagnosis(tmp_path)
    code, _, error = run("diagnose", challenge / "case-0001", "-o", out, capsys=capsys)
    assert code == 2
    assert "--force" in error


@pytest.mark.thorough
def test_the_same_campaign_gives_the_same_bytes(challenge, diagnosed, tmp_path, capsys):
    run("diagnose", challenge / "case-0001", "-o", tmp_path / "one", "--quiet", "--jobs", 1, capsys=capsys)
    assert (tmp_path / "one" / "gap.json").read_bytes() == (diagnosed[0] / "gap.json").read_bytes()


@pytest.mark.thorough
def test_an_effect_is_carried_into_the_prediction(challenge, tmp_path, capsys):
    card = tmp_path / "card.toml"
    card.write_text(CARD, encoding="utf-8")
    campaign, truth = challenge / "case-0001", json.loads((challenge / "answers" / "answers.json").read_text())
    there = truth["case-0001"]["held_out"][-1]
    errors = {}
    for name, more in (("with", ["--effect", "auto"]), ("without", [])):
        run("fit", campaign, "-o", tmp_path / name, "--model", card, "--quiet", *more, capsys=capsys)
        _, text, _ = run("predict", tmp_path / name, "--sc", there["scruton_number"], "--json", capsys=capsys)
        entry = json.loads(text)["predictions"][0]
        errors[name] = abs(entry["amplitude"]["median"] / there["stable_amplitude"] - 1.0)
        assert ("aerodynamic_damping_nonlinearity" in str(entry["laws"])) == (name == "with")
        code, _, error = run("predict", tmp_path / name, "--sc", "5", "--effect", "auto", capsys=capsys)
        assert (code == 2) == (name == "without")
        assert ("fit CAMPAIGN --effect auto" in error) == (name == "without")
    assert errors["with"] < 0.5 * errors["without"]
    assert (
        json.loads((tmp_path / "with" / "fit.json").read_text())["effect"]["used"] == "aerodynamic_damping_nonlinearity"
    )


def test_an_effect_that_is_none_is_refused(challenge, tmp_path, capsys):
    code, _, error = run("fit", challenge / "case-0001", "-o", tmp_path / "x", "--effect", "gremlins", capsys=capsys)
    assert code == 2
    assert "coulomb_friction" in error


@pytest.mark.thorough
def test_challenge_from_make_to_score(tmp_path, capsys):
    folder, results = tmp_path / "c", tmp_path / "r"
    effects = "none,sensor_gain_error"
    code, _, _ = run("challenge", "make", "-o", folder, "--cases", 2, "--seed", 4, "--effects", effects,
                     "--severities", "0.4", "--quiet", capsys=capsys)  # fmt: skip
    assert code == 0
    assert run("challenge", "run", folder, "-o", results, "--quiet", capsys=capsys)[0] == 0
    code, text, _ = run("challenge", "score", folder, results, "--markdown", tmp_path / "c.md", capsys=capsys)
    assert code == 0
    assert "top-1" in text
    assert (tmp_path / "c.md").read_text().startswith("# The blind check")


def test_bad_arguments_of_the_challenge(tmp_path, capsys):
    code, _, error = run("challenge", "make", "-o", tmp_path / "c", "--severities", "much", capsys=capsys)
    assert code == 2
    assert "--severities" in error
    assert run("challenge", "run", tmp_path / "none", "-o", tmp_path / "r", capsys=capsys)[0] == 2
