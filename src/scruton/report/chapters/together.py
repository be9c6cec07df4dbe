"""Several modes of a bridge together, of one motion or of both, from the content of sizing.json."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from scruton.report.conventions import amplitude
from scruton.report.document import Block, Heading, Table, paragraph
from scruton.report.wording import Notation, share
from scruton.sizing.checks import ASKED

Content = Mapping[str, Any]

TOGETHER = "Probability of exceeding the limit in lock-in"


def exceedances(content: Content, write: Callable[[float], str]) -> list[tuple[str, ...]]:
    """Probability of exceeding the limit in every mode and in any, by what is done about it."""
    every = content["all_modes"]
    labels = {
        "without": "as it is",
        "with_required_damping": f"with the damping required at {share(float(ASKED))}",
        "with_dampers": "with all dampers, each acting on every mode",
    }
    return [
        (label, *map(write, every[key]["each"]), write(every[key]["any"]))
        for key, label in labels.items()
        if key in every
    ]


def both_blocks(content: Content, mode: str, write: Callable[[float], str], of: Notation) -> Iterator[Block]:
    """Heaving and torsion of one bridge, where both were sized.

    Parameters
    ----------
    content : mapping
        Of sizing.json.
    mode : str
        What stands before the name of a mode.
    write : callable
        Of a probability.
    of : Notation
    """
    both = content.get("both")
    if not both:
        return
    if not of.plain:
        yield Heading("Heaving and torsion together")
        yield paragraph(
            "The two sections were tested apart; the site and the span are those of one bridge. Dampers against "
            "heaving hang on the axis of the deck; those against torsion stand off it and move with heaving, too."
        )
    edge = "; ".join(
        f"{name} ({motion}) {amplitude(at['median'], 'm')} "
        f"({' to '.join(amplitude(at[end], 'm') for end in ('low', 'high'))})"
        for name, motion, at in zip(both["names"], both["motions"], both["edge"], strict=True)
    )
    yield Table(
        "both", f"Heaving and torsion together: {TOGETHER[0].lower()}{TOGETHER[1:]}",
        ("", *(f"{mode}{name}" for name in both["names"]), "any mode" if mode else "any"),
        exceedances({"all_modes": both}, write),
        f"Amplitude at the edge of the deck without added damping (90 %): {edge}",
    )  # fmt: skip
