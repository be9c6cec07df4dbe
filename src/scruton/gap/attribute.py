"""Which effect: the evidence of every catalogued effect against none and against the unknown."""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from scruton.arrays import FloatArray
from scruton.dynamics.effects import CATALOGUE, UNKNOWN, Effect
from scruton.dynamics.effects.effect import Variant
from scruton.dynamics.effects.terms import Layout
from scruton.gap.hypothesis import FittedHypothesis
from scruton.gap.screen import ScoreTest, Screen, first_starts
from scruton.gap.thresholds import FIT_SHARE, FIT_WITHIN, HOPELESS, MOST_FITS


@dataclass(frozen=True, eq=False)
class Candidate:
    """One effect, weighed.

    Attributes
    ----------
    name : str
    log_evidence : float
        Averaged over its variants by their prior weights; -inf where none can act.
    best : FittedHypothesis or None
        Of the variant with the highest evidence.
    """

    name: str
    log_evidence: float
    best: FittedHypothesis | None

    @property
    def variant(self) -> Variant | None:
        """The best variant."""
        return self.best.hypothesis.variants[-1] if self.best else None


def score_tests(screen: Screen, effect: Effect) -> list[ScoreTest]:
    """Screen every variant of an effect."""
    found = []
    for variant in effect.variants(screen.data.layout):
        first = variant.parameters[0]
        if variant.scan:
            found.append(screen.scan(variant))
        elif len(variant.parameters) == 1 and first.log:
            about = (float(first.location + first.scale * x) for x in (-2.0, -1.2, -0.5, 0.0, 0.5, 1.2))
            found.append(screen.direct(variant, sorted({*first.starts, *about})))
        elif any(p.log or p.starts[0] for p in variant.parameters):
            found.append(_conditional(screen, variant))
        else:
            found.append(screen.linear(variant))
    return found


def _conditional(screen: Screen, variant: Variant) -> ScoreTest:
    """Variants whose further parameters shape the first: screened by the first with the others at their starts."""
    layout = screen.data.layout

    def apply(table: FloatArray, values: Mapping[str, FloatArray], _layout: Layout) -> None:
        fixed = {
            p.name: np.where(p.members >= 0, np.exp(p.starts[0]) if p.log else p.starts[0], 0.0)[None]
            * np.ones((len(table), 1))
            for p in variant.parameters[1:]
        }
        variant.apply(table, {**values, **fixed}, layout)

    first = screen.linear(replace(variant, parameters=variant.parameters[:1], apply=apply))
    return ScoreTest(variant, first.gain, first_starts(variant))


def weigh(screen: Screen, effects: Sequence[Effect], *, workers: int = 2) -> dict[str, Candidate]:
    """Evidence of every effect added to a hypothesis.

    Parameters
    ----------
    screen : Screen
        At the optimum of that hypothesis.
    effects : sequence of Effect
    workers : int
        Threads: the filter lets go of the interpreter.
    """
    base = screen.base
    with ThreadPoolExecutor(workers) as pool:
        tested = list(pool.map(lambda effect: score_tests(screen, effect), effects))
        chosen: list[ScoreTest] = []
        for tests in tested:
            ranked = sorted(tests, key=lambda test: -test.gain - np.log(test.variant.weight))[:MOST_FITS]
            bar = ranked[0].gain - FIT_WITHIN - FIT_SHARE * max(ranked[0].gain, 0.0) if ranked else 0.0
            chosen += [test for test in ranked if test.gain >= max(bar, HOPELESS)]
        fits = list(pool.map(lambda test: base.with_variants(test.variant, start=test.start), chosen))
    found = {}
    for effect, tests in zip(effects, tested, strict=True):
        total = sum(test.variant.weight for test in tests)
        mine = [(test, fit) for test, fit in zip(chosen, fits, strict=True) if test.variant.effect == effect.name]
        if not mine:
            best_gain = max((test.gain for test in tests), default=-np.inf)
            found[effect.name] = Candidate(effect.name, base.log_evidence + min(best_gain, -1.0), None)
            continue
        # What was not fitted has its share of the prior all the same, so that many hopeless variants dilute.
        logs = [np.log(test.variant.weight / total) + fit.log_evidence for test, fit in mine]
        found[effect.name] = Candidate(effect.name, float(logsumexp(logs)), mine[int(np.argmax(logs))][1])
    return found


def everything() -> tuple[Effect, ...]:
    """The catalogue and the unknown."""
    return (*CATALOGUE.values(), UNKNOWN)
