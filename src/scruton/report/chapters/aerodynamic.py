"""Aerodynamic damping against amplitude, and the stability that follows from it."""

from scruton.report.chapters.material import Material
from scruton.report.document import Block, Chapter, Equation, Paragraph
from scruton.report.equations import AERODYNAMIC


def aerodynamic_chapter(material: Material) -> Chapter:
    """Figures of aerodynamic damping and of stability."""
    figures = material.of("aerodynamic")
    words: list[Block] = [
        Paragraph(("The aerodynamic damping ratio follows from the envelope’s rate of change,",)),
        Equation(AERODYNAMIC),
        Paragraph(
            (
                "Where it is as far below zero as the structural one is above, the amplitude stays as it is; it is "
                "stable "
                "where the sum of both grows with amplitude.",
            )
        ),
    ]
    return Chapter("aerodynamic", "Aerodynamic damping", (*words, *figures) if figures else ())
