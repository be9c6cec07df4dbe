"""`scruton predict`: the stable amplitude at a design Scruton number, from a folder of results."""

import json
import math
import re
from argparse import Namespace
from pathlib import Path
from typing import Any

from scruton.app.options import check_effect_name
from scruton.app.run import Outcome
from scruton.app.thresholds import SHARE_SHOWN
from scruton.campaign import Quantity
from scruton.errors import InputError
from scruton.report.text import number, table
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
    rows = []
    for one in found:
        entry = one.to_json()
        amplitude = entry["amplitude"]
        low, high = amplitude["interval"]["0.90"]
        rows.append(
            [
                number(entry["sc"]), number(entry["damping_ratio"]), number(amplitude["median"]),
                f"{number(low)} .. {number(high)}", number(amplitude["sd"]), number(one.extrapolation_index, 2),
            ]
        )  # fmt: skip
    header = ["Sc", "damping ratio", f"amplitude [{summary['amplitude_unit']}]", "90 % interval", "sd", "x"]
    lines = [table(header, rows), "x: extrapolation index; laws agree for |x| < 0.2 and part beyond 0.3."]
    shares = [f"{law} {weight:.0%}" for law, weight in found[0].laws.items() if weight > SHARE_SHOWN]
    lines.append(f"Laws: {', '.join(shares)}. The interval carries the discrepancy between settings.")
    lines += [f"! {flag}" for one in found for flag in one.flags]
    if not summary["converged"]:
        lines.append("! the fit did not converge: " + "; ".join(summary["flags"]))
    return Outcome(lines=lines, code=code)


def parse_damping(text: str) -> Quantity:
    """Read a design damping ratio from the command line: "0.003", "0.003 +/- 0.001"."""
    wanted = 'a damping ratio such as "0.003" or "0.003 +/- 0.001"'
    try:
        values = [float(part) for part in re.split(r"\s*(?:\+/-|±)\s*", text.strip())]
    except ValueError:
        raise InputError("command line", "--damping", f'"{text}"', wanted) from None
    if len(values) > 2 or not 0 < values[0] < 1 or not all(math.isfinite(one) and one >= 0 for one in values):
        raise InputError("command line", "--damping", f'"{text}"', wanted + ", between 0 and 1")
    return Quantity(values[0], values[1] if len(values) == 2 else None)


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
