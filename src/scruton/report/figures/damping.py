"""Damping against amplitude: aerodynamic (the paper's Fig. 3) and total, zero at the stable amplitude (Fig. 14)."""

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics import rate as amplitude_rate
from scruton.envelope.damping import aerodynamic_damping, total_damping
from scruton.griffin.bands import trial_griffin_draws
from scruton.griffin.posterior import draws_of, exponent_draws, mass_damping_draws, peak_names, test_names, unit_of
from scruton.report.figures import style
from scruton.report.figures.griffin_axes import front_ends, line_styles
from scruton.report.figures.registry import FigureWithCaption, figure
from scruton.report.thresholds import CURVE_POINTS, MOST_BANDS, PANELS_A_PAGE

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from scruton.infer.results import Fit

GRID = 121
_DRAWS = 1000


def tests_with_transients(fit: "Fit") -> list[str]:
    """Tests that hold a growth or a decay, whose amplitudes span a range."""
    if "posterior_predictive" not in fit.tree:
        return []
    held = set(fit.tree["constant_data"]["record_test"].to_numpy().astype(str))
    return [name for name in test_names(fit.tree) if name in held]


@figure(
    "aerodynamic",
    name="aerodynamic_damping",
    what="The plot of aerodynamic damping",
    when=tests_with_transients,
    caption="Aerodynamic damping ratio against amplitude over the range of each test's records: median and 90 % "
    "credible band of the fitted law, and the deterministic procedure of Eqs. (2) to (6) (dotted). Negative damping "
    "drives. Curves of tests with like mass that fall together show that it depends on amplitude alone.",
)
def aerodynamic_damping_plot(fit: "Fit") -> FigureWithCaption:
    """Aerodynamic damping ratio against amplitude, all tests with a transient (Fig. 3); of many, the peak tests."""
    styles, tests = line_styles(fit.tree), tests_with_transients(fit)
    peaks = [name for name in tests if name in peak_names(fit.tree)]
    tests = peaks if peaks and len(tests) > MOST_BANDS else tests
    drawing = style.new_figure(95.0)
    axes = drawing.subplots()
    lowest = 0.0
    for name in tests:
        grid, look = amplitude_grid(fit, name), styles[name]
        low, median, high = np.quantile(aerodynamic_draws(fit.tree, name, grid), style.Q90, axis=0)
        if len(tests) <= MOST_BANDS:
            axes.fill_between(grid, 100 * low, 100 * high, color=look.colour, alpha=0.3, lw=0)
        axes.plot(grid, 100 * median, **look.pen, lw=1.6, label=style.shorten(name))
        lowest = min(lowest, float(100 * low.min()))
    _deterministic(axes, fit, tests, total=False)
    axes.axhline(0.0, color=style.GREY, lw=0.6)
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=1.08 * lowest)
    axes.set_xlabel(style.amplitude_label(unit_of(fit.tree)))
    axes.set_ylabel("Aerodynamic damping [%]")
    style.below(drawing, [axes])
    return FigureWithCaption(
        drawing, alt=f"Aerodynamic damping ratio, negative and largest at small amplitude, for {', '.join(tests)}."
    )


@figure(
    "aerodynamic",
    name="aerodynamic_damping_by_test",
    what="The aerodynamic damping of single tests",
    when=tests_with_transients,
    caption="Aerodynamic damping ratio against amplitude, test by test: median and 90 % credible band of the "
    "fitted law (filled), 90 % band of the trial function of each record, Eq. (4) (hatched), and the "
    "deterministic procedure (dotted). The vertical line is the stable amplitude.",
)
def aerodynamic_damping_by_test(fit: "Fit") -> Iterable[FigureWithCaption]:
    """The same, one panel a test, with the band of the trial function (Eq. 4) of each record beside the law's."""
    alt = "Aerodynamic damping ratio against amplitude for {}: law and trial function compared."
    return _by_test(fit, _aerodynamic_panel, "Aerodynamic damping [%]", alt, columns=2)


@figure(
    "aerodynamic",
    name="stability",
    what="The figures of stability",
    when=tests_with_transients,
    caption="Total damping ratio against amplitude: median and 90 % credible band of the fitted law, and the "
    "deterministic procedure of Eqs. (2) to (5) (dotted). Below zero vibration grows, above zero it "
    "decays, as the arrows say: the crossing is the stable amplitude, here with its 90 % interval.",
)
def stability_figures(fit: "Fit") -> Iterable[FigureWithCaption]:
    """Total damping ratio against amplitude, one panel a test; it crosses zero at the stable amplitude (Fig. 14)."""
    alt = "Total damping ratio rising through zero at the stable amplitude, for {}."
    return _by_test(fit, _stability_panel, "Total damping [%]", alt, columns=3)


def _by_test(
    fit: "Fit", draw: "Callable[[Axes, Fit, str], None]", quantity: str, alt: str, *, columns: int
) -> Iterable[FigureWithCaption]:
    """One panel a test, on as many pages as it takes; `columns` are those of the legend."""
    for page in style.pages(tests_with_transients(fit), PANELS_A_PAGE):
        drawing, panels = style.panels(len(page), height_mm=47.0)
        for axes, name in zip(panels, page, strict=True):
            draw(axes, fit, name)
            axes.set_title(style.shorten(name))
        style.outer_labels(panels, style.amplitude_label(unit_of(fit.tree)), quantity)
        style.below(drawing, panels, columns=columns)
        yield FigureWithCaption(drawing, alt=alt.format(", ".join(page)))


def _aerodynamic_panel(axes: "Axes", fit: "Fit", name: str) -> None:
    label = "trial function, Eq. (4), 90 %"
    known = fit.tree["trial_function"]["record"].to_numpy().tolist() if "trial_function" in fit.tree else []
    for _, record, _ in front_ends(fit, [name]):
        if record in known:
            amplitude, draws = trial_draws(fit, record, name)
            axes.fill_between(
                amplitude, *(100 * np.nanquantile(draws, [0.05, 0.95], axis=0)), facecolor="none",
                edgecolor=style.PURPLE, hatch="/////", lw=0.7, label=label, zorder=2,
            )  # fmt: skip
            label = ""
    limits = _law_band(axes, fit, name, aerodynamic_draws, zorder=3)
    _deterministic(axes, fit, [name], total=False)
    axes.axvline(float(np.median(draws_of(fit.tree, "a_star", name))), color=style.GREEN, lw=0.9, ls=(0, (5, 2)))
    axes.axhline(0.0, color=style.GREY, lw=0.6)
    axes.set_xlim(left=0.0)
    axes.set_ylim(*limits)


def _stability_panel(axes: "Axes", fit: "Fit", name: str) -> None:
    limits = _law_band(axes, fit, name, total_draws, zorder=2)
    _deterministic(axes, fit, [name], total=True)
    first, middle, last = np.quantile(draws_of(fit.tree, "a_star", name), style.Q90)
    axes.axhline(0.0, color=style.GREY, lw=0.8, zorder=1)
    axes.axvspan(first, last, color=style.GREEN, alpha=0.3, lw=0, zorder=1)
    dot: dict[str, Any] = {
        "color": style.GREEN,
        "mec": style.BLACK,
        "mew": 0.6,
        "ms": 5.5,
        "label": "stable amplitude, 90 %",
    }
    axes.plot([middle], [0.0], "o", **dot, zorder=6)
    span = 1.02 * float(amplitude_grid(fit, name)[-1])
    for start, end in ((middle - 0.20 * span, middle - 0.05 * span), (middle + 0.20 * span, middle + 0.05 * span)):
        if 0.0 < start < span:
            arrow = {"arrowstyle": "-|>", "color": style.BLACK, "lw": 0.9, "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", (end, 0.0), (start, 0.0), zorder=5, arrowprops=arrow)
    axes.set_xlim(0.0, span)
    axes.set_ylim(*limits)
    for word, x, rise, ha, va in (("decays", 0.01, 3, "left", "baseline"), ("grows", 0.99, -3, "right", "top")):
        axes.annotate(
            word, (x, 0.0), xycoords=("axes fraction", "data"), xytext=(0, rise), textcoords="offset points",
            fontsize=7.5, color=style.GREY, ha=ha, va=va,
        )  # fmt: skip


def _law_band(
    axes: "Axes", fit: "Fit", name: str, draws: "Callable[[xr.DataTree, str, FloatArray], FloatArray]", *, zorder: int
) -> tuple[float, float]:
    """Median and 90 % band of a damping ratio under the fitted law; limits of the axis that hold them."""
    look, grid = line_styles(fit.tree)[name], amplitude_grid(fit, name)
    low, median, high = 100 * np.quantile(draws(fit.tree, name, grid), style.Q90, axis=0)
    axes.fill_between(grid, low, high, color=look.colour, alpha=0.35, lw=0, label="fitted law, 90 %", zorder=zorder)
    axes.plot(grid, median, color=look.colour, lw=1.4, label="fitted law, median", zorder=zorder + 1)
    bottom, top = float(np.min(low)), float(np.max(high))
    margin = 0.08 * (top - bottom)
    return bottom - margin, max(top, 0.0) + margin


def _deterministic(axes: "Axes", fit: "Fit", tests: Sequence[str], *, total: bool) -> None:
    """Damping ratio by the paper's own procedure, one curve a transient record."""
    label = "Eqs. (2)-(6), deterministic"
    for _, _, front in front_ends(fit, tests):
        pick = style.thin_along(np.log(np.maximum(front.smooth_amplitude, 1e-12)), CURVE_POINTS)
        damping = front.total_damping if total else front.aerodynamic_damping
        pen: dict[str, Any] = {"color": style.BLACK, "ls": ":", "lw": 1.0, "label": label, "zorder": 5}
        axes.plot(front.smooth_amplitude[pick], 100 * damping[pick], **pen)
        label = ""


def amplitude_grid(fit: "Fit", test: str) -> FloatArray:
    """Amplitudes that the test's transients went through, evenly spaced in the logarithm."""
    mine = fit.tree["constant_data"]["record_test"].to_numpy().astype(str) == test
    amplitude = fit.tree["observed_data"]["amplitude"].to_numpy()[mine]
    stable = float(np.median(draws_of(fit.tree, "a_star", test)))
    # the noise floor of a growth is no amplitude
    low = max(float(amplitude.min()), 0.1 * stable)
    return np.geomspace(min(low, 0.9 * stable), max(float(amplitude.max()), 1.1 * stable), GRID)


def total_draws(tree: "xr.DataTree", test: str, amplitude: FloatArray) -> FloatArray:
    """Draws of the total damping ratio at `amplitude` (n,), from Eq. (5) on the fitted law; (S, n), S <= 1000."""
    pick = style.thin(draws_of(tree, "a_star", test).size, _DRAWS)
    a_star, rate = (draws_of(tree, key, test)[pick, None] for key in ("a_star", "relaxation_rate"))
    n = exponent_draws(tree, test)[pick, None]
    omega = 2 * np.pi * float(tree["constant_data"]["wind_frequency"].sel(test=test))
    return total_damping(amplitude, amplitude_rate(amplitude, a_star, rate, n), omega)


def aerodynamic_draws(tree: "xr.DataTree", test: str, amplitude: FloatArray) -> FloatArray:
    """Draws of the aerodynamic damping ratio at `amplitude` (n,), Eq. (6) on the fitted law; (S, n), S <= 1000."""
    total = total_draws(tree, test, amplitude)
    xi = draws_of(tree, "damping_ratio", test)
    xi = xi[style.thin(xi.size, _DRAWS), None]
    omega, omega0 = (
        2 * np.pi * float(tree["constant_data"][key].sel(test=test)) for key in ("wind_frequency", "frequency")
    )
    return aerodynamic_damping(total, amplitude, lambda _: xi, omega, omega0)


def trial_draws(fit: "Fit", record: str, test: str) -> tuple[FloatArray, FloatArray]:
    """Amplitudes that a record went through (n,), and draws of the aerodynamic damping there by Eq. (4), (S, n).

    The Griffin curve of every draw is read the other way round: what damping an amplitude would be stable under,
    with the opposite sign. NaN where a draw does not reach; amplitudes that few draws reach are left out.
    """
    tree, curve = fit.tree, fit.front_ends[record].griffin.scruton_number
    constant = tree["constant_data"]
    turn = float(constant["frequency"].sel(test=test)) / float(constant["wind_frequency"].sel(test=test))
    factor = float(np.median(mass_damping_draws(tree, test)))
    low, high = float(np.nanmin(curve)), float(np.nanmax(curve))
    margin = 0.3 * (high - low)
    # dense near the stable amplitude, where damping hardly changes, and far out at small amplitude
    middle = float(np.median(draws_of(tree, "scruton_number", test)))
    steps = np.geomspace(1e-3, 1.0, GRID)
    sc = np.concatenate(
        [middle - (middle - low + margin) * steps[::-1], [middle], middle + (high - middle + margin) * steps]
    )
    amplitudes, _ = trial_griffin_draws(tree, sc, record)
    damping = -sc * turn / factor
    grid = amplitude_grid(fit, test)
    draws = np.full((len(amplitudes), GRID), np.nan)
    for row, one in zip(draws, amplitudes, strict=True):
        good = np.flatnonzero(np.isfinite(one))
        order = good[np.argsort(one[good], kind="stable")]
        if order.size > 1:
            row[:] = np.interp(grid, one[order], damping[order], left=np.nan, right=np.nan)
    mine = constant["record"].to_numpy().astype(str) == record
    seen = tree["observed_data"]["amplitude"].to_numpy()[mine]
    reached = (np.isfinite(draws).mean(axis=0) > 0.9) & (grid >= seen.min()) & (grid <= seen.max())
    return grid[reached], draws[:, reached]
