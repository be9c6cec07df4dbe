"""What differs from run to run or from machine to machine, and is therefore not frozen."""

import re
from typing import Any

PLACEHOLDER = "<volatile>"

# Whole leaves (and what lies below them), by the name of their key.
KEYS = re.compile(r"^(versions|scruton|python|created|started|ended|seconds|duration_s|elapsed|.*sha256)$")

# Parts of texts.
PATTERNS: tuple[tuple[re.Pattern[str], str], ...] = (
    (re.compile(r"\b[0-9a-f]{64}\b"), "<sha256>"),
    (re.compile(r"\b\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d(\.\d+)?)?(Z|[+-]\d\d:?\d\d)?"), "<moment>"),
    (
        re.compile(r"\b(Python|python|scruton|numpy|emcee|arviz|numba|scipy|xarray|netCDF4) \d+(\.\w+)+"),
        r"\1 <version>",
    ),
    (re.compile(r"\b\d+(\.\d+)? ?(s|min|seconds|minutes) (of computing|of work|wall time)"), "<duration>"),
    (re.compile(r"\bprocess \d+\b"), "process <pid>"),
    (re.compile(r"(seconds a campaign, one( process \(median\))?) .*"), r"\1 <durations>"),
)


# Rows of tables that are of times, by their first cell or their entry "figure".
ROWS = re.compile(r"^seconds ")


def mask(text: str, room: str = "") -> str:
    """Replace what is volatile in a text, and the folder of the run where it is given."""
    if room:
        text = text.replace(room, "<room>")
    for pattern, instead in PATTERNS:
        text = pattern.sub(instead, text)
    return text


def masked(value: Any, room: str = "") -> Any:
    """Replace what is volatile in the content of a JSON file."""
    if isinstance(value, dict):
        if ROWS.match(str(value.get("figure"))):
            return PLACEHOLDER
        return {k: PLACEHOLDER if KEYS.match(k) else masked(v, room) for k, v in value.items()}
    if isinstance(value, list):
        return [masked(one, room) for one in value]
    return mask(value, room) if isinstance(value, str) else value
