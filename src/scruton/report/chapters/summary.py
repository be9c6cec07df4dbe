"""The answer first: what was asked, the number with its interval, and whether it may be trusted."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from scruton.report.chapters.gap import gap_sentence
from scruton.report.chapters.material import Material, chapter
from scruton.report.chapters.predictions import design_table, in_model_unit
from scruton.report.chapters.sizing import sizing_figures, sizing_sentence, sizing_warnings
from scruton.report.chapters.structural import damping_table
from scruton.report.document import ALARM, CAUTION, Block, Callout, KeyFigure, KeyFigures, Listing, paragraph
from scruton.report.wording import estimate, number, percent, stated

if TYPE_CHECKING:
    from scruton.infer.results import Fit


@chapter("summary", "Summary")
def summary_chapter(material: Material) -> Iterator[Block]:
    """Warnings in red, the answer, the numbers, and what they rest on."""
    fit = material.fit
    warnings = (*fit.flags, *sizing_warnings(material.sizing))
    if not fit.converged:
        yield Callout(ALARM, "Not to be trusted: the sampling did not converge.", warnings)
    elif warnings:
        yield Callout(ALARM, "Read this before using a number.", warnings)
    lines = [] if material.sizing is None else [sizing_sentence(material.sizing)]
    lines += _answers(material)
    if len(lines) > 3:
        yield Listing(tuple(lines), role="answer")
    else:
        yield from (paragraph(line, role="answer") for line in lines)
    if figures := (*sizing_figures(material.sizing), *_design_figures(material)):
        yield KeyFigures(figures)
    if material.cautions():
        yield Callout(CAUTION, "With caution", tuple(material.cautions()))
    yield paragraph(*_basis(fit)) if material.in_wind else damping_table(fit)
    if material.gap is not None:
        yield paragraph(f"Diagnosis: {gap_sentence(material.gap)}")
    if not material.in_wind:
        yield paragraph("The campaign holds no test in wind, so it says nothing of vortex-induced vibration.")
    elif material.design:
        yield design_table(material)


def _design_figures(material: Material) -> Iterator[KeyFigure]:
    """The numbers of the first design."""
    for one in material.design[:1]:
        amplitude = one.to_json()["amplitude"]
        median, interval = estimate(amplitude)
        title = f"Stable amplitude at Sc = {stated(one.scruton_number)}"
        yield KeyFigure(title, f"{median} {one.unit}", f"90 % interval {interval} {one.unit}")
        if material.sizing is None:
            median, interval, unit = in_model_unit(material.fit, amplitude)
            yield KeyFigure("At the model's scale", f"{median} {unit}", f"90 % interval {interval} {unit}")
        nearest = min(one.extrapolation_indices, key=lambda test: abs(one.extrapolation_indices[test]))
        reach = f"from {nearest}; laws agree for |x| < 0.2"
        yield KeyFigure("Extrapolation index x", number(one.extrapolation_index, 2), reach)


def _answers(material: Material) -> list[str]:
    """Sentences that answer what the report was asked: the design, else the peak tests, else structural damping."""
    fit, unit = material.fit, material.unit
    answers = []
    for one in material.design:
        amplitude = one.to_json()["amplitude"]
        median, interval = estimate(amplitude)
        model_median, model_interval, model_unit = in_model_unit(fit, amplitude)
        answers.append(
            f"At the design Scruton number {stated(one.scruton_number)} (structural damping ratio "
            f"{percent(one.damping_ratio)} on rig {one.rig}) the predicted stable amplitude is {median} {unit}, "
            f"90 % interval {interval} {unit}; at the model's scale {model_median} ({model_interval}) {model_unit}."
        )
    for test in fit.summary["tests"] if not answers else ():
        if test["peak"]:
            median, interval = estimate(test["parameters"]["a_star"])
            sc = number(test["parameters"]["scruton_number"]["median"], 3)
            answers.append(
                f"Peak test {test['name']} (Sc = {sc}): the stable amplitude is {median} {unit}, 90 % interval "
                f"{interval} {unit}."
            )
    for rig in fit.summary["rigs"] if not answers else ():
        median, interval = estimate(rig["parameters"]["damping_ratio"], 100.0)
        answers.append(f"Rig {rig['name']}: the structural damping ratio is {median} %, 90 % interval {interval} %.")
    return answers


def _basis(fit: "Fit") -> tuple[str, str]:
    """What the numbers rest on."""
    campaign = fit.campaign
    sc = [one["parameters"]["scruton_number"]["median"] for one in fit.summary["tests"] if one["peak"]]
    records = _count(sum(len(one.records) for one in campaign.tests), "record")
    words = f"It rests on {records} in wind of {_count(len(campaign.tests), 'test')}"
    if sc:
        between = f"{number(min(sc), 3)} to {number(max(sc), 3)}" if len(sc) > 1 else number(sc[0], 3)
        words += f", {_count(len(sc), 'peak test')} among them (Sc = {between}), and on "
        words += _count(len(campaign.rigs), "rig")
    return (
        f"{words}.",
        " Intervals carry the record, the structural damping, the law of aerodynamic damping and the discrepancy "
        "between settings.",
    )


def _count(size: int, word: str) -> str:
    return f"{size} {word}{'' if size == 1 else 's'}"
