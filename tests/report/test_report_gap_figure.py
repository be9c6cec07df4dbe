"""The picture of a gap: it shows every test and rig, and marks where the effect acts."""

from dataclasses import replace
from pathlib import Path

import pytest

from scruton.calibrate.challenge.case import simulate_case
from scruton.gap.diagnosis import Diagnosis, diagnose
from scruton.gap.finding import Finding
from scruton.gap.locate import locate
from scruton.gap.locate_curves import excess_curves
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
