"""Tables as text: columns; CSV, where text that a spreadsheet would take for a formula is quoted, as OWASP advises."""

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from scruton.documents import as_json

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


def aligned(rows: Iterable[Sequence[str]]) -> str:
    """Rows of text in columns as wide as their widest cell."""
    rows = list(rows)
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join("  ".join(map(str.ljust, row, widths)).rstrip() for row in rows)
