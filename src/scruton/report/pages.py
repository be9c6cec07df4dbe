"""Where the blocks of a document stand on paper: pictures a little smaller or a little later, pages nearly full.

A picture that no longer fits would leave the rest of its page empty; a typesetter's floats fill it with text, but take
pictures into other chapters.  Here each stays in its section: blocks are measured, and of the ways to break them into
pages the cheapest is taken, by a search that keeps the best few.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from heapq import nsmallest
from itertools import pairwise
from typing import NamedTuple

from scruton.report.document import Block, Callout, Document, Equation, Heading, KeyFigures, Picture, Table
from scruton.report.thresholds import (
    BLOCKS_WAITING,
    EMPTY_PAGE,
    FEW_ROWS,
    LONG_CALLOUT,
    MARGIN,
    PAGE_HEIGHT,
    PAGES_KEPT,
    PICTURE_SCALES,
    SHORT_TABLE,
)

HEADING, CONTENTS = -1, -2  # in the place of a block's index: what begins a chapter, and what follows the first one
_SPLIT = 40.0  # pt that a block leaves at least on either page
_HEADER = 26.0  # pt of a table's header
# What is paid for a page; for what of it is empty, and a picture that is smaller, by their squares; for each block that
# comes after a picture, or before, out of its order; for a table of few rows that breaks; for what must not be.
_PAGE, _EMPTY, _SMALLER, _AFTER, _BEFORE, _BROKEN, _NEVER = 1.0, 30.0, 40.0, 2.0, 0.3, 3.0, 1e3
# For a part that does not begin a page, and a first chapter, which is the decision, that takes more than one.
_PART, _FIRST = 20.0, 20.0

Mark = Sequence[float] | float  # chapter, block and pt from the top, all below one another; pt of a drawing behind it
Step = tuple[int, float, bool]  # block, scale, and whether a page begins with it


class _Item(NamedTuple):
    chapter: int
    block: int
    top: float  # pt, where it begins on the page without an end
    height: float  # pt, with the space below it
    kind: str  # "heading", "whole", "flowing" or "picture"
    drawing: float = 0.0  # pt of a picture that a scale makes smaller
    header: float = 0.0  # pt of a table that every page repeats
    torn: float = 0.0  # what it costs to break it
    part: bool = False  # whether it begins a part, and a page where that leaves none too empty


@dataclass(frozen=True)
class _State:
    """Items so far on paper: what they cost, where the last page ends, and what waits."""

    cost: float = 0.0
    y: float = 0.0
    following: int = 0
    waiting: tuple[int, ...] = ()
    held: bool = False  # by a heading, which does not end a page
    last: "tuple[_Item, Step] | None" = None
    before: "_State | None" = None


def arranged(document: Document, marks: Sequence[Mark]) -> list[list[Step]]:
    """Break a document into pages.

    Parameters
    ----------
    document : Document
    marks : sequence of (chapter, block, pt) and of pt
        Where each block begins, all below one another on a page without an end: of each chapter its `HEADING`, its
        blocks and `CONTENTS`, which stands for what follows them.  Behind that of a picture, how high its drawing is.

    Returns
    -------
    list of list of (block, scale, bool)
        Of every chapter its `HEADING` and its blocks in their order on paper.
    """
    items = list(_items(document, marks))
    layer = [_State(y=items[0].top - MARGIN if items else 0.0)]
    for _ in items:
        best: dict[tuple[int, tuple[int, ...], bool, int], _State] = {}
        for state in layer:
            for one in _ways(items, state):
                key = (one.following, one.waiting, one.held, round(one.y / 6.0))
                if key not in best or one.cost < best[key].cost:
                    best[key] = one
        layer = nsmallest(PAGES_KEPT, best.values(), key=lambda one: one.cost)
    result: list[list[Step]] = [[] for _ in document.chapters]
    at: _State | None = layer[0]
    while at is not None and at.last is not None:
        item, step = at.last
        if item.block != CONTENTS:
            result[item.chapter].insert(0, step)
        at = at.before
    return result


def _beginnings(marks: Sequence[Mark]) -> list[tuple[int, int, float, float]]:
    """Chapter, block, pt from the top, and pt of the drawing of every mark."""
    found: list[tuple[int, int, float, float]] = []
    for mark in marks:
        if isinstance(mark, int | float):
            chapter, block, y, _ = found[-1]
            found[-1] = chapter, block, y, float(mark)
        else:
            found.append((int(mark[0]), int(mark[1]), float(mark[2]), 0.0))
    return found


def _items(document: Document, marks: Sequence[Mark]) -> Iterator[_Item]:
    for (chapter, index, y, drawing), (_, _, end, _) in pairwise(_beginnings(marks)):
        of = document.chapters[chapter]
        if index == HEADING:
            yield _Item(chapter, index, y, end - y, "heading", part=bool(of.part) and chapter > 0)
        elif index != CONTENTS:
            block, header, torn = of.blocks[index], 0.0, 0.0
            if isinstance(block, Table):
                header, torn = _HEADER, _BROKEN if len(block.rows) <= FEW_ROWS else 0.0
            torn = max(torn, _FIRST * (chapter == 0))
            yield _Item(chapter, index, y, end - y, _kind(block), drawing, header, torn)
        elif end > y:
            yield _Item(chapter, index, y, end - y, "whole")


def _kind(block: Block) -> str:
    """How a block breaks, as the template has it."""
    match block:
        case Heading():
            return "heading"
        case Picture():
            return "picture"
        case Equation() | KeyFigures():
            return "whole"
        case Table() if len(block.rows) <= SHORT_TABLE:
            return "whole"
        case Callout() if sum(len(run) for line in block.lines for run in line if isinstance(run, str)) <= LONG_CALLOUT:
            return "whole"
    return "flowing"


def _ways(items: Sequence[_Item], state: _State) -> Iterator[_State]:
    """Every way to put one more item on paper.

    Below the first chapter pictures may wait for what follows them in their section, or go before what precedes them.
    """
    here, waiting = state.following, state.waiting
    if waiting:
        yield from _placed(items[waiting[0]], state, here, waiting[1:])
    elif here < len(items):
        yield from _placed(items[here], state, here + 1, ())
    if here == len(items) or items[here].chapter == 0:
        return
    ahead = here
    while ahead < len(items) and items[ahead].kind == "picture":
        ahead += 1
    later = (*waiting, *range(here, ahead))
    pictures = all(items[one].kind == "picture" for one in later)
    if pictures and 0 < len(later) <= BLOCKS_WAITING and ahead < len(items) and items[ahead].kind != "heading":
        yield from _placed(items[ahead], state, ahead + 1, later, _BEFORE * len(later))
    for ahead in range(here + 1, min(here + BLOCKS_WAITING + 1, len(items))):
        if waiting or items[ahead - 1].kind in ("heading", "picture"):
            break
        if items[ahead].kind == "picture":
            yield from _placed(items[ahead], state, ahead + 1, tuple(range(here, ahead)), _AFTER * (ahead - here))


def _placed(
    item: _Item, state: _State, following: int, waiting: tuple[int, ...], turned: float = 0.0
) -> Iterator[_State]:
    """Every way to put this one there: on the page that is begun, or on a new one, at any scale; `turned` is paid."""
    for scale in PICTURE_SCALES if item.kind == "picture" else (1.0,):
        height = item.height - (1.0 - scale) * item.drawing
        cost = state.cost + turned + _SMALLER * (1.0 - scale) ** 2
        for fresh in (False, True):
            y = (0.0 if fresh else state.y) + height
            if not fresh and not _goes_on(item, y, height):
                continue
            paid = cost + (_PAGE + _ended(state) if fresh else _PART * item.part)
            paid += _FIRST * (fresh and item.chapter == 0 and item.block != CONTENTS)
            while y > PAGE_HEIGHT:
                y -= PAGE_HEIGHT - item.header
                paid += _PAGE + item.torn
            last = (item, (item.block, scale, fresh))
            yield _State(paid, y, following, waiting, item.kind == "heading", last, state)


def _goes_on(item: _Item, y: float, height: float) -> bool:
    """Whether a block that would end at `y` may begin on the page that is begun."""
    breaks = item.kind == "flowing" or height > PAGE_HEIGHT
    return y <= PAGE_HEIGHT or (breaks and PAGE_HEIGHT - (y - height) >= _SPLIT)


def _ended(state: _State) -> float:
    """What it costs to end a page here."""
    empty = max(0.0, 1.0 - state.y / PAGE_HEIGHT)
    return _EMPTY * empty**2 + _NEVER * (max(0.0, empty - EMPTY_PAGE) + state.held)
