"""What numbers in JSON must be."""

import json
import math
from typing import Any


def _constant(name: str) -> float:
    raise ValueError(f"{name} in JSON")


def finite_json(text: str) -> str:
    """Say what is wrong with JSON: it cannot be read, or holds numbers that are none."""
    try:
        content = json.loads(text, parse_constant=_constant)
    except ValueError as error:
        return f"JSON that cannot be read\n{error}"
    bad = _bad(content, "")
    return f"numbers in JSON that are none\n{bad}" if bad else ""


def _bad(value: Any, at: str) -> str:
    if isinstance(value, float) and not math.isfinite(value):
        return at
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return next((found for key, one in items if (found := _bad(one, f"{at}.{key}"))), "")
