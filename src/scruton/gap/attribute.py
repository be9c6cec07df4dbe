"""Which effect: the evidence of every catalogued effect against none and against the unknown.

Score tests from one optimum alone tell which variants are worth a fit.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import log_ndtr, logsumexp

from scruton.arrays import FloatArray
from scruton.dynamics.effects import CATALOGUE, Effect, Layout
from scruton.dynamics.effects.effect import DAMPING, DRIVE, FREQUENCY, REPEATED, Extent, Parameter, Variant
from scruton.gap.hypothesis import FittedHypothesis
from scruton.gap.screen import ScoreTest, Screen, first_starts
from scruton.gap.thresholds import (
    CREEP,
    FAR_BEHIND_THE_BEST,
    FIT_SHARE,
    FIT_WITHIN,
    HOPELESS,
    LOST,
    MOST_FITS,
    NOTICED,
    QUICK_FITS,
    READING_SHARE,
    REFINED_NATS,
    REPEATS,
    ROUGHLY,
)


@dataclass(frozen=True, eq=False)
class Candidate:
    """One effect, weighed."""

    name: str
    log_evidence: float  # averaged over its variants by their prior weights; -inf where none can act
    best: FittedHypothesis | None  # of the variant with the highest evidence

    @property
    def variant(self) -> Variant | None:
        """The best variant."""
        return self.best.hypothesis.variants[-1] if self.best else None

    @property
    def optimum(self) -> dict[str, FloatArray]:
        """Where the parameters of the best variant were found, in their sampled coordinates."""
        if self.best is None:
            return {}
        variants = self.best.hypothesis.variants
        return {p.name: self.best.value(p.name, len(variants) - 1)[0] for p in variants[-1].parameters}


def best_of(candidates: Mapping[str, Candidate]) -> Candidate:
    """The catalogued effect with the most evidence; where a card leaves none of them, one without a name or a fit."""
    catalogued = (c for name, c in candidates.items() if name in CATALOGUE)
    return max(catalogued, key=lambda c: c.log_evidence, default=Candidate("", LOST, None))


def weigh(
    base: FittedHypothesis,
    effects: Sequence[Effect],
    *,
    workers: int = 2,
    quick: Collection[str] = (),
    known: Candidate | None = None,
) -> dict[str, Candidate]:
    """Evidence of every effect added to a hypothesis at its optimum; those that are `quick` by fewer variants.

    What is `known` of one of them, beside another base, is fitted from where it was found, too.  Beside a base whose
    evidence is no number nothing is worth more than that.
    """
    if base.is_lost:
        return {effect.name: Candidate(effect.name, LOST, None) for effect in effects}
    screen = Screen(base)
    with ThreadPoolExecutor(workers) as pool:  # the filter lets go of the interpreter
        tested = list(pool.map(screen.tests, effects))
        promising = [
            _promising(tests, QUICK_FITS if effect.name in quick else MOST_FITS)
            for effect, tests in zip(effects, tested, strict=True)
        ]

        def fits(tests: Sequence[ScoreTest], enough: float = 0.0) -> list[FittedHypothesis]:
            def fit(one: ScoreTest) -> FittedHypothesis:  # what is scanned for begins where nothing leads on
                return base.with_variants(one.variant, start=one.start, enough=0.0 if one.variant.scan else enough)

            return list(pool.map(fit, tests))

        chosen = [ranked[0] for ranked in promising if ranked]
        found = fits(chosen, ROUGHLY)
        # Promises hold to second order: what comes near the lesser of what the first one promised and what it kept.
        kept = {
            test.variant.effect: fit.log_evidence - base.log_evidence for test, fit in zip(chosen, found, strict=True)
        }
        others = []
        for effect, tests in zip(effects, promising, strict=True):
            if not tests:
                continue
            first, *ranked = tests
            share = READING_SHARE if effect.channel == "signal" else FIT_SHARE
            gained = kept[first.variant.effect]
            least, most = sorted(max(gain, 0.0) for gain in (first.gain, gained))
            # what is scanned for promises the less the more of it noise has taken up: the others as the first one
            off = max(share * most, gained - first.gain) if first.variant.scan else share * most
            needed = max(least - FIT_WITHIN, HOPELESS) - off
            others += [test for test in ranked if test.gain >= needed]
        once_more = []
        if known is not None and known.variant is not None:
            others.append(ScoreTest(known.variant, 0.0, known.optimum))
            once_more.append((others[-1], pool.submit(_again, base, known)))
        chosen, found = [*chosen, *others], [*found, *fits(others, ROUGHLY)]
        near = max(fit.log_evidence for fit in (base, *found)) - FAR_BEHIND_THE_BEST
        found = list(pool.map(lambda fit: fit.hypothesis.fit(fit.mode) if fit.log_evidence > near else fit, found))
        chosen, found = [*chosen, *(test for test, _ in once_more)], [*found, *(job.result() for _, job in once_more)]
        finer = list(_refinements(base, tested, chosen, found))
        chosen, found = [*chosen, *finer], [*found, *fits(finer)]
    twins = list(_twins(base, [test for tests in tested for test in tests], chosen, found))
    chosen, found = [*chosen, *(test for test, _ in twins)], [*found, *(fit for _, fit in twins)]
    candidates = {}
    for effect, tests in zip(effects, tested, strict=True):
        total = sum(variant.weight for variant in effect.variants(base.hypothesis.data.layout))
        fitted = [(test, fit) for test, fit in zip(chosen, found, strict=True) if test.variant.effect == effect.name]
        # What was not fitted has its share of the prior all the same, so that many hopeless variants dilute.
        logs = [
            np.log(test.variant.weight / total) + fit.log_evidence + (0.0 if fit.is_lost else log_noticeable(fit))
            for test, fit in fitted
        ]
        if fitted:
            best = fitted[int(np.argmax(logs))][1]
            once: dict[object, float] = {}  # a variant may have been fitted twice
            for (test, _), log in zip(fitted, logs, strict=True):
                once[test.variant.identity] = max(log, once.get(test.variant.identity, -np.inf))
            evidence = float(logsumexp(list(once.values())))
        else:
            evidence, best = base.log_evidence + min(max((t.gain for t in tests), default=-np.inf), -1.0), None
        candidates[effect.name] = Candidate(effect.name, evidence, best)
    return candidates


def _again(base: FittedHypothesis, known: Candidate) -> FittedHypothesis:
    """The variant of a candidate beside another base, from where all of its fit was found, but for what is in the base.

    A bend of the frequency is not found again where the phases start from a base that knows of none.
    """
    assert known.best is not None
    assert known.variant is not None
    larger = base.hypothesis.extended(known.variant)
    start, shared = larger.start_from(base.mode, known.optimum), sum(p.size for p in larger.null.parameters)
    start[:shared] = known.best.mode[:shared]
    return larger.fit(start)


def _refinements(
    base: FittedHypothesis,
    tested: Sequence[Sequence[ScoreTest]],
    chosen: Sequence[ScoreTest],
    found: Sequence[FittedHypothesis],
) -> Iterator[ScoreTest]:
    """What refines the best of an effect's forms that may be refined, where that gains much: from where it was found.

    With the base held still it promises nothing beside a form that is nearly right.
    """
    fitted = {test.variant.identity for test in chosen}
    for tests in tested:
        finer: dict[object, list[ScoreTest]] = {}
        for test in tests:
            if test.variant.refines:
                finer.setdefault(test.variant.plain, []).append(test)
        plain = [
            Candidate(test.variant.effect, fit.log_evidence, fit)
            for test, fit in zip(chosen, found, strict=True)
            if test.variant.identity in finer
        ]
        best = max(plain, key=lambda one: one.log_evidence, default=None)
        if best is None or best.variant is None or best.log_evidence < base.log_evidence + REFINED_NATS:
            continue
        for test in finer[best.variant.identity]:
            if test.variant.identity not in fitted:
                yield ScoreTest(test.variant, test.gain, first_starts(test.variant) | best.optimum)


def _twins(
    base: FittedHypothesis, tests: Sequence[ScoreTest], chosen: Sequence[ScoreTest], found: Sequence[FittedHypothesis]
) -> Iterator[tuple[ScoreTest, FittedHypothesis]]:
    """What was not fitted of one effect and does just what was fitted of another: one fit holds for both.

    A promise with the base held still is too low beside others, so that one effect alone would have the form.
    """
    fitted = {test.variant.identity for test in chosen}
    for test in tests:
        if test.variant.identity not in fitted:
            for other, fit in zip(chosen, found, strict=True):
                if test.variant.does_what(other.variant):
                    yield test, replace(fit, hypothesis=base.hypothesis.extended(test.variant))
                    break


def _promising(tests: Sequence[ScoreTest], most: int) -> list[ScoreTest]:
    """The most promising variants of an effect, at most so many, the first one first; none where that is hopeless.

    Of variants that differ in their rig, test or record alone the best stands for all.  What is scanned for is never
    hopeless: at an optimum whose gusts follow its beats or jumps little of it is left to score.
    """
    ranked: dict[tuple[str, Extent], ScoreTest] = {}
    for test in sorted(tests, key=lambda test: -test.gain - np.log(test.variant.weight)):
        ranked.setdefault((test.variant.form, test.variant.scope.extent), test)
    best = [*ranked.values()][:most]
    return best if best and (best[0].gain >= HOPELESS or best[0].variant.scan) else []


def log_noticeable(fit: FittedHypothesis) -> float:
    r"""What the log evidence of an effect gains by its being no smaller than anybody would notice.

    .. math:: \ln\frac{P(\max|s| > s_0 \mid y)}{P(\max|s| > s_0)}

    for the sizes s, in units of the relaxation damping, of the drive or of the frequency, of the variant that was added
    last, with the normal approximation of their posterior. No gap and one of less than :math:`s_0` are the same thing;
    and so are a force off the response that takes longer than a record to beat with it once, and more drive. Of what is
    not the same in every record those alone count that tell: some are too short to show that anything is small.
    """
    last = len(fit.hypothesis.variants) - 1
    variant = fit.hypothesis.variants[last]
    least = {DAMPING: NOTICED, DRIVE: NOTICED, FREQUENCY: CREEP, REPEATED: REPEATS}
    sizes = [p for p in variant.parameters if p.unit in least and not p.log and p.name != variant.scan]
    sized = [(p, least[p.unit]) for p in sizes]
    detuned = [p for p in variant.parameters if p.name == variant.scan == "detuning"]
    beating = [(p, _one_beat(p, fit.hypothesis.data.layout)) for p in detuned]

    def gained(of: Sequence[tuple[Parameter, FloatArray | float]]) -> float:
        """What is just noticeable stands beside each parameter."""
        modes, sds = (np.concatenate(x) for x in zip(*(_found(fit, p, last) for p, _ in of), strict=True))
        centres, scales, positive = (
            np.concatenate([np.broadcast_to(getattr(p, name), p.size) for p, _ in of])
            for name in ("location", "scale", "positive")
        )
        unit = np.concatenate([np.broadcast_to(noticed, p.size) for p, noticed in of])
        each = np.concatenate([np.full(p.size, p.unit == REPEATED) for p, _ in of])
        tell = ~each | ((sds > 0.0) & (sds < 0.5 * unit))  # the only record of a rig is off nothing
        if not tell.any():
            return -np.inf
        posterior = _log_any_beyond((modes / unit)[tell], (sds / unit)[tell], positive[tell])
        return posterior - _log_any_beyond((centres / unit)[tell], (scales / unit)[tell], positive[tell])

    return sum(gained(of) for of in (sized, beating) if of)


def _found(fit: FittedHypothesis, parameter: Parameter, owner: int) -> tuple[FloatArray, FloatArray]:
    """Mode and standard deviation; of what differs between records from the mean of its rig, which may be any."""
    mode, sd = fit.value(parameter.name, owner)
    if parameter.unit != REPEATED or parameter.size == 1:
        return mode, sd
    where, layout = fit.hypothesis.slices[owner, parameter.name], fit.hypothesis.data.layout
    rig = np.array([layout.rig[parameter.members == g][0] for g in range(parameter.size)])
    same = rig[:, None] == rig
    about = np.eye(parameter.size) - same / same.sum(axis=1)
    return about @ mode, np.sqrt(np.diag(about @ fit.covariance[where, where] @ about.T))


def _one_beat(detuning: Parameter, layout: Layout) -> FloatArray:
    """Detuning, over the frequency, of one beat in the longest record of each member, (G,)."""
    cycles = layout.duration * layout.omega / (2.0 * np.pi)
    return np.array([1.0 / cycles[detuning.members == g].max() for g in range(detuning.size)])


def _log_any_beyond(centres: FloatArray, scales: FloatArray, positive: np.ndarray) -> float:
    """Log probability that any of some normal sizes, (n,) each, is above one; those that are positive cut at zero.

    In logarithms throughout: of a size whose likelihood falls from zero on, either probability alone is nothing.
    """
    above, below = (log_ndtr((side * centres - 1.0) / scales) for side in (1.0, -1.0))
    beyond = np.minimum(np.where(positive, above - log_ndtr(centres / scales), np.logaddexp(above, below)), 0.0)
    with np.errstate(divide="ignore"):
        within = np.log(-np.expm1(beyond))
    # the first beyond, or the second and not the first, and so on
    return float(logsumexp(beyond + np.cumsum(np.r_[0.0, within[:-1]])))
