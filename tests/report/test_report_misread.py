"""Pictures that were misread: what is written lies inside its panel, apart from the next, and says what is drawn."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from scruton.report.figures import griffin_axes, style
from scruton.report.figures.criticism import _innovation_row
from scruton.report.figures.damping import stability_figures
from scruton.report.figures.sizing import decision_plot, required_plot
from tests.report.fake_fit import fake_fit
from tests.report.fake_parts import sizing


def drawn(figure):
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return canvas.get_renderer()


def test_amplitudes_under_innovations_stand_apart():
    """In a quarter of the page there is no room for three decimals at more than three places."""
    rng = np.random.default_rng(0)
    with style.house_style():
        figure = style.new_figure(46.0)
        row = figure.subplots(1, 4)
        amplitude = np.linspace(0.003, 0.0906, 224)
        record = SimpleNamespace(test="t", record="r", amplitude=amplitude, time=0.2 * np.arange(224.0))
        _innovation_row(row, record, rng.standard_normal(224), 1.0)
        renderer = drawn(figure)
        low, high = row[1].get_xlim()
        ticks = row[1].xaxis.get_major_ticks()
        shown = [tick.label1.get_window_extent(renderer) for tick in ticks if low <= tick.get_loc() <= high]
    assert len(shown) >= 2
    assert all(right.x0 - left.x1 > 3.0 for left, right in pairwise(shown))


@pytest.mark.parametrize("note", [0.3, 0.6])
def test_what_has_no_physical_meaning_is_said_above_the_axis(note):
    with style.house_style():
        figure, (axes, _) = style.panels(2, height_mm=54.0)
        figure.legend([axes.plot([0, 1])[0]] * 4, ["one", "two", "three", "four"], loc="outside lower center", ncols=2)
        axes.set(title="from A alone", xlabel="Sc")
        griffin_axes.frame(axes, (-3.0, 28.0), 0.21, note=note)
        renderer = drawn(figure)
        text, panel = axes.texts[0].get_window_extent(renderer), axes.get_window_extent(renderer)
    assert panel.y0 < text.y0 < text.y1 < panel.y1


@pytest.mark.parametrize(("high", "written"), [(0.8, False), (4.0, True)])
def test_the_interval_of_the_bridge_as_it_is_is_shown_whole_or_its_end_is_written(high, written):
    content = sizing(0.002)
    mode = content["modes"][0]
    limit = mode["limits"][0]
    curve = limit["curve"] | {
        "amplitude_05": [0.3, 0.2, 0.1], "amplitude_50": [0.5, 0.4, 0.2], "amplitude_95": [high, 0.6, 0.3],
    }  # fmt: skip
    mode = mode | {"limits": [limit | {"curve": curve, "limit": 0.05}]}
    axes = decision_plot(content | {"modes": [mode]}, mode).figure.axes[0]
    end = 1000.0 * high / axes.get_ylim()[1]  # the axis is in mm
    assert (end > 1.0) == written
    assert any("to 4" in text.get_text() for text in axes.texts) == written


def test_a_limit_beside_its_bars_is_written_in_full():
    content = sizing()
    mode = content["modes"][0]
    fixed = mode["limits"][0] | {"rule": "0.15 m", "title": "a fixed amplitude"}
    axes = required_plot(content | {"modes": [mode | {"limits": [fixed]}]}).figure.axes[0]
    assert [text.get_text() for text in axes.get_yticklabels()] == ["V1\na fixed amplitude, 0.15 m"]


def test_where_vibration_grows_and_where_it_decays_is_written_where_it_does():
    """At small amplitudes the total damping is below zero, at large ones above it."""
    (first, *_) = stability_figures(fake_fit(growth=False, sweeps=False))
    axes = first.figure.axes[0]
    drawn(first.figure)
    places = {text.get_text(): text.get_window_extent() for text in axes.texts if text.get_text()}
    marker = next(line for line in axes.lines if line.get_marker() == "o")
    x, zero = axes.transData.transform((float(marker.get_xdata()[0]), 0.0))
    assert places["grows"].x1 < x
    assert places["grows"].y1 < zero
    assert places["decays"].x0 > x
    assert places["decays"].y0 > zero
