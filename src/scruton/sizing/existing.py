"""Dampers that are there, or that a supplier offers: the risk with them, and with the bridge as it was identified."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from scruton.campaign.units import FREQUENCY, Dimension, parse_quantity
from scruton.errors import InputError
from scruton.sizing.bridge import Bridge, identified
from scruton.sizing.model import ModeModel
from scruton.sizing.number_table import read_table
from scruton.sizing.thresholds import AT_NODE
from scruton.sizing.together import Exceedance, Placed, against, exceedance_of, with_dampers

_MASS = Dimension("a mass", "kg", 12000.0)
_DAMPING = Dimension("a damping ratio, a bare number", "", 0.08)
_POSITION = Dimension("a fraction of the span, a bare number", "", 0.5)
_WANTED = '"mass, frequency, damping ratio" or with ", position", such as "12 t, 0.29 Hz, 0.08, 0.5", or a CSV file'
_COLUMNS = "one header line, then mass [kg], frequency [Hz], damping ratio and, if need be, position of each damper"
_AS_BUILT = '"mode: frequency", "mode: , damping ratio" or both, such as "V1: 0.296 Hz, 0.0042 +/- 0.0006"'


@dataclass(frozen=True)
class Offer:
    """Dampers that hang together, and the words they were named with."""

    name: str
    dampers: tuple[Placed, ...]


@dataclass(frozen=True, eq=False)
class Existing:
    """The risk with given dampers.

    Attributes
    ----------
    name : str
    dampers : tuple of Placed
    left : Exceedance
        Of each mode and of any, with the bridge as it is known: as identified, where it was.
    stroke_high : tuple of float
        95 % quantile of the largest stroke of any damper [m], by mode.
    added_damping : tuple of float
        Median, by mode.
    as_designed : Exceedance or None
        With what was assumed of the bridge before anything of it was identified.
    """

    name: str
    dampers: tuple[Placed, ...]
    left: Exceedance
    stroke_high: tuple[float, ...]
    added_damping: tuple[float, ...]
    as_designed: Exceedance | None = None


def offers(stated: str) -> list[Offer]:
    """Read dampers of the command line: one, several that hang together with ";" between, or a supplier's list.

    Raises
    ------
    InputError
        For anything else, or a number that no damper has.
    """
    if stated.lower().endswith(".csv"):
        path = Path(stated)
        rows = read_table(path, _COLUMNS, (_MASS, FREQUENCY, _DAMPING, _POSITION))
        if rows.shape[1] not in (3, 4):
            raise InputError(path, "", f"rows of {rows.shape[1]} columns", _COLUMNS)
        if (bad := ~(np.isfinite(rows) & (rows > 0.0))).any():
            row, column = np.argwhere(bad)[0]
            wanted = f"a number greater than zero; {_COLUMNS}"
            raise InputError(path, f"row {row + 1}, column {column + 1}", f"{rows[row, column]:g}", wanted)
        return [
            Offer(f"{path.name}, {k}", (_checked(Placed(*row), path, f"row {k}"),))
            for k, row in enumerate(rows.tolist(), 1)
        ]
    return [Offer(stated.strip(), tuple(_placed(part) for part in stated.split(";")))]


def as_built(bridge: Bridge, stated: Sequence[str]) -> Bridge:
    """The bridge with what was identified on it, from the command line.

    Raises
    ------
    InputError
        For a mode that the bridge does not have, or numbers that cannot be read.
    """
    modes = {mode.name: mode for mode in bridge.modes}
    for text in stated:
        name, _, rest = text.rpartition(":")
        values = [part.strip() for part in rest.split(",")]
        if name.strip() not in modes or not 1 <= len(values) <= 2 or not any(values):
            names = ", ".join((*modes, *bridge.others))
            raise InputError("command line", "--identified", f'"{text}"', f"{_AS_BUILT}; modes: {names}")
        frequency, damping = (
            parse_quantity(_number(value), dimension, "command line", "--identified") if value else None
            for value, dimension in zip([*values, ""][:2], (FREQUENCY, _DAMPING), strict=True)
        )
        if damping is not None and not damping.mean < 1.0:
            raise InputError("command line", "--identified", f'"{text}"', "a damping ratio below 1")
        modes[name.strip()] = identified(modes[name.strip()], frequency, damping, f"--identified {text}")
    return replace(bridge, modes=tuple(modes.values()))


def hung(models: Sequence[ModeModel], asked: Sequence[Offer]) -> list[Offer]:
    """The offers as they hang: each damper is one of the mode whose frequency is nearest to its own.

    Where no place is stated it stands where that mode has its dampers; one of a heaving mode is on the axis.

    Raises
    ------
    InputError
        Where a mode has no modal mass, or a damper stands at a node of every mode that it could move with.
    """
    for model in models if asked else ():
        if model.mode.modal_mass is None:
            wanted = "a mass and a length, or a modal_mass: without it no damper of stated mass can be judged"
            raise InputError("bridge", f"mode {model.mode.name}", "no modal mass", wanted)
    return [replace(offer, dampers=tuple(_hung(each, models) for each in offer.dampers)) for offer in asked]


def existing(
    models: Sequence[ModeModel], limits: Sequence[float], asked: Sequence[Offer], seed: int
) -> tuple[Existing, ...]:
    """Risk with each of these offers, as of `hung`."""
    designed = [_as_designed(model) for model in models]
    found = []
    for offer in asked:
        modes = with_dampers(offer.dampers, models, limits, seed + 30)
        outcomes = [mode.draws.outcome(mode.dampers) for mode in modes]
        before = None
        if designed != list(models):
            before = exceedance_of(with_dampers(offer.dampers, designed, limits, seed + 30))
        found.append(
            Existing(
                offer.name, offer.dampers, exceedance_of(modes), tuple(outcome.stroke_high for outcome in outcomes),
                tuple(outcome.added_damping for outcome in outcomes), before,
            )
        )  # fmt: skip
    return tuple(found)


def _as_designed(model: ModeModel) -> ModeModel:
    """The mode before anything of it was identified."""
    if model.mode.designed is None:
        return model
    frequency, damping = model.mode.designed
    return replace(model, mode=replace(model.mode, frequency=frequency, damping_ratio=damping, designed=None))


def _hung(damper: Placed, models: Sequence[ModeModel]) -> Placed:
    nearest = min(models, key=lambda model: abs(np.log(damper.frequency / model.mode.frequency.mean)))
    position = nearest.damper_positions[0] if damper.position is None else damper.position
    found = against(nearest.bridge.motion)(damper.mass, damper.frequency, damper.damping_ratio, position)
    met = [model for model in models if found.in_motion(model.bridge.motion).mass]
    if all(abs(model.mode.shape.at(position)) < AT_NODE for model in met):
        raise InputError("command line", "--damper", f"position {position:g}", "no node of every mode")
    return found


def _placed(text: str) -> Placed:
    parts = [part.strip() for part in text.split(",")]
    if not 3 <= len(parts) <= 4:
        raise InputError("command line", "--damper", f'"{text.strip()}"', _WANTED)
    values = []
    for part, dimension in zip(parts, (_MASS, FREQUENCY, _DAMPING, _POSITION), strict=False):
        quantity = parse_quantity(_number(part), dimension, "command line", "--damper")
        if quantity.sd is not None:
            raise InputError("command line", "--damper", f'"{part}"', "a number without a standard deviation")
        values.append(quantity.mean)
    return _checked(Placed(*values), "command line", "--damper")


def _checked(damper: Placed, source: Path | str, field: str) -> Placed:
    if not damper.damping_ratio < 1.0:
        raise InputError(source, field, f"a damping ratio of {damper.damping_ratio:g}", "a bare number below 1")
    if damper.position is not None and not damper.position < 1.0:
        raise InputError(source, field, f"a position of {damper.position:g}", "a fraction of the span between 0 and 1")
    return damper


def _number(text: str) -> str | float:
    """A bare number as such: what has no unit is no text for `parse_quantity`."""
    try:
        return float(text)
    except ValueError:
        return text
