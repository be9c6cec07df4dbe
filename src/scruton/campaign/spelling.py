"""How values, keys and numbers are spelt in a message, and how alike names are found."""

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Any


def show(value: object) -> str:
    """Show a value as TOML spells it, shortly."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"' if len(value) <= 60 else f'"{value[:57]}..."'
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {show(inner)}" for key, inner in list(value.items())[:4]) + " }"
    if isinstance(value, list):
        return "a list"
    text = str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def several(given: Any) -> tuple[Any, ...]:
    """What was given, by itself or in a sequence, as a tuple: a text is one name, not its letters; None is nothing."""
    if given is None:
        return ()
    return tuple(given) if isinstance(given, Iterable) and not isinstance(given, str) else (given,)


def figure(value: float) -> str:
    """Write a number with two digits, and without an exponent where it has up to six before the point."""
    return f"{value:.0f}" if 100.0 <= abs(value) < 1e6 else f"{value:.2g}"


def digits(value: float) -> str:
    """Write a number in full; of one that is longer than any that is meant, how long it is."""
    text = str(value)
    return text if len(text) <= 24 else f"a number of {len(text.lstrip('-'))} digits"


def nearest(word: str, known: Iterable[str]) -> str:
    """Name what is known, the nearest to `word` first: '"mass" (known: frequency, mass, name)'."""
    names = list(known)
    close = get_close_matches(word.lower(), [name.lower() for name in names], n=1, cutoff=0.5)
    listed = ", ".join(names) if len(names) <= 16 else ", ".join(names[:16]) + ", ..."
    if not close:
        return f"one of: {listed}" if names else "none"
    best = next(name for name in names if name.lower() == close[0])
    return f'"{best}"' + (f" (known: {listed})" if len(names) > 1 else "")


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Ask for the name that is nearest to `word`; list all of them where none is near."""
    names = list(known)
    near = get_close_matches(word, names, 1)
    return f"did you mean '{near[0]}'?" if near else f"one of: {', '.join(names)}"


def folded(name: str) -> str:
    """Fold case, underscores and spaces: "Wind_speed" is "wind speed"."""
    return " ".join(name.replace("_", " ").lower().split())
