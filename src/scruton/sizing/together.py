"""Dampers on the whole bridge: each acts on every mode, and the risk is that of any mode."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scruton.arrays import BoolArray
from scruton.campaign.schema import Motion
from scruton.progress import Progress
from scruton.said import key, said
from scruton.sizing.damper_request import DamperRequest, Delivered, RiskOf, delivered
from scruton.sizing.dampers import Damper, damper, reality, shapes
from scruton.sizing.model import (
    COHERENCE,
    COHERENCE_AMPLITUDE,
    LAW,
    SECTION,
    SOURCES,
    TRANSFER,
    Draws,
    ModeModel,
    error_by_row,
    unit_cube,
)
from scruton.sizing.thresholds import RISK_MARGIN
from scruton.sizing.tmd import TunedMass
from scruton.sizing.tmd_draws import DamperDraws

POINTS = 1 << 14
FOR_ANY = key('damper.risk_of = "any"', "a sizing for the risk of any mode")
_ROUNDS = 6
_NEAR = 0.93  # of the risk asked for: what is below it is worth another round


@dataclass(frozen=True)
class Placed:
    """A damper that hangs on the bridge: mass [kg], own frequency [Hz], damping ratio, fraction of the span.

    Without a `position` it stands where the mode whose frequency is nearest to its own is largest.
    """

    mass: float
    frequency: float
    damping_ratio: float
    position: float | None = None

    def in_motion(self, _motion: Motion) -> "Placed":
        """The damper as modes of a motion meet it."""
        return self


@dataclass(frozen=True)
class OnAxis(Placed):
    """A damper on the axis of the deck, against heaving: torsion does not move it."""

    def in_motion(self, motion: Motion) -> Placed:
        """The damper as modes of a motion meet it; without mass for torsion."""
        return self if motion is Motion.HEAVING else replace(self, mass=0.0)


def against(motion: Motion) -> type[Placed]:
    """How dampers against a motion hang: those against heaving on the axis, where torsion does not move them."""
    return OnAxis if motion is Motion.HEAVING else Placed


@dataclass(frozen=True)
class Exceedance:
    """P(amplitude > limit) by mode, and P(any mode exceeds its limit), each mode in its own lock-in.

    `each_mcse` and `any_mcse` are their Monte Carlo standard errors; None in a sizing of earlier versions.
    """

    each: tuple[float, ...]
    any: float
    each_mcse: tuple[float, ...] | None = None
    any_mcse: float | None = None


def counted(exceeds: BoolArray, rows: Sequence[NDArray[np.integer]]) -> Exceedance:
    """Probabilities by which draws exceed their limits, (modes, N).

    `rows`, of every mode, are as `Draws.row`.  Modes of two motions stand on two posteriors: the error of any of them
    is the larger of those in either order.
    """
    found, union = exceeds.astype(float), exceeds.any(axis=0).astype(float)
    return Exceedance(
        tuple(float(mode.mean()) for mode in found), float(union.mean()),
        tuple(error_by_row(mode, row) for mode, row in zip(found, rows, strict=True)),
        max(error_by_row(union, row) for row in rows),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class ModeDraws:
    """One mode with all dampers that move in it: `DamperDraws` of the mode, and the dampers as ratios to it.

    `row` as of `Draws`.
    """

    draws: DamperDraws
    dampers: tuple[TunedMass, ...]
    row: NDArray[np.integer]

    @property
    def exceeds(self) -> BoolArray:
        """Whether each draw exceeds its limit, (S,)."""
        return np.asarray(self.draws.at_limit(self.dampers)[0] > self.draws.limit)


def joint_draws(models: Sequence[ModeModel], seed: int, points: int = POINTS) -> list[Draws]:
    """Draws of every mode: one coherence and site for all, one section and law for a motion, the rest its own."""
    of_fit, of_bridge = (SECTION, LAW), (COHERENCE, COHERENCE_AMPLITUDE, *TRANSFER)
    of_mode = [source for source in SOURCES if source not in (*of_fit, *of_bridge)]
    fits = list(dict.fromkeys(model.bridge.motion for model in models))  # each motion has a fit of its own
    # One cube with a coordinate for each source of each mode: cubes of their own would tie the modes together.
    common, own = len(of_fit) + len(of_bridge), len(of_mode) * len(models)
    cube = unit_cube(points, seed + 10, common + own + len(of_fit) * (len(fits) - 1))
    draws = []
    for k, model in enumerate(models):
        u = np.empty((points, len(SOURCES)))
        u[:, (*of_fit, *of_bridge)] = cube[:, :common]
        first = common + k * len(of_mode)
        u[:, of_mode] = cube[:, first : first + len(of_mode)]
        if further := fits.index(model.bridge.motion):
            first = common + own + len(of_fit) * (further - 1)
            u[:, of_fit] = cube[:, first : first + len(of_fit)]
        draws.append(model.draws(u))
    return draws


def with_dampers(
    dampers: Sequence[Placed], models: Sequence[ModeModel], limits: Sequence[float], seed: int
) -> tuple[ModeDraws, ...]:
    """Every mode with all dampers of the bridge; modal masses must be stated, and each damper is one in all modes."""
    made = delivered(models[0].bridge.damper, len(dampers), POINTS, seed + 10)
    return tuple(
        _in_mode([each.in_motion(model.bridge.motion) for each in dampers], model, drawn, limit, made, seed + k)
        for k, (model, drawn, limit) in enumerate(zip(models, joint_draws(models, seed), limits, strict=True))
    )


def exceedance_of(modes: Sequence[ModeDraws]) -> Exceedance:
    """Probabilities with the dampers."""
    return counted(np.array([mode.exceeds for mode in modes]), [mode.row for mode in modes])


def placed(dampers: Sequence[Damper], models: Sequence[ModeModel]) -> list[Placed]:
    """The dampers that were found for the modes, with their places."""
    return [
        against(model.bridge.motion)(each.mass or 0.0, each.frequency, each.damping_ratio, position)
        for found, model in zip(dampers, models, strict=True)
        for each, position in zip(found.dampers, found.positions or (), strict=bool(found.dampers))
    ]


def sized_for_any(
    models: Sequence[ModeModel], limits: Sequence[float], dampers: Sequence[Damper], seed: int, tell: Progress
) -> list[Damper]:
    """Dampers of all modes such that the risk of any mode is kept, from those that keep it in every mode alone.

    The modes share the risk of a mode, which is lowered until the union keeps it, with all dampers in all modes.
    """
    asked, found = models[0].bridge.damper.risk, list(dampers)
    most = asked - RISK_MARGIN * float(np.sqrt(asked * (1.0 - asked) / POINTS))
    aim, best = asked, None
    for k in range(_ROUNDS):
        left = exceedance_of(with_dampers(placed(found, models), models, limits, seed + 20)).any
        if left <= most:
            best = found
        if not all(one.achievable for one in found) or _NEAR * most <= left <= most:
            break
        aim *= (0.5 + 0.5 * _NEAR) * most / max(left, 0.1 * most)
        if aim >= asked:
            break
        tell("dampers for any mode", k / _ROUNDS)
        found = [damper(model, limit, seed, risk=aim) for model, limit in zip(models, limits, strict=True)]
    if best is None:
        short = f"not achievable for any mode: a risk of {left:.2g} is left"
        return [replace(one, achievable=False, reason=short if one.achievable else one.reason) for one in found]
    return best


def any_mode_flag(names: Sequence[str], left: Exceedance, request: DamperRequest) -> str | None:
    """What has to be said where the risk of a mode, or of any, is above the one asked for; None where that is not so.

    Parameters
    ----------
    names : sequence of str
        Of several modes.
    left : Exceedance
        With all dampers.
    """
    if left.any <= request.risk:
        return None
    over = [f"{risk:.1%} of mode {name}" for name, risk in zip(names, left.each, strict=True) if risk > request.risk]
    if over or request.risk_of is RiskOf.ANY:
        asked = "any mode" if request.risk_of is RiskOf.ANY else "each mode"
        found = ", ".join([*over, f"{left.any:.1%} of any mode"])
        return (
            f"with all dampers, each acting on every mode, the risk is {found}; {request.risk:.1%} of {asked} is asked"
        )
    return said(
        f"every mode keeps a risk of {request.risk:.1%} with all dampers, but that of any mode is {left.any:.1%}: ",
        FOR_ANY, " sizes them for that",
    )  # fmt: skip


def _in_mode(
    dampers: Sequence[Placed], model: ModeModel, drawn: Draws, limit: float, made: Delivered, seed: int
) -> ModeDraws:
    mode, moving, tuned, where = model.mode, [], [], []
    assert mode.modal_mass is not None
    for k, each in enumerate(dampers):
        assert each.position is not None
        (moves,) = shapes(model, [each.position])
        ratio = each.mass * moves**2 / mode.modal_mass
        if ratio > 1e-9:  # one at a node does not move
            moving.append(k)
            where.append(moves)
            tuned.append(TunedMass(ratio, each.frequency / mode.frequency.mean, each.damping_ratio))
    rows = Delivered(made.frequency[moving], made.damping[moving], made.mass[moving])
    draws = DamperDraws(drawn.amplitude, limit, drawn.detuning, where or 1.0, reality(model, drawn, rows, seed))
    return ModeDraws(draws, tuple(tuned), drawn.row)
