"""Several modes of a bridge together, of one motion or of both, from the content of sizing.json."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from scruton.report.conventions import amplitude, damping, scruton
from scruton.report.document import Block, Heading, Table, paragraph
from scruton.report.wording import Notation, number, percent, share
from scruton.sizing.checks import ASKED

Content = Mapping[str, Any]

TOGETHER = "Probability of exceeding the limit in lock-in"


def exceedances(content: Content, write: Callable[[float], str]) -> list[tuple[str, ...]]:
    """Probability of exceeding the limit in every mode, and in any of several, by what is done about it."""
    every = content["all_modes"]
    left = {
        "as it is": every["without"],
        f"with the damping required at {share(float(ASKED))}": every.get("with_required_damping"),
        "with the damping required for any mode": (every.get("required_for_any") or {}).get("left"),
        "with all dampers, each acting on every mode": every.get("with_dampers"),
    }
    return [(label, *_risks(found, write)) for label, found in left.items() if found is not None]


def _risks(found: Content, write: Callable[[float], str]) -> list[str]:
    """Of each mode, and of any where there are several."""
    return [write(risk) for risk in (*found["each"], *([found["any"]] if len(found["each"]) > 1 else []))]


def modes_header(names: Sequence[str], mode: str) -> list[str]:
    """Headings of such a table, with what stands before the name of a mode."""
    return [f"{mode}{name}" for name in names] + ([f"any{mode and ' mode'}"] if len(names) > 1 else [])


def for_any_note(every: Content) -> str:
    """The damping that keeps the risk of any of several modes, in a sentence; empty for one mode."""
    found = every.get("required_for_any")
    if not found:
        return ""
    added = ", ".join(
        f"{name} {'more than can be added' if need is None else damping(need) if need else 'none'}{_reach(at)}"
        for name, need, at in zip(every["names"], found["required"], found["reach"], strict=True)
    )
    return f"Required for a risk of {percent(found['risk'])} of any mode: {added}."


def _reach(at: Content | None) -> str:
    """How far a required damping lies from what was tested, in brackets; empty where that is not known."""
    if at is None:
        return ""
    place, far = scruton(at["scruton_number"], digits=3), "" if at["trusted"] else ", far from what was tested"
    index, covered = number(at["extrapolation_index"], 2), f"{at['covered_by']} of {at['tests']}"
    return f" (Sc {place}, x {index}, transients of {covered} tests through the limit's amplitude{far})"


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
            one["name"], *_risks(one["left"], write),
            number(max(strokes), 3) if strokes else "no bound",
            *([write(one["as_designed"]["any"])] if designed else []),
        ))  # fmt: skip
    header = ("damper", *modes_header(names, mode), "stroke (95 %) [m]")
    yield Table(
        "existing",
        "Probability of exceeding the limit with a given damper" + (", the bridge as identified" if designed else ""),
        (*header, "any, as designed" if len(names) > 1 else "as designed") if designed else header,
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
        ("", *modes_header(both["names"], mode)),
        exceedances({"all_modes": both}, write),
        f"{for_any_note(both)} Amplitude at the edge of the deck without added damping (90 %): {edge}.".strip(),
    )  # fmt: skip
    yield from existing_blocks(content, mode, write)
