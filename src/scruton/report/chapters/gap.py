"""The gap between the null model and the records: where, which effect, how far it shrinks, what would settle it."""

from collections.abc import Iterator, Mapping
from typing import Any

from scruton.report.chapters.gap_tables import held_out_table, probability_table, size_table, where_table
from scruton.report.chapters.gap_words import (
    FIRST,
    capital,
    contained_sentence,
    effect_title,
    explained,
    gap_sentence,
    in_titles,
    in_words,
    shrink_sentence,
)
from scruton.report.chapters.material import Material
from scruton.report.document import CAUTION, Block, Callout, Heading, Listing, paragraph
from scruton.report.thresholds import PLACES_SHOWN, SIZES_SHOWN
from scruton.report.verdict import conclusion, condition, settled, told_apart_by_nothing
from scruton.report.wording import PAGE, TERMINAL

_INVISIBLE = "What these records cannot show, whatever it is"
_NULL_IN_WIND = (
    "The null model is the paper’s law with one pair of aerodynamic parameters for the peak tests and no discrepancy "
    "between them: the discrepancy and the average over laws, which the predictions carry, would swallow what this "
    "chapter looks for."
)
_NULL_IN_STILL_AIR = "The null model is a rig of constant damping ratio and constant frequency, whatever the amplitude."


def gap_chapter(material: Material) -> Iterator[Block]:
    """The diagnosis, in words, tables and its picture."""
    gap = material.gap
    if gap is None:
        return
    yield paragraph(gap_sentence(gap), role="answer")
    yield paragraph(_NULL_IN_WIND if material.tests else _NULL_IN_STILL_AIR)
    flags = list(gap.get("flags", ()))
    if material.fit.summary["provenance"]["tests"]:
        flags.append("The diagnosis reads the whole campaign, the tests that the fit was told to leave out among them.")
    if flags:
        yield Callout(CAUTION, "What was read", flags)
    for words in explained(gap, FIRST, contained_sentence(gap, material.fit.summary)):
        yield paragraph(words)
    yield held_out_table(gap, PAGE, material.unit)
    if words := shrink_sentence(gap["shrink"]):
        yield paragraph(words)
    if alike := [" or ".join(map(in_words, group)) for group in told_apart_by_nothing(gap)]:
        yield Callout(CAUTION, "These data cannot tell apart", alike)
    yield from material.of("gap")
    yield probability_table(gap, "What explains the gap", effect_title)
    yield where_table(gap, PAGE, material.unit, "Where the null model and the records part", PLACES_SHOWN)
    yield size_table(gap, PAGE, "How large the effect is")
    if gap["advice"]:
        yield Heading("What data would settle it")
        yield Listing(gap["advice"])
    if gap["invisible"]:
        yield Heading(_INVISIBLE)
        yield Listing([entry["text"] for entry in gap["invisible"]])


def gap_summary(gap: Mapping[str, Any], unit: str) -> list[Block]:
    """The diagnosis for the terminal, of amplitudes in this unit: every place, and effects by the names of files."""
    alike = "; ".join(map(" / ".join, told_apart_by_nothing(gap)))
    found = conclusion(gap, str)
    verdict = f"Verdict: {found}" if settled(gap) else capital(found)
    asked = f", {condition(gap, gap['verdict'])}".removesuffix(", ")
    return [
        paragraph(f"{verdict}. {in_titles(gap)}"),
        *([Callout(CAUTION, "", list(flags))] if (flags := gap.get("flags", ())) else []),
        *(paragraph(words) for words in explained(gap, gap["verdict"])),
        held_out_table(gap, TERMINAL, unit),
        paragraph(shrink_sentence(gap["shrink"])),
        probability_table(gap, "Probability", str),
        *([paragraph(f"These data cannot tell apart: {alike}")] if alike else []),
        size_table(gap, TERMINAL, f"Parameters{asked}", SIZES_SHOWN),
        where_table(gap, TERMINAL, unit, "Where"),
        Listing(gap["advice"]),
        *([paragraph(f"{_INVISIBLE}:")] if gap["invisible"] else []),
        Listing([entry["text"] for entry in gap["invisible"]]),
    ]
