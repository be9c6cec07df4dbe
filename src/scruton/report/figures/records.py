"""Records with their envelope and the fitted bands, as Fig. 2 of the paper."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Record, Test
from scruton.report.figures import style
from scruton.report.figures.registry import FigureWithCaption, figure
from scruton.report.thresholds import PANELS_A_PAGE

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from scruton.infer.results import Fit

_BINS = 300  # stretches that a long response is decimated to
_DOTS = 150  # cycles drawn one by one; more become a line
_POINTS = 120  # of a band


@figure(
    "records",
    name="records",
    what="The figures of the records",
    caption="Records with the amplitude of every cycle, the 90 % credible band of the mean amplitude that the fitted "
    "law gives from the first cycle on, and the 90 % predictive band, which holds turbulence and sensor noise as well. "
    "Dashed: the stable amplitude of the posterior, with its 90 % interval.",
)
def record_figures(fit: "Fit") -> Iterable[FigureWithCaption]:
    """One panel a record in wind, on as many pages as it takes; the records of a test stand together."""
    unit = fit.campaign.section.amplitude_unit
    in_wind = [(test, record) for test in fit.campaign.tests for record in test.records]
    for page in style.pages(in_wind, PANELS_A_PAGE):
        drawing, panels = style.panels(len(page), height_mm=44.0)
        for axes, (test, record) in zip(panels, page, strict=True):
            _panel(axes, fit, test, record)
        response = "Response y/D [-]" if unit == "A/D" else "Rotation [rad]"
        style.outer_labels(panels, "Time from the record's start [s]", response)
        style.below(drawing, panels)
        tests = list(dict.fromkeys(test.name for test, _ in page))
        yield FigureWithCaption(
            drawing,
            alt=f"Time histories of {len(page)} record(s) of {', '.join(tests)}: the response with its amplitude "
            f"growing or decaying towards the stable amplitude ({style.amplitude_label(unit)}), inside the predictive "
            "band.",
        )


def _panel(axes: "Axes", fit: "Fit", test: Test, record: Record) -> None:
    begin = float(record.time[0])
    cycles = fit.cycles[record.name]
    pen: dict[str, Any]
    if not record.is_envelope:
        pen = {"color": style.LIGHT, "label": "response", "zorder": 1}
        if len(cycles.time) > _BINS and len(record.time) > 2 * _BINS:
            extremes = style.extremes(record.time - begin, record.response, _BINS)
            axes.fill_between(*extremes, alpha=0.7, lw=0, **pen)
        else:
            axes.plot(*style.decimate(record.time - begin, record.response, _BINS), lw=0.4, **pen)
    band = predicted(fit.tree, record.name)
    if band is not None:
        pick = style.thin(len(band[0]), _POINTS)
        time, mean, predictive = band[0][pick] - begin, band[1][:, pick], band[2][:, pick]
        label = "predictive band, 90 %"
        axes.fill_between(time, *predictive, color=style.ORANGE, alpha=0.45, lw=0, label=label, zorder=2)
        axes.fill_between(time, *mean, color=style.BLUE, alpha=0.75, lw=0, label="mean amplitude, 90 %", zorder=3)
    pen = {"color": style.BLACK, "label": "amplitude of a cycle", "zorder": 4}
    if len(cycles.time) > _DOTS:
        axes.plot(*style.decimate(cycles.time - begin, cycles.amplitude, _BINS), lw=0.4, **pen)
    else:
        axes.plot(cycles.time - begin, cycles.amplitude, ".", ms=1.5, **pen)
    stable = fit.tree["posterior"]["a_star"].sel(test=test.name).to_numpy()
    low, median, high = np.quantile(stable, style.Q90)
    axes.axhspan(low, high, color=style.GREEN, alpha=0.3, lw=0, zorder=1.5)
    axes.axhline(median, color=style.GREEN, lw=1.0, ls=(0, (5, 2)), label="stable amplitude, posterior", zorder=5)
    if test.stable_amplitude is not None:
        axes.axhline(
            test.stable_amplitude.mean, color=style.VERMILLION, lw=1.0, ls=(0, (1, 1.5)),
            label="stable amplitude, measured", zorder=5,
        )  # fmt: skip
    if record.is_envelope:
        axes.set_ylim(bottom=0.0)
    axes.set_xlim(0.0, float(record.time[-1]) - begin)
    kind, name = record.kind.value.replace("-", " "), style.shorten(record.name, 20)
    axes.set_title(f"{style.shorten(test.name, 18)}, {kind}: {name}", fontsize=7.5)


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
