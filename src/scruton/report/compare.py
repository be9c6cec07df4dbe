"""Two results side by side: as tables for the terminal, as numbers, and as a page with both Griffin plots in one."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from scruton.campaign.spelling import several
from scruton.documents import as_json, found_beside, read_document
from scruton.gap.results import RESULT as GAP
from scruton.griffin.compare import APART, MOVED, NARROWER, WIDER, Difference, Side, differences
from scruton.griffin.posterior import peak_names
from scruton.griffin.thresholds import WIDTH_APART
from scruton.infer.joint import FORCES
from scruton.infer.results import Fit
from scruton.infer.store import load_fit
from scruton.report.chapters.gap_words import gap_sentence
from scruton.report.conventions import DAMPING, SCRUTON, by_conventions, damping_words, shown_in
from scruton.report.document import Block, Chapter, Document, Listing, Table, numbered, paragraph
from scruton.report.figures.compare import compare_plot
from scruton.report.needs import for_any, governing, required_of
from scruton.report.parts import drawn
from scruton.report.saved import chosen_sizing, read_sizing
from scruton.report.summaries import forces_hold
from scruton.report.wording import PAGE, Notation
from scruton.shown import shown
from scruton.sizing.checks import ASKED

_NAMES = {  # letters that every terminal has
    "damping_ratio": "structural damping ratio", "scruton_number": "Scruton number", "a_star": "stable amplitude",
    "relaxation_rate": "relaxation rate lambda", "amplitude": "predicted stable amplitude",
    "weight": "weight of the law", "required_damping": f"required damping ratio, {float(ASKED):.0%} confidence",
}  # fmt: skip
_SHOWN_AS = {"damping_ratio": DAMPING, "required_damping": DAMPING, "scruton_number": SCRUTON}
_MADE_BY: Mapping[str, Callable[[Mapping[str, Any]], Any]] = {  # of a provenance
    "seed": lambda one: one["seed"],
    "version of scruton": lambda one: one["versions"]["scruton"],
    "card": lambda one: one["card"]["name"],
}
_WORDS = {MOVED: "moved", APART: "APART"}


def _facts(one: "Comparison") -> Mapping[str, object]:
    counts = {verdict: len(one.with_verdict(verdict)) for verdict in (MOVED, APART)}
    counts |= {spread: sum(each.spread == spread for each in one.differences) for spread in (WIDER, NARROWER)}
    return {"of": " and ".join(one.titles), "compared": len(one.differences), **counts}


@shown(_facts)
@dataclass(frozen=True, eq=False)
class Comparison:
    """Two results side by side.

    Attributes
    ----------
    titles : (str, str)
        Of the campaigns.
    differences : tuple of Difference
        Every quantity that one of them has.
    inputs : tuple of str
        How what they were made from differs, a sentence each; empty where it is the same.
    diagnoses : (str, str)
        In a sentence each; empty where there is none beside the fit.
    converged : (bool, bool)
    fits : (Fit, Fit)
    folders : (str, str)
        Where each lies, as it was named; empty for a fit that was given itself.
    """

    titles: tuple[str, str]
    differences: tuple[Difference, ...]
    inputs: tuple[str, ...]
    diagnoses: tuple[str, str]
    converged: tuple[bool, bool]
    fits: tuple[Fit, Fit]
    folders: tuple[str, str] = ("", "")

    @property
    def conventions(self) -> Mapping[str, Any]:
        """How a reader is shown both: as the first."""
        conventions: Mapping[str, Any] = self.fits[0].summary.get("conventions", {})
        return conventions

    @property
    def forces_hold(self) -> tuple[bool, bool]:
        """Whether the law that Y1 and epsilon are parameters of carries weight in each."""
        first, second = (forces_hold(fit.summary) for fit in self.fits)
        return first, second

    @property
    def judged(self) -> tuple[Difference, ...]:
        """The differences but those of Y1 and epsilon where their law does not hold in one or the other."""
        return tuple(one for one in self.differences if all(self.forces_hold) or one.name not in FORCES)

    def with_verdict(self, verdict: str) -> tuple[Difference, ...]:
        """Those that are "alike", "moved" (beyond Monte Carlo error) or "apart" (their 90 % intervals, too)."""
        return tuple(one for one in self.differences if one.verdict == verdict)

    def to_json(self) -> dict[str, Any]:
        """Everything but the fits as it may stand in a JSON file."""
        rows = [
            {**asdict(one), "verdict": one.verdict or None, "change": one.change, "width_ratio": one.width_ratio,
             "spread": one.spread or None}
            for one in self.differences
        ]  # fmt: skip
        names = ("title", "folder", "converged", "diagnosis", "forces_hold")
        diagnoses, folders = ([text or None for text in pair] for pair in (self.diagnoses, self.folders))
        each = zip(self.titles, folders, self.converged, diagnoses, self.forces_hold, strict=True)
        sides = [dict(zip(names, side, strict=True)) for side in each]
        content: dict[str, Any] = as_json({"format": 1, "sides": sides, "inputs": self.inputs, "differences": rows})
        return content


def compare(
    first: Fit | Path | str,
    second: Fit | Path | str,
    *,
    tests: str | Sequence[str] = (),
    scruton_numbers: float | Sequence[float] = (),
    seed: int = 0,
) -> Comparison:
    """Lay two results side by side: what differs beyond Monte Carlo error, and what does not.

    Parameters
    ----------
    first, second : Fit, Path or str
        Fits, or their folders; diagnoses and sizings that lie in those or beside are compared, too.
    tests, scruton_numbers, seed
        As of `scruton.griffin.compare.differences`.

    Raises
    ------
    InputError
        As `load_fit` and `differences`; where a diagnosis or a sizing is damaged.
    """
    folders = [Path(side) if isinstance(side, Path | str) else None for side in (first, second)]
    one, other = (load_fit(side) if isinstance(side, Path | str) else side for side in (first, second))
    found = differences(
        (one.tree, one.summary), (other.tree, other.summary), tests=several(tests),
        scruton_numbers=several(scruton_numbers), seed=seed,
    )  # fmt: skip
    return Comparison(
        (one.campaign.title, other.campaign.title),
        (*found, *_required(_sizing(folders[0], one), _sizing(folders[1], other))),
        tuple(_inputs(one.summary["provenance"], other.summary["provenance"])),
        (_diagnosis(folders[0]), _diagnosis(folders[1])), (one.converged, other.converged), (one, other),
        ("" if folders[0] is None else str(folders[0]), "" if folders[1] is None else str(folders[1])),
    )  # fmt: skip


def _diagnosis(folder: Path | None) -> str:
    path = None if folder is None else found_beside(folder, "gap", GAP)
    return "" if path is None else gap_sentence(read_document(path, "what `scruton diagnose` wrote", version=1))


def _sizing(folder: Path | None, fit: Fit) -> Mapping[str, Any]:
    path = None if folder is None else chosen_sizing(folder, fit.summary)
    return {"modes": []} if path is None else read_sizing(path)


def _required(first: Mapping[str, Any], second: Mapping[str, Any]) -> Iterator[Difference]:
    """The damping that each mode of a name needs, where one of the two was sized."""
    sides = [{mode["name"]: _needed(content, mode) for mode in content["modes"]} for content in (first, second)]
    for name in dict.fromkeys(name for of in sides for name in of):
        one, other = (of.get(name) for of in sides)
        if one or other:
            yield Difference("required_damping", name, "-", one, other)


def _needed(content: Mapping[str, Any], mode: Mapping[str, Any]) -> Side | None:
    """The required damping as a quantity: its ends are those of the least and the greatest confidence.

    What keeps the risk of any mode, where the bridge asks for that, comes from half the draws.
    """
    limit, value = governing(mode), required_of(content, mode)
    if value is None:
        return None
    ends = [value, *(one for one in limit["required"].values() if one is not None)]
    error = (limit["required_mcse"][ASKED] or 0.0) * (math.sqrt(2.0) if for_any(content) else 1.0)
    return Side(value, min(ends), max(ends), error)


def _inputs(first: Mapping[str, Any], second: Mapping[str, Any]) -> Iterator[str]:
    """How two fits were made that differs."""
    for what, at in _MADE_BY.items():
        a, b = (at(one) for one in (first, second))
        if a != b:
            yield f"The {what}: {a}, and {b}."
    if first["card"]["sha256"] != second["card"]["sha256"] and first["card"]["name"] == second["card"]["name"]:
        yield f"The card {first['card']['name']} is not the same."
    files = [one["sha256"] for one in (first, second)]
    for whose, mine, other in (("A", files[0], files[1]), ("B", files[1], files[0])):
        if own := [name for name in mine if name not in other]:
            yield f"Files of {whose} alone: {', '.join(own)}."
    if changed := [name for name in files[0] if name in files[1] and files[0][name] != files[1][name]]:
        yield f"Files that differ: {', '.join(changed)}."


@by_conventions
def compared_blocks(found: Comparison, notation: Notation) -> Iterator[Block]:
    """What differs, then everything side by side."""
    # two fits of one campaign have one title
    yield Listing(
        [
            f"{name}: {title}{f' ({folder})' if folder else ''}"
            for name, title, folder in zip("AB", found.titles, found.folders, strict=True)
        ]
    )
    for name, converged in zip("AB", found.converged, strict=True):
        if not converged:
            yield paragraph(f"{name} DID NOT CONVERGE: not to be trusted.")
    yield paragraph(_said(found), role="answer")
    if found.inputs:
        yield paragraph("Made from what is not the same:")
        yield Listing(found.inputs)
    for name, text in zip("AB", found.diagnoses, strict=True):
        if text:
            yield paragraph(f"Diagnosis of {name}: {text}")
    for key in dict.fromkeys(one.name for one in found.differences):
        rows = [one for one in found.differences if one.name == key]
        factor, unit = _shown(rows[0])
        ends = rows[0].name != "weight"
        spans = ("between",) if key == "required_damping" else ("90 %",)
        says = any(map(_marked, rows))
        header = ("of", "A", *(spans if ends else ()), "B", *(spans if ends else ()), "change", *([""] if says else []))
        cells = [
            (one.of, *_side(one.first, factor, notation, ends=ends), *_side(one.second, factor, notation, ends=ends),
             _change(one, notation), *([_marked(one)] if says else []))
            for one in rows
        ]  # fmt: skip
        caveat = _doubt(found.forces_hold) if key in FORCES else ""
        yield Table(key, f"{_name(key)}{f' [{unit}]' if unit else ''}{caveat}", header, cells,
                    numeric=(False, *[True] * (len(header) - 1 - says), *([False] if says else [])))  # fmt: skip
    yield paragraph(
        "moved: beyond four Monte Carlo standard errors. APART: the 90 % intervals do not meet, too. wider, narrower:"
        f" the 90 % interval of B, by a factor of {WIDTH_APART:g} or more."
        " Required damping: between the least and the greatest confidence.",
        role="note",
    )


def _marked(one: Difference) -> str:
    """What the last column says of a quantity."""
    return ", ".join(filter(None, (_WORDS.get(one.verdict, ""), one.spread)))


def _doubt(holds: Sequence[bool]) -> str:
    """What has to be said of Y1 and epsilon where their law does not hold in A, in B or in both; empty otherwise."""
    where = " and ".join(name for name, held in zip("AB", holds, strict=True) if not held)
    return f" (of the law n=-1, WHICH DOES NOT HOLD IN {where})" if where else ""


def _said(found: Comparison) -> str:
    """What differs, in a sentence or two."""
    doubt = _doubt(found.forces_hold)
    return _said_of_judged(found) + (f" Y1 and epsilon are not among them{doubt}." if doubt else "")


def _said_of_judged(found: Comparison) -> str:
    both = [one for one in found.judged if one.verdict]
    moved, apart = ([one for one in both if one.verdict == verdict] for verdict in (MOVED, APART))
    if not both:
        return "Nothing is in both of them."
    spread = _said_of_widths(both)
    if not moved and not apart:
        if spread:
            return f"The medians are alike within Monte Carlo error: all of {len(both)} quantities.{spread}"
        return f"Alike within Monte Carlo error: all of {len(both)} quantities."
    words = [f"{len(moved) + len(apart)} of {len(both)} quantities differ beyond Monte Carlo error"]
    words += [f"{len(apart)} of them by more than their 90 % intervals" if apart else "their 90 % intervals all meet"]
    relative = [one for one in (*moved, *apart) if one.name != "weight" and one.change == one.change]
    largest = sorted(relative, key=lambda one: abs(one.change), reverse=True)[:3]
    most = ", ".join(f"{_name(one.name)} of {one.of}" for one in largest)
    return f"{', '.join(words)}." + (f" The largest changes: {most}." if most else "") + spread


def _said_of_widths(both: Sequence[Difference]) -> str:
    """Of how many quantities the interval is another, in a sentence; empty where of none."""
    told = sorted((one for one in both if one.spread), key=lambda one: abs(math.log(one.width_ratio)), reverse=True)
    if not told:
        return ""
    count = {spread: sum(one.spread == spread for one in told) for spread in (WIDER, NARROWER)}
    words = " and ".join(f"{many} {spread}" for spread, many in count.items() if many)
    times = math.exp(abs(math.log(told[0].width_ratio)))
    most = f"most that of {_name(told[0].name)} of {told[0].of}, {times:.2g} times"
    return f" Of the 90 % intervals, {words} in B by a factor of {WIDTH_APART:g} or more: {most}."


def _name(quantity: str) -> str:
    return _NAMES.get(quantity, quantity).replace("damping ratio", damping_words())


def _shown(one: Difference) -> tuple[float, str]:
    """Factor and unit of a quantity as it is read."""
    if one.name == "weight":
        return 100.0, "%"
    factor, unit = shown_in(_SHOWN_AS.get(one.name, one.unit))
    return factor, "" if unit == "-" else unit


def _side(side: Side | None, factor: float, notation: Notation, *, ends: bool) -> tuple[str, ...]:
    if side is None:
        return (notation.missing,) * (1 + ends)
    if not ends:
        return (notation.number(factor * side.median),)
    return notation.interval(side.median, side.low, side.high, factor=factor)


def _change(one: Difference, notation: Notation) -> str:
    if one.name == "weight" or one.change != one.change:
        return notation.missing
    if abs(one.change) < 5e-5:
        return "0 %"
    return f"{'+' if one.change > 0.0 else ''}{notation.number(100.0 * one.change, 2)} %"


def compared_document(found: Comparison) -> Document:
    """The page: what differs, both Griffin plots in one, and everything side by side."""
    blocks = list(compared_blocks(found, PAGE))
    tables = [block for block in blocks if isinstance(block, Table)]
    pictures = [drawn(compare_plot(*found.fits))] if all(peak_names(fit.tree) for fit in found.fits) else []
    block = found.fits[1].campaign.title_block
    return numbered(
        Document(
            title=" and ".join(dict.fromkeys(found.titles)), about="Comparison of two results", source="",
            chapters=[
                Chapter("differences", "What differs", [one for one in blocks if not isinstance(one, Table)]),
                Chapter("griffin", "Griffin plots", pictures),
                Chapter("numbers", "Side by side", tables),
            ],
            generator="scruton compare", title_block=block.lines, colour=block.colour, logo=block.logo,
        )
    )  # fmt: skip
