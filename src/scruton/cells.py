"""Tables as text: columns; CSV, where text that a spreadsheet would take for a formula is quoted, as OWASP advises."""

import csv
import io
import json
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from scruton.documents import as_json

if TYPE_CHECKING:
    import pandas as pd

GAP = "  "  # between columns
PROSE = 20  # letters: a cell of several words that is longer may be broken between them
_COMMANDS = ("=", "+", "-", "@", "\t", "\r", "\n")  # a text that begins so is a formula to a spreadsheet


def safe_cell(value: Any) -> Any:
    """Put an apostrophe before a text that begins like a formula; numbers, also as text, and a lone dash stay.

    >>> safe_cell("=HYPERLINK(1)"), safe_cell("-0.31"), safe_cell("-"), safe_cell(-0.31)
    ("'=HYPERLINK(1)", '-0.31', '-', -0.31)
    """
    if not isinstance(value, str) or not value.startswith(_COMMANDS) or value == "-":
        return value
    try:
        float(value)
    except ValueError:
        return f"'{value}"
    return value


def safe_frame(frame: "pd.DataFrame") -> "pd.DataFrame":
    """A copy of a frame whose headings and texts are safe cells."""
    return frame.map(safe_cell).rename(columns=safe_cell)


def csv_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """Rows as CSV under their keys; six significant digits, nested values as JSON."""
    if not rows:
        return ""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: _cell(value) for key, value in row.items()} for row in rows)
    return text.getvalue()


def _cell(value: Any) -> Any:
    if isinstance(value, float):
        return f"{value:.6g}"
    return json.dumps(as_json(value)) if isinstance(value, dict | list | tuple) else safe_cell(value)


def wrapped(text: str, width: int | None, indent: str = "") -> str:
    """Break the lines of a text between words; those that follow in the place of one are indented."""
    if width is None:
        return text
    return "\n".join(
        textwrap.fill(line, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
        if len(line) > width else line
        for line in text.split("\n")
    )  # fmt: skip


def aligned(rows: Iterable[Sequence[str]], width: int | None = None) -> str:
    """Rows of text, the first of them the header, in columns to the left; `width` as of `columns`."""
    header, *others = rows
    return columns(header, others, [True] * len(header), width, rule=False)


def columns(
    header: Sequence[str], rows: Sequence[Sequence[str]], left: Sequence[bool], width: int | None = None, *,
    rule: bool = True,
) -> str:  # fmt: skip
    """Lay a table out in columns as wide as their widest cell, two spaces apart.

    Parameters
    ----------
    header, rows : sequences of str
    left : sequence of bool
        Which columns stand to the left; the others to the right.
    width : int, optional
        Letters of a line. A wider table has its headings and long cells broken between words; where that is not
        enough it is cut into parts that stand one below the other, each with the first column: nothing is dropped.
    rule : bool
        Underline the header.
    """
    cells = list(zip(header, *rows, strict=True))
    full = [max(map(len, column)) for column in cells]
    if width is None or sum(full) + len(GAP) * (len(full) - 1) <= width:
        return _laid(cells, full, left, rule)
    half = (width - len(GAP)) // 2
    least = [min(half, max(_longest_word(head), *map(_least, below), 0)) for head, *below in cells]
    texts = []
    for part in _parts(least, width):
        wide = [full[i] for i in part]
        while sum(wide) + len(GAP) * (len(wide) - 1) > width:
            widest = max((i for i in range(len(part)) if wide[i] > least[part[i]]), key=lambda i: wide[i])
            wide[widest] -= 1
        texts.append(_laid([cells[i] for i in part], wide, [left[i] for i in part], rule))
    return "\n\n".join(texts)


def _least(cell: str) -> int:
    return _longest_word(cell) if len(cell) > PROSE else len(cell)


def _longest_word(text: str) -> int:
    return max(map(len, text.split()), default=0)


def _parts(least: Sequence[int], width: int) -> list[list[int]]:
    """Which columns stand side by side: the first in every part, and as many of the others as there is room for."""
    parts = [[0]]
    for i in range(1, len(least)):
        if sum(least[k] for k in parts[-1]) + least[i] + len(GAP) * len(parts[-1]) > width and len(parts[-1]) > 1:
            parts.append([0])
        parts[-1].append(i)
    return parts


def _laid(cells: Sequence[Sequence[str]], widths: Sequence[int], left: Sequence[bool], rule: bool) -> str:
    """Columns of cells, each cell on as many lines as its column's width asks for; headings stand on the rule."""
    lines = []
    for number, row in enumerate(zip(*cells, strict=True)):
        broken = [
            textwrap.wrap(cell, wide) if len(cell) > wide else [cell] for cell, wide in zip(row, widths, strict=True)
        ]
        depth = max(map(len, broken))
        spare = [[""] * (depth - len(cell)) for cell in broken]
        stacks = [
            [*above, *cell] if number == 0 else [*cell, *above] for cell, above in zip(broken, spare, strict=True)
        ]
        for line in zip(*stacks, strict=True):
            fitted = zip(line, widths, left, strict=True)
            lines.append(
                GAP.join(text.ljust(wide) if ahead else text.rjust(wide) for text, wide, ahead in fitted).rstrip()
            )
        if rule and number == 0:
            lines.append(GAP.join("-" * wide for wide in widths))
    return "\n".join(lines)
