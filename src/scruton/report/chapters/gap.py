"""The gap between the null model and the records: where, which effect, how far it shrinks, what would settle it."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from scruton.dynamics.effects import CATALOGUE, UNKNOWN
from scruton.dynamics.effects.effect import DAMPING as RELAXATION
from scruton.dynamics.effects.effect import REFERENCE
from scruton.report.chapters.material import Material
from scruton.report.conventions import DAMPING, shown_in
from scruton.report.document import CAUTION, Block, Callout, Heading, Listing, Table, paragraph
from scruton.report.thresholds import PLACES_SHOWN, PROBABILITY_SHOWN, SIZES_SHOWN
from scruton.report.verdict import conclusion, condition, likeliest, odds, perhaps, settled
from scruton.report.wording import PAGE, PARAMETERS, TERMINAL, Notation, percent, share

_SIZE = ("parameter", "median", "90 % interval", "unit", "form")
_OF_DAMPING = ("damping", "branch", "test")  # quantities whose excess is a damping ratio
_HELD_OUT = ("amplitude, before", "amplitude, after", "damping, before", "damping, after")
_WHERE = ("quantity", "rig", "test", "record", "amplitude", "time [s]", "excess")
_FIRST = "the first of these"  # what an unsettled verdict goes by, after a sentence that names what it may be
_INVISIBLE = "What these records cannot show, whatever it is"
_NULL_IN_WIND = (
    "The null model is the paper’s law with one pair of aerodynamic parameters for the peak tests and no discrepancy "
    "between them: the discrepancy and the average over laws, which the predictions carry, would swallow what this "
    "chapter looks for."
)
_NULL_IN_STILL_AIR = "The null model is a rig of constant damping ratio and constant frequency, whatever the amplitude."


def gap_chapter(material: Material) -> Iterator[Block]:
    """The diagnosis, in words, tables and its picture."""
    gap = material.gap
    if gap is None:
        return
    yield paragraph(gap_sentence(gap), role="answer")
    yield paragraph(_NULL_IN_WIND if material.tests else _NULL_IN_STILL_AIR)
    flags = list(gap.get("flags", ()))
    if material.fit.summary["provenance"]["tests"]:
        flags.append("The diagnosis reads the whole campaign, the tests that the fit was told to leave out among them.")
    if flags:
        yield Callout(CAUTION, "What was read", flags)
    for words in _explained(gap, _FIRST, contained_sentence(gap, material.fit.summary)):
        yield paragraph(words)
    yield _held_out_table(gap, PAGE, material.unit)
    if words := shrink_sentence(gap["shrink"]):
        yield paragraph(words)
    if alike := [" or ".join(map(_in_words, group)) for group in gap["indistinguishable"] if len(group) > 1]:
        yield Callout(CAUTION, "These data cannot tell apart", alike)
    yield from material.of("gap")
    likely = _probabilities(gap, effect_title)
    yield Table("gap_probability", "What explains the gap", ("cause", "probability"), likely)
    yield _where_table(gap, material.unit)
    numeric = (False, False, True, True, False, False)
    sizes = _sizes(gap, PAGE)
    caption = "How large the effect is"
    yield Table("gap_size", caption, ("effect", *_SIZE), sizes, _sizes_note(gap), numeric=numeric)
    if gap["advice"]:
        yield Heading("What data would settle it")
        yield Listing(gap["advice"])
    if gap["invisible"]:
        yield Heading(_INVISIBLE)
        yield Listing([entry["text"] for entry in gap["invisible"]])
    yield paragraph(f"Calibrated on {gap['calibrated_on']}.", role="note")


def _where_table(gap: Mapping[str, Any], unit: str) -> Table:
    rows = _places(gap, PAGE, unit)
    more = f" {len(rows) - PLACES_SHOWN} more are in gap.json." if len(rows) > PLACES_SHOWN else ""
    return Table(
        "gap_where",
        "Where the null model and the records part",
        (*_where_header(PAGE, unit), "z"),
        rows[:PLACES_SHOWN],
        "Excess: measured minus null model, of a damping ratio or a relative frequency; z: how many standard "
        f"deviations.{more}",
        (False, False, False, False, True, True, True, True),
    )


def effect_title(name: str) -> str:
    """An effect of the catalogue in words."""
    if name == "none":
        return "no gap"
    return {**CATALOGUE, UNKNOWN.name: UNKNOWN}[name].title


def _in_words(name: str) -> str:
    """The same inside a sentence."""
    title = effect_title(name)
    return title if title[1:2].isupper() else title[0].lower() + title[1:]


def gap_sentence(gap: Mapping[str, Any]) -> str:
    """The verdict in one sentence; what is below 0.8, with what else it may be."""
    found = conclusion(gap, _in_words, f"{{}} (probability {odds(gap['probability'][gap['verdict']])})")
    if not settled(gap):
        return f"{_whether(gap)} {_capital(found)}."
    return _whether(gap) if gap["verdict"] == "none" else f"{_whether(gap)} What explains it: {found}."


def _capital(words: str) -> str:
    return words[0].upper() + words[1:]


def _whether(gap: Mapping[str, Any]) -> str:
    """Whether the null model and the records part, in a sentence."""
    if gap["verdict"] != "none":
        return "The null model and the records part."
    if not settled(gap):
        return "Nothing is found that must be there."
    return "The null model and the records agree within their noise."


def gap_summary(gap: Mapping[str, Any], unit: str) -> list[Block]:
    """The diagnosis for the terminal, of amplitudes in this unit: every place, and effects by the names of files."""
    alike = "; ".join(" / ".join(group) for group in gap["indistinguishable"] if len(group) > 1)
    probability = "Probability (calibrated on simulated campaigns)"
    found = conclusion(gap, str)
    verdict = f"Verdict: {found}" if settled(gap) else _capital(found)
    asked = f", {condition(gap, gap['verdict'])}".removesuffix(", ")
    sizes = _sizes(gap, TERMINAL, SIZES_SHOWN)
    return [
        paragraph(f"{verdict}. {_in_titles(gap)}"),
        *([Callout(CAUTION, "", list(flags))] if (flags := gap.get("flags", ())) else []),
        *(paragraph(words) for words in _explained(gap, gap["verdict"])),
        _held_out_table(gap, TERMINAL, unit),
        paragraph(shrink_sentence(gap["shrink"])),
        Table("gap_probability", probability, ("cause", "probability"), _probabilities(gap, str)),
        *([paragraph(f"These data cannot tell apart: {alike}")] if alike else []),
        Table("gap_size", f"Parameters{asked}", ("effect", *_SIZE), sizes, _sizes_note(gap, SIZES_SHOWN)),
        Table("gap_where", "Where", _where_header(TERMINAL, unit), [row[:-1] for row in _places(gap, TERMINAL, unit)]),
        Listing(gap["advice"]),
        *([paragraph(f"{_INVISIBLE}:")] if gap["invisible"] else []),
        Listing([entry["text"] for entry in gap["invisible"]]),
    ]


def _in_titles(gap: Mapping[str, Any]) -> str:
    """What the names of a verdict stand for: of one that is not settled, of all that it may be."""
    beside = [_capital(perhaps(gap, name, _in_words)) for name in gap["also"]]
    if not settled(gap):
        titles = [*(f"If it is {name}: {_in_words(name)}" for name, _ in likeliest(gap)), *beside]
    elif gap["verdict"] == "none":
        return _whether(gap)
    else:
        titles = [effect_title(gap["verdict"]), *beside]
    return " ".join(f"{title}." for title in titles)


def _explained(gap: Mapping[str, Any], name: str, contained: str = "") -> list[str]:
    """What an unknown looks like, and what the verdict means for the predictions: if it is true.

    `contained` is whether a fit's numbers contain it, where there is a fit.
    """
    said = [_conditional(gap, name, words) for words in (gap.get("unknown", {}).get("text"),) if words]
    meaning = gap.get("meaning", {})
    if contained:
        return [*said, " ".join([contained, *meaning.get("remarks", ())])]
    text = meaning.get("text")
    return [*said, *([text if gap["verdict"] == "none" else _conditional(gap, name, text)] if text else [])]


def _conditional(gap: Mapping[str, Any], name: str, words: str) -> str:
    asked = condition(gap, name)
    return f"{_capital(asked)}: {words[0].lower()}{words[1:]}" if asked else words


def contained_sentence(gap: Mapping[str, Any], fit: Mapping[str, Any]) -> str:
    """Whether the numbers of a fit, by its fit.json, contain what was found, and what that moves."""
    meaning = gap.get("meaning")
    if not meaning:
        return ""
    found = [] if gap["verdict"] == "none" else [gap["verdict"], *gap["also"]]
    entry = fit.get("effect", {})
    put_in = [name for name in (entry.get("used", "none"), *entry.get("also", ())) if name != "none"]
    # what stands beside an unknown cause by its own name is no unknown cause
    missing, foreign = ([one for one in of if one not in other] for of, other in ((found, put_in), (put_in, found)))
    command, moves = meaning.get("command"), meaning.get("moves") or ""
    out = " The same command without `--effect` takes it out."
    if foreign:
        also = f", and not {_names(found)}, which was found" if found else ", which was not found"
        return f"The numbers here contain {_names(put_in)}, as was asked{also}.{out}"
    if not missing and found:
        what = "it" if settled(gap) else _FIRST
        return f"The numbers here contain {what}.{f' {moves}' if moves else ''}{out}"
    if not found or command is None:
        return str(meaning["text"]).removesuffix(" ".join(["", *meaning.get("remarks", ())]))
    how = f"`{command}` puts {'all of it' if len(found) > 1 else 'it'} in."
    moved = f" {_conditional(gap, _FIRST, moves)}" if moves else ""
    if put_in:
        return f"The numbers here contain {_names(put_in)}, and not {_names(missing)}: {how}{moved}"
    return f"The numbers here do not contain it: {how}{moved}"


def _names(effects: Iterable[str]) -> str:
    return " and ".join(map(_in_words, effects))


def _held_out_table(gap: Mapping[str, Any], of: Notation, unit: str) -> Table:
    """What a user predicts of a test from the others: how far that is off before and after."""
    shrink = gap["shrink"]
    tests = shrink.get("stable_amplitude", ()) if shrink.get("measurable", True) else ()
    damping = {test["test"]: test for test in (shrink.get("damping_discrepancy") or {}).get("tests", ())}
    factor, shown = shown_in(unit)
    rows = []
    for test in tests:
        curve = damping.get(test["test"], {})
        errors = [test["error_before"], test["error_after"], curve.get("before"), curve.get("after")]
        off = (of.missing if error is None else f"{100.0 * error:.1f} %" for error in errors)
        rows.append((test["test"], of.number(factor * test["measured"]), *off))
    return Table(
        "gap_amplitudes",
        "Errors of what the other tests foretell of each, before and after the effect is put in",
        ("test", f"measured [{of.unit(shown)}]", *_HELD_OUT),
        rows,
        "Amplitude: stable, over the measured one; damping: the curve, in the mean, over the relaxation damping.",
    )


def shrink_sentence(entry: Mapping[str, Any]) -> str:
    """How far the gap shrinks, from `shrink` of gap.json: what a user predicts first; empty where there is none."""
    if not entry:
        return ""
    if not entry.get("measurable", True):
        return "The gap in the amplitudes of the cycles is too small to measure how far it shrinks."
    return " ".join(words for words in (_headline(entry.get("headline")), _density(entry)) if words)


def _headline(head: Mapping[str, Any] | None) -> str:
    """Errors of what is predicted of a test from the others, or of a record in still air."""
    if not head:
        return ""
    if "records" in head:  # still air: nothing is stable
        return (
            f"Of records left out in turn, the damping curve is off by {_off(head['damping_before'])} before and "
            f"{_off(head['damping_after'])} of the structural damping after"
            f"{_worse(head['damping_worse'], head['records'])}."
        )
    tests = head["tests"]
    words = (
        "Of tests left out in turn, the stable amplitude is off by "
        f"{_off(head['amplitude_before'])} (median) before and {_off(head['amplitude_after'])} after"
        f"{_worse(head['amplitude_worse'], tests)}"
    )
    if "damping_before" in head:
        words += (
            f"; the damping curve by {_off(head['damping_before'])} and {_off(head['damping_after'])} "
            f"of the relaxation damping{_worse(head['damping_worse'], tests)}"
        )
    return f"{words}."


def _off(error: float | None) -> str:
    """A relative error; none where what is predicted has no stable amplitude, or no end."""
    return "more than any measure" if error is None else percent(error, 2)


def _worse(count: int, of: int) -> str:
    return f", made worse in {count} of {of}" if count else ""


def _density(entry: Mapping[str, Any]) -> str:
    """The part of the gap in the density of the records that closes."""
    words = f"Put into the model, it closes {_share(entry)} of the gap on the records used"
    if not entry.get("held_out"):
        return f"{words}; no record can be left out to test that on what the model has not seen."
    words += f", and {_share(entry['held_out'])} on records held out"
    runner, closed = entry.get("runner_up"), entry["held_out"].get("fraction")
    if not runner or runner["fraction"] is None:
        return f"{words}."
    leaves = ""
    if runner.get("amplitude_error") is not None:
        leaves = f", and leave the amplitude off by {percent(runner['amplitude_error'], 2)}"
    rival = f"the runner-up ({_in_words(runner['effect'])}) would close {share(runner['fraction'])}{leaves}"
    if closed is not None and round(runner["fraction"], 2) > round(closed, 2):
        return f"{words}. Of records held out the verdict is not the best account: {rival}."
    return f"{words}; {rival}."


def _share(entry: Mapping[str, Any]) -> str:
    if entry.get("fraction") is None:
        return "an unmeasurable part"
    if entry.get("interval90") is None:
        return f"{share(entry['fraction'])} (a single record: no interval)"
    low, high = entry["interval90"]
    return f"{share(entry['fraction'])} (90 % interval {share(low)} to {share(high)})"


def _probabilities(gap: Mapping[str, Any], title: Callable[[str], str]) -> list[tuple[str, str]]:
    likely = sorted(gap["probability"].items(), key=lambda pair: -pair[1])
    named = [(name, p) for name, p in likely if p >= PROBABILITY_SHOWN or name == "none"]
    others = [p for name, p in likely if (name, p) not in named]
    rows = [(title(name), f"{p:.3f}") for name, p in named]
    if others:
        rows.append((f"{len(others)} others together", f"{sum(others):.3f}"))
    beside = gap.get("probability_also", {})
    within = str if title is str else _in_words
    return [*rows, *((f"beside it: {within(name)}", f"{beside[name]:.3f}") for name in gap["also"] if name in beside)]


def _where_header(of: Notation, unit: str) -> tuple[str, ...]:
    shown = of.unit(shown_in(unit)[1])
    return tuple(f"{word} [{shown}]" if word == "amplitude" else word for word in _WHERE)


def _places(gap: Mapping[str, Any], of: Notation, unit: str) -> list[tuple[str, ...]]:
    """Where the null model and the records part, a row each, the number of standard deviations last."""
    factor = shown_in(unit)[0]
    return [
        (
            place["quantity"], place["rig"] or of.missing, place["test"] or "still air", place["record"] or of.missing,
            of.range(None if place["amplitude"] is None else [factor * end for end in place["amplitude"]], 3),
            of.range(place["time_s"], 3), _excess(place, of, unit),
            of.number(place["significance"], 2),
        )
        for place in gap["where"]
    ]  # fmt: skip


def _parameter(key: str) -> str:
    """A parameter of an effect in words: "epsilon[Sc 1.9]" is ε of the test Sc 1.9."""
    name, _, of = key.removesuffix("]").partition("[")
    words = PARAMETERS.get(name, name.replace("_", " "))
    return f"{words}, {of}" if of else words


def _excess(place: Mapping[str, Any], of: Notation, unit: str) -> str:
    """An excess: of damping and of an amplitude, given in this unit, as they are shown; else relative."""
    kind = DAMPING if place["quantity"] in _OF_DAMPING else unit if place["quantity"] == "spectrum" else ""
    if place["excess"] is None or not kind:
        return of.number(place["excess"], 3)
    factor, shown = shown_in(kind)
    return f"{of.number(factor * place['excess'], 3)} {of.unit(shown)}".rstrip()


def _sizes(gap: Mapping[str, Any], of: Notation, most: int | None = None) -> list[Any]:
    """How large every effect is, a row each of its parameters, of at most so many."""
    page = of is PAGE
    return [
        (
            _capital(perhaps(gap, name, _in_words)) * (not i) if page else perhaps(gap, name, str),
            _parameter(key) if page else key,
            *of.interval(size["median"], *(size["interval90"] or (None, None))),
            of.unit(size["unit"]),
            "" if page and i else size["form"],
        )
        for name, effect in gap["effects"].items()
        for i, (key, size) in enumerate(list(effect["parameters"].items())[:most])
    ]


def _sizes_note(gap: Mapping[str, Any], most: int | None = None) -> str:
    """What sizes are of, and how many parameters are not listed, where at most so many of an effect are."""
    parameters = [effect["parameters"] for effect in gap["effects"].values()]
    relative = any(size["unit"] in (RELAXATION, REFERENCE) for sizes in parameters for size in sizes.values())
    left = sum(max(0, len(sizes) - most) for sizes in parameters) if most else 0
    notes = [
        f"Relaxation damping and reference amplitude are those of {gap.get('sizes_refer_to')}." if relative else "",
        f"{left} more are in gap.json." if left else "",
    ]
    return " ".join(filter(None, notes))
