"""Figures: what they show is what the posterior says, and a reader can read them."""

import io
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from fake_fit import fake_fit
from fake_parts import sizing
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from scruton.arrays import FloatArray, thin
from scruton.campaign.schema import Motion
from scruton.dynamics import closed_form
from scruton.dynamics.departure import COLUMNS, relative_drift
from scruton.griffin.damping import aerodynamic_draws, amplitude_grid, total_draws, trial_draws
from scruton.griffin.posterior import draws_of
from scruton.infer.result_schema import dataset
from scruton.infer.results import Fit
from scruton.report.charts import griffin_chart
from scruton.report.figures import FigureWithCaption, all_figures, figure, save
from scruton.report.figures.criticism import corner_plot
from scruton.report.figures.damping import aerodynamic_damping_by_test
from scruton.report.figures.griffin import griffin_plot, has_lock_in, law_comparison, reciprocal_plot
from scruton.report.figures.griffin_axes import line_styles
from scruton.report.figures.records import predicted, record_figures, ring_down_figures, trial_comparison
from scruton.report.figures.registry import (
    Registered,
    chapter_of,
    contents,
    laid_out_once,
    registered,
    registered_name,
    rounded,
)
from scruton.report.figures.sizing import damper_masses, risk_curves, variance_shares
from scruton.report.figures.style import (
    WIDTH,
    alone,
    decimate,
    extremes,
    house_style,
    line_style,
    pages,
    shorten,
    thin_along,
)

STRANGE = ["虎门大桥 +3° α₀", "Sc_2 $5 & <b>", "a very long name of a test that goes on until it does not fit"]


@pytest.fixture(scope="module")
def fit() -> Fit:
    return fake_fit()


@pytest.fixture(scope="module")
def figures() -> list[FigureWithCaption]:
    return figures_with_one_chain(fake_fit(tests=2))


def figures_with_one_chain(fit: Fit) -> list[FigureWithCaption]:
    """All figures, corner and trace of the first test only: those of the others take long and are like them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("scruton.report.figures.criticism.CHAINS_SHOWN", 1)
        return list(all_figures(fit))


def by_name(figures: list[FigureWithCaption], name: str) -> FigureWithCaption:
    return next(one for one in figures if one.name == name)


def visible_texts(figure: Figure) -> list[Text]:
    texts = figure.findobj(lambda one: isinstance(one, Text))
    return [one for one in texts if one.get_visible() and one.get_text().strip() and on_screen(one)]


def on_screen(text: Text) -> bool:
    """Whether the text's axes, if it has any, are drawn, and a tick label belongs to a tick inside them."""
    return text.axes is None or text.axes.get_visible()


# ------------------------------------------------------------------------------------------------ the whole set


def test_every_figure_of_the_issue_is_there(figures: list[FigureWithCaption]) -> None:
    wanted = {
        "griffin", "griffin_reciprocal", "griffin_by_test", "records", "ring_downs", "aerodynamic_damping",
        "aerodynamic_damping_by_test", "stability", "laws", "trial_functions", "reciprocal_against_damping", "lock_in",
        "corner_1", "trace_1",
    }  # fmt: skip
    names = [one.name for one in figures]
    assert wanted <= set(names)
    assert len(names) == len(set(names))
    assert all(len(one.caption) > 60 and len(one.alt) > 30 for one in figures)


def test_axes_carry_units_and_type_is_large_enough(figures: list[FigureWithCaption]) -> None:
    for one in figures:
        assert one.figure.get_size_inches()[0] == pytest.approx(WIDTH)
        labels = [
            label
            for axes in one.figure.axes
            if axes.get_visible()
            for label in (axes.get_xlabel(), axes.get_ylabel())
            if label
        ]
        assert len(labels) >= 2, one.name
        assert all(label.endswith("]") for label in labels), (one.name, labels)
        assert min(text.get_fontsize() for text in visible_texts(one.figure)) >= 7.5, one.name


def test_svg_is_small_and_well_formed_and_nothing_leaves_the_page(figures: list[FigureWithCaption]) -> None:
    for one in figures:
        check_page(one)


def check_page(one: FigureWithCaption) -> None:
    buffer = io.BytesIO()
    with house_style(), laid_out_once(one.figure):
        page, renderer = one.figure.bbox, FigureCanvasAgg(one.figure).get_renderer()
        shown = [axes for axes in one.figure.axes if axes.get_visible()]
        legends = [*one.figure.legends, *(axes.get_legend() for axes in shown if axes.get_legend())]
        texts = [text for axes in shown for text in (axes._left_title, axes.xaxis.label, axes.yaxis.label)]  # type: ignore[attr-defined]
        for artist in (*legends, *(text for text in texts if text.get_text())):
            box = artist.get_window_extent(renderer)
            inside = page.x0 - 1 <= box.x0 <= box.x1 <= page.x1 + 1 and page.y0 - 1 <= box.y0 <= box.y1 <= page.y1 + 1
            assert inside, (one.name, artist)
        one.figure.savefig(buffer, format="svg")
    svg = rounded(buffer.getvalue())
    ET.fromstring(svg)
    assert len(svg) < 300_000, one.name


def test_drawing_leaves_no_trace(fit: Fit, tmp_path_factory: pytest.TempPathFactory) -> None:
    import matplotlib.pyplot as plt

    before = dict(mpl.rcParams)
    save(griffin_plot(fit), tmp_path_factory.mktemp("trace"), formats=("svg",))
    assert dict(mpl.rcParams) == before
    assert plt.get_fignums() == []


def test_the_figure_of_the_page_on_extending_is_drawn(fit: Fit, monkeypatch: pytest.MonkeyPatch) -> None:
    entries: dict[str, Registered] = {}
    monkeypatch.setattr("scruton.report.figures.registry._REGISTER", entries)
    page = (Path(__file__).parents[2] / "docs" / "extending.md").read_text(encoding="utf-8")
    code = page.partition("## A figure")[2].partition("```python")[2].partition("```")[0]
    exec(compile(code, "extending", "exec"), {"__name__": "extending_figure"})
    monkeypatch.setattr("scruton.report.figures.registry.registered", lambda: entries)
    (drawn,) = all_figures(fit)
    assert (drawn.name, chapter_of(drawn.name)) == ("damping_of_rigs", "structural")
    assert "3 rigs" in drawn.alt
    check_page(drawn)


def test_a_figure_is_registered_by_its_decorator_alone(fit: Fit, monkeypatch: pytest.MonkeyPatch) -> None:
    entries = dict(registered())
    monkeypatch.setattr("scruton.report.figures.registry.registered", lambda: entries)
    monkeypatch.setattr("scruton.report.figures.registry._REGISTER", entries)
    entries.clear()

    @figure("records", name="mine", what="Mine", caption="What is seen.", each=lambda fit: {"_1": "a", "_7": "b"})
    def mine(fit: Fit, letter: str) -> FigureWithCaption:
        return FigureWithCaption(Figure(), alt=f"{letter} of {fit.campaign.title}")

    @figure("gap", name="paged", what="Paged")
    def paged(fit: Fit) -> Iterator[FigureWithCaption]:
        yield from (FigureWithCaption(Figure(), caption=letter, alt=letter) for letter in "xy")

    drawn = list(all_figures(fit))
    assert [(one.name, one.caption) for one in drawn] == [
        ("mine_1", "What is seen."), ("mine_7", "What is seen."), ("paged", "x"), ("paged_2", "y"),
    ]  # fmt: skip
    assert drawn[1].alt == f"b of {fit.campaign.title}"
    assert [chapter_of(one.name) for one in drawn] == ["records", "records", "gap", "gap"]
    assert registered_name("paged_2") == "paged"
    assert chapter_of("nobodys") == "convergence"
    with pytest.raises(ValueError, match="two figures of the name mine"):
        figure("gap", name="mine")(paged)


# ------------------------------------------------------------------------------------------------ odd campaigns


def test_strange_names_fit_on_the_page() -> None:
    strange = fake_fit(names=STRANGE, growth=False)
    drawn = [griffin_plot(strange), trial_comparison(strange), *record_figures(strange)]
    for one in drawn:
        check_page(one)
    assert "$5" in by_name(drawn, "griffin").alt


def test_one_test_torsional_without_anything_else() -> None:
    one = fake_fit(
        motion=Motion.TORSIONAL, tests=1, growth=False, measured=False, sweeps=False, ringdowns=False, seed=3
    )
    drawn = figures_with_one_chain(one)
    assert not {"lock_in", "ring_downs"} & {each.name for each in drawn}
    griffin = by_name(drawn, "griffin").figure
    assert griffin.axes[0].get_ylabel() == "Stable amplitude [°]"
    assert griffin.axes[0].get_ylim()[1] > np.rad2deg(float(one.tree["posterior"]["a_star"].median()))
    labels = griffin.axes[0].get_legend_handles_labels()[1]
    assert "measured" not in labels
    for each in (by_name(drawn, "griffin"), by_name(drawn, "records")):
        check_page(each)


def test_very_long_records_stay_small() -> None:
    for one in record_figures(fake_fit(cycles_per_record=3000, tests=3)):
        check_page(one)


def test_lock_in_records_alone_have_no_damping_figures() -> None:
    names = {
        one.name for one in figures_with_one_chain(fake_fit(steady=True, tests=4, measured=False, ringdowns=False))
    }
    assert {"griffin", "records", "lock_in"} <= names
    assert not {"aerodynamic_damping", "stability", "trial_functions", "laws"} & names


def test_still_air_alone_gives_ring_downs_alone(fit: Fit) -> None:
    still = replace(fit, campaign=replace(fit.campaign, tests=(), sweeps=()))
    assert [one.name for one in all_figures(still)] == ["ring_downs"]
    assert ring_down_figures(replace(still, ringdowns={})) == []


def test_another_law_than_the_papers() -> None:
    other = fake_fit(law_n=2.0, growth=False)
    assert "Y1" not in other.tree["posterior"]
    for one in (reciprocal_plot(other), *aerodynamic_damping_by_test(other)):
        check_page(one)
    labels = [axes.get_xlabel() for axes in corner_plot(other, "Sc 1.9").figure.axes if axes.get_xlabel()]
    assert "noise factor [-]" in labels


def test_lock_in_needs_sweeps_or_several_speeds(fit: Fit) -> None:
    assert has_lock_in(fit)
    assert not has_lock_in(fake_fit(sweeps=False, ringdowns=False))
    assert has_lock_in(fake_fit(sweeps=False, ringdowns=False, steady=True, tests=4))


# ------------------------------------------------------------------------------------------------ what is drawn


def test_griffin_plot_passes_through_the_tests_and_marks_what_was_measured(fit: Fit) -> None:
    axes = griffin_plot(fit).figure.axes[0]
    for name, one in line_styles(fit.tree).items():
        sc, a_star = (float(np.median(draws_of(fit.tree, key, name))) for key in ("scruton_number", "a_star"))
        lines = [line for line in axes.lines if line.get_label() == f"from {name}"]
        assert [line.get_color() for line in lines] == [one.colour]
        x, y = (np.asarray(value, dtype=float) for value in lines[0].get_data())
        known = np.isfinite(y)
        assert np.interp(sc, x[known], y[known]) == pytest.approx(a_star, rel=0.01)
        assert name in [text.get_text() for text in axes.texts]
    assert "no physical meaning" in [text.get_text() for text in axes.texts]
    assert axes.get_xlim()[0] < 0.0
    assert "measured" in axes.get_legend_handles_labels()[1]


def test_griffin_plot_has_the_amplitudes_of_the_codes_beside(fit: Fit) -> None:
    one, section = griffin_plot(fit), fit.campaign.section
    axes = one.figure.axes[0]
    handbook = next(line for line in axes.lines if line.get_label() == "Japanese handbook, inclined webs")
    sc, amplitude = (np.asarray(value, dtype=float) for value in handbook.get_data())
    assert (sc > 0.0).all()
    shown = np.isfinite(amplitude)
    assert shown.any()
    assert np.nanmax(amplitude) <= axes.get_ylim()[1]
    by_hand = 0.13 * section.width / section.depth / sc[shown]
    np.testing.assert_allclose(amplitude[shown], by_hand, rtol=5e-3)
    assert "none a limit" in one.caption
    assert "c = 0.5" in one.caption
    assert "none a limit" not in reciprocal_plot(fit).caption


def test_reciprocal_is_a_straight_line_with_table_5_slopes(fit: Fit) -> None:
    axes = reciprocal_plot(fit).figure.axes[0]
    for name, slope in (("Sc 1.9", 0.8927), ("Sc 21.7", 0.7543), ("Sc 78.1", 0.9583)):
        line = next(one for one in axes.lines if one.get_label() == f"from {name}")
        x, y = (np.asarray(value, dtype=float)[np.isfinite(line.get_ydata())] for value in line.get_data())
        fitted, residual = np.polyfit(x, y, 1, full=True)[:2]
        assert fitted[0] == pytest.approx(slope, rel=0.03)
        assert np.sqrt(residual[0] / len(x)) < 0.005 * np.ptp(y)


def test_ehsan_and_scanlan_die_where_their_law_says(fit: Fit) -> None:
    right = law_comparison(fit).figure.axes[1]
    sc, reach = (
        float(np.median(draws_of(fit.tree, key, "Sc 21.7"))) for key in ("scruton_number", "relaxation_scruton_number")
    )
    thin_lines = [line for line in right.lines if line.get_color() == line_styles(fit.tree)["Sc 21.7"].colour]
    reached = max(
        float(np.asarray(line.get_xdata())[np.isfinite(line.get_ydata())].max())
        for line in thin_lines
        if np.size(line.get_xdata()) > 10
    )
    assert reached == pytest.approx(sc + reach / 2.0, abs=1.0)  # n = 2: zero at x = 1/2


@pytest.mark.parametrize("n", [-1.0, 2.0])
def test_total_damping_is_the_slope_of_the_closed_form(n: float) -> None:
    fit = fake_fit(tests=1, growth=False, law_n=n, laws=False)
    a_star, lam = (draws_of(fit.tree, key, "Sc 1.9") for key in ("a_star", "relaxation_rate"))
    grid = np.array([0.4, 1.0, 1.7]) * float(np.median(a_star))
    step = 1e-4
    slope = np.log(closed_form(step, grid, a_star[:, None], lam[:, None], n) / grid) / step
    found = total_draws(fit.tree, "Sc 1.9", grid)
    np.testing.assert_allclose(found, -slope / (2 * np.pi * 7.97), rtol=1e-3, atol=1e-7)
    xi = draws_of(fit.tree, "damping_ratio", "Sc 1.9")[:, None]
    np.testing.assert_allclose(aerodynamic_draws(fit.tree, "Sc 1.9", grid), found - xi, atol=1e-12)


def test_damping_is_that_of_the_law_with_the_departure_of_the_same_draws() -> None:
    fit = fake_fit(tests=1, growth=False, laws=False)
    a_star = draws_of(fit.tree, "a_star", "Sc 1.9")
    grid = np.array([0.4, 1.0, 1.7]) * float(np.median(a_star))
    kept = np.array([3, 40, 77])
    law = total_draws(fit.tree, "Sc 1.9", grid)[np.searchsorted(thin(a_star.size, 1000), kept)]
    theta = np.zeros((3, 1, COLUMNS))
    theta[:, 0, 0], theta[:, 0, 3] = (0.5, -0.3, 0.0), (0.4, 0.0, 0.0)
    group = dataset("departure", {"draw_number": kept[:, None], "column": theta}, test=["Sc 1.9"])
    fit.tree["departure"] = xr.DataTree(group)
    want = law * relative_drift(grid / a_star[kept, None], theta)
    np.testing.assert_allclose(total_draws(fit.tree, "Sc 1.9", grid), want, rtol=1e-12)
    assert np.abs(want / law - 1.0)[0, [0, 2]].min() > 0.1
    xi = draws_of(fit.tree, "damping_ratio", "Sc 1.9")[kept, None]
    np.testing.assert_allclose(aerodynamic_draws(fit.tree, "Sc 1.9", grid), want - xi, atol=1e-12)


def test_trial_band_is_eq_4_read_draw_by_draw(fit: Fit) -> None:
    record, test = "test2_decay.csv", "Sc 21.7"
    grid, draws = trial_draws(fit, record, test)
    constants = [fit.tree["trial_function"][key].sel(record=record).to_numpy().ravel() for key in "abcd"]
    xi = draws_of(fit.tree, "damping_ratio", test)
    omega = 2 * np.pi * 7.87
    low, high = np.nanquantile(draws, [0.05, 0.95], axis=0)
    middle = len(grid) // 2
    slow: list[float] = []
    t = np.linspace(0.0, 9.0, 20001)
    for (a, b, c, d), damping in zip(np.array(constants).T, xi, strict=True):
        value, slope = a * np.exp(b * t) + c * np.exp(d * t), a * b * np.exp(b * t) + c * d * np.exp(d * t)
        k = int(np.argmin(np.abs(value - grid[middle])))
        slow.append(-slope[k] / (omega * value[k]) - damping)
    expected = np.quantile(slow, [0.05, 0.95])
    width = expected[1] - expected[0]
    np.testing.assert_allclose([low[middle], high[middle]], expected, atol=0.3 * width)


def test_record_bands_are_quantiles_over_draws_of_that_record_alone(fit: Fit) -> None:
    record = "test2_growth.csv"
    found = predicted(fit.tree, record)
    assert found is not None
    time, mean, predictive = found
    cycles = fit.cycles[record]
    np.testing.assert_array_equal(time, cycles.time)
    of_record = [i for i, name in enumerate(fit.tree["constant_data"]["record"].to_numpy()) if name == record]
    one = fit.tree["posterior_predictive"]["mean_amplitude"].to_numpy()[0][:, of_record[7]]
    assert mean[:, 7] == pytest.approx([np.quantile(one, 0.05), np.quantile(one, 0.95)])
    assert np.all(np.diff(predictive, axis=0) >= np.diff(mean, axis=0) - 1e-6)
    assert predicted(fit.tree, "nosuch.csv") is None


def test_amplitude_grid_spans_the_transients_but_not_the_noise_floor(fit: Fit) -> None:
    grid = amplitude_grid(fit, "Sc 1.9")
    assert grid[0] == pytest.approx(0.2 * 0.0655, rel=0.1)
    assert grid[-1] == pytest.approx(2.2 * 0.0655, rel=0.05)


# ------------------------------------------------------------------------------------------------ saving


def test_same_fit_same_bytes(fit: Fit, tmp_path_factory: pytest.TempPathFactory) -> None:
    first, second = tmp_path_factory.mktemp("first"), tmp_path_factory.mktemp("second")
    paths = save(griffin_plot(fit), first)
    again = save(griffin_plot(fake_fit()), second)
    assert [path.name for path in paths] == ["griffin.svg", "griffin.png", "griffin.pdf"]
    for one, other in zip(paths, again, strict=True):
        assert one.read_bytes() == other.read_bytes(), one.suffix
    assert sorted(path.name for path in first.iterdir()) == sorted(path.name for path in paths)
    root = ET.fromstring(paths[0].read_bytes())
    assert "Stable amplitude" in ET.tostring(root, encoding="unicode")  # the caption goes along
    assert b"CreationDate" not in paths[2].read_bytes()


def test_saving_keeps_the_layout_for_the_next_time(fit: Fit, tmp_path_factory: pytest.TempPathFactory) -> None:
    one, folder = griffin_plot(fit), tmp_path_factory.mktemp("twice")
    first = save(one, folder, "a", formats=("svg",))[0].read_bytes()
    assert one.figure.get_layout_engine() is not None
    again = save(one, folder, "b", formats=("svg",))[0].read_bytes()
    # Laying out again begins where it stopped: places may round to another hundredth of a point, and ids with them.
    bare = re.compile(rb"[-0-9a-f.]+")
    assert bare.sub(b"", again) == bare.sub(b"", first)


def test_a_figure_without_a_name_is_refused(tmp_path_factory: pytest.TempPathFactory) -> None:
    with pytest.raises(ValueError, match="needs a name"):
        save(Figure(), tmp_path_factory.mktemp("none"))


# ------------------------------------------------------------------------------------------------ small parts


def slow_decimation(x: FloatArray, y: FloatArray, bins: int) -> set[tuple[float, float]]:
    kept = set()
    edges = np.linspace(0, len(y), bins + 1).astype(int)
    for begin, end in pairwise(edges):
        part = list(range(begin, end))
        kept |= {(float(x[k]), float(y[k])) for k in (min(part, key=lambda i: y[i]), max(part, key=lambda i: y[i]))}
    return kept


def test_decimation_keeps_the_extremes_of_every_bin() -> None:
    rng = np.random.default_rng(0)
    x, y = np.arange(5003.0), rng.standard_normal(5003)
    short_x, short_y = decimate(x, y, 100)
    assert set(zip(short_x.tolist(), short_y.tolist(), strict=True)) == slow_decimation(x, y, 100)
    assert np.all(np.diff(short_x) >= 0)
    assert decimate(x[:150], y[:150], 100)[1] is not None
    np.testing.assert_array_equal(decimate(x[:150], y[:150], 100)[1], y[:150])
    middle, low, high = extremes(x, y, 100)
    assert len(middle) == len(low) == len(high) == 100
    assert low.min() == y.min()
    assert high.max() == y.max()


def test_thinning_along_a_curve_follows_its_bends() -> None:
    decay = np.exp(-np.linspace(0.0, 100.0, 10_000))
    pick = thin_along(decay, 60)
    assert len(pick) <= 60
    assert pick[0] == 0
    assert pick[-1] == 9999
    assert np.abs(np.diff(decay[pick])).max() < 0.05  # evenly spaced in time the first step would be 0.8
    assert np.abs(np.diff(decay[thin(10_000, 60)])).max() > 0.5


def test_looks_are_distinct() -> None:
    assert len({(line_style(i).colour, str(line_style(i).line)) for i in range(35)}) == 35


def test_pages_are_evenly_filled() -> None:
    assert [len(page) for page in pages(list(range(13)), 6)] == [5, 5, 3]
    assert pages([], 6) == []
    assert [one for page in pages(list(range(13)), 6) for one in page] == list(range(13))


def test_long_names_are_cut_in_the_middle_and_dollars_kept_literal() -> None:
    assert shorten("short") == "short"
    assert shorten("a" * 30 + "b" * 30, 11) == "aaaaa…bbbbb"
    assert shorten("5 $ and 6 $") == r"5 \$ and 6 \$"


def test_a_band_without_an_end_is_drawn_within_reach_of_a_rasteriser() -> None:
    drawing, axes = alone(50.0)
    axes.fill_between([0.0, 1.0, 2.0], [0.0, 0.1, 0.2], [1e12, 0.5, -1e9])
    axes.set(xlim=(0.0, 2.0), ylim=(0.0, 1.0))
    svg, png = contents(drawing, ("svg", "png"))
    paths = re.findall(rb'\sd="([^"]*)"', svg)
    assert max(abs(float(number)) for path in paths for number in re.findall(rb"-?\d+\.?\d*", path)) == 9999.0
    assert png.startswith(b"\x89PNG")


def test_captions_speak_of_measured_points_where_there_are_any(fit: Fit) -> None:
    nothing = fake_fit(measured=False, growth=False, sweeps=False)
    assert all(point["tone"] == "posterior" for point in griffin_chart(nothing)["points"])
    for draw in (griffin_plot, law_comparison):
        assert "measured" not in draw(nothing).caption.replace("damping that the transients show", "")
        assert "points are measured" in draw(fit).caption.lower()
    assert "measured" in griffin_chart(fit)["key"]
    assert "measured" not in griffin_chart(nothing)["key"]


def test_a_colour_means_one_thing_in_the_figure_of_the_risk() -> None:
    content = sizing()
    curve = content["modes"][0]["limits"][0]["curve"]
    curve |= {f"amplitude_{q}": [0.2, 0.1, 0.05] for q in ("05", "50", "95")}
    curve["by_law"] = {"n=-1": [0.8, 0.3, 0.05], "n=2": [0.8, 0.2, 0.01]}
    left, right = risk_curves(content, content["modes"][0]).figure.axes
    limit = next(line.get_color() for line in right.lines if line.get_label() == "limit")
    laws = [line for line in left.lines if str(line.get_label()).startswith("n = ")]
    assert limit not in {line.get_color() for line in left.lines}
    assert len({line.get_color() for line in laws}) == 1, "told apart by their dashes"
    assert len({str(line.get_linestyle()) + str(line._dash_pattern) for line in laws}) == 2
    assert all(text.get_path_effects() for text in left.texts if "%" in text.get_text()), "no line strikes a name"


def test_shares_and_dampers_of_a_limit_out_of_reach_say_so_in_their_pictures() -> None:
    """No axes are empty without a word, and the heaviest dampers that are allowed are not called the heaviest."""
    content = sizing(None)
    (mode,) = content["modes"]
    none, some = {"source": "law", "first": 0.0, "total": 0.0}, {"source": "law", "first": 0.4, "total": 0.5}
    mode["shares"] = {"needed": [none], "amplitude": [some]}
    drawn = variance_shares(content, mode)
    left, right = drawn.figure.axes
    (told,) = (text.get_text() for text in left.texts)
    assert told == "nearly every draw needs more than 5.00 %,\nor the same in every draw"
    assert not right.texts
    assert right.get_title(loc="left") == "amplitude without added damping"
    assert "without added damping" in drawn.caption
    chart = {key: [0.05, 0.07] for key in ("mass", "mass_ratio", "probability", "stroke", "stroke_high")}
    mode["damper"] |= {"achievable": False, "mass": 0.05, "mass_ratio": 0.05, "map": chart}
    mode["damper"]["asked"] |= {"largest_mass_ratio": 0.05, "largest_stroke": None, "number": 1}
    drawn = damper_masses(content, mode)
    assert "heaviest allowed (5 %), and not enough" in drawn.figure.axes[0].get_legend_handles_labels()[1]
