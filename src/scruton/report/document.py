"""The report as a document: chapters of blocks, frozen, without a word on how they look; the renderers know that."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from scruton.report.maths import Maths


@dataclass(frozen=True)
class Code:
    """A word of code inside a line of text: a command, a file."""

    text: str


Run = str | Maths | Code
ALARM, CAUTION, NOTE = "alarm", "caution", "note"


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

    items: tuple[str, ...]
    role: str = "text"


@dataclass(frozen=True)
class Equation:
    """A displayed equation; `number` is given by `numbered`."""

    maths: Maths
    number: str = ""


@dataclass(frozen=True)
class Table:
    """A table of text.

    Attributes
    ----------
    name : str
        Unique in a document: the stem of its LaTeX file.
    caption : str
    header : tuple of str
    rows : tuple of tuple of str
    note : str
        What stands below it.
    numeric : tuple of bool
        Which columns hold numbers; by default all but the first.
    data : str
        Stem of the CSV file that has its numbers unrounded; by default a file of its own name is written as shown.
    number : str
        Given by `numbered`.
    """

    name: str
    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""
    numeric: tuple[bool, ...] = ()
    data: str = ""
    number: str = ""

    def is_numeric(self, column: int) -> bool:
        """Whether a column holds numbers."""
        return self.numeric[column] if self.numeric else column > 0


@dataclass(frozen=True)
class Picture:
    """A figure.

    Attributes
    ----------
    name : str
        Unique in a document: the stem of its files.
    caption, alt : str
        What stands below it; what it shows, for a reader who cannot see it.
    svg, png : bytes
        The contents of its files, either empty where it is left out.
    number : str
        Given by `numbered`.
    """

    name: str
    caption: str
    alt: str
    svg: bytes = b""
    png: bytes = b""
    number: str = ""


@dataclass(frozen=True)
class Chart:
    """A figure that answers: the picture where there is no script, and the numbers that a script draws it from.

    Attributes
    ----------
    picture : Picture
    data : mapping
        JSON: `x` and `y` (label, min, max; for x also start and step), `grid`, `areas` (label, low, high, tone),
        `lines` (label, x, y, tone), `points` (label, x, y, low, high), `read` (median, low, high along the grid, unit).
    """

    picture: Picture
    data: Mapping[str, Any]


@dataclass(frozen=True)
class Callout:
    """A box; `role` is ALARM (not to be trusted), CAUTION or NOTE."""

    role: str
    head: str
    lines: tuple[str, ...] = ()


@dataclass(frozen=True)
class KeyFigure:
    """One number that the reader came for."""

    label: str
    value: str
    detail: str = ""


@dataclass(frozen=True)
class KeyFigures:
    """Numbers side by side."""

    items: tuple[KeyFigure, ...]


@dataclass(frozen=True)
class Definitions:
    """Terms, each with its text."""

    pairs: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Verbatim:
    """Text as it stands in a file."""

    text: str


Block = (
    Paragraph | Heading | Listing | Equation | Table | Picture | Chart | Callout | KeyFigures | Definitions | Verbatim
)


@dataclass(frozen=True)
class Chapter:
    """A chapter; `key` is its address, `number` is given by `numbered` ("1", or "A" for an appendix)."""

    key: str
    title: str
    blocks: tuple[Block, ...]
    appendix: bool = False
    number: str = ""


@dataclass(frozen=True)
class Document:
    """A whole report.

    Attributes
    ----------
    title, about, source : str
        Heading, what sort of report it is, where the data come from.
    chapters : tuple of Chapter
        Those without a block are left out by `numbered`.
    generator : str
        Program and version.
    """

    title: str
    about: str
    source: str
    chapters: tuple[Chapter, ...]
    generator: str = ""

    def blocks(self) -> Iterator[Block]:
        """Every block, in order."""
        for chapter in self.chapters:
            yield from chapter.blocks

    def tables(self) -> tuple[Table, ...]:
        """Every table, in order."""
        return tuple(one for one in self.blocks() if isinstance(one, Table))

    def pictures(self) -> tuple[Picture, ...]:
        """Every picture, those of charts among them, in order."""
        found = [one.picture if isinstance(one, Chart) else one for one in self.blocks()]
        return tuple(one for one in found if isinstance(one, Picture))


def numbered(document: Document) -> Document:
    """Leave out what is empty, and number chapters, tables, figures and equations.

    Raises
    ------
    ValueError
        If two tables, two pictures or two chapters have one name: their files and addresses would collide.
    """
    counts = {"table": 0, "figure": 0, "equation": 0}

    def next_number(kind: str) -> str:
        counts[kind] += 1
        return str(counts[kind])

    def with_number(block: Block) -> Block:
        match block:
            case Table():
                return replace(block, number=next_number("table"))
            case Picture():
                return replace(block, number=next_number("figure"))
            case Chart():
                return replace(block, picture=replace(block.picture, number=next_number("figure")))
            case Equation():
                return replace(block, number=next_number("equation"))
            case _:
                return block

    chapters: list[Chapter] = []
    letters = iter("ABCDEFGH")
    for chapter in document.chapters:
        kept = tuple(one for one in chapter.blocks if not isinstance(one, Table) or one.rows)
        if kept:
            body = sum(not one.appendix for one in chapters)
            number = next(letters) if chapter.appendix else str(body + 1)
            chapters.append(replace(chapter, number=number, blocks=tuple(with_number(one) for one in kept)))
    found = replace(document, chapters=tuple(chapters))
    for kind, names in (
        ("tables", [one.name for one in found.tables()]),
        ("pictures", [one.name for one in found.pictures()]),
        ("chapters", [one.key for one in found.chapters]),
    ):
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"{kind} of one name: {', '.join(twice)}")
    return found
