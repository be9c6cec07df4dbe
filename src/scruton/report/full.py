"""`scruton report`: fit, diagnosis, crossed predictions, sizing, and the report of them all."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from scruton.errors import InputError
from scruton.report.build import ReportPaths, build_report

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
        As of `scruton.report.run.run_fit`.

    Returns
    -------
    fit, paths : (Fit, ReportPaths)

    Raises
    ------
    InputError
        For bad input; nothing is written then.
    """
    from scruton.report.aside import Aside
    from scruton.report.parts import check_bridge, crossed_part, gap_part, scruton_numbers_of, sizing_part
    from scruton.report.run import check_design, run_fit

    check_design(design_sc)
    if limits and bridge is None:
        raise InputError("command line", "--limit", f'"{limits[0]}" without a bridge', "--bridge FILE beside it")
    if bridge is not None:
        check_bridge(path, bridge, limits)
    names = (tests,) if isinstance(tests, str) else tuple(tests or ())
    with Aside(beside) as aside:
        crossed = aside.begin(crossed_part, path, model, names, seed)
        found = aside.begin(gap_part, path, model) if gap else None
        fit, folder = run_fit(
            path, out, model=model, tests=tests, seed=seed, force=force, resume=resume, quiet=quiet, effect=effect
        )
        sizing = None if bridge is None else aside.begin(sizing_part, folder, bridge, limits, seed)
        paths = build_report(
            fit,
            folder,
            design_sc=design_sc or (scruton_numbers_of(fit, bridge) if bridge and fit.summary["tests"] else ()),
            gap=found,
            sizing=sizing,
            crossed=crossed,
            aside=aside,
        )
    return fit, paths
