"""Damping against amplitude: aerodynamic (the paper's Fig. 3) and total, zero at the stable amplitude (Fig. 14)."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics import rate as amplitude_rate
from scruton.envelope.damping import aerodynamic_damping, total_damping
from scruton.griffin.bands import trial_griffin_draws
from scruton.griffin.posterior import draws_of, exponent_draws, mass_damping_draws, peak_names, test_names, unit_of
from scruton.report.figures.griffin import looks
from scruton.report.figures.style import (
    BLACK,
    GREEN,
    GREY,
    PURPLE,
    FigureWithCaption,
    amplitude_label,
    below,
    house_style,
    new_figure,
    pages,
    panels,
    shorten,
    thin,
    thin_along,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from scruton.infer.results import Fit

PANELS = 6
GRID = 121
_DRAWS = 1000
_BANDS = 7  # tests whose bands are drawn; of more only the medians
_POINTS = 150


def aerodynamic_damping_plot(fit: "Fit") -> FigureWithCaption:
    """Aerodynamic damping ratio against amplitude, all tests with a transient (Fig. 3); of many, the peak tests."""
    style, tests = looks(fit.tree), tests_with_transients(fit)
    peaks = [name for name in tests if name in peak_names(fit.tree)]
    tests = peaks if peaks and len(tests) > _BANDS else tests
    with house_style():
        figure = new_figure(95.0)
        axes = figure.subplots()
        lowest = 0.0
        for name in tests:
            grid = amplitude_grid(fit, name)
            low, median, high = np.quantile(aerodynamic_draws(fit.tree, name, grid), [0.05, 0.5, 0.95], axis=0)
            one = style[name]
            if len(tests) <= _BANDS:
                axes.fill_between(grid, 100 * low, 100 * high, color=one.colour, alpha=0.3, lw=0)
            axes.plot(grid, 100 * median, color=one.colour, ls=one.line, lw=1.6, label=shorten(name))
            lowest = min(lowest, float(100 * low.min()))
        _deterministic(axes, fit, tests, total=False)
        axes.axhline(0.0, color=GREY, lw=0.6)
        axes.set_xlim(left=0.0)
        axes.set_ylim(bottom=1.08 * lowest)
        _labels(axes, fit, "Aerodynamic damping [%]")
        below(figure, [axes])
    return FigureWithCaption(
        figure,
        "aerodynamic_damping",
        "Aerodynamic damping ratio against amplitude over the range of each test's records: median and 90 % credible "
        "band of the fitted law, and the deterministic procedure of Eqs. (2) to (6) (dotted). Negative damping drives. "
        "Curves of tests with like mass that fall together show that it depends on amplitude alone.",
        f"Aerodynamic damping ratio, negative and largest at small amplitude, for {', '.join(tests)}.",
    )


def aerodynamic_damping_by_test(fit: "Fit") -> list[FigureWithCaption]:
    """The same, one panel a test, with the band of the trial function (Eq. 4) of each record beside the law's."""
    found = []
    for number, page in enumerate(pages(tests_with_transients(fit), PANELS), 1):
        with house_style():
            figure, axes = panels(len(page), height_mm=47.0)
            for one, name in zip(axes, page, strict=True):
                _by_test(one, fit, name)
            _outer_labels(axes, fit, "Aerodynamic damping [%]")
            below(figure, axes, columns=2)
        found.append(
            FigureWithCaption(
                figure,
                "aerodynamic_damping_by_test" if number == 1 else f"aerodynamic_damping_by_test_{number}",
                "Aerodynamic damping ratio against amplitude, test by test: median and 90 % credible band of the "
                "fitted law (filled), 90 % band of the trial function of each record, Eq. (4) (hatched), and the "
                "deterministic procedure (dotted). The vertical line is the stable amplitude.",
                f"Aerodynamic damping ratio against amplitude for {', '.join(page)}: law and trial function compared.",
            )
        )
    return found


def _by_test(axes: "Axes", fit: "Fit", name: str) -> None:
    one, grid = looks(fit.tree)[name], amplitude_grid(fit, name)
    low, median, high = 100 * np.quantile(aerodynamic_draws(fit.tree, name, grid), [0.05, 0.5, 0.95], axis=0)
    bottom, top = _limits(low, high)
    label = "trial function, Eq. (4), 90 %"
    known = fit.tree["trial_function"]["record"].to_numpy().tolist() if "trial_function" in fit.tree else []
    for record in fit.campaign.test(name).records:
        if record.name in fit.front_ends and record.name in known:
            amplitude, draws = trial_draws(fit, record.name, name)
            axes.fill_between(
                amplitude, *(100 * np.nanquantile(draws, [0.05, 0.95], axis=0)), facecolor="none", edgecolor=PURPLE,
                hatch="/////", lw=0.7, label=label, zorder=2,
            )  # fmt: skip
            label = ""
    axes.fill_between(grid, low, high, color=one.colour, alpha=0.35, lw=0, label="fitted law, 90 %", zorder=3)
    axes.plot(grid, median, color=one.colour, lw=1.4, label="fitted law, median", zorder=4)
    _deterministic(axes, fit, [name], total=False)
    axes.axvline(float(np.median(draws_of(fit.tree, "a_star", name))), color=GREEN, lw=0.9, ls=(0, (5, 2)))
    axes.axhline(0.0, color=GREY, lw=0.6)
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom, top)
    axes.set_title(shorten(name))


def stability_figures(fit: "Fit") -> list[FigureWithCaption]:
    """Total damping ratio against amplitude, one panel a test; it crosses zero at the stable amplitude (Fig. 14)."""
    found = []
    for number, page in enumerate(pages(tests_with_transients(fit), PANELS), 1):
        with house_style():
            figure, axes = panels(len(page), height_mm=47.0)
            for one, name in zip(axes, page, strict=True):
                _stability(one, fit, name)
            _outer_labels(axes, fit, "Total damping [%]")
            below(figure, axes)
        found.append(
            FigureWithCaption(
                figure,
                "stability" if number == 1 else f"stability_{number}",
                "Total damping ratio against amplitude: median and 90 % credible band of the fitted law, and the "
                "deterministic procedure of Eqs. (2) to (5) (dotted). Below zero vibration grows, above zero it "
                "decays, as the arrows say: the crossing is the stable amplitude, here with its 90 % interval.",
                f"Total damping ratio rising through zero at the stable amplitude, for {', '.join(page)}.",
            )
        )
    return found


def _stability(axes: "Axes", fit: "Fit", name: str) -> None:
    one, grid = looks(fit.tree)[name], amplitude_grid(fit, name)
    low, median, high = 100 * np.quantile(total_draws(fit.tree, name, grid), [0.05, 0.5, 0.95], axis=0)
    bottom, top = _limits(low, high)
    left, right = 0.0, 1.02 * float(grid[-1])
    axes.fill_between(grid, low, high, color=one.colour, alpha=0.35, lw=0, label="fitted law, 90 %", zorder=2)
    axes.plot(grid, median, color=one.colour, lw=1.4, label="fitted law, median", zorder=3)
    _deterministic(axes, fit, [name], total=True)
    first, middle, last = np.quantile(draws_of(fit.tree, "a_star", name), [0.05, 0.5, 0.95])
    axes.axhline(0.0, color=GREY, lw=0.8, zorder=1)
    axes.axvspan(first, last, color=GREEN, alpha=0.3, lw=0, zorder=1)
    axes.plot([middle], [0.0], "o", color=GREEN, mec=BLACK, mew=0.6, ms=5.5, zorder=6, label="stable amplitude, 90 %")
    span = right - left
    for start, end in ((middle - 0.20 * span, middle - 0.05 * span), (middle + 0.20 * span, middle + 0.05 * span)):
        if left < start < right:
            axes.annotate(
                "", (end, 0.0), (start, 0.0), zorder=5,
                arrowprops={"arrowstyle": "-|>", "color": BLACK, "lw": 0.9, "shrinkA": 0, "shrinkB": 0},
            )  # fmt: skip
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    axes.annotate(
        "decays", (0.01, 0.0), xycoords=("axes fraction", "data"), xytext=(0, 3), textcoords="offset points",
        fontsize=7.5, color=GREY,
    )  # fmt: skip
    axes.annotate(
        "grows", (0.99, 0.0), xycoords=("axes fraction", "data"), xytext=(0, -3), textcoords="offset points",
        fontsize=7.5, color=GREY, ha="right", va="top",
    )  # fmt: skip
    axes.set_title(shorten(name))


def tests_with_transients(fit: "Fit") -> list[str]:
    """Tests that hold a growth or a decay, whose amplitudes span a range."""
    if "posterior_predictive" not in fit.tree:
        return []
    held = set(fit.tree["constant_data"]["record_test"].to_numpy().astype(str))
    return [name for name in test_names(fit.tree) if name in held]


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
    pick = thin(draws_of(tree, "a_star", test).size, _DRAWS)
    a_star, rate = (draws_of(tree, key, test)[pick, None] for key in ("a_star", "relaxation_rate"))
    n = exponent_draws(tree, test)[pick, None]
    omega = 2 * np.pi * float(tree["constant_data"]["wind_frequency"].sel(test=test))
    return total_damping(amplitude, amplitude_rate(amplitude, a_star, rate, n), omega)


def aerodynamic_draws(tree: "xr.DataTree", test: str, amplitude: FloatArray) -> FloatArray:
    """Draws of the aerodynamic damping ratio at `amplitude` (n,), Eq. (6) on the fitted law; (S, n), S <= 1000."""
    total = total_draws(tree, test, amplitude)
    xi = draws_of(tree, "damping_ratio", test)
    xi = xi[thin(xi.size, _DRAWS), None]
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


def _deterministic(axes: "Axes", fit: "Fit", tests: Sequence[str], *, total: bool) -> None:
    label = "Eqs. (2)-(6), deterministic"
    for name in tests:
        for record in fit.campaign.test(name).records:
            if record.name in fit.front_ends:
                front = fit.front_ends[record.name]
                pick = thin_along(np.log(np.maximum(front.smooth_amplitude, 1e-12)), _POINTS)
                damping = front.total_damping if total else front.aerodynamic_damping
                axes.plot(
                    front.smooth_amplitude[pick],
                    100 * damping[pick],
                    color=BLACK,
                    ls=":",
                    lw=1.0,
                    label=label,
                    zorder=5,
                )
                label = ""


def _limits(low: FloatArray, high: FloatArray) -> tuple[float, float]:
    bottom, top = float(np.min(low)), float(np.max(high))
    margin = 0.08 * (top - bottom)
    return bottom - margin, max(top, 0.0) + margin


def _labels(axes: "Axes", fit: "Fit", quantity: str) -> None:
    axes.set_xlabel(amplitude_label(unit_of(fit.tree)))
    axes.set_ylabel(quantity)


def _outer_labels(axes: "Sequence[Axes]", fit: "Fit", quantity: str) -> None:
    columns = min(2, len(axes))
    for one in axes[::columns]:
        one.set_ylabel(quantity)
    for one in axes[-columns:]:
        one.set_xlabel(amplitude_label(unit_of(fit.tree)))
