"""Predictions: what a model card's priors say before any record, and those of a validation beside what was found."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Motion
from scruton.griffin.prior import REFERENCES, PriorCurves, prior_curves
from scruton.report.figures import FigureWithCaption, figure, style
from scruton.report.figures.griffin_axes import SC_LABEL

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from scruton.griffin.validate import Validation
    from scruton.infer.cards import ModelCard

CURVES = 16  # single draws shown
_LOWEST = 3e-4  # of the amplitude axis, A/D or rad: below this nothing is measured
_HIGHEST = 3.0
_MINUS = "\N{MINUS SIGN}"
_TICKS = (0.1, 0.2, 0.33, 0.5, 0.67, 0.8, 1.0, 1.25, 1.5, 2.0, 3.0, 5.0, 10.0)  # of a factor


@figure(name="prior-predictive", source="")
def prior_plot(card: "ModelCard", *, seed: int = 0) -> FigureWithCaption:
    """Griffin curves drawn from the priors of a card, with 50 and 90 % bands."""
    drawing, panels = style.panels(2, height_mm=76.0)
    for axes, (motion, mark) in zip(panels, ((Motion.HEAVING, "a"), (Motion.TORSIONAL, "b")), strict=True):
        reference = REFERENCES[motion]
        curves = prior_curves(card, reference, seed=seed)
        _draw(axes, curves, card)
        title = f"({mark}) {motion.value}, \N{GREEK SMALL LETTER XI} = {100 * reference.damping_ratio:g} %"
        axes.set(title=title, xlabel=SC_LABEL, ylabel=style.amplitude_label(reference.unit, "Stable amplitude"))
    style.below(drawing, panels, columns=4)
    return FigureWithCaption(
        drawing,
        caption=f"Model card “{card.name}” before any record: "
        "Griffin curves drawn from its priors at a reference setting (vertical line), with 50 and 90 % bands.",
        alt="Two panels of falling curves, fanned out over two decades of amplitude.",
    )


def _draw(axes: "Axes", curves: PriorCurves, card: "ModelCard") -> None:
    sc, bands = curves.scruton_number, curves.band
    axes.plot(sc, _until_death(bands.median), color=style.BLACK, lw=1.8, zorder=3, label="median")
    for probability, alpha in ((0.50, 0.9), (0.90, 0.45)):
        low, high = (np.maximum(bound, 0.1 * _LOWEST) for bound in style.bounded(bands.intervals[probability]))
        label = f"{100 * probability:.0f} % of the curves"
        axes.fill_between(sc, low, high, color=style.LIGHT, alpha=alpha, lw=0, zorder=1, label=label)
    styles = {n: style.line_style(i) for i, n in enumerate(card.laws)}
    shown = zip(curves.amplitude[:CURVES], curves.exponent[:CURVES], strict=True)
    for amplitude, n in sorted(shown, key=lambda pair: card.laws.index(pair[1]) if styles else 0):
        look = styles.get(float(n), style.LineStyle(style.BLUE, "-", "o"))
        label = f"one curve, n = {f'{n:g}'.replace('-', _MINUS)}" if styles else "one curve, n free"
        axes.plot(sc, _until_death(amplitude), **look.pen, lw=0.6, alpha=0.75, zorder=2, label=label)
    axes.axvline(curves.reference.scruton_number, color=style.GREY, lw=0.6, ls=(0, (1.2, 1.6)), zorder=0.5)
    axes.set(yscale="log", ylim=(_LOWEST, _HIGHEST), xlim=(0.0, sc[-1]))
    style.plain_log(axes.yaxis)


def _until_death(amplitude: FloatArray) -> FloatArray:
    """Down to the axis where vibration dies, and no further."""
    dead = amplitude <= 0.0
    drawn = np.where(dead, np.nan, amplitude)
    drawn[1:][dead[1:] & ~dead[:-1]] = 0.1 * _LOWEST
    return drawn


@figure(name="validation", source="")
def validation_figure(folds: "Sequence[Validation]") -> FigureWithCaption:
    """Predicted over found, one line a prediction, with its 50 and 90 % intervals."""
    tests = list(dict.fromkeys(f.test for f in folds))
    drawing, axes = style.alone(24.0 + 7.0 * len(folds))
    axes.axvline(1.0, color=style.GREY, lw=0.8, zorder=1)
    axes.axvspan(1.0 / 1.25, 1.25, color=style.LIGHT, alpha=0.35, lw=0, zorder=0)
    labels = []
    for row, fold in enumerate(folds):
        look = style.line_style(tests.index(fold.test))
        for probability, width in ((0.90, 1.2), (0.50, 3.6)):
            low, high = (bound / fold.amplitude for bound in fold.prediction.interval(probability))
            axes.plot([max(low, 1e-3), min(high, 1e3)], [row, row], color=look.colour, lw=width, zorder=2)
        factor = fold.prediction.median / fold.amplitude
        axes.plot([factor], [row], marker=look.marker, color=style.BLACK, ms=4.5, zorder=3)
        origin = "all others" if len(fold.source) > 1 or len(tests) == 2 else style.shorten(fold.source[0], 22)
        labels.append(f"{style.shorten(fold.test, 22)} from {origin}")
    reach = [f.factor * max(1.0 + f.error, 1.0 / (1.0 + f.error)) for f in folds if f.error > -1.0]
    limit = float(np.clip(1.15 * max([1.5, *[r for r in reach if np.isfinite(r)]]), 1.6, 10.0))
    axes.set(xscale="log", xlim=(1.0 / limit, limit), xlabel="Predicted over found stable amplitude [-]")
    ticks = [t for t in _TICKS if 1 / limit < t < limit]
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
    axes.minorticks_off()
    style.rows(axes, labels)
    measured = all(f.measured for f in folds)
    return FigureWithCaption(
        drawing,
        caption="Stable amplitudes predicted without the records of the test predicted, over what was found: median, "
        "50 % (thick) and 90 % interval (thin). Shaded: within a factor of 1.25. "
        + ("What was found is measured." if measured else "What was not measured is the test's posterior."),
        alt="; ".join(
            f"{f.test} from {', '.join(f.source)}: {f.error:+.0%}, {'inside' if f.inside() else 'outside'} 90 %"
            for f in folds
        ),
    )
