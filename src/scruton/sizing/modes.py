"""Several modes at once: any of them too large, hours in lock-in, and dampers that meet other modes than their own."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.sizing.checks import ASKED
from scruton.sizing.existing import Existing
from scruton.sizing.hours import LockInHours, LockInShape, lock_in_hours
from scruton.sizing.model import Draws, ModeModel, Spread, spread
from scruton.sizing.risk import Risk
from scruton.sizing.together import Exceedance, Placed, exceedance_of, joint_draws, with_dampers


@dataclass(frozen=True)
class AllModes:
    """All modes together.

    Attributes
    ----------
    without : Exceedance
        As the bridge is.
    with_required_damping : Exceedance or None
        With the damping required at 95 %, where all modes can have it.
    with_dampers : Exceedance or None
        With all dampers, each acting on every mode, where modal masses are stated.
    added_by_dampers : tuple of Spread or None
        Damping ratio that they add, by mode.
    hours : LockInHours or None
        Where the bridge has a wind climate.
    """

    names: tuple[str, ...]
    without: Exceedance
    with_required_damping: Exceedance | None = None
    with_dampers: Exceedance | None = None
    added_by_dampers: tuple[Spread, ...] | None = None
    hours: LockInHours | None = None


@dataclass(frozen=True)
class BothMotions:
    """Heaving and torsional modes of one bridge together.

    Attributes
    ----------
    names, motions : tuple of str
        Of all modes.
    edge : tuple of Spread
        Amplitude at the edge of the deck [m] without added damping: of torsion half the width times the rotation.
    without, with_required_damping, with_dampers : Exceedance or None
        As of `AllModes`.
    existing : tuple of Existing or None
        Dampers that were asked about.
    """

    names: tuple[str, ...]
    motions: tuple[str, ...]
    edge: tuple[Spread, ...]
    without: Exceedance
    with_required_damping: Exceedance | None = None
    with_dampers: Exceedance | None = None
    existing: tuple[Existing, ...] | None = None


def exceedance(draws: Sequence[Draws], limits: Sequence[float], added: Sequence[FloatArray | float]) -> Exceedance:
    """Probabilities with added damping by mode: a number, or one for every draw."""
    exceeds = np.array(
        [drawn.needed(limit) > more for drawn, limit, more in zip(draws, limits, added, strict=True)], dtype=bool
    )
    return Exceedance(tuple(float(row.mean()) for row in exceeds), float(exceeds.any(axis=0).mean()))


def with_required(draws: Sequence[Draws], limits: Sequence[float], risks: Sequence[Risk]) -> Exceedance | None:
    """Probabilities with the damping that each mode needs at 95 %; None where one cannot have it."""
    needs = [need for risk in risks if (need := risk.required[ASKED]) is not None]
    return exceedance(draws, limits, needs) if len(needs) == len(risks) else None


def all_modes(
    models: Sequence[ModeModel],
    risks: Sequence[Risk],
    dampers: Sequence[Placed],
    shapes: Sequence[LockInShape],
    seed: int,
) -> AllModes:
    """Union over the modes, with and without dampers, and hours a year.

    Parameters
    ----------
    risks : sequence of Risk
        Of every mode against the limit that governs it.
    dampers : sequence of Placed
        Of all modes.
    shapes : sequence of LockInShape
        Amplitude against the wind speed, of every mode; not used without a wind climate.
    """
    draws, limits = joint_draws(models, seed), [risk.limit for risk in risks]
    without = exceedance(draws, limits, [0.0] * len(models))
    required = with_required(draws, limits, risks)
    damped, added_by_dampers = damped_modes(models, limits, dampers, seed)
    hours = lock_in_hours(models, draws, limits, shapes, seed)
    names = tuple(model.mode.name for model in models)
    return AllModes(names, without, required, damped, added_by_dampers, hours)


def damped_modes(
    models: Sequence[ModeModel], limits: Sequence[float], dampers: Sequence[Placed], seed: int
) -> tuple[Exceedance | None, tuple[Spread, ...] | None]:
    """What all dampers leave, and the damping ratio that they add by mode; None where a modal mass is not stated."""
    if any(model.mode.modal_mass is None for model in models):
        return None, None
    every = with_dampers(dampers, models, limits, seed)
    found = [mode.draws.at_limit(mode.dampers)[1] for mode in every]
    return exceedance_of(every), tuple(spread(np.zeros(1) if one is None else one.added_damping) for one in found)
