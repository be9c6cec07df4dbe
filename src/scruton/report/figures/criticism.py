"""Figures that judge a fit: chains, innovations, predictive checks, what moved the posterior."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray, thin
from scruton.griffin.posterior import peak_names, printed_draws, test_names, unit_of
from scruton.infer import replication
from scruton.infer.criticism import Criticism, RecordOf, records
from scruton.infer.results import Fit
from scruton.infer.thresholds import BARELY_MOVED, NOT_MOVED, SENSITIVE, TRUSTED_KHAT
from scruton.report.conventions import decrements, parameter_unit, parameter_words, shown_in
from scruton.report.figures import FigureWithCaption, figure, style
from scruton.report.summaries import forces_hold
from scruton.report.tables import unit_of as unit_of_parameter
from scruton.report.thresholds import CHAINS_SHOWN, PANELS_A_PAGE
from scruton.report.wording import unit_text
from scruton.stats import whiteness

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


CORNER = ("a_star", "relaxation_rate", "damping_ratio", "Y1", "epsilon", "amplitude_scatter")
TRACE = ("a_star", "relaxation_rate", "damping_ratio", "amplitude_scatter", "noise_factor")
_MASS = (0.90, 0.50)  # what the contours hold
_WALKERS = 3  # lines drawn of each ensemble
_STEPS = 300
_ROWS, _LINES, _POINTS = 4, 16, 1500
# Signs of the parameters, as the axes show them.
_SIGNS = {
    "a_star": "$a^*$", "relaxation_rate": r"$\lambda$", "Y1": "$Y_1$", "epsilon": r"$\varepsilon$",
    "damping_ratio": r"$\xi_s$", "amplitude_scatter": "scatter", "noise_factor": "noise factor",
    "gust_scatter": "gusts", "gust_time": "gust time", "set_point_scatter": "set-point",
    "departure_scale": "departure",
    "law_exponent": "$n$", "reference_amplitude": r"$A_\mathrm{ref}$", "reference_relaxation": r"$R_\mathrm{ref}$",
    "discrepancy_amplitude": r"$\tau$", "discrepancy_relaxation": r"$\kappa$",
}  # fmt: skip


def chains_shown(fit: Fit) -> dict[str, str]:
    """Peak tests whose plots a report holds, by their number in the campaign: a name may hold what a file cannot."""
    return {f"_{test_names(fit.tree).index(test) + 1}": test for test in peak_names(fit.tree)[:CHAINS_SHOWN]}


@figure("posterior", name="corner", what="The corner plot", each=chains_shown)
def corner_plot(fit: Fit, test: str) -> FigureWithCaption:
    """Pairs of parameters of one test with contours that hold 50 and 90 % of the posterior."""
    from matplotlib.ticker import MaxNLocator

    printed = printed_draws(fit.tree, test)
    # Y1 and epsilon are the paper's law's: drawn where it carries weight
    names = CORNER if "Y1" in printed and forces_hold(fit.summary) else TRACE
    draws = {name: _shown_in(fit.tree, name)[0] * printed[name] for name in names}
    drawing = style.new_figure(124.0)
    grid = drawing.add_gridspec(len(names), len(names))
    for i, below in enumerate(names):
        for j, across in enumerate(names[: i + 1]):
            axes = drawing.add_subplot(grid[i, j])
            if i == j:
                _marginal(axes, draws[across])
            else:
                _pair(axes, draws[across], draws[below])
                axes.set_ylim(*_range(draws[below]))
                axes.yaxis.set_major_locator(MaxNLocator(3, prune="both"))
                axes.tick_params(axis="y", labelleft=j == 0)
            axes.set_xlim(*_range(draws[across]))
            axes.xaxis.set_major_locator(MaxNLocator(3, prune="both"))
            axes.tick_params(axis="x", labelbottom=below == names[-1], rotation=45)
            axes.set_xlabel(_label(fit, across) if below == names[-1] else "")
            axes.set_ylabel(_label(fit, below) if j == 0 and i > 0 else "")
    drawing.align_labels()
    words = f"{style.shorten(test, 30)}\ncontours hold 50 and 90 %"  # in the empty corner
    drawing.text(0.62, 0.9, words, fontsize=8.5, va="top")
    return FigureWithCaption(
        drawing,
        caption=f"Posterior of test {test}: marginal distributions with median and 90 % interval, and pairs with "
        "contours that hold 50 and 90 % of the draws.",
        alt=f"Corner plot of {', '.join(map(parameter_words, names))} for test {test}.",
    )


def _marginal(axes: "Axes", draws: FloatArray) -> None:
    low, middle, high = np.quantile(draws, style.Q90)
    counts, edges = np.histogram(draws, bins=_bins(draws), range=_range(draws), density=True)
    axes.stairs(counts, edges, color=style.BLUE, fill=True, alpha=0.3)
    axes.stairs(counts, edges, color=style.BLUE, lw=0.9)
    axes.axvline(middle, color=style.GREY, lw=0.9)
    for edge in (low, high):
        axes.axvline(edge, color=style.GREY, lw=0.8, ls=(0, (3, 2)))
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)


def _pair(axes: "Axes", x: FloatArray, y: FloatArray) -> None:
    from scipy.ndimage import gaussian_filter

    counts, first, second = np.histogram2d(x, y, bins=_bins(x), range=[_range(x), _range(y)])
    smooth = gaussian_filter(counts.T, 1.3, mode="constant")
    ordered = np.sort(smooth.ravel())[::-1]
    held = np.cumsum(ordered) / ordered.sum()
    levels = sorted({float(ordered[np.searchsorted(held, mass)]) for mass in _MASS})
    if levels[0] <= 0.0 or levels[-1] >= smooth.max():
        axes.plot(x[:500], y[:500], ".", ms=1, color=style.BLUE)
        return
    centres = (0.5 * (first[1:] + first[:-1]), 0.5 * (second[1:] + second[:-1]))
    colours = [style.SKY, style.BLUE][: len(levels)]
    axes.contourf(*centres, smooth, levels=[*levels, float(smooth.max())], colors=colours, alpha=0.55)
    axes.contour(*centres, smooth, levels=levels, colors=style.BLUE, linewidths=0.8)


def _bins(draws: FloatArray) -> int:
    return int(np.clip(np.sqrt(draws.size) / 2, 16, 32))


def _range(draws: FloatArray) -> tuple[float, float]:
    low, high = np.quantile(draws, [0.01, 0.99])
    margin = 0.15 * (high - low) or 0.01 * abs(high) or 1e-9
    return float(low - margin), float(high + margin)


@figure("convergence", name="trace", what="The traces", each=chains_shown)
def trace_plot(fit: Fit, test: str) -> FigureWithCaption:
    """Chains of one test against the draw, coloured by ensemble, with the marginal of each ensemble beside."""
    drawing = style.new_figure(19.5 * len(TRACE) + 10.0)
    axes = drawing.subplots(len(TRACE), 2, width_ratios=(4.5, 1.0), sharey="row", squeeze=False)
    for (left, right), name in zip(axes, TRACE, strict=True):
        draws = _draws(fit.tree, name, test)  # (ensembles, walkers, draws of each)
        bins = np.linspace(draws.min(), draws.max(), 22)
        steps = np.arange(0, draws.shape[2], -(-draws.shape[2] // _STEPS))
        for i, walkers in enumerate(draws):
            colour = style.line_style(i).colour
            if walkers.shape[0] > _WALKERS:
                low, high = np.quantile(walkers[:, steps], [0.05, 0.95], axis=0)
                left.fill_between(steps, low, high, color=colour, alpha=0.12, lw=0)
            for walker in walkers[:_WALKERS]:
                left.plot(steps, walker[steps], color=colour, lw=0.5, alpha=0.9, label=f"ensemble {i + 1}")
            counts, _ = np.histogram(walkers, bins=bins, density=True)
            right.plot(counts, 0.5 * (bins[1:] + bins[:-1]), color=colour, lw=0.9)
        left.set(
            ylabel=_label(fit, name).replace("noise factor", "noise\nfactor"), xlim=(0, draws.shape[2]), ymargin=0.05
        )
        left.tick_params(labelbottom=name == TRACE[-1])
        right.xaxis.set_visible(False)
        right.spines["bottom"].set_visible(False)
        right.tick_params(labelleft=False)
    axes[0, 0].set_title(style.shorten(test, 50))
    axes[-1, 0].set_xlabel("Draw of each walker [-]")
    handles = style.legend_handles([axes[0, 0]])
    drawing.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=min(4, len(handles)))
    drawing.align_ylabels(axes[:, 0])
    return FigureWithCaption(
        drawing,
        caption=f"Chains of test {test} by ensemble: band of 90 % of an ensemble's walkers at every draw, a few "
        "walkers as lines, and the distribution of each ensemble at the right. Ensembles start apart and must agree.",
        alt=f"Trace plot of {', '.join(map(parameter_words, TRACE))} for test {test}, one colour an ensemble.",
    )


def _draws(tree: "xr.DataTree", name: str, test: str) -> FloatArray:
    column = tree["posterior"][name].sel(test=test).transpose("chain", "draw")
    walkers = len(np.unique(column["walker"]))
    values = np.asarray(column.values, dtype=float).reshape(column.sizes["chain"], walkers, -1)
    return _shown_in(tree, name)[0] * values


def _label(fit: Fit, name: str) -> str:
    sign = r"$\delta_s$" if name == "damping_ratio" and decrements() else _SIGNS[name]
    unit = unit_text(_shown_in(fit.tree, name)[1])
    return f"{sign} [{unit if unit not in ('', 'A/D') else '-'}]"


def _shown_in(tree: "xr.DataTree", name: str) -> tuple[float, str]:
    """Factor and unit by which a parameter is shown."""
    return shown_in(parameter_unit(name, unit_of_parameter(name, unit_of(tree))))


def _record(test: str, record: str) -> str:
    return f"{style.shorten(test, 20)}: {style.shorten(record, 24)}"


@figure(name="innovations", source="criticism")
def innovation_figures(tree: "xr.DataTree", criticism: Criticism) -> Iterable[FigureWithCaption]:
    """Innovations of every record that was judged by them."""
    judged = {(entry.test, entry.record) for entry in criticism.innovations}
    for page in style.pages([series for series in records(tree) if (series.test, series.record) in judged], _ROWS):
        values = np.asarray(tree["innovations"]["amplitude"].to_numpy(), dtype=float).reshape(-1)
        drawing = style.new_figure(38.0 * len(page) + 8.0)
        grid = drawing.subplots(len(page), 4, squeeze=False)
        for row, record in zip(grid, page, strict=True):
            _innovation_row(row, record, values[record.index], shown_in(unit_of(tree))[0])
        labels = ("Time [s]", style.amplitude_label(unit_of(tree)), "Lag [cycles]", "Normal quantile")
        for axes, label in zip(grid[-1], labels, strict=True):
            axes.set_xlabel(label, fontsize=7.5)
        drawing.align_ylabels()
        yield FigureWithCaption(
            drawing,
            caption="Standardised innovations of the filter, one record a row: against time; against the amplitude of "
            "the cycle before, with the fitted parabola, which is flat where the law of damping has the right shape; "
            "their autocorrelation with 95 % limits; and against normal quantiles.",
            alt=f"Four panels for each of {len(page)} record(s): innovations over time and over amplitude, their "
            "autocorrelation, and a normal quantile plot.",
        )


def _innovation_row(row: "Sequence[Axes]", record: RecordOf, values: np.ndarray, scale: float) -> None:
    from matplotlib.ticker import MaxNLocator
    from scipy.special import ndtri

    x, before, time = values[1:], scale * record.amplitude[:-1], record.time[1:] - record.time[0]
    pick = thin(x.size, _POINTS)
    for axes, at in zip(row[:2], (time, before), strict=True):
        axes.axhspan(-1.96, 1.96, color=style.LIGHT, alpha=0.45, lw=0)
        axes.axhline(0.0, color=style.GREY, lw=0.6)
        axes.plot(at[pick], x[pick], ".", color=style.BLUE, ms=2.2)
    row[0].set_ylabel("Innovation [sd]", fontsize=7.5)
    row[0].set_title(_record(record.test, record.record), fontsize=7.5)
    grid = np.linspace(before.min(), before.max(), 100)
    row[1].plot(grid, np.polynomial.Polynomial.fit(before, x, 2)(grid), color=style.VERMILLION, lw=1.2)
    row[1].xaxis.set_major_locator(MaxNLocator(3))  # three decimals each: more run together in a quarter of the page
    lags = whiteness.lags_of(x.size)
    limit = 1.96 / np.sqrt(x.size)
    row[2].axhspan(-limit, limit, color=style.LIGHT, alpha=0.45, lw=0)
    row[2].axhline(0.0, color=style.GREY, lw=0.6)
    row[2].vlines(np.arange(1, lags + 1), 0.0, whiteness.autocorrelation(x, lags), color=style.BLUE, lw=1.6)
    row[2].set_ylabel("Autocorrelation", fontsize=7.5)
    theory = ndtri((np.arange(1, x.size + 1) - 0.5) / x.size)
    reach = np.array([theory[0], theory[-1]])
    row[3].plot(reach, reach, color=style.GREY, lw=0.8)
    row[3].plot(theory[pick], np.sort(x)[pick], ".", color=style.BLUE, ms=2.2)
    row[3].set_ylabel("Innovation [sd]", fontsize=7.5)


@figure(name="posterior_predictive", source="criticism")
def predictive_figures(_: "xr.DataTree", criticism: Criticism) -> Iterable[FigureWithCaption]:
    """Statistics of every record beside those of its replicates."""
    known = list(dict.fromkeys((entry.test, entry.record) for entry in criticism.predictive))
    for page in style.pages(known, _LINES):
        height, names = 20.0 + 6.0 * len(page), replication.STATISTICS
        drawing, panels = style.panels(len(names), columns=3, height_mm=height, sharey=True)
        for axes, statistic in zip(panels, names, strict=True):
            rows = {(entry.test, entry.record): entry for entry in criticism.predictive if entry.name == statistic}
            for i, key in enumerate(page):
                check = rows[key]
                axes.hlines(i, check.low, check.high, color=style.LIGHT, lw=5.0, label="replicates, 90 %")
                marker, colour, label = "o", style.BLUE, "observed"
                if check.adjusted < 0.01:
                    marker, colour, label = "D", style.VERMILLION, "observed, p < 0.01"
                axes.plot(check.value, i, marker, color=colour, ms=4.5, label=label)
            axes.set_title(statistic[0].upper() + statistic[1:], fontsize=8.0)
            axes.margins(x=0.08)
            axes.locator_params(axis="x", nbins=4)
        style.rows(panels[0], [f"{style.shorten(test, 14)}\n{style.shorten(record, 18)}" for test, record in page])
        style.below(drawing, panels)
        yield FigureWithCaption(
            drawing,
            caption="Posterior predictive check: statistics of every record and the central 90 % of those of its "
            "replicates. Statistics of the residual are about the mean curve of each draw, in units of amplitude.",
            alt=f"Five panels with an interval and a mark for each of {len(page)} record(s).",
        )


@figure(name="prior_predictive", source="criticism")
def prior_figures(tree: "xr.DataTree", criticism: Criticism) -> Iterable[FigureWithCaption]:
    """Every record inside what the priors expected of it."""
    banded = [series for series in records(tree) if (series.test, series.record) in criticism.bands]
    for page in style.pages(banded, PANELS_A_PAGE):
        drawing, panels = style.panels(len(page), height_mm=46.0)
        for axes, record in zip(panels, page, strict=True):
            scale = shown_in(unit_of(tree))[0]
            shown = replace(record, amplitude=scale * record.amplitude)
            _prior_panel(axes, shown, scale * criticism.bands[record.test, record.record])
        for axes in panels[:: min(2, len(page))]:
            axes.set_ylabel(style.amplitude_label(unit_of(tree)))
        style.below(drawing, panels, columns=4)
        yield FigureWithCaption(
            drawing,
            caption="Prior predictive check: what the priors alone expect of each record from its first amplitude on, "
            "with what was observed.",
            alt=f"Amplitudes of {len(page)} record(s) over time inside wide bands of the prior predictive, logarithmic "
            "scale.",
        )


def _prior_panel(axes: "Axes", record: RecordOf, bands: FloatArray) -> None:
    time = record.time - record.time[0]
    floor = 0.2 * float(record.amplitude[record.amplitude > 0.0].min(initial=np.inf))
    pick = thin(time.size, 400)
    low, quarter, middle, three, high = np.maximum(bands[:, pick], floor)
    label = "prior predictive, 90 %"
    axes.fill_between(time[pick], low, high, color=style.ORANGE, alpha=0.35, lw=0, label=label)
    axes.fill_between(time[pick], quarter, three, color=style.ORANGE, alpha=0.6, lw=0, label="50 %")
    axes.plot(time[pick], middle, color=style.VERMILLION, lw=1.0, ls=(0, (5, 2)), label="median")
    positive = record.amplitude > 0.0
    axes.plot(time[positive], record.amplitude[positive], ".", color=style.BLACK, ms=2.0, label="observed")
    axes.set_yscale("log")
    axes.set_ylim(bottom=floor)
    style.plain_log(axes.yaxis)
    axes.set_title(_record(record.test, record.record), fontsize=7.5)
    axes.set_xlabel("Time from the first cycle [s]")


@figure(name="what_moved_the_posterior", source="criticism")
def moved_figures(_: "xr.DataTree", criticism: Criticism) -> Iterable[FigureWithCaption]:
    """Standard deviations and sensitivities, a line for every parameter."""
    moved = [row.test for row in criticism.moved if row.test]
    for page in style.pages(list(dict.fromkeys(moved or [sensitivity.test for sensitivity in criticism.scaling])), 3):
        yield _moved(page, criticism)


def _moved(tests: Sequence[str], criticism: Criticism) -> FigureWithCaption:
    ratios = {(row.test, row.parameter): row.ratio for row in criticism.moved if row.test in tests or not row.test}
    scaled = {(row.test, row.parameter): row for row in criticism.scaling if row.test in tests}
    lines = list(dict.fromkeys([*ratios, *scaled]))
    drawing = style.new_figure(26.0 + 5.0 * len(lines))
    left, right = drawing.subplots(1, 2, sharey=True)
    for axes, edge in ((left, BARELY_MOVED), (left, NOT_MOVED), (right, SENSITIVE)):
        axes.axvline(edge, color=style.GREY, lw=0.8, ls=(0, (4, 2)))
    for i, key in enumerate(lines):
        if np.isfinite(ratios.get(key, np.nan)):
            left.hlines(i, 1e-4, ratios[key], color=style.LIGHT, lw=3.0)
            left.plot(ratios[key], i, "o", color=style.BLUE)
        if key in scaled:
            sensitivity = scaled[key]
            shown = (
                (sensitivity.prior, "s", style.VERMILLION, "the card's priors"),
                (sensitivity.still_air, "^", style.GREEN, "still air"),
                (sensitivity.likelihood, "o", style.BLUE, "records in wind"),
            )
            for value, marker, colour, label in shown:
                if np.isfinite(value):
                    right.plot(max(value, 1e-4), i, marker, color=colour, label=label)
    left.set(xscale="log", xlim=(0.5 * min(filter(np.isfinite, ratios.values()), default=0.1), 1.6))
    right.set(xscale="log", xmargin=0.08)
    for axes, title in ((left, "(a) Posterior sd over prior sd"), (right, "(b) Sensitivity to ...")):
        axes.set_title(title)
        style.plain_log(axes.xaxis)
    of = {test: style.shorten(test, 18) if test else "campaign" for test, _ in lines}
    style.rows(left, [f"{of[test]}  {_SIGNS.get(name, name)}" for test, name in lines])
    style.below(drawing, [right])
    return FigureWithCaption(
        drawing,
        caption="What moved the posterior. (a) Standard deviation after over before, in the coordinate that is "
        "sampled: beyond 0.5 the data barely moved a parameter, beyond 0.8 they did not. (b) How far the posterior "
        "follows a factor raised to a power (cumulative Jensen-Shannon distance a doubling): beyond 0.05 it matters.",
        alt=f"Two panels with marks for each of {len(lines)} parameters.",
    )


@figure(name="influence", source="criticism")
def influence_figures(_: "xr.DataTree", criticism: Criticism) -> Iterable[FigureWithCaption]:
    """Shifts of the posterior without a record, a line for every record."""
    known = list(dict.fromkeys((entry.test, entry.record) for entry in criticism.influence))
    rows = {(entry.test, entry.record, entry.parameter): entry for entry in criticism.influence}
    reach = max([1.5, *(1.15 * abs(entry.shift) for entry in rows.values())])
    marks = (("a_star", "o", style.BLUE, -0.14), ("relaxation_rate", "s", style.VERMILLION, 0.14))
    for page in style.pages(known, _LINES):
        drawing, axes = style.alone(26.0 + 9.0 * len(page))
        axes.axvspan(-1.0, 1.0, color=style.LIGHT, alpha=0.45, lw=0)
        axes.axvline(0.0, color=style.GREY, lw=0.6)
        for i, (test, record) in enumerate(page):
            for parameter, marker, colour, rise in marks:
                influence, label, inside = rows[test, record, parameter], _SIGNS[parameter], colour
                if not influence.trusted:
                    label, inside = f"{label}, not to be trusted (k-hat > {TRUSTED_KHAT})", "white"
                axes.plot(influence.shift, i + rise, marker, color=colour, mfc=inside, label=label)
                axes.hlines(i + rise, 0.0, influence.shift, color=colour, lw=0.9)
        style.rows(axes, [_record(*key) for key in page])
        axes.set_xlim(-reach, reach)
        axes.set_xlabel("Shift of the posterior when the record is left out [posterior sd]")
        style.below(drawing, [axes], columns=2)
        yield FigureWithCaption(
            drawing,
            caption="Influence of each record: how far the posterior of the stable amplitude and of the relaxation "
            "rate moves when the record is left out, by Pareto-smoothed reweighting. Hollow: the record dominates, "
            "only a refit tells.",
            alt=f"A shift of two parameters for each of {len(page)} record(s).",
        )
