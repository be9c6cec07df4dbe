"""What a diagnosis says, in sentences: the verdict, what it means for the numbers, how far the gap shrinks."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from scruton.dynamics.effects import CATALOGUE, UNKNOWN
from scruton.gap.thresholds import SETTLED
from scruton.report.thresholds import NEARER, NEARER_BY, STAYS_OFF, STAYS_OFF_SHARE
from scruton.report.verdict import conclusion, condition, likeliest, odds, perhaps, settled
from scruton.report.wording import percent, share

_NOT_THE_BEST = "Of records held out the verdict is not the best account"
FIRST = "the first of these"  # what an unsettled verdict goes by, after a sentence that names what it may be


def effect_title(name: str) -> str:
    """An effect of the catalogue in words."""
    if name == "none":
        return "no gap"
    return {**CATALOGUE, UNKNOWN.name: UNKNOWN}[name].title


def in_words(name: str) -> str:
    """The same inside a sentence."""
    title = effect_title(name)
    return title if title[1:2].isupper() else title[0].lower() + title[1:]


def gap_sentence(gap: Mapping[str, Any]) -> str:
    """The verdict in one sentence; what is below 0.8, with what else it may be."""
    found = conclusion(gap, in_words, f"{{}} (probability {odds(gap['probability'][gap['verdict']])})")
    if not settled(gap):
        return f"{whether(gap)} {capital(found)}."
    return whether(gap) if gap["verdict"] == "none" else f"{whether(gap)} What explains it: {found}."


def capital(words: str) -> str:
    """The same at the beginning of a sentence."""
    return words[0].upper() + words[1:]


def whether(gap: Mapping[str, Any]) -> str:
    """Whether the null model and the records part, in a sentence."""
    if gap["verdict"] != "none":
        return "The null model and the records part."
    if not settled(gap):
        return "Nothing is found that must be there."
    return "The null model and the records agree within their noise."


def in_titles(gap: Mapping[str, Any]) -> str:
    """What the names of a verdict stand for: of one that is not settled, of all that it may be."""
    beside = [capital(perhaps(gap, name, in_words)) for name in gap["also"]]
    if not settled(gap):
        titles = [*(f"If it is {name}: {in_words(name)}" for name, _ in likeliest(gap)), *beside]
    elif gap["verdict"] == "none":
        return whether(gap)
    else:
        titles = [effect_title(gap["verdict"]), *beside]
    return " ".join(f"{title}." for title in titles)


def explained(gap: Mapping[str, Any], name: str, contained: str = "") -> list[str]:
    """What an unknown looks like, and what the verdict means for the predictions: if it is true.

    `contained` is whether a fit's numbers contain it, where there is a fit.
    """
    said = [conditional(gap, name, words) for words in (gap.get("unknown", {}).get("text"),) if words]
    meaning = gap.get("meaning", {})
    if contained:
        return [*said, " ".join([contained, *meaning.get("remarks", ())])]
    if text := meaning.get("text"):  # that there is nothing to be done is true in any case
        said.append(text if meaning.get("command", "") is None else conditional(gap, name, text))
    return said


def conditional(gap: Mapping[str, Any], name: str, words: str) -> str:
    """A sentence that is true if the verdict is, which goes by this name."""
    asked = condition(gap, name)
    return f"{capital(asked)}: {words[0].lower()}{words[1:]}" if asked else words


def contained_sentence(
    gap: Mapping[str, Any], fit: Mapping[str, Any], numbers: str = "The numbers of this report"
) -> str:
    """Whether the numbers of a fit, by its fit.json, contain what was found, and what that moves."""
    meaning = gap.get("meaning")
    if not meaning:
        return ""
    found = [] if gap["verdict"] == "none" else [gap["verdict"], *gap["also"]]
    put_in = _put_in(fit.get("effect", {}))
    # what stands beside an unknown cause by its own name is no unknown cause
    missing, foreign = ([one for one in of if one not in other] for of, other in ((found, put_in), (put_in, found)))
    command, moves = meaning.get("command"), meaning.get("moves") or ""
    out = " The same command without `--effect` takes it out."
    if foreign:
        also = f", and not {_names(found)}, which was found" if found else ", which was not found"
        return f"{numbers} contain {_names(put_in)}, as was asked{also}.{out}"
    if not missing and found:
        what = "it" if settled(gap) else f"{FIRST}{' and what stands beside it' if gap['also'] else ''}"
        return f"{numbers} contain {what}.{f' {moves}' if moves else ''}{out}"
    if not found or command is None:
        return str(meaning["text"]).removesuffix(" ".join(["", *meaning.get("remarks", ())]))
    how = f"`{command}` puts {'all of it' if len(found) > 1 else 'it'} in."
    moved = f" {conditional(gap, FIRST, moves)}" if moves else ""
    if put_in:
        return f"{numbers} contain {_names(put_in)}, and not {_names(missing)}: {how}{moved}"
    return f"{numbers} do not contain it: {how}{moved}"


def carried_sentence(fit: Mapping[str, Any]) -> str:
    """What a fit puts into its predictions, by its fit.json, and how sure it is; empty where it was told nothing."""
    entry = fit.get("effect")
    if not entry:
        return ""
    put_in = _put_in(entry)
    if not put_in:
        return "The diagnosis found no gap: predictions contain no effect."
    p, asked = entry["probability"], "" if entry["asked"] == "auto" else ", as was asked"
    unsettled = ", which is not settled; the same command without `--effect` takes it out" if p < SETTLED else ""
    first = " of the first" if len(put_in) > 1 else ""
    return f"Predictions contain {_names(put_in)}{asked}: the probability{first} is {odds(p)}{unsettled}."


def _put_in(entry: Mapping[str, Any]) -> list[str]:
    """The effects that a fit carries, by `effect` of its fit.json."""
    return [name for name in (entry.get("used", "none"), *entry.get("also", ())) if name != "none"]


def _names(effects: Iterable[str]) -> str:
    return " and ".join(f"“{in_words(name)}”" for name in effects)  # titles are clauses as often as nouns


def shrink_sentence(entry: Mapping[str, Any]) -> str:
    """How far the gap shrinks, from `shrink` of gap.json: what a user predicts first; empty where there is none."""
    if not entry:
        return ""
    if not entry.get("put_in", True):
        return f"There is nothing that could be put into the model. {_as_it_is(entry['headline'])}".rstrip()
    density = _density(entry) if entry.get("measurable", True) else _too_small(entry)
    parts = (_headline(entry.get("headline")), _own(entry.get("not_foretold", ())), density)
    return " ".join(words for words in parts if words)


def _own(effects: Sequence[str]) -> str:
    """What the errors of tests left out do not say, of effects that have a value for every test."""
    if not effects:
        return ""
    has = "has" if len(effects) == 1 else "have"
    return (
        f"What was put in ({_names(effects)}) {has} values of its own in every test: of a test that is not there it "
        "says nothing, and these errors say nothing of how it would do."
    )


def _headline(head: Mapping[str, Any] | None) -> str:
    """Errors of what is predicted of a test from the others, of a record of the only one, or of one in still air."""
    if not head:
        return ""
    if "test" in head:
        return _of_one_test(head)
    if "tests" not in head:  # still air, or a single record: nothing stable is foretold
        whose, damping = _left_out(head)
        return (
            f"Of {whose} left out in turn, the damping curve is off by {_off(head['damping_before'])} before and "
            f"{_off(head['damping_after'])} of the {damping} damping after"
            f"{_worse(head['damping_worse'], head.get('records', 2))}."
        )
    tests = head["tests"]
    words = (
        "Of tests left out in turn, the stable amplitude is off by "
        f"{_off(head['amplitude_before'])} (median) before and {_off(head['amplitude_after'])} after"
        f"{_worst(head)}{_worse(head['amplitude_worse'], tests)}"
    )
    if "damping_before" in head:
        words += (
            f"; the damping curve by {_off(head['damping_before'])} and {_off(head['damping_after'])} "
            f"of the relaxation damping{_worse(head['damping_worse'], tests)}"
        )
    return f"{words}."


def _as_it_is(head: Mapping[str, Any] | None) -> str:
    """Errors of what is left out in turn, of a model that nothing can be put into."""
    if not head:
        return ""
    whose, damping = _left_out(head)
    off = []
    if "amplitude_before" in head:
        off.append(f"the stable amplitude is off by {_off(head['amplitude_before'])} (median)")
    if head.get("damping_before") is not None:
        curve = f"the damping curve{'' if off else ' is off'} by {_off(head['damping_before'])}"
        off.append(f"{curve} of the {damping} damping")
    return f"Of {whose} left out in turn, {' and '.join(off)}." if off else ""


def _left_out(head: Mapping[str, Any]) -> tuple[str, str]:
    """What is left out in turn, and the damping that errors of damping curves are relative to."""
    if "record" in head:
        return f"the large and the small amplitudes of {head['record']}", ("structural", "relaxation")[head["in_wind"]]
    whose = "tests" if "tests" in head else f"the records of {head['test']}" if "test" in head else "records"
    return whose, "relaxation" if "tests" in head or "test" in head else "structural"


def _of_one_test(head: Mapping[str, Any]) -> str:
    """Errors of what the other records of a test foretell of each: at no other Scruton number."""
    words = (
        f"Of the records of {head['test']} left out in turn, the damping curve is off by "
        f"{_off(head['damping_before'])} before and {_off(head['damping_after'])} of the relaxation damping after"
        f"{_worse(head['damping_worse'], head['records'])}"
    )
    if count := head.get("amplitudes"):
        words += (
            f"; the stable amplitude, which {count} of {head['records']} show, by {_off(head['amplitude_before'])} "
            f"(median) and {_off(head['amplitude_after'])}{_worse(head['amplitude_worse'], count)}"
        )
    return f"{words}. There is no other test to leave out: how it is at another Scruton number is not tested."


def _off(error: float | None) -> str:
    """A relative error; none where what is predicted has no stable amplitude, or no end."""
    return "more than any measure" if error is None else percent(error, 2)


def _worst(head: Mapping[str, Any]) -> str:
    """The test that stays far off, while the median is near: what was found does not account for that one."""
    worst, median = head.get("worst", {"error": 0.0}), head["amplitude_after"]
    error = worst["error"]
    if median is None or (error is not None and error < max(STAYS_OFF, STAYS_OFF_SHARE * median)):
        return ""
    return f" (in {worst['test']} still by {_off(error)})"


def _worse(count: int, of: int) -> str:
    return f", made worse in {count} of {of}" if count else ""


def _density(entry: Mapping[str, Any]) -> str:
    """The part of the gap in the density of the records that closes."""
    words = f"Put into the model, it closes {_share(entry)} of the gap on the records used"
    if not entry.get("held_out"):
        if "record" in (entry.get("headline") or {}):
            return f"{words}."
        return f"{words}; no record can be left out to test that on what the model has not seen."
    words += f", and {_share(entry['held_out'])} on records held out"
    runner, closed = entry.get("runner_up"), entry["held_out"].get("fraction")
    if not runner or runner["fraction"] is None:
        return f"{words}."
    error, nearer = _of_the_runner_up(entry)
    leaves = "" if error is None else f", and leave the amplitude off by {percent(error, 2)}{' only' * nearer}"
    rival = f"the runner-up ({in_words(runner['effect'])}) would close {share(runner['fraction'])}{leaves}"
    if nearer or (closed is not None and round(runner["fraction"], 2) > round(closed, 2)):
        return f"{words}. {_NOT_THE_BEST}: {rival}."
    return f"{words}; {rival}."


def _too_small(entry: Mapping[str, Any]) -> str:
    """What is said where noise hides how much of the gap closes: of the runner-up, how far off it leaves amplitudes."""
    words = "The gap in the amplitudes of the cycles is too small to measure how far it shrinks"
    error, nearer = _of_the_runner_up(entry)
    if error is None:
        return f"{words}."
    rival = (
        f"the runner-up ({in_words(entry['runner_up']['effect'])}) would leave the stable amplitude off by "
        f"{percent(error, 2)}{' only' * nearer}"
    )
    return f"{words}. {_NOT_THE_BEST}: {rival}." if nearer else f"{words}; {rival}."


def _of_the_runner_up(entry: Mapping[str, Any]) -> tuple[float | None, bool]:
    """How far off the runner-up leaves the stable amplitude, None where that is not known; whether that is nearer."""
    error = (entry.get("runner_up") or {}).get("amplitude_error")
    own = (entry.get("headline") or {}).get("amplitude_after")
    nearer = error is not None and own is not None and error < NEARER * own and own - error > NEARER_BY
    return error, nearer


def _share(entry: Mapping[str, Any]) -> str:
    if entry.get("fraction") is None:
        return "an unmeasurable part"
    if entry.get("interval90") is None:
        return f"{share(entry['fraction'])} (a single record: no interval)"
    low, high = entry["interval90"]
    return f"{share(entry['fraction'])} (90 % interval {share(low)} to {share(high)})"
