"""The picture of a gap: it shows every test and rig, and marks where the effect acts."""

from dataclasses import replace
from pathlib import Path

import pytest
from matplotlib.colors import to_hex

from scruton.calibrate.challenge.case import simulate_case
from scruton.gap.diagnosis import Diagnosis, diagnose
from scruton.gap.finding import Finding
from scruton.gap.locate import locate
from scruton.gap.locate_curves import excess_curves
from scruton.report.chapters.gap_words import shrink_sentence
from scruton.report.figures import save
from scruton.report.figures.gap import gap_figure


@pytest.fixture(scope="module")
def clipped() -> tuple[Diagnosis, tuple[Finding, ...]]:
    diagnosis = diagnose(simulate_case(7, 3, "sensor_clipping", 0.4)[0])
    return diagnosis, locate(diagnosis)


def test_every_test_and_rig_has_its_panel_and_the_verdict_its_bar(
    clipped: tuple[Diagnosis, tuple[Finding, ...]], tmp_path: Path
) -> None:
    diagnosis, findings = clipped
    figure = gap_figure(diagnosis, findings).figure
    axes = [one for part in figure.subfigs for one in part.axes]
    titles = [one.get_title(loc="left") for one in axes]
    for name in (*diagnosis.data.tests, *diagnosis.data.rigs):
        assert any(name in title for title in titles)
    assert any("sensor clipping" in title for title in titles)
    bars = axes[-1]
    widest = max(bars.patches, key=lambda bar: bar.get_width())
    assert widest.get_width() == pytest.approx(max(diagnosis.probability.values()))
    assert bars.get_yticklabels()[0].get_text() == "sensor clipping"
    (path,) = save(figure, tmp_path, "gap", formats=("png",))
    assert path.stat().st_size > 10_000


def test_curves_lie_in_their_panels_where_they_leave_zero(clipped: tuple[Diagnosis, tuple[Finding, ...]]) -> None:
    diagnosis, findings = clipped
    curves = excess_curves(diagnosis.null)
    figure = gap_figure(diagnosis, findings, curves).figure
    marked = [c for c in curves.damping if c.places()]
    assert marked
    panels = figure.subfigs[0].axes
    for curve in marked:
        wind = diagnosis.data.layout.wind[curve.record]
        name = (diagnosis.data.tests[diagnosis.data.layout.test[curve.record]] if wind else
                f"{diagnosis.data.rigs[diagnosis.data.layout.rig[curve.record]]}, still air")  # fmt: skip
        (axes,) = [one for one in panels if name in one.get_title(loc="left")]
        low, high = axes.get_ylim()
        for place in curve.places():
            assert low < 100.0 * curve.excess[place].min()
            assert 100.0 * curve.excess[place].max() < high


def test_rigs_have_none_of_the_colours_of_growth_decay_and_still_air(
    clipped: tuple[Diagnosis, tuple[Finding, ...]],
) -> None:
    diagnosis, findings = clipped
    upper, lower = gap_figure(diagnosis, findings).figure.subfigs
    above = {line.get_color() for axes in upper.axes for line in axes.lines if "band" in str(line.get_label())}
    frequency, causes = lower.axes
    rigs = [line for line in frequency.lines if len(line.get_xdata()) > 2]
    assert above
    assert rigs
    assert not above & {line.get_color() for line in rigs}
    assert len({line.get_marker() for line in rigs}) == len(diagnosis.data.rigs)
    assert not above & {to_hex(bar.get_facecolor()).upper() for bar in causes.patches}


def test_the_headline_says_the_verdict(clipped: tuple[Diagnosis, tuple[Finding, ...]]) -> None:
    diagnosis, findings = clipped
    figure = gap_figure(diagnosis, findings).figure
    assert figure.get_suptitle().startswith("Sensor clipping")


def test_the_headline_says_what_is_not_settled_and_no_gap_has_its_bar(
    clipped: tuple[Diagnosis, tuple[Finding, ...]],
) -> None:
    diagnosis, findings = clipped
    names = [name for name in diagnosis.probability if name not in ("none", diagnosis.verdict)][:6]
    likely = dict.fromkeys(names, 0.07) | {diagnosis.verdict: 0.577, "none": 0.003}
    unsure = replace(
        diagnosis, probability=likely, found=(diagnosis.verdict, "fluid_memory"), also={"fluid_memory": 0.07}
    )
    figure = gap_figure(unsure, findings).figure
    headline = figure.get_suptitle().replace("\n", " ")
    assert headline.startswith("Not settled: sensor clipping (58 %) or ")
    assert headline.endswith("; no gap below 1 %; beside it perhaps fluid memory (7 %)")
    bars = [label.get_text() for label in figure.subfigs[1].axes[-1].get_yticklabels()]
    assert "no gap" in bars
    assert bars[0] == "sensor clipping"


def test_a_test_of_which_no_stable_amplitude_is_foretold_has_words() -> None:
    """A rig that dies out ended a diagnosis with a traceback, its results written already."""
    head = {"tests": 3, "amplitude_before": 0.21, "amplitude_after": None, "amplitude_worse": 2}
    said = shrink_sentence({"headline": head, "fraction": None})
    assert "off by 21 % (median) before and more than any measure after, made worse in 2 of 3" in said
