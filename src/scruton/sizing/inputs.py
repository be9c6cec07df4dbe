"""Every number that a sizing rests on, as stated or by default with its source; and the bridge's files themselves."""

import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np

from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.shown import fields_in_brief, shown
from scruton.sizing.bridge import Bridge

STATED, DEFAULT = "stated", "default"
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
}
JUDGEMENT = "the program's default, set by judgement"
# What is no number of the bridge, or is in its files as a table of numbers.
_LEFT_OUT = (
    "motion", "curve", "sha256", "documents", "limits", "position", "value", "speed", "hours", "lock_in_shape",
    "assumed", "name", "others",
)  # fmt: skip


@dataclass(frozen=True)
class Input:
    """One: its place in bridge.toml ("modes[0].mass.sd"), its value in SI, "stated" or "default", the source."""

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
    rows = []
    for name, value in _leaves(bridge, ""):
        if bridge.motion is Motion.TORSIONAL:
            name = re.sub(r"^(modes\[\d+\])\.mass\b", r"\1.inertia", name)
        stated = _is_stated(said, name)
        source = "" if stated else _source(name)
        rows.append(Input(name, value, STATED if stated else DEFAULT, source))
    return Inputs(tuple(rows), dict(bridge.documents), limits)


def _leaves(value: Any, name: str) -> Iterator[tuple[str, Any]]:
    if is_dataclass(value):
        for part in fields(value):
            if part.name not in _LEFT_OUT:
                inner = getattr(value, part.name)
                if isinstance(value, Quantity) and part.name == "minimum" and not inner:
                    continue
                yield from _leaves(inner, f"{name}.{part.name}" if name else part.name)
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _leaves(inner, f"{name}.{key}")
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


def _source(name: str) -> str:
    parts = re.sub(r"\[\d+\]", "", name).split(".")
    for key in (".".join(parts[-2:]), parts[-1], parts[-2] if len(parts) > 1 else ""):
        if key in SOURCES:
            return SOURCES[key]
    return JUDGEMENT
