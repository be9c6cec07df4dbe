"""Minimum expected cost, and what it would be worth to know more (value of information, by regression on the draws)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from scruton.arrays import BoolArray, FloatArray
from scruton.sizing.bridge import Cost
from scruton.sizing.dampers import Damper
from scruton.sizing.model import DAMPING, DISCREPANCY, LAW, SECTION, SOURCES, TRANSFER, Draws, ModeModel, unit_cube
from scruton.sizing.risk import Risk
from scruton.sizing.thresholds import DAMPING_TEST_COV, STEADY_COV

POINTS = 1 << 14
_SINGULAR = 1e-13  # of the largest eigenvalue
_KNOTS, _DEGREE = 6, 3


@dataclass(frozen=True, eq=False)
class CostByDamping:
    """Expected cost where damping is bought by the percentage point.

    Attributes
    ----------
    damper, failure, total : (K,) array
        Cost of the damper, expected cost of failure, and their sum.
    best_added_damping, best_total : float
        Where the sum is least.
    at_the_end : bool
        Whether that is the most damping looked at.
    """

    added_damping: FloatArray
    damper: FloatArray
    failure: FloatArray
    total: FloatArray
    best_added_damping: float
    best_total: float
    at_the_end: bool


@dataclass(frozen=True, eq=False)
class CostByMass:
    """Expected cost where dampers are bought by their mass; what is not said here as of `CostByDamping`.

    Attributes
    ----------
    mass : (M,) array
        Of all dampers together [kg].
    allowed : (M,) array of bool
        Within the largest mass ratio and the largest stroke.
    without : float
        Expected cost without a damper.
    best_mass : float
        Where the sum is least; zero kg where none is better.
    """

    mass: FloatArray
    damper: FloatArray
    failure: FloatArray
    total: FloatArray
    allowed: BoolArray
    without: float
    best_mass: float
    best_total: float
    at_the_end: bool


@dataclass(frozen=True)
class Worth:
    """Expected saving, in the currency of the costs, by learning something.

    The kind is "perfect" knowledge of a source (EVPPI), or a "sample", the outcome of an experiment (EVSI).
    """

    name: str
    kind: str
    value: float


@dataclass(frozen=True, eq=False)
class Information:
    """Expected saving if all of one mode and limit were known (EVPI), and its parts, the largest first by kind."""

    perfect: float
    worth: tuple[Worth, ...]


@dataclass(frozen=True)
class Costs:
    """Least expected cost of one mode, and what knowing more is worth, as far as costs are stated.

    `failure` is the cost of a bridge that exceeds its limit.
    """

    currency: str
    failure: float
    by_mass: CostByMass | None = None
    by_damping: CostByDamping | None = None
    information: Information | None = None


def costs(model: ModeModel, risk: Risk, damper: Damper, seed: int) -> Costs:
    """Expected costs of one mode with the costs that its bridge states."""
    cost = model.bridge.cost
    assert cost is not None
    by_damping = known = None
    if cost.per_percent > 0.0:
        by_damping = cost_by_damping(cost, risk.curve.added_damping, risk.curve.probability)
        known = information(model, risk.limit, cost, risk.curve.added_damping, seed=seed)
    by_mass = cost_by_mass(cost, risk.probability, damper) if cost.per_kg > 0.0 else None
    return Costs(cost.currency, cost.failure, by_mass, by_damping, known)


def cost_by_damping(cost: Cost, added: FloatArray, probability: FloatArray) -> CostByDamping:
    """Cost of damping that is bought by the percentage point, with the cost of failure; (K,) arrays."""
    damper, failure = _damping_cost(cost, added), cost.failure * probability
    total = damper + failure
    best = int(np.argmin(total))
    return CostByDamping(added, damper, failure, total, float(added[best]), float(total[best]), best == added.size - 1)


def cost_by_mass(cost: Cost, probability: float, damper: Damper) -> CostByMass | None:
    """Cost of dampers by their mass, with the cost of failure; `probability` is that without any.

    None where no mass of the mode is stated.
    """
    chart, asked = damper.map, damper.asked
    if chart.mass is None:
        return None
    bought, failure = cost.fixed + cost.per_kg * chart.mass, cost.failure * chart.probability
    total, without = bought + failure, cost.failure * probability
    allowed = chart.allowed(asked)
    best = int(np.argmin(np.where(allowed, total, np.inf)))
    place = (float(chart.mass[best]), float(total[best]), best == total.size - 1)
    if not allowed[best] or without <= total[best]:
        place = (0.0, without, False)
    return CostByMass(chart.mass, bought, failure, total, allowed, without, *place)


def _damping_cost(cost: Cost, added: FloatArray) -> FloatArray:
    return np.where(added > 0.0, cost.fixed, 0.0) + cost.per_percent * 100.0 * added


def information(
    model: ModeModel, limit: float, cost: Cost, added: FloatArray, *, seed: int = 0, points: int = POINTS
) -> Information:
    """Value of knowing more before the damper is chosen among `added` (K,).

    Notes
    -----
    An experiment's outcome is simulated for every draw; the expected cost of each choice given the outcome is a
    regression of the cost on it (splines in its ranks), so that no inner simulation is needed.
    """
    u = unit_cube(points, seed + 3)
    draws = model.draws(u)
    damper = _damping_cost(cost, added)
    certain = damper + cost.failure * (draws.needed(limit)[:, None] > added)
    # What does not tell the discrepancy is judged at the mean over it, P(amplitude > limit) given all else: less noise.
    curve = draws.curve
    tau, shift = draws.spread(added[None]), curve.discrepancy * draws.discrepancy
    with np.errstate(divide="ignore", invalid="ignore"):
        log_margin = np.log(limit / draws.amplitude(added[None])) + tau * draws.discrepancy[:, None]
        mean = damper + cost.failure * np.where(tau > 0.0, ndtr(-(log_margin / tau)), log_margin < 0.0)
    now = float(mean.mean(axis=0).min())
    # What a source tells, as numbers on which the need is smooth.
    features = {
        SECTION: [np.log(curve.amplitude), np.log(curve.relaxation), curve.discrepancy],
        DISCREPANCY: [shift],
        LAW: [curve.n],
    }
    worth = [
        Worth(SOURCES[k], "perfect", _saving(certain if k == DISCREPANCY else mean, features.get(k, [u[:, k]])))
        for k in model.uncertain()
    ]
    for name, (tells, outcome) in _experiments(model, draws, u, seed).items():
        worth.append(Worth(name, "sample", _saving(certain if tells else mean, outcome)))
    worth.sort(key=lambda item: (item.kind, -item.value))
    # never below zero: the least cost now has less noise than the draws
    return Information(max(now - float(certain.min(axis=1).mean()), 0.0), tuple(worth))


def _experiments(
    model: ModeModel, draws: Draws, u: FloatArray, seed: int
) -> Mapping[str, tuple[bool, list[FloatArray]]]:
    """Whether an experiment tells the bridge's own discrepancy, and its outcome for every draw."""
    rng = np.random.default_rng([seed, 0xE751])
    size, curve = len(draws), draws.curve

    def noise() -> FloatArray:
        return rng.standard_normal(size)

    def steady(sc: float, deviate: FloatArray) -> list[FloatArray]:
        at = np.full((size, 1), sc)
        on_curve = np.clip(draws.on_curve(at), 1e-6, 10.0)
        off = curve.setting(at, on_curve).off(deviate)[:, 0]
        return [np.log(on_curve[:, 0]) + off + STEADY_COV * noise()]

    bridge_sc = float(np.median(draws.scruton_number(0.0)))
    again = [value + np.std(value) * noise() for value in (np.log(curve.amplitude), np.log(curve.relaxation))]
    experiments = {
        "a rig at the bridge's own Scruton number": (True, steady(bridge_sc, draws.discrepancy)),
        "a rig at twice that Scruton number": (False, steady(2.0 * bridge_sc, noise())),
        "growth records as long as all so far": (False, again),
    }
    if model.bridge.transfer is not None:
        # It shares Reynolds number and details with the bridge, and its discrepancy: one reading of all of them.
        alike = np.zeros(size)
        for k, factor in zip(TRANSFER[1:], model.bridge.transfer.factors[1:], strict=True):
            alike += np.log(factor.quantile(u[:, k]))
        experiments["a large-scale test at the bridge's own Scruton number"] = (
            True, [steady(bridge_sc, draws.discrepancy)[0] + alike],
        )  # fmt: skip
    if DAMPING in model.uncertain():
        test = np.log(draws.damping_ratio) + DAMPING_TEST_COV * noise()
        experiments["a damping test of the finished bridge"] = (False, [test])
    return experiments


def _saving(losses: FloatArray, outcome: Sequence[FloatArray]) -> float:
    """Expected saving when the choice may depend on the outcome; never below zero.

    Each half of the draws is judged by the regression of the other: a choice that only fits noise saves nothing.
    """
    basis = _basis(outcome)
    halves = [(basis[k::2], losses[k::2]) for k in (0, 1)]
    spent = 0.0
    for (here, own), (told, then) in zip(halves, halves[::-1], strict=True):
        # by the normal equations: ranks lie in (0, 1), and what columns have in common is left out
        weights, *_ = np.linalg.lstsq(told.T @ told, told.T @ then, rcond=_SINGULAR)
        choice = (here @ weights).argmin(axis=1)
        spent += float(own[np.arange(len(own)), choice].sum())
    return max(0.0, float(losses.mean(axis=0).min()) - spent / len(losses))


def _basis(outcome: Sequence[FloatArray]) -> FloatArray:
    """Additive cubic splines in the ranks of each coordinate, and products of their first powers."""
    from scipy.interpolate import BSpline
    from scipy.stats import rankdata

    # Places among the draws, in (0, 1); equal values share one.
    ranks = [(rankdata(numbers) - 0.5) / numbers.size for numbers in outcome if np.ptp(numbers) > 0.0]
    columns = [np.ones((outcome[0].size, 1))]
    knots = np.concatenate((np.zeros(_DEGREE), np.linspace(0.0, 1.0, _KNOTS), np.ones(_DEGREE)))
    for rank in ranks:
        columns.append(BSpline.design_matrix(rank, knots, _DEGREE).toarray()[:, 1:])
    for i, rank in enumerate(ranks):
        for other in ranks[i + 1 :]:
            columns += [(rank**p * other**q)[:, None] for p in (1, 2) for q in (1, 2)]
    return np.hstack(columns)
