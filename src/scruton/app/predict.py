"""`scruton predict` and `scruton size`: what is asked of a folder of results."""

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.app.options import check_writable, parse_damping
from scruton.app.run import Outcome, Run, variant
from scruton.documents import found_beside
from scruton.errors import InputError
from scruton.infer.store import read_draws
from scruton.report.render_text import render_text
from scruton.report.wording import TERMINAL
from scruton.terminal import DONE, NOT_TRUSTED, line_width

if TYPE_CHECKING:
    import xarray as xr

    from scruton.sizing.bridge import Bridge
    from scruton.sizing.existing import Offer
    from scruton.sizing.limits import Limit

    Fitted = tuple[xr.DataTree, dict[str, Any]]


def predict(arguments: Namespace) -> Outcome:
    """Predict the stable amplitude at a design Scruton number; nothing is written.

    InputError for results that cannot be read, or hold no test in wind.
    """
    from scruton.griffin import predict
    from scruton.infer.joint import unconverged
    from scruton.report.summaries import prediction_summary

    results, rig = arguments.results, arguments.rig
    if not arguments.sc and not arguments.damping:
        raise InputError("command line", "--sc", "no design Scruton number", "--sc 30, or --damping 0.003")
    wanted = "a fit of at least one test: still air says nothing of it"
    tree, summary = read_fit(results, arguments.effect, wanted)
    rigs = [entry["name"] for entry in summary["rigs"]]
    if rig is not None and rig not in rigs:
        raise InputError(results, "--rig", f"'{rig}'", f"one of: {', '.join(rigs)}")
    common: dict[str, Any] = {"rig": rig, "law_n": arguments.law, "seed": arguments.seed}
    predictions = [predict(tree, scruton_number=sc, **common) for sc in arguments.sc]
    predictions += [predict(tree, damping_ratio=parse_damping(damping), **common) for damping in arguments.damping]
    content = {"predictions": [prediction.to_json() for prediction in predictions]}
    unseen = arguments.json or arguments.quiet
    of_the_gap = [] if unseen else _of_the_gap(results, summary)
    text = "\n\n".join([render_text(prediction_summary(predictions, summary), line_width()), *of_the_gap])
    if summary["converged"]:
        return Outcome(text, content=content)
    remarks = [f"the fit did not converge: {', '.join(unconverged(tree))}"] if unseen else []
    return Outcome(text, remarks=remarks, code=NOT_TRUSTED, content=content)


def _of_the_gap(results: Path, summary: dict[str, Any]) -> list[str]:
    """What a diagnosis of the fit, in its folder or put into it, means for the numbers above; rendered, if any."""
    from scruton.gap.results import RESULT

    path = found_beside(results, "gap", RESULT)
    if path is None and not summary.get("effect"):
        return []
    from scruton.report.document import paragraph
    from scruton.report.saved import said_of_the_gap  # it takes its time to come

    said = said_of_the_gap(path, summary, "These numbers")
    return [render_text([paragraph(said)], line_width())] if said else []


def read_fit(results: Path, effect: str | None, wanted: str) -> "Fitted":
    """Read a fit of tests in wind that carries the effect; "auto": any that was diagnosed, also one without a gap.

    What was found is put into the fit: nothing here can.
    """
    tree, summary = read_draws(results)
    if not summary["tests"]:
        raise InputError(results, "", "a campaign without tests in wind", wanted)
    entry = summary.get("effect", {})
    carried = [entry["used"], *entry.get("also", ())] if entry else []
    if effect is not None and (not carried or effect not in ("auto", *carried)):
        raise InputError(
            results, "--effect", f"a fit that carries {' and '.join(carried) or 'no effect'}",
            f"the folder of `scruton fit CAMPAIGN --effect {effect}`",
        )  # fmt: skip
    return tree, summary


def size(arguments: Namespace) -> Outcome:
    """Size the damping of one fit, or with --other of both: sizing.json, its table for the terminal and its figures.

    The other one's results lie in a folder of its motion's name.

    InputError for bad input, or a folder that holds a sizing already; nothing is written then.
    """
    from scruton.infer.store import provenance_of
    from scruton.report.chapters.sizing import sizing_summary
    from scruton.report.chapters.together import as_fraction, both_blocks
    from scruton.sizing.results import RESULT
    from scruton.sizing.size import check_other, sized

    check_other(arguments.other, arguments.bridge, "command line", "--")
    folder, rules, asked = asked_of(arguments)
    folders = [place for place in (arguments.results, arguments.other) if place is not None]
    fits = [read_fit(results, arguments.effect, "a fit of at least one test") for results in folders]
    bridges = [bridge_of(tree, arguments) for tree, _ in fits]
    settings, several = settings_of(arguments), len(fits) > 1
    made: dict[str, str] = {}
    for bridge, results, (_, summary) in zip(bridges, folders, fits, strict=True):
        whose = f"{bridge.motion.value}: " if several else ""
        made |= {f"{whose}{name}": digest for name, digest in provenance_of(results, summary).items()}
    stated = dict(bridges[0].sha256)
    inputs = stated | made if several else made | stated  # manifests keep this order
    with Run(folder, "size", arguments, sha256=inputs, settings=settings, results=(RESULT,)) as work:
        contents = sized(
            folders, fits, bridges, rules, asked=settings, rig=arguments.rig, law_n=arguments.law,
            seed=arguments.seed, progress=work.bar, offers=asked,
        )  # fmt: skip
        written: list[Path] = []
        for content, part in zip(contents, ("", bridges[-1].motion.value), strict=False):
            written += write_sizing(work, content, part)
        paths = work.published(written)
    told = [*map(sizing_summary, contents), both_blocks(contents[0], "", as_fraction, TERMINAL)]
    rendered = [render_text(blocks, line_width()) for blocks in told]
    of_gaps = [
        said for results, (_, summary) in zip(folders, fits, strict=True) for said in _of_the_gap(results, summary)
    ]
    text = "\n\n".join(filter(None, [*rendered, *of_gaps]))
    untrusted = any(content["unconverged"] for content in contents)
    return Outcome(text, paths, code=NOT_TRUSTED if untrusted else DONE)


def asked_of(arguments: Namespace) -> "tuple[Path, list[Limit], list[Offer]]":
    """Where a sizing goes, the limits beside the bridge's, and the dampers that are there or on offer.

    Without -o the folder is a new one beside those that hold a sizing.
    """
    from scruton.sizing.existing import offers
    from scruton.sizing.limits import limit
    from scruton.sizing.results import RESULT

    folder = arguments.out or arguments.results / "sizing"
    if arguments.out is None and not arguments.force:
        folder = variant(folder, "size", (RESULT,))
    rules = [limit(rule) for rule in arguments.limit]
    asked = [offer for stated in arguments.damper for offer in offers(stated)]
    check_writable(folder)
    return folder, rules, asked


def settings_of(arguments: Namespace) -> dict[str, Any]:
    """What a sizing is asked for, by the names that sizing.json keeps it under."""
    settings = {name: getattr(arguments, name) for name in ("law", "effect", "rig", "damping")}
    return settings | {"limits": arguments.limit, "dampers": arguments.damper, "identified": arguments.identified}


def write_sizing(work: Run, content: dict[str, Any], part: str = "") -> list[Path]:
    """Write sizing.json and its figures into a part of the new results; their places."""
    from scruton.report.figures import figures_from, save
    from scruton.sizing.results import RESULT

    folder = work.new / part
    folder.mkdir(exist_ok=True)
    drawn = figures_from("sizing", content)
    figures = [path for figure in drawn for path in save(figure, folder, formats=("svg", "png"))]
    work.write(str(Path(part) / RESULT), content)
    return [folder / RESULT, *figures]


def bridge_of(tree: "xr.DataTree", arguments: Namespace) -> "Bridge":
    """Read the bridge of the command line, or take the section model itself where none is given."""
    from scruton.griffin.posterior import chosen_rig, motion_of
    from scruton.sizing.bridge import load_bridge, stand_in, with_damping
    from scruton.sizing.existing import as_built

    motion, stated = motion_of(tree), arguments.damping
    if arguments.bridge is None and arguments.identified:
        raise InputError("command line", "--identified", "no bridge", "--bridge FILE: its modes are what is identified")
    design = None if stated is None else parse_damping(stated)
    if arguments.bridge is None:
        bridge = stand_in(tree, motion, chosen_rig(tree, arguments.rig))
    else:
        bridge = load_bridge(arguments.bridge, motion)
    if design is not None:
        bridge = with_damping(bridge, design, f"--damping {stated}")
    its_own = [text for text in arguments.identified if text.partition(":")[0].strip() not in bridge.others]
    return as_built(bridge, its_own)
