"""How quantities are shown: amplitudes in degrees and mm, damping and Scruton numbers as `[report]` of a campaign asks.

Files hold A/D, radians, metres, damping ratios and the paper's Scruton number, whatever is shown.
"""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Concatenate

from scruton import said
from scruton.dynamics.effects.effect import FACTOR, TENTHS
from scruton.report.wording import PARAMETERS, number, stated, to_error, unit_text, with_error

if TYPE_CHECKING:
    from scruton.report.document import Block

DAMPING, SCRUTON = "damping ratio", "Sc"  # what `shown_in` takes for a unit, beside units
_FIXED = {"rad": (180.0 / math.pi, "deg"), "m": (1e3, "mm"), "1/rad": (math.pi / 180.0, "1/deg")}
_IN_FORCE: ContextVar[Mapping[str, Any]] = ContextVar("conventions", default=MappingProxyType({}))


@contextmanager
def conventions(of: Any) -> Iterator[None]:
    """Show numbers within by what `[report]` says, of results: a fit, a campaign, the content of fit or sizing.json.

    Within results of another sort those stay in force that are.
    """
    found = getattr(of, "summary", of)
    if not isinstance(found, Mapping):
        found = {"conventions": getattr(of, "conventions", _IN_FORCE.get())}
    token = _IN_FORCE.set(found.get("conventions") or {})
    try:
        yield
    finally:
        _IN_FORCE.reset(token)


def by_conventions[First, **Others](
    write: "Callable[Concatenate[First, Others], Iterable[Block]]",
) -> "Callable[Concatenate[First, Others], list[Block]]":
    """Make the blocks of a function by the conventions of its first argument."""

    @wraps(write)
    def written(first: First, /, *others: Others.args, **settings: Others.kwargs) -> "list[Block]":
        with conventions(first):
            return list(write(first, *others, **settings))

    return written


def shown_in(unit: str) -> tuple[float, str]:
    """Factor and unit by which a quantity is shown that files hold in this unit: the one place that knows.

    Radians are shown in degrees, metres of amplitude in mm, a `DAMPING` ratio in per cent or as logarithmic decrement,
    a Scruton number, `SCRUTON`, by the paper's or the Eurocode's definition.
    """
    if unit == DAMPING:
        return (2.0 * math.pi, "") if decrements() else (100.0, "%")
    if unit == SCRUTON:
        return float(_IN_FORCE.get().get("scruton_factor", 1.0)), ""
    return _FIXED.get(unit, (1.0, unit))


def shown_excess(quantity: str, unit: str) -> tuple[float, str]:
    """Factor and unit by which the excess of a place in gap.json is shown, `unit` being that of amplitudes.

    Damping as it is, a line's amplitude as amplitudes are, shares in per cent; others are plain numbers.
    """
    if quantity in ("frequency", "signal"):
        return 100.0, "%"
    kinds = {"damping": DAMPING, "branch": DAMPING, "test": DAMPING, "spectrum": unit}
    return shown_in(kinds[quantity]) if quantity in kinds else (1.0, "")


def shown_size(size: Mapping[str, Any]) -> tuple[float, float | None, float | None, str]:
    """Median, 5 and 95 % and unit of a parameter of an effect, from gap.json, as a person would write them.

    A logarithm of a factor is shown as a change in per cent, as are tenths of a frequency.
    """
    ends = [size["median"], *(size["interval90"] or (None, None))]
    factor, unit = shown_in(size["unit"])
    if size["unit"] == FACTOR:
        ends, factor, unit = [None if end is None else math.expm1(end) for end in ends], 100.0, "%"
    elif size["unit"] == TENTHS:
        factor, unit = 10.0, "% of the frequency"
    median, low, high = (None if end is None else factor * end for end in ends)
    return median or 0.0, low, high, unit


def decrements() -> bool:
    """Whether damping is shown as logarithmic decrement, 2 pi times its ratio."""
    return _IN_FORCE.get().get("damping") == "decrement"


def damping_words() -> str:
    """What damping is called as it is shown."""
    return "logarithmic decrement" if decrements() else "damping ratio"


def damping_symbol() -> str:
    """Its symbol, structural."""
    return "δₛ" if decrements() else "ξₛ"


def parameter_unit(parameter: str, unit: str) -> str:
    """What `shown_in` takes for the unit of a parameter, which files hold in this one."""
    return {
        "damping_ratio": DAMPING, "scruton_number": SCRUTON, "relaxation_scruton_number": SCRUTON,
        "mass_damping_factor": SCRUTON,
    }.get(parameter, unit)  # fmt: skip


def parameter_words(parameter: str) -> str:
    """What a parameter of a posterior, or "PARAMETER of TEST", is called as it is shown."""
    name, *test = parameter.split(" of ", 1)
    words = PARAMETERS.get(name, name.replace("_", " "))
    if name == "damping_ratio":
        words = f"structural {damping_words()} {damping_symbol()}"
    return " of ".join([words, *test])


def damping_label(words: str = "damping ratio") -> str:
    """A heading, or the label of an axis, that speaks of damping, with the unit that it is shown in."""
    if not decrements():
        return f"{words} [%]"
    return re.sub("(d)amping( ratio)?", lambda found: f"{found[1]}ecrement", words, flags=re.IGNORECASE) + " [-]"


def damping(value: float | None, digits: int = 3, error: float | None = None) -> str:
    """Write a damping ratio as it is shown, with its unit; to the digits that a standard error leaves it."""
    factor, unit = shown_in(DAMPING)
    if value and error:
        return to_error(factor * value, factor * error) + (f" {unit}" if unit else "")
    return number(None if value is None else factor * value, digits) + (f" {unit}" if unit else "")


def amplitude(value: float | None, unit: str, digits: int = 3) -> str:
    """Write an amplitude that files hold in a unit, as it is shown, with its unit; None is one that nothing bounds."""
    if value is None:
        return "no bound"
    factor, shown = shown_in(unit)
    return with_unit(number(factor * value, digits), shown)


def with_unit(text: str, unit: str) -> str:
    """A number with its unit: degrees stand without a gap."""
    sign = unit_text(unit)
    return text if not sign else f"{text}{sign}" if sign == "°" else f"{text} {sign}"


def known_to(text: str, value: float | None, error: float | None, shown: tuple[float, str]) -> str:
    """What is written of a number; with its Monte Carlo standard error, by a factor and in a unit, where it has one."""
    factor, unit = shown
    return with_unit(with_error(factor * value, factor * error), unit) if value and error else text


def scruton(value: float | None, write: Callable[[float | None, int], str] = number, digits: int = 4) -> str:
    """Write a Scruton number, which files hold by the paper's definition, as it is shown."""
    return write(None if value is None else shown_in(SCRUTON)[0] * value, digits)


def scruton_note(*, heaving: bool = True) -> str:
    """Which Scruton number is shown, in a sentence, where it is not the paper's; else empty."""
    if _IN_FORCE.get().get("scruton_number") != "eurocode":
        return ""
    if not heaving:
        return "EN 1991-1-4 defines no Scruton number for torsion: it is the paper’s, 4πJξ/(ρB³D)."
    factor = stated(float(f"{shown_in(SCRUTON)[0]:.4g}"))
    return (
        f"Scruton numbers are those of EN 1991-1-4, 4πmξ/(ρD²): B/D = {factor} times the paper’s, 4πmξ/(ρBD), which "
        "commands take and files keep."
    )


def flag_texts(flags: Iterable[str], content: Mapping[str, Any], *, keys: bool = False) -> list[str]:
    """Flags of fit.json or sizing.json, its content, as they are shown; with `keys` those of input files stay as typed.

    A sentence of an earlier version, or without a number that is shown otherwise, stands as the file has it.
    """
    parts = content.get("flag_parts", {})
    return ["".join(_part(part, keys) for part in parts.get(flag, [flag])) for flag in flags]


def _part(part: str | Mapping[str, Any], keys: bool) -> str:
    if isinstance(part, str):
        return part
    text: str = part["text"]
    match part["kind"]:
        case said.DAMPING if decrements():
            return f"δ = {shown_in(DAMPING)[0] * part['value']:.3g}"
        case said.SCRUTON if shown_in(SCRUTON)[0] != 1.0:
            return f"{shown_in(SCRUTON)[0] * part['value']:.3g}"
        case said.KEY if not keys:
            text = part["words"]
    return text
