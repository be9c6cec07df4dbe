"""Predictions of a validation beside what was found."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from scruton.report.figures import style
from scruton.report.figures.registry import FigureWithCaption, figure

if TYPE_CHECKING:
    from scruton.griffin.validate import Validation

_TICKS = (0.1, 0.2, 0.33, 0.5, 0.67, 0.8, 1.0, 1.25, 1.5, 2.0, 3.0, 5.0, 10.0)


@figure("", name="validation", source="")
def validation_figure(found: "Sequence[Validation]") -> FigureWithCaption:
    """Predicted over found, one line a prediction, with its 50 and 90 % intervals."""
    tests = list(dict.fromkeys(one.test for one in found))
    drawing = style.new_figure(24.0 + 7.0 * len(found))
    axes = drawing.subplots()
    axes.axvline(1.0, color=style.GREY, lw=0.8, zorder=1)
    axes.axvspan(1.0 / 1.25, 1.25, color=style.LIGHT, alpha=0.35, lw=0, zorder=0)
    labels = []
    for row, one in enumerate(found):
        look = style.line_style(tests.index(one.test))
        for probability, width in ((0.90, 1.2), (0.50, 3.6)):
            low, high = (bound / one.amplitude for bound in one.prediction.interval(probability))
            axes.plot([max(low, 1e-3), min(high, 1e3)], [row, row], color=look.colour, lw=width, zorder=2)
        axes.plot(
            [one.prediction.median / one.amplitude], [row], marker=look.marker, color=style.BLACK, ms=4.5, zorder=3
        )
        origin = "all others" if len(one.source) > 1 or len(tests) == 2 else style.shorten(one.source[0], 22)
        labels.append(f"{style.shorten(one.test, 22)} from {origin}")
    reach = [one.factor * max(1.0 + one.error, 1.0 / (1.0 + one.error)) for one in found if one.error > -1.0]
    limit = float(np.clip(1.15 * max([1.5, *[r for r in reach if np.isfinite(r)]]), 1.6, 10.0))
    axes.set_xscale("log")
    axes.set_xlim(1.0 / limit, limit)
    ticks = [t for t in _TICKS if 1 / limit < t < limit]
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
    axes.minorticks_off()
    axes.set_yticks(range(len(labels)), labels)
    axes.set_ylim(len(labels) - 0.4, -0.6)
    axes.set_xlabel("Predicted over found stable amplitude [-]")
    axes.grid(axis="y", visible=False)
    measured = all(one.measured for one in found)
    return FigureWithCaption(
        drawing,
        caption="Stable amplitudes predicted without the records of the test predicted, over what was found: median, "
        "50 % (thick) and 90 % interval (thin). Shaded: within a factor of 1.25. "
        + ("What was found is measured." if measured else "What was not measured is the test's posterior."),
        alt="; ".join(
            f"{one.test} from {', '.join(one.source)}: {one.error:+.0%}, {'inside' if one.inside() else 'outside'} 90 %"
            for one in found
        ),
    )
