"""A document on the terminal: its tables laid out in columns, its paragraphs and boxes as lines."""

from collections.abc import Iterable

from scruton.cells import columns, wrapped
from scruton.report.document import Block, Callout, Code, Heading, Listing, Paragraph, Table
from scruton.report.maths import Maths


def render_text(blocks: Iterable[Block], width: int | None = None) -> str:
    """Render blocks one below the other, an empty line between them; tables without a row are left out.

    Lines are broken between words where they are longer than `width` letters, and tables fitted; without it, they are
    as long as they come.

    A terminal can show paragraphs, headings, listings, boxes and tables (TypeError for any other block).
    """
    return "\n\n".join(text for block in blocks if (text := _block(block, width)))


def _block(block: Block, width: int | None) -> str:
    match block:
        case Paragraph(runs):
            texts = (
                run.latex if isinstance(run, Maths) else run.text if isinstance(run, Code) else run for run in runs
            )
            return wrapped("".join(texts), width)
        case Heading():
            return wrapped(block.text, width)
        case Listing():
            return "\n\n".join(wrapped(f"- {item}", width, "  ") for item in block.items)
        case Callout():
            lines = (wrapped(f"  ! {line}", width, "    ") for line in block.lines)
            return "\n".join([*([wrapped(block.head, width)] if block.head else []), *lines])
        case Table():
            caption, note = wrapped(block.caption, width), wrapped(block.note, width)
            return "\n".join(filter(None, [caption, _columns(block, width), note])) if block.rows else ""
    raise TypeError(f"a terminal shows no {type(block).__name__}")


def _columns(table: Table, width: int | None) -> str:
    """The first column to the left, the others to the right (or all to the left)."""
    every = bool(table.numeric) and not any(table.numeric)
    return columns(table.header, table.rows, [every or i == 0 for i in range(len(table.header))], width)
