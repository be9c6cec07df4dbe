"""Results as plain text: JSON that every reader takes, CSV, and tables in columns."""

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from scruton.cells import safe_cell


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
    return json.dumps(plain(value)) if isinstance(value, dict | list | tuple) else safe_cell(value)


def plain(value: Any) -> Any:
    """Numbers that JSON has: NaN and infinities become null."""
    if isinstance(value, dict):
        return {str(key): plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def aligned(rows: Iterable[Sequence[str]]) -> str:
    """Rows of text in columns as wide as their widest cell."""
    rows = list(rows)
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return "\n".join(
        "  ".join(one.ljust(width) for one, width in zip(row, widths, strict=True)).rstrip() for row in rows
    )
