"""The records that were found as a campaign.toml with comments, grouped into rigs and tests by their names."""

import json
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from scruton.app.init.channels import Found, unit_of
from scruton.campaign import units
from scruton.campaign.load import UNFILLED
from scruton.campaign.readers import is_delimited
from scruton.campaign.schema import Kind

_KINDS = re.compile(
    r"(still[ _-]*air|free[ _-]*decay|ring[ _-]*down|still|free|growth|decay|steady|lock[ _-]*in|gtr|dtr)(?![a-z])",
    re.IGNORECASE,
)
_DIGITS = re.compile(r"(?<=\d)p(?=\d)")
Question = tuple[str, units.Dimension, bool]


def questions(angular: bool) -> dict[str, Question]:
    """What no file of records tells: the words, the dimension, and whether only tests in the wind need it."""
    mass = "inertia" if angular else "mass"
    return {
        "width": ("width of the section along the wind, B", units.LENGTH, False),
        "depth": ("depth of the section across the wind, D", units.LENGTH, False),
        mass: (f"{mass} per unit length of every rig", units.INERTIA if angular else units.MASS, True),
        "air_density": ("air density", units.DENSITY, True),
        "wind_speed": ("wind speed of every test", units.SPEED, True),
    }


def campaign_text(folder: Path, found: Sequence[Found], answers: Mapping[str, str], remarks: Sequence[str]) -> str:
    """Spell the campaign; what nobody answered stands in a comment that is marked."""
    angular = Counter(one.angular for one in found).most_common(1)[0][0]
    found = [one for one in found if one.angular == angular]
    wanted = questions(angular)

    def asked(key: str) -> str:
        if answers.get(key):
            return f"{key} = {_text(answers[key])}"
        what, dimension, _ = wanted[key]
        return f"# {key} = {dimension.spelling}  # {UNFILLED}: {what}"

    rigs, tests = _grouped(found)
    speed = answers.get("wind_speed")
    lines = [
        "# Written by `scruton init`. Kinds, windows and groups are guesses from the envelopes and the names: look",
        "# them over. A line marked with two words in capitals is to be filled in: put the value, take the # away.",
        "format = 1", f"title = {_text(folder.resolve().name)}", "",
        "[section]", f'motion = "{"torsional" if angular else "heaving"}"', asked("width"), asked("depth"),
    ]  # fmt: skip
    if tests:
        usual = [asked("air_density")] + ([asked("wind_speed")] if speed else [])
        lines += ["", "[defaults.tests]  # of every test that does not say otherwise", *usual]
    timeless = [one for one in found if one.time is None and one.response.clock is None]
    if any(one.rate is None for one in timeless):
        lines += ["", "[defaults.records]  # of every record that does not say otherwise"]
        lines += [f'# sample_rate = "1000 Hz"  # {UNFILLED}: no time in the files; then `scruton init --sample-rate`']
    mass = "inertia" if angular else "mass"
    for name, records in rigs.items():
        frequency = float(np.median([one.stretch.frequency for one in (records or tests_of(tests, name))]))
        lines += ["", "[[rigs]]", f"name = {_text(name)}"]
        lines += [asked(mass)] if tests else []
        lines += [f'frequency = "{frequency:.4g} Hz"  # the dominant line of its records']
        if not records:
            lines += [f"# damping_ratio = 0.005  # {UNFILLED}: no ring-down in still air was found"]
        for one in records:
            lines += _record(one, found, "rigs")
    for (name, rig), records in tests.items():
        lines += ["", "[[tests]]", f"name = {_text(name)}"]
        lines += [
            f"rig = {_text(rig)}" if rig else f"# rig = {_text(next(iter(rigs)))}  # {UNFILLED}: the rig it is of"
        ]
        stated = records[0].wind_speed
        if stated is not None:
            lines += [f'wind_speed = "{stated:g} m/s"  # as its file says']
        elif not speed:
            lines += [asked("wind_speed")]
        for one in records:
            lines += _record(one, found, "tests")
    if remarks:
        lines += ["", "# Left out:", *(f"# {' '.join(text.split())}" for text in remarks)]
    return "\n".join(lines) + "\n"


def tests_of(tests: Mapping[tuple[str, str], list[Found]], rig: str) -> list[Found]:
    """Records of the tests of a rig, or of all where none is said to be of it."""
    own = [one for (_, name), records in tests.items() if name == rig for one in records]
    return own or [one for records in tests.values() for one in records]


def _grouped(found: Sequence[Found]) -> tuple[dict[str, list[Found]], dict[tuple[str, str], list[Found]]]:
    """Rigs by name, and tests by name and rig; the rig is empty where the names do not tell it."""
    rigs: dict[str, list[Found]] = {}
    for one in found:
        if one.stretch.kind is Kind.FREE_DECAY:
            stem = re.sub(r"[ _-]+\d{1,2}$", "", one.path.stem) if _KINDS.search(one.path.stem) else one.path.stem
            rigs.setdefault(_short(stem) or "rig", []).append(one)
    tests: dict[tuple[str, str], list[Found]] = {}
    waiting = [one for one in found if one.stretch.kind is not Kind.FREE_DECAY]
    if waiting and not rigs:
        rigs["rig"] = []
    for one in waiting:
        name = _short(one.path.stem) or "test"
        alike = [rig for rig in rigs if rig == name or re.match(rf"{re.escape(rig)}(?![0-9a-z])", name, re.IGNORECASE)]
        rig = next(iter(rigs)) if len(rigs) == 1 else max(alike, key=len, default="")
        if one.wind_speed is not None:
            name += f" U {one.wind_speed:g}"
        elif one.response.group:
            name += f" {one.response.group}"
        tests.setdefault((name, rig), []).append(one)
    return rigs, tests


def _short(stem: str) -> str:
    return _DIGITS.sub(".", _KINDS.sub("", stem)).strip(" _-").replace("_", " ")


def _record(one: Found, found: Sequence[Found], owner: str) -> list[str]:
    """Spell the table of one record."""
    quantity = "rotation" if one.angular else "displacement"
    key = "columns" if is_delimited(one.path) else "variables"
    names: dict[str, Any] = {quantity: one.response.key}
    stated: dict[str, str] = {}
    if one.response.unit is None:
        stated[quantity] = unit_of(f for f in found if f.response.name == one.response.name)
    if one.time is not None:
        names["time"] = one.time.key
        stated |= {"time": "s"} if one.time.unit is None else {}
    lines = ["", f"[[{owner}.records]]", f"file = {_text(one.path.name)}", f'kind = "{one.stretch.kind.value}"']
    lines += [f"{name} = {_text(value)}" for name, value in one.source.layout.items()]
    if any(isinstance(value, int) or value.lower() != name for name, value in names.items()):
        lines.append(f"{key} = {_table(names)}")
    if stated:
        guess = "" if quantity not in stated else "  # a guess: the file does not say"
        lines.append(f"units = {_table(stated)}{guess}")
    timed = one.time is not None or one.response.clock is not None or one.rate is not None
    if one.rate is not None:
        lines.append(f'sample_rate = "{one.rate:.10g} Hz"')
    for name, value in (("start", one.stretch.start), ("stop", one.stretch.stop)):
        if value is not None and timed:
            lines.append(f'{name} = "{value:.6g} s"')
    return lines


def _table(values: Mapping[str, Any]) -> str:
    return "{ " + ", ".join(f"{key} = {_text(value)}" for key, value in values.items()) + " }"


def _text(value: object) -> str:
    """Spell a string or a whole number as TOML does."""
    return str(value) if isinstance(value, int) else json.dumps(value, ensure_ascii=False)
