"""The paper's law against Ehsan and Scanlan's, carried to other Scruton numbers from the same posterior (Fig. 15)."""

from typing import TYPE_CHECKING

import numpy as np

from scruton.griffin.bands import griffin_band
from scruton.griffin.posterior import peak_names, unit_of
from scruton.report.figures import style
from scruton.report.figures.damping import tests_with_transients
from scruton.report.figures.griffin_axes import (
    SC_LABEL,
    draw_band,
    frame,
    line_styles,
    points,
    sc_range,
    stable_amplitude_label,
)
from scruton.report.figures.registry import FigureWithCaption, figure
from scruton.report.thresholds import MOST_BANDS

if TYPE_CHECKING:
    from scruton.infer.results import Fit

LAWS = ((-1.0, "(a) Eq. (11), n = \N{MINUS SIGN}1"), (2.0, "(b) Ehsan and Scanlan, Eq. (21), n = 2"))


@figure(
    "griffin-plot",
    name="laws",
    what="The comparison of laws",
    when=tests_with_transients,
    caption="Griffin curves from the stable amplitude and the relaxation rate of one test at a time, (a) by the "
    "paper's law and (b) by Ehsan and Scanlan's, with 50 and 90 % credible bands; thin where the extrapolation index "
    "exceeds 0.3, beyond which laws part. Points are measured.",
)
def law_comparison(fit: "Fit") -> FigureWithCaption:
    """Griffin curves of every peak test under n = -1 and under n = 2, from one and the same (a*, lambda)."""
    tree, tests, styles = fit.tree, peak_names(fit.tree), line_styles(fit.tree)
    low, high = sc_range(tree, tests)
    grid = np.linspace(low, high, 161)
    bands = {n: {name: griffin_band(tree, grid, name, law_n=n) for name in tests} for n, _ in LAWS}
    medians = [own.median[grid >= 0.0] for own in bands[-1.0].values()]
    measured = [fit.campaign.test(name).stable_amplitude for name in tests]
    ceiling = 1.25 * max(
        [float(median[np.isfinite(median)].max(initial=0.0)) for median in medians]
        + [quantity.mean for quantity in measured if quantity]
    )
    drawing, panels = style.panels(2, height_mm=78.0, sharex=True, sharey=True)
    for axes, (n, title) in zip(panels, LAWS, strict=True):
        for name in tests:
            draw_band(axes, bands[n][name], styles[name], f"from {name}", bands=len(tests) <= MOST_BANDS)
        points(axes, fit, own=False)
        frame(axes, (low, high), ceiling, note=0.3 if axes is panels[0] else None)
        axes.set_title(title)
    style.outer_labels(panels, SC_LABEL, stable_amplitude_label(unit_of(tree)))
    style.below(drawing, panels)
    return FigureWithCaption(
        drawing,
        alt="Two panels: curves of the paper's law stay near the measured points at distant Scruton numbers, those of "
        "Ehsan and Scanlan's law fall to zero amplitude at a finite Scruton number.",
    )
