"""The records that were found as a campaign.toml with comments, grouped into rigs and tests by their names."""

import json
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from scruton.app.init.channels import QUANTITIES, SCALES, Found, unit_of
from scruton.campaign import units
from scruton.campaign.bounded import relative_to
from scruton.campaign.load import UNFILLED
from scruton.campaign.readers import is_delimited
from scruton.campaign.schema import Kind
from scruton.campaign.spelling import nearest
from scruton.errors import InputError

_KINDS = re.compile(
    r"(still[ _-]*air|free[ _-]*decay|ring[ _-]*down|still|free|growth|decay|steady|lock[ _-]*in|gtr|dtr)(?![a-z])",
    re.IGNORECASE,
)
_DIGITS = re.compile(r"(?<=\d)p(?=\d)")
_DAMPED = re.compile(r"(?:sc|xi|zeta|damp\w*)[ _=-]*(\d+(?:\.\d+)?)$", re.IGNORECASE)  # a test called by its damping
_RATE = 1000.0  # Hz, an example of a sample rate
_APART, _ALIKE = 1.4, 1.25  # least factor between neighbours, largest one between numbers that are proportional

ANSWER = "answer"  # where an error of one stands


class Question(NamedTuple):
    """What no file of records tells, and of which rigs, tests or channels it is asked, if of any."""

    key: str
    what: str
    example: str  # as an answer
    read: Callable[[str, str], object]  # of an answer and `what`; InputError for what is none
    of: tuple[str, ...] = ()


def of_quantity(key: str, what: str, dimension: units.Dimension, of: tuple[str, ...] = ()) -> Question:
    """Ask for a quantity."""
    example = dimension.spelling.strip('"')

    def read(text: str, what: str) -> object:
        try:
            return units.parse_quantity(text, dimension, ANSWER, what)
        except InputError as error:
            # what is wanted in a file is a line with its key and quotes: here, what is to be typed
            line = f"{what.rpartition('.')[2]} = {dimension.spelling}"
            raise InputError(error.file, error.field, error.found, error.wanted.replace(line, example)) from None

    return Question(key, what, example, read, of)


@dataclass(frozen=True, eq=False)
class Groups:
    """The records of one motion, by rig, and by test and its rig, which is empty where nothing tells it."""

    angular: bool
    found: list[Found]
    rigs: dict[str, list[Found]]
    tests: dict[tuple[str, str], list[Found]]
    by_damping: bool  # whether the rigs of tests are told by the damping in their names

    @property
    def mass(self) -> str:
        """The key of what a rig weighs."""
        return "inertia" if self.angular else "mass"

    def of(self, rig: str) -> list[Found]:
        """Records of a rig in still air; else those of its tests, or of all where none is said to be of it."""
        own = self.rigs[rig] or [one for (_, name), records in self.tests.items() if name == rig for one in records]
        return own or [one for records in self.tests.values() for one in records]

    def questions(self) -> list[Question]:
        """What is to be asked."""
        asked = [
            of_quantity("width", "width of the section along the wind, B", units.LENGTH),
            of_quantity("depth", "depth of the section across the wind, D", units.LENGTH),
        ]
        if self.tests:
            dimension = units.INERTIA if self.angular else units.MASS
            silent = tuple(name for (name, _), records in self.tests.items() if records[0].wind_speed is None)
            asked += [
                of_quantity(self.mass, f"{self.mass} per unit length", dimension, tuple(self.rigs)),
                of_quantity("air_density", "air density", units.DENSITY),
                *([of_quantity("wind_speed", "wind speed", units.SPEED, silent)] if silent else []),
            ]
        if homeless := tuple(name for name, rig in self.tests if not rig):
            asked.append(Question("rig", "the rig", next(iter(self.rigs)), self._rig_named, homeless))
        if undamped := tuple(name for name, records in self.rigs.items() if not records):
            what = "structural damping ratio (no ring-down in still air was found)"
            asked.append(of_quantity("damping_ratio", what, units.DAMPING_RATIO, undamped))
        if uncalibrated := tuple(dict.fromkeys(one.response.name for one in self.found if one.uncalibrated)):
            example = next(SCALES[one.quantity] for one in self.found if one.uncalibrated)
            asked.append(Question("scale", "calibration or sensitivity", example, self._scale, uncalibrated))
        return asked

    def _rig_named(self, text: str, what: str) -> str:
        if text not in self.rigs:
            raise InputError(ANSWER, what, f'no rig "{text}"', nearest(text, self.rigs))
        return text

    def _scale(self, text: str, what: str) -> None:
        one = next(one for one in self.found if one.uncalibrated)
        try:
            units.scaled_factor(text, one.response.unit, lambda unit: units.unit_factor(unit, QUANTITIES[one.quantity]))
        except ValueError as error:
            wanted = f'a factor such as "{SCALES[one.quantity]}", or a sensitivity, "100 mV/g"'
            raise InputError(ANSWER, what, f'"{text}" for {one.response.unit} ({error})', wanted) from None


def campaign_text(
    folder: Path, groups: Groups, answers: Mapping[str, Mapping[str, str]], remarks: Sequence[str]
) -> str:
    """Spell the campaign; what nobody answered stands in a comment that is marked.

    The answers are by key, and below that by rig or test, or by the empty name where there is one for all.
    """
    wanted = {one.key: one for one in groups.questions()}

    def asked(key: str, of: str = "") -> str:
        if (answer := answers.get(key, {}).get(of)) is not None:
            return f"{key} = {_text(answer)}"
        bare = key == "damping_ratio"
        example = wanted[key].example if bare else _text(wanted[key].example)
        return f"# {key} = {example}  # {UNFILLED}: {wanted[key].what}"

    angular, found, rigs, tests = groups.angular, groups.found, groups.rigs, groups.tests
    lines = [
        "# Written by `scruton init`. Kinds, windows and groups are guesses from the envelopes and the names: look",
        "# them over. A line marked with two words in capitals is to be filled in: put the value, take the # away.",
        "format = 1", f"title = {_text(folder.resolve().name)}", "",
        "[section]", f'motion = "{"torsional" if angular else "heaving"}"', asked("width"), asked("depth"),
    ]  # fmt: skip
    if tests:
        lines += ["", "[defaults.tests]  # of every test that does not say otherwise", asked("air_density")]
    if any(one.timeless for one in found):
        lines += ["", "[defaults.records]  # of every record that does not say otherwise"]
        lines += [
            f'# sample_rate = "{_RATE:g} Hz"  # {UNFILLED}: no time in the files. Windows need it: run `scruton init`'
        ]
        lines += [f'# again, with --force and --sample-rate "{_RATE:g} Hz"']
    for name, records in rigs.items():
        of = groups.of(name)
        frequency = float(np.median([one.stretch.frequency for one in of]))
        lines += ["", "[[rigs]]", f"name = {_text(name)}"]
        lines += [asked(groups.mass, name)] if tests else []
        if all(one.timeless for one in of):
            line = f"the dominant line of its records is at {frequency:.4g} of the sample rate"
            lines += [f'# frequency = "{_RATE * frequency:.4g} Hz"  # {UNFILLED}: {line}']
        else:
            lines += [f'frequency = "{frequency:.4g} Hz"  # the dominant line of its records']
        if not records:
            lines += [asked("damping_ratio", name)]
        for one in records:
            lines += _record(one, found, "rigs", asked, folder)
    for (name, rig), records in tests.items():
        lines += ["", "[[tests]]", f"name = {_text(name)}"]
        guess = "  # a guess: names of tests and damping of rigs go together" if groups.by_damping else ""
        lines += [f"rig = {_text(rig)}{guess}" if rig else asked("rig", name)]
        stated = records[0].wind_speed
        if stated is not None:
            how = "the mean of a channel of its file" if records[0].wind_measured else "as its file says"
            lines += [f'wind_speed = "{stated:g} m/s"  # {how}']
        else:
            lines += [asked("wind_speed", name)]
        for one in records:
            lines += _record(one, found, "tests", asked, folder)
    if remarks:
        lines += ["", "# Left out:", *(f"# {' '.join(text.split())}" for text in remarks)]
    return "\n".join(lines) + "\n"


def grouped(found: Sequence[Found], folder: Path) -> Groups:
    """Group the records of the motion that most of them are of into rigs and tests, by their folders and names."""
    angular = Counter(one.angular for one in found).most_common(1)[0][0]
    found = [one for one in found if one.angular == angular]
    rigs: dict[str, list[Found]] = {}
    homes = _rig_folders(found, folder)
    for one in found:
        if home := homes.get(one.path):
            rigs.setdefault(home, []).extend([one] * (one.stretch.kind is Kind.FREE_DECAY))
        elif one.stretch.kind is Kind.FREE_DECAY:
            stem = re.sub(r"[ _-]+\d{1,2}$", "", one.path.stem) if _KINDS.search(one.path.stem) else one.path.stem
            rigs.setdefault(_short(stem) or "rig", []).append(one)
    tests: dict[tuple[str, str], list[Found]] = {}
    waiting = [one for one in found if one.stretch.kind is not Kind.FREE_DECAY]
    if waiting and not rigs:
        rigs["rig"] = []
    for one in waiting:
        name = f"{homes.get(one.path, '')} {_short(one.path.stem)}".strip() or "test"
        alike = [rig for rig in rigs if rig == name or re.match(rf"{re.escape(rig)}(?![0-9a-z])", name, re.IGNORECASE)]
        rig = homes.get(one.path) or (next(iter(rigs)) if len(rigs) == 1 else max(alike, key=len, default=""))
        if one.wind_speed is not None and not one.wind_measured:
            name += f" U {one.wind_speed:g}"
        elif one.response.group:
            name += f" {one.response.group}"
        tests.setdefault((name, rig), []).append(one)
    matched = _by_damping(rigs, [name for name, _ in tests]) if tests and not any(rig for _, rig in tests) else {}
    if matched:
        tests = {(name, matched[name]): records for (name, _), records in tests.items()}
    return Groups(angular, list(found), rigs, tests, bool(matched))


def _rig_folders(found: Sequence[Found], folder: Path) -> dict[Path, str]:
    """The rig of every file in a folder below, where there is one folder a rig; else empty.

    So it is where one of them has ring-downs and tests in wind, or several have ring-downs; one folder for still air
    and one for the wind tell no rig.
    """
    below = [one for one in found if one.path.parent != folder]
    kinds: dict[str, set[bool]] = {}
    for one in below:
        kinds.setdefault(one.path.relative_to(folder).parts[0], set()).add(one.stretch.kind is Kind.FREE_DECAY)
    told = any(len(of) == 2 for of in kinds.values()) or sum(True in of for of in kinds.values()) > 1
    return {one.path: _short(one.path.relative_to(folder).parts[0]) or "rig" for one in below} if told else {}


def _by_damping(rigs: Mapping[str, Sequence[Found]], tests: Sequence[str]) -> dict[str, str]:
    """Find the rig of each test called by its damping or Scruton number, which damping is in proportion to.

    Empty where a test is not called so, where they are not as many as rigs, or where the order is not beyond doubt.
    """
    stated = {name: float(said[1]) for name in tests if (said := _DAMPED.search(name))}
    measured = {
        rig: float(np.median(ratios))
        for rig, records in rigs.items()
        if (ratios := [one.stretch.damping_ratio for one in records if one.stretch.damping_ratio])
    }
    if not len(stated) == len(tests) == len(measured) == len(rigs) or min(*stated.values(), *measured.values()) <= 0.0:
        return {}
    names, order = sorted(stated, key=stated.__getitem__), sorted(measured, key=measured.__getitem__)
    factors = [stated[name] / measured[rig] for name, rig in zip(names, order, strict=True)]
    apart = [values[i + 1] / values[i] for values in (sorted(stated.values()), sorted(measured.values()))
             for i in range(len(values) - 1)]  # fmt: skip
    clear = min(apart, default=_APART) >= _APART and max(factors) <= _ALIKE * min(factors)
    return dict(zip(names, order, strict=True)) if clear else {}


def _short(stem: str) -> str:
    return _DIGITS.sub(".", _KINDS.sub("", stem)).strip(" _-").replace("_", " ")


def _record(
    one: Found, found: Sequence[Found], owner: str, asked: Callable[[str, str], str], folder: Path
) -> list[str]:
    """Spell the table of one record of a folder; `asked` spells what somebody may have been asked."""
    quantity = one.quantity
    key = "columns" if is_delimited(one.path) else "variables"
    names: dict[str, Any] = {quantity: one.response.key}
    stated: dict[str, str] = {}
    if not one.response.told:
        alike = (f for f in found if f.response.name == one.response.name)
        stated[quantity] = one.response.unit or unit_of(alike)
    if one.time is not None:
        names["time"] = one.time.key
        stated |= {} if one.time.told else {"time": one.time.unit or "s"}
    file, kind = relative_to(one.path, folder), one.stretch.kind.value
    lines = ["", f"[[{owner}.records]]", f"file = {_text(file)}", f'kind = "{kind}"']
    lines += [f"{name} = {_text(value)}" for name, value in one.source.layout.items()]
    if any(isinstance(value, int) or value.lower() != name for name, value in names.items()):
        lines.append(f"{key} = {_table(names)}")
    if stated:
        guess = "" if one.response.unit is not None else "  # a guess: the file does not say"
        lines.append(f"units = {_table(stated)}{guess}")
    if one.uncalibrated:
        lines.append(asked("scale", one.response.name))
    if one.others:
        lines.append(f"# other channels that move: {', '.join(one.others)}")
    if one.rate is not None:
        lines.append(f'sample_rate = "{one.rate:.10g} Hz"')
    for name, value in (("start", one.stretch.start), ("stop", one.stretch.stop)):
        if value is not None and not one.timeless:
            lines.append(f'{name} = "{value:.6g} s"')
    return lines


def _table(values: Mapping[str, Any]) -> str:
    return "{ " + ", ".join(f"{key} = {_text(value)}" for key, value in values.items()) + " }"


def _text(value: object) -> str:
    """Spell a string or a whole number as TOML does."""
    return str(value) if isinstance(value, int) else json.dumps(value, ensure_ascii=False)
