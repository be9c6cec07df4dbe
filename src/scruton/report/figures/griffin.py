"""Griffin plots: amplitude, or its reciprocal, against the Scruton number (the paper's Figs. 4, 10 and 12)."""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from scruton.griffin import predictive_draws, shared_curve, single_draws
from scruton.griffin.bands import GriffinBand, band, griffin_band, griffin_draws, index_draws
from scruton.griffin.posterior import mass_damping_draws, peak_names, unit_of
from scruton.griffin.thresholds import X_TRUSTED
from scruton.report.figures import style
from scruton.report.figures.griffin_axes import (
    SC_LABEL,
    deterministic,
    draw_band,
    frame,
    line_styles,
    points,
    sc_range,
    shade,
    stable_amplitude_label,
    test_points,
)
from scruton.report.figures.registry import FigureWithCaption, figure
from scruton.report.thresholds import MOST_BANDS, PANELS_A_PAGE

if TYPE_CHECKING:
    from scruton.infer.results import Fit

GRID = 161


@figure("griffin-plot", name="griffin", what="The Griffin plot")
def griffin_plot(fit: "Fit") -> FigureWithCaption:
    """Stable amplitude against Scruton number: every peak test's band, the predictive band, the measured points."""
    return _plot(fit, reciprocal=False)


@figure("reciprocal", name="griffin_reciprocal", what="The plot of 1/A")
def reciprocal_plot(fit: "Fit") -> FigureWithCaption:
    """The same as D/A (or 1/rad), in which the paper's law is a straight line (Fig. 10)."""
    return _plot(fit, reciprocal=True)


def _plot(fit: "Fit", *, reciprocal: bool) -> FigureWithCaption:
    tree, tests, styles, unit = fit.tree, peak_names(fit.tree), line_styles(fit.tree), unit_of(fit.tree)
    low, high = sc_range(tree, tests)
    grid = np.linspace(low, high, GRID)
    seed = int(fit.summary["provenance"]["seed"])
    draws = predictive_draws(tree, grid, seed=seed)
    discrepancy = float(np.median(shared_curve(tree, seed=seed).discrepancy))

    def shown(found: GriffinBand) -> GriffinBand:
        return found.reciprocal() if reciprocal else found

    predictive = shown(band(grid, draws, unit, "predictive"))
    drawing = style.new_figure(108.0)
    axes = drawing.subplots()
    shade(axes, grid, predictive)
    for name in tests:
        own = shown(griffin_band(tree, grid, name))
        draw_band(axes, own, styles[name], f"from {name}", bands=len(tests) <= MOST_BANDS)
    deterministic(axes, fit, tests, reciprocal=reciprocal)
    points(axes, fit, reciprocal=reciprocal)
    ceiling = _ceiling(fit, predictive, tests, reciprocal=reciprocal)
    frame(axes, (low, high), ceiling, note=0.6 if reciprocal else 0.3)
    axes.set_xlabel(SC_LABEL)
    axes.set_ylabel(_reciprocal_label(unit) if reciprocal else stable_amplitude_label(unit))
    if unit == "rad" and not reciprocal:
        style.add_degrees(axes)
    style.below(drawing, [axes])
    what = "Reciprocal stable amplitude" if reciprocal else "Stable amplitude"
    figures = "a straight line under the paper's law (n = -1)" if reciprocal else "the Griffin plot"
    return FigureWithCaption(
        drawing,
        caption=f"{what} against the Scruton number, {figures}. Coloured: what each peak test's records alone predict, "
        "median with 50 and 90 % credible bands, thin beyond an extrapolation index of 0.3. Grey: 90 % predictive band "
        f"of all peak tests together, laws weighed, for a setting that lies {discrepancy:.0%} off their curve. Dotted: "
        "the deterministic procedure of Eqs. (2) to (8). Filled points are measured, open ones are the posterior of "
        "each test's own stable amplitude with its 90 % interval. Negative Scruton numbers have no physical meaning.",
        alt=_alt(fit, tests, what),
    )


@figure(
    "griffin-plot",
    name="griffin_by_test",
    what="The Griffin plots of single tests",
    caption="The Griffin plot from one test at a time: 50 and 90 % credible bands of that test's curve, the 90 % "
    "predictive band with the discrepancy between settings, the deterministic curve of its "
    "records (dotted), and the points of every test. A test that predicts the others' points within the "
    "grey band bears the self-similarity out.",
)
def griffin_by_test(fit: "Fit") -> Iterable[FigureWithCaption]:
    """The Griffin plot that each peak test gives by itself, one panel a test, with the points of all the others."""
    tree, styles, unit, tests = fit.tree, line_styles(fit.tree), unit_of(fit.tree), peak_names(fit.tree)
    low, high = sc_range(tree, tests)
    grid = np.linspace(low, high, GRID)
    for page in style.pages(tests, PANELS_A_PAGE):
        drawing, panels = style.panels(len(page), height_mm=58.0, sharey=True)
        for axes, name in zip(panels, page, strict=True):
            draws = single_draws(tree, grid, name, seed=int(fit.summary["provenance"]["seed"]))
            predictive = band(grid, draws, unit, "predictive")
            shade(axes, grid, predictive)
            draw_band(axes, griffin_band(tree, grid, name), styles[name], "")
            deterministic(axes, fit, [name])
            points(axes, fit)
            frame(axes, (low, high), _ceiling(fit, predictive, tests), note=0.3 if axes is panels[0] else None)
            axes.set_title(f"from {style.shorten(name, 30)} alone")
        style.outer_labels(panels, SC_LABEL, stable_amplitude_label(unit))
        style.below(drawing, panels)
        yield FigureWithCaption(drawing, alt=_alt(fit, page, "Stable amplitude from one test at a time"))


@figure(
    "reciprocal",
    name="reciprocal_against_damping",
    what="The plot of 1/A against damping",
    caption="Reciprocal stable amplitude against the structural damping ratio, for the mass and the air of each test: "
    "median with 50 and 90 % credible bands. A straight line is what the paper's law says; a curve that bends up "
    "at small amplitude points at dry friction in the suspension.",
)
def reciprocal_against_damping(fit: "Fit") -> FigureWithCaption:
    """Reciprocal amplitude against the structural damping ratio, as Fig. 12, for each test's own mass and air."""
    tree, tests, styles, unit = fit.tree, peak_names(fit.tree), line_styles(fit.tree), unit_of(fit.tree)
    low, high = sc_range(tree, tests)
    factor = {name: mass_damping_draws(tree, name) for name in tests}
    heaviest = max(float(np.median(draws)) for draws in factor.values())
    ratio = np.linspace(low, high, GRID) / heaviest
    drawing = style.new_figure(95.0)
    axes = drawing.subplots()
    ceiling = 0.0
    for name in tests:
        sc = factor[name][:, None] * ratio
        beyond = np.abs(np.median(index_draws(tree, sc, name), axis=0)) > X_TRUSTED
        own = band(100.0 * ratio, griffin_draws(tree, sc, name), unit, name, beyond).reciprocal()
        draw_band(axes, own, styles[name], f"from {name}", bands=len(tests) <= MOST_BANDS)
        ceiling = max(ceiling, _ceiling(fit, own, tests, reciprocal=True))
    points(axes, fit, reciprocal=True, against_damping=True)
    frame(axes, (100.0 * ratio[0], 100.0 * ratio[-1]), ceiling, note=0.6)
    axes.set_xlabel("Structural damping ratio [%]")
    axes.set_ylabel(_reciprocal_label(unit))
    style.below(drawing, [axes])
    return FigureWithCaption(drawing, alt=_alt(fit, tests, "Reciprocal stable amplitude against damping ratio"))


def _reciprocal_label(unit: str) -> str:
    return "Reciprocal amplitude D/A [-]" if unit == "A/D" else "Reciprocal amplitude [1/rad]"


def _ceiling(fit: "Fit", predictive: GriffinBand, tests: Sequence[str], *, reciprocal: bool = False) -> float:
    """Top of the axis: all points, and the median where Sc is not negative, up to some times the largest point."""
    median = predictive.median[(predictive.scruton_number >= 0.0) & np.isfinite(predictive.median)]
    values = [value for point in test_points(fit, tests) for value in point.known if value > 0.0]
    largest = max(1.0 / value if reciprocal else value for value in values)
    curve = min(float(median.max(initial=0.0)), 2.5 * largest)
    return (1.15 if reciprocal else 1.3) * max(largest, curve)


def _alt(fit: "Fit", tests: Sequence[str], what: str) -> str:
    values = [
        f"{one.name}: Sc {one.scruton_number:.3g}, amplitude {one.median:.3g} {unit_of(fit.tree)} "
        f"(90 % {one.low:.3g} to {one.high:.3g})"
        for one in test_points(fit, tests[:8])
    ]
    return f"{what} against the Scruton number. " + "; ".join(values) + "."
