"""Several modes at once: any of them too large, hours in lock-in, and dampers that meet other modes than their own."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.sizing.hours import LockInHours, LockInShape, lock_in_hours
from scruton.sizing.model import (
    COHERENCE,
    COHERENCE_AMPLITUDE,
    LAW,
    SECTION,
    SOURCES,
    TRANSFER,
    Draws,
    ModeModel,
    Spread,
    spread,
    unit_cube,
)
from scruton.sizing.risk import Risk
from scruton.sizing.tmd import TunedMass, response
from scruton.sizing.tmd_design import BuiltDamper

POINTS = 1 << 14


@dataclass(frozen=True)
class Exceedance:
    """P(amplitude > limit) by mode, and P(any mode exceeds its limit), each mode in its own lock-in."""

    each: tuple[float, ...]
    any: float


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


def joint_draws(models: Sequence[ModeModel], seed: int, points: int = POINTS) -> list[Draws]:
    """Draws of every mode: one section, law, coherence and site for all, the rest each mode's own."""
    shared = (SECTION, LAW, COHERENCE, COHERENCE_AMPLITUDE, *TRANSFER)
    separate = [source for source in SOURCES if source not in shared]
    # One cube with a coordinate for each source of each mode: cubes of their own would tie the modes together.
    cube = unit_cube(points, seed + 10, len(shared) + len(separate) * len(models))
    draws = []
    for k, model in enumerate(models):
        u = np.empty((points, len(SOURCES)))
        u[:, shared] = cube[:, : len(shared)]
        first = len(shared) + k * len(separate)
        u[:, separate] = cube[:, first : first + len(separate)]
        draws.append(model.draws(u))
    return draws


def exceedance(draws: Sequence[Draws], limits: Sequence[float], added: Sequence[FloatArray | float]) -> Exceedance:
    """Probabilities with added damping by mode: a number, or one for every draw."""
    exceeds = np.array(
        [drawn.needed(limit) > more for drawn, limit, more in zip(draws, limits, added, strict=True)], dtype=bool
    )
    return Exceedance(tuple(float(row.mean()) for row in exceeds), float(exceeds.any(axis=0).mean()))


def all_modes(
    models: Sequence[ModeModel],
    risks: Sequence[Risk],
    dampers: Sequence[tuple[BuiltDamper, float]],
    shapes: Sequence[LockInShape],
    seed: int,
) -> AllModes:
    """Union over the modes, with and without dampers, and hours a year.

    Parameters
    ----------
    risks : sequence of Risk
        Of every mode against the limit that governs it.
    dampers : sequence of (BuiltDamper, float)
        Of all modes, with the fractions of the span where they hang.
    shapes : sequence of LockInShape
        Amplitude against the wind speed, of every mode; not used without a wind climate.
    """
    draws, limits = joint_draws(models, seed), [risk.limit for risk in risks]
    without = exceedance(draws, limits, [0.0] * len(models))
    needs = [need for risk in risks if (need := risk.required["0.95"]) is not None]
    required = exceedance(draws, limits, needs) if len(needs) == len(models) else None
    with_dampers = added_by_dampers = None
    if all(model.mode.modal_mass is not None for model in models):
        added = [added_by(dampers, model, drawn.detuning) for model, drawn in zip(models, draws, strict=True)]
        with_dampers = exceedance(draws, limits, added)
        added_by_dampers = tuple(spread(damping) for damping in added)
    hours = lock_in_hours(models, draws, limits, shapes, seed)
    names = tuple(model.mode.name for model in models)
    return AllModes(names, without, required, with_dampers, added_by_dampers, hours)


def added_by(dampers: Sequence[tuple[BuiltDamper, float]], model: ModeModel, detuning: FloatArray) -> FloatArray:
    """Damping ratio that all dampers of the bridge add to a mode of known modal mass, by its detuning, (N,)."""
    mode = model.mode
    assert mode.modal_mass is not None
    moving = []
    for damper, position in dampers:
        assert damper.mass is not None
        ratio = damper.mass * (mode.shape.at(position) * model.lever_arm) ** 2 / mode.modal_mass
        if ratio > 1e-9:  # one at a node does not move
            moving.append(TunedMass(ratio, damper.frequency / mode.frequency.mean, damper.damping_ratio))
    return response(moving, detuning).added_damping if moving else np.zeros(len(detuning))
