"""Results on a line, and as a table in a notebook, by a few facts in place of every number that they hold."""

import html
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

Facts = Callable[[Any], Mapping[str, object]]
LONGEST, LINE = 60, 360  # letters of a fact on the line, and of all of them
_FEW = 3  # entries that are told in place of their number


def shown[Kind: type](facts: Facts) -> Callable[[Kind], Kind]:
    """Give a class `__repr__` and `_repr_html_` of the facts that a function names of an instance.

    Parameters
    ----------
    facts : callable
        From an instance to what there is to say of it, by name.
    """

    def line(self: object) -> str:
        stated = (f"{name}={_short(str(value), LONGEST)}" for name, value in facts(self).items())
        return f"{type(self).__name__}({_short(', '.join(stated), LINE)})"

    def table(self: object) -> str:
        rows = "".join(
            f'<tr><th style="text-align:left">{html.escape(name.replace("_", " "))}</th>'
            f'<td style="text-align:left">{html.escape(str(value))}</td></tr>'
            for name, value in facts(self).items()
        )
        return f"<table><caption>{html.escape(type(self).__name__)}</caption>{rows}</table>"

    def give(kind: Kind) -> Kind:
        # what a dataclass wrote of itself is replaced, whatever was decorated first
        setattr(kind, "__repr__", line)  # noqa: B010  # mypy knows no assignment to a method
        setattr(kind, "_repr_html_", table)  # noqa: B010
        return kind

    return give


def fields_in_brief(one: Any) -> dict[str, object]:
    """Facts of a dataclass: each field that says something, arrays by their shape, collections by their size."""
    said = {field.name: _in_brief(getattr(one, field.name)) for field in fields(one)}
    return {name: text for name, text in said.items() if text}


def _in_brief(value: Any) -> str:
    if value is None or isinstance(value, str):
        return value or ""
    if shape := getattr(value, "shape", ()):
        return f"array {'x'.join(map(str, shape))}"
    if isinstance(value, Mapping | tuple | list):
        few = len(value) <= _FEW and all(isinstance(one, str | int | float) for one in value)
        return ", ".join(map(_in_brief, value)) if few else str(len(value))
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(mean := getattr(value, "mean", None), float):
        return f"{mean:.6g}" + (f" +/- {value.sd:.6g}" if getattr(value, "sd", None) else "")
    named = getattr(value, "name", None)
    return named if isinstance(named, str) else str(value)


def _short(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 1]}…"
