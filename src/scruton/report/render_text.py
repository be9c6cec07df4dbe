"""A document on the terminal: its tables laid out in columns, its paragraphs and boxes as lines."""

from collections.abc import Iterable

from scruton.report.document import Block, Callout, Code, Heading, Listing, Paragraph, Table
from scruton.report.maths import Maths


def render_text(blocks: Iterable[Block]) -> str:
    """Render blocks one below the other, an empty line between them; tables without a row are left out.

    A terminal can show paragraphs, headings, listings, boxes and tables (TypeError for any other block).
    """
    return "\n\n".join(text for block in blocks if (text := _block(block)))


def _block(block: Block) -> str:
    match block:
        case Paragraph(runs):
            texts = (
                run.latex if isinstance(run, Maths) else run.text if isinstance(run, Code) else run for run in runs
            )
            return "".join(texts)
        case Heading():
            return block.text
        case Listing():
            return "\n\n".join(f"- {item}" for item in block.items)
        case Callout():
            return "\n".join([*([block.head] if block.head else []), *(f"  ! {line}" for line in block.lines)])
        case Table():
            return "\n".join(filter(None, [block.caption, _columns(block), block.note])) if block.rows else ""
    raise TypeError(f"a terminal shows no {type(block).__name__}")


def _columns(table: Table) -> str:
    """The first column to the left, the others to the right (or all to the left), two spaces apart."""
    left = bool(table.numeric) and not any(table.numeric)
    widths = [max(map(len, cells)) for cells in zip(table.header, *table.rows, strict=True)]
    lines = [
        "  ".join(
            cell.ljust(width) if left or i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in (table.header, *table.rows)
    ]
    return "\n".join([lines[0], "  ".join("-" * width for width in widths), *lines[1:]])
