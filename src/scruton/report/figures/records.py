"""Records with their envelope and the fitted bands (Fig. 2 of the paper), ring-downs, and trial functions (Fig. 13)."""

from collections.abc import Iterable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.arrays import FloatArray, thin
from scruton.campaign.schema import Record, Rig, Test
from scruton.envelope import TRIAL_FUNCTIONS, FrontEnd, front_end
from scruton.errors import InputError
from scruton.griffin.posterior import draws_of, mass_damping_draws, peak_names, printed_draws, unit_of
from scruton.infer.results import Fit
from scruton.report.conventions import DAMPING, damping, damping_label, damping_words, shown_in
from scruton.report.figures import FigureWithCaption, figure, griffin_axes, style
from scruton.report.thresholds import PANELS_A_PAGE

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


_BINS = 300  # stretches that a long response is decimated to
_DOTS = 150  # cycles drawn one by one; more become a line
_POINTS = 120  # of a band
_RIGS = 3  # on one page of ring-downs
_PLUCKS = 4  # that the legend names
_PLUCK_BINS = 200
FITTED = "second-order exponential"  # the form of the trial function that the fit itself used


@figure("records", name="records", what="The figures of the records")
def record_figures(fit: Fit) -> Iterable[FigureWithCaption]:
    """One panel a record in wind, on as many pages as it takes; the records of a test stand together."""
    unit = fit.campaign.section.amplitude_unit
    in_wind = [(test, record) for test in fit.campaign.tests for record in test.records]
    for page in style.pages(in_wind, PANELS_A_PAGE):
        drawing, panels = style.panels(len(page), height_mm=44.0)
        for axes, (test, record) in zip(panels, page, strict=True):
            _panel(axes, fit, test, record)
        response = "Response y/D [-]" if unit == "A/D" else style.amplitude_label(unit, "Rotation")
        style.outer_labels(panels, "Time from the record's start [s]", response)
        style.below(drawing, panels)
        tests = list(dict.fromkeys(test.name for test, _ in page))
        yield FigureWithCaption(
            drawing,
            caption="Records with the amplitude of every cycle, the 90 % credible band of the mean amplitude that the "
            "fitted law gives from the first cycle on, and the 90 % predictive band, which holds turbulence, gusts "
            "and sensor noise as well. Dashed: the stable amplitude of the posterior, with its 90 % interval.",
            alt=f"Time histories of {len(page)} record(s) of {', '.join(tests)}: the response with its amplitude "
            f"growing or decaying towards the stable amplitude ({style.amplitude_label(unit)}), inside the predictive "
            "band.",
        )


def _panel(axes: "Axes", fit: Fit, test: Test, record: Record) -> None:
    begin, scale = float(record.time[0]), shown_in(fit.campaign.section.amplitude_unit)[0]
    cycles = fit.cycles[record.name]
    pen: dict[str, Any] = {"color": style.LIGHT, "label": "response", "zorder": 1}
    long = len(cycles.time) > _BINS and len(record.time) > 2 * _BINS
    if long and not record.is_envelope:
        extremes = style.extremes(record.time - begin, scale * record.response, _BINS)
        axes.fill_between(*extremes, alpha=0.7, lw=0, **pen)
    elif not record.is_envelope:
        axes.plot(*style.decimate(record.time - begin, scale * record.response, _BINS), lw=0.4, **pen)
    band = predicted(fit.tree, record.name)
    if band is not None:
        pick = thin(len(band[0]), _POINTS)
        time, mean, predictive = band[0][pick] - begin, scale * band[1][:, pick], scale * band[2][:, pick]
        label = "predictive band, 90 %"
        axes.fill_between(time, *predictive, color=style.ORANGE, alpha=0.45, lw=0, label=label, zorder=2)
        axes.fill_between(time, *mean, color=style.BLUE, alpha=0.75, lw=0, label="mean amplitude, 90 %", zorder=3)
    pen = {"color": style.BLACK, "label": "amplitude of a cycle", "zorder": 4}
    if len(cycles.time) > _DOTS:
        axes.plot(*style.decimate(cycles.time - begin, scale * cycles.amplitude, _BINS), lw=0.4, **pen)
    else:
        axes.plot(cycles.time - begin, scale * cycles.amplitude, ".", ms=1.5, **pen)
    stable = scale * printed_draws(fit.tree, test.name)["a_star"]
    low, median, high = np.quantile(stable, style.Q90)
    axes.axhspan(low, high, color=style.GREEN, alpha=0.3, lw=0, zorder=1.5)
    axes.axhline(median, color=style.GREEN, lw=1.0, ls=(0, (5, 2)), label="stable amplitude, posterior", zorder=5)
    if test.stable_amplitude is not None:
        axes.axhline(
            scale * test.stable_amplitude.mean, color=style.VERMILLION, lw=1.0, ls=(0, (1, 1.5)),
            label="stable amplitude, measured", zorder=5,
        )  # fmt: skip
    if record.is_envelope:
        axes.set_ylim(bottom=0.0)
    axes.set_xlim(0.0, float(record.time[-1]) - begin)
    kind, name = record.kind.value.replace("-", " "), style.shorten(record.name, 20)
    axes.set_title(f"{style.shorten(test.name, 18)}, {kind}: {name}", fontsize=7.5)


def predicted(tree: "xr.DataTree", record: str) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Times (n,) of a record, 90 % bands (2, n) of mean amplitude and of replicated data; None without a fit."""
    if "posterior_predictive" not in tree:
        return None
    constant = tree["constant_data"]
    rows = constant["record"].to_numpy().astype(str) == record
    if not rows.any():
        return None
    draws = (tree["posterior_predictive"][name].to_numpy()[..., rows] for name in ("mean_amplitude", "amplitude"))
    mean, predictive = (np.quantile(values.reshape(-1, rows.sum()), [0.05, 0.95], axis=0) for values in draws)
    return constant["time"].to_numpy()[rows], mean, predictive


@figure("structural", name="ring_downs", what="The figures of the ring-downs", in_still_air=True)
def ring_down_figures(fit: Fit) -> Iterable[FigureWithCaption]:
    """One row a rig with free decays: ln amplitude of every pluck against time, and damping ratio against amplitude."""
    rigs = [rig for rig in fit.campaign.rigs if rig.name in fit.ringdowns]
    for page in style.pages(rigs, _RIGS):
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
        parts = [f"rig {name}: {damping(ring.damping_ratio)} at {ring.frequency:.3f} Hz" for name, ring in rings]
        words = damping_words()
        yield FigureWithCaption(
            drawing,
            caption="Ring-downs in still air. Left: the logarithm of the amplitude of every cycle, one colour a "
            f"pluck; a straight line is a constant {words}. Right: {words} against amplitude, by octave "
            "(mean and spread of the plucks) and as a smooth curve with its 90 % band; orange: 90 % interval of the "
            "posterior's constant.",
            alt=f"Ring-downs and their damping. {'; '.join(parts)}.",
        )


def _decays(axes: "Axes", fit: Fit, rig: Rig) -> None:
    scale = shown_in(fit.campaign.section.amplitude_unit)[0]
    lowest, highest, named = np.inf, -np.inf, len(rig.records) <= _PLUCKS
    for i, record in enumerate(rig.records):
        cycles = fit.cycles[record.name]
        good = cycles.amplitude > 2.0 * cycles.standard_error
        if not good.any():
            continue
        time, log = cycles.time[good] - cycles.time[good][0], np.log(scale * cycles.amplitude[good])
        label = style.shorten(record.name, 26) if named else ""
        axes.plot(*style.decimate(time, log, _PLUCK_BINS), **style.line_style(i).pen, lw=1.0, label=label)
        lowest, highest = min(lowest, float(log.min())), max(highest, float(log.max()))
    if np.isfinite(lowest):
        axes.set_ylim(max(lowest, highest - 7.0) - 0.2, highest + 0.3)
    axes.set_xlim(left=0.0)
    heaving = fit.campaign.section.amplitude_unit == "A/D"
    axes.set_ylabel("ln(A/D) [-]" if heaving else "ln(amplitude / 1°) [-]")
    plucks = f", {len(rig.records)} plucks" if len(rig.records) > 1 else ""
    axes.set_title(f"rig {style.shorten(rig.name, 24)}{plucks}")
    if named:
        axes.legend(loc="upper right")


def _damping(axes: "Axes", fit: Fit, rig: Rig) -> None:
    ring, (per, _), scale = fit.ringdowns[rig.name], shown_in(DAMPING), shown_in(fit.campaign.section.amplitude_unit)[0]
    draws = per * fit.tree["rig_posterior"]["damping_ratio"].sel(rig=rig.name).to_numpy()
    low, middle, high = np.quantile(draws, style.Q90)
    axes.axhspan(low, high, color=style.ORANGE, alpha=0.5, lw=0, label="posterior, 90 %", zorder=1)
    axes.axhline(middle, color=style.ORANGE, lw=1.0, zorder=1)
    curve, spread = per * ring.curve_damping_ratio, per * style.Z90 * ring.curve_sd
    x, label = scale * ring.curve_amplitude, "smooth, 90 %"
    axes.fill_between(x, curve - spread, curve + spread, color=style.SKY, alpha=0.4, lw=0, label=label, zorder=2)
    axes.plot(x, curve, color=style.BLUE, lw=1.2, label="smooth", zorder=3)
    if ring.bands:
        lower, upper, xi, sd = np.array([(b.lower, b.upper, b.damping_ratio, b.sd) for b in ring.bands]).T
        lower, upper = scale * lower, scale * upper
        centre = np.sqrt(lower * upper)
        axes.errorbar(
            centre, per * xi, per * style.Z90 * sd, [centre - lower, upper - centre], fmt="o", ms=3.0,
            color=style.BLACK, elinewidth=0.8, capsize=0, label="by octave, 90 %", zorder=4,
        )  # fmt: skip
    if rig.damping_ratio is not None:
        axes.axhline(per * rig.damping_ratio.mean, color=style.GREY, lw=0.9, ls=":", label="as stated", zorder=1)
    axes.set_xscale("log")
    style.plain_log(axes.xaxis)
    shown = [per * b.damping_ratio for b in ring.bands] + [float(low), float(high)]
    reach = 0.5 * (max(shown) - min(shown)) + 0.05 * max(map(abs, shown))
    bottom = min(shown) - reach
    axes.set_ylim(max(bottom, 0.0) if min(shown) > 0.0 else bottom, max(shown) + reach)
    axes.set(ylabel=damping_label("Damping ratio"), title=rf"$f_0$ = {ring.frequency:.3f} Hz")


@figure("records", name="trial_functions", what="The comparison of trial functions", when=lambda fit: fit.front_ends)
def trial_comparison(fit: Fit) -> FigureWithCaption:
    """One panel a trial function: the constructed Griffin curve of every record, and the measured points."""
    fronts = {form: curves for form in TRIAL_FUNCTIONS if (curves := _fronts(fit, form))}
    styles = griffin_axes.line_styles(fit.tree)
    limits = griffin_axes.sc_range(fit.tree)
    largest = max(value for point in griffin_axes.test_points(fit) for value in point.known)
    drawing, panels = style.panels(len(fronts), columns=3, height_mm=66.0, sharex=True, sharey=True)
    for letter, axes, (form, curves) in zip("abcdef", panels, fronts.items(), strict=False):
        for name, front in curves:
            griffin_axes.plot_curve(
                axes, front, unit_of(fit.tree), style.shorten(name), **styles[name].pen, lw=1.1, zorder=3
            )
        griffin_axes.points(axes, fit, posteriors=False)
        griffin_axes.frame(
            axes, griffin_axes.sc_shown(limits), 1.45 * shown_in(unit_of(fit.tree))[0] * largest, note=None
        )
        axes.set_title(f"({letter}) {form}", fontsize=8.0)
        axes.set_xlabel(griffin_axes.SC_LABEL)
    panels[0].set_ylabel(style.amplitude_label(unit_of(fit.tree), "Stable amplitude"))
    style.below(drawing, panels, columns=4)
    return FigureWithCaption(
        drawing,
        caption="Griffin curves that the deterministic procedure constructs from each transient record with other "
        "trial functions in step (5): polynomials and splines follow the noise of the envelope, and its derivative "
        "shows it. Hatched: negative Scruton numbers, without physical meaning.",
        alt=f"Constructed Griffin curves of every record in {len(fronts)} panels: {', '.join(fronts)}.",
    )


def _fronts(fit: Fit, form: str) -> list[tuple[str, FrontEnd]]:
    """The paper's procedure with a trial function on every transient record of the peak tests, with their test."""
    curves, constant = [], fit.tree["constant_data"]
    for name, record, front in griffin_axes.front_ends(fit, peak_names(fit.tree)):
        if form == FITTED:
            curves.append((name, front))
            continue
        with suppress(InputError, ValueError):  # too short for so many constants
            front = front_end(
                record,
                frequency=float(constant["wind_frequency"].sel(test=name)),
                still_air_frequency=float(constant["frequency"].sel(test=name)),
                damping_ratio=float(np.median(draws_of(fit.tree, "damping_ratio", name))),
                mass_damping_factor=float(np.median(mass_damping_draws(fit.tree, name))),
                trial=form,
            )
            curves.append((name, front))
    return curves
