"""Every number that a sizing rests on, with where it is from; and the bridge's files themselves."""

import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.shown import fields_in_brief, shown
from scruton.sizing.bridge import Bridge, Mode
from scruton.sizing.limits import limit
from scruton.sizing.mode_shape import ModeShape
from scruton.sizing.thresholds import (
    DAMPING_TEST_COV,
    LARGEST_ADDED,
    LOCK_IN_MARGIN,
    MODAL_MASS_COV,
    ONE_RIG,
    STEADY_COV,
)

STATED, DEFAULT, COMPUTED = "stated", "default", "computed"
# Where a default comes from, by the last of its names; the program's own judgement where it is not here.
SOURCES = {
    "air_density": "sea level, 15 degrees",
    "coherence": "full coherence along the span",
    "damping_ratio": "steel box girders: median 0.3 %, not below 0.1 %",
    "damping_ratio.sd": "a coefficient of variation of 45 %: what repeated identification of one bridge scatters by",
    "frequency.sd": "2 % between calculation and bridge, 0.5 % once it is identified",
    "turbulence": "median 1, 15 %: the spread of a handbook's factor over 5 to 12 % of turbulence",
    "reynolds_number": "median 1, 15 %, by judgement: published cases err to either side",
    "details": "median 1, 10 %, by judgement",
    "modal_mass": "mass times length times the mean square of the shape",
    "family": "lognormal, since what is stated is positive; beta for a fraction",
    "modal_mass_cov": "as the mass varies, else 5 %",
    "largest_stroke": "what there is room for between girder webs",
    "smallest_mass_ratio": "a lighter damper lives by its tuning",
    "kept_detuning": "what frequencies of finished bridges are off by",
    "lever_arm": "half the width",
    "lock_in": "that of the tests",
    "shape": "a sine, unless another is named",
    "half_waves": "one",
    "share": "all of the time",
}
# Of what was identified without an uncertainty; the rest is as of SOURCES.
IDENTIFIED = {"damping_ratio.sd": "a coefficient of variation of 15 %: what damping tests of one bridge scatter by"}
# What the program sets by itself, and no bridge.toml: value and reason.
PROGRAM = {
    "largest_added_damping": (LARGEST_ADDED, "more cannot be added to a bridge: beyond it stands not achievable"),
    "one_rig_discrepancy": (ONE_RIG, "what settings of one body were seen to miss its curve by at the worst"),
    "lock_in_margin": (
        LOCK_IN_MARGIN, "how far lock-in reaches to either side of a peak test, where neither bridge nor tests tell it",
    ),
    "damping_test_cov": (DAMPING_TEST_COV, "of a damping test that could be made, for what it is worth"),
    "steady_cov": (STEADY_COV, "of a steady amplitude of a test that could be made, for what it is worth"),
}  # fmt: skip
JUDGEMENT = "the program's default, set by judgement"
# What is no number of the bridge, or is in its files as a table of numbers.
_LEFT_OUT = (
    "motion", "sha256", "documents", "limits", "speed", "hours", "lock_in_shape", "assumed", "name", "others", "given",
)  # fmt: skip
# Where bridge.toml says what stands at another place in the bridge.
_WRITTEN = (
    (r"\.modal_mass_cov$", ".modal_mass.sd"),
    (r"\.designed\[0\]", ".frequency"),
    (r"\.designed\[1\]", ".damping_ratio"),
)


@dataclass(frozen=True)
class Input:
    """One: its place in bridge.toml ("modes[0].mass.sd"), its value in SI, where it is from, and by what.

    The origin is "stated" (in bridge.toml), "default", "computed" from what is stated, "command line" or "identified"
    (on the finished bridge, there or in bridge.toml).  Places that begin with "program" are not of bridge.toml.
    """

    name: str
    value: Any
    origin: str
    source: str = ""


@shown(fields_in_brief)
@dataclass(frozen=True)
class Inputs:
    """What a sizing was asked: every number of the bridge, and its files, from which `size` gives the same again.

    Attributes
    ----------
    numbers : tuple of Input
    documents : mapping
        Text of bridge.toml and of every file that it names; empty for the section model itself.
    limits : tuple of str
        All of them, as they were written.
    """

    numbers: tuple[Input, ...] = ()
    documents: Mapping[str, str] = field(default_factory=dict)
    limits: tuple[str, ...] = ()


def inputs_of(bridge: Bridge, limits: tuple[str, ...]) -> Inputs:
    """Collect them from a bridge as it was read."""
    document = next((text for name, text in bridge.documents.items() if name.endswith(".toml")), "")
    said = tomllib.loads(document) if document else {}
    if bridge.others:  # those that are left to the other motion's fit
        said["modes"] = [mode for mode in said["modes"] if mode["motion"] == bridge.motion.value]
        if (lost_at := said.pop("coherence_amplitude", {}).get(bridge.motion.value)) is not None:
            said["coherence_amplitude"] = lost_at
    rows = [_row(said, bridge, name, value) for name, value in _leaves(bridge, "")]
    rows += [_limit(bridge, f"limits[{k}]", text) for k, text in enumerate(limits)]
    rows += _unsaid(bridge)
    if bridge.motion is Motion.TORSIONAL:
        rows = [replace(row, name=re.sub(r"^(modes\[\d+\])\.mass\b", r"\1.inertia", row.name)) for row in rows]
    rows += [Input(f"program.{name}", value, DEFAULT, reason) for name, (value, reason) in PROGRAM.items()]
    return Inputs(tuple(rows), dict(bridge.documents), limits)


def _row(said: Any, bridge: Bridge, name: str, value: Any) -> Input:
    """One number of the bridge."""
    place = re.match(r"modes\[(\d+)\]\.(frequency|damping_ratio|designed\[\d\])\.(\w+)", name)
    given = bridge.modes[int(place[1])].given.get(place[2]) if place else None
    written = name
    for pattern, there in _WRITTEN:
        written = re.sub(pattern, there, written)
    if bridge.motion is Motion.TORSIONAL:
        written = re.sub(r"^(modes\[\d+\])\.mass\b", r"\1.inertia", written)
    if place and given:
        if given.spread is None:
            stated = _is_stated(said, f"modes[{place[1]}].{given.source}.{place[3]}")
        else:
            stated = given.spread and place[3] == "sd"
        if stated or place[3] == "mean":
            return Input(name, value, given.origin, given.source)
        known = IDENTIFIED if given.origin == "identified" else {}
        last = ".".join(written.split(".")[-2:])
        return Input(name, value, DEFAULT, known.get(last) or _source(written, value))
    if _is_stated(said, written):
        return Input(name, value, STATED)
    if name == "damper.largest_stroke" and bridge.damper.end_stop is not None:
        return Input(name, value, DEFAULT, "the end stop")
    computed = re.fullmatch(r"modes\[\d+\]\.modal_mass", name) is not None
    return Input(name, value, COMPUTED if computed else DEFAULT, _source(written, value))


def _limit(bridge: Bridge, name: str, text: str) -> Input:
    """A limit with the value of its parameter, which is the code's own where the text has none."""
    found = limit(text)
    size = f"{found.value:g} {found.rule.dimension.unit}".strip()
    if text == found.rule.name:
        return Input(name, f"{text}: {size}", DEFAULT, f"{found.rule.dimension.name}, by {found.rule.source}")
    source = f"{size}, by {found.rule.source}" if text.partition(":")[2].strip().lower() in found.rule.classes else ""
    stated = text in (rule.text for rule in bridge.limits)
    return Input(name, text, STATED if stated else "command line", source or ("" if stated else f"--limit {text}"))


def _unsaid(bridge: Bridge) -> Iterator[Input]:
    """What a bridge leaves open, and the program fills in."""
    for k, mode in enumerate(bridge.modes):
        if mode.modal_mass is not None and mode.modal_mass_cov is None:
            yield Input(f"modes[{k}].modal_mass_cov", *_spread_of_modal_mass(mode))
    if bridge.motion is Motion.TORSIONAL and bridge.damper.lever_arm is None:
        yield Input("damper.lever_arm", 0.5 * bridge.width, DEFAULT, SOURCES["lever_arm"])


def _spread_of_modal_mass(mode: Mode) -> tuple[float, str, str]:
    if mode.mass is not None and not mode.mass.certain:
        return mode.mass.relative_sd, COMPUTED, "as the mass varies"
    return MODAL_MASS_COV, DEFAULT, "self-weight against drawings, and the shape"


def _leaves(value: Any, name: str) -> Iterator[tuple[str, Any]]:
    if isinstance(value, ModeShape):
        yield name, value.name
    elif isinstance(value, Quantity):
        family = "known" if value.certain else value.family
        known = {"mean": value.mean, "sd": value.sd, "family": family, "minimum": value.minimum or None}
        yield from ((f"{name}.{part}", number) for part, number in known.items() if number is not None)
    elif is_dataclass(value):
        for part in fields(value):
            if part.name not in _LEFT_OUT:
                # "position" in bridge.toml, of all modes or by mode
                key = "position" if part.name == "positions" else part.name
                yield from _leaves(getattr(value, part.name), f"{name}.{key}" if name else key)
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _leaves(inner, f"{name}.{key}" if key else name)
    elif isinstance(value, tuple | list) and any(map(is_dataclass, value)):
        for k, inner in enumerate(value):
            yield from _leaves(inner, f"{name}[{k}]")
    elif isinstance(value, Enum):
        yield name, value.value
    elif not (value is None or isinstance(value, np.ndarray) or value == ()):
        yield name, list(value) if isinstance(value, tuple) else value


def _is_stated(said: Any, name: str) -> bool:
    """Whether a TOML document says something of a place; of a spread only where the quantity carries one."""
    parts = re.findall(r"[^.\[\]]+", name)
    for part in parts:
        if isinstance(said, list) and part.isdigit() and int(part) < len(said):
            said = said[int(part)]
        elif isinstance(said, dict) and part in said:
            said = said[part]
        else:
            return _within_quantity(said, part)
    return True


def _within_quantity(said: Any, part: str) -> bool:
    """Whether a quantity as it is written says this part of itself."""
    if isinstance(said, dict):
        known = {"mean": ("mean", "median"), "sd": ("sd", "cov"), "family": ("distribution",), "minimum": ("minimum",)}
        return any(key in said for key in known.get(part, ()))
    if isinstance(said, str | int | float):
        return part == "mean" or (part == "sd" and isinstance(said, str) and ("+/-" in said or "±" in said))
    return False


def _source(name: str, value: Any) -> str:
    if value == "known":
        return "one value, since no uncertainty is stated"
    parts = re.sub(r"\[\d+\]", "", name).split(".")
    for key in (".".join(parts[-2:]), parts[-1], parts[-2] if len(parts) > 1 else ""):
        if key in SOURCES:
            return SOURCES[key]
    return JUDGEMENT
