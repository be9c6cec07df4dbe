"""Griffin plots: amplitude, or its reciprocal, against the Scruton number (the paper's Figs. 4, 10 and 12)."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.griffin import predictive_draws, shared_curve, single_draws
from scruton.griffin.bands import GriffinBand, band, griffin_band, griffin_draws, index_draws
from scruton.griffin.posterior import draws_of, mass_damping_draws, peak_names, test_names, unit_of
from scruton.griffin.thresholds import X_TRUSTED
from scruton.report.figures.style import (
    BLACK,
    GREY,
    LIGHT,
    FigureWithCaption,
    Look,
    add_degrees,
    amplitude_label,
    below,
    house_style,
    look,
    new_figure,
    pages,
    panels,
    shorten,
    thin_along,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from scruton.envelope import FrontEnd
    from scruton.infer.results import Fit

SC_LABEL = "Scruton number Sc [-]"
GRID = 161
PANELS = 6
_LABELLED = 9  # points that get their name beside them
_BANDS = 7  # tests whose bands are drawn; of more only the medians
_POINTS = 150  # of a deterministic curve


def looks(tree: "xr.DataTree") -> dict[str, Look]:
    """The look of every test, the same in all figures; peak tests have the first and most different ones."""
    order = dict.fromkeys([*peak_names(tree), *test_names(tree)])
    return {name: look(i) for i, name in enumerate(order)}


def sc_range(tree: "xr.DataTree", tests: Sequence[str]) -> tuple[float, float]:
    """Scruton numbers worth drawing: the tested ones, a little beyond, and somewhat below zero."""
    sc = [float(np.median(draws_of(tree, "scruton_number", one))) for one in tests]
    reach = [float(np.median(draws_of(tree, "relaxation_scruton_number", one))) for one in tests]
    upper = 1.15 * max(sc)
    if max(sc) < 1.5 * min(sc):  # one setting: show what one relaxation rate more of damping does
        upper = max(upper, max(sc) + float(np.median(reach)))
    lower = max(-0.1 * upper, min(s - 0.9 * r for s, r in zip(sc, reach, strict=True)))
    return min(lower, -0.02 * upper), upper


def griffin_plot(fit: "Fit") -> FigureWithCaption:
    """Stable amplitude against Scruton number: every peak test's band, the predictive band, the measured points.

    Parameters
    ----------
    fit : Fit
        With one test in wind or more.
    """
    return _plot(fit, reciprocal=False)


def reciprocal_plot(fit: "Fit") -> FigureWithCaption:
    """The same as D/A (or 1/rad), in which the paper's law is a straight line (Fig. 10)."""
    return _plot(fit, reciprocal=True)


def _plot(fit: "Fit", *, reciprocal: bool) -> FigureWithCaption:
    tree, tests, style = fit.tree, peak_names(fit.tree), looks(fit.tree)
    unit = unit_of(tree)
    low, high = sc_range(tree, tests)
    grid = np.linspace(low, high, GRID)
    seed = int(fit.summary["provenance"]["seed"])
    draws = predictive_draws(tree, grid, seed=seed)
    discrepancy = float(np.median(shared_curve(tree, seed=seed).discrepancy))
    predictive = _as(band(grid, draws, unit, "predictive"), reciprocal)
    with house_style():
        figure = new_figure(108.0)
        axes = figure.subplots()
        shade(axes, grid, predictive)
        for name in tests:
            one = _as(griffin_band(tree, grid, name), reciprocal)
            draw_band(axes, one, style[name], f"from {name}", bands=len(tests) <= _BANDS)
        deterministic(axes, fit, tests, reciprocal=reciprocal)
        points(axes, fit, reciprocal=reciprocal)
        frame(
            axes, (low, high), _ceiling(fit, predictive, tests, reciprocal=reciprocal), note=0.6 if reciprocal else 0.3
        )
        axes.set_xlabel(SC_LABEL)
        axes.set_ylabel(_amplitude(unit, reciprocal))
        if unit == "rad" and not reciprocal:
            add_degrees(axes)
        below(figure, [axes])
    what = "Reciprocal stable amplitude" if reciprocal else "Stable amplitude"
    figures = "a straight line under the paper's law (n = -1)" if reciprocal else "the Griffin plot"
    return FigureWithCaption(
        figure,
        "griffin_reciprocal" if reciprocal else "griffin",
        f"{what} against the Scruton number, {figures}. Coloured: what each peak test's records alone predict, median "
        "with 50 and 90 % credible bands, thin beyond an extrapolation index of 0.3. Grey: 90 % predictive band of all "
        f"peak tests together, laws weighed, for a setting that lies {discrepancy:.0%} off their curve. Dotted: "
        "the deterministic procedure of Eqs. (2) to (8). Filled points are measured, open ones are the posterior of "
        "each test's own stable amplitude with its 90 % interval. Negative Scruton numbers have no physical meaning.",
        _alt(fit, tests, what),
    )


def griffin_by_test(fit: "Fit") -> list[FigureWithCaption]:
    """The Griffin plot that each peak test gives by itself, one panel a test, with the points of all the others."""
    tree, style, unit = fit.tree, looks(fit.tree), unit_of(fit.tree)
    tests = peak_names(tree)
    low, high = sc_range(tree, tests)
    grid = np.linspace(low, high, GRID)
    found = []
    for number, page in enumerate(pages(tests, PANELS), 1):
        with house_style():
            figure, axes = panels(len(page), height_mm=58.0, sharey=True)
            for one, name in zip(axes, page, strict=True):
                draws = single_draws(tree, grid, name, seed=int(fit.summary["provenance"]["seed"]))
                predictive = band(grid, draws, unit, "predictive")
                shade(one, grid, predictive)
                draw_band(one, griffin_band(tree, grid, name), style[name], "")
                deterministic(one, fit, [name])
                points(one, fit)
                frame(one, (low, high), _ceiling(fit, predictive, tests), note=0.3 if one is axes[0] else None)
                one.set_title(f"from {shorten(name, 30)} alone")
            columns = min(2, len(page))
            for one in axes[::columns]:
                one.set_ylabel(_amplitude(unit, False))
            for one in axes[-columns:]:
                one.set_xlabel(SC_LABEL)
            below(figure, axes)
        found.append(
            FigureWithCaption(
                figure,
                "griffin_by_test" if number == 1 else f"griffin_by_test_{number}",
                "The Griffin plot from one test at a time: 50 and 90 % credible bands of that test's curve, the 90 % "
                "predictive band with the discrepancy between settings, the deterministic curve of its "
                "records (dotted), and the points of every test. A test that predicts the others' points within the "
                "grey band bears the self-similarity out.",
                _alt(fit, page, "Stable amplitude from one test at a time"),
            )
        )
    return found


def reciprocal_against_damping(fit: "Fit") -> FigureWithCaption:
    """Reciprocal amplitude against the structural damping ratio, as Fig. 12, for each test's own mass and air."""
    tree, tests, style, unit = fit.tree, peak_names(fit.tree), looks(fit.tree), unit_of(fit.tree)
    low, high = sc_range(tree, tests)
    factor = {name: mass_damping_draws(tree, name) for name in tests}
    heaviest = max(float(np.median(one)) for one in factor.values())
    ratio = np.linspace(low, high, GRID) / heaviest
    with house_style():
        figure = new_figure(95.0)
        axes = figure.subplots()
        ceiling = 0.0
        for name in tests:
            sc = factor[name][:, None] * ratio
            beyond = np.abs(np.median(index_draws(tree, sc, name), axis=0)) > X_TRUSTED
            one = band(100.0 * ratio, griffin_draws(tree, sc, name)[0], unit, name, beyond).reciprocal()
            draw_band(axes, one, style[name], f"from {name}", bands=len(tests) <= _BANDS)
            ceiling = max(ceiling, _ceiling(fit, one, tests, reciprocal=True))
        points(axes, fit, reciprocal=True, against_damping=True)
        frame(axes, (100.0 * ratio[0], 100.0 * ratio[-1]), ceiling, note=0.6)
        axes.set_xlabel("Structural damping ratio [%]")
        axes.set_ylabel(_amplitude(unit, True))
        below(figure, [axes])
    return FigureWithCaption(
        figure,
        "reciprocal_against_damping",
        "Reciprocal stable amplitude against the structural damping ratio, for the mass and the air of each test: "
        "median with 50 and 90 % credible bands. A straight line is what the paper's law says; a curve that bends up "
        "at small amplitude points at dry friction in the suspension.",
        _alt(fit, tests, "Reciprocal stable amplitude against damping ratio"),
    )


def draw_band(axes: "Axes", one: GriffinBand, look: Look, label: str, *, bands: bool = True) -> None:
    """Median with 50 and 90 % bands; the median is thin where the band is extrapolated."""
    sc, median = one.scruton_number, _finite(one.median)
    median = np.where((median == 0.0) & (np.roll(median, 1) == 0.0), np.nan, median)  # dead: stop at the axis
    if bands:
        for probability, alpha in ((0.90, 0.22), (0.50, 0.35)):
            axes.fill_between(sc, *_finite(one.intervals[probability]), color=look.colour, alpha=alpha, lw=0, zorder=2)
    trusted = np.where(one.extrapolated, np.nan, median)
    inner = ~one.extrapolated
    inner[1:-1] &= ~one.extrapolated[2:] & ~one.extrapolated[:-2]  # the two lines meet
    axes.plot(sc, np.where(inner, np.nan, median), color=look.colour, ls=look.line, lw=0.8, zorder=3)
    axes.plot(
        sc, trusted, color=look.colour, ls=look.line, lw=1.8, label=shorten(label) or "median, 50 and 90 %", zorder=3
    )


def shade(axes: "Axes", grid: FloatArray, predictive: GriffinBand) -> None:
    """The 90 % predictive band, in grey behind everything."""
    low, high = _finite(predictive.intervals[0.90])
    axes.fill_between(grid, low, high, color=LIGHT, alpha=0.45, lw=0, label="predictive, 90 %", zorder=1)
    axes.plot(grid, low, color=GREY, lw=0.5, zorder=1)
    axes.plot(grid, high, color=GREY, lw=0.5, zorder=1)


def deterministic(axes: "Axes", fit: "Fit", tests: Sequence[str], *, reciprocal: bool = False) -> None:
    """Curves of the paper's own procedure, one for each transient record of these tests."""
    label = "Eqs. (2)-(8), deterministic"
    for name in tests:
        for record in fit.campaign.test(name).records:
            if record.name in fit.front_ends:
                plot_curve(axes, fit.front_ends[record.name], reciprocal=reciprocal, label=label)
                label = ""


def plot_curve(axes: "Axes", front: "FrontEnd", *, reciprocal: bool = False, label: str = "", **kwargs: Any) -> None:
    """Draw one constructed Griffin curve."""
    pick = thin_along(np.log(np.maximum(front.griffin.amplitude, 1e-12)), _POINTS)
    style: dict[str, Any] = {"color": BLACK, "ls": ":", "lw": 1.0, "zorder": 4} | kwargs
    amplitude = np.where(front.griffin.amplitude[pick] > 0.0, front.griffin.amplitude[pick], np.nan)
    axes.plot(
        front.griffin.scruton_number[pick],
        1.0 / amplitude if reciprocal else amplitude,
        **style,
        label=label,
    )


def points(
    axes: "Axes", fit: "Fit", *, reciprocal: bool = False, against_damping: bool = False, own: bool = True
) -> None:
    """Measured stable amplitudes (filled, named) and each test's own posterior (open), where they were tested."""
    tree, style, peaks = fit.tree, looks(fit.tree), set(peak_names(fit.tree))
    names = [name for name in test_names(tree) if name in peaks]
    first = {"measured": "measured", "own": "posterior of each test, 90 %"}
    named: list[tuple[str, float, float]] = []
    for name in names:
        x = float(np.median(draws_of(tree, "scruton_number", name)))
        if against_damping:
            x = 100.0 * float(np.median(draws_of(tree, "damping_ratio", name)))
        low, middle, high = np.quantile(draws_of(tree, "a_star", name), [0.05, 0.5, 0.95])
        if reciprocal:
            low, middle, high = 1.0 / high, 1.0 / middle, 1.0 / low
        measured = fit.campaign.test(name).stable_amplitude
        if own or measured is None:
            axes.errorbar(
                [x], [middle], [[middle - low], [high - middle]], fmt=style[name].marker, ms=6.5, mfc="none",
                color=style[name].colour, elinewidth=0.8, capsize=2, zorder=5, label=first.pop("own", ""),
            )  # fmt: skip
        at = middle
        if measured is not None and measured.mean > 0.0:
            at = 1.0 / measured.mean if reciprocal else measured.mean
            sd = 1.645 * (measured.sd or 0.0)
            spread = sd / measured.mean**2 if reciprocal else sd
            axes.errorbar(
                [x], [at], [[spread], [spread]] if spread else None, fmt=style[name].marker, ms=4.0, color=BLACK,
                elinewidth=0.8, capsize=2, zorder=6, label=first.pop("measured", ""),
            )  # fmt: skip
        named.append((name, x, at))
    if len(named) <= _LABELLED:
        _name_points(axes, named, rising=reciprocal)


def _name_points(axes: "Axes", named: Sequence[tuple[str, float, float]], *, rising: bool) -> None:
    """Write the names beside the points, on the outer side of the curve; neighbours are stacked away from it."""
    from matplotlib.patheffects import withStroke

    right = max(x for _, x, _ in named)
    top = max(y for _, _, y in named)
    away = -1.0 if rising else 1.0
    level, before = 0, (-np.inf, -np.inf)
    for name, x, y in sorted(named, key=lambda one: one[1]):
        close = abs(x - before[0]) < 0.15 * right and abs(y - before[1]) < 0.12 * top
        level, before = (level + 1 if close else 0), (x, y)
        edge = x > 0.75 * right and len(named) > 1 and level == 0  # no room at the right edge
        axes.annotate(
            shorten(name, 18), (x, y), textcoords="offset points", zorder=7, fontsize=7.5,
            xytext=(0.0 if edge else 5.0 + 7.0 * level, away * (9.0 if edge else 5.0 + 10.0 * level)),
            ha="center" if edge else "left", va="top" if rising else "bottom",
            path_effects=[withStroke(linewidth=1.8, foreground="white", alpha=0.8)],
            arrowprops={"arrowstyle": "-", "lw": 0.4, "color": GREY, "shrinkA": 0, "shrinkB": 3} if level else None,
        )  # fmt: skip


def frame(axes: "Axes", limits: tuple[float, float], ceiling: float, *, note: float | None = 0.3) -> None:
    """Limits, and the shaded strip of negative Scruton numbers (or damping ratios), its label at height `note`."""
    axes.set_xlim(*limits)
    axes.set_ylim(0.0, ceiling)
    if limits[0] < 0.0:
        axes.axvspan(limits[0], 0.0, facecolor="#EFEFEF", edgecolor=LIGHT, hatch="////", lw=0, zorder=0)
        axes.axvline(0.0, color=GREY, lw=0.6, zorder=0.5)
        if note is not None:
            axes.annotate(
                "no physical meaning", (0.5 * limits[0], note * ceiling), rotation=90, ha="center", va="center",
                fontsize=7.5, color=GREY, zorder=8,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.8},
            )  # fmt: skip


def _as(one: GriffinBand, reciprocal: bool) -> GriffinBand:
    return one.reciprocal() if reciprocal else one


def _amplitude(unit: str, reciprocal: bool) -> str:
    if not reciprocal:
        return "Stable " + amplitude_label(unit)[0].lower() + amplitude_label(unit)[1:]
    return "Reciprocal amplitude D/A [-]" if unit == "A/D" else "Reciprocal amplitude [1/rad]"


def _finite(values: FloatArray) -> FloatArray:
    """Draw infinity as far out as no axis reaches."""
    return np.where(np.isinf(values), np.sign(values) * 1e6, values)


def _ceiling(fit: "Fit", predictive: GriffinBand, tests: Sequence[str], *, reciprocal: bool = False) -> float:
    """Top of the axis: all points, and the median where Sc is not negative, up to some times the largest point."""
    median = predictive.median[(predictive.scruton_number >= 0.0) & np.isfinite(predictive.median)]
    measured = [fit.campaign.test(name).stable_amplitude for name in tests]
    values = [float(np.median(draws_of(fit.tree, "a_star", name))) for name in tests]
    values += [one.mean for one in measured if one is not None and one.mean > 0.0]
    largest = max(1.0 / one if reciprocal else one for one in values)
    curve = min(float(median.max(initial=0.0)), 2.5 * largest)
    return (1.15 if reciprocal else 1.3) * max(largest, curve)


def _alt(fit: "Fit", tests: Sequence[str], what: str) -> str:
    unit = unit_of(fit.tree)
    values = []
    for name in tests[:8]:
        sc = float(np.median(draws_of(fit.tree, "scruton_number", name)))
        low, middle, high = np.quantile(draws_of(fit.tree, "a_star", name), [0.05, 0.5, 0.95])
        values.append(f"{name}: Sc {sc:.3g}, amplitude {middle:.3g} {unit} (90 % {low:.3g} to {high:.3g})")
    return f"{what} against the Scruton number. " + "; ".join(values) + "."
