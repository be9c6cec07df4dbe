"""The table [damper] of a `bridge.toml`: what is asked of tuned mass dampers, and what they turn out to be."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.toml import Field, Table, bare, choice, is_number, number, whole
from scruton.campaign.units import LENGTH, Dimension
from scruton.sizing.thresholds import (
    DAMPING_TOLERANCE,
    FREQUENCY_TOLERANCE,
    KEPT_DETUNING,
    LARGEST_STROKE,
    LEAST_RISK,
    MASS_TOLERANCE,
    SMALLEST_MASS_RATIO,
    STOP_STIFFNESS,
)


class RiskOf(StrEnum):
    """What the risk is asked of: every mode for itself, or any of them."""

    MODE = "mode"
    ANY = "any"


@dataclass(frozen=True)
class DamperRequest:
    """What is asked of so many tuned mass dampers, and how far what is built may be from it.

    Attributes
    ----------
    number : int
        Dampers of each mode.
    risk : float
        Probability of exceeding the limit that may remain.
    risk_of : RiskOf
        In each mode, or in any.
    largest_stroke : float
        [m], not to be exceeded with 95 % confidence.
    smallest_mass_ratio, largest_mass_ratio : float
        Of all dampers of a mode together.
    kept_detuning : float
        Relative error of the mode's frequency, either way, at which the risk is kept as well.
    positions : mapping of str to tuple of float
        Fractions of the span where the dampers stand, by the name of the mode, "" for all others; without one they
        stand where the mode is largest.
    lever_arm : float or None
        Of a damper against torsion: distance from the axis [m]; None: half the width.
    frequency_tolerance, damping_tolerance, mass_tolerance : float
        Relative errors of a delivered damper, either way; each damper has its own, anywhere between with equal
        probability.
    temperature_detuning : float
        Largest relative change of the dampers' frequency through the year, either way, the same for all.
    start_acceleration : float
        Of the bridge, at which a damper breaks loose from friction [m/s^2]: friction force over the damper's mass.
    end_stop : float or None
        Stroke at which the mass meets its end stops [m].
    stop_stiffness : float
        Of the stops, over the damper's own spring.
    """

    number: int = 1
    risk: float = 0.05
    risk_of: RiskOf = RiskOf.MODE
    largest_stroke: float = LARGEST_STROKE
    smallest_mass_ratio: float = SMALLEST_MASS_RATIO
    largest_mass_ratio: float = 0.05
    kept_detuning: float = KEPT_DETUNING
    positions: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    lever_arm: float | None = None
    frequency_tolerance: float = FREQUENCY_TOLERANCE
    damping_tolerance: float = DAMPING_TOLERANCE
    mass_tolerance: float = MASS_TOLERANCE
    temperature_detuning: float = 0.0
    start_acceleration: float = 0.0
    end_stop: float | None = None
    stop_stiffness: float = STOP_STIFFNESS

    def places(self, mode: str) -> tuple[float, ...] | None:
        """Fractions of the span where the dampers of a mode stand; None: where it is largest."""
        stated = self.positions.get(mode, self.positions.get(""))
        return None if stated is None else stated if len(stated) > 1 else stated * self.number


def read_damper(table: Table) -> DamperRequest:
    """Read the table; InputError for what is wrong with it."""
    values = table.read(_FIELDS)
    values["positions"] = values.pop("position")
    for mode, places in values["positions"].items():
        if "number" in table and 1 < len(places) != values["number"]:
            found = f"{len(places)} places" + (f" for mode {mode}" if mode else "")
            raise table.error("position", found, f"as many as there are dampers, number = {values['number']}, or one")
    smallest, largest = values["smallest_mass_ratio"], values["largest_mass_ratio"]
    if smallest is None:
        values["smallest_mass_ratio"] = min(SMALLEST_MASS_RATIO, largest)
    elif smallest > largest:
        raise table.error("smallest_mass_ratio", f"{smallest:g}", f"no more than the largest, {largest:g}")
    stop = values["end_stop"]
    if values["largest_stroke"] is None:
        values["largest_stroke"] = LARGEST_STROKE if stop is None else stop
    elif stop is not None and values["largest_stroke"] > stop:
        raise table.error("largest_stroke", f"{values['largest_stroke']:g} m", f"no more than the end stop, {stop:g} m")
    return DamperRequest(**values)


def _positions(table: Table, key: str) -> dict[str, tuple[float, ...]]:
    """A fraction of the span, a list of one for every damper, or a table of either by mode."""
    wanted = "a fraction of the span between 0 and 1, a list of them, or a table of either by the name of the mode"

    def places(value: Any) -> tuple[float, ...]:
        listed = value if isinstance(value, list) else [value]
        if not 1 <= len(listed) <= _MOST or not all(is_number(x) and 0.0 < x < 1.0 for x in listed):
            raise table.refusal(key, wanted)
        return tuple(float(x) for x in listed)

    value = table.values[key]
    return {name: places(x) for name, x in value.items()} if isinstance(value, Mapping) else {"": places(value)}


_MOST = 16
_RATIO = Dimension("a bare number", "", 0.5)
_ACCELERATION = Dimension("an acceleration", "m/s^2", 0.02)
_RISK = number(
    _RATIO, 0.05, good=lambda risk: LEAST_RISK <= risk < 1.0,
    wanted=f"a number between {LEAST_RISK:g} and 1: draws tell no less",
)  # fmt: skip
_SHARE = number(_RATIO, 0.05, good=lambda share: share < 1.0, wanted="a number between 0 and 1")
_OPTIONAL = number(_RATIO, None, good=lambda share: share < 1.0, wanted="a number between 0 and 1")


def _tolerance(default: float) -> Field:
    return bare(0.0, 0.5, default, "a relative error from 0 to 0.5, such as 0.01")


_FIELDS = {
    "number": whole(1, _MOST, 1),
    "risk": _RISK,
    "risk_of": choice(RiskOf, RiskOf.MODE),
    "largest_stroke": number(LENGTH, None),
    "smallest_mass_ratio": _OPTIONAL,
    "largest_mass_ratio": _SHARE,
    "kept_detuning": bare(0.0, 0.2, KEPT_DETUNING, "a relative error of the frequency from 0 to 0.2, such as 0.02"),
    "position": Field(_positions, {}),
    "lever_arm": number(LENGTH, None),
    "frequency_tolerance": _tolerance(FREQUENCY_TOLERANCE),
    "damping_tolerance": _tolerance(DAMPING_TOLERANCE),
    "mass_tolerance": _tolerance(MASS_TOLERANCE),
    "temperature_detuning": _tolerance(0.0),
    "start_acceleration": number(_ACCELERATION, 0.0),
    "end_stop": number(LENGTH, None),
    "stop_stiffness": bare(0.1, 1e3, STOP_STIFFNESS),
}


@dataclass(frozen=True, eq=False)
class Delivered:
    """Draws of what delivered dampers are over what they were meant to be, (dampers, S) each."""

    frequency: FloatArray
    damping: FloatArray
    mass: FloatArray


def delivered(request: DamperRequest, count: int, size: int, seed: int) -> Delivered:
    """Draw the errors of so many dampers."""
    rng = np.random.default_rng([seed, 0xDA3B])

    def within(tolerance: float, rows: int) -> FloatArray:
        return 1.0 + tolerance * (2.0 * rng.random((rows, size)) - 1.0)

    return Delivered(
        within(request.frequency_tolerance, count) * within(request.temperature_detuning, 1),
        within(request.damping_tolerance, count),
        within(request.mass_tolerance, count),
    )
