"""Several modes of a bridge together, of one motion or of both, from the content of sizing.json."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

from scruton.report.conventions import DAMPING, amplitude, damping, known_to, scruton, shown_in
from scruton.report.document import Block, Heading, Table, paragraph
from scruton.report.wording import Notation, counted, number, percent, share, to_error
from scruton.sizing.checks import ASKED
from scruton.sizing.thresholds import LARGEST_ADDED

Content = Mapping[str, Any]

TOGETHER = "Probability of exceeding the limit in lock-in"


Write = Callable[[float, float | None], str]  # a probability, to the digit of its Monte Carlo error where that is known


def in_percent(risk: float, error: float | None = None) -> str:
    """A probability for the page."""
    return f"{to_error(100.0 * risk, 100.0 * error)} %" if risk and error else counted(risk)


def as_fraction(risk: float, error: float | None = None) -> str:
    """A probability for the terminal."""
    return to_error(risk, error) if risk and error else f"{risk:.3f}"


def _known_to(founds: Iterable[Content]) -> str:
    """The largest Monte Carlo error of such probabilities, in a sentence; empty where none is known."""
    errors = [error for found in founds for error in (*(found.get("each_mcse") or ()), found.get("any_mcse")) if error]
    return f"Monte Carlo standard errors of the probabilities: at most {percent(max(errors), 1)}." if errors else ""


def exceedances(content: Content, write: Write) -> list[tuple[str, ...]]:
    """Probability of exceeding the limit in every mode, and in any of several, by what is done about it."""
    return [(label, *_risks(found, write)) for label, found in _left(content["all_modes"]).items()]


def _left(every: Content) -> dict[str, Content]:
    """The probabilities by what is done about them."""
    left = {
        "as it is": every["without"],
        f"with the damping required at {share(float(ASKED))}": every.get("with_required_damping"),
        "with the damping required for any mode": (every.get("required_for_any") or {}).get("left"),
        "with all dampers, each acting on every mode": every.get("with_dampers"),
    }
    return {label: found for label, found in left.items() if found is not None}


def exceedances_note(every: Content) -> str:
    """What stands below a table of `exceedances`: the damping for any mode, and how well the numbers are known."""
    return " ".join(filter(None, (for_any_note(every), _known_to(_left(every).values()))))


def _risks(found: Content, write: Write) -> list[str]:
    """Of each mode, and of any where there are several."""
    cells = [*map(write, found["each"], found.get("each_mcse") or [None] * len(found["each"]))]
    return cells + ([write(found["any"], found.get("any_mcse"))] if len(cells) > 1 else [])


def modes_header(names: Sequence[str], mode: str) -> list[str]:
    """Headings of such a table, with what stands before the name of a mode."""
    return [f"{mode}{name}" for name in names] + ([f"any{mode and ' mode'}"] if len(names) > 1 else [])


def for_any_note(every: Content) -> str:
    """The damping that keeps the risk of any of several modes, in a sentence; empty for one mode."""
    found = every.get("required_for_any")
    if not found:
        return ""
    errors = found.get("required_mcse") or [None] * len(found["required"])
    added = ", ".join(
        f"{name} {_need(need, error)}{_reach(at, beyond=need is None)}"
        for name, need, error, at in zip(every["names"], found["required"], errors, found["reach"], strict=True)
    )
    return f"Required for a risk of {percent(found['risk'])} of any mode: {added}."


def _need(need: float | None, error: float | None) -> str:
    """Damping with its Monte Carlo error; None is more than is looked at."""
    if not need:
        return f"more than {damping(LARGEST_ADDED)}" if need is None else "none"
    return known_to(damping(need), need, error, shown_in(DAMPING))


def _reach(at: Content | None, *, beyond: bool) -> str:
    """How far a required damping lies from what was tested, in brackets; empty where that is not known.

    `beyond` it, where it is more than is looked at.
    """
    if at is None:
        return ""
    place, far = scruton(at["scruton_number"], digits=3), "" if at["trusted"] else ", far from what was tested"
    index, covered = number(at["extrapolation_index"], 2), f"{at['covered_by']} of {at['tests']}"
    place, index = (f"beyond Sc {place}", f"of at least {index}") if beyond else (f"Sc {place}", index)
    return f" ({place}, x {index}, transients of {covered} tests through the limit's amplitude{far})"


def existing_blocks(content: Content, mode: str, write: Write) -> Iterator[Block]:
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
            *([write(one["as_designed"]["any"], one["as_designed"].get("any_mcse"))] if designed else []),
        ))  # fmt: skip
    header = ("damper", *modes_header(names, mode), "stroke (95 %) [m]")
    yield Table(
        "existing",
        "Probability of exceeding the limit with a given damper" + (", the bridge as identified" if designed else ""),
        (*header, "any, as designed" if len(names) > 1 else "as designed") if designed else header,
        rows,
        _known_to(part for one in found for part in (one["left"], one.get("as_designed")) if part),
    )


def both_blocks(content: Content, mode: str, write: Write, of: Notation) -> Iterator[Block]:
    """Heaving and torsion of one bridge, where both were sized.

    Parameters
    ----------
    content : mapping
        Of sizing.json.
    mode : str
        What stands before the name of a mode.
    write : callable
        Of a probability, and of its Monte Carlo error.
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
        f"{exceedances_note(both)} Amplitude at the edge of the deck without added damping (90 %): {edge}.".strip(),
    )  # fmt: skip
    yield from existing_blocks(content, mode, write)
