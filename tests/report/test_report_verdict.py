"""What a diagnosis concludes, in words: a verdict that the records cannot tell from another is not settled."""

from typing import Any

import pytest

from scruton.report.chapters.gap import gap_sentence, gap_summary
from scruton.report.render_text import render_text
from scruton.report.verdict import conclusion, settled
from tests.report.fake_parts import GAP


def gap(verdict: str, group: list[str], **probability: float) -> dict[str, Any]:
    shares = {"none": 0.002, **probability}
    return GAP | {"verdict": verdict, "also": [], "indistinguishable": [group], "probability": shares}


@pytest.mark.parametrize(
    ("verdict", "other"),
    [
        ("reduced_velocity_drift", "setting_dependence"),
        ("spanwise_coherence_loss", "aerodynamic_damping_nonlinearity"),
        ("fluid_memory", "aerodynamic_damping_nonlinearity"),
    ],
)
def test_a_verdict_with_another_in_its_group_is_not_settled(verdict: str, other: str) -> None:
    both = gap(verdict, [verdict, other], **{verdict: 0.9, other: 0.03, "coulomb_friction": 0.05})
    assert not settled(both)
    assert conclusion(both, str) == f"not settled: {verdict} (90 %) or {other} (3 %); no gap below 1 %"
    assert gap_sentence(both).startswith("The null model and the records part. Not settled: ")
    assert f"If it is {other}: " in render_text(gap_summary(both, "rad"))
    alone = both | {"indistinguishable": [[verdict], [other, "coulomb_friction"]]}
    assert settled(alone)
    assert conclusion(alone, str) == verdict


def test_what_could_be_there_unseen_leaves_no_gap_settled() -> None:
    assert settled(gap("none", ["none", "fluid_memory"], none=0.9, fluid_memory=0.05))


def test_below_that_probability_the_likeliest_are_named_whatever_the_group() -> None:
    names = ["fluid_memory", "aerodynamic_damping_nonlinearity"]
    doubtful = gap("fluid_memory", names, fluid_memory=0.6, coulomb_friction=0.3, **{names[1]: 0.08})
    assert conclusion(doubtful, str).startswith("not settled: fluid_memory (60 %) or coulomb_friction (30 %); no gap")


def test_beside_no_gap_nothing_is_named_that_has_next_to_no_probability() -> None:
    """The sentence, the table and what cannot be told apart name the same."""
    shares = {"none": 0.735, "unknown": 0.236, "wind_speed_drift": 0.0055, "setting_dependence": 0.0017}
    doubtful = GAP | {
        "verdict": "none", "also": [], "indistinguishable": [["none", "setting_dependence"]], "probability": shares,
    }  # fmt: skip
    assert conclusion(doubtful, str) == "not settled: no gap (74 %), or unknown (24 %)"
    text = render_text(gap_summary(doubtful, "rad"))
    assert "cannot tell apart" not in text
    assert "setting_dependence" not in text
    seen = doubtful | {"probability": shares | {"setting_dependence": 0.04}}
    assert "cannot tell apart: none / setting_dependence" in render_text(gap_summary(seen, "rad"))


def test_every_member_of_a_group_has_a_row_of_the_table() -> None:
    both = gap("fluid_memory", ["fluid_memory", "coulomb_friction"], fluid_memory=0.9, coulomb_friction=0.001)
    assert "fluid_memory (90 %) or coulomb_friction (below 1 %)" in conclusion(both, str)
    rows = [line.split() for line in render_text(gap_summary(both, "rad")).splitlines()]
    assert ["coulomb_friction", "0.001"] in rows
