"""`scruton report`: fit, diagnosis, crossed predictions, sizing, and the report of them all."""

from argparse import Namespace
from functools import partial

from scruton.app.fit import FitTask
from scruton.app.run import Outcome
from scruton.errors import InputError
from scruton.report.build import write_report
from scruton.report.render_text import render_text
from scruton.report.summaries import fit_summary
from scruton.terminal import DONE, NOT_TRUSTED


def run(arguments: Namespace) -> Outcome:
    """Fit a campaign into a folder and write its report there; a second process shares the work.

    Raises
    ------
    InputError
        For bad input; nothing is written then. What fails once the fit is made is a remark.
    """
    from scruton.infer.store import write_fit
    from scruton.processes import SecondProcess
    from scruton.report.failures import begun
    from scruton.report.parts import check_bridge, crossed_part, gap_part, scruton_numbers_of, sizing_part

    path, model, seed = arguments.campaign, arguments.model, arguments.seed
    bridge, limits, gap = arguments.bridge, arguments.limit, not arguments.no_gap
    if limits and bridge is None:
        raise InputError("command line", "--limit", f'"{limits[0]}" without a bridge', "--bridge FILE beside it")
    stands = None if bridge is None else check_bridge(path, bridge, limits)
    task = FitTask.asked(arguments)
    claim = task.claim(
        arguments,
        sha256={} if stands is None else stands.sha256,
        settings={"sc": arguments.sc, "limits": limits, "gap": gap, "bridge": bridge is not None},
    )
    with claim as work, SecondProcess() as second:
        crossed = begun(second, crossed_part, task.campaign, task.card, seed)
        diagnosis = begun(second, gap_part, path, model) if gap else None
        fit = task.fit(work)
        write_fit(fit, work.new)
        sizing = None if bridge is None else begun(second, sizing_part, work.new, bridge, limits, seed)
        of_the_bridge = partial(scruton_numbers_of, fit, bridge) if bridge and fit.summary["tests"] else ()
        paths = write_report(
            fit, work.new, place=task.folder, design_sc=arguments.sc or of_the_bridge, gap=diagnosis, sizing=sizing,
            crossed=crossed, second=second,
        )  # fmt: skip
        work.publish()
    places = (("report (PDF):", paths.pdf), ("report:", paths.report), ("Griffin plot:", paths.griffin))
    failures = [one.sentence for one in paths.failures]
    return Outcome(
        render_text(fit_summary(fit)),
        [f"{name:13} {place}" for name, place in places if place is not None],
        [*failures, *fit.flags],
        DONE if fit.converged and not failures else NOT_TRUSTED,
    )
