"""Amplitude against reduced velocity through the lock-in range, as the paper's Figs. 1 and 6a."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from scruton.griffin.lock_in import LockInBand, has_speeds, lock_in_band
from scruton.griffin.posterior import draws_of, test_names
from scruton.report.figures import style
from scruton.report.figures.registry import FigureWithCaption, figure
from scruton.report.thresholds import MOST_RIG_BANDS, SCRUTON_NUMBERS_APART, SPEEDS_APART

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from scruton.infer.results import Fit


def has_lock_in(fit: "Fit") -> bool:
    """Whether there are sweeps, or one rig was tested at several speeds."""
    speeds: dict[str, list[float]] = {}
    for test in fit.campaign.tests:
        speeds.setdefault(test.rig, []).append(test.wind_speed.mean)
    return bool(fit.campaign.sweeps) or any(max(one) > SPEEDS_APART * min(one) for one in speeds.values())


@figure("griffin-plot", name="lock_in", what="The plot against wind speed", when=has_lock_in)
def lock_in_plot(fit: "Fit", *, scruton_number: float | None = None) -> FigureWithCaption:
    """Steady amplitudes of sweeps and tests by rig, with the bands of the smooth model where the fit has it.

    Parameters
    ----------
    fit : Fit
        With sweeps, or tests at several speeds; see `has_lock_in`.
    scruton_number : float, optional
        Untested Scruton number that the second panel is for; in the widest gap between the tested ones, or
        twice the largest, if left out.
    """
    tree = fit.tree
    wanted = {sweep.rig for sweep in fit.campaign.sweeps} | {test.rig for test in fit.campaign.tests}
    used = [rig.name for rig in fit.campaign.rigs if rig.name in wanted]
    styles = {name: style.line_style(i) for i, name in enumerate(used)}
    unit, smooth = fit.campaign.section.amplitude_unit, has_speeds(tree)
    untested = scruton_number if scruton_number is not None or not smooth else _untested(fit)
    drawing = style.new_figure(140.0 if smooth else 95.0)
    panels = list(drawing.subplots(2 if smooth else 1, 1, sharex=True, squeeze=False).flat)
    top = _points(panels[0], fit, styles)
    if smooth and untested is not None:
        top = max(top, _own_bands(panels[0], fit, styles))
        panels[0].set_title("Each rig at its own Scruton number")
        _untested_band(panels[1], fit, styles, untested)
        panels[1].set_title(f"Sc = {untested:.3g}, untested")
    panels[0].set_ylim(0.0, 1.08 * top)
    style.outer_labels(panels, r"Reduced velocity $U/(f_0 D)$ [-]", style.amplitude_label(unit), columns=1)
    if unit == "rad":
        for axes in panels:
            style.add_degrees(axes)
    style.below(drawing, panels)
    caption = (
        "Steady amplitude against reduced velocity, with the still-air frequency of each rig: sweeps where the "
        "campaign has them, and the stable amplitude of every test's posterior with its 90 % interval."
    )
    if smooth:
        caption += (
            " Bands: stable amplitude and relaxation smooth in the reduced velocity, median with 50 and 90 % bands "
            "of a new test of the same rig (above) or of a new rig (below), with its discrepancy and, for a new rig, "
            "with the uncertain place of its lock-in. Thin: beyond the outermost test within lock-in, or an "
            "extrapolation index of 0.3. Amplitudes below a tenth of a rig's largest lie outside lock-in: they enter "
            "no band, and end it."
        )
    alt = f"Amplitude through the lock-in range for rig(s) {', '.join(used)}."
    if smooth and untested is not None:
        peak = lock_in_band(tree, untested, seed=_seed(fit))
        i = int(np.nanargmax(np.where(np.isfinite(peak.median), peak.median, -1.0)))
        low, high = peak.intervals[0.90][:, i]
        alt += (
            f" At Sc = {untested:.3g} the median is largest at a reduced velocity of {peak.velocity[i]:.3g}: "
            f"{peak.median[i]:.3g} {unit} (90 % {low:.3g} to {high:.3g})."
        )
    return FigureWithCaption(drawing, caption=caption, alt=alt)


def _points(axes: "Axes", fit: "Fit", styles: Mapping[str, style.LineStyle]) -> float:
    """Sweeps, posteriors of the tests and what was measured; the largest amplitude drawn."""
    campaign, tree, depth = fit.campaign, fit.tree, fit.campaign.section.depth
    frequency = {rig.name: rig.frequency.mean for rig in campaign.rigs}
    top = 0.0
    for sweep in campaign.sweeps:
        order = np.argsort(sweep.wind_speed, kind="stable")
        axes.plot(
            sweep.wind_speed[order] / (frequency[sweep.rig] * depth), sweep.amplitude[order], **styles[sweep.rig].pen,
            lw=0.8, marker=styles[sweep.rig].marker, ms=3.5, label=style.shorten(f"rig {sweep.rig}, sweep"),
        )  # fmt: skip
        top = max(top, float(sweep.amplitude.max()))
    for rig, look in styles.items():
        mine = [test for test in campaign.tests if test.rig == rig and test.name in test_names(tree)]
        if not mine:
            continue
        x = [test.wind_speed.mean / (frequency[rig] * depth) for test in mine]
        low, middle, high = np.array([np.quantile(draws_of(tree, "a_star", test.name), style.Q90) for test in mine]).T
        axes.errorbar(
            x, middle, [middle - low, high - middle], fmt=look.marker, ms=7.5, mfc="none", color=look.colour,
            elinewidth=0.9, capsize=2.5, label=f"rig {style.shorten(rig, 20)}, posterior, 90 %", zorder=4,
        )  # fmt: skip
        top = max(top, float(high.max()))
    stated = [(test, test.stable_amplitude.mean) for test in campaign.tests if test.stable_amplitude is not None]
    if stated:
        axes.plot(
            [test.wind_speed.mean / (frequency[test.rig] * depth) for test, _ in stated], [mean for _, mean in stated],
            "x", color=style.BLACK, ms=5, mew=1.1, label="measured stable amplitude", zorder=5,
        )  # fmt: skip
    return top


def _own_bands(axes: "Axes", fit: "Fit", styles: Mapping[str, style.LineStyle]) -> float:
    """Band of every rig in the smooth model at its own Sc; the largest upper end of the 50 % bands."""
    own = _own_scruton_numbers(fit)
    top = 0.0
    for rig in (name for name in styles if name in own):
        band = lock_in_band(fit.tree, own[rig], rig=rig, seed=_seed(fit))
        label = style.shorten(f"rig {rig}, Sc = {own[rig]:.3g}, band")
        _draw(axes, band, styles[rig], label, bands=len(own) <= MOST_RIG_BANDS)
        inside = ~_beyond(fit, band) & np.isfinite(band.intervals[0.50][1])
        top = max(top, float(band.intervals[0.50][1][inside].max(initial=0.0)))
    return top


def _untested_band(axes: "Axes", fit: "Fit", styles: Mapping[str, style.LineStyle], untested: float) -> None:
    """Band of a new rig at an untested Sc, with the medians of the tested rigs for comparison."""
    largest = 0.0
    for rig, sc in _own_scruton_numbers(fit).items():
        own = lock_in_band(fit.tree, sc, rig=rig, seed=_seed(fit))
        axes.plot(own.velocity, style.bounded(own.median), **styles[rig].pen, lw=0.7, zorder=3)
        largest = max(largest, float(own.median[np.isfinite(own.median)].max(initial=0.0)))
    band = lock_in_band(fit.tree, untested, seed=_seed(fit))
    _draw(axes, band, style.LineStyle(style.BLACK, "-", ""), f"Sc = {untested:.3g}, median, 50 and 90 %")
    upper = band.intervals[0.90][1]
    upper = upper[np.isfinite(upper) & ~_beyond(fit, band)]
    axes.set_ylim(0.0, 1.08 * min(max(largest, float(upper.max(initial=0.0))), 2.0 * largest))


def _beyond(fit: "Fit", band: LockInBand) -> np.ndarray:
    """Where a band lies beyond the outermost test."""
    group = fit.tree["speeds"]
    return np.asarray((band.velocity < group.attrs["tested_low"]) | (band.velocity > group.attrs["tested_high"]))


def _draw(axes: "Axes", band: LockInBand, look: style.LineStyle, label: str, *, bands: bool = True) -> None:
    """Median with 50 and 90 % bands, thin where extrapolated."""
    v, median = band.velocity, style.bounded(band.median)
    if bands:
        for probability, alpha in ((0.90, 0.14), (0.50, 0.25)):
            interval = style.bounded(band.intervals[probability])
            axes.fill_between(v, *interval, color=look.colour, alpha=alpha, lw=0, zorder=1)
    axes.plot(v, median, **look.pen, lw=0.7, zorder=2, label=style.shorten(label, 40))
    axes.plot(v, np.where(band.extrapolated, np.nan, median), **look.pen, lw=1.7, zorder=2)


def _own_scruton_numbers(fit: "Fit") -> dict[str, float]:
    """Scruton number of every rig in the smooth model: the median over its tests and sweeps."""
    group = fit.tree["speeds"]
    rig, sc = (group[key].to_numpy() for key in ("point_rig", "point_scruton_number"))
    return {str(name): float(np.median(sc[rig == name])) for name in group["rig"].to_numpy()}


def _untested(fit: "Fit") -> float:
    """In the widest gap between tested Scruton numbers a factor two or more apart, else twice the largest."""
    tested = np.sort(list(_own_scruton_numbers(fit).values()))
    ratio = tested[1:] / tested[:-1]
    if ratio.max(initial=0.0) < SCRUTON_NUMBERS_APART:
        return float(f"{2.0 * tested[-1]:.2g}")
    i = int(ratio.argmax())
    return float(f"{np.sqrt(tested[i] * tested[i + 1]):.2g}")


def _seed(fit: "Fit") -> int:
    return int(fit.summary["provenance"]["seed"])
