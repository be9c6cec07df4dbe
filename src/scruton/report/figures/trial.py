"""Trial functions compared by the Griffin curves that they give, as the paper's Fig. 13."""

from typing import TYPE_CHECKING

import numpy as np

from scruton.errors import InputError
from scruton.griffin.posterior import draws_of, mass_damping_draws, peak_names, unit_of
from scruton.report.figures import style
from scruton.report.figures.griffin_axes import (
    SC_LABEL,
    frame,
    line_styles,
    plot_curve,
    points,
    sc_range,
    stable_amplitude_label,
    test_points,
)
from scruton.report.figures.registry import FigureWithCaption, figure

if TYPE_CHECKING:
    from scruton.envelope import FrontEnd
    from scruton.infer.results import Fit

FITTED = "second-order exponential"  # the form that the fit itself used


def trial_function_fronts(fit: "Fit") -> dict[str, dict[str, "FrontEnd"]]:
    """Run the paper's procedure on every transient record of the peak tests with every trial function.

    Returns
    -------
    dict
        By trial function and record name; a record too short for a form is left out of it.
    """
    from scruton.envelope import TRIAL_FUNCTIONS, front_end

    constant = fit.tree["constant_data"]
    found: dict[str, dict[str, FrontEnd]] = {form: {} for form in TRIAL_FUNCTIONS}
    for form, fronts in found.items():
        for name in peak_names(fit.tree):
            for record in fit.campaign.test(name).records:
                if record.name not in fit.front_ends:
                    continue
                if form == FITTED:
                    fronts[record.name] = fit.front_ends[record.name]
                    continue
                try:
                    fronts[record.name] = front_end(
                        record,
                        frequency=float(constant["wind_frequency"].sel(test=name)),
                        still_air_frequency=float(constant["frequency"].sel(test=name)),
                        damping_ratio=float(np.median(draws_of(fit.tree, "damping_ratio", name))),
                        mass_damping_factor=float(np.median(mass_damping_draws(fit.tree, name))),
                        trial=form,
                    )
                except (InputError, ValueError):  # too short for so many constants
                    continue
    return found


@figure(
    "records",
    name="trial_functions",
    what="The comparison of trial functions",
    when=lambda fit: fit.front_ends,
    caption="Griffin curves that the deterministic procedure constructs from each transient record with other trial "
    "functions in step (5): polynomials and splines follow the noise of the envelope, and its derivative shows it. "
    "Hatched: negative Scruton numbers, without physical meaning.",
)
def trial_comparison(fit: "Fit") -> FigureWithCaption:
    """One panel a trial function: the constructed Griffin curve of every record, and the measured points."""
    fronts = {form: found for form, found in trial_function_fronts(fit).items() if found}
    tests, styles = peak_names(fit.tree), line_styles(fit.tree)
    limits = sc_range(fit.tree, tests)
    largest = max(value for point in test_points(fit, tests) for value in point.known)
    drawing, panels = style.panels(len(fronts), columns=3, height_mm=66.0, sharex=True, sharey=True)
    for letter, axes, form in zip("abcdef", panels, fronts, strict=False):
        for name in tests:
            label = style.shorten(name)
            for record in fit.campaign.test(name).records:
                if record.name in fronts[form]:
                    plot_curve(axes, fronts[form][record.name], label=label, **styles[name].pen, lw=1.1, zorder=3)
                    label = ""
        points(axes, fit, own=False)
        frame(axes, limits, 1.45 * largest, note=None)
        axes.set_title(f"({letter}) {form}", fontsize=8.0)
        axes.set_xlabel(SC_LABEL)
    panels[0].set_ylabel(stable_amplitude_label(unit_of(fit.tree)))
    style.below(drawing, panels, columns=4)
    return FigureWithCaption(
        drawing, alt=f"Constructed Griffin curves of every record in {len(fronts)} panels: {', '.join(fronts)}."
    )
