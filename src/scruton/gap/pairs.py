"""Two effects that explain together what either alone does not, where the generic term leads all single ones."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from scruton.dynamics.effects import CATALOGUE, Effect
from scruton.dynamics.effects.effect import DAMPING
from scruton.gap import thresholds
from scruton.gap.attribute import Candidate, best_of, weigh
from scruton.gap.hypothesis import FittedHypothesis

# Both say how the drive goes with the amplitude, and forms of the first do what both do: together they are one.
_DRIVE = frozenset({"aerodynamic_damping_nonlinearity", "spanwise_coherence_loss"})


def one_with(name: str) -> frozenset[str]:
    """Effects that none of this name is told apart from where both act."""
    return _DRIVE - {name} if name in _DRIVE else frozenset()


def best_pair(
    base: FittedHypothesis,
    singles: Mapping[str, Candidate],
    effects: Sequence[Effect],
    *,
    damping: bool = False,
    workers: int,
) -> tuple[Candidate, ...]:
    """The pair with the most evidence beside a hypothesis, each found beside the one before; none where no two do.

    Parameters
    ----------
    base : FittedHypothesis
    singles : mapping
        Every effect that may join, added to `base` alone.
    effects : sequence of Effect
        Of the catalogue.
    damping : bool
        Whether both have to add structural damping.
    workers : int
        Threads.
    """
    pair = max(_pairs(base, singles, effects, damping=damping, workers=workers), key=_evidence_of, default=())
    return max(pair, _again(base, *pair, effects, workers), key=_evidence_of) if pair else ()


def _pairs(
    base: FittedHypothesis,
    singles: Mapping[str, Candidate],
    effects: Sequence[Effect],
    *,
    damping: bool,
    workers: int,
) -> Iterator[tuple[Candidate, Candidate]]:
    """Each of the best single effects with its best partner; those that have a line of their own join by themselves.

    Two effects that explain nothing alone and everything together are large, bend opposite ways, and make a curve of
    any form: such a pair is a fit and no finding, unless both add structural damping, so that neither mends the other.
    """
    amplitude = [effect for effect in effects if effect.name in CATALOGUE and effect.channel in ("amplitude", "signal")]
    named = [single for effect in amplitude if (single := singles.get(effect.name)) and single.best is not None]
    for first in sorted(named, key=lambda single: -single.log_evidence)[: thresholds.PAIRED]:
        assert first.best is not None
        apart_from = {first.name} | one_with(first.name)
        others = [effect for effect in amplitude if effect.name not in apart_from and effect.name in singles]
        second = best_of(weigh(first.best, others, workers=workers, quick=CATALOGUE))
        if second.best is None:
            continue
        gain = second.log_evidence - base.log_evidence
        own = min(singles[name].log_evidence - base.log_evidence for name in (first.name, second.name))
        enough = second.log_evidence > first.log_evidence + thresholds.SECOND_NATS
        apart = not damping and own > thresholds.OWN_SHARE * gain
        if enough and (apart or _both_damp(second.best)):
            yield first, second


def _again(
    base: FittedHypothesis, first: Candidate, second: Candidate, effects: Sequence[Effect], workers: int
) -> tuple[Candidate, Candidate]:
    """A pair, each weighed once more with the other in the model.

    The form that explains most alone may be another: of friction and drag either takes what bends the other's way.
    """
    of = {effect.name: [effect] for effect in effects}
    for _ in range(2):
        if second.variant is None:
            break
        beside = base.with_variants(second.variant, start=second.optimum)
        first, second = second, weigh(beside, of[first.name], workers=workers)[first.name]
    return first, second


def _both_damp(fit: FittedHypothesis) -> bool:
    """Whether the two effects that joined last add structural damping, each and at any amplitude."""
    wind = fit.hypothesis.data.layout.wind
    for k in (len(fit.hypothesis.variants) - 2, len(fit.hypothesis.variants) - 1):
        variant = fit.hypothesis.variants[k]
        sizes = [fit.value(p.name, k) for p in variant.parameters if p.unit == DAMPING and not p.log]
        in_still_air = bool(np.any(variant.scope.records & ~wind))
        if not (sizes and in_still_air and all(np.all(size > -2.0 * sd) for size, sd in sizes)):
            return False
    return True


def _evidence_of(pair: Sequence[Candidate]) -> float:
    return pair[-1].log_evidence
