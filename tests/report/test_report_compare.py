"""Two results side by side: what is alike, what moved and what is apart, by hand and of real fits."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fake_fit import fake_fit, led_by
from fake_parts import sizing

import scruton
from scruton.cli import main
from scruton.errors import InputError
from scruton.griffin.compare import ALIKE, APART, MOVED, NARROWER, WIDER, Difference, Side
from scruton.infer.joint import FORCES
from scruton.infer.store import read_tree
from scruton.report.compare import _required, _side, compared_blocks
from scruton.report.render_text import render_text
from scruton.report.wording import TERMINAL


def side(median: float, width: float, error: float) -> Side:
    return Side(median, median - width, median + width, error)


@pytest.mark.parametrize(
    ("second", "verdict"),
    [
        (side(1.0, 0.1, 0.01), ALIKE),
        (side(1.05, 0.1, 0.01), ALIKE),  # 3.5 standard errors of the difference
        (side(1.06, 0.1, 0.01), MOVED),  # 4.2
        (side(1.3, 0.1, 0.01), APART),
        (side(1.3, 0.1, 1.0), APART),
        (None, ""),
    ],
)
def test_verdicts(second: Side | None, verdict: str) -> None:
    assert Difference("a_star", "t", "A/D", side(1.0, 0.1, 0.01), second).verdict == verdict


@pytest.mark.parametrize(
    ("name", "second", "spread"),
    [
        ("a_star", side(1.0, 0.14, 0.001), ""),
        ("a_star", side(1.0, 0.16, 0.001), WIDER),
        ("a_star", side(1.0, 0.06, 0.001), NARROWER),
        ("a_star", side(1.0, 0.16, 0.03), ""),  # so few draws that the widths may be alike
        ("weight", side(1.0, 0.0, 0.001), ""),
        ("required_damping", side(1.0, 0.5, 0.001), ""),
        ("a_star", None, ""),
    ],
)
def test_an_interval_that_is_far_wider_is_told(name: str, second: Side | None, spread: str) -> None:
    assert Difference(name, "t", "A/D", side(1.0, 0.1, 0.001), second).spread == spread


def test_wider_intervals_are_marked_and_counted_and_the_folders_are_named(
    small_results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Medians that are alike say nothing of a fit whose answer is ten times as vague."""
    other = tmp_path / "another"
    shutil.copytree(small_results, other)
    found = scruton.compare(small_results, other)
    wider = tuple(
        replace(one, second=replace(one.second, low=one.first.low - 9.0 * (one.first.high - one.first.low)))
        if one.name == "a_star" and one.first is not None and one.second is not None
        else one
        for one in found.differences
    )
    text = render_text(compared_blocks(replace(found, differences=wider), TERMINAL), 10**6)
    assert "The medians are alike within Monte Carlo error: all of" in text
    assert "Of the 90 % intervals, 1 wider in B by a factor of 1.5 or more: most that of stable amplitude of" in text
    assert ", 10 times." in text
    assert sum(line.rstrip().endswith("wider") for line in text.splitlines()) == 1
    assert main(["compare", str(small_results), str(other), "--html", str(tmp_path / "page.html")]) in (0, 1)
    said, page = capsys.readouterr().out, (tmp_path / "page.html").read_text(encoding="utf-8")
    for folder in (str(small_results), str(other)):
        assert f"({folder})" in said
        assert f"({folder})" in page
    assert [one["folder"] for one in found.to_json()["sides"]] == [str(small_results), str(other)]


def test_required_damping_is_that_of_any_mode_where_the_bridge_asks_for_it() -> None:
    each = sizing(modes=2)
    for mode in each["modes"]:
        mode["limits"][0]["required_mcse"] = {"0.95": 1e-4}
    asked = each["modes"][0]["damper"] | {"asked": {"risk": 0.05, "risk_of": "any"}}
    together = {"risk": 0.05, "required": [0.005, 0.006], "reach": [None, None]}
    anyone = each | {
        "modes": [mode | {"damper": asked} for mode in each["modes"]],
        "all_modes": each["all_modes"] | {"required_for_any": together},
    }
    found = [(one.of, one.first.median, one.second.median) for one in _required(each, anyone)]
    assert found == [("V1", 0.004, 0.005), ("V2", 0.004, 0.006)]


def test_a_result_beside_itself_is_alike_throughout(small_results: Path) -> None:
    found = scruton.compare(small_results, str(small_results), scruton_numbers=[30.0])
    assert {one.verdict for one in found.differences} == {ALIKE}
    assert found.inputs == ()
    assert {"damping_ratio", "a_star", "Y1", "epsilon", "weight", "amplitude"} <= {
        one.name for one in found.differences
    }
    assert len(repr(found)) < 200


def test_numbers_are_those_of_the_results(small_results: Path) -> None:
    _, summary = read_tree(small_results)
    found = {(one.name, one.of): one for one in scruton.compare(small_results, small_results).differences}
    (test,) = summary["tests"]
    for name in ("a_star", "Y1", "epsilon", "relaxation_rate"):
        entry, first = test["parameters"][name], found[name, test["name"]].first
        assert first is not None
        assert first.median == pytest.approx(entry["median"], rel=1e-12)
        assert (first.low, first.high) == pytest.approx(tuple(entry["interval"]["0.90"]), rel=1e-9)


def test_intervals_have_the_digits_of_their_width() -> None:
    narrow = Side(0.006500, 0.006498, 0.006503, 1e-7)
    assert _side(narrow, 100.0, TERMINAL, ends=True) == ("0.6500", "0.6498 .. 0.6503"), "and not 0.65 .. 0.65"
    assert _side(None, 100.0, TERMINAL, ends=True) == ("-", "-")


def test_another_seed_is_alike_and_said(small_campaign: Path, quick_results: Path, tmp_path: Path) -> None:
    out, card = tmp_path / "fit", quick_results.parent / "card.toml"
    assert main(["fit", str(small_campaign), "-o", str(out), "--model", str(card), "--seed", "5", "--quiet"]) == 0
    found = scruton.compare(quick_results, out, scruton_numbers=[30.0])
    assert [one for one in found.differences if one.verdict in (MOVED, APART)] == []
    assert any(np.isfinite(one.change) and one.change for one in found.differences), "the draws are others"
    assert found.inputs == ("The seed: 0, and 5.",)


@pytest.mark.thorough
def test_another_campaign_is_apart_in_what_differs(
    small_campaign: Path, quick_results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Twice the displacement: the stable amplitude doubles, Sc stays."""
    copy = shutil.copytree(small_campaign, tmp_path / "twice")
    for name in ("decay.csv", "growth.csv"):
        head, *lines = (copy / name).read_text(encoding="utf-8").splitlines()
        rows = [f"{t},{2.0 * float(y):.9g}" for t, y in (line.split(",") for line in lines)]
        (copy / name).write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    results, card = [str(quick_results), str(tmp_path / "fit")], quick_results.parent / "card.toml"
    assert main(["fit", str(copy), "-o", results[1], "--model", str(card), "--quiet"]) in (0, 1)
    capsys.readouterr()
    page = tmp_path / "page.html"
    assert main(["compare", *results, "--json", "--html", str(page)]) in (0, 1)
    content = json.loads(capsys.readouterr().out)
    verdicts = {one["name"]: one["verdict"] for one in content["differences"]}
    assert (verdicts["a_star"], verdicts["scruton_number"]) == (APART, ALIKE)
    change = {one["name"]: one["change"] for one in content["differences"]}
    assert change["a_star"] == pytest.approx(1.0, abs=0.05)
    assert content["inputs"] == ["Files that differ: decay.csv, growth.csv."]
    text = page.read_text(encoding="utf-8")
    assert "APART" in text
    assert "<svg" in text or "data:image/svg+xml" in text
    assert "http://" not in text.replace("http://www.w3.org", "")


def test_parameters_of_a_law_that_does_not_hold_are_not_ranked_and_carry_a_caveat() -> None:
    """Y1 and epsilon move most, and mean nothing where n = -1 has no weight."""
    fits = (fake_fit(growth=False, sweeps=False), fake_fit(growth=False, sweeps=False, seed=2))
    for second, holds in ((fits[1], True), (led_by(fits[1], gompertz=1.0), False)):
        found = scruton.compare(fits[0], second)
        times = dict.fromkeys(FORCES, 20.0) | {"a_star": 3.0}
        found = replace(
            found,
            differences=tuple(
                replace(one, second=replace(one.second, median=times.get(one.name, 1.0) * one.second.median))
                for one in found.differences
            ),
        )
        text = render_text(compared_blocks(found, TERMINAL), 10**6)
        (answer,) = (line for line in text.splitlines() if "largest changes" in line)
        assert ("Y1 of" in answer) == holds
        assert ("Y1 and epsilon are not among them (of the law n=-1, WHICH DOES NOT HOLD IN B)" in answer) != holds
        for name in FORCES:
            assert (f"{name} (of the law n=-1, WHICH DOES NOT HOLD IN B)" in text) != holds
        assert [side["forces_hold"] for side in found.to_json()["sides"]] == [True, holds]


def test_what_has_nothing_in_common_is_refused(small_results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", str(small_results), str(small_results), "--test", "none"]) == 2
    assert "Sc 21.7" in capsys.readouterr().err
    assert main(["compare", str(small_results), str(small_results.parent)]) == 2
    assert "scruton fit" in capsys.readouterr().err
    with pytest.raises(InputError, match="no such file"):
        scruton.compare(small_results.parent, small_results)
