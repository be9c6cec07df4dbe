"""Values as they are kept: rounded, long arrays summarised, texts by their lines; and how two of them are compared."""

import hashlib
import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from llvmlite.binding import get_host_cpu_name

LONGEST = 12  # numbers that are kept one by one
DIGITS = 10
WIDTH = 160  # of a line of a golden file


def rounded(value: float, digits: int = DIGITS) -> Any:
    """Round to significant digits; what JSON has no number for becomes its name."""
    if not math.isfinite(value):
        return str(value)
    return float(f"{value:.{digits}g}")


def kept(value: Any, digits: int = DIGITS) -> Any:
    """Shorten a value to what a golden keeps of it."""
    if isinstance(value, dict):
        return {str(k): kept(v, digits) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        numbers = flat_numbers(value)
        if numbers is not None and numbers.size > LONGEST:
            return summary(numbers, np.shape(value), digits)
        return [kept(one, digits) for one in value]
    if isinstance(value, str):
        lines = value.splitlines()
        return [one.rstrip() for one in lines] if len(lines) > 1 else value
    return rounded(value, digits) if isinstance(value, float) else value


def flat_numbers(value: list[Any] | tuple[Any, ...]) -> np.ndarray | None:
    """Return the numbers of a list, or of lists of one length; None is NaN, anything else is none of our business."""
    try:
        found = np.array(value, dtype=object)
    except ValueError:  # ragged
        return None
    if not all(one is None or (isinstance(one, (int, float)) and not isinstance(one, bool)) for one in found.flat):
        return None
    return np.array([math.nan if one is None else one for one in found.flat], dtype=float)


def summary(numbers: np.ndarray, shape: tuple[int, ...], digits: int = DIGITS) -> dict[str, Any]:
    """Keep what moves when an array moves."""
    finite = numbers[np.isfinite(numbers)]
    found: dict[str, Any] = {"shape": list(shape), "not finite": int(numbers.size - finite.size)}
    if finite.size:
        values = {
            "min": finite.min(),
            "max": finite.max(),
            "mean": finite.mean(),
            "first": finite[0],
            "last": finite[-1],
        }
        found |= {name: rounded(float(value), digits) for name, value in values.items()}
    return found


def arithmetic() -> str:
    """Tell machines apart that round in another order or by other instructions: a sampler's draws go other ways there.

    Linear algebra, numpy's functions and compiled code: each has instructions of its own on another processor, the last
    those of its name.
    """
    a = np.sin(np.arange(120.0 * 120.0)).reshape(120, 120)
    parts = [a @ a.T, a @ a[0], np.linalg.cholesky(a @ a.T + 120.0 * np.eye(120)), np.linalg.solve(a + np.eye(120), a)]
    parts += [function(1.5 + a) for function in (np.exp, np.log, np.tanh, np.cos, np.arctan, np.cumsum, np.square)]
    parts += [np.einsum("ij,kj->ik", a, a), a.sum(axis=0), np.fft.rfft(a)]
    numbers = b"".join(one.tobytes() for one in parts)
    return hashlib.sha256(numbers + get_host_cpu_name().encode()).hexdigest()[:16]


def form(value: Any) -> Any:
    """Leave of a value what no rounding changes: its structure, and its texts without their numbers and columns."""
    if isinstance(value, dict):
        return {key: form(one) for key, one in value.items()}
    if isinstance(value, list):
        return [form(one) for one in value]
    if isinstance(value, str):
        ruled = re.sub(r"-{2,}", "--", value)  # the lines under the headings of a table are as wide as its numbers
        return " ".join(re.sub(r"[-+]?\d[\d.]*(e[-+]?\d+)?", "#", ruled).split())
    return "#" if isinstance(value, (int, float)) and not isinstance(value, bool) else value


def leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """List every leaf with its path."""
    if isinstance(value, dict) and value:
        for key, one in value.items():
            yield from leaves(one, f"{path}/{key}")
    elif isinstance(value, list) and value:
        for i, one in enumerate(value):
            yield from leaves(one, f"{path}[{i}]")
    else:
        yield path, value


def same(wanted: Any, found: Any, rtol: float, atol: float) -> bool:
    """Compare numbers to within a tolerance, everything else exactly."""
    if all(isinstance(one, (int, float)) and not isinstance(one, bool) for one in (wanted, found)):
        return math.isclose(wanted, found, rel_tol=rtol, abs_tol=atol)
    return type(wanted) is type(found) and bool(wanted == found)


def differences(wanted: Any, found: Any, rtol: float, atol: float) -> list[str]:
    """List the leaves that differ: where, what was wanted, what was found."""
    old, new = dict(leaves(wanted)), dict(leaves(found))
    missing = "(nothing)"

    def absolute(path: str) -> float:
        """The mean of what nearly cancels has no digits of its own: those of the extremes count."""
        extremes = [old.get(f"{path.removesuffix('/mean')}/{one}") for one in ("min", "max")]
        sizes = [abs(one) for one in extremes if path.endswith("/mean") and isinstance(one, (int, float))]
        return max(atol, *(rtol * one for one in sizes), 0.0)

    return [
        f"{path}: wanted {_told(old.get(path, missing))}, found {_told(new.get(path, missing))}"
        for path in old | new
        if path not in old or path not in new or not same(old[path], new[path], rtol, absolute(path))
    ]


def _told(value: Any) -> str:
    return value if value == "(nothing)" else json.dumps(value, ensure_ascii=False)


def spelled(value: Any, indent: int = 0) -> str:
    """Spell JSON with a line for each group of leaves that fits into one."""
    line = json.dumps(value, ensure_ascii=False)
    if len(line) + indent <= WIDTH or not isinstance(value, (dict, list)) or not value:
        return line
    inner = " " * (indent + 1)
    if isinstance(value, dict):
        rows = [f"{inner}{json.dumps(k, ensure_ascii=False)}: {spelled(v, indent + 1)}" for k, v in value.items()]
        return "{\n" + ",\n".join(rows) + "\n" + " " * indent + "}"
    return "[\n" + ",\n".join(inner + spelled(v, indent + 1) for v in value) + "\n" + " " * indent + "]"


def store(path: Path, value: Any) -> None:
    """Write a golden file."""
    path.write_text(spelled(value) + "\n", encoding="utf-8")


def load(path: Path) -> Any:
    """Read a golden file."""
    return json.loads(path.read_text(encoding="utf-8"))
