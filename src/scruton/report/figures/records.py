"""Records with their envelope and the fitted bands, as Fig. 2 of the paper."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Record, Test
from scruton.report.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    LIGHT,
    ORANGE,
    VERMILLION,
    FigureWithCaption,
    amplitude_label,
    below,
    decimate,
    extremes,
    house_style,
    pages,
    panels,
    shorten,
    thin,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from scruton.infer.results import Fit

PANELS = 6  # records on one page
_BINS = 300  # stretches that a long response is decimated to
_DOTS = 150  # cycles drawn one by one; more become a line
_POINTS = 120  # of a band

KINDS = {"growth": "growth", "decay": "decay", "steady": "steady", "free-decay": "free decay"}


def record_figures(fit: "Fit") -> list[FigureWithCaption]:
    """One panel a record in wind, on as many pages as it takes; the records of a test stand together.

    Parameters
    ----------
    fit : Fit

    Returns
    -------
    list of FigureWithCaption
        Empty for a campaign without records in wind.
    """
    items = [(test, record) for test in fit.campaign.tests for record in test.records]
    found = []
    for number, page in enumerate(pages(items, PANELS), 1):
        found.append(_page(fit, page, "records" if number == 1 else f"records_{number}"))
    return found


def _page(fit: "Fit", items: Sequence[tuple[Test, Record]], name: str) -> FigureWithCaption:
    unit = fit.campaign.section.amplitude_unit
    with house_style():
        figure, axes = panels(len(items), height_mm=44.0)
        for one, (test, record) in zip(axes, items, strict=True):
            _panel(one, fit, test, record)
        columns = min(2, len(items))
        for one in axes[::columns]:
            one.set_ylabel("Response y/D [-]" if unit == "A/D" else "Rotation [rad]")
        for one in axes[-columns:]:
            one.set_xlabel("Time from the record's start [s]")
        below(figure, axes)
    tests = list(dict.fromkeys(test.name for test, _ in items))
    return FigureWithCaption(
        figure,
        name,
        "Records with the amplitude of every cycle, the 90 % credible band of the mean amplitude that the fitted law "
        "gives from the first cycle on, and the 90 % predictive band, which holds turbulence and sensor noise as well. "
        "Dashed: the stable amplitude of the posterior, with its 90 % interval.",
        f"Time histories of {len(items)} record(s) of {', '.join(tests)}: the response with its amplitude growing or "
        f"decaying towards the stable amplitude ({amplitude_label(unit)}), inside the predictive band.",
    )


def _panel(axes: "Axes", fit: "Fit", test: Test, record: Record) -> None:
    begin = float(record.time[0])
    cycles = fit.cycles[record.name]
    if not record.is_envelope:
        if len(cycles.time) > _BINS and len(record.time) > 2 * _BINS:
            axes.fill_between(
                *extremes(record.time - begin, record.response, _BINS), color=LIGHT, alpha=0.7, lw=0, label="response",
                zorder=1,
            )  # fmt: skip
        else:
            time, response = decimate(record.time - begin, record.response, _BINS)
            axes.plot(time, response, color=LIGHT, lw=0.4, label="response", zorder=1)
    band = predicted(fit.tree, record.name)
    if band is not None:
        pick = thin(len(band[0]), _POINTS)
        time, mean, predictive = band[0][pick] - begin, band[1][:, pick], band[2][:, pick]
        axes.fill_between(time, *predictive, color=ORANGE, alpha=0.45, lw=0, label="predictive band, 90 %", zorder=2)
        axes.fill_between(time, *mean, color=BLUE, alpha=0.75, lw=0, label="mean amplitude, 90 %", zorder=3)
    label = "amplitude of a cycle"
    if len(cycles.time) > _DOTS:
        axes.plot(*decimate(cycles.time - begin, cycles.amplitude, _BINS), color=BLACK, lw=0.4, label=label, zorder=4)
    else:
        axes.plot(cycles.time - begin, cycles.amplitude, ".", color=BLACK, ms=1.5, label=label, zorder=4)
    stable = fit.tree["posterior"]["a_star"].sel(test=test.name).to_numpy()
    low, median, high = np.quantile(stable, [0.05, 0.5, 0.95])
    axes.axhspan(low, high, color=GREEN, alpha=0.3, lw=0, zorder=1.5)
    axes.axhline(median, color=GREEN, lw=1.0, ls=(0, (5, 2)), label="stable amplitude, posterior", zorder=5)
    if test.stable_amplitude is not None:
        axes.axhline(
            test.stable_amplitude.mean, color=VERMILLION, lw=1.0, ls=(0, (1, 1.5)),
            label="stable amplitude, measured", zorder=5,
        )  # fmt: skip
    if record.is_envelope:
        axes.set_ylim(bottom=0.0)
    axes.set_xlim(0.0, float(record.time[-1]) - begin)
    axes.set_title(f"{shorten(test.name, 18)}, {KINDS[record.kind.value]}: {shorten(record.name, 20)}", fontsize=7.5)


def predicted(tree: "xr.DataTree", record: str) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Times of a record's cycles with the 90 % bands of mean amplitude and of replicated data; None without a fit.

    Returns
    -------
    time, mean, predictive : (n,), (2, n), (2, n) arrays
    """
    if "posterior_predictive" not in tree:
        return None
    constant = tree["constant_data"]
    mine = constant["record"].to_numpy().astype(str) == record
    if not mine.any():
        return None
    group = tree["posterior_predictive"]

    def interval(name: str) -> FloatArray:
        draws = group[name].to_numpy()[..., mine]
        return np.asarray(np.quantile(draws.reshape(-1, draws.shape[-1]), [0.05, 0.95], axis=0))

    return constant["time"].to_numpy()[mine], interval("mean_amplitude"), interval("amplitude")
