"""The figures of a report: pure functions from a fit to a figure with its caption, and `save` to files."""

from collections.abc import Callable, Iterable
from functools import partial
from typing import TYPE_CHECKING

from scruton.griffin.posterior import peak_names
from scruton.report.failures import Failures
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

Figures = Iterable[FigureWithCaption]
CHAINS_SHOWN = 6  # tests whose corner and trace plots a report holds, peak tests only


def all_figures(fit: "Fit", failures: Failures | None = None) -> list[FigureWithCaption]:
    """Every figure that this fit can fill, in the order of a report.

    Parameters
    ----------
    fit : Fit
    failures : Failures, optional
        Takes note of the figures that fail; without it, the first failure is raised.

    Returns
    -------
    list of FigureWithCaption
        Names are unique; a still-air campaign gives ring-downs alone.
    """
    found: list[FigureWithCaption] = []

    def add(chapter: str, what: str, draw: Callable[..., FigureWithCaption | Figures], *arguments: object) -> None:
        work = partial(_several, draw, *arguments)
        found.extend(work() if failures is None else failures.attempt(chapter, what, work, []))

    if not fit.campaign.tests or "posterior" not in fit.tree:
        add("structural", "The figures of the ring-downs", ring_down_figures, fit)
        return found
    add("griffin-plot", "The Griffin plot", griffin_plot, fit)
    add("reciprocal", "The plot of 1/A", reciprocal_plot, fit)
    add("griffin-plot", "The Griffin plots of single tests", griffin_by_test, fit)
    add("records", "The figures of the records", record_figures, fit)
    add("structural", "The figures of the ring-downs", ring_down_figures, fit)
    if tests_with_transients(fit):
        add("aerodynamic", "The plot of aerodynamic damping", aerodynamic_damping_plot, fit)
        add("aerodynamic", "The aerodynamic damping of single tests", aerodynamic_damping_by_test, fit)
        add("aerodynamic", "The figures of stability", stability_figures, fit)
        add("griffin-plot", "The comparison of laws", law_comparison, fit)
    if fit.front_ends:
        add("records", "The comparison of trial functions", _trial_figure, fit)
    add("reciprocal", "The plot of 1/A against damping", reciprocal_against_damping, fit)
    if has_lock_in(fit):
        add("griffin-plot", "The plot against wind speed", lock_in_plot, fit)
    for test in [*peak_names(fit.tree)][:CHAINS_SHOWN]:
        add("posterior", f"The corner plot of {test}", corner_plot, fit, test)
        add("convergence", f"The traces of {test}", trace_plot, fit, test)
    return found


def _several(draw: Callable[..., FigureWithCaption | Figures], *arguments: object) -> list[FigureWithCaption]:
    """What a function draws, be it one figure or several."""
    drawn = draw(*arguments)
    return [drawn] if isinstance(drawn, FigureWithCaption) else list(drawn)


def _trial_figure(fit: "Fit") -> FigureWithCaption:
    return trial_comparison(fit, trial_function_fronts(fit))
