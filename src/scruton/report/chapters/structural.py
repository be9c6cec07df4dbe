"""Structural damping against amplitude, from the ring-downs in still air."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from scruton.campaign.schema import Quantity
from scruton.report.chapters.material import Material, chapter
from scruton.report.document import Block, Table, paragraph
from scruton.report.wording import estimate, number, percent, stated

if TYPE_CHECKING:
    from scruton.infer.results import Fit


@chapter("structural", "Structural damping against amplitude")
def structural_chapter(material: Material) -> Iterator[Block]:
    """Damping ratio of every rig, by amplitude where there are ring-downs."""
    if material.in_wind:
        yield damping_table(material.fit)
    if material.fit.ringdowns:
        yield paragraph(
            "A suspension whose damping changes with amplitude shows it here; the Scruton number then depends "
            "on the amplitude at which it is read."
        )
        yield ring_down_table(material.fit)
    yield from material.of("structural")


def damping_table(fit: "Fit") -> Table:
    """Structural damping of every rig."""
    rows = []
    for one in fit.summary["rigs"]:
        rig = fit.campaign.rig(one["name"])
        ring = fit.ringdowns.get(rig.name)
        rows.append(
            (
                rig.name,
                number(ring.frequency if ring else rig.frequency.mean),
                _stated_damping(rig.damping_ratio),
                str(len(rig.records)),
                *(f"{text} %" for text in estimate(one["parameters"]["damping_ratio"], 100.0)),
            )
        )  # fmt: skip
    return Table(
        "damping",
        "Structural damping ratio in still air",
        ("rig", "f₀ [Hz]", "stated", "ring-downs", "found", "90 % interval"),
        tuple(rows),
        "Without ring-downs the damping found is the stated one, with the uncertainty of the model card.",
        data="rigs",
    )


def _stated_damping(quantity: Quantity | None) -> str:
    if quantity is None:
        return "–"
    text = f"{stated(100.0 * quantity.mean)} %"
    return f"{text} ± {stated(100.0 * quantity.sd)} %" if quantity.sd else text


def ring_down_table(fit: "Fit") -> Table:
    """Structural damping against amplitude."""
    unit = fit.campaign.section.amplitude_unit
    rows = [
        (
            name, f"{number(band.lower, 3)} to {number(band.upper, 3)}", percent(band.damping_ratio, 4),
            percent(band.sd, 2), str(band.plucks),
        )
        for name, ring in fit.ringdowns.items()
        for band in ring.bands
    ]  # fmt: skip
    return Table(
        "ring_downs",
        "Structural damping ratio by amplitude",
        ("rig", f"amplitude [{unit}]", "damping ratio", "sd", "plucks"),
        tuple(rows),
        data="ring_downs",
    )
