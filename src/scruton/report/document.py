"""The report as a document: chapters of blocks, frozen, without a word on how they look; the renderers know that."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from scruton.report.maths import Maths


@dataclass(frozen=True)
class Code:
    """Text as it stands in a file: a word inside a line, such as a command; or a block."""

    text: str


Run = str | Maths | Code
Line = str | tuple[Run, ...]  # a text before it is `set_in_type`, and after
ALARM, CAUTION = "alarm", "caution"


@dataclass(frozen=True)
class Paragraph:
    """Text; `role` is "text", "answer" (what the report was asked) or "note" (small)."""

    runs: tuple[Run, ...]
    role: str = "text"


def paragraph(*runs: Run, role: str = "text") -> Paragraph:
    """Text, run by run."""
    return Paragraph(runs, role)


@dataclass(frozen=True)
class Heading:
    """A heading inside a chapter."""

    text: str


@dataclass(frozen=True)
class Listing:
    """Lines with a mark before each."""

    items: Sequence[Line]
    role: str = "text"


@dataclass(frozen=True)
class Abreast:
    """Two lists side by side, each below its heading, in small type: what one page has to hold."""

    lists: Sequence[tuple[str, Sequence[Line]]]


@dataclass(frozen=True)
class Equation:
    """A displayed equation; `number` is given by `numbered`."""

    maths: Maths
    number: str = ""


@dataclass(frozen=True)
class Table:
    """A table of text."""

    name: str  # unique in a document: the stem of its LaTeX file
    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""  # stands below it
    numeric: Sequence[bool] = ()  # which columns hold numbers; by default all but the first
    data: str = ""  # stem of the CSV file with its numbers unrounded; by default one of its own name, as shown
    number: str = ""  # given by `numbered`

    def is_numeric(self, column: int) -> bool:
        """Whether a column holds numbers."""
        return self.numeric[column] if self.numeric else column > 0


@dataclass(frozen=True)
class Picture:
    """A figure, which answers where it comes with the numbers that a script draws it from.

    The `chart` is JSON: `x` and `y` (label, min, max; for x also start and step), `grid`, `areas` (label, low, high,
    tone), `lines` (label, x, y, tone), `points` (label, x, y, low, high), `read` (median, low, high along the grid,
    unit).  That of a first look is `panels`, and for a record its `window`: see `scruton.report.first_look_charts`.
    """

    name: str  # unique in a document: the stem of its files
    caption: str  # stands below it
    alt: str  # what it shows, for a reader who cannot see it
    svg: bytes = b""  # contents of its files, either empty where it is left out
    png: bytes = b""
    chart: Mapping[str, Any] | None = None
    number: str = ""  # given by `numbered`


@dataclass(frozen=True)
class Callout:
    """A box; `role` is ALARM (not to be trusted) or CAUTION."""

    role: str
    head: str
    lines: Sequence[Line] = ()


@dataclass(frozen=True)
class KeyFigures:
    """The numbers that the reader came for, side by side: label, value and detail of each."""

    items: Sequence[tuple[str, str, str]]


@dataclass(frozen=True)
class Definitions:
    """Terms, each with its text."""

    pairs: Sequence[tuple[str, str]]


Block = Paragraph | Heading | Listing | Abreast | Equation | Table | Picture | Callout | KeyFigures | Definitions | Code


@dataclass(frozen=True)
class Chapter:
    """A chapter; `key` is its address, `number` is given by `numbered` ("1", or "A" for an appendix).

    `part` is the title of the part of the report that begins with it, empty where none does.
    """

    key: str
    title: str
    blocks: Sequence[Block]
    appendix: bool = False
    number: str = ""
    part: str = ""


@dataclass(frozen=True)
class Document:
    """A whole report; chapters without a block are left out by `numbered`."""

    title: str
    about: str  # what sort of report it is
    source: str  # of the data
    chapters: Sequence[Chapter]
    generator: str = ""  # program and version
    title_block: Sequence[tuple[str, str]] = ()  # whose it is: label and text
    colour: str = ""  # of the house, "#rrggbb"
    logo: str = ""  # data URI

    def every[B: Block](self, kind: type[B]) -> list[B]:
        """Every block of a kind, in order."""
        return [block for chapter in self.chapters for block in chapter.blocks if isinstance(block, kind)]


_CODE = re.compile("`([^`]+)`")
_MINUS = re.compile(r"(?<![\w.^)=-])-(?=\.?\d)")
_POWER = re.compile(r"\b(m|mm|s|f)\^([23])\b")


def set_in_type(line: Line) -> tuple[Run, ...]:
    """A sentence for the terminal as a page sets it: commands as code, the minus as a minus, powers raised."""

    def words(text: str) -> str:
        return _POWER.sub(lambda found: found[1] + "²³"[int(found[2]) - 2], _MINUS.sub("−", text))

    if not isinstance(line, str):
        return line
    parts = _CODE.split(line)  # what stood between backticks at every odd place
    return tuple(Code(part) if i % 2 else words(part) for i, part in enumerate(parts) if part)


def _typeset(block: Block) -> Block:
    match block:
        case Paragraph(runs):
            each = [set_in_type(run) if isinstance(run, str) else (run,) for run in runs]
            return replace(block, runs=tuple(run for some in each for run in some))
        case Listing(items):
            return replace(block, items=tuple(map(set_in_type, items)))
        case Abreast(lists):
            return replace(block, lists=tuple((head, tuple(map(set_in_type, lines))) for head, lines in lists))
        case Callout(_, _, lines):
            return replace(block, lines=tuple(map(set_in_type, lines)))
    return block


def numbered(document: Document) -> Document:
    """Leave out what is empty, set sentences in type, and number chapters, tables, figures and equations.

    ValueError where two tables, pictures or chapters have one name: their files and addresses would collide.
    """
    counts: Counter[type] = Counter()

    def with_number(block: Block) -> Block:
        if not isinstance(block, Table | Picture | Equation):
            return _typeset(block)
        counts[type(block)] += 1
        return replace(block, number=str(counts[type(block)]))

    chapters: list[Chapter] = []
    letters = iter("ABCDEFGH")
    for chapter in document.chapters:
        kept = [block for block in chapter.blocks if not isinstance(block, Table) or block.rows]
        if kept:
            body = sum(not earlier.appendix for earlier in chapters)
            number = next(letters) if chapter.appendix else str(body + 1)
            chapters.append(replace(chapter, number=number, blocks=tuple(map(with_number, kept))))
    result = replace(document, chapters=tuple(chapters))
    for kind, names in (
        ("tables", Counter(table.name for table in result.every(Table))),
        ("pictures", Counter(picture.name for picture in result.every(Picture))),
        ("chapters", Counter(part.key for part in chapters)),
    ):
        if twice := sorted(name for name, count in names.items() if count > 1):
            raise ValueError(f"{kind} of one name: {', '.join(twice)}")
    return result
