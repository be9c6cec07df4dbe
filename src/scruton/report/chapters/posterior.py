"""Posteriors of every test, in tables and corner plots."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from scruton.report.chapters.material import Material
from scruton.report.document import Block, Chapter, Table
from scruton.report.tables import unit_of
from scruton.report.wording import estimate, parameter_name, unit_text

if TYPE_CHECKING:
    from scruton.infer.results import Fit


def posterior_chapter(material: Material) -> Chapter:
    """One table a test; corner plots of the peak tests."""
    corners = {one.name: one for one in material.of("posterior")}
    blocks: list[Block] = []
    for i, table in enumerate(posterior_tables(material.fit), 1):
        blocks.append(table)
        if f"corner_{i}" in corners:
            blocks.append(corners.pop(f"corner_{i}"))
    return Chapter("posterior", "Posteriors", (*blocks, *corners.values()))


def posterior_tables(fit: "Fit") -> list[Table]:
    """One table a test: every parameter with its intervals."""
    unit = fit.campaign.section.amplitude_unit
    return [
        _parameter_table(f"posterior_{i}", f"Test {one['name']}", one["parameters"], unit)
        for i, one in enumerate(fit.summary["tests"], 1)
    ]


def _parameter_table(name: str, caption: str, parameters: Mapping[str, Any], unit: str) -> Table:
    rows = []
    for key, entry in parameters.items():
        halves = {"median": entry["median"], "interval": {"0.90": entry["interval"]["0.50"]}}
        median, interval = estimate(entry)
        rows.append((parameter_name(key), unit_text(unit_of(key, unit)), median, estimate(halves)[1], interval))
    return Table(
        name, caption, ("parameter", "unit", "median", "50 % interval", "90 % interval"), tuple(rows),
        numeric=(False, False, True, True, True), data="posterior",
    )  # fmt: skip


def discrepancy(fit: "Fit") -> str:
    """What was found of the discrepancy between settings, in words."""
    found = fit.summary["campaign"].get("parameters")
    if not found:
        return ""
    texts = [
        "{} (90 %: {})".format(*estimate(found[key])) for key in ("discrepancy_amplitude", "discrepancy_relaxation")
    ]
    return f"{texts[0]} in the logarithm of the amplitude and {texts[1]} in that of G"
