"""The chapters of a report, one function each, from the results to blocks; `compose` puts them in order."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

from scruton.report.chapters import campaign, gap, methods, results, sizing, summary
from scruton.report.chapters.material import Material
from scruton.report.chapters.prose import worded
from scruton.report.conventions import conventions
from scruton.report.document import ALARM, Block, Callout, Chapter, Document, numbered
from scruton.report.failures import Failures

__all__ = ["CHAPTERS", "Material", "compose", "with_failures"]

# In the order of a report: key (where figures and failures find their chapter), title, and what writes its blocks.
CHAPTERS: tuple[tuple[str, str, Callable[[Material], Iterator[Block]]], ...] = (
    # the decision
    ("summary", "Summary", summary.summary_chapter),
    # engineering
    ("sizing", "Damper sizing and risk", sizing.sizing_chapter),
    ("griffin-plot", "Griffin plot", results.griffin_chapter),
    ("predictions", "Predictions", results.predictions_chapter),
    ("gap", "The gap between model and measurement", gap.gap_chapter),
    ("validity", "Limits of validity", summary.validity_chapter),
    ("campaign", "Campaign and similitude", campaign.campaign_chapter),
    ("structural", "Structural damping against amplitude", campaign.structural_chapter),
    ("records", "Records and fitted envelopes", campaign.records_chapter),
    ("aerodynamic", "Aerodynamic damping", results.aerodynamic_chapter),
    ("reciprocal", "1/A against the Scruton number", results.reciprocal_chapter),
    # statistics
    ("posterior", "Posteriors", results.posterior_chapter),
    ("convergence", "Convergence and calibration", methods.convergence_chapter),
    ("provenance", "Provenance", methods.provenance_chapter),
    ("methods", "Methods in short", methods.methods_chapter),
)
APPENDICES = ("posterior", "convergence", "provenance", "methods")
# The parts of a report, by the key of the chapter that each begins with, or would if it had something to say.
PARTS = {"summary": "The decision", "sizing": "Engineering", "posterior": "Statistical appendix"}


def compose(material: Material, failures: Failures | None = None) -> Document:
    """Write the document, numbered; chapters that have nothing to say are left out.

    What failed before, if `failures` are given, is said in its chapter; a chapter that fails is added to them.
    """
    fit, failures = material.fit, failures or Failures()
    chapters = []
    for key, title, write in CHAPTERS:
        # a generator: its work is done within the attempt
        with conventions(fit):
            blocks = failures.attempt(key, f"The chapter “{title}”", partial(tuple, write(material)), ())
        boxes = [failure.callout() for failure in failures.found if failure.chapter == key]
        chapters.append(Chapter(key, title, (*boxes, *blocks), key in APPENDICES))
    document = numbered(
        Document(
            title=fit.campaign.title or "Untitled campaign",
            about="Vortex-induced vibration: Griffin plot, stable amplitude and what they rest on"
            if material.tests
            else "Structural damping in still air",
            source=fit.campaign.source,
            chapters=chapters,
            generator=f"scruton {fit.summary['provenance']['versions']['scruton']}",
            title_block=fit.campaign.title_block.lines,
            colour=fit.campaign.title_block.colour,
            logo=fit.campaign.title_block.logo,
        )
    )
    return replace(document, chapters=worded(parted(document.chapters)))


def parted(chapters: Sequence[Chapter]) -> list[Chapter]:
    """Chapters, the first of every part with its title."""
    of, part, before, result = {}, "", "", []
    for key, _, _ in CHAPTERS:
        of[key] = part = PARTS.get(key, part)
    for chapter in chapters:
        result.append(replace(chapter, part="" if of[chapter.key] == before else of[chapter.key]))
        before = of[chapter.key]
    return result


def with_failures(document: Document, failures: Failures) -> Document:
    """Say at the head of a numbered document what is missing from it."""
    if not failures.found:
        return document
    box = Callout(ALARM, "Parts of this report are missing.", [failure.sentence for failure in failures.found])
    first, *others = document.chapters
    return replace(document, chapters=(replace(first, blocks=(box, *first.blocks)), *others))
