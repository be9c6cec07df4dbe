"""Identifiers that sentences of other rooms hold, in words: a reader of the report knows no names of files."""

import re
from dataclasses import fields, is_dataclass, replace
from typing import Any

from scruton.dynamics.effects import CATALOGUE
from scruton.report.document import Code
from scruton.report.maths import Maths
from scruton.report.wording import law_text

# Names and addresses, which files and links are called by; and what is no text.
_KEPT = {"key", "name", "data", "svg", "png", "chart", "role", "number", "numeric", "generator", "colour", "logo"}
# Titles are clauses as often as nouns: in a sentence that goes on they stand in quotes.
_WORDS = {name: f"“{_title[0].lower()}{_title[1:]}”" for name, effect in CATALOGUE.items() for _title in [effect.title]}
_WORDS |= {
    "gamma_v": "γᵥ", "beta_t": "βₜ", "alpha": "α", "I_u": "Iᵤ", "K_D": "dynamic sensitivity parameter",
    "K_w": "correlation length factor", "V_cr": "critical wind speed", "xi_s": "ξₛ",
}  # fmt: skip
_PERCENT = re.compile(r"(?<=\d)%")  # the terminal's; a page puts a space before it
_LAW = re.compile(r"\bn=-?\d[\d.]*")
_IDENTIFIER = re.compile(rf"(?<![\w/.])({'|'.join(sorted(_WORDS, key=len, reverse=True))})(?![\w/.]\w)")


def in_words(text: str) -> str:
    """A text with every effect of the catalogue by its title, and signs and per cent as a page has them.

    >>> in_words("it would tell setting_dependence from the rest")
    'it would tell “aerodynamic parameters differ from test to test, not by the reduced velocity” from the rest'
    """
    text = _PERCENT.sub(" %", text)
    return _LAW.sub(lambda found: law_text(found[0]), _IDENTIFIER.sub(lambda found: _WORDS[found[1]], text))


def worded(value: Any) -> Any:
    """A part of a document with its identifiers in words; code and formulae stay."""
    result: Any = value
    match value:
        case str():
            result = in_words(value)
        case Code() | Maths():
            pass
        case tuple() | list():
            result = type(value)(map(worded, value))
        case _ if is_dataclass(value) and not isinstance(value, type):
            result = replace(
                value, **{f.name: worded(getattr(value, f.name)) for f in fields(value) if f.name not in _KEPT}
            )
    return result
