"""The tables of a diagnosis: errors of what is foretold, probabilities, places, and sizes."""

from collections.abc import Callable, Mapping
from typing import Any

from scruton.dynamics.effects.effect import DAMPING as RELAXATION
from scruton.dynamics.effects.effect import REFERENCE
from scruton.report.chapters.gap_words import capital, in_words
from scruton.report.conventions import SCRUTON, damping_words, decrements, shown_excess, shown_in, shown_size
from scruton.report.document import Table
from scruton.report.thresholds import PROBABILITY_SHOWN
from scruton.report.verdict import perhaps, told_apart_by_nothing
from scruton.report.wording import PAGE, PARAMETERS, Notation

_SIZE = ("parameter", "of", "median", "90 % interval", "unit", "form")
_ERRORS = ("amplitude, before", "amplitude, after", "damping, before", "damping, after")
_OFF_BY = "Amplitude: stable, over the measured one; damping: the curve, in the mean, over the relaxation damping."


def held_out_table(gap: Mapping[str, Any], of: Notation, unit: str) -> Table:
    """What a user predicts of a test from the others: how far that is off before and after.

    Of one test, and in still air, it is a record from the others; nothing is stable in still air.
    """
    shrink = gap["shrink"]
    if not shrink.get("put_in", True):  # there is no after
        shrink = {}
    tests = shrink.get("stable_amplitude", ())
    curves = shrink.get("damping_discrepancy") or {}

    def off(*errors: float | None) -> tuple[str, ...]:
        return tuple(of.missing if error is None else f"{100.0 * error:.1f} %" for error in errors)

    (factor, shown), (per, _) = shown_in(unit), shown_in(SCRUTON)
    records = curves.get("records", ())
    if not tests and "test" in (shrink.get("headline") or {}):
        level = {one["record"]: one for one in shrink["stable_amplitude_of_records"]}
        nothing = dict.fromkeys(("measured", "error_before", "error_after"))
        rows = []
        for curve in records:
            one = level.get(curve["record"], nothing)
            rows.append((
                curve["record"], curve.get("rig", of.missing),
                of.missing if one["measured"] is None else of.number(factor * one["measured"]),
                *off(one["error_before"], one["error_after"], curve["before"], curve["after"]),
            ))  # fmt: skip
        return Table(
            "gap_amplitudes",
            "Errors of what the other records of the test foretell of each, before and after the effect is put in",
            ("record", "rig", f"measured [{of.unit(shown)}]", *_ERRORS),
            rows,
            f"{_OFF_BY} A record that has not settled shows no stable amplitude.",
            (False, False, True, True, True, True, True),
        )
    if parts := curves.get("amplitudes", ()):
        over = "relaxation" if shrink["headline"]["in_wind"] else "structural"
        return Table(
            "gap_amplitudes",
            "Errors of what the rest of the record foretells of its large and its small amplitudes, before and after "
            "the effect is put in",
            ("record", "rig", f"amplitudes [{of.unit(shown)}]", *_ERRORS[2:]),
            [
                (one["record"], one["rig"], of.range([factor * end for end in one["amplitude"]], 3),
                 *off(one["before"], one["after"]))
                for one in parts
            ],
            f"Damping: the curve, in the mean, over the {over} damping.",
            (False, False, True, True, True),
        )  # fmt: skip
    if not tests:
        return Table(
            "gap_amplitudes",
            "Errors of what the other records foretell of each, before and after the effect is put in",
            ("record", "rig", *_ERRORS[2:]),
            [(one["record"], one.get("rig", of.missing), *off(one["before"], one["after"])) for one in records],
            "Damping: the curve, in the mean, over the structural damping.",
            (False, False, True, True),
        )
    damping = {test["test"]: test for test in curves.get("tests", ())}
    rows = []
    for test in tests:
        curve, number = damping.get(test["test"], {}), test.get("scruton_number")
        rows.append((
            test["test"], test.get("rig", of.missing), of.missing if number is None else of.number(per * number, 3),
            of.number(factor * test["measured"]),
            *off(test["error_before"], test["error_after"], curve.get("before"), curve.get("after")),
        ))  # fmt: skip
    return Table(
        "gap_amplitudes",
        "Errors of what the other tests foretell of each, before and after the effect is put in",
        ("test", "rig", "Sc", f"measured [{of.unit(shown)}]", *_ERRORS),
        rows,
        _OFF_BY,
        (False, False, True, True, True, True, True, True),
    )


def probability_table(gap: Mapping[str, Any], caption: str, title: Callable[[str], str]) -> Table:
    """The causes by their probabilities, and under them how sure these are."""
    note = f"{capital(gap['calibrated_on'])}."
    return Table("gap_probability", caption, ("cause", "probability"), _probabilities(gap, title), note)


def _probabilities(gap: Mapping[str, Any], title: Callable[[str], str]) -> list[tuple[str, str]]:
    likely = sorted(gap["probability"].items(), key=lambda pair: -pair[1])
    grouped = {name for group in told_apart_by_nothing(gap) for name in group}  # each has a row of its own
    named = [(name, p) for name, p in likely if p >= PROBABILITY_SHOWN or name == "none" or name in grouped]
    others = [p for name, p in likely if (name, p) not in named]
    rows = [(title(name), f"{p:.3f}") for name, p in named]
    if others:
        rows.append((f"{len(others)} others together", f"{sum(others):.3f}"))
    beside = gap.get("probability_also", {})
    within = str if title is str else in_words
    return [*rows, *((f"beside it: {within(name)}", f"{beside[name]:.3f}") for name in gap["also"] if name in beside)]


def where_table(gap: Mapping[str, Any], of: Notation, unit: str, caption: str, most: int | None = None) -> Table:
    """Where the null model and the records part, at most so many places: what is seen there in words, and how much.

    How surely stands on a page alone: lines of a terminal are short.
    """
    columns = 8 if of is PAGE else 7
    factor, shown = shown_in(unit)
    rows = [
        (
            _seen(place), place["rig"] or of.missing, place["test"] or "still air", place["record"] or of.missing,
            of.range(None if place["amplitude"] is None else [factor * end for end in place["amplitude"]], 3),
            of.range(place["time_s"], 3), _excess(place, of, unit), of.number(place["significance"], 2),
        )
        for place in gap["where"]
    ]  # fmt: skip
    left = len(rows) - most if most else 0
    more = f" {left} more are in gap.json." if left > 0 else ""
    return Table(
        "gap_where",
        caption,
        ("what", "rig", "test", "record", f"amplitude [{of.unit(shown)}]", "time [s]", "excess", "z")[:columns],
        [row[:columns] for row in rows[:most]],
        "Excess: of what is named first, measured minus null model; of an effect that was found, what it adds there"
        + (f"; z: how many standard deviations.{more}" if of is PAGE else "."),
        (False, False, False, False, True, True, True, True)[:columns],
    )


def _seen(place: Mapping[str, Any]) -> str:
    """What is seen at a place, in words."""
    words = place["detail"] or place["quantity"]
    if decrements():
        words = words.replace("damping ratio", damping_words())
    return str(words)


def _excess(place: Mapping[str, Any], of: Notation, unit: str) -> str:
    """An excess with its unit, amplitudes being given in this one."""
    if place["excess"] is None:
        return of.missing
    factor, shown = shown_excess(place["quantity"], unit)
    return f"{of.number(factor * place['excess'], 3)} {of.unit(shown)}".removesuffix(" ")


def size_table(gap: Mapping[str, Any], of: Notation, caption: str, most: int | None = None) -> Table:
    """How large every effect is, a row each of its parameters, of at most so many, with what each belongs to."""
    page = of is PAGE
    rows = [
        (
            capital(perhaps(gap, name, in_words)) * (not i) if page else perhaps(gap, name, str),
            *_parameter(key, size, of), *_interval(size, of), "" if page and i else size["form"],
        )
        for name, effect in gap["effects"].items()
        for i, (key, size) in enumerate(list(effect["parameters"].items())[:most])
    ]  # fmt: skip
    numeric = (False, False, False, True, True, False, False) if page else ()
    return Table("gap_size", caption, ("effect", *_SIZE), rows, _sizes_note(gap, most), numeric)


def _parameter(key: str, size: Mapping[str, Any], of: Notation) -> tuple[str, str]:
    """A parameter of an effect, on a page in words, and what it belongs to: "epsilon[Sc 1.9]" is ε of Sc 1.9."""
    name, _, owner = key.removesuffix("]").partition("[")
    words = PARAMETERS.get(name, name.replace("_", " ")) if of is PAGE else name
    return words, size.get("of") or owner or of.missing


def _interval(size: Mapping[str, Any], of: Notation) -> tuple[str, str, str]:
    """Median, interval and unit, as they are shown."""
    *ends, unit = shown_size(size)
    return *of.interval(*ends), of.unit(unit)


def _sizes_note(gap: Mapping[str, Any], most: int | None) -> str:
    """What sizes are of, and how many parameters are not listed, where at most so many of an effect are."""
    parameters = [effect["parameters"] for effect in gap["effects"].values()]
    relative = any(size["unit"] in (RELAXATION, REFERENCE) for sizes in parameters for size in sizes.values())
    left = sum(max(0, len(sizes) - most) for sizes in parameters) if most else 0
    notes = [
        f"Relaxation damping and reference amplitude are those of {gap.get('sizes_refer_to')}." if relative else "",
        f"{left} more are in gap.json." if left else "",
    ]
    return " ".join(filter(None, notes))
