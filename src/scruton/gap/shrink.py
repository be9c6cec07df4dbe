"""How far the gap shrinks once the effect is in the model: on the records used, and on Scruton numbers left out."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.documents import as_json
from scruton.dynamics.effects import CATALOGUE, UNKNOWN, Term
from scruton.gap.curves import Discrepancy, damping_discrepancy
from scruton.gap.data import GapData
from scruton.gap.density import NormalPosterior, density, parameters_spent, posterior_at_mode, posterior_without
from scruton.gap.diagnosis import Diagnosis
from scruton.gap.hypothesis import FittedHypothesis
from scruton.gap.predict import stable_amplitude
from scruton.gap.thresholds import MEASURABLE_NATS, TAIL

METRIC = (
    "joint log predictive density of whole records, nats short of the ceiling that the noise sets; held out: "
    "parameters from the other Scruton numbers and still air alone"
)
_RESAMPLES = 2000


@dataclass(frozen=True)
class HeldOut:
    """The gap on records left out: see `Shrink`; one record gives no `interval90`."""

    records: tuple[str, ...]
    before: float
    after: float
    fraction: float | None
    interval90: tuple[float, float] | None


@dataclass(frozen=True)
class StableAmplitude:
    """Stable amplitude of a test, predicted from the other Scruton numbers.

    Attributes
    ----------
    test : str
    measured : float
        Mean of the last fifth of its records, or as stated; A/D or rad, as read.
    before, after : float
        As the bare model and the verdict's predict it.
    error_before, error_after : float
        Relative.
    """

    test: str
    measured: float
    before: float
    after: float
    error_before: float
    error_after: float


@dataclass(frozen=True)
class RunnerUp:
    """The next best effect and the part of the held-out gap that it closes."""

    effect: str
    fraction: float | None


@dataclass(frozen=True)
class Shrink:
    """How far the gap shrinks.

    Attributes
    ----------
    metric : str
    before, after : float
        Nats that the bare model and the verdict's fall short of the ceiling, on all records, the parameters that were
        fitted to them discounted.
    fraction : float or None
        (before - after)/before; None where the gap is too small to measure.
    interval90 : (float, float) or None
        By bootstrap over records; None for a single one, which says nothing of its like.
    held_out : HeldOut or None
        None where no record can be left out.
    measurable : bool
        Whether the gap is large enough to be measured: on the records held out, or, without any, on those used.
    statement : str
    runner_up : RunnerUp or None
        Its fraction is None, too, where no record can be left out.
    stable_amplitude : tuple of StableAmplitude
        One for each test left out in turn.
    damping_discrepancy : Discrepancy or None
        Of damping curves; None without wind.
    """

    metric: str
    before: float
    after: float
    fraction: float | None
    interval90: tuple[float, float] | None
    held_out: HeldOut | None
    measurable: bool
    statement: str
    runner_up: RunnerUp | None
    stable_amplitude: tuple[StableAmplitude, ...]
    damping_discrepancy: Discrepancy | None

    def to_json(self) -> dict[str, Any]:
        """Plain numbers, lists and strings."""
        return as_json(asdict(self))  # type: ignore[no-any-return]


def shrink(diagnosis: Diagnosis, *, workers: int = 2, seed: np.random.SeedSequence | None = None) -> Shrink:
    """Measure the gap before and after the effects found, on the records used and on records held out.

    Every Scruton number is left out in turn (all records in wind of its test; every record in turn where there is one
    test, or only still air).  A hypothesis is fitted to the rest.  What is left out is scored by the joint density
    of all its cycles, all records of a test at once, parameters integrated over what the rest says of them, normal
    about the optimum.  What is its own alone (detuning, reading, imperfections within the tolerances, an effect's
    parameter of one record) is integrated over its prior; and the scatter of a test is that of the other tests, to
    within 20 per cent, lest a wrong model explain its misses by turbulence.  The damping ratio that was stated for
    the rig is scored with the records: still-air decays, which stay, may say another.

    The ceiling is the density that a record has when the shared parameters are known, its own integrated as before:
    its density at the fit to all records, less half the effective number of parameters fitted to it.  Of the null
    model, the verdict and the generic one, that which comes highest in all is what noise allows.  On the records used,
    a model counts by what it would score on a replicate of them: as the ceiling, but less the whole effective number
    of parameters.

    Parameters
    ----------
    diagnosis : Diagnosis
    workers : int
        Threads.
    seed : SeedSequence, optional
        Of the bootstrap.
    """
    data = diagnosis.data
    folds = _folds(data)
    models = [diagnosis.null, diagnosis.final]
    generic = diagnosis.singles[UNKNOWN.name].best if UNKNOWN.name in diagnosis.singles else None
    runner = _runner_up(diagnosis)
    references = [*models, *([generic] if generic is not None and generic is not diagnosis.final else [])]
    learners = [*models, *([runner[1]] if runner else [])]
    held = [fold for fold, out in folds if out]
    with ThreadPoolExecutor(workers) as pool:
        known_jobs = [pool.submit(_known, m, [fold for fold, _ in folds]) for m in references]
        left_out_jobs = [[pool.submit(_left_out, m, fold) for fold in held] for m in learners]
        known = np.array([job.result() for job in known_jobs])
        left_out = [[job.result() for job in jobs] for jobs in left_out_jobs]
    best = int(np.argmax((known[:, 0] - 0.5 * known[:, 1]).sum(axis=1)))
    ceiling = known[best, 0] - 0.5 * known[best, 1]
    used = ceiling - (known[:2, 0] - known[:2, 1])
    rng = np.random.default_rng(seed or np.random.SeedSequence(0))
    before, after = (float(x) for x in used.sum(axis=1))
    fraction = _fraction(used[0], used[1]) if before > MEASURABLE_NATS else None
    measurable, held_out, by_runner = fraction is not None, None, None
    if held:
        mask = np.any(held, axis=0)
        short = np.array([(ceiling - np.sum([scores for _, scores, _ in parts], axis=0))[mask] for parts in left_out])
        learnt = sum(cost for _, _, cost in left_out[0])
        measurable = float(short[0].sum()) - learnt > MEASURABLE_NATS
        held_out = _held_out(tuple(np.array(data.layout.records)[mask].tolist()), short[0], short[1], measurable, rng)
        by_runner = _fraction(short[0], short[2]) if runner and measurable else None
    stable: tuple[StableAmplitude, ...] = ()
    discrepancy = None
    if data.layout.wind.any():
        by_test = [(fold, left_out[0][i][0], left_out[1][i][0]) for i, fold in enumerate(held) if _is_test(data, fold)]
        misstated = any(Term.STRUCTURAL in CATALOGUE[name].terms for name in diagnosis.found if name in CATALOGUE)
        stable = tuple(_stable_amplitude(data, fold, null, final, misstated) for fold, null, final in by_test)
        pairs = [(null.optimum, final.optimum) for _, null, final in by_test]
        discrepancy = damping_discrepancy(diagnosis.null, diagnosis.final, pairs)
    return Shrink(
        METRIC, before, after, fraction, _bootstrap(used[0], used[1], rng) if fraction is not None else None, held_out,
        measurable, _statement(measurable, held_out, diagnosis.verdict),
        RunnerUp(runner[0], by_runner) if runner else None, stable, discrepancy,
    )  # fmt: skip


def _folds(data: GapData) -> list[tuple[np.ndarray, bool]]:
    """Groups of records that make up the campaign, and whether each is left out in turn."""
    layout = data.layout
    tests = np.unique(layout.test[layout.wind])
    count = len(layout.records)
    if tests.size > 1:
        found = [(layout.test == j, True) for j in tests]
        return found + [(~layout.wind & (layout.rig == i), False) for i in np.unique(layout.rig[~layout.wind])]
    wind = layout.wind if tests.size else np.ones(count, dtype=bool)
    return [(np.arange(count) == r, bool(wind[r]) and count > 1) for r in range(count)]


def _is_test(data: GapData, fold: np.ndarray) -> bool:
    test = data.layout.test
    first = int(np.flatnonzero(fold)[0])
    return bool(test[first] >= 0 and np.array_equal(fold, test == test[first]))


def _runner_up(diagnosis: Diagnosis) -> tuple[str, FittedHypothesis] | None:
    named = [
        (name, one.best)
        for name, one in diagnosis.rivals.items()
        if name in CATALOGUE and name not in diagnosis.found and one.best is not None
    ]
    return max(named, key=lambda pair: pair[1].log_evidence) if named else None


def _known(model: FittedHypothesis, folds: Sequence[np.ndarray]) -> FloatArray:
    """Density of every record, parameters as all records settle them, and parameters spent on it, (2, R)."""
    found = np.zeros((2, len(folds[0])))
    for fold in folds:
        known = posterior_at_mode(model, fold)
        scored = density(known, fold)
        found[0, fold] = scored.shares[fold]
        found[1, fold] = parameters_spent(known, scored, model.covariance) / np.count_nonzero(fold)
    return found


def _left_out(model: FittedHypothesis, fold: np.ndarray) -> tuple[NormalPosterior, FloatArray, float]:
    """What the other records say, the density of those left out, (R,), and what a right model would lose in all."""
    known = posterior_without(model, fold)
    scored = density(known, fold)
    prior = posterior_at_mode(model, fold).covariance[np.ix_(scored.where, scored.where)]
    own = np.diag(prior) > 0.0
    alone = np.eye(int(own.sum())) + scored.information[np.ix_(own, own)] @ prior[np.ix_(own, own)]
    cost = scored.learnt - 0.5 * float(np.linalg.slogdet(alone)[1])
    return known, np.where(fold, scored.shares, 0.0), cost


def _held_out(
    names: tuple[str, ...], before: FloatArray, after: FloatArray, measurable: bool, rng: np.random.Generator
) -> HeldOut:
    """The gap on the records left out, and how far it shrinks where it can be measured."""
    return HeldOut(
        names, float(before.sum()), float(after.sum()), _fraction(before, after) if measurable else None,
        _bootstrap(before, after, rng) if measurable else None,
    )  # fmt: skip


def _fraction(before: FloatArray, after: FloatArray) -> float:
    return float((before.sum() - after.sum()) / before.sum())


def _bootstrap(before: FloatArray, after: FloatArray, rng: np.random.Generator) -> tuple[float, float] | None:
    """90 % interval of the fraction over records like these; None of a single one, all of whose resamples are it."""
    if before.size < 2:
        return None
    chosen = rng.integers(0, before.size, (_RESAMPLES, before.size))
    b, a = before[chosen].sum(axis=1), after[chosen].sum(axis=1)
    found = (b - a)[b > 0.0] / b[b > 0.0]
    low, high = np.quantile(found, [0.05, 0.95])
    return float(low), float(high)


def _stable_amplitude(
    data: GapData, fold: np.ndarray, null: NormalPosterior, final: NormalPosterior, misstated: bool
) -> StableAmplitude:
    """The stable amplitude of a test left out, as read; a misstated damping is what the bare model goes by."""
    records = np.flatnonzero(fold)
    test = next(t for t in data.campaign.tests if t.name == data.tests[data.layout.test[records[0]]])
    stated = test.stable_amplitude
    measured = stated.mean if stated else float(np.mean([_tail(data, int(r)) for r in records]))
    number = float(data.layout.scruton_number[records[0]]) if misstated else None
    before, after = (
        float(np.median([stable_amplitude(k.hypothesis, k.optimum[None], int(r), scruton_number=n, reading=True)[0]
                         for r in records]))
        for k, n in ((null, number), (final, None))
    )  # fmt: skip
    return StableAmplitude(
        test.name, measured, before, after, abs(before - measured) / measured, abs(after - measured) / measured
    )


def _tail(data: GapData, record: int) -> float:
    a = data.cycles[data.layout.records[record]].amplitude
    return float(np.mean(a[-max(5, int(TAIL * a.size)) :]))


def _statement(measurable: bool, held: HeldOut | None, verdict: str) -> str:
    if held is None:
        return "no record can be left out: the gap is not measured on held-out records"
    if not measurable or held.fraction is None:
        return "the gap is too small to measure on held-out records"
    what = "a generic term, for the unknown," if verdict == UNKNOWN.name else verdict
    closed = f"{what} closes {held.fraction:.0%} of the gap on held-out records"
    if held.interval90 is None:
        return f"{closed} (one record: no interval)"
    low, high = held.interval90
    return f"{closed} (90 % interval {low:.0%} to {high:.0%})"
