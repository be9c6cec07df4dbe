"""Damping against amplitude: aerodynamic (the paper's Fig. 3) and total, zero at the stable amplitude (Fig. 14)."""

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.griffin.damping import aerodynamic_draws, amplitude_grid, total_draws, trial_draws
from scruton.griffin.posterior import names_of, peak_names, printed_draws, test_names, unit_of
from scruton.infer.results import Fit
from scruton.report.conventions import DAMPING, damping_label, damping_words, shown_in
from scruton.report.figures import FigureWithCaption, figure, style
from scruton.report.figures.griffin_axes import front_ends, line_styles
from scruton.report.thresholds import CURVE_POINTS, MOST_BANDS, PANELS_A_PAGE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def tests_with_transients(fit: Fit) -> list[str]:
    """Tests that hold a growth or a decay, whose amplitudes span a range."""
    if "posterior_predictive" not in fit.tree:
        return []
    held = set(fit.tree["constant_data"]["record_test"].to_numpy().astype(str))
    return [name for name in test_names(fit.tree) if name in held]


def _factors(fit: Fit) -> tuple[float, float]:
    """What damping ratios and amplitudes are multiplied by to be shown."""
    return shown_in(DAMPING)[0], shown_in(unit_of(fit.tree))[0]


@figure("aerodynamic", name="aerodynamic_damping", what="The plot of aerodynamic damping", when=tests_with_transients)
def aerodynamic_damping_plot(fit: Fit) -> FigureWithCaption:
    """Aerodynamic damping ratio against amplitude, all tests with a transient (Fig. 3); of many, the peak tests."""
    styles, tests = line_styles(fit.tree), tests_with_transients(fit)
    peaks = [name for name in tests if name in peak_names(fit.tree)]
    tests = peaks if peaks and len(tests) > MOST_BANDS else tests
    drawing, axes = style.alone(95.0)
    lowest, (per, scale) = 0.0, _factors(fit)
    for name in tests:
        grid, look = amplitude_grid(fit, name), styles[name]
        low, median, high = per * np.quantile(aerodynamic_draws(fit.tree, name, grid), style.Q90, axis=0)
        grid = scale * grid
        if len(tests) <= MOST_BANDS:
            axes.fill_between(grid, low, high, color=look.colour, alpha=0.3, lw=0)
        axes.plot(grid, median, **look.pen, lw=1.6, label=style.shorten(name))
        lowest = min(lowest, float(low.min()))
    _deterministic(axes, fit, tests, total=False)
    axes.axhline(0.0, color=style.GREY, lw=0.6)
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=1.08 * lowest)
    axes.set(xlabel=style.amplitude_label(unit_of(fit.tree)), ylabel=damping_label("Aerodynamic damping ratio"))
    style.below(drawing, [axes])
    return FigureWithCaption(
        drawing,
        caption=f"Aerodynamic {damping_words()} against amplitude over the range of each test's records: median and "
        "90 % credible band of the fitted law with the departure from it, and the deterministic procedure of Eqs. (2) "
        "to (6) (dotted). Negative damping drives. Curves of tests with like mass that fall together show that it "
        "depends on amplitude alone.",
        alt=f"Aerodynamic damping ratio, negative and largest at small amplitude, for {', '.join(tests)}.",
    )


@figure(
    "aerodynamic",
    name="aerodynamic_damping_by_test",
    what="The aerodynamic damping of single tests",
    when=tests_with_transients,
)
def aerodynamic_damping_by_test(fit: Fit) -> Iterable[FigureWithCaption]:
    """The same, one panel a test, with the band of the trial function (Eq. 4) of each record beside the law's."""
    for drawing, page in _by_test(fit, _aerodynamic_panel, damping_label("Aerodynamic damping"), columns=2):
        yield FigureWithCaption(
            drawing,
            caption=f"Aerodynamic {damping_words()} against amplitude, test by test: median and 90 % credible band of "
            "the fitted law with the departure from it (filled), 90 % band of the trial function of each record, "
            "Eq. (4) (hatched), and the deterministic procedure (dotted). The vertical line is the stable amplitude.",
            alt=f"Aerodynamic damping ratio against amplitude for {page}: law and trial function compared.",
        )


def _aerodynamic_panel(axes: "Axes", fit: Fit, name: str) -> None:
    known = names_of(fit.tree["trial_function"]["record"]) if "trial_function" in fit.tree else []
    per, scale = _factors(fit)
    for _, record, _ in front_ends(fit, [name]):
        if record.name in known:
            amplitude, draws = trial_draws(fit, record.name, name)
            axes.fill_between(
                scale * amplitude, *(per * np.nanquantile(draws, [0.05, 0.95], axis=0)), facecolor="none",
                edgecolor=style.PURPLE, hatch="/////", lw=0.7, label="trial function, Eq. (4), 90 %", zorder=2,
            )  # fmt: skip
    _law(axes, fit, name, total=False, zorder=3)
    axes.axvline(
        scale * float(np.median(printed_draws(fit.tree, name)["a_star"])), color=style.GREEN, lw=0.9, ls=(0, (5, 2))
    )
    axes.axhline(0.0, color=style.GREY, lw=0.6)
    axes.set_xlim(left=0.0)


@figure("aerodynamic", name="stability", what="The figures of stability", when=tests_with_transients)
def stability_figures(fit: Fit) -> Iterable[FigureWithCaption]:
    """Total damping ratio against amplitude, one panel a test; it crosses zero at the stable amplitude (Fig. 14)."""
    for drawing, page in _by_test(fit, _stability_panel, damping_label("Total damping"), columns=3):
        yield FigureWithCaption(
            drawing,
            caption=f"Total {damping_words()} against amplitude: median and 90 % credible band of the fitted law "
            "with the departure from it, and the deterministic procedure of Eqs. (2) to (5) (dotted). Below zero "
            "vibration grows, above zero it decays, as the arrows say: the crossing is the stable amplitude, here with "
            "its 90 % interval.",
            alt=f"Total damping ratio rising through zero at the stable amplitude, for {page}.",
        )


def _stability_panel(axes: "Axes", fit: Fit, name: str) -> None:
    _law(axes, fit, name, total=True, zorder=2)
    scale = _factors(fit)[1]
    first, middle, last = scale * np.quantile(printed_draws(fit.tree, name)["a_star"], style.Q90)
    axes.axhline(0.0, color=style.GREY, lw=0.8, zorder=1)
    axes.axvspan(first, last, color=style.GREEN, alpha=0.3, lw=0, zorder=1)
    label, edge = "stable amplitude, 90 %", style.BLACK
    axes.plot([middle], [0.0], "o", color=style.GREEN, mec=edge, mew=0.6, ms=5.5, label=label, zorder=6)
    span = 1.02 * scale * float(amplitude_grid(fit, name)[-1])
    for start, end in ((middle - 0.20 * span, middle - 0.05 * span), (middle + 0.20 * span, middle + 0.05 * span)):
        if 0.0 < start < span:
            arrow = {"arrowstyle": "-|>", "color": style.BLACK, "lw": 0.9, "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", (end, 0.0), (start, 0.0), zorder=5, arrowprops=arrow)
    axes.set_xlim(0.0, span)
    # each where the curve is on its side of zero: below it at small amplitudes, above it at large ones
    low, high = axes.get_ylim()
    axes.set_ylim(low, max(high, 0.0) + 0.14 * (high - low))
    grey: dict[str, Any] = {"fontsize": 7.5, "color": style.GREY, "va": "top", "textcoords": "offset points"}
    axes.annotate("grows", (0.01, 0.0), xycoords=("axes fraction", "data"), xytext=(0, -3), ha="left", **grey)
    axes.annotate("decays", (0.99, 1.0), xycoords="axes fraction", xytext=(0, -1), ha="right", **grey)


def _by_test(
    fit: Fit, draw: "Callable[[Axes, Fit, str], None]", quantity: str, *, columns: int
) -> "Iterable[tuple[Figure, str]]":
    """One panel a test, on as many pages as it takes, with their tests; `columns` are those of the legend."""
    for page in style.pages(tests_with_transients(fit), PANELS_A_PAGE):
        drawing, panels = style.panels(len(page), height_mm=47.0)
        for axes, name in zip(panels, page, strict=True):
            draw(axes, fit, name)
            axes.set_title(style.shorten(name))
        style.outer_labels(panels, style.amplitude_label(unit_of(fit.tree)), quantity)
        style.below(drawing, panels, columns=columns)
        yield drawing, ", ".join(page)


def _law(axes: "Axes", fit: Fit, name: str, *, total: bool, zorder: int) -> None:
    """Median and 90 % band of the fitted law and its departure, which the axis holds, and the paper's own procedure."""
    colour, grid = line_styles(fit.tree)[name].colour, amplitude_grid(fit, name)
    draws = (total_draws if total else aerodynamic_draws)(fit.tree, name, grid)
    per, scale = _factors(fit)
    low, median, high = per * np.quantile(draws, style.Q90, axis=0)
    grid = scale * grid
    axes.fill_between(grid, low, high, color=colour, alpha=0.35, lw=0, label="fitted law, 90 %", zorder=zorder)
    axes.plot(grid, median, color=colour, lw=1.4, label="fitted law, median", zorder=zorder + 1)
    _deterministic(axes, fit, [name], total=total)
    bottom, top = float(np.min(low)), float(np.max(high))
    margin = 0.08 * (top - bottom)
    axes.set_ylim(bottom - margin, max(top, 0.0) + margin)


def _deterministic(axes: "Axes", fit: Fit, tests: Sequence[str], *, total: bool) -> None:
    """Damping ratio by the paper's own procedure, one curve a transient record."""
    pen: dict[str, Any] = {"color": style.BLACK, "ls": ":", "lw": 1.0, "label": "Eqs. (2)-(6), deterministic"}
    per, scale = _factors(fit)
    for _, _, front in front_ends(fit, tests):
        pick = style.thin_along(np.log(np.maximum(front.smooth_amplitude, 1e-12)), CURVE_POINTS)
        damping = per * (front.total_damping if total else front.aerodynamic_damping)[pick]
        axes.plot(scale * front.smooth_amplitude[pick], damping, **pen, zorder=5)
