"""The gap between the null model and the records: where, which effect, how far it shrinks, what would settle it."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from scruton.dynamics.effects import CATALOGUE, UNKNOWN
from scruton.gap.thresholds import SETTLED
from scruton.report.chapters.material import Material
from scruton.report.conventions import DAMPING, shown_in
from scruton.report.document import CAUTION, Block, Callout, Heading, Listing, Table, paragraph
from scruton.report.thresholds import NAMED_ABOVE, PLACES_SHOWN, PROBABILITY_SHOWN
from scruton.report.wording import PAGE, PARAMETERS, TERMINAL, Notation, number, percent, share

_SIZE = ("parameter", "median", "90 % interval", "unit", "form")
_WHERE = ("quantity", "rig", "test", "record", "amplitude", "time [s]", "excess")
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
    if material.fit.summary["provenance"]["tests"]:
        words = "The diagnosis uses every test of the campaign, those that the fit left out among them."
        yield Callout(CAUTION, words)
    for words in (*_explained(gap), shrink_sentence(gap["shrink"])):
        if words:
            yield paragraph(words)
    if alike := [" or ".join(map(_in_words, group)) for group in gap["indistinguishable"] if len(group) > 1]:
        yield Callout(CAUTION, "These data cannot tell apart", alike)
    yield from material.of("gap")
    likely = _probabilities(gap, effect_title)
    yield Table("gap_probability", "What explains the gap", ("cause", "probability"), likely)
    yield _where_table(gap, material.unit)
    numeric = (False, False, True, True, False, False)
    factor, unit = material.shown
    sizes = _sizes(gap, PAGE, effect_title)
    yield Table("gap_size", "How large the effect is", ("effect", *_SIZE), sizes, numeric=numeric)
    rows = [
        (
            test["test"], *(number(factor * test[key]) for key in ("measured", "before", "after")),
            *(f"{100.0 * test[key]:.1f} %" for key in ("error_before", "error_after")),
        )
        for test in gap["shrink"].get("stable_amplitude", ())
    ]  # fmt: skip
    yield Table(
        "gap_amplitudes",
        f"Stable amplitude of every test before and after the effect is put in [{unit}]",
        ("test", "measured", "null model", "with the effect", "off before", "off after"),
        rows,
    )
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
    """The verdict in one sentence; below 0.8 with what else it may be."""
    if not _settled(gap):
        return f"{_whether(gap)} Not settled: {_candidates(gap, _in_words)}."
    if gap["verdict"] == "none":
        return _whether(gap)
    names = [_in_words(gap["verdict"]), *(f"{_in_words(name)}{_chance(gap, name)}" for name in gap["also"])]
    sure = _odds(gap["probability"][gap["verdict"]])
    return f"{_whether(gap)} What explains it: {names[0]} (probability {sure})" + (
        f", and {' and '.join(names[1:])}." if names[1:] else "."
    )


def _whether(gap: Mapping[str, Any]) -> str:
    """Whether the null model and the records part, in a sentence."""
    if gap["verdict"] != "none":
        return "The null model and the records part."
    if not _settled(gap):
        return "Nothing is found that must be there."
    return "The null model and the records agree within their noise."


def _settled(gap: Mapping[str, Any]) -> bool:
    return bool(gap["probability"][gap["verdict"]] >= SETTLED)


def _odds(p: float) -> str:
    return "above 0.99" if p > 0.99 else number(p, 2)


def _chance(gap: Mapping[str, Any], name: str) -> str:
    p = gap.get("probability_also", {}).get(name)
    return "" if p is None else f" ({_odds(p)})"


def _candidates(gap: Mapping[str, Any], title: Callable[[str], str]) -> str:
    """The likeliest causes with their shares, and that of no gap, which comes first where it leads."""
    likely = sorted(gap["probability"].items(), key=lambda pair: -pair[1])
    causes = [(name, p) for name, p in likely if name != "none"]
    named = [f"{title(name)} ({share(p)})" for i, (name, p) in enumerate(causes) if i < 2 or p >= NAMED_ABOVE]
    none = share(gap["probability"].get("none", 0.0))
    if gap["verdict"] == "none":
        return f"no gap ({none}), or {' or '.join(named)}"
    return f"{' or '.join(named)}; no gap {none}"


def gap_summary(gap: Mapping[str, Any], unit: str) -> list[Block]:
    """The diagnosis for the terminal, of amplitudes in this unit: every place, and effects by the names of files."""
    names = [gap["verdict"], *gap["also"]]
    alike = "; ".join(" / ".join(group) for group in gap["indistinguishable"] if len(group) > 1)
    titles = _whether(gap) if names == ["none"] else " ".join(f"{effect_title(name)}." for name in names)
    probability = "Probability (calibrated on simulated campaigns)"
    verdict = f"Verdict: {' and '.join([names[0], *(f'{name}{_chance(gap, name)}' for name in names[1:])])}. {titles}"
    if not _settled(gap):
        verdict = f"Not settled: {_candidates(gap, str)}. {titles}"
    return [
        paragraph(verdict),
        *(paragraph(words) for words in _explained(gap)),
        Table("gap_probability", probability, ("cause", "probability"), _probabilities(gap, str)),
        *([paragraph(f"These data cannot tell apart: {alike}")] if alike else []),
        Table("gap_size", "Parameters", ("effect", *_SIZE), _sizes(gap, TERMINAL, str, most=6)),
        Table("gap_where", "Where", _where_header(TERMINAL, unit), [row[:-1] for row in _places(gap, TERMINAL, unit)]),
        paragraph(shrink_sentence(gap["shrink"])),
        Listing(gap["advice"]),
        *([paragraph(f"{_INVISIBLE}:")] if gap["invisible"] else []),
        Listing([entry["text"] for entry in gap["invisible"]]),
    ]


def _explained(gap: Mapping[str, Any]) -> list[str]:
    """What the verdict means for the predictions, and what an unknown looks like."""
    return [words for key in ("unknown", "meaning") if (words := gap.get(key, {}).get("text"))]


def contained_sentence(gap: Mapping[str, Any], fit: Mapping[str, Any]) -> str:
    """Whether the numbers of a fit, by its fit.json, contain what was found, and what that would move."""
    if gap["verdict"] == "none" or not gap.get("meaning"):
        return ""
    if fit.get("effect", {}).get("used") == gap["verdict"]:
        return "The numbers here contain it."
    return f"The numbers here do not contain it. {gap['meaning']['text']}"


def shrink_sentence(entry: Mapping[str, Any]) -> str:
    """How far the gap shrinks, from `shrink` of gap.json: what a user predicts first; empty where there is none."""
    if not entry:
        return ""
    if not entry.get("measurable", True):
        return "The gap is too small to measure how far it shrinks."
    return " ".join(words for words in (_headline(entry.get("headline")), _density(entry)) if words)


def _headline(head: Mapping[str, Any] | None) -> str:
    """Errors of what is predicted of a test from the others."""
    if not head:
        return ""
    tests = head["tests"]
    words = (
        "Of tests left out in turn, the stable amplitude is off by "
        f"{percent(head['amplitude_before'], 2)} (median) before and {percent(head['amplitude_after'], 2)} after"
        f"{_worse(head['amplitude_worse'], tests)}"
    )
    if "damping_before" in head:
        words += (
            f"; the damping curve by {percent(head['damping_before'], 2)} and {percent(head['damping_after'], 2)} "
            f"of the relaxation damping{_worse(head['damping_worse'], tests)}"
        )
    return f"{words}."


def _worse(count: int, of: int) -> str:
    return f", made worse in {count} of {of}" if count else ""


def _density(entry: Mapping[str, Any]) -> str:
    """The part of the gap in the density of the records that closes."""
    words = f"Put into the model, it closes {_share(entry)} of the gap on the records used"
    if not entry.get("held_out"):
        return f"{words}; no record can be left out to test that on what the model has not seen."
    words += f", and {_share(entry['held_out'])} on records held out"
    runner = entry.get("runner_up")
    if runner and runner["fraction"] is not None:
        words += f"; the runner-up ({_in_words(runner['effect'])}) would close {share(runner['fraction'])}"
        if runner.get("amplitude_error") is not None:
            words += f", and leave the amplitude off by {percent(runner['amplitude_error'], 2)}"
    return words + "."


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
    return [*rows, (f"{len(others)} others together", f"{sum(others):.3f}")] if others else rows


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
            of.range(place["time_s"], 3), _excess(place, of),
            of.number(place["significance"], 2),
        )
        for place in gap["where"]
    ]  # fmt: skip


def _parameter(key: str) -> str:
    """A parameter of an effect in words: "epsilon[Sc 1.9]" is ε of the test Sc 1.9."""
    name, _, of = key.removesuffix("]").partition("[")
    words = PARAMETERS.get(name, name.replace("_", " "))
    return f"{words}, {of}" if of else words


def _excess(place: Mapping[str, Any], of: Notation) -> str:
    """An excess: of damping as it is shown, else relative."""
    value = place["excess"]
    if value is None or place["quantity"] != "damping":
        return of.number(value, 3)
    factor, unit = shown_in(DAMPING)
    return f"{of.number(factor * value, 3)} {unit}".rstrip()


def _sizes(gap: Mapping[str, Any], of: Notation, title: Callable[[str], str], most: int | None = None) -> list[Any]:
    """How large every effect is, a row each of its parameters, of at most so many."""
    page = title is not str
    return [
        (
            "" if page and i else title(name),
            _parameter(key) if page else key,
            *of.interval(size["median"], *(size["interval90"] or (None, None))),
            of.unit(size["unit"]),
            "" if page and i else size["form"],
        )
        for name, effect in gap["effects"].items()
        for i, (key, size) in enumerate(list(effect["parameters"].items())[:most])
    ]
