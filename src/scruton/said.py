"""Sentences that know their numbers: text in every file, worded anew where a reader is shown damping otherwise.

A flag is a string wherever it goes, and JSON holds it as text.  What it says of damping, of a Scruton number or of a
key of an input file is kept beside it, so that a report can say it in the conventions that it was asked for.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from scruton.documents import as_json

DAMPING, SCRUTON, KEY = "damping ratio", "Scruton number", "key"


@dataclass(frozen=True)
class Value:
    """Part of a sentence that is not the same for every reader.

    Attributes
    ----------
    kind : {"damping ratio", "Scruton number", "key"}
    text : str
        As files and the terminal have it.
    value : float or None
        The damping ratio, or the Scruton number by the paper's definition.
    words : str or None
        Of a key: what it stands for, where there is no file to write it into.
    """

    kind: str
    text: str
    value: float | None = None
    words: str | None = None


class Said(str):
    """A sentence, with the parts that it is made of: text and values."""

    parts: tuple[str | Value, ...] = ()


def said(*parts: str | Value | Iterable[str | Value]) -> Said:
    """Make a sentence of text, values, and sentences or sequences of both."""
    flat = tuple(_flat(parts))
    sentence = Said("".join(part if isinstance(part, str) else part.text for part in flat))
    sentence.parts = flat
    return sentence


def damping(ratio: float, form: str = ".3g") -> Value:
    """A damping ratio, in per cent."""
    return Value(DAMPING, f"{100.0 * ratio:{form}} %", ratio)


def scruton_number(number: float) -> Value:
    """A Scruton number."""
    return Value(SCRUTON, f"{number:.3g}", number)


def key(text: str, words: str) -> Value:
    """A key of an input file, and what it stands for."""
    return Value(KEY, text, words=words)


def listed(items: Iterable[Iterable[str | Value]], between: str = ", ") -> Iterator[str | Value]:
    """Parts of a list: what stands between them is put there."""
    for i, item in enumerate(items):
        yield from [between][: i > 0]
        yield from item


def parts_of(sentences: Iterable[str]) -> dict[str, list[Any]]:
    """What JSON keeps beside sentences: of each that has values, by its text, its parts."""
    known = (one for one in sentences if isinstance(one, Said))
    return {str(one): as_json(one.parts) for one in known if any(isinstance(part, Value) for part in one.parts)}


def _flat(parts: Iterable[str | Value | Iterable[str | Value]]) -> Iterator[str | Value]:
    for part in parts:
        if isinstance(part, Said):
            yield from part.parts
        elif isinstance(part, str | Value):
            yield part
        else:
            yield from _flat(part)
