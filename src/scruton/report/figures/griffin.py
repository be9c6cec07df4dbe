"""Griffin plots: amplitude, or its reciprocal, against the Scruton number (the paper's Figs. 4, 10 and 12).

Laws are compared by them, as in Fig. 15; and amplitude is drawn through the lock-in range, as in Figs. 1 and 6a.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray
from scruton.griffin import predictive_draws, shared_curve, single_draws
from scruton.griffin.bands import GriffinBand, band_along, griffin_band, griffin_draws, predicting_index
from scruton.griffin.lock_in import LockInBand, has_speeds, lock_in_band
from scruton.griffin.posterior import mass_damping_draws, peak_names, printed_draws, test_names, unit_of
from scruton.griffin.thresholds import X_TRUSTED
from scruton.infer.results import Fit
from scruton.report.conventions import (
    DAMPING,
    amplitude,
    damping_label,
    damping_words,
    scruton,
    scruton_note,
    shown_in,
)
from scruton.report.figures import FigureWithCaption, figure, griffin_axes, style
from scruton.report.figures.damping import tests_with_transients
from scruton.report.summaries import law_of_tests, law_of_tests_leads
from scruton.report.thresholds import MOST_RIG_BANDS, PANELS_A_PAGE, SCRUTON_NUMBERS_APART, SPEEDS_APART
from scruton.sizing.codes import comparisons

if TYPE_CHECKING:
    from matplotlib.axes import Axes


GRID = 161
STABLE = "Stable amplitude"
LAWS = ((-1.0, "(a) Eq. (11), n = \N{MINUS SIGN}1"), (2.0, "(b) Ehsan and Scanlan, Eq. (21), n = 2"))
_RECIPROCAL = {"A/D": "Reciprocal amplitude D/A [-]", "rad": "Reciprocal amplitude [1/°]"}


@figure("griffin-plot", name="griffin", what="The Griffin plot")
def griffin_plot(fit: Fit) -> FigureWithCaption:
    """Stable amplitude against Scruton number: every peak test's band, the predictive band, the measured points."""
    return _plot(fit, reciprocal=False)


@figure("reciprocal", name="griffin_reciprocal", what="The plot of 1/A")
def reciprocal_plot(fit: Fit) -> FigureWithCaption:
    """The same as D/A (or 1/rad), in which the paper's law is a straight line (Fig. 10)."""
    return _plot(fit, reciprocal=True)


def _plot(fit: Fit, *, reciprocal: bool) -> FigureWithCaption:
    tree, tests, unit, limits = fit.tree, peak_names(fit.tree), unit_of(fit.tree), griffin_axes.sc_range(fit.tree)
    grid = np.linspace(*limits, GRID)
    predictive = band_along(grid, partial(predictive_draws, tree, seed=fit.seed), unit, "predictive")
    alone = [griffin_band(tree, grid, name) for name in tests]
    if reciprocal:
        predictive, alone = predictive.reciprocal(), [curve.reciprocal() for curve in alone]
    drawing, axes = style.alone(88.0 if reciprocal else 98.0)
    griffin_axes.shade(axes, predictive)
    griffin_axes.draw_bands(axes, fit, alone)
    griffin_axes.deterministic(axes, fit, tests, reciprocal=reciprocal)
    griffin_axes.points(axes, fit, reciprocal=reciprocal)
    ceiling = _ceiling(fit, _highest(griffin_axes.as_shown(predictive)), reciprocal=reciprocal)
    codes = "" if reciprocal else _codes(axes, fit, limits[1], ceiling)
    griffin_axes.frame(axes, griffin_axes.sc_shown(limits), ceiling, note=0.6 if reciprocal else 0.3)
    axes.set(
        xlabel=griffin_axes.SC_LABEL, ylabel=_RECIPROCAL[unit] if reciprocal else style.amplitude_label(unit, STABLE)
    )
    style.below(drawing, [axes])
    what = "Reciprocal stable amplitude" if reciprocal else STABLE
    figures = "a straight line under the paper's law (n = -1)" if reciprocal else "the Griffin plot"
    discrepancy = float(np.median(shared_curve(tree, seed=fit.seed).discrepancy))
    return FigureWithCaption(
        drawing,
        caption=f"{what} against the Scruton number, {figures}. Coloured: what each peak test's records alone predict "
        f"by {law_of_tests(fit.summary)}, median with 50 and 90 % credible bands, thin beyond an extrapolation index "
        "of 0.3. Grey: 90 % predictive band "
        "of all peak tests together, laws weighed and, away from the tests, led by the damping that the transients "
        f"show, for a setting that lies {discrepancy:.0%} off their curve. Dotted: "
        "the deterministic procedure of Eqs. (2) to (8). "
        + ("Filled points are measured, open" if _measured(fit) else "Open")
        + " ones are the posterior of each test's own stable amplitude with its 90 % interval. Negative Scruton "
        "numbers have no physical meaning."
        + codes
        + (f" {note}" if (note := scruton_note(heaving=unit == "A/D")) else ""),
        alt=_alt(fit, tests, what),
    )


def _codes(axes: "Axes", fit: Fit, upper: float, ceiling: float) -> str:
    """Draw what codes say the amplitude is, thin and grey, for comparison; what they are, for the caption."""
    section, rigs = fit.campaign.section, {rig.name: rig.frequency.mean for rig in fit.campaign.rigs}
    tests = [fit.campaign.test(name) for name in peak_names(fit.tree)]
    strouhal = float(np.median([rigs[test.rig] * section.depth / test.wind_speed.mean for test in tests]))
    lines = comparisons(section.motion, section.width, section.depth, strouhal)
    sc, (times, scale) = np.linspace(upper / GRID, upper, GRID), griffin_axes.factors(unit_of(fit.tree))
    for line, dashes in zip(lines, ((6, 1.5), (3, 1.5), (1, 1), (8, 2, 1, 2), (8, 2, 1, 2, 1, 2)), strict=False):
        amplitude = scale * line.amplitude(sc)
        shown = np.where(amplitude <= ceiling, amplitude, np.nan)
        axes.plot(times * sc, shown, color=style.GREY, lw=0.8, dashes=dashes, label=line.name, zorder=1.5)
    if not lines:
        return ""
    said = (line.clause + (f" ({line.confirm}: confirm)" if line.confirm else "") for line in lines)
    return f" Thin dashes, amplitudes by codes for comparison, none a limit: {'; '.join(said)}."


@figure("griffin-plot", name="griffin_by_test", what="The Griffin plots of single tests")
def griffin_by_test(fit: Fit) -> Iterable[FigureWithCaption]:
    """The Griffin plot that each peak test gives by itself, one panel a test, with the points of all the others."""
    tree, unit, limits = fit.tree, unit_of(fit.tree), griffin_axes.sc_range(fit.tree)
    grid = np.linspace(*limits, GRID)
    for page in style.pages(peak_names(tree), PANELS_A_PAGE):
        drawing, panels = style.panels(len(page), height_mm=58.0, sharey=True)
        for axes, name in zip(panels, page, strict=True):
            draws_at = partial(single_draws, tree, test=name, seed=fit.seed)
            predictive = band_along(grid, draws_at, unit, "predictive")
            griffin_axes.shade(axes, predictive)
            griffin_axes.draw_bands(axes, fit, [griffin_band(tree, grid, name)], "median, 50 and 90 %")
            griffin_axes.deterministic(axes, fit, [name])
            griffin_axes.points(axes, fit)
            griffin_axes.frame(
                axes,
                griffin_axes.sc_shown(limits),
                _ceiling(fit, _highest(griffin_axes.as_shown(predictive))),
                note=0.3 if axes is panels[0] else None,
            )
            axes.set_title(f"from {style.shorten(name, 30)} alone")
        style.outer_labels(panels, griffin_axes.SC_LABEL, style.amplitude_label(unit, STABLE))
        style.below(drawing, panels)
        yield FigureWithCaption(
            drawing,
            caption="The Griffin plot from one test at a time: 50 and 90 % credible bands of that test's curve by "
            f"{law_of_tests(fit.summary)}, the 90 % predictive band with the discrepancy between settings, the "
            "deterministic curve of its records (dotted), and the points of every test. "
            + (
                "A test that predicts the others' points within the grey band bears the self-similarity out."
                if law_of_tests_leads(fit.summary)
                else "That law does not lead, and under others no test was sampled by itself: whether a test predicts "
                "the others' points here says nothing of them."
            ),
            alt=_alt(fit, page, "Stable amplitude from one test at a time"),
        )


@figure("reciprocal", name="reciprocal_against_damping", what="The plot of 1/A against damping")
def reciprocal_against_damping(fit: Fit) -> FigureWithCaption:
    """Reciprocal amplitude against the structural damping ratio, as Fig. 12, for each test's own mass and air."""
    tree, tests, unit = fit.tree, peak_names(fit.tree), unit_of(fit.tree)
    factor = {name: mass_damping_draws(tree, name) for name in tests}
    ratio = np.linspace(*griffin_axes.sc_range(tree), GRID) / max(float(np.median(draws)) for draws in factor.values())
    shown, curves = shown_in(DAMPING)[0] * ratio, []

    def draws_at(name: str, some: FloatArray) -> FloatArray:
        return griffin_draws(tree, factor[name][:, None] * some, name)

    for name in tests:
        beyond = np.abs(predicting_index(tree, float(np.median(factor[name])) * ratio, name)) > X_TRUSTED
        found = band_along(ratio, partial(draws_at, name), unit, name, beyond)
        curve = griffin_axes.as_shown(found.reciprocal())
        curves.append(replace(curve, scruton_number=shown))  # whose axis is that of damping here
    drawing, axes = style.alone(80.0)
    griffin_axes.draw_shown(axes, fit, curves)
    ceiling = max(_ceiling(fit, _highest(curve), reciprocal=True) for curve in curves)
    griffin_axes.points(axes, fit, reciprocal=True, against_damping=True)
    griffin_axes.frame(axes, (shown[0], shown[-1]), ceiling, note=0.6)
    axes.set(xlabel=damping_label("Structural damping ratio"), ylabel=_RECIPROCAL[unit])
    style.below(drawing, [axes])
    return FigureWithCaption(
        drawing,
        caption=f"Reciprocal stable amplitude against the structural {damping_words()}, for the mass and the air of "
        f"each test, from its records alone by {law_of_tests(fit.summary)}: median with 50 and 90 % credible bands. "
        "A straight line is what the paper's law says; points that bend up from it at small amplitude point at dry "
        "friction in the suspension.",
        alt=_alt(fit, tests, "Reciprocal stable amplitude against damping ratio"),
    )


def _measured(fit: Fit) -> bool:
    """Whether a stable amplitude was measured."""
    return any(point.measured for point in griffin_axes.test_points(fit))


def _ceiling(fit: Fit, highest: float, *, reciprocal: bool = False) -> float:
    """Top of the axis: all points, and the largest median, up to some times the largest point; all as shown."""
    values = [value for point in griffin_axes.test_points(fit) for value in point.known if value > 0.0]
    unit = unit_of(fit.tree)
    if reciprocal:
        values, unit = [1.0 / value for value in values], f"1/{unit}"
    largest = shown_in(unit)[0] * max(values)
    return (1.15 if reciprocal else 1.3) * max(largest, min(highest, 2.5 * largest))


def _highest(shown: GriffinBand) -> float:
    """Largest median where Sc is not negative."""
    return float(shown.median[(shown.scruton_number >= 0.0) & np.isfinite(shown.median)].max(initial=0.0))


def _alt(fit: Fit, tests: Sequence[str], what: str) -> str:
    unit, shown = unit_of(fit.tree), [point for point in griffin_axes.test_points(fit) if point.name in tests][:8]
    values = [
        f"{point.name}: Sc {scruton(point.scruton_number, digits=3)}, amplitude {amplitude(point.median, unit)} "
        f"(90 % {amplitude(point.low, unit)} to {amplitude(point.high, unit)})"
        for point in shown
    ]
    return f"{what} against the Scruton number. " + "; ".join(values) + "."


@figure("griffin-plot", name="laws", what="The comparison of laws", when=tests_with_transients)
def law_comparison(fit: Fit) -> FigureWithCaption:
    """Griffin curves of every peak test under n = -1 and under n = 2, from one and the same (a*, lambda)."""
    tree, limits = fit.tree, griffin_axes.sc_range(fit.tree)
    grid = np.linspace(*limits, GRID)
    bands = {n: [griffin_band(tree, grid, name, law_n=n) for name in peak_names(tree)] for n, _ in LAWS}
    ceiling = _ceiling(fit, max(_highest(griffin_axes.as_shown(curve)) for curve in bands[-1.0]))
    drawing, panels = style.panels(2, height_mm=78.0, sharex=True, sharey=True)
    for axes, (n, title) in zip(panels, LAWS, strict=True):
        griffin_axes.draw_bands(axes, fit, bands[n])
        griffin_axes.without_law(axes, fit)
        griffin_axes.points(axes, fit, posteriors=False)
        griffin_axes.frame(axes, griffin_axes.sc_shown(limits), ceiling, note=0.3 if axes is panels[0] else None)
        axes.set_title(title)
    style.outer_labels(panels, griffin_axes.SC_LABEL, style.amplitude_label(unit_of(tree), STABLE))
    style.below(drawing, panels)
    return FigureWithCaption(
        drawing,
        caption="Griffin curves from the stable amplitude and the relaxation rate of one test at a time, as its "
        f"records alone give them under {law_of_tests(fit.summary)}, carried on (a) by the "
        "paper's law and (b) by Ehsan and Scanlan's, with 50 and 90 % credible bands; thin where the extrapolation "
        "index exceeds 0.3, beyond which laws part. Dashed: the damping that the transients show at an amplitude, "
        "without a law, with its 90 % band, as far as any transient reached. "
        + ("Points are measured." if _measured(fit) else "Points are posteriors of each test."),
        alt="Two panels with the points of all tests: (a) Griffin curves of each test by the paper's law, whose "
        "amplitude falls without end, (b) by Ehsan and Scanlan's, which fall to zero at a finite Scruton number.",
    )


def has_lock_in(fit: Fit) -> bool:
    """Whether there are sweeps, or one rig was tested at several speeds."""
    speeds: dict[str, list[float]] = {}
    for test in fit.campaign.tests:
        speeds.setdefault(test.rig, []).append(test.wind_speed.mean)
    return bool(fit.campaign.sweeps) or any(max(tested) > SPEEDS_APART * min(tested) for tested in speeds.values())


@figure("griffin-plot", name="lock_in", what="The plot against wind speed", when=has_lock_in)
def lock_in_plot(fit: Fit) -> FigureWithCaption:
    """Steady amplitudes of sweeps and tests by rig, with the bands of the smooth model where the fit has it."""
    wanted = {sweep.rig for sweep in fit.campaign.sweeps} | {test.rig for test in fit.campaign.tests}
    used = [rig.name for rig in fit.campaign.rigs if rig.name in wanted]
    styles = {name: style.line_style(i) for i, name in enumerate(used)}
    unit, smooth = fit.campaign.section.amplitude_unit, has_speeds(fit.tree)
    scale = shown_in(unit)[0]
    drawing = style.new_figure(140.0 if smooth else 95.0)
    panels = list(drawing.subplots(2 if smooth else 1, 1, sharex=True, squeeze=False).flat)
    top = _steady(panels[0], fit, styles)
    caption = (
        "Steady amplitude against reduced velocity, with the still-air frequency of each rig: sweeps where the "
        "campaign has them, and the stable amplitude of every test's posterior with its 90 % interval."
    )
    alt = f"Amplitude through the lock-in range for rig(s) {', '.join(used)}."
    if smooth:
        caption += (
            " Bands: stable amplitude and relaxation smooth in the reduced velocity, median with 50 and 90 % bands "
            "of a new test of the same rig (above) or of a new rig (below), with its discrepancy and, for a new rig, "
            "with the uncertain place of its lock-in. Thin: beyond the outermost test within lock-in, or an "
            "extrapolation index of 0.3. Amplitudes below a tenth of a rig's largest lie outside lock-in: they enter "
            "no band, and end it."
        )
        highest, peak = _smooth(panels, fit, styles)
        top = max(top, highest)
        i = int(np.nanargmax(np.where(np.isfinite(peak.median), peak.median, -1.0)))
        low, high = peak.intervals[0.90][:, i]
        alt += (
            f" At Sc = {scruton(peak.scruton_number, digits=3)} the median is largest at a reduced velocity of "
            f"{peak.velocity[i]:.3g}: {amplitude(peak.median[i], unit)} (90 % {amplitude(low, unit)} to "
            f"{amplitude(high, unit)})."
        )
    panels[0].set_ylim(0.0, 1.08 * scale * top)
    style.outer_labels(panels, r"Reduced velocity $U/(f_0 D)$ [-]", style.amplitude_label(unit), columns=1)
    style.below(drawing, panels)
    return FigureWithCaption(drawing, caption=caption, alt=alt)


def _steady(axes: "Axes", fit: Fit, styles: Mapping[str, style.LineStyle]) -> float:
    """Sweeps, posteriors of the tests and what was measured; the largest amplitude drawn."""
    campaign, tree, top, scale = fit.campaign, fit.tree, 0.0, shown_in(unit_of(fit.tree))[0]
    unit_speed = {rig.name: rig.frequency.mean * campaign.section.depth for rig in campaign.rigs}
    for sweep in campaign.sweeps:
        order, look = np.argsort(sweep.wind_speed, kind="stable"), styles[sweep.rig]
        axes.plot(
            sweep.wind_speed[order] / unit_speed[sweep.rig], scale * sweep.amplitude[order], **look.pen,
            lw=0.8, marker=look.marker, ms=3.5, label=style.shorten(f"rig {sweep.rig}, sweep"),
        )  # fmt: skip
        top = max(top, float(sweep.amplitude.max()))
    for rig, look in styles.items():
        tests = [test for test in campaign.tests if test.rig == rig and test.name in test_names(tree)]
        if not tests:
            continue
        x = [campaign.reduced_velocity(test) for test in tests]
        stable = [np.quantile(printed_draws(tree, test.name)["a_star"], style.Q90) for test in tests]
        low, middle, high = np.array(stable).T
        axes.errorbar(
            x, scale * middle, [scale * (middle - low), scale * (high - middle)], fmt=look.marker, ms=7.5, mfc="none",
            color=look.colour, elinewidth=0.9, capsize=2.5, zorder=4,
            label=f"rig {style.shorten(rig, 20)}, posterior, 90 %",
        )  # fmt: skip
        top = max(top, float(high.max()))
    stated = [(test, test.stable_amplitude.mean) for test in campaign.tests if test.stable_amplitude is not None]
    if stated:
        x, y = np.array([(campaign.reduced_velocity(test), mean) for test, mean in stated]).T
        axes.plot(x, scale * y, "x", color=style.BLACK, ms=5, mew=1.1, label="measured stable amplitude", zorder=5)
    return top


def _smooth(panels: "Sequence[Axes]", fit: Fit, styles: Mapping[str, style.LineStyle]) -> tuple[float, LockInBand]:
    """Bands of every rig at its own Sc, and of a new one at an untested Sc; top of the former, and the latter."""
    group = fit.tree["speeds"]
    scale = shown_in(unit_of(fit.tree))[0]
    rigs, numbers = (group[key].to_numpy() for key in ("point_rig", "point_scruton_number"))
    scruton_numbers = {str(name): float(np.median(numbers[rigs == name])) for name in group["rig"].to_numpy()}
    bands = {rig: lock_in_band(fit.tree, sc, rig=rig, seed=fit.seed) for rig, sc in scruton_numbers.items()}
    new = lock_in_band(fit.tree, _untested(list(scruton_numbers.values())), seed=fit.seed)

    def largest(values: FloatArray, shown: LockInBand) -> float:
        tested = (shown.velocity >= group.attrs["tested_low"]) & (shown.velocity <= group.attrs["tested_high"])
        return float(values[tested & np.isfinite(values)].max(initial=0.0))

    for rig in (name for name in styles if name in scruton_numbers):
        label = style.shorten(f"rig {rig}, Sc = {scruton(scruton_numbers[rig], digits=3)}, band")
        _draw(panels[0], bands[rig], scale, styles[rig], label, bands=len(scruton_numbers) <= MOST_RIG_BANDS)
    panels[0].set_title("Each rig at its own Scruton number")
    for rig, curve in bands.items():
        panels[1].plot(curve.velocity, scale * style.bounded(curve.median), **styles[rig].pen, lw=0.7, zorder=3)
    label = f"Sc = {scruton(new.scruton_number, digits=3)}"
    _draw(panels[1], new, scale, style.LineStyle(style.BLACK, "-", ""), f"{label}, median, 50 and 90 %")
    middle = max(float(b.median[np.isfinite(b.median)].max(initial=0.0)) for b in bands.values())
    top = min(max(middle, largest(new.intervals[0.90][1], new)), 2.0 * middle)
    panels[1].set(ylim=(0.0, 1.08 * scale * top), title=f"{label}, untested")
    return max(largest(bands[rig].intervals[0.50][1], bands[rig]) for rig in styles if rig in scruton_numbers), new


def _draw(
    axes: "Axes", band: LockInBand, scale: float, look: style.LineStyle, label: str, *, bands: bool = True
) -> None:
    """Median with 50 and 90 % bands, thin where extrapolated, of amplitudes times `scale`."""
    v, median = band.velocity, scale * style.bounded(band.median)
    for probability, alpha in ((0.90, 0.14), (0.50, 0.25)) if bands else ():
        interval = scale * style.bounded(band.intervals[probability])
        axes.fill_between(v, *interval, color=look.colour, alpha=alpha, lw=0, zorder=1)
    axes.plot(v, median, **look.pen, lw=0.7, zorder=2, label=style.shorten(label, 40))
    axes.plot(v, np.where(band.extrapolated, np.nan, median), **look.pen, lw=1.7, zorder=2)


def _untested(scruton_numbers: Sequence[float]) -> float:
    """In the widest gap between tested Scruton numbers a factor two or more apart, else twice the largest."""
    tested = np.sort(scruton_numbers)
    ratio = tested[1:] / tested[:-1]
    if ratio.max(initial=0.0) < SCRUTON_NUMBERS_APART:
        return float(f"{2.0 * tested[-1]:.2g}")
    i = int(ratio.argmax())
    return float(f"{np.sqrt(tested[i] * tested[i + 1]):.2g}")
