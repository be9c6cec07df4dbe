"""Cells of CSV files: text that a spreadsheet would take for a formula is quoted, as OWASP advises."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

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
