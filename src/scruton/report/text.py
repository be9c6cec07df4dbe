"""Plain tables for the terminal."""

from collections.abc import Sequence

import numpy as np


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Lay out columns: the first to the left, the others to the right, two spaces apart."""
    lines = [list(header), *[list(row) for row in rows]]
    widths = [max(len(line[i]) for line in lines) for i in range(len(header))]

    def join(line: Sequence[str]) -> str:
        cells = [line[0].ljust(widths[0])] + [
            cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True)
        ]
        return "  ".join(cells).rstrip()

    rule = "  ".join("-" * width for width in widths)
    return "\n".join([join(lines[0]), rule, *map(join, lines[1:])])


def number(value: float | None, digits: int = 4) -> str:
    """Write a number with significant digits, a dash for one that is missing."""
    if value is None or not np.isfinite(value):
        return "-"
    return f"{value:.{digits}g}"


def bullets(lines: Sequence[str]) -> str:
    """One line each, marked."""
    return "\n".join(f"  ! {line}" for line in lines)
