"""`scruton predict`: the stable amplitude at a design Scruton number, from a folder of results."""

import json
from argparse import Namespace
from pathlib import Path
from typing import Any

from scruton.app.options import check_effect_name, parse_damping
from scruton.app.run import Outcome
from scruton.errors import InputError
from scruton.report.render_text import render_text
from scruton.report.summaries import prediction_summary
from scruton.terminal import DONE, NOT_TRUSTED


def run(arguments: Namespace) -> Outcome:
    """Predict from a folder of results; nothing is written.

    Raises
    ------
    InputError
        For results that cannot be read, or hold no test in wind.
    """
    from scruton.griffin import predict
    from scruton.infer.store import read_tree

    results, rig = arguments.results, arguments.rig
    if not arguments.sc and not arguments.damping:
        raise InputError("command line", "--sc", "no design Scruton number", "--sc 30, or --damping 0.003")
    tree, summary = read_tree(results)
    if not summary["tests"]:
        raise InputError(
            results, "", "a campaign without tests in wind", "a fit of at least one test: still air says nothing of it"
        )
    check_effect(summary, arguments.effect, results)
    rigs = [one["name"] for one in summary["rigs"]]
    if rig is not None and rig not in rigs:
        raise InputError(results, "--rig", f"'{rig}'", f"one of: {', '.join(rigs)}")
    common: dict[str, Any] = {"rig": rig, "law_n": arguments.law, "seed": arguments.seed}
    found = [predict(tree, scruton_number=one, **common) for one in arguments.sc]
    found += [predict(tree, damping_ratio=parse_damping(one), **common) for one in arguments.damping]
    code = DONE if summary["converged"] else NOT_TRUSTED
    if arguments.json:
        return Outcome(lines=[json.dumps({"predictions": [one.to_json() for one in found]})], code=code)
    return Outcome(lines=[render_text(prediction_summary(found, summary))], code=code)


def check_effect(summary: dict[str, Any], effect: str | None, results: Path) -> None:
    """Refuse a fit that does not carry the effect: what was found is put into the fit, nothing here can.

    Parameters
    ----------
    summary : dict
        Of fit.json.
    effect : str or None
        A name, or "auto": any fit that was diagnosed, also one without a gap.
    results : Path
        For the error.
    """
    check_effect_name(effect)
    carried = summary.get("effect", {}).get("used")
    if effect is not None and (carried is None or effect not in ("auto", carried)):
        raise InputError(
            results, "--effect", f"a fit that carries {carried or 'no effect'}",
            f"the folder of `scruton fit CAMPAIGN --effect {effect}`",
        )  # fmt: skip
