"""The figures of a report: pure functions from a fit to a figure with its caption, and `save` to files."""

from typing import TYPE_CHECKING

from scruton.griffin.posterior import peak_names
from scruton.report.figures.chains import corner_plot, trace_plot
from scruton.report.figures.damping import (
    aerodynamic_damping_by_test,
    aerodynamic_damping_plot,
    stability_figures,
    tests_with_transients,
)
from scruton.report.figures.griffin import (
    griffin_by_test,
    griffin_plot,
    reciprocal_against_damping,
    reciprocal_plot,
)
from scruton.report.figures.laws import law_comparison
from scruton.report.figures.lock_in import has_lock_in, lock_in_plot
from scruton.report.figures.records import record_figures
from scruton.report.figures.ringdowns import ring_down_figures
from scruton.report.figures.save import save
from scruton.report.figures.style import FigureWithCaption
from scruton.report.figures.trial import trial_comparison, trial_function_fronts

if TYPE_CHECKING:
    from scruton.infer.results import Fit

__all__ = [
    "FigureWithCaption",
    "aerodynamic_damping_by_test",
    "aerodynamic_damping_plot",
    "all_figures",
    "corner_plot",
    "griffin_by_test",
    "griffin_plot",
    "has_lock_in",
    "law_comparison",
    "lock_in_plot",
    "reciprocal_against_damping",
    "reciprocal_plot",
    "record_figures",
    "ring_down_figures",
    "save",
    "stability_figures",
    "trace_plot",
    "trial_comparison",
    "trial_function_fronts",
]

CHAINS_SHOWN = 6  # tests whose corner and trace plots a report holds, peak tests only


def all_figures(fit: "Fit") -> list[FigureWithCaption]:
    """Every figure that this fit can fill, in the order of a report.

    Parameters
    ----------
    fit : Fit

    Returns
    -------
    list of FigureWithCaption
        Names are unique; a still-air campaign gives ring-downs alone.
    """
    found = list(ring_down_figures(fit))
    if not fit.campaign.tests or "posterior" not in fit.tree:
        return found
    transients = tests_with_transients(fit)
    found = [griffin_plot(fit), reciprocal_plot(fit), *griffin_by_test(fit), *record_figures(fit), *found]
    if transients:
        found += [aerodynamic_damping_plot(fit), *aerodynamic_damping_by_test(fit), *stability_figures(fit)]
        found.append(law_comparison(fit))
    if fit.front_ends:
        found.append(trial_comparison(fit, trial_function_fronts(fit)))
    found.append(reciprocal_against_damping(fit))
    if has_lock_in(fit):
        found.append(lock_in_plot(fit))
    for test in [*peak_names(fit.tree)][:CHAINS_SHOWN]:
        found += [corner_plot(fit, test), trace_plot(fit, test)]
    return found
