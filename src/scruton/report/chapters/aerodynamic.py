"""Aerodynamic damping against amplitude, and the stability that follows from it."""

from collections.abc import Iterator

from scruton.report.chapters.material import Material, chapter
from scruton.report.document import Block, Equation, paragraph
from scruton.report.equations import AERODYNAMIC


@chapter("aerodynamic", "Aerodynamic damping")
def aerodynamic_chapter(material: Material) -> Iterator[Block]:
    """Figures of aerodynamic damping and of stability."""
    if figures := material.of("aerodynamic"):
        yield paragraph("The aerodynamic damping ratio follows from the envelope’s rate of change,")
        yield Equation(AERODYNAMIC)
        yield paragraph(
            "Where it is as far below zero as the structural one is above, the amplitude stays as it is; it is stable "
            "where the sum of both grows with amplitude."
        )
        yield from figures
