"""`scruton size`: sizing.json, its table for the terminal and its figures."""

from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.app.options import check_writable, parse_damping
from scruton.app.predict import check_effect
from scruton.app.run import Outcome, Run
from scruton.errors import InputError
from scruton.report.chapters.sizing import sizing_summary
from scruton.report.render_text import render_text
from scruton.terminal import DONE, NOT_TRUSTED

if TYPE_CHECKING:
    import xarray as xr

    from scruton.sizing.bridge import Bridge

RESULT = "sizing.json"


def run(arguments: Namespace) -> Outcome:
    """Size the damping from a folder of results.

    Raises
    ------
    InputError
        For bad input, or a folder that holds a sizing already; nothing is written then.
    """
    from scruton.infer.store import read_tree
    from scruton.report.figures import figures_from, save
    from scruton.report.parts import sizing_origin
    from scruton.sizing.limits import limit
    from scruton.sizing.run import size

    results, rig = arguments.results, arguments.rig
    folder = arguments.out or results / "sizing"
    rules = [limit(one) for one in arguments.limit]
    check_writable(folder)
    tree, summary = read_tree(results)
    if not summary["tests"]:
        raise InputError(results, "", "a campaign without tests in wind", "a fit of at least one test")
    check_effect(summary, arguments.effect, results)
    stands = read_bridge(tree, arguments.bridge, damping=arguments.damping, rig=rig)
    settings = {name: getattr(arguments, name) for name in ("law", "effect", "rig", "damping")}
    settings["limits"] = arguments.limit
    origin = sizing_origin(results, summary, stands, seed=arguments.seed, settings=settings)
    inputs = origin["fit_sha256"] | origin["bridge_sha256"]
    with Run(folder, "size", arguments, sha256=inputs, settings=settings, results=(RESULT,)) as work:
        sizing = size(tree, stands, rules, rig=rig, law_n=arguments.law, seed=arguments.seed, progress=work.bar)
        content = sizing.to_json()
        _explain(content, summary, bridge=arguments.bridge)
        content["provenance"] = origin | {key: settings[key] for key in ("law", "effect")}
        drawn = figures_from("sizing", content)
        figures = [path for one in drawn for path in save(one, work.new, formats=("svg", "png"))]
        work.write(RESULT, content)
        paths = work.published([work.new / RESULT, *figures])
    return Outcome(render_text(sizing_summary(content)), paths, code=DONE if summary["converged"] else NOT_TRUSTED)


def _explain(content: dict[str, Any], summary: Mapping[str, Any], *, bridge: Path | None) -> None:
    """Add what has to be said of the fit and of a bridge that was not given."""
    if bridge is None:
        content["flags"].append("no bridge was given: the answer is for the section model itself, at its own size")
    if not summary["converged"]:
        content["flags"].insert(0, "the fit did not converge: " + "; ".join(summary["flags"]))


def read_bridge(
    tree: "xr.DataTree", path: Path | None, *, damping: str | None = None, rig: str | None = None
) -> "Bridge":
    """Read the bridge of the command line, or take the section model itself where none is given."""
    from dataclasses import replace

    from scruton.griffin.posterior import chosen_rig, motion_of
    from scruton.sizing.bridge import DAMPING, load_bridge, stand_in
    from scruton.sizing.thresholds import DAMPING_COV

    motion = motion_of(tree)
    design = None
    if damping is not None:
        design = parse_damping(damping).or_relative_sd(DAMPING_COV)
    if path is None:
        return stand_in(tree, motion, chosen_rig(tree, rig), design or DAMPING)
    found = load_bridge(path, motion)
    if design is None:
        return found
    return replace(found, modes=tuple(replace(mode, damping_ratio=design) for mode in found.modes))
