"""Which limit governs, and what is said of those that do not hold for a mode."""

from collections.abc import Iterator, Sequence

from scruton.said import Value, key, said
from scruton.sizing.limits.rule import limit_words
from scruton.sizing.risk import Risk


def governing(risks: Sequence[Risk]) -> Risk:
    """The limit that governs: the smallest of those that hold for the mode, of all where none does."""
    return min(risks, key=lambda against: (against.outside is not None, against.limit))


def named(against: Risk) -> Value:
    """A limit as the user wrote it, and by its code where a report speaks of it."""
    return key(f'"{against.rule}"', limit_words(against.rule, against.title))


def outside(mode: str, risks: Sequence[Risk]) -> Iterator[str]:
    """A remark on every limit that does not hold for the mode, whether it governs or not."""
    deciding = governing(risks)
    for against in risks:
        if against.outside is None:
            continue
        if against is deciding:
            yield said(f"mode {mode}: the limit ", named(against), f" governs, yet {against.outside}")
        else:
            smaller = ", though it is the smallest" if against.limit < deciding.limit else ""
            yield said(f"mode {mode}: the limit ", named(against), f" does not govern{smaller}: {against.outside}")
