"""Figures of a criticism: innovations, predictive checks, what moved the posterior."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from scruton.infer import replication
from scruton.infer.criticism import Criticism, RecordOf, records
from scruton.infer.thresholds import BARELY_MOVED, NOT_MOVED, SENSITIVE, TRUSTED_KHAT
from scruton.report.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    LIGHT,
    ORANGE,
    VERMILLION,
    FigureWithCaption,
    amplitude_label,
    below,
    house_style,
    new_figure,
    pages,
    panels,
    plain_log,
    shorten,
    thin,
)
from scruton.stats import whiteness

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ROWS, _PANELS, _LINES, _POINTS = 4, 6, 16, 1500
# Signs of the parameters, as the axes show them.
_SIGNS = {
    "a_star": "$a^*$",
    "relaxation_rate": r"$\lambda$",
    "Y1": "$Y_1$",
    "epsilon": r"$\varepsilon$",
    "damping_ratio": r"$\xi_s$",
    "amplitude_scatter": "scatter",
    "noise_factor": "noise factor",
    "law_exponent": "$n$",
    "reference_amplitude": r"$A_\mathrm{ref}$",
    "reference_relaxation": r"$R_\mathrm{ref}$",
    "discrepancy_amplitude": r"$\tau$",
    "discrepancy_relaxation": r"$\kappa$",
}


def criticism_figures(tree: "xr.DataTree", criticism: Criticism) -> list[FigureWithCaption]:
    """Every figure that the answers fill; long campaigns take several pages, numbered from the second on.

    Parameters
    ----------
    tree : DataTree
        Of the fit that was criticised.
    criticism : Criticism
    """
    known = list(records(tree))
    unit = str(tree["constant_data"]["amplitude_unit"].item())
    found: list[FigureWithCaption] = []
    if criticism.innovations:
        values = np.asarray(tree["innovations"]["amplitude"].to_numpy(), dtype=float).reshape(-1)
        judged = {(one.test, one.record) for one in criticism.innovations}
        items = [(one, values[one.index]) for one in known if (one.test, one.record) in judged]
        for i, page in enumerate(pages(items, _ROWS)):
            found.append(_innovations(page, unit, _numbered("innovations", i)))
    if criticism.predictive:
        found += _predictive_pages(criticism)
    banded = [one for one in known if (one.test, one.record) in criticism.bands]
    for i, group in enumerate(pages(banded, _PANELS)):
        found.append(_prior(group, criticism, unit, _numbered("prior_predictive", i)))
    if criticism.scaling or criticism.moved:
        tests = list(dict.fromkeys(one.test for one in criticism.moved if one.test)) or list(
            dict.fromkeys(one.test for one in criticism.scaling)
        )
        for i, names in enumerate(pages(tests, 3)):
            found.append(_moved(names, criticism, _numbered("what_moved_the_posterior", i)))
    if criticism.influence:
        found += _influence_pages(criticism)
    return found


def _numbered(name: str, page: int) -> str:
    return name if page == 0 else f"{name}_{page + 1}"


def _label(test: str, record: str) -> str:
    return f"{shorten(test, 20)}: {shorten(record, 24)}"


def _innovations(items: Sequence[tuple[RecordOf, np.ndarray]], unit: str, name: str) -> FigureWithCaption:
    with house_style():
        figure = new_figure(38.0 * len(items) + 8.0)
        grid = figure.subplots(len(items), 4, squeeze=False)
        for row, (one, values) in zip(grid, items, strict=True):
            _innovation_row(row, one, values)
        for axes, label in zip(
            grid[-1], ("Time [s]", amplitude_label(unit), "Lag [cycles]", "Normal quantile"), strict=True
        ):
            axes.set_xlabel(label, fontsize=7.5)
        figure.align_ylabels()
    return FigureWithCaption(
        figure,
        name,
        "Standardised innovations of the filter, one record a row: against time; against the amplitude of the cycle "
        "before, with the fitted parabola, which is flat where the law of damping has the right shape; their "
        "autocorrelation with 95 % limits; and against normal quantiles.",
        f"Four panels for each of {len(items)} record(s): innovations over time and over amplitude, their "
        "autocorrelation, and a normal quantile plot.",
    )


def _innovation_row(row: "Sequence[Axes]", one: RecordOf, values: np.ndarray) -> None:
    from scipy.stats import norm

    x, before, time = values[1:], one.amplitude[:-1], one.time[1:] - one.time[0]
    pick = thin(x.size, _POINTS)
    for axes, at in zip(row[:2], (time, before), strict=True):
        axes.axhspan(-1.96, 1.96, color=LIGHT, alpha=0.45, lw=0)
        axes.axhline(0.0, color=GREY, lw=0.6)
        axes.plot(at[pick], x[pick], ".", color=BLUE, ms=2.2)
    row[0].set_ylabel("Innovation [sd]", fontsize=7.5)
    row[0].set_title(_label(one.test, one.record), fontsize=7.5)
    grid = np.linspace(before.min(), before.max(), 100)
    # on an axis of unit spread: three coefficients of amplitudes near 0.01 would be ill-conditioned
    scale = before.std() or 1.0
    middle = before.mean()
    parabola = np.polynomial.polynomial.polyfit((before - middle) / scale, x, 2)
    row[1].plot(grid, np.polynomial.polynomial.polyval((grid - middle) / scale, parabola), color=VERMILLION, lw=1.2)
    lags = whiteness.lags_of(x.size)
    limit = 1.96 / np.sqrt(x.size)
    row[2].axhspan(-limit, limit, color=LIGHT, alpha=0.45, lw=0)
    row[2].axhline(0.0, color=GREY, lw=0.6)
    row[2].vlines(np.arange(1, lags + 1), 0.0, whiteness.autocorrelation(x, lags), color=BLUE, lw=1.6)
    row[2].set_ylabel("Autocorrelation", fontsize=7.5)
    theory = norm.ppf((np.arange(1, x.size + 1) - 0.5) / x.size)
    reach = np.array([theory[0], theory[-1]])
    row[3].plot(reach, reach, color=GREY, lw=0.8)
    row[3].plot(theory[pick], np.sort(x)[pick], ".", color=BLUE, ms=2.2)
    row[3].set_ylabel("Innovation [sd]", fontsize=7.5)


def _predictive_pages(criticism: Criticism) -> list[FigureWithCaption]:
    known = list(dict.fromkeys((one.test, one.record) for one in criticism.predictive))
    return [
        _predictive(page, criticism, _numbered("posterior_predictive", i))
        for i, page in enumerate(pages(known, _LINES))
    ]


def _predictive(known: Sequence[tuple[str, str]], criticism: Criticism, name: str) -> FigureWithCaption:
    with house_style():
        figure, axes = panels(len(replication.STATISTICS), columns=3, height_mm=20.0 + 6.0 * len(known), sharey=True)
        for panel, statistic in zip(axes, replication.STATISTICS, strict=True):
            rows = {(one.test, one.record): one for one in criticism.predictive if one.name == statistic}
            for i, key in enumerate(known):
                one = rows[key]
                bad = one.adjusted < 0.01
                panel.hlines(i, one.low, one.high, color=LIGHT, lw=5.0, label="replicates, 90 %")
                panel.plot(
                    one.value, i, "D" if bad else "o", color=VERMILLION if bad else BLUE, ms=4.5,
                    label="observed, p < 0.01" if bad else "observed",
                )  # fmt: skip
            panel.set_title(statistic[0].upper() + statistic[1:], fontsize=8.0)
            panel.margins(x=0.08)
            panel.locator_params(axis="x", nbins=4)
        axes[0].set_yticks(range(len(known)), [_short(*key) for key in known])
        axes[0].set_ylim(len(known) - 0.4, -0.6)
        below(figure, axes)
    return FigureWithCaption(
        figure,
        name,
        "Posterior predictive check: statistics of every record and the central 90 % of those of its replicates. "
        "Statistics of the residual are about the mean curve of each draw, in units of amplitude.",
        f"Five panels with an interval and a mark for each of {len(known)} record(s).",
    )


def _short(test: str, record: str) -> str:
    return f"{shorten(test, 14)}\n{shorten(record, 18)}"


def _prior(group: Sequence[RecordOf], criticism: Criticism, unit: str, name: str) -> FigureWithCaption:
    with house_style():
        figure, axes = panels(len(group), height_mm=46.0)
        for panel, one in zip(axes, group, strict=True):
            bands = criticism.bands[one.test, one.record]
            time = one.time - one.time[0]
            floor = 0.2 * float(one.amplitude[one.amplitude > 0.0].min(initial=np.inf))
            pick = thin(time.size, 400)
            low, quarter, middle, three, high = np.maximum(bands[:, pick], floor)
            panel.fill_between(time[pick], low, high, color=ORANGE, alpha=0.35, lw=0, label="prior predictive, 90 %")
            panel.fill_between(time[pick], quarter, three, color=ORANGE, alpha=0.6, lw=0, label="50 %")
            panel.plot(time[pick], middle, color=VERMILLION, lw=1.0, ls=(0, (5, 2)), label="median")
            positive = one.amplitude > 0.0
            panel.plot(time[positive], one.amplitude[positive], ".", color=BLACK, ms=2.0, label="observed")
            panel.set_yscale("log")
            panel.set_ylim(bottom=floor)
            plain_log(panel.yaxis)
            panel.set_title(_label(one.test, one.record), fontsize=7.5)
            panel.set_xlabel("Time from the first cycle [s]")
        for panel in axes[:: min(2, len(group))]:
            panel.set_ylabel(amplitude_label(unit))
        below(figure, axes, columns=4)
    return FigureWithCaption(
        figure,
        name,
        "Prior predictive check: what the priors alone expect of each record from its first amplitude on, with what "
        "was observed.",
        f"Amplitudes of {len(group)} record(s) over time inside wide bands of the prior predictive, logarithmic scale.",
    )


def _moved(tests: Sequence[str], criticism: Criticism, name: str) -> FigureWithCaption:
    """Standard deviations and sensitivities, a line for every parameter."""
    moved = [one for one in criticism.moved if one.test in tests or not one.test]
    lines = [(one.test, one.parameter) for one in moved]
    ratios = {(one.test, one.parameter): one.ratio for one in moved}
    scaled = {(one.test, one.parameter): one for one in criticism.scaling if one.test in tests}
    lines += [one for one in scaled if one not in ratios]
    with house_style():
        figure = new_figure(26.0 + 5.0 * len(lines))
        left, right = figure.subplots(1, 2, sharey=True)
        for edge in (BARELY_MOVED, NOT_MOVED):
            left.axvline(edge, color=GREY, lw=0.8, ls=(0, (4, 2)))
        right.axvline(SENSITIVE, color=GREY, lw=0.8, ls=(0, (4, 2)))
        for i, key in enumerate(lines):
            if np.isfinite(ratios.get(key, np.nan)):
                left.hlines(i, 1e-4, ratios[key], color=LIGHT, lw=3.0)
                left.plot(ratios[key], i, "o", color=BLUE)
            if key in scaled:
                one = scaled[key]
                shown = (
                    (one.prior, "s", VERMILLION, "the card's priors"),
                    (one.still_air, "^", GREEN, "still air"),
                    (one.likelihood, "o", BLUE, "records in wind"),
                )
                for value, marker, colour, label in shown:
                    if np.isfinite(value):
                        right.plot(max(value, 1e-4), i, marker, color=colour, label=label)
        for axes, title in ((left, "(a) Posterior sd over prior sd"), (right, "(b) Sensitivity to ...")):
            axes.set_xscale("log")
            axes.set_title(title)
        lowest = min([one for one in ratios.values() if np.isfinite(one)], default=0.1)
        left.set_xlim(0.5 * lowest, 1.6)
        right.margins(x=0.08)
        plain_log(left.xaxis)
        plain_log(right.xaxis)
        left.set_yticks(range(len(lines)), [_line(*key) for key in lines])
        left.set_ylim(len(lines) - 0.4, -0.6)
        _legend(figure, right)
    return FigureWithCaption(
        figure,
        name,
        "What moved the posterior. (a) Standard deviation after over before, in the coordinate that is sampled: beyond "
        "0.5 the data barely moved a parameter, beyond 0.8 they did not. (b) How far the posterior follows a factor "
        "raised to a power (cumulative Jensen-Shannon distance a doubling): beyond 0.05 it matters.",
        f"Two panels with marks for each of {len(lines)} parameters.",
    )


def _line(test: str, parameter: str) -> str:
    return f"{shorten(test, 18) if test else 'campaign'}  {_SIGNS.get(parameter, parameter)}"


def _influence_pages(criticism: Criticism) -> list[FigureWithCaption]:
    known = list(dict.fromkeys((one.test, one.record) for one in criticism.influence))
    return [_influence(page, criticism, _numbered("influence", i)) for i, page in enumerate(pages(known, _LINES))]


def _influence(known: Sequence[tuple[str, str]], criticism: Criticism, name: str) -> FigureWithCaption:
    rows = {(one.test, one.record, one.parameter): one for one in criticism.influence}
    with house_style():
        figure = new_figure(26.0 + 9.0 * len(known))
        axes = figure.subplots()
        axes.axvspan(-1.0, 1.0, color=LIGHT, alpha=0.45, lw=0)
        axes.axvline(0.0, color=GREY, lw=0.6)
        parameters = (("a_star", "o", BLUE, "$a^*$", -0.14), ("relaxation_rate", "s", VERMILLION, r"$\lambda$", 0.14))
        for i, (test, record) in enumerate(known):
            for parameter, marker, colour, sign, aside in parameters:
                one = rows[test, record, parameter]
                label = sign if one.trusted else f"{sign}, not to be trusted (k-hat > {TRUSTED_KHAT})"
                axes.plot(
                    one.shift, i + aside, marker, color=colour, mfc=colour if one.trusted else "white", label=label
                )
                axes.hlines(i + aside, 0.0, one.shift, color=colour, lw=0.9)
        axes.set_yticks(range(len(known)), [_label(*key) for key in known])
        axes.set_ylim(len(known) - 0.4, -0.6)
        reach = max(1.5, 1.15 * max(abs(one.shift) for one in rows.values()))
        axes.set_xlim(-reach, reach)
        axes.set_xlabel("Shift of the posterior when the record is left out [posterior sd]")
        _legend(figure, axes, columns=2)
    return FigureWithCaption(
        figure,
        name,
        "Influence of each record: how far the posterior of the stable amplitude and of the relaxation rate moves when "
        "the record is left out, by Pareto-smoothed reweighting. Hollow: the record dominates, only a refit tells.",
        f"A shift of two parameters for each of {len(known)} record(s).",
    )


def _legend(figure: "Figure", axes: "Axes", *, columns: int = 3) -> None:
    below(figure, [axes], columns=columns)
