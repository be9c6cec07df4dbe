"""What a model card's priors say before any record: Griffin curves with bands, heaving and torsional."""

from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Motion
from scruton.griffin.prior import REFERENCES, PriorCurves, prior_curves
from scruton.report.figures import style
from scruton.report.figures.griffin_axes import SC_LABEL, stable_amplitude_label
from scruton.report.figures.registry import FigureWithCaption, figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from scruton.infer.cards import ModelCard

CURVES = 16  # single draws shown
_LOWEST = 3e-4  # of the amplitude axis, A/D or rad: below this nothing is measured
_HIGHEST = 3.0
_MINUS = "\N{MINUS SIGN}"


@figure("", name="prior-predictive", source="")
def prior_plot(card: "ModelCard", *, seed: int = 0) -> FigureWithCaption:
    """Griffin curves drawn from the priors of a card, with 50 and 90 % bands.

    Parameters
    ----------
    card : ModelCard
    seed : int
        Of the draws.
    """
    drawing, panels = style.panels(2, height_mm=76.0)
    for axes, (motion, mark) in zip(panels, ((Motion.HEAVING, "a"), (Motion.TORSIONAL, "b")), strict=True):
        reference = REFERENCES[motion]
        curves = prior_curves(card, reference, seed=seed)
        _draw(axes, curves, card)
        axes.set_title(f"({mark}) {motion.value}, \N{GREEK SMALL LETTER XI} = {100 * reference.damping_ratio:g} %")
        axes.set_xlabel(SC_LABEL)
        axes.set_ylabel(stable_amplitude_label(reference.unit))
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
        low, high = (np.maximum(one, 0.1 * _LOWEST) for one in bands.intervals[probability])
        label = f"{100 * probability:.0f} % of the curves"
        axes.fill_between(sc, low, high, color=style.LIGHT, alpha=alpha, lw=0, zorder=1, label=label)
    styles = {n: style.line_style(i) for i, n in enumerate(card.laws)}
    shown = zip(curves.amplitude[:CURVES], curves.exponent[:CURVES], strict=True)
    for amplitude, n in sorted(shown, key=lambda one: card.laws.index(one[1]) if styles else 0):
        look = styles.get(float(n), style.LineStyle(style.BLUE, "-", "o"))
        label = f"one curve, n = {f'{n:g}'.replace('-', _MINUS)}" if styles else "one curve, n free"
        drawn = _until_death(amplitude)
        axes.plot(sc, drawn, **look.pen, lw=0.6, alpha=0.75, zorder=2, label=label)
    axes.axvline(curves.reference.scruton_number, color=style.GREY, lw=0.6, ls=(0, (1.2, 1.6)), zorder=0.5)
    axes.set_yscale("log")
    axes.set_ylim(_LOWEST, _HIGHEST)
    axes.set_xlim(0.0, sc[-1])
    style.plain_log(axes.yaxis)


def _until_death(amplitude: FloatArray) -> FloatArray:
    """Down to the axis where vibration dies, and no further."""
    dead = amplitude <= 0.0
    found = np.where(dead, np.nan, amplitude)
    found[1:][dead[1:] & ~dead[:-1]] = 0.1 * _LOWEST
    return found
