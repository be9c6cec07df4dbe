"""Still-air ring-downs: the logarithm of the amplitude against time, and damping against amplitude."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from scruton.report.figures import style
from scruton.report.figures.registry import FigureWithCaption, figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from scruton.campaign.schema import Rig
    from scruton.infer.results import Fit

ROWS = 3  # rigs on one page
_NAMED = 4  # plucks that the legend names
_BINS = 200


@figure(
    "structural",
    name="ring_downs",
    what="The figures of the ring-downs",
    in_still_air=True,
    caption="Ring-downs in still air. Left: the logarithm of the amplitude of every cycle, one colour a pluck; a "
    "straight line is a constant damping ratio. Right: damping ratio against amplitude, by octave (mean and spread of "
    "the plucks) and as a smooth curve with its 90 % band; orange: 90 % interval of the posterior's "
    "constant.",
)
def ring_down_figures(fit: "Fit") -> Iterable[FigureWithCaption]:
    """One row a rig with free decays: ln amplitude of every pluck against time, and damping ratio against amplitude."""
    rigs = [rig for rig in fit.campaign.rigs if rig.name in fit.ringdowns]
    for page in style.pages(rigs, ROWS):
        drawing = style.new_figure(58.0 * len(page) + 14.0)
        axes = drawing.subplots(len(page), 2, squeeze=False)
        for (left, right), rig in zip(axes, page, strict=True):
            _decays(left, fit, rig)
            _damping(right, fit, rig)
        axes[-1, 0].set_xlabel("Time from the pluck's start [s]")
        axes[-1, 1].set_xlabel(style.amplitude_label(fit.campaign.section.amplitude_unit))
        drawing.legend(*axes[0, 1].get_legend_handles_labels(), loc="outside lower right", ncols=3)
        for column in axes.T:
            drawing.align_ylabels(column)
        rings = [(rig.name, fit.ringdowns[rig.name]) for rig in page]
        parts = [f"rig {name}: {100 * ring.damping_ratio:.3g} % at {ring.frequency:.3f} Hz" for name, ring in rings]
        yield FigureWithCaption(drawing, alt=f"Ring-downs and their damping. {'; '.join(parts)}.")


def _decays(axes: "Axes", fit: "Fit", rig: "Rig") -> None:
    unit = fit.campaign.section.amplitude_unit
    lowest, highest = np.inf, -np.inf
    for i, record in enumerate(rig.records):
        cycles = fit.cycles[record.name]
        good = cycles.amplitude > 2.0 * cycles.standard_error
        if not good.any():
            continue
        time, log = cycles.time[good] - cycles.time[good][0], np.log(cycles.amplitude[good])
        look = style.line_style(i)
        axes.plot(
            *style.decimate(time, log, _BINS), **look.pen, lw=1.0,
            label=style.shorten(record.name, 26) if len(rig.records) <= _NAMED else "",
        )  # fmt: skip
        lowest, highest = min(lowest, float(log.min())), max(highest, float(log.max()))
    if np.isfinite(lowest):
        axes.set_ylim(max(lowest, highest - 7.0) - 0.2, highest + 0.3)
    axes.set_xlim(left=0.0)
    axes.set_ylabel("ln(A/D) [-]" if unit == "A/D" else "ln(amplitude / 1 rad) [-]")
    many = f", {len(rig.records)} plucks" if len(rig.records) > 1 else ""
    axes.set_title(f"rig {style.shorten(rig.name, 24)}{many}")
    if len(rig.records) <= _NAMED:
        axes.legend(loc="upper right")


def _damping(axes: "Axes", fit: "Fit", rig: "Rig") -> None:
    ring = fit.ringdowns[rig.name]
    draws = 100 * fit.tree["rig_posterior"]["damping_ratio"].sel(rig=rig.name).to_numpy()
    low, middle, high = np.quantile(draws, style.Q90)
    axes.axhspan(low, high, color=style.ORANGE, alpha=0.5, lw=0, label="constant, posterior, 90 %", zorder=1)
    axes.axhline(middle, color=style.ORANGE, lw=1.0, zorder=1)
    curve, spread = 100 * ring.curve_damping_ratio, 164.5 * ring.curve_sd
    axes.fill_between(
        ring.curve_amplitude,
        curve - spread,
        curve + spread,
        color=style.SKY,
        alpha=0.4,
        lw=0,
        label="smooth, 90 %",
        zorder=2,
    )
    axes.plot(ring.curve_amplitude, curve, color=style.BLUE, lw=1.2, label="smooth", zorder=3)
    if ring.bands:
        lower, upper, xi, sd = np.array([(b.lower, b.upper, b.damping_ratio, b.sd) for b in ring.bands]).T
        centre = np.sqrt(lower * upper)
        axes.errorbar(
            centre, 100 * xi, 164.5 * sd, [centre - lower, upper - centre], fmt="o", ms=3.0, color=style.BLACK,
            elinewidth=0.8, capsize=0, label="by octave, 90 %", zorder=4,
        )  # fmt: skip
    if rig.damping_ratio is not None:
        axes.axhline(100 * rig.damping_ratio.mean, color=style.GREY, lw=0.9, ls=":", label="as stated", zorder=1)
    axes.set_xscale("log")
    style.plain_log(axes.xaxis)
    shown = [100 * b.damping_ratio for b in ring.bands] + [float(low), float(high)]
    reach = 0.5 * (max(shown) - min(shown)) + 0.05 * max(map(abs, shown))
    bottom = min(shown) - reach
    axes.set_ylim(max(bottom, 0.0) if min(shown) > 0.0 else bottom, max(shown) + reach)
    axes.set_ylabel("Damping ratio [%]")
    axes.set_title(rf"$f_0$ = {ring.frequency:.3f} Hz")
