"""Options of the command line, checked before any work is done."""

import math
import os
import re
from collections.abc import Callable, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from scruton.app.thresholds import EXPONENTS, LARGEST_SC, LARGEST_SEED, LONGEST_PATH, MOST
from scruton.campaign.quantity import Quantity
from scruton.campaign.spelling import digits
from scruton.dynamics.effects import CATALOGUE
from scruton.errors import InputError

AUTO = "auto"  # the effect that diagnosis finds
_GENERATOR, _HEAD = b'<meta name="generator" content="scruton', 4096  # of a page of ours, and bytes that hold it


def check_options(options: Mapping[str, Any]) -> None:
    """Refuse the first option that cannot be, whatever the verb is; those that are None or empty were not given."""
    given = {name: value if isinstance(value, list) else [value] for name, value in options.items()}
    for name, values in given.items():
        if any(isinstance(value, Path) and "\0" in str(value) for value in values):
            raise InputError("command line", name, "a path with a null character", "the path of a file or folder")
    for name, check in _CHECKS.items():
        for argument in given.get(name, []):
            if argument is not None:
                check(argument, f"--{name.replace('_', '-')}" if name != "out" else "-o")


def check_effect_name(effect: str, option: str, place: str = "command line") -> None:
    """Refuse the name of an effect that is not in the catalogue."""
    if effect == AUTO or effect in CATALOGUE:
        return
    close = [name for name in CATALOGUE if effect.lower() in name] or get_close_matches(effect, CATALOGUE, n=1)
    near = f'"{close[0]}"; ' if close else ""
    wanted = f'{near}"{AUTO}", or one of: {", ".join(CATALOGUE)}'
    raise InputError(place, option, f'"{effect}"', wanted)


def check_writable(folder: Path, option: str = "-o") -> None:
    """Refuse a folder that cannot be made or written to; nothing is made yet."""
    length = len(os.fsencode(folder.absolute()))
    if length > LONGEST_PATH:
        raise InputError(folder, option, f"a path of {length} bytes", f"one of at most {LONGEST_PATH}")
    there = next(path for path in (folder, *folder.resolve().parents) if path.exists())
    if not there.is_dir():
        raise InputError(folder, option, f"a file, {there}", "the path of a folder for the results")
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError(folder, option, f"{there}, where nothing can be written", "a folder, there or to be made")


def check_page(page: Path, option: str = "--html") -> None:
    """Refuse a file that cannot be written to, or that is there and no page of ours: a measured record, perhaps."""
    if page.is_dir() or not page.absolute().parent.is_dir():
        raise InputError("command line", option, str(page), "a file in a folder that is there, such as page.html")
    if page.exists() and not (page.is_file() and _is_ours(page)):
        wanted = "the name of a new file, or of a page that scruton wrote"
        raise InputError(page, option, "a file that is there and no page of scruton's", wanted)


def _is_ours(page: Path) -> bool:
    with page.open("rb") as stream:
        return _GENERATOR in stream.read(_HEAD)


def check_new(file: Path, option: str, *, force: bool) -> None:
    """Refuse a file that cannot be written to, or that is there where nobody said to replace it."""
    check_writable(file.parent, option)
    if file.is_dir() or (file.exists() and not force):
        raise InputError(file, option, "what is there already", "the name of a new file, or --force to replace it")


def check_numbers(option: str, text: str, count: int | None = None) -> tuple[float, ...]:
    """Read finite numbers with commas between them, `count` of them where it is given."""
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if not numbers or not all(map(math.isfinite, numbers)) or (count is not None and len(numbers) != count):
        raise InputError("command line", option, f'"{text}"', f"{count or 'some'} numbers with commas between them")
    return numbers


def numbers_of(option: str, text: str) -> list[float]:
    """Read one number, or several with commas between them; what they may be is checked with the other options."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        wanted = f"a number, or several with commas between them, such as {option} 15,40"
        raise InputError("command line", option, f'"{text}"', wanted) from None


def _whole(low: int, high: int, wanted: str) -> Callable[[int, str], None]:
    def check(value: int, option: str) -> None:
        if not low <= value <= high:
            raise InputError("command line", option, digits(value), f"a whole number, {wanted}")

    return check


def _between(low: float, high: float, example: str) -> Callable[[float, str], None]:
    def check(value: float, option: str) -> None:
        if not low <= value <= high:  # nor is NaN
            wanted = f"a number from {low:g} to {high:g}, such as {option} {example}"
            raise InputError("command line", option, f"{value:g}", wanted)

    return check


def parse_damping(text: str, option: str = "--damping", place: str = "command line") -> Quantity:
    """Read a design damping ratio: "0.003", "0.003 +/- 0.001"."""
    wanted = 'a damping ratio such as "0.003" or "0.003 +/- 0.001"'
    try:
        values = [float(part) for part in re.split(r"\s*(?:\+/-|±)\s*", text.strip())]
    except ValueError:
        raise InputError(place, option, f'"{text}"', wanted) from None
    if len(values) > 2 or not 0 < values[0] < 1 or not all(math.isfinite(value) and value >= 0 for value in values):
        raise InputError(place, option, f'"{text}"', wanted + ", between 0 and 1")
    return Quantity(values[0], values[1] if len(values) == 2 else None)


def _limit(value: str, option: str) -> None:
    from scruton.sizing.limits import limit

    limit(value, field=option)


_COUNT = _whole(1, MOST, f"one or more, up to {MOST:,}")
_CHECKS: dict[str, Callable[[Any, str], object]] = {
    "seed": _whole(0, LARGEST_SEED, f"zero or more, up to {LARGEST_SEED}"),
    "jobs": _COUNT, "cases": _COUNT,
    "sc": _between(-LARGEST_SC, LARGEST_SC, "30"), "law": _between(*EXPONENTS, "-1"),
    "effect": check_effect_name, "limit": _limit, "damping": parse_damping, "out": check_writable,
    "prior_predictive": check_writable,
}  # fmt: skip
