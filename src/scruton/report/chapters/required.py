"""What the required damping is held against: every law, no law, a line by hand, and how far it lies from the tests."""

from collections.abc import Callable, Iterator

from scruton.griffin.thresholds import X_TRUSTED
from scruton.report.conventions import DAMPING, SCRUTON, damping, damping_words, scruton, shown_in, with_unit
from scruton.report.document import Table
from scruton.report.needs import Content
from scruton.report.wording import Notation, law_text, limit_text, share
from scruton.sizing.checks import CONFIDENCES, LAW_FREE
from scruton.sizing.thresholds import LARGEST_ADDED

FAR = (
    f"!: far from what was tested (x beyond {X_TRUSTED:g}, or no transient through that amplitude); what it rests on "
    "stands below."
)
_SHARES = [share(float(p)) for p in CONFIDENCES]


def required_tables(content: Content, of: Notation) -> Iterator[Table]:
    """What each required damping is held against, a table a mode and limit: every law, no law, and what was tested."""
    for k, mode in enumerate(content["modes"], 1):
        for j, limit in enumerate(mode["limits"], 1):
            rows, against = _required_rows(limit, content, of), limit["rule"] if of.plain else limit_text(limit)
            if any(cell not in ("none", "") for _, *cells in rows for cell in cells):
                yield Table(
                    f"required_by_law_{k}_{j}",
                    f"Mode {mode['name']}, {against}: added {damping_words()} required, and what it rests on",
                    ("", *_SHARES),
                    [*rows, *_reach_rows(limit, of)],
                    f"x is the extrapolation index from the nearest test: laws part beyond {X_TRUSTED:g} (!). Without "
                    "a law the damping is that which the transients show at the amplitude of the limit. A law that "
                    "does not hold starts from the nearest test, what is weighed from the curve of all: its row may "
                    "lie outside the others." + _by_hand(limit, content["amplitude_unit"], of),
                    numeric=(False, *[True] * len(_SHARES)),
                )


def _required_rows(limit: Content, content: Content, of: Notation) -> list[tuple[str, ...]]:
    """Label, and the required damping by confidence: as weighed, under each law, without a law, by hand, one rig."""
    errors = limit.get("required_mcse", {})  # under one law the draws are as many, and the error is about as large

    def row(label: str, required: Content) -> tuple[str, ...]:
        return label, *(required_damping(required[p], of, errors.get(p)) for p in CONFIDENCES)

    alone = content.get("provenance", {}).get("law")
    rows = [row("laws as weighed" if alone is None else f"as asked, under n = {alone:g} alone", limit["required"])]
    for law, required in limit.get("required_by_law", {}).items():
        rows.append(row("without a law" if law == LAW_FREE else f"under {law_text(law)} alone", required))
    for tau, required in limit.get("required_at_discrepancy", {}).items():
        rows.append(row(f"where rigs miss the curve by {share(float(tau))}", required))
    if (by_hand := limit.get("required_by_hand")) is not None:
        rows.append(
            (
                "straight line of 1/A, by hand",
                required_damping(by_hand, of, errors.get(CONFIDENCES[0])),
                *[""] * (len(CONFIDENCES) - 1),
            )
        )
    return rows


def _by_hand(limit: Content, unit: str, of: Notation) -> str:
    """How the damping by the straight line of 1/A is reckoned, in a sentence that begins with a gap."""
    if not (at := limit.get("by_hand")):
        return ""
    angle = unit if unit == "rad" else ""
    (factor, shown), inverse = shown_in(angle), shown_in("1/rad")[0] if angle else 1.0
    intercept, slope = (
        of.number(inverse * value, 4) for value in (at["intercept"], at["slope"] / shown_in(SCRUTON)[0])
    )
    line = f"1/A = {intercept} + {slope} Sc" + (f", A in {of.unit(shown)}," if shown else "")
    size = of.number(factor * at["amplitude"], 4)
    largest = f"{size} {shown or 'D'}" if of.plain else with_unit(size, shown or "D")
    return (
        f" By hand: the stable amplitudes of the section lie along {line} and the limit is A = {largest} with all "
        f"else at its median, so Sc = {scruton(at['scruton_number'], of.number)}; the bridge has a {damping_words()} "
        f"of {damping(at['damping_ratio'])} already."
    )


def required_damping(value: float | None, of: Notation, error: float | None = None) -> str:
    """A damping that is required, as it is shown, to its standard error's digit; None is more than can be added."""
    factor, unit = shown_in(DAMPING)
    if value and error:
        return damping(value, error=error)
    text = of.number(factor * (LARGEST_ADDED if value is None else value), 3) + f" {unit}".rstrip()
    return f"> {text}" if value is None else text if value else "none"


def far(limit: Content, confidence: str) -> str:
    """The sign of a required damping that lies far from what was tested; empty for others, and for none."""
    reach = limit.get("reach", {}).get(confidence)
    return " !" if limit["required"][confidence] != 0.0 and reach and not reach["trusted"] else ""


def far_note(content: Content) -> str:
    """What the sign of `far` means, where it stands in the table of all modes."""
    marked = any(far(limit, p) for mode in content["modes"] for limit in mode["limits"] for p in CONFIDENCES)
    return FAR if marked else ""


def _reach_rows(limit: Content, of: Notation) -> list[tuple[str, ...]]:
    """How far each required damping lies from what was tested."""
    reach = [limit.get("reach", {}).get(p) for p in CONFIDENCES]
    if not any(reach):
        return []

    def row(label: str, write: Callable[[Content], str], beyond: str = "") -> tuple[str, ...]:
        more = [beyond if limit["required"][p] is None else "" for p in CONFIDENCES]
        return label, *("" if at is None else sign + write(at) for at, sign in zip(reach, more, strict=True))

    return [
        row("Sc there", lambda at: scruton(at["scruton_number"], of.number, 3), "> "),
        row("x there", lambda at: of.number(at["extrapolation_index"], 2) + ("" if at["trusted"] else " !"), "> "),
        row("tests through that amplitude", lambda at: f"{at['covered_by']} of {at['tests']}"),
    ]
