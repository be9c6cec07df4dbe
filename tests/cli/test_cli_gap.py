"""The verbs of the gap: diagnose, challenge, and what was found carried into predictions."""

import io
import json
from contextlib import redirect_stdout

import numpy as np
import pytest

from scruton import load_diagnosis
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
max_steps = 100
"""


@pytest.fixture(scope="module")
def campaign(two_rigs):
    """Two rigs under another law than the paper's."""
    return two_rigs("ehsan-scanlan")


def run(*arguments, capsys):
    code = main([str(one) for one in arguments])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


@pytest.fixture(scope="module")
def diagnosed(campaign, tmp_path_factory):
    """The folder that `diagnose` wrote with two threads, and what it printed."""
    out, printed = tmp_path_factory.mktemp("diagnosed") / "gap", io.StringIO()
    with redirect_stdout(printed):
        assert main(["diagnose", str(campaign), "-o", str(out), "--jobs", "2"]) == 0
    return out, printed.getvalue()


def test_diagnose_writes_what_its_format_says(campaign, diagnosed, tmp_path, capsys):
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
    code, _, error = run("diagnose", campaign, "-o", out, capsys=capsys)
    assert code == 2
    assert "--force" in error


def test_a_law_that_is_not_the_papers_stands_in_its_place(diagnosed):
    """Ehsan and Scanlan's: all of the drive is that law's, and it is one effect, without a loss of coherence beside."""
    found = json.loads((diagnosed[0] / "gap.json").read_text())
    assert (found["verdict"], found["also"]) == ("aerodynamic_damping_nonlinearity", [])
    parameters = found["effects"]["aerodynamic_damping_nonlinearity"]["parameters"]
    share = parameters["share"]
    assert share["form"].startswith("in the place of the drive")
    assert parameters["exponent"]["median"] == pytest.approx(2.0, abs=0.1)
    assert share["median"] == pytest.approx(1.0, abs=0.1)
    place = next(one for one in found["where"] if one["effect"])  # at the stable amplitude nothing is added
    assert place["excess"] > 1e-4


def test_the_same_campaign_gives_the_same_bytes(campaign, diagnosed, tmp_path, capsys):
    run("diagnose", campaign, "-o", tmp_path / "one", "--quiet", "--jobs", 1, capsys=capsys)
    assert (tmp_path / "one" / "gap.json").read_bytes() == (diagnosed[0] / "gap.json").read_bytes()


@pytest.mark.thorough
def test_an_effect_is_carried_into_the_prediction(campaign, tmp_path, capsys):
    card = tmp_path / "card.toml"
    card.write_text(CARD, encoding="utf-8")
    sc, errors = 34.0, {}
    truth = np.sqrt(4.0 / 2146.0 * (1.0 - 0.6429 * sc / 21.7 / 1.2428))  # of the force, as in conftest.py
    for name, more in (("with", ["--effect", "auto"]), ("without", [])):
        run("fit", campaign, "-o", tmp_path / name, "--model", card, "--quiet", *more, capsys=capsys)
        _, text, _ = run("predict", tmp_path / name, "--sc", sc, "--json", capsys=capsys)
        entry = json.loads(text)["predictions"][0]
        errors[name] = abs(entry["amplitude"]["median"] / truth - 1.0)
        assert ("aerodynamic_damping_nonlinearity" in str(entry["laws"])) == (name == "with")
        code, _, error = run("predict", tmp_path / name, "--sc", "5", "--effect", "auto", capsys=capsys)
        assert (code == 2) == (name == "without")
        assert ("fit CAMPAIGN --effect auto" in error) == (name == "without")
    assert errors["with"] < 0.5 * errors["without"]
    assert (
        json.loads((tmp_path / "with" / "fit.json").read_text())["effect"]["used"] == "aerodynamic_damping_nonlinearity"
    )


def test_an_effect_that_is_none_is_refused(campaign, tmp_path, capsys):
    code, _, error = run("fit", campaign, "-o", tmp_path / "x", "--effect", "gremlins", capsys=capsys)
    assert code == 2
    assert "coulomb_friction" in error


@pytest.mark.thorough
def test_challenge_from_make_to_score(tmp_path, capsys):
    folder, results = tmp_path / "c", tmp_path / "r"
    effects = "none,coulomb_friction"
    code, _, _ = run("challenge", "make", "-o", folder, "--cases", 2, "--seed", 4, "--effects", effects,
                     "--severities", "0.4", "--design", "one-rig", "--quiet", capsys=capsys)  # fmt: skip
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
