"""Posteriors of every test, in tables and corner plots."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from scruton.report.chapters.material import Material, chapter
from scruton.report.document import Block, Table
from scruton.report.tables import unit_of
from scruton.report.wording import estimate, parameter_name, unit_text

if TYPE_CHECKING:
    from scruton.infer.results import Fit


@chapter("posterior", "Posteriors")
def posterior_chapter(material: Material) -> Iterator[Block]:
    """One table a test; corner plots of the peak tests."""
    corners = {one.name: one for one in material.of("posterior")}
    for i, test in enumerate(material.fit.summary["tests"], 1):
        yield _parameter_table(f"posterior_{i}", f"Test {test['name']}", test["parameters"], material.unit)
        if f"corner_{i}" in corners:
            yield corners.pop(f"corner_{i}")
    yield from corners.values()


def _parameter_table(name: str, caption: str, parameters: Mapping[str, Any], unit: str) -> Table:
    rows = []
    for key, entry in parameters.items():
        median, interval = estimate(entry)
        half = estimate(entry, level="0.50")[1]
        rows.append((parameter_name(key), unit_text(unit_of(key, unit)), median, half, interval))
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
