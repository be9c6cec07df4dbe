"""A document on the terminal: its tables laid out in columns, its paragraphs and boxes as lines."""

from collections.abc import Iterable, Sequence

from scruton.report.document import Block, Callout, Code, Heading, Listing, Paragraph, Run, Table
from scruton.report.maths import Maths


def render_text(blocks: Iterable[Block]) -> str:
    """Render blocks one below the other, an empty line between them; tables without a row are left out.

    Parameters
    ----------
    blocks : iterable of Block
        Those that a terminal can show: paragraphs, headings, listings, boxes and tables.

    Raises
    ------
    TypeError
        For a block that it cannot show.
    """
    return "\n\n".join(text for block in blocks if (text := _block(block)))


def _block(block: Block) -> str:
    match block:
        case Paragraph():
            return "".join(map(_run, block.runs))
        case Heading():
            return block.text
        case Listing():
            return "\n\n".join(f"- {item}" for item in block.items)
        case Callout():
            return "\n".join([*([block.head] if block.head else []), *(f"  ! {line}" for line in block.lines)])
        case Table():
            if not block.rows:
                return ""
            left = bool(block.numeric) and not any(block.numeric)
            lines = [block.caption, table(block.header, block.rows, left=left), block.note]
            return "\n".join(filter(None, lines))
    raise TypeError(f"a terminal shows no {type(block).__name__}")


def _run(run: Run) -> str:
    match run:
        case Maths():
            return run.latex
        case Code():
            return run.text
    return run


def table(header: Sequence[str], rows: Sequence[Sequence[str]], *, left: bool = False) -> str:
    """Lay out columns: the first to the left, the others to the right (or all to the `left`), two spaces apart."""
    lines = [list(header), *[list(row) for row in rows]]
    widths = [max(len(line[i]) for line in lines) for i in range(len(header))]

    def join(line: Sequence[str]) -> str:
        cells = [
            cell.ljust(width) if left or i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(line, widths, strict=True))
        ]
        return "  ".join(cells).rstrip()

    rule = "  ".join("-" * width for width in widths)
    return "\n".join([join(lines[0]), rule, *map(join, lines[1:])])
