"""Options of the command line, checked before any work is done."""

import math
import os
import re
from collections.abc import Callable, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.app.thresholds import EXPONENTS, LARGEST_SC, LARGEST_SEED, LONGEST_PATH, MOST
from scruton.dynamics.effects import CATALOGUE
from scruton.errors import InputError

if TYPE_CHECKING:
    from scruton.campaign.quantity import Quantity

AUTO = "auto"  # the effect that diagnosis finds


def check_options(options: Mapping[str, Any]) -> None:
    """Refuse the first option that cannot be, whatever the verb is.

    Parameters
    ----------
    options : mapping
        By name, as the parser spells it; those that are None or empty were not given.

    Raises
    ------
    InputError
        Names the option, what was found and what is wanted.
    """
    for name, value in options.items():
        for one in value if isinstance(value, list) else [value]:
            if isinstance(one, Path) and "\0" in str(one):
                raise InputError("command line", name, "a path with a null character", "the path of a file or folder")
    for name, check in _CHECKS.items():
        value = options.get(name)
        for one in value if isinstance(value, list) else [value]:
            if one is not None:
                check(f"--{name.replace('_', '-')}" if name != "out" else "-o", one)


def check_effect_name(effect: str | None) -> None:
    """Refuse the name of an effect that is not in the catalogue."""
    if effect is None or effect == AUTO or effect in CATALOGUE:
        return
    close = [name for name in CATALOGUE if effect.lower() in name] or get_close_matches(effect, CATALOGUE, n=1)
    near = f'"{close[0]}"; ' if close else ""
    wanted = f'{near}"{AUTO}", or one of: {", ".join(CATALOGUE)}'
    raise InputError("command line", "--effect", f'"{effect}"', wanted)


def check_writable(folder: Path, option: str = "-o") -> None:
    """Refuse a folder that cannot be made or written to; nothing is made yet."""
    length = len(os.fsencode(folder.absolute()))
    if length > LONGEST_PATH:
        raise InputError(folder, option, f"a path of {length} bytes", f"one of at most {LONGEST_PATH}")
    there = next(one for one in (folder, *folder.resolve().parents) if one.exists())
    if not there.is_dir():
        raise InputError(folder, option, f"a file, {there}", "the path of a folder for the results")
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError(folder, option, f"{there}, where nothing can be written", "a folder, there or to be made")


def check_numbers(option: str, text: str, count: int | None = None) -> tuple[float, ...]:
    """Read finite numbers with commas between them, `count` of them where it is given."""
    try:
        found = tuple(float(one) for one in text.split(","))
    except ValueError:
        found = ()
    if not found or not all(map(math.isfinite, found)) or (count is not None and len(found) != count):
        raise InputError("command line", option, f'"{text}"', f"{count or 'some'} numbers with commas between them")
    return found


def _seed(option: str, value: int) -> None:
    if not 0 <= value <= LARGEST_SEED:
        raise InputError("command line", option, _short(value), f"a whole number, zero or more, up to {LARGEST_SEED}")


def _count(option: str, value: int) -> None:
    if not 1 <= value <= MOST:
        raise InputError("command line", option, _short(value), f"a whole number, one or more, up to {MOST:,}")


def _short(value: int) -> str:
    text = str(value)
    return text if len(text) <= 24 else f"a number of {len(text.lstrip('-'))} digits"


def _between(low: float, high: float, example: str) -> Callable[[str, float], None]:
    def check(option: str, value: float) -> None:
        if not low <= value <= high:  # nor is NaN
            wanted = f"a number from {low:g} to {high:g}, such as {option} {example}"
            raise InputError("command line", option, f"{value:g}", wanted)

    return check


def parse_damping(text: str) -> "Quantity":
    """Read a design damping ratio from the command line: "0.003", "0.003 +/- 0.001"."""
    from scruton.campaign.quantity import Quantity

    wanted = 'a damping ratio such as "0.003" or "0.003 +/- 0.001"'
    try:
        values = [float(part) for part in re.split(r"\s*(?:\+/-|±)\s*", text.strip())]
    except ValueError:
        raise InputError("command line", "--damping", f'"{text}"', wanted) from None
    if len(values) > 2 or not 0 < values[0] < 1 or not all(math.isfinite(one) and one >= 0 for one in values):
        raise InputError("command line", "--damping", f'"{text}"', wanted + ", between 0 and 1")
    return Quantity(values[0], values[1] if len(values) == 2 else None)


def _effect(_option: str, value: str) -> None:
    check_effect_name(value)


def _limit(option: str, value: str) -> None:
    from scruton.sizing.limits import limit

    limit(value, field=option)


def _damping(_option: str, value: str) -> None:
    parse_damping(value)


def _folder(option: str, value: Path) -> None:
    check_writable(value, option)


_CHECKS: dict[str, Callable[[str, Any], None]] = {
    "seed": _seed, "jobs": _count, "workers": _count, "cases": _count,
    "sc": _between(-LARGEST_SC, LARGEST_SC, "30"), "law": _between(*EXPONENTS, "-1"),
    "effect": _effect, "limit": _limit, "damping": _damping, "out": _folder, "prior_predictive": _folder,
}  # fmt: skip
