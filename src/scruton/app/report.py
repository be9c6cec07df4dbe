"""`scruton report`: of a campaign, with all that is computed for it; or of what earlier runs left in a folder."""

from argparse import Namespace
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from scruton.app.fit import FitTask
from scruton.app.run import Outcome, Run
from scruton.errors import InputError
from scruton.report.office import PACKAGES, check_office
from scruton.report.render_text import render_text
from scruton.report.summaries import fit_summary
from scruton.terminal import DONE, NOT_TRUSTED, line_width

if TYPE_CHECKING:
    from scruton.infer.results import Fit
    from scruton.report.build import ReportPaths

WRITTEN = ("report.html", "report.pdf", "report.json")
# Options that have a meaning for a campaign alone, and what they are where they are left out.
_OF_A_CAMPAIGN = {"model": "default", "tests": None, "effect": None, "resume": False}
_SPELT = {"tests": "test"}  # where an option is not called as the argument that it becomes


def run(arguments: Namespace) -> Outcome:
    """Write the report of a campaign, or of a fit that lies in a folder.

    InputError for bad input; nothing is written then. What fails once the fit is made is a remark.
    """
    from scruton.infer.store import SUMMARY
    from scruton.sizing.size import check_other

    bridge, limits = arguments.bridge, arguments.limit
    if limits and bridge is None:
        raise InputError("command line", "--limit", f'"{limits[0]}" without a bridge', "--bridge FILE beside it")
    check_other(arguments.other, bridge, "command line", "--")
    for form in _office(arguments):
        check_office(form, f"--{form}")
    if (arguments.campaign / SUMMARY).is_file():
        return of_results(arguments)
    if arguments.sizing is not None:
        wanted = "a folder of results; a report of a campaign takes --bridge FILE"
        raise InputError(
            "command line", "--sizing", f"an option of a report of results, with {arguments.campaign}", wanted
        )
    return of_campaign(arguments)


def _office(arguments: Namespace) -> list[str]:
    """The formats that are asked for beside HTML and PDF."""
    return [form for form in PACKAGES if getattr(arguments, form)]


def of_campaign(arguments: Namespace) -> Outcome:
    """Fit a campaign into a folder and write its report there; a second process shares the work."""
    from scruton.infer.sampling import Known
    from scruton.infer.store import write_fit
    from scruton.processes import SecondProcess, aside
    from scruton.report.build import write_report
    from scruton.report.failures import begun
    from scruton.report.kept import Beside
    from scruton.report.parts import (
        Asked,
        check_bridge,
        crossed_part,
        gap_part,
        scruton_numbers_of,
        sizing_part,
        stated_scruton_numbers,
        whole_of,
    )

    path, model, seed = arguments.campaign, arguments.model, arguments.seed
    bridge, limits, gap = arguments.bridge, arguments.limit, not arguments.no_gap
    checked = None if bridge is None else check_bridge(path, bridge, limits)
    sha256 = {} if checked is None else dict(checked.sha256)
    across = _of_other(arguments)
    task = FitTask.of(arguments)
    settings = {"sc": arguments.sc, "limits": limits, "gap": gap, "bridge": bridge is not None}
    with task.claim(arguments, sha256 | across, settings) as work, SecondProcess(beside=arguments.jobs > 1) as second:
        stated = arguments.sc or ([] if checked is None else stated_scruton_numbers(checked))
        diagnosis = begun(second, aside, gap_part, path, model, stated) if gap else None
        known = Known(second=second)
        fit = task.fit(work, known)
        crossed = begun(second, crossed_part, whole_of(fit, known))
        write_fit(fit, work.new)
        asked = None if bridge is None else Asked(bridge, limits, arguments.other)
        sizing = None if asked is None else begun(second, aside, sizing_part, work.new, asked, seed)
        of_the_bridge = partial(scruton_numbers_of, fit.tree, bridge) if bridge and fit.summary["tests"] else ()
        paths = write_report(
            fit, work.new, design_sc=arguments.sc or of_the_bridge, gap=diagnosis, sizing=sizing,
            known=Beside(crossed), second=second, office=_office(arguments),
        )  # fmt: skip
        work.publish()
    return _outcome(fit, paths.moved(task.folder))


def of_results(arguments: Namespace) -> Outcome:
    """Write the report of a fit that lies in a folder, with the diagnosis and the sizing beside it; nothing is sampled.

    A bridge that is named is sized anew, which takes seconds.
    """
    from scruton.infer.store import load_fit, provenance_of
    from scruton.report.build import write_report
    from scruton.report.parts import Asked
    from scruton.report.saved import beside, chosen_sizing, sizing_remark

    results: Path = arguments.campaign
    for option, otherwise in _OF_A_CAMPAIGN.items():
        if getattr(arguments, option) != otherwise:
            raise InputError(
                "command line", f"--{_SPELT.get(option, option)}", f"an option of a fit, with {results} that holds one",
                "the campaign itself; a report of results takes what is there",
            )  # fmt: skip
    fit = load_fit(results)
    bridge, limits = arguments.bridge, arguments.limit
    if bridge is not None and arguments.sizing is not None:
        raise InputError("command line", "--sizing", "a sizing and a bridge to be sized", "one of them")
    sizing = None if bridge is not None else chosen_sizing(results, fit.summary, arguments.sizing)
    said = sizing_remark(results, sizing)
    remarks = [f"{said}: --sizing DIR takes it"] if said else []
    content = beside(
        results, fit, asked=None if bridge is None else Asked(bridge, limits, arguments.other),
        design_sc=arguments.sc, gap=not arguments.no_gap, sizing=arguments.sizing, out=arguments.out,
    )  # fmt: skip
    inputs = provenance_of(results, fit.summary) | _of_other(arguments)
    if bridge is not None:
        inputs |= content["sizing"].content["provenance"]["bridge_sha256"]
    settings = {"sc": arguments.sc, "limits": limits, "gap": content["gap"] is not None, "bridge": bridge is not None}
    folder = arguments.out or results / "report"
    claim = Run(folder, "report", arguments, sha256=inputs, settings=settings, results=WRITTEN)
    with claim as work:
        paths = write_report(fit, work.new, office=_office(arguments), **content)
        work.publish()
    return _outcome(fit, paths.moved(folder), remarks, sizing)


def _of_other(arguments: Namespace) -> dict[str, str]:
    """SHA-256 of the fit of the other motion, by its motion and file; InputError where it is none of tests in wind."""
    if arguments.other is None:
        return {}
    from scruton.app.predict import read_fit
    from scruton.griffin.posterior import motion_of
    from scruton.infer.store import provenance_of

    tree, summary = read_fit(arguments.other, None, "a fit of at least one test")
    made = provenance_of(arguments.other, summary)
    return {f"{motion_of(tree).value}: {name}": digest for name, digest in made.items()}


def _outcome(fit: "Fit", paths: "ReportPaths", remarks: Sequence[str] = (), sizing: Path | None = None) -> Outcome:
    written = [place for place in (paths.pdf, paths.report, *paths.office, paths.griffin) if place is not None]
    failures = [failure.sentence for failure in paths.failures]
    code = DONE if fit.converged and not failures else NOT_TRUSTED
    content = {"paths": list(map(str, written)), "converged": fit.converged, "failures": failures, "flags": fit.flags}
    content |= {} if sizing is None else {"sizing": str(sizing)}
    said = [*failures, *fit.flags, *remarks]
    return Outcome(render_text(fit_summary(fit), line_width()), written, said, code, content)
