"""The chapters of a report, one function each, from the results to blocks; `compose` puts them in order."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from scruton.report.chapters.aerodynamic import aerodynamic_chapter
from scruton.report.chapters.campaign import campaign_chapter
from scruton.report.chapters.convergence import convergence_chapter
from scruton.report.chapters.gap import gap_chapter
from scruton.report.chapters.griffin import griffin_chapter, reciprocal_chapter
from scruton.report.chapters.material import Material
from scruton.report.chapters.methods import methods_chapter
from scruton.report.chapters.posterior import posterior_chapter
from scruton.report.chapters.predictions import predictions_chapter
from scruton.report.chapters.provenance import provenance_chapter
from scruton.report.chapters.records import records_chapter
from scruton.report.chapters.sizing import sizing_chapter
from scruton.report.chapters.structural import structural_chapter
from scruton.report.chapters.summary import summary_chapter
from scruton.report.chapters.validity import validity_chapter
from scruton.report.document import Chapter, Chart, Document, Picture, numbered

__all__ = ["Material", "compose", "sizing_chapter"]


def compose(material: Material, charts: Mapping[str, Mapping[str, Any]] | None = None) -> Document:
    """Write the document.

    Parameters
    ----------
    material : Material
    charts : mapping, optional
        Interactive charts by the name of the picture that each stands for, as of `scruton.report.charts`.

    Returns
    -------
    Document
        Numbered; chapters that have nothing to say are left out.
    """
    fit = material.fit
    in_wind = bool(fit.summary["tests"])
    chapters: list[Chapter] = [
        summary_chapter(material),
        campaign_chapter(material),
        structural_chapter(material),
        records_chapter(material),
        aerodynamic_chapter(material),
        griffin_chapter(material),
        reciprocal_chapter(material),
        posterior_chapter(material),
        predictions_chapter(material),
        gap_chapter(material),
        sizing_chapter(material.sizing, material.of("sizing")),
        validity_chapter(material),
        convergence_chapter(material),
        provenance_chapter(material),
        methods_chapter(material),
    ]
    return numbered(
        Document(
            title=fit.campaign.title or "Untitled campaign",
            about="Vortex-induced vibration: Griffin plot, stable amplitude and what they rest on"
            if in_wind
            else "Structural damping in still air",
            source=fit.campaign.source,
            chapters=tuple(_with_charts(one, charts or {}) for one in chapters),
            generator=f"scruton {fit.summary['provenance']['versions']['scruton']}",
        )
    )


def _with_charts(chapter: Chapter, charts: Mapping[str, Mapping[str, Any]]) -> Chapter:
    """Put charts where their pictures stand."""
    blocks = tuple(
        Chart(one, charts[one.name]) if isinstance(one, Picture) and one.name in charts else one
        for one in chapter.blocks
    )
    return replace(chapter, blocks=blocks)
