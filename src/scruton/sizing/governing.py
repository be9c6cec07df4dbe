"""Which limit governs, and what is said of those that do not hold for a mode."""

from collections.abc import Iterator, Sequence

from scruton.sizing.risk import Risk


def governing(risks: Sequence[Risk]) -> Risk:
    """The limit that governs: the smallest of those that hold for the mode, of all where none does."""
    return min(risks, key=lambda against: (against.outside is not None, against.limit))


def outside(mode: str, risks: Sequence[Risk]) -> Iterator[str]:
    """A remark on every limit that does not hold for the mode, whether it governs or not."""
    deciding = governing(risks)
    for against in risks:
        if against.outside is None:
            continue
        if against is deciding:
            yield f'mode {mode}: the limit "{against.rule}" governs, yet {against.outside}'
        else:
            smaller = ", though it is the smallest" if against.limit < deciding.limit else ""
            yield f'mode {mode}: the limit "{against.rule}" does not govern{smaller}: {against.outside}'
