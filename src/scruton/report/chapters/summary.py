"""The answer first: what was asked, the number with its interval, and whether it may be trusted."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.campaign.schema import Motion
from scruton.report.chapters.gap import gap_sentence
from scruton.report.chapters.material import Material
from scruton.report.chapters.predictions import design_table
from scruton.report.chapters.sizing import sizing_figures, sizing_sentence, sizing_warnings
from scruton.report.chapters.structural import damping_table
from scruton.report.document import ALARM, CAUTION, Block, Callout, Chapter, KeyFigure, KeyFigures, Listing, Paragraph
from scruton.report.wording import estimate, number, percent, stated

if TYPE_CHECKING:
    from scruton.griffin import Prediction
    from scruton.infer.results import Fit


def summary_chapter(material: Material) -> Chapter:
    """Warnings in red, the answer, the numbers, and what they rest on."""
    fit = material.fit
    blocks: list[Block] = []
    warnings = [*fit.flags, *sizing_warnings(material.sizing)]
    if warnings or not fit.converged:
        head = (
            "Read this before using a number." if fit.converged else "Not to be trusted: the sampling did not converge."
        )
        blocks.append(Callout(ALARM, head, tuple(warnings)))
    lines = answers(fit, material.design)
    if material.sizing is not None:
        lines.insert(0, sizing_sentence(material.sizing))
    if len(lines) > 3:
        blocks.append(Listing(tuple(lines), role="answer"))
    else:
        blocks += [Paragraph((line,), role="answer") for line in lines]
    figures = key_figures(material)
    if figures.items:
        blocks.append(figures)
    if material.cautions():
        blocks.append(Callout(CAUTION, "With caution", tuple(material.cautions())))
    if material.in_wind:
        blocks.append(Paragraph(tuple(basis(fit))))
        blocks += _diagnosis(material)
        if material.design:
            blocks.append(design_table(fit, material.design))
    else:
        blocks.append(damping_table(fit))
        blocks += _diagnosis(material)
        blocks.append(
            Paragraph(("The campaign holds no test in wind, so it says nothing of vortex-induced vibration.",))
        )
    return Chapter("summary", "Summary", tuple(blocks))


def _diagnosis(material: Material) -> list[Block]:
    return [] if material.gap is None else [Paragraph((f"Diagnosis: {gap_sentence(material.gap)}",))]


def key_figures(material: Material) -> KeyFigures:
    """The numbers of the sizing where a bridge is given, and the first design."""
    found = [*sizing_figures(material.sizing)]
    for one in material.design[:1]:
        median, interval = estimate(one.to_json()["amplitude"])
        found.append(
            KeyFigure(
                f"Stable amplitude at Sc = {stated(one.scruton_number)}",
                f"{median} {one.unit}",
                f"90 % interval {interval} {one.unit}",
            )
        )
        if material.sizing is None:
            found.append(
                KeyFigure("At the model's scale", *in_model_unit(material.fit, one.to_json()["amplitude"], apart=True))
            )
        nearest = min(one.extrapolation_indices, key=lambda test: abs(one.extrapolation_indices[test]))
        found.append(
            KeyFigure(
                "Extrapolation index x", number(one.extrapolation_index, 2), f"from {nearest}; laws agree for |x| < 0.2"
            )
        )
    return KeyFigures(tuple(found))


def in_model_unit(fit: "Fit", entry: Mapping[str, Any], *, apart: bool = False) -> Any:
    """An amplitude as a length at the model's scale, or in degrees; `apart` gives the number and its interval."""
    section = fit.campaign.section
    heaving = section.motion is Motion.HEAVING
    median, interval = estimate(dict(entry), 1e3 * section.depth if heaving else 180.0 / np.pi)
    unit = "mm" if heaving else "°"
    return (f"{median} {unit}", f"90 % interval {interval} {unit}") if apart else f"{median} ({interval}) {unit}"


def answers(fit: "Fit", design: "Sequence[Prediction]") -> list[str]:
    """Sentences that answer what the report was asked."""
    found = []
    unit = fit.campaign.section.amplitude_unit
    for one in design:
        entry = one.to_json()
        median, interval = estimate(entry["amplitude"])
        found.append(
            f"At the design Scruton number {stated(one.scruton_number)} (structural damping ratio "
            f"{percent(one.damping_ratio)} on rig {one.rig}) the predicted stable amplitude is {median} {unit}, "
            f"90 % interval {interval} {unit}; at the model's scale {in_model_unit(fit, entry['amplitude'])}."
        )
    if found:
        return found
    for test in fit.summary["tests"]:
        if not test["peak"]:
            continue
        median, interval = estimate(test["parameters"]["a_star"])
        sc = number(test["parameters"]["scruton_number"]["median"], 3)
        found.append(
            f"Peak test {test['name']} (Sc = {sc}): the stable amplitude is {median} {unit}, 90 % interval {interval} "
            f"{unit}."
        )
    if found:
        return found
    for rig in fit.summary["rigs"]:
        median, interval = estimate(rig["parameters"]["damping_ratio"], 100.0)
        found.append(f"Rig {rig['name']}: the structural damping ratio is {median} %, 90 % interval {interval} %.")
    return found


def basis(fit: "Fit") -> list[str]:
    """One sentence on what the numbers rest on."""
    campaign = fit.campaign
    peaks = [one for one in fit.summary["tests"] if one["peak"]]
    records = sum(len(one.records) for one in campaign.tests)
    sc = [one["parameters"]["scruton_number"]["median"] for one in peaks]
    between = f"Sc = {number(min(sc), 3)} to {number(max(sc), 3)}" if len(sc) > 1 else f"Sc = {number(sc[0], 3)}"
    return [
        f"It rests on {_count(records, 'record')} in wind of {_count(len(campaign.tests), 'test')}, "
        f"{_count(len(peaks), 'peak test')} among them ({between}), and on {_count(len(campaign.rigs), 'rig')}."
        if peaks
        else f"It rests on {_count(records, 'record')} in wind of {_count(len(campaign.tests), 'test')}.",
        " Intervals carry the record, the structural damping, the law of aerodynamic damping and the discrepancy "
        "between settings.",
    ]


def _count(size: int, word: str) -> str:
    return f"{size} {word}{'' if size == 1 else 's'}"
