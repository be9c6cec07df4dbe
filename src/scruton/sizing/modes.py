"""Several modes at once: any of them too large, hours in lock-in, and dampers that meet other modes than their own."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.shown import fields_in_brief, shown
from scruton.sizing.checks import ASKED, Reach, reach_of
from scruton.sizing.existing import Existing
from scruton.sizing.hours import LockInHours, LockInShape, lock_in_hours
from scruton.sizing.model import Draws, ModeModel, Spread, error_by_row, spread
from scruton.sizing.risk import Risk
from scruton.sizing.thresholds import LARGEST_ADDED
from scruton.sizing.together import Exceedance, Placed, counted, exceedance_of, joint_draws, with_dampers


@dataclass(frozen=True)
class RequiredForAny:
    """Added damping of all modes that keeps the risk of any: each mode has it at one and the same confidence.

    Attributes
    ----------
    risk : float
        That any mode exceeds its limit, as the bridge asks it of its dampers.
    confidence : float
        Of every mode by itself, at which that is kept.
    required : tuple of float or None
        Damping ratio to add, by mode; None where more than `LARGEST_ADDED` would be needed.
    reach : tuple of Reach or None
        How far the setting with it lies from what was tested, by mode.
    left : Exceedance or None
        Probabilities with it, where all modes can have it.
    required_mcse : tuple of float or None
        Monte Carlo standard errors of the damping, at the most; None where it is, and in a sizing of earlier versions.
    """

    risk: float
    confidence: float
    required: tuple[float | None, ...]
    reach: tuple[Reach | None, ...]
    left: Exceedance | None
    required_mcse: tuple[float | None, ...] | None = None


@shown(fields_in_brief)
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
    required_for_any : RequiredForAny or None
        Of several modes.
    """

    names: tuple[str, ...]
    without: Exceedance
    with_required_damping: Exceedance | None = None
    with_dampers: Exceedance | None = None
    added_by_dampers: tuple[Spread, ...] | None = None
    hours: LockInHours | None = None
    required_for_any: RequiredForAny | None = None


@shown(fields_in_brief)
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
    required, reach : tuple of float or None, of Reach or None
        Damping ratio to add at 95 %, and how far the setting with it lies from what was tested, by mode.
    dampers : tuple of tuple of Placed
        Those that were found for each mode; none where none is needed, or keeps the risk.
    trusted : tuple of bool
        Whether the fit that a mode rests on converged. None, as what stands before it, in a sizing of earlier versions.
    required_for_any : RequiredForAny or None
    """

    names: tuple[str, ...]
    motions: tuple[str, ...]
    edge: tuple[Spread, ...]
    without: Exceedance
    with_required_damping: Exceedance | None = None
    with_dampers: Exceedance | None = None
    existing: tuple[Existing, ...] | None = None
    required: tuple[float | None, ...] | None = None
    reach: tuple[Reach | None, ...] | None = None
    dampers: tuple[tuple[Placed, ...], ...] | None = None
    trusted: tuple[bool, ...] | None = None
    required_for_any: RequiredForAny | None = None


def exceedance(draws: Sequence[Draws], limits: Sequence[float], added: Sequence[FloatArray | float]) -> Exceedance:
    """Probabilities with added damping by mode: a number, or one for every draw."""
    exceeds = np.array(
        [drawn.needed(limit) > more for drawn, limit, more in zip(draws, limits, added, strict=True)], dtype=bool
    )
    return counted(exceeds, [drawn.row for drawn in draws])


def with_required(draws: Sequence[Draws], limits: Sequence[float], risks: Sequence[Risk]) -> Exceedance | None:
    """Probabilities with the damping that each mode needs at 95 %; None where one cannot have it."""
    needs = [need for risk in risks if (need := risk.required[ASKED]) is not None]
    return exceedance(draws, limits, needs) if len(needs) == len(risks) else None


def required_for_any(draws: Sequence[Draws], limits: Sequence[float], risk: float) -> RequiredForAny | None:
    """The least confidence, alike in every mode, whose damping keeps the risk of any mode; None for one mode.

    Notes
    -----
    A mode exceeds its limit where a draw's place among what its draws need, from the least up, lies above the place
    that the damping is read off at.  So that place is a quantile of the draws' highest place among the modes.  The
    damping of a mode is off by the error of that place, and by that of its own quantile there; both are added up as if
    they had nothing in common, which errs to the large side.
    """
    if len(draws) < 2:
        return None
    needs = np.array([drawn.needed(limit) for drawn, limit in zip(draws, limits, strict=True)])
    ordered, size = np.sort(needs, axis=1), needs.shape[1]
    places = [np.searchsorted(row, need, side="right") for row, need in zip(ordered, needs, strict=True)]
    highest = np.where(needs > 0.0, places, 0).max(axis=0)  # what needs nothing never exceeds
    place = int(np.quantile(highest, 1.0 - risk, method="inverted_cdf"))
    most = np.maximum(ordered[:, place - 1], 0.0) if place else np.zeros(len(needs))
    added = [float(need) if need <= LARGEST_ADDED else None for need in most]
    can = [need for need in added if need is not None]
    errors = [
        need and _required_error(drawn, own, row[np.maximum(highest, 1) - 1], (place / size, risk))
        for drawn, own, row, need in zip(draws, needs, ordered, added, strict=True)
    ]
    return RequiredForAny(
        risk, place / size, tuple(added),
        tuple(
            reach_of(drawn, limit, need) for drawn, limit, need in zip(draws, limits, added, strict=True)
        ),
        exceedance(draws, limits, can) if len(can) == len(added) else None, tuple(errors),
    )  # fmt: skip


def _required_error(drawn: Draws, needs: FloatArray, at_highest: FloatArray, at: tuple[float, float]) -> float | None:
    """Of what a mode needs for any: `at_highest` is its own need (N,) at the draws' highest place among the modes.

    `at` are the confidence in the mode and the risk of any.
    """
    confidence, risk = at
    of_place = error_by_row(np.maximum(at_highest, 0.0), drawn.row, 1.0 - risk)
    found = float(np.hypot(of_place, error_by_row(np.maximum(needs, 0.0), drawn.row, confidence)))
    return found if np.isfinite(found) else None


def all_modes(
    models: Sequence[ModeModel],
    risks: Sequence[Risk],
    dampers: Sequence[Placed] | None,
    shapes: Sequence[LockInShape],
    seed: int,
) -> AllModes:
    """Union over the modes, with and without dampers, and hours a year.

    Parameters
    ----------
    risks : sequence of Risk
        Of every mode against the limit that governs it.
    dampers : sequence of Placed or None
        Of all modes; None where none may be specified.
    shapes : sequence of LockInShape
        Amplitude against the wind speed, of every mode; not used without a wind climate.
    """
    draws, limits = joint_draws(models, seed), [risk.limit for risk in risks]
    without = exceedance(draws, limits, [0.0] * len(models))
    required = with_required(draws, limits, risks)
    damped = damped_modes(models, limits, dampers, seed)
    left: dict[str, Sequence[FloatArray]] = {} if damped is None else {"with_dampers": damped.amplitude}
    if required is not None:
        added = [risk.required[ASKED] or 0.0 for risk in risks]
        left["with_required_damping"] = [drawn.amplitude(more) for drawn, more in zip(draws, added, strict=True)]
    return AllModes(
        tuple(model.mode.name for model in models), without, required,
        None if damped is None else damped.left, None if damped is None else damped.added,
        lock_in_hours(models, draws, limits, shapes, seed, left),
        required_for_any(draws, limits, models[0].bridge.damper.risk),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Damped:
    """All modes with all dampers, by mode: the risk left, the damping ratio added, draws of the amplitude (S,)."""

    left: Exceedance
    added: tuple[Spread, ...]
    amplitude: tuple[FloatArray, ...]


def damped_modes(
    models: Sequence[ModeModel], limits: Sequence[float], dampers: Sequence[Placed] | None, seed: int
) -> Damped | None:
    """What all dampers do; None where none may be specified, or a modal mass is not stated.

    The amplitude is that with the damping that they add where the mode vibrates at its limit; draws as of
    `joint_draws`.
    """
    if dampers is None or any(model.mode.modal_mass is None for model in models):
        return None
    every = with_dampers(dampers, models, limits, seed)
    found = [mode.draws.at_limit(mode.dampers) for mode in every]
    added = tuple(spread(np.zeros(1) if one is None else one.added_damping) for _, one in found)
    return Damped(exceedance_of(every), added, tuple(amplitude for amplitude, _ in found))
