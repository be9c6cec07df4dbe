"""`scruton report`: fit, diagnosis, crossed predictions, sizing, and the report of them all."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from scruton.errors import InputError
from scruton.report.build import ReportPaths, write_report

if TYPE_CHECKING:
    from scruton.infer.results import Fit


def run_report(
    path: Path,
    out: Path | None,
    *,
    design_sc: Sequence[float] = (),
    bridge: Path | None = None,
    limits: Sequence[str] = (),
    model: str = "default",
    tests: str | Sequence[str] | None = None,
    seed: int = 0,
    force: bool = False,
    resume: bool = False,
    quiet: bool = False,
    effect: str | None = None,
    gap: bool = True,
    beside: bool = True,
) -> "tuple[Fit, ReportPaths]":
    """Fit a campaign into a folder and write its report there.

    Parameters
    ----------
    path, out : Path
        Campaign, and folder for the results.
    design_sc : sequence of float
        Design Scruton numbers.
    bridge : Path, optional
        A bridge.toml: the report then has damper sizing and risk.
    limits : sequence of str
        Limits beside those that the bridge names.
    gap : bool
        Whether the diagnosis of the gap is made.
    beside : bool
        Whether a second process shares the work; the results do not depend on it.
    model, tests, seed, force, resume, quiet, effect
        As of `scruton.app.fit.run_fit`.

    Returns
    -------
    fit, paths : (Fit, ReportPaths)

    Raises
    ------
    InputError
        For bad input; nothing is written then. What fails once the fit is made stands in `paths.failures`.
    """
    from scruton.app.fit import FitTask, check_design
    from scruton.infer.store import write_fit
    from scruton.report.aside import Aside
    from scruton.report.failures import begun
    from scruton.report.parts import check_bridge, crossed_part, gap_part, scruton_numbers_of, sizing_part

    check_design(design_sc)
    if limits and bridge is None:
        raise InputError("command line", "--limit", f'"{limits[0]}" without a bridge', "--bridge FILE beside it")
    stands = None if bridge is None else check_bridge(path, bridge, limits)
    task = FitTask.of(path, out, model=model, tests=tests, seed=seed, effect=effect)
    claim = task.workspace(
        force=force,
        resume=resume,
        inputs={} if stands is None else stands.sha256,
        settings={"sc": list(design_sc), "limits": list(limits), "gap": gap, "bridge": bridge is not None},
    )
    with claim as work, Aside(beside) as aside:
        crossed = begun(aside, crossed_part, path, model, task.names, seed)
        found = begun(aside, gap_part, path, model) if gap else None
        fit = task.fit(work, quiet=quiet)
        write_fit(fit, work.new)
        sizing = None if bridge is None else begun(aside, sizing_part, work.new, bridge, limits, seed)
        paths = write_report(
            fit,
            work.new,
            design_sc=design_sc
            or (partial(scruton_numbers_of, fit, bridge) if bridge and fit.summary["tests"] else ()),
            gap=found,
            sizing=sizing,
            crossed=crossed,
            aside=aside,
        )
        work.publish()
    return fit, paths.moved(work.new, task.folder)
