"""Several modes at once: any of them too large, hours in lock-in, and dampers that meet other modes than their own."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Motion
from scruton.sizing.bridge import Mode
from scruton.sizing.model import COHERENCE, LAW, SECTION, SOURCES, Draws, ModeModel, unit_cube
from scruton.sizing.tmd import TunedMass, response

POINTS = 1 << 14


@dataclass(frozen=True, eq=False)
class Installed:
    """Tuned masses as they hang in the bridge.

    Attributes
    ----------
    mass : float
        Of one damper [kg].
    frequency : float
        Its own [Hz].
    damping_ratio : float
    position : float
        Fraction of the span.
    """

    mass: float
    frequency: float
    damping_ratio: float
    position: float


@dataclass(frozen=True, eq=False)
class Together:
    """Probabilities over all modes.

    Attributes
    ----------
    each : tuple of float
        P(amplitude > limit) by mode.
    union : float
        P(any mode exceeds its limit), each mode in its own lock-in.
    """

    each: tuple[float, ...]
    union: float


def joint_draws(models: Sequence[ModeModel], seed: int, points: int = POINTS) -> list[Draws]:
    """Draws of every mode: one section, law and coherence for all, the rest each mode's own."""
    shared = (SECTION, LAW, COHERENCE)
    own = [source for source in SOURCES if source not in shared]
    # One cube with a coordinate for each source of each mode: cubes of their own would tie the modes together.
    cube = unit_cube(points, seed + 10, len(shared) + len(own) * len(models))
    found = []
    for k, model in enumerate(models):
        u = np.empty((points, len(SOURCES)))
        u[:, shared] = cube[:, : len(shared)]
        first = len(shared) + k * len(own)
        u[:, own] = cube[:, first : first + len(own)]
        found.append(model.draws(u))
    return found


def together(draws: Sequence[Draws], limits: Sequence[float], added: Sequence[FloatArray | float]) -> Together:
    """Probabilities with added damping by mode: a number, or one for every draw."""
    exceeds = np.array(
        [one.needed(limit) > more for one, limit, more in zip(draws, limits, added, strict=True)], dtype=bool
    )
    return Together(tuple(float(row.mean()) for row in exceeds), float(exceeds.any(axis=0).mean()))


def added_by(installed: Sequence[Installed], mode: Mode, detuning: FloatArray, lever_arm: float = 1.0) -> FloatArray:
    """Damping ratio that all dampers of the bridge add to one mode, for draws of its detuning.

    Parameters
    ----------
    installed : sequence of Installed
    mode : Mode
        With a modal mass.
    detuning : (N,) array
    lever_arm : float
        Of torsion [m].
    """
    assert mode.modal_mass is not None
    dampers = []
    for one in installed:
        shape = mode.shape.at(one.position) * lever_arm
        ratio = one.mass * shape**2 / mode.modal_mass
        if ratio > 1e-9:  # one at a node does not move
            dampers.append(TunedMass(ratio, one.frequency / mode.frequency.mean, one.damping_ratio))
    if not dampers:
        return np.zeros(len(detuning))
    return response(dampers, detuning).added_damping


def lock_in_hours(model: ModeModel, reduced_velocity: tuple[float, float]) -> float | None:
    """Hours a year in which the wind is in the lock-in range of a mode; None without a wind climate."""
    wind = model.bridge.wind
    if wind is None:
        return None
    speed = model.mode.frequency.mean * model.bridge.depth
    return wind.between(reduced_velocity[0] * speed, reduced_velocity[1] * speed)


def lever_arm(model: ModeModel) -> float:
    """Lever arm of dampers against torsion [m]; 1 for heaving."""
    if model.bridge.motion is Motion.HEAVING:
        return 1.0
    return model.bridge.damper.lever_arm or 0.5 * model.bridge.width


def position(model: ModeModel) -> float:
    """Fraction of the span where a mode's dampers stand: as wished, or where the mode is largest."""
    if model.bridge.damper.position is not None:
        return model.bridge.damper.position
    shape = model.mode.shape
    x = shape.position
    place = x[int(np.abs(shape.value).argmax())]
    return float((place - x[0]) / (x[-1] - x[0]))
