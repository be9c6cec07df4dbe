"""Results on a line, and as a table in a notebook, by a few facts in place of every number that they hold."""

import html
from collections.abc import Callable, Mapping
from typing import Any

Facts = Callable[[Any], Mapping[str, object]]
LONGEST = 60  # letters of a fact on the line


def shown[Kind: type](facts: Facts) -> Callable[[Kind], Kind]:
    """Give a class `__repr__` and `_repr_html_` of the facts that a function names of an instance.

    Parameters
    ----------
    facts : callable
        From an instance to what there is to say of it, by name.
    """

    def line(self: object) -> str:
        stated = (f"{name}={_short(str(value))}" for name, value in facts(self).items())
        return f"{type(self).__name__}({', '.join(stated)})"

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


def _short(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"
