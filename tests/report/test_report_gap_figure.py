"""The picture of a gap: it shows every test and rig, and marks where the effect acts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from scruton.calibrate.challenge.case import simulate_case
from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Campaign, Kind, Motion, Record, Rig, Section
from scruton.gap.diagnosis import Diagnosis, diagnose
from scruton.gap.finding import Finding
from scruton.gap.locate import locate
from scruton.gap.locate_curves import excess_curves
from scruton.report.chapters.gap_words import shrink_sentence
from scruton.report.figures import save
from scruton.report.figures.gap import gap_figure
from scruton.report.verdict import conclusion
from tests.gap.few import among


@pytest.fixture(scope="module")
def clipped() -> tuple[Diagnosis, tuple[Finding, ...]]:
    rivals = among("sensor_clipping", "sensor_gain_error", "coulomb_friction", "fluid_memory")
    diagnosis = diagnose(simulate_case(7, 3, "sensor_clipping", 0.4)[0], prior=rivals)
    return diagnosis, locate(diagnosis)


@pytest.mark.thorough
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


@pytest.mark.thorough
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


@pytest.mark.thorough
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


def titles(figure: Figure) -> list[str]:
    return [one.get_title(loc="left").replace("\n", " ") for one in figure.subfigs[0].axes]


@pytest.mark.thorough
def test_rows_stand_in_the_order_of_the_scruton_numbers_and_what_is_left_out_is_said(
    clipped: tuple[Diagnosis, tuple[Finding, ...]], monkeypatch: pytest.MonkeyPatch
) -> None:
    diagnosis, findings = clipped
    layout = diagnosis.data.layout
    # the rig that is first in the campaign has the largest Scruton number
    falling = {0: 30.0, 1: 20.0, 2: 10.0}
    numbers = np.array([falling[i] if i >= 0 else np.nan for i in layout.test.tolist()])
    turned = replace(diagnosis, data=replace(diagnosis.data, layout=replace(layout, scruton_number=numbers)))
    drawn = gap_figure(turned, findings)
    found = [title for title in titles(drawn.figure) if "still air" not in title]
    assert [name in title for name, title in zip(diagnosis.data.tests[::-1], found, strict=True)] == [True] * 3
    assert "against amplitude for every test and" in drawn.caption
    monkeypatch.setattr("scruton.report.figures.gap.GAP_ROWS", 2)
    fewer = gap_figure(diagnosis, findings)
    assert len([title for title in titles(fewer.figure) if "still air" not in title]) == 2
    (missing,) = [name for name in diagnosis.data.tests if not any(name in title for title in titles(fewer.figure))]
    said = f"depart least: {missing} (1 of 3)"
    assert said in fewer.figure.subfigs[0].get_suptitle().replace("\n", " ")
    assert "2 tests, left out" in fewer.caption
    assert said in fewer.caption


@pytest.mark.thorough
def test_how_large_it_is_stands_under_the_title(clipped: tuple[Diagnosis, tuple[Finding, ...]]) -> None:
    diagnosis, findings = clipped
    line = gap_figure(diagnosis, findings).figure.subfigs[0].get_suptitle().replace("\n", " ")
    assert line.startswith("Size (90 % interval): sensor clipping ")
    assert "relative error of the reading at the largest amplitude" in line
    without = gap_figure(diagnosis, ()).figure.subfigs[0].get_suptitle()
    assert "saturation" in without, "a parameter, with its form, where no place tells"


@pytest.mark.thorough
def test_the_title_is_settled_where_the_sentence_is(clipped: tuple[Diagnosis, tuple[Finding, ...]]) -> None:
    """A verdict of 0.85 that nothing tells from another was bold and settled above the picture, and not below it."""
    diagnosis, findings = clipped
    alike = (diagnosis.verdict, "coulomb_friction")
    for groups, settled in ((), True), ((alike,), False):
        title = gap_figure(diagnosis, findings, groups=groups).figure.get_suptitle()
        said = {"verdict": diagnosis.verdict, "also": (), "probability": diagnosis.probability,
                "indistinguishable": groups}  # fmt: skip
        assert title.startswith("Not settled: ") != settled
        assert title.replace("\n", " ").lower() == conclusion(
            said, lambda name: name.replace("_", " ")
        ).lower().replace("none", "no gap")


@pytest.mark.thorough
def test_a_second_effect_has_a_bar_of_its_own_probability(clipped: tuple[Diagnosis, tuple[Finding, ...]]) -> None:
    diagnosis, findings = clipped
    beside = {"fluid_memory": {"fluid_memory": 0.87}}
    both = replace(diagnosis, found=(diagnosis.verdict, "fluid_memory"), beside=beside)
    bars = gap_figure(both, findings).figure.subfigs[1].axes[-1]
    labels = [label.get_text().replace("\n", " ") for label in bars.get_yticklabels()]
    assert labels[-1] == "beside it: fluid memory"
    assert labels.count("fluid memory") == 0
    assert bars.patches[-1].get_width() == pytest.approx(0.87)


@pytest.mark.thorough
def test_where_an_unknown_cause_acts_its_records_are_named(
    clipped: tuple[Diagnosis, tuple[Finding, ...]], monkeypatch: pytest.MonkeyPatch
) -> None:
    diagnosis, findings = clipped
    layout = diagnosis.data.layout
    record = int(np.flatnonzero(layout.wind)[0])
    name, test = layout.records[record], diagnosis.data.tests[layout.test[record]]
    monkeypatch.setattr("scruton.report.figures.gap.describe_unknown", lambda *_: {"records": [name]})
    marked = [title for title in titles(gap_figure(diagnosis, findings).figure) if "not in the catalogue" in title]
    assert len(marked) == 1
    assert test in marked[0]
    assert f"not in the catalogue in {name}" in marked[0]


@pytest.mark.thorough
def test_a_heavy_line_of_frequency_is_explained(clipped: tuple[Diagnosis, tuple[Finding, ...]]) -> None:
    diagnosis, findings = clipped
    curves = excess_curves(diagnosis.null)
    bent = [replace(c, excess=c.excess + 0.1) for c in curves.frequency]
    figure = gap_figure(diagnosis, findings, replace(curves, frequency=bent)).figure
    assert "frequency, where it changes" in [text.get_text() for text in figure.legends[0].get_texts()]
    names = [text.get_text() for text in figure.subfigs[1].axes[0].get_legend().get_texts()]
    assert names == list(diagnosis.data.rigs), "a colour for every rig, in order"


@pytest.mark.thorough
def test_the_headline_says_the_verdict(clipped: tuple[Diagnosis, tuple[Finding, ...]]) -> None:
    diagnosis, findings = clipped
    figure = gap_figure(diagnosis, findings).figure
    assert figure.get_suptitle().startswith("Sensor clipping")


@pytest.mark.thorough
def test_the_headline_says_what_is_not_settled_and_no_gap_has_its_bar(
    clipped: tuple[Diagnosis, tuple[Finding, ...]],
) -> None:
    diagnosis, findings = clipped
    names = [name for name in diagnosis.probability if name not in ("none", diagnosis.verdict)][:6]
    likely = dict.fromkeys(names, 0.07) | {diagnosis.verdict: 0.577, "none": 0.003}
    beside = {"fluid_memory": {"fluid_memory": 0.07, "none": 0.93}}
    unsure = replace(diagnosis, probability=likely, found=(diagnosis.verdict, "fluid_memory"), beside=beside)
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


def test_envelopes_alone_tell_no_frequency() -> None:
    time = np.arange(0.0, 60.0, 0.25)
    amplitude = 0.05 * np.exp(-0.03 * time) + 2e-5 * np.random.default_rng(1).standard_normal(time.size)
    record = Record("still.csv", Path("still.csv"), Kind.FREE_DECAY, time, amplitude, is_envelope=True)
    rig = Rig("rig", Quantity(4.0), None, None, (record,))
    diagnosis = diagnose(Campaign(Path(), "", "", Section(Motion.HEAVING, 0.3, 0.05), (rig,)), workers=1)
    (panel,) = [
        axes
        for part in gap_figure(diagnosis, ()).figure.subfigs
        for axes in part.axes
        if axes.get_title(loc="left") == "Frequency against amplitude"
    ]
    assert [text.get_text() for text in panel.texts] == ["no record tells the frequency"]
