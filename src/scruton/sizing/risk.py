"""Probability of exceeding a limit against added damping, what a confidence asks for, and which uncertainty matters."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.griffin.thresholds import X_TRUSTED
from scruton.said import Value, damping, listed, said, scruton_number
from scruton.shown import fields_in_brief, shown
from scruton.sizing.checks import LAW_FREE, ByHand, Checks, Evidence, Reach, Required, required_of
from scruton.sizing.limits import Limit
from scruton.sizing.model import LAW, SECTION, SOURCES, Draws, ModeModel, sampling_error, unit_cube
from scruton.sizing.thresholds import LARGEST_ADDED, LAWS_PART, LEAST_PARTED, LEAST_VARIED, ONE_RIG

POINTS, SHARE_POINTS = 1 << 15, 1 << 12
_CURVES, _INNER = 256, 1024  # of the band: curves of the section, and draws of all else for each
_GRID = 81


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class RiskCurve:
    """P(amplitude > limit) and more of one mode against one limit, along the damping ratio that is added.

    Attributes
    ----------
    scruton_number : (K,) array
        Median there.
    probability_05, probability_95 : (K,) array
        5 and 95 % points of that probability over the section's posterior and the laws: what testing could change.
    by_law : mapping
        The same probability under each law alone.
    amplitude_05, amplitude_50, amplitude_95 : (K,) array
        Points of the amplitude [m] or [rad].
    expected_exceedance : (K,) array
        E[max(A - limit, 0)]; NaN where a draw has no stable amplitude.
    """

    added_damping: FloatArray
    scruton_number: FloatArray
    probability: FloatArray
    probability_05: FloatArray
    probability_95: FloatArray
    by_law: Mapping[str, FloatArray]
    amplitude_05: FloatArray
    amplitude_50: FloatArray
    amplitude_95: FloatArray
    expected_exceedance: FloatArray


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class Risk:
    """One mode against one limit.

    Attributes
    ----------
    rule, title, source, confirm : str
        As the user wrote it, and as of `scruton.sizing.limits.Rule`.
    limit : float
        [m] or [rad].
    probability, expected_exceedance : float
        P(amplitude > limit) and E[max(A - limit, 0)] without added damping.
    required, required_text : mapping
        Added damping ratio by confidence ("0.95"), and in words; None where more than `LARGEST_ADDED` would be needed.
    probability_mcse, required_mcse : float, mapping
        Monte Carlo standard errors of the two; None where nothing is required that could be given.
    outside : str or None
        Why the rule does not hold for this mode, where it does not.
    reading : str or None
        What the rule's code says of the median amplitude without added damping, and of its 95 % point.
    reach : mapping
        How far the setting with the required damping lies from what was tested, by confidence.
    required_by_law : mapping
        The required damping by confidence under each law of the card alone, whatever its weight, and "law-free": by
        the damping that the transients show at the amplitude, without a law.
    required_at_discrepancy : mapping
        From one rig: the same where rigs are known to miss the curve by so much ("0.10").
    required_by_hand : float or None
        The added damping where the straight line of 1/A through the measured stable amplitudes meets the limit, with
        the median of all else; None with one setting.
    by_hand : ByHand or None
        The line, and what of it leads there.
    """

    rule: str
    title: str
    source: str
    confirm: str
    limit: float
    probability: float
    expected_exceedance: float
    required: Mapping[str, float | None]
    required_text: Mapping[str, str]
    curve: RiskCurve
    probability_mcse: float | None = None
    required_mcse: Mapping[str, float | None] | None = None
    outside: str | None = None
    reading: str | None = None
    reach: Mapping[str, Reach | None] = field(default_factory=dict)
    required_by_law: Mapping[str, Required] = field(default_factory=dict)
    required_at_discrepancy: Mapping[str, Required] = field(default_factory=dict)
    required_by_hand: float | None = None
    by_hand: ByHand | None = None


def risk(model: ModeModel, limit: Limit, *, seed: int = 0, evidence: Evidence | None = None) -> Risk:
    """Probability of exceeding a limit, against added damping; the required damping is held against the evidence.

    Raises
    ------
    InputError
        Where the limit says nothing of this motion.
    """
    bridge, rule = model.bridge, limit.rule
    place = (model.mode.frequency.mean, bridge.width, bridge.depth)
    largest = limit.amplitude(bridge.motion, *place)
    u = unit_cube(POINTS, seed)
    needed = model.draws(u).needed(largest)
    wanted = required_of(needed)
    top = max(LARGEST_ADDED if damping is None else damping for damping in wanted.values())
    added = np.linspace(0.0, min(max(1.4 * top, 0.002), LARGEST_ADDED), _GRID)
    few = model.draws(u[: POINTS // 4])
    amplitude = few.amplitude(added[None])
    with np.errstate(invalid="ignore"):
        excess = np.maximum(amplitude - largest, 0.0).mean(axis=0)
        low, middle, high = np.quantile(amplitude, [0.05, 0.5, 0.95], axis=0, method="inverted_cdf")
    under, alone = {}, replace(model, laws=replace(model.laws, measured=None))  # each law by itself
    for k, label in enumerate(model.laws.labels):
        if model.laws.weights[k] > 1e-6:
            v = u.copy()
            v[:, LAW] = model.laws.weights[:k].sum() + 0.5 * model.laws.weights[k]
            same = len(model.laws.labels) == 1 and model.laws.measured is None
            under[label] = needed if same else alone.draws(v).needed(largest)
    by_law = {label: probability(needs, added) for label, needs in under.items()}
    # The band: for every curve of the section, draws of all else.
    outer, both = unit_cube(_CURVES, seed + 1), np.tile(unit_cube(_INNER, seed + 2), (_CURVES, 1))
    for source in (SECTION, LAW):
        both[:, source] = np.repeat(outer[:, source], _INNER)
    by_curve = model.draws(both).needed(largest).reshape(_CURVES, _INNER)
    lowest, highest = np.quantile([probability(needs, added) for needs in by_curve], [0.05, 0.95], axis=0)
    curve = RiskCurve(
        added, np.median(few.scruton_number(added[None]), axis=0), probability(needed, added),
        lowest, highest, by_law, low, middle, high, np.where(np.isfinite(excess), excess, np.nan),
    )  # fmt: skip
    never = f"not achievable with added damping up to {100 * LARGEST_ADDED:g} %"
    in_words = {
        name: never if damping is None else f"{100 * damping:.3f} %" if damping else "none"
        for name, damping in wanted.items()
    }
    checks = evidence.checks(model, largest, wanted, u, under) if evidence else Checks()
    return Risk(
        limit.text, rule.title, rule.source, rule.confirm, largest, float(np.mean(needed > 0.0)),
        float(curve.expected_exceedance[0]), wanted, in_words, curve,
        sampling_error((needed > 0.0).astype(float), u),
        {
            name: None if damping is None else sampling_error(needed, u, float(name)) if damping else 0.0
            for name, damping in wanted.items()
        },
        rule.outside(*place) or None,
        "; ".join(
            f"{name} {said}"
            for name, amplitude in (("median", middle[0]), ("95 %", high[0]))
            if (said := limit.reading(bridge.motion, *place, float(amplitude)))
        )
        or None,
        **vars(checks),
    )  # fmt: skip


def remarks(name: str, asked: str, found: Risk, *, coherent: bool = True) -> list[str]:
    """What the reader must know of the damping that is required at a confidence ("0.95") before trusting it.

    What transients ask for is that of a force `coherent` at every amplitude: else the two are not to be compared.
    """
    reach, added = found.reach.get(asked), found.required[asked]
    others = {label: row[asked] for label, row in found.required_by_law.items()}
    by_law = listed([f"{label}: ", *percent(value)] for label, value in others.items())
    where = said(f"mode {name}: the damping required at {100.0 * float(asked):.0f} % (", percent(added), ")")
    sentences: list[str] = []
    if added != 0.0 and reach is not None and not reach.trusted:
        told = "no transient went through the amplitude of the limit there, so it is the law's alone"
        if reach.covered_by:
            told = f"transients of {reach.covered_by} of {reach.tests} tests went through the amplitude of the limit"
        sentences.append(
            said(
                where,
                *lies("", reach, added, f"; {told}. By law: "),
                by_law,
            )
        )
    elif coherent and LAW_FREE in others and _parted(others[LAW_FREE], added):
        sentences.append(
            said(
                where,
                " is the law's: the damping measured at the amplitude of the limit asks for ",
                percent(others[LAW_FREE]),
                ". By law: ",
                by_law,
            )
        )
    if found.required_at_discrepancy:
        stated = listed(
            (
                [*percent(row[asked]), f" where rigs miss the curve by {100.0 * float(tau):.0f} %"]
                for tau, row in found.required_at_discrepancy.items()
            ),
            " and ",
        )
        sentences.append(
            said(
                where,
                " rests on one rig, which says nothing of how far rigs miss the curve: ",
                stated,
                f". It is sized for {100.0 * ONE_RIG:.0f} %; a second rig would tell",
            )
        )
    return sentences


def lies(before: str, reach: Reach, added: float | None, after: str) -> list[str | Value]:
    """Where a required damping lies, between other words; more than is looked at lies beyond where that much does."""
    at, index = ("at", "of") if added is not None else ("beyond", "of at least")
    nearest = f", an extrapolation index {index} {reach.extrapolation_index:.2f} from the nearest test"
    return [f"{before} lies {at} Sc ", scruton_number(reach.scruton_number), nearest + after]


def _parted(value: float | None, other: float | None) -> bool:
    """Whether two required damping ratios differ by so much that what they were found with decides."""
    low, high = sorted(LARGEST_ADDED if x is None else x for x in (value, other))
    return high > LAWS_PART * low + LEAST_PARTED


def percent(value: float | None) -> list[str | Value]:
    """A damping ratio as a remark has it; None is more than can be added."""
    return ["more than ", damping(LARGEST_ADDED)] if value is None else [damping(value)]


def probability(needed: FloatArray, added: FloatArray) -> FloatArray:
    """Fraction of draws that need more than is added."""
    return np.asarray(1.0 - np.searchsorted(np.sort(needed), added, side="right") / needed.size)


def flags(model: ModeModel, draws: Draws) -> list[str]:
    """What the reader must know of a mode before trusting its numbers."""
    remarks = []
    # at the structural damping of the bridge itself: what is added goes further still
    x = draws.curve.index_of_nearest(float(np.median(draws.scruton_number(0.0))))
    if abs(x) > X_TRUSTED:
        remarks.append(
            f"mode {model.mode.name}: the bridge's own damping lies {x:.3g} from the tests (extrapolation index): "
            f"beyond {X_TRUSTED:g} the answer is the law's as much as the records'"
        )
    return remarks


@dataclass(frozen=True)
class Share:
    """What one source contributes to a variance: first-order index (alone), and total (with all its interactions)."""

    source: str
    first: float
    total: float


def shares(model: ModeModel, limit: float, *, added: float = 0.0, seed: int = 0) -> dict[str, tuple[Share, ...]]:
    """Sobol' indices, by quantity ("needed", "amplitude" with `added` damping), the largest total first.

    The section's posterior is one source: its amplitude and relaxation are correlated and cannot be told apart.
    An amplitude beyond ten times the limit, or its own median, counts as that, damping beyond what can be added as that
    much.  Where nearly every draw needs more the few that do not say nothing of the others: their indices are 0.
    """
    draws = model.draws(unit_cube(SHARE_POINTS, seed))
    most = 10.0 * max(limit, _finite(float(np.median(draws.amplitude(added)))))
    needed = sobol_shares(model, lambda u: np.clip(model.draws(u).needed(limit), -LARGEST_ADDED, LARGEST_ADDED), seed)
    if np.mean(draws.needed(limit) < LARGEST_ADDED) < LEAST_VARIED:
        needed = tuple(replace(one, first=0.0, total=0.0) for one in needed)
    amplitude = sobol_shares(model, lambda u: np.minimum(model.draws(u).amplitude(added), most), seed)
    return {"needed": needed, "amplitude": amplitude}


def _finite(value: float) -> float:
    return value if np.isfinite(value) else 0.0


def sobol_shares(
    model: ModeModel, function: Callable[[FloatArray], FloatArray], seed: int, points: int = SHARE_POINTS
) -> tuple[Share, ...]:
    """Sobol' indices of a function of the unit cube."""
    from scipy.stats import sobol_indices, uniform

    sources = model.uncertain()
    if len(sources) == 1:
        return (Share(SOURCES[sources[0]], 1.0, 1.0),)

    def of(rows: FloatArray) -> FloatArray:
        flat = rows.reshape(len(sources), -1)
        u = np.full((flat.shape[1], len(SOURCES)), 0.5)
        u[:, list(sources)] = np.clip(flat.T, 1e-9, 1.0 - 1e-9)
        return function(u).reshape(1, *rows.shape[1:])

    cube: Any = [uniform()] * len(sources)
    indices = sobol_indices(func=of, n=points, dists=cube, rng=np.random.default_rng([seed, 0x50B0]))
    both = np.stack([indices.first_order.ravel(), indices.total_order.ravel()])
    if not np.isfinite(both).all():
        both = np.zeros_like(both)  # the same in every draw: there is no variance to share
    shares = np.clip(both, 0.0, 1.0).T.tolist()  # noise takes an estimate beyond what a share can be
    rows = [Share(SOURCES[source], *orders) for source, orders in zip(sources, shares, strict=True)]
    return tuple(sorted(rows, key=lambda row: -row.total))
