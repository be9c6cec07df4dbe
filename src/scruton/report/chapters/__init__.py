"""The chapters of a report, one function each, from the results to blocks; `compose` puts them in order."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
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
from scruton.report.document import ALARM, Callout, Chapter, Chart, Document, Picture, numbered
from scruton.report.failures import Failures

__all__ = ["CHAPTERS", "Material", "compose", "with_failures"]

# In the order of a report.
CHAPTERS = (
    summary_chapter, campaign_chapter, structural_chapter, records_chapter, aerodynamic_chapter, griffin_chapter,
    reciprocal_chapter, posterior_chapter, predictions_chapter, gap_chapter, sizing_chapter, validity_chapter,
    convergence_chapter, provenance_chapter, methods_chapter,
)  # fmt: skip


def compose(
    material: Material,
    charts: Mapping[str, Mapping[str, Any]] | None = None,
    failures: Failures | None = None,
) -> Document:
    """Write the document.

    Parameters
    ----------
    material : Material
    charts : mapping, optional
        Interactive charts by the name of the picture that each stands for, as of `scruton.report.charts`.
    failures : Failures, optional
        What failed before, to be said in its chapter; a chapter that fails is added.

    Returns
    -------
    Document
        Numbered; chapters that have nothing to say are left out.
    """
    fit = material.fit
    in_wind = bool(fit.summary["tests"])
    failures = failures or Failures()
    chapters = []
    for write in CHAPTERS:
        what = f"The chapter “{write.title}”"
        written = failures.attempt(write.key, what, partial(write, material), write.blank())
        chapters.append(replace(written, blocks=(*failures.of(write.key), *written.blocks)))
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


def with_failures(document: Document, failures: Failures) -> Document:
    """Say at the head of a numbered document what is missing from it."""
    if not failures.found:
        return document
    box = Callout(ALARM, "Parts of this report are missing.", tuple(one.sentence for one in failures.found))
    first, *others = document.chapters
    return replace(document, chapters=(replace(first, blocks=(box, *first.blocks)), *others))


def _with_charts(chapter: Chapter, charts: Mapping[str, Mapping[str, Any]]) -> Chapter:
    """Put charts where their pictures stand."""
    blocks = tuple(
        Chart(one, charts[one.name]) if isinstance(one, Picture) and one.name in charts else one
        for one in chapter.blocks
    )
    return replace(chapter, blocks=blocks)
