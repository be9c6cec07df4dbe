"""Figures of a criticism: innovations, predictive checks, what moved the posterior."""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray
from scruton.infer import replication
from scruton.infer.criticism import Criticism, RecordOf, records
from scruton.infer.thresholds import BARELY_MOVED, NOT_MOVED, SENSITIVE, TRUSTED_KHAT
from scruton.report.figures import style
from scruton.report.figures.registry import FigureWithCaption, figure
from scruton.report.thresholds import PANELS_A_PAGE
from scruton.stats import whiteness

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_ROWS, _LINES, _POINTS = 4, 16, 1500
# Signs of the parameters, as the axes show them.
_SIGNS = {
    "a_star": "$a^*$", "relaxation_rate": r"$\lambda$", "Y1": "$Y_1$", "epsilon": r"$\varepsilon$",
    "damping_ratio": r"$\xi_s$", "amplitude_scatter": "scatter", "noise_factor": "noise factor",
    "law_exponent": "$n$", "reference_amplitude": r"$A_\mathrm{ref}$", "reference_relaxation": r"$R_\mathrm{ref}$",
    "discrepancy_amplitude": r"$\tau$", "discrepancy_relaxation": r"$\kappa$",
}  # fmt: skip


def _label(test: str, record: str) -> str:
    return f"{style.shorten(test, 20)}: {style.shorten(record, 24)}"


@figure(
    "",
    name="innovations",
    source="criticism",
    caption="Standardised innovations of the filter, one record a row: against time; against the amplitude of the "
    "cycle before, with the fitted parabola, which is flat where the law of damping has the right shape; their "
    "autocorrelation with 95 % limits; and against normal quantiles.",
)
def innovation_figures(tree: "xr.DataTree", criticism: Criticism) -> Iterable[FigureWithCaption]:
    """Innovations of every record that was judged by them."""
    judged = {(one.test, one.record) for one in criticism.innovations}
    for page in style.pages([one for one in records(tree) if (one.test, one.record) in judged], _ROWS):
        values = np.asarray(tree["innovations"]["amplitude"].to_numpy(), dtype=float).reshape(-1)
        drawing = style.new_figure(38.0 * len(page) + 8.0)
        grid = drawing.subplots(len(page), 4, squeeze=False)
        for row, one in zip(grid, page, strict=True):
            _innovation_row(row, one, values[one.index])
        labels = ("Time [s]", style.amplitude_label(_unit(tree)), "Lag [cycles]", "Normal quantile")
        for axes, label in zip(grid[-1], labels, strict=True):
            axes.set_xlabel(label, fontsize=7.5)
        drawing.align_ylabels()
        yield FigureWithCaption(
            drawing,
            alt=f"Four panels for each of {len(page)} record(s): innovations over time and over amplitude, their "
            "autocorrelation, and a normal quantile plot.",
        )


def _innovation_row(row: "Sequence[Axes]", one: RecordOf, values: np.ndarray) -> None:
    from scipy.stats import norm

    x, before, time = values[1:], one.amplitude[:-1], one.time[1:] - one.time[0]
    pick = style.thin(x.size, _POINTS)
    for axes, at in zip(row[:2], (time, before), strict=True):
        axes.axhspan(-1.96, 1.96, color=style.LIGHT, alpha=0.45, lw=0)
        axes.axhline(0.0, color=style.GREY, lw=0.6)
        axes.plot(at[pick], x[pick], ".", color=style.BLUE, ms=2.2)
    row[0].set_ylabel("Innovation [sd]", fontsize=7.5)
    row[0].set_title(_label(one.test, one.record), fontsize=7.5)
    grid = np.linspace(before.min(), before.max(), 100)
    # on an axis of unit spread: three coefficients of amplitudes near 0.01 would be ill-conditioned
    scale = before.std() or 1.0
    middle = before.mean()
    parabola = np.polynomial.polynomial.polyfit((before - middle) / scale, x, 2)
    row[1].plot(
        grid, np.polynomial.polynomial.polyval((grid - middle) / scale, parabola), color=style.VERMILLION, lw=1.2
    )
    lags = whiteness.lags_of(x.size)
    limit = 1.96 / np.sqrt(x.size)
    row[2].axhspan(-limit, limit, color=style.LIGHT, alpha=0.45, lw=0)
    row[2].axhline(0.0, color=style.GREY, lw=0.6)
    row[2].vlines(np.arange(1, lags + 1), 0.0, whiteness.autocorrelation(x, lags), color=style.BLUE, lw=1.6)
    row[2].set_ylabel("Autocorrelation", fontsize=7.5)
    theory = norm.ppf((np.arange(1, x.size + 1) - 0.5) / x.size)
    reach = np.array([theory[0], theory[-1]])
    row[3].plot(reach, reach, color=style.GREY, lw=0.8)
    row[3].plot(theory[pick], np.sort(x)[pick], ".", color=style.BLUE, ms=2.2)
    row[3].set_ylabel("Innovation [sd]", fontsize=7.5)


@figure(
    "",
    name="posterior_predictive",
    source="criticism",
    caption="Posterior predictive check: statistics of every record and the central 90 % of those of its replicates. "
    "Statistics of the residual are about the mean curve of each draw, in units of amplitude.",
)
def predictive_figures(_: "xr.DataTree", criticism: Criticism) -> Iterable[FigureWithCaption]:
    """Statistics of every record beside those of its replicates."""
    known = list(dict.fromkeys((one.test, one.record) for one in criticism.predictive))
    for page in style.pages(known, _LINES):
        drawing, panels = style.panels(
            len(replication.STATISTICS), columns=3, height_mm=20.0 + 6.0 * len(page), sharey=True
        )
        for axes, statistic in zip(panels, replication.STATISTICS, strict=True):
            rows = {(one.test, one.record): one for one in criticism.predictive if one.name == statistic}
            for i, key in enumerate(page):
                one = rows[key]
                bad = one.adjusted < 0.01
                axes.hlines(i, one.low, one.high, color=style.LIGHT, lw=5.0, label="replicates, 90 %")
                marker, colour, label = (
                    ("D", style.VERMILLION, "observed, p < 0.01") if bad else ("o", style.BLUE, "observed")
                )
                axes.plot(one.value, i, marker, color=colour, ms=4.5, label=label)
            axes.set_title(statistic[0].upper() + statistic[1:], fontsize=8.0)
            axes.margins(x=0.08)
            axes.locator_params(axis="x", nbins=4)
        _lines(panels[0], [f"{style.shorten(test, 14)}\n{style.shorten(record, 18)}" for test, record in page])
        style.below(drawing, panels)
        yield FigureWithCaption(
            drawing, alt=f"Five panels with an interval and a mark for each of {len(page)} record(s)."
        )


@figure(
    "",
    name="prior_predictive",
    source="criticism",
    caption="Prior predictive check: what the priors alone expect of each record from its first amplitude on, with "
    "what was observed.",
)
def prior_figures(tree: "xr.DataTree", criticism: Criticism) -> Iterable[FigureWithCaption]:
    """Every record inside what the priors expected of it."""
    banded = [one for one in records(tree) if (one.test, one.record) in criticism.bands]
    for page in style.pages(banded, PANELS_A_PAGE):
        drawing, panels = style.panels(len(page), height_mm=46.0)
        for axes, one in zip(panels, page, strict=True):
            _prior_panel(axes, one, criticism.bands[one.test, one.record])
        for axes in panels[:: min(2, len(page))]:
            axes.set_ylabel(style.amplitude_label(_unit(tree)))
        style.below(drawing, panels, columns=4)
        yield FigureWithCaption(
            drawing,
            alt=f"Amplitudes of {len(page)} record(s) over time inside wide bands of the prior predictive, logarithmic "
            "scale.",
        )


def _prior_panel(axes: "Axes", one: RecordOf, bands: FloatArray) -> None:
    time = one.time - one.time[0]
    floor = 0.2 * float(one.amplitude[one.amplitude > 0.0].min(initial=np.inf))
    pick = style.thin(time.size, 400)
    low, quarter, middle, three, high = np.maximum(bands[:, pick], floor)
    label = "prior predictive, 90 %"
    axes.fill_between(time[pick], low, high, color=style.ORANGE, alpha=0.35, lw=0, label=label)
    axes.fill_between(time[pick], quarter, three, color=style.ORANGE, alpha=0.6, lw=0, label="50 %")
    axes.plot(time[pick], middle, color=style.VERMILLION, lw=1.0, ls=(0, (5, 2)), label="median")
    positive = one.amplitude > 0.0
    axes.plot(time[positive], one.amplitude[positive], ".", color=style.BLACK, ms=2.0, label="observed")
    axes.set_yscale("log")
    axes.set_ylim(bottom=floor)
    style.plain_log(axes.yaxis)
    axes.set_title(_label(one.test, one.record), fontsize=7.5)
    axes.set_xlabel("Time from the first cycle [s]")


@figure(
    "",
    name="what_moved_the_posterior",
    source="criticism",
    caption="What moved the posterior. (a) Standard deviation after over before, in the coordinate that is sampled: "
    "beyond 0.5 the data barely moved a parameter, beyond 0.8 they did not. (b) How far the posterior follows a factor "
    "raised to a power (cumulative Jensen-Shannon distance a doubling): beyond 0.05 it matters.",
)
def moved_figures(_: "xr.DataTree", criticism: Criticism) -> Iterable[FigureWithCaption]:
    """Standard deviations and sensitivities, a line for every parameter."""
    moved = [one.test for one in criticism.moved if one.test]
    for page in style.pages(list(dict.fromkeys(moved or [one.test for one in criticism.scaling])), 3):
        yield _moved(page, criticism)


def _moved(tests: Sequence[str], criticism: Criticism) -> FigureWithCaption:
    moved = [one for one in criticism.moved if one.test in tests or not one.test]
    lines = [(one.test, one.parameter) for one in moved]
    ratios = {(one.test, one.parameter): one.ratio for one in moved}
    scaled = {(one.test, one.parameter): one for one in criticism.scaling if one.test in tests}
    lines += [key for key in scaled if key not in ratios]
    drawing = style.new_figure(26.0 + 5.0 * len(lines))
    left, right = drawing.subplots(1, 2, sharey=True)
    limits = ((left, BARELY_MOVED), (left, NOT_MOVED), (right, SENSITIVE))
    for axes, edge in limits:
        axes.axvline(edge, color=style.GREY, lw=0.8, ls=(0, (4, 2)))
    for i, key in enumerate(lines):
        if np.isfinite(ratios.get(key, np.nan)):
            left.hlines(i, 1e-4, ratios[key], color=style.LIGHT, lw=3.0)
            left.plot(ratios[key], i, "o", color=style.BLUE)
        if key in scaled:
            one = scaled[key]
            shown = (
                (one.prior, "s", style.VERMILLION, "the card's priors"),
                (one.still_air, "^", style.GREEN, "still air"),
                (one.likelihood, "o", style.BLUE, "records in wind"),
            )
            for value, marker, colour, label in shown:
                if np.isfinite(value):
                    right.plot(max(value, 1e-4), i, marker, color=colour, label=label)
    for axes, title in ((left, "(a) Posterior sd over prior sd"), (right, "(b) Sensitivity to ...")):
        axes.set_xscale("log")
        axes.set_title(title)
    lowest = min([ratio for ratio in ratios.values() if np.isfinite(ratio)], default=0.1)
    left.set_xlim(0.5 * lowest, 1.6)
    right.margins(x=0.08)
    style.plain_log(left.xaxis)
    style.plain_log(right.xaxis)
    _lines(
        left, [f"{style.shorten(test, 18) if test else 'campaign'}  {_SIGNS.get(name, name)}" for test, name in lines]
    )
    style.below(drawing, [right])
    return FigureWithCaption(drawing, alt=f"Two panels with marks for each of {len(lines)} parameters.")


@figure(
    "",
    name="influence",
    source="criticism",
    caption="Influence of each record: how far the posterior of the stable amplitude and of the relaxation rate moves "
    "when the record is left out, by Pareto-smoothed reweighting. Hollow: the record dominates, only a refit tells.",
)
def influence_figures(_: "xr.DataTree", criticism: Criticism) -> Iterable[FigureWithCaption]:
    """Shifts of the posterior without a record, a line for every record."""
    known = list(dict.fromkeys((one.test, one.record) for one in criticism.influence))
    rows = {(one.test, one.record, one.parameter): one for one in criticism.influence}
    reach = max([1.5, *(1.15 * abs(one.shift) for one in rows.values())])
    marks = (
        ("a_star", "o", style.BLUE, "$a^*$", -0.14),
        ("relaxation_rate", "s", style.VERMILLION, r"$\lambda$", 0.14),
    )
    for page in style.pages(known, _LINES):
        drawing = style.new_figure(26.0 + 9.0 * len(page))
        axes = drawing.subplots()
        axes.axvspan(-1.0, 1.0, color=style.LIGHT, alpha=0.45, lw=0)
        axes.axvline(0.0, color=style.GREY, lw=0.6)
        for i, (test, record) in enumerate(page):
            for parameter, marker, colour, sign, rise in marks:
                one = rows[test, record, parameter]
                label = sign if one.trusted else f"{sign}, not to be trusted (k-hat > {TRUSTED_KHAT})"
                inside = colour if one.trusted else "white"
                axes.plot(one.shift, i + rise, marker, color=colour, mfc=inside, label=label)
                axes.hlines(i + rise, 0.0, one.shift, color=colour, lw=0.9)
        _lines(axes, [_label(*key) for key in page])
        axes.set_xlim(-reach, reach)
        axes.set_xlabel("Shift of the posterior when the record is left out [posterior sd]")
        style.below(drawing, [axes], columns=2)
        yield FigureWithCaption(drawing, alt=f"A shift of two parameters for each of {len(page)} record(s).")


def _lines(axes: "Axes", labels: Sequence[str]) -> None:
    """Name the lines of an axis that counts downwards."""
    axes.set_yticks(range(len(labels)), labels)
    axes.set_ylim(len(labels) - 0.4, -0.6)


def _unit(tree: "xr.DataTree") -> str:
    return str(tree["constant_data"]["amplitude_unit"].item())
