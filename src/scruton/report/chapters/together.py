"""Several modes of a bridge together, of one motion or of both, from the content of sizing.json."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from scruton.report.conventions import amplitude
from scruton.report.document import Block, Heading, Table, paragraph
from scruton.report.wording import Notation, number, share
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


def existing_blocks(content: Content, mode: str, write: Callable[[float], str]) -> Iterator[Block]:
    """Risk with the dampers that were asked about, and with what was assumed before anything was identified.

    Arguments as of `both_blocks`; where both motions were sized, the table is that of all their modes.
    """
    both = content.get("both")
    found, names = (both or content).get("existing") or [], (both or content["all_modes"])["names"]
    designed = any("as_designed" in one for one in found)
    rows = []
    for one in found:
        strokes = [stroke for stroke in one["stroke_high"] if stroke is not None]
        rows.append((
            one["name"], *map(write, one["left"]["each"]), write(one["left"]["any"]),
            number(max(strokes), 3) if strokes else "no bound",
            *([write(one["as_designed"]["any"])] if designed else []),
        ))  # fmt: skip
    header = ("damper", *(f"{mode}{name}" for name in names), f"any{mode and ' mode'}", "stroke (95 %) [m]")
    yield Table(
        "existing",
        "Probability of exceeding the limit with a given damper" + (", the bridge as identified" if designed else ""),
        (*header, "any, as designed") if designed else header,
        rows,
    )


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
        ("", *(f"{mode}{name}" for name in both["names"]), f"any{mode and ' mode'}"),
        exceedances({"all_modes": both}, write),
        f"Amplitude at the edge of the deck without added damping (90 %): {edge}",
    )  # fmt: skip
    yield from existing_blocks(content, mode, write)
