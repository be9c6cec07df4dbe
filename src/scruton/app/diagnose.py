"""`scruton diagnose`: gap.json, its text for the terminal and its picture."""

from argparse import Namespace
from typing import Any

from scruton.app.run import Outcome, Run, default_folder
from scruton.campaign import load_campaign
from scruton.dynamics.effects import CATALOGUE, UNKNOWN
from scruton.gap.results import RESULT
from scruton.report.chapters.gap import shrink_sentence
from scruton.report.text import number, table


def run(arguments: Namespace) -> Outcome:
    """Diagnose a campaign into a folder.

    Raises
    ------
    InputError
        For bad input, or a folder that holds a diagnosis already; nothing is written then.
    """
    from scruton.gap.run import examine
    from scruton.infer.cards import load_card
    from scruton.report.figures.gap import gap_figure
    from scruton.report.figures.save import save

    campaign, card = load_campaign(arguments.campaign), load_card(arguments.model)
    claim = Run(
        arguments.out or default_folder(arguments.campaign) / "gap",
        "diagnose",
        arguments,
        sha256=campaign.sha256 or {},
        card=card,
        settings={"thorough": arguments.thorough},
        results=(RESULT,),
    )
    with claim as work:
        diagnosis, content, findings, curves = examine(
            campaign, card, workers=arguments.workers, thorough=arguments.thorough, progress=work.bar
        )
        pictures = save(gap_figure(diagnosis, findings, curves), work.new, "gap", formats=("svg", "png"))
        work.write(RESULT, content)
        return Outcome(gap_text(content), work.published([work.new / RESULT, *pictures]))


def gap_text(content: dict[str, Any]) -> str:
    """Tell what was found, where, how sure, and how far the gap shrinks."""
    names = [content["verdict"], *content["also"]]
    parts = [f"Verdict: {' and '.join(names)}. {_titles(names)}"]
    likely = sorted(content["probability"].items(), key=lambda pair: -pair[1])
    rows = [[name, f"{p:.3f}"] for name, p in likely if p > 5e-4]
    parts.append("Probability (calibrated on simulated campaigns)\n" + table(["cause", "probability"], rows))
    groups = [group for group in content["indistinguishable"] if len(group) > 1]
    if groups:
        parts.append("These data cannot tell apart: " + "; ".join(" / ".join(group) for group in groups))
    rows = [
        [
            name, key, number(one["median"]), f"{number(one['interval90'][0])} .. {number(one['interval90'][1])}",
            one["unit"], one["form"],
        ]
        for name, effect in content["effects"].items()
        for key, one in list(effect["parameters"].items())[:6]
    ]  # fmt: skip
    if rows:
        header = ["effect", "parameter", "median", "90 % interval", "unit", "form"]
        parts.append("Parameters\n" + table(header, rows))
    rows = [
        [
            one["quantity"], one["rig"] or "-", one["test"] or "still air", one["record"] or "-",
            _range(one["amplitude"]), _range(one["time_s"]), number(one["excess"], 3),
        ]
        for one in content["where"]
    ]  # fmt: skip
    if rows:
        parts.append("Where\n" + table(["quantity", "rig", "test", "record", "amplitude", "time [s]", "excess"], rows))
    if words := shrink_sentence(content["shrink"]):
        parts.append(words)
    parts += [f"- {line}" for line in content["advice"]]
    if content["invisible"]:
        parts.append("What these records cannot show, whatever it is:")
        parts += [f"- {one['text']}" for one in content["invisible"]]
    return "\n\n".join(parts)


def _titles(names: list[str]) -> str:
    if names == ["none"]:
        return "The bare model and the records agree within their noise."
    entries = {**CATALOGUE, UNKNOWN.name: UNKNOWN}
    return " ".join(f"{entries[name].title}." for name in names if name in entries)


def _range(pair: list[float] | None) -> str:
    return "-" if pair is None else f"{number(pair[0], 3)} .. {number(pair[1], 3)}"
