"""Trial functions compared by the Griffin curves that they give, as the paper's Fig. 13."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from scruton.errors import InputError
from scruton.report.figures.griffin import SC_LABEL, frame, looks, plot_curve, points, sc_range
from scruton.report.figures.style import (
    FigureWithCaption,
    amplitude_label,
    below,
    house_style,
    panels,
    shorten,
)

if TYPE_CHECKING:
    from scruton.envelope import FrontEnd
    from scruton.infer.results import Fit


def trial_function_fronts(fit: "Fit") -> dict[str, dict[str, "FrontEnd"]]:
    """Run the paper's procedure on every transient record of the peak tests with every trial function.

    Returns
    -------
    dict
        By trial function and record name; a record too short for a form is left out of it.
    """
    from scruton.envelope import TRIAL_FUNCTIONS, front_end
    from scruton.griffin.posterior import draws_of, mass_damping_draws, peak_names

    constant = fit.tree["constant_data"]
    found: dict[str, dict[str, FrontEnd]] = {}
    for form in TRIAL_FUNCTIONS:
        mine = found.setdefault(form, {})
        for name in peak_names(fit.tree):
            for record in fit.campaign.test(name).records:
                if record.name not in fit.front_ends:
                    continue
                if form == "second-order exponential":
                    mine[record.name] = fit.front_ends[record.name]
                    continue
                try:
                    mine[record.name] = front_end(
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


def trial_comparison(fit: "Fit", fronts: Mapping[str, Mapping[str, "FrontEnd"]]) -> FigureWithCaption:
    """One panel a trial function: the constructed Griffin curve of every record, and the measured points.

    Parameters
    ----------
    fit : Fit
    fronts : mapping
        By trial function and record; see `trial_function_fronts`.
    """
    from scruton.griffin.posterior import draws_of, peak_names, unit_of

    tests, style = peak_names(fit.tree), looks(fit.tree)
    limits = sc_range(fit.tree, tests)
    measured = [fit.campaign.test(name).stable_amplitude for name in tests]
    largest = max(
        [float(np.median(draws_of(fit.tree, "a_star", name))) for name in tests]
        + [one.mean for one in measured if one is not None]
    )
    forms = [form for form in fronts if fronts[form]]
    with house_style():
        figure, axes = panels(len(forms), columns=3, height_mm=66.0, sharex=True, sharey=True)
        for letter, one, form in zip("abcdef", axes, forms, strict=False):
            for name in tests:
                label = name
                for record in fit.campaign.test(name).records:
                    if record.name in fronts[form]:
                        plot_curve(
                            one, fronts[form][record.name], label=shorten(label), color=style[name].colour,
                            ls=style[name].line, lw=1.1, zorder=3,
                        )  # fmt: skip
                        label = ""
            points(one, fit, own=False)
            frame(one, limits, 1.45 * largest, note=None)
            one.set_title(f"({letter}) {form}", fontsize=8.0)
            one.set_xlabel(SC_LABEL)
        label = amplitude_label(unit_of(fit.tree))
        axes[0].set_ylabel(f"Stable {label[0].lower()}{label[1:]}")
        below(figure, axes, columns=4)
    return FigureWithCaption(
        figure,
        "trial_functions",
        "Griffin curves that the deterministic procedure constructs from each transient record with other trial "
        "functions in step (5): polynomials and splines follow the noise of the envelope, and its derivative shows it. "
        "Hatched: negative Scruton numbers, without physical meaning.",
        f"Constructed Griffin curves of every record in {len(forms)} panels: {', '.join(forms)}.",
    )
