"""`scruton validate`: what it says before it fits anything, and what it writes of every prediction."""

import csv
import subprocess
import sys

import numpy as np
import pytest

from scruton.cli import main
from scruton.griffin import Prediction
from scruton.griffin.validate import Validation


@pytest.fixture
def one(monkeypatch: pytest.MonkeyPatch) -> Prediction:
    """A prediction that takes the place of all fits."""
    draws = 0.02 * np.exp(0.1 * np.random.default_rng(1).standard_normal(400))
    made = Prediction(20.0, 0.006, "A/D", draws, {"n=-1": 1.0}, "a", {"A": 0.42, "B": -0.7}, 0.1, (), 4, 1)
    cases = [Validation("heavy", ("light",), made, 0.021, measured=True, trusted=True)]
    monkeypatch.setattr("scruton.griffin.validate.validate", lambda *_, **__: cases)
    return made


def test_it_says_how_many_fits_it_makes_before_it_makes_them(two_rigs, one, tmp_path, capsys) -> None:
    campaign = str(two_rigs("paper"))
    assert main(["validate", campaign, "-o", str(tmp_path / "out")]) == 0
    said = capsys.readouterr()
    assert said.err.splitlines() == ["scruton: 3 fits, the first of all tests"]
    assert f"{one.extrapolation_index:.2f}" in said.out
    assert "1 of 2" in said.out
    assert main(["validate", campaign, "-o", str(tmp_path / "again"), "--quiet"]) == 0
    assert capsys.readouterr().err == ""
    with (tmp_path / "out" / "validation.csv").open(encoding="utf-8") as file:
        (row,) = csv.DictReader(file)
    assert float(row["extrapolation index x"]) == one.extrapolation_index
    assert row["peak tests that cover the amplitude"] == "1"


def test_it_says_nothing_of_fits_where_there_are_none(small_campaign, one, tmp_path, capsys) -> None:
    assert main(["validate", str(small_campaign), "-o", str(tmp_path / "out")]) == 2
    (said,) = capsys.readouterr().err.splitlines()
    assert "two or more: one predicts the other" in said


def test_its_help_says_how_many_fits_there_are() -> None:
    asked = subprocess.run(
        [sys.executable, "-m", "scruton", "validate", "--help"], capture_output=True, text=True, check=True
    )
    text = " ".join(asked.stdout.split())
    assert "2 R + 1 fits of R rigs" in text
    assert "R + 1 fits" in text.partition("--no-singles leave")[2]
