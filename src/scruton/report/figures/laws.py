"""The paper's law against Ehsan and Scanlan's, carried to other Scruton numbers from the same posterior (Fig. 15)."""

from typing import TYPE_CHECKING

import numpy as np

from scruton.griffin.bands import griffin_band
from scruton.griffin.posterior import peak_names, unit_of
from scruton.report.figures.griffin import SC_LABEL, draw_band, frame, looks, points, sc_range
from scruton.report.figures.style import (
    FigureWithCaption,
    amplitude_label,
    below,
    house_style,
    panels,
)

if TYPE_CHECKING:
    from scruton.infer.results import Fit

LAWS = ((-1.0, "(a) Eq. (11), n = \N{MINUS SIGN}1"), (2.0, "(b) Ehsan and Scanlan, Eq. (21), n = 2"))
_BANDS = 7


def law_comparison(fit: "Fit") -> FigureWithCaption:
    """Griffin curves of every peak test under n = -1 and under n = 2, from one and the same (a*, lambda).

    Parameters
    ----------
    fit : Fit
        With one test in wind or more.
    """
    tree, tests, style = fit.tree, peak_names(fit.tree), looks(fit.tree)
    low, high = sc_range(tree, tests)
    grid = np.linspace(low, high, 161)
    bands = {n: {name: griffin_band(tree, grid, name, law_n=n) for name in tests} for n, _ in LAWS}
    reach = [one.median[grid >= 0.0] for one in bands[-1.0].values()]
    measured = [fit.campaign.test(name).stable_amplitude for name in tests]
    ceiling = 1.25 * max(
        [float(one[np.isfinite(one)].max(initial=0.0)) for one in reach] + [one.mean for one in measured if one]
    )
    with house_style():
        figure, axes = panels(2, height_mm=78.0, sharex=True, sharey=True)
        for one, (n, title) in zip(axes, LAWS, strict=True):
            for name in tests:
                draw_band(one, bands[n][name], style[name], f"from {name}", bands=len(tests) <= _BANDS)
            points(one, fit, own=False)
            frame(one, (low, high), ceiling, note=0.3 if one is axes[0] else None)
            one.set_title(title)
            one.set_xlabel(SC_LABEL)
        label = amplitude_label(unit_of(tree))
        axes[0].set_ylabel(f"Stable {label[0].lower()}{label[1:]}")
        below(figure, axes)
    return FigureWithCaption(
        figure,
        "laws",
        "Griffin curves from the stable amplitude and the relaxation rate of one test at a time, (a) by the paper's "
        "law and (b) by Ehsan and Scanlan's, with 50 and 90 % credible bands; thin where the extrapolation index "
        "exceeds 0.3, beyond which laws part. Points are measured.",
        "Two panels: curves of the paper's law stay near the measured points at distant Scruton numbers, those of "
        "Ehsan and Scanlan's law fall to zero amplitude at a finite Scruton number.",
    )
