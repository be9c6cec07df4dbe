"""The Griffin plots of two fits in one."""

from functools import partial

import numpy as np

from scruton.griffin import predictive_draws
from scruton.griffin.bands import band_along
from scruton.griffin.posterior import unit_of
from scruton.infer.results import Fit
from scruton.report.conventions import amplitude, scruton
from scruton.report.figures import FigureWithCaption, figure, griffin_axes, style
from scruton.report.figures.griffin import GRID

_CAPTION = (
    "Stable amplitude against the Scruton number from two results: median and 90 % predictive band of each, and the "
    "posterior of each peak test’s own stable amplitude with its 90 % interval."
)


@figure(name="compare", what="The Griffin plots of both", source="", caption=_CAPTION)
def compare_plot(first: Fit, second: Fit) -> FigureWithCaption:
    """Median, 90 % predictive band and stable amplitudes of two fits of one motion, A and B."""
    fits, unit = (first, second), unit_of(first.tree)
    ends = [griffin_axes.sc_range(fit.tree) for fit in fits]
    limits = min(low for low, _ in ends), max(high for _, high in ends)
    grid = np.linspace(*limits, GRID)
    drawing, axes = style.alone(108.0)
    ceiling, (times, scale) = 0.0, griffin_axes.factors(unit)
    tests = [griffin_axes.test_points(fit) for fit in fits]
    for i, (name, fit, places) in enumerate(zip("AB", fits, tests, strict=True)):
        look = style.line_style(i)
        found = griffin_axes.as_shown(
            band_along(grid, partial(predictive_draws, fit.tree, seed=fit.seed), unit, "predictive")
        )
        axes.fill_between(
            found.scruton_number, *style.bounded(found.intervals[0.90]), color=look.colour, alpha=0.2, lw=0, zorder=2
        )
        axes.plot(
            found.scruton_number, style.bounded(found.median), **look.pen, lw=1.8, label=f"{name}, predictive", zorder=3
        )
        low, middle, high = scale * np.array([(place.low, place.median, place.high) for place in places]).T
        spread = [middle - low, high - middle]
        axes.errorbar(
            [times * place.scruton_number for place in places], middle, spread, fmt="os"[i], color=look.colour,
            mfc="white", ms=5, lw=1.0, label=f"{name}, tests", zorder=4,
        )  # fmt: skip
        ceiling = max(ceiling, 1.3 * float(high.max()))
    axes.set(
        xlim=griffin_axes.sc_shown(limits), ylim=(0.0, ceiling), xlabel=griffin_axes.SC_LABEL,
        ylabel=style.amplitude_label(unit, "Stable amplitude"),
    )  # fmt: skip
    style.below(drawing, [axes])
    said = "; ".join(
        f"{name} {amplitude(place.median, unit)} at Sc {scruton(place.scruton_number, digits=3)}"
        for name, places in zip("AB", tests, strict=True)
        for place in places
    )
    return FigureWithCaption(drawing, alt=f"Stable amplitudes against the Scruton number. {said}.")
