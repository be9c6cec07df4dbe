"""Whether the numbers of a report contain what was found, in words."""

from types import SimpleNamespace
from typing import Any

from scruton.calibrate.challenge.case import simulate_case
from scruton.gap.data import load_gap
from scruton.gap.diagnosis import fit_null
from scruton.gap.meaning import meaning
from scruton.report.chapters.gap import gap_chapter, gap_summary
from scruton.report.chapters.gap_words import carried_sentence, contained_sentence
from scruton.report.chapters.material import Material
from scruton.report.render_text import render_text
from tests.report.fake_parts import GAP as MADE_UP

GAP: dict[str, Any] = MADE_UP
SURE: dict[str, Any] = {
    "verdict": "coulomb_friction",
    "also": ["stiffness_nonlinearity"],
    "probability": {"none": 0.01, "coulomb_friction": 0.93, "fluid_memory": 0.06},
    "probability_also": {"stiffness_nonlinearity": 0.85},
}
PUT_IN: dict[str, Any] = {
    "command": "--effect auto", "moves": "It moves by 5 %.", "remarks": ["Look at the log."], "text": "Some words."
}  # fmt: skip
OUT = " The same command without `--effect` takes it out."


def carried(*names: str) -> dict[str, Any]:
    return {"effect": {"used": names[0], "also": [*names[1:]]}}


def test_the_report_says_whether_its_numbers_contain_what_was_found() -> None:
    one = SURE | {"also": [], "meaning": PUT_IN}
    assert (
        contained_sentence(one, carried("coulomb_friction"))
        == f"The numbers of this report contain it. It moves by 5 %.{OUT}"
    )
    missing = "The numbers of this report do not contain it: `--effect auto` puts it in."
    assert contained_sentence(one, {}) == f"{missing} It moves by 5 %."
    assert contained_sentence(one | {"meaning": PUT_IN | {"moves": ""}}, {}) == missing
    unsure = one | {"probability": {"none": 0.1, "coulomb_friction": 0.5, "fluid_memory": 0.4}}
    assert contained_sentence(unsure, {}) == f"{missing} If it is the first of these: it moves by 5 %."
    said = contained_sentence(unsure, carried("coulomb_friction"))
    assert said.startswith("The numbers of this report contain the first of these. ")
    assert contained_sentence(one, carried("fluid_memory")) == (
        "The numbers of this report contain “the wake lags”, as was asked, and not “dry friction”, which was found."
        + OUT
    )


def test_of_a_pair_the_report_says_which_of_both_its_numbers_contain() -> None:
    pair = SURE | {"meaning": PUT_IN}
    both = contained_sentence(pair, carried("coulomb_friction", "stiffness_nonlinearity"))
    assert both == f"The numbers of this report contain it. It moves by 5 %.{OUT}"
    assert contained_sentence(pair, carried("stiffness_nonlinearity")) == (
        "The numbers of this report contain “frequency varies with amplitude”, and not “dry friction”: `--effect auto` "
        "puts all of it in. It moves by 5 %."
    )
    unsure = pair | {"probability": {"none": 0.1, "coulomb_friction": 0.5, "fluid_memory": 0.4}}
    said = contained_sentence(unsure, carried("coulomb_friction", "stiffness_nonlinearity"))
    assert said.startswith("The numbers of this report contain the first of these and what stands beside it. ")
    assert "and not “frequency varies" in contained_sentence(pair, carried("coulomb_friction"))


def test_a_fit_says_what_it_puts_in_and_how_sure_that_is() -> None:
    entry = {"asked": "auto", "used": "coulomb_friction", "also": [], "probability": 0.93}
    said = "Predictions contain “dry friction”: the probability is 0.93."
    assert carried_sentence({"effect": entry}) == said
    unsure = "the probability is 0.55, which is not settled; the same command without `--effect` takes it out."
    assert (
        carried_sentence({"effect": entry | {"probability": 0.55}}) == f"Predictions contain “dry friction”: {unsure}"
    )
    asked = entry | {"asked": "coulomb_friction", "also": ["fluid_memory"], "probability": 0.03}
    assert carried_sentence({"effect": asked}).startswith(
        "Predictions contain “dry friction” and “the wake lags”, as was asked: the probability of the first is 0.030, "
    )
    none = {"asked": "auto", "used": "none", "also": [], "probability": 0.9}
    assert carried_sentence({"effect": none}) == "The diagnosis found no gap: predictions contain no effect."
    assert carried_sentence({}) == ""


def test_where_there_is_no_gap_nothing_is_to_be_put_in() -> None:
    data, null = fit_null(load_gap(simulate_case(900, 1, None, 0.0)[0]))
    none: Any = SimpleNamespace(verdict="none", found=(), data=data, null=null, final=null)
    empty = meaning(none)
    assert empty["command"] is None
    assert empty["text"] == "There is nothing to be put into the predictions."
    gap = {"verdict": "none", "also": [], "probability": {"none": 0.98, "fluid_memory": 0.02}, "meaning": empty}
    assert contained_sentence(gap, carried("none")) == contained_sentence(gap, {}) == empty["text"]
    assert contained_sentence(gap, carried("fluid_memory")) == (
        f"The numbers of this report contain “the wake lags”, as was asked, which was not found.{OUT}"
    )
    assert empty["text"] in render_text(gap_summary(GAP | gap | {"effects": {}}, "rad"))


def test_the_chapter_says_what_the_reports_own_numbers_contain() -> None:
    gap: Any = GAP | {"meaning": PUT_IN | {"text": "Predictions contain it only where they are told to."}}
    for summary, said in ((carried("coulomb_friction"), "contain it."), ({}, "do not contain it: `--effect auto`")):
        fit: Any = SimpleNamespace(
            summary=summary | {"tests": [], "provenance": {"tests": []}},
            campaign=SimpleNamespace(section=SimpleNamespace(amplitude_unit="A/D")),
        )
        text = render_text(list(gap_chapter(Material(fit, {}, gap=gap))))
        assert f"The numbers of this report {said}" in text
        assert "Look at the log." in text
        assert "only where they are told to" not in text
