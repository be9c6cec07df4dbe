"""Which effect: the evidence of every catalogued effect against none and against the unknown."""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from scruton.arrays import FloatArray
from scruton.dynamics.effects import CATALOGUE, UNKNOWN, Effect
from scruton.dynamics.effects.terms import Variant
from scruton.gap.hypothesis import Weighed
from scruton.gap.screen import Promise, Screen

_FITS = 4  # variants of an effect that are fitted, at most
_REACH = 6.0  # nats behind the best promise of its effect at which a variant is still fitted,
_HOPELESS = -1.0  # nats: promises below are taken at their word
_TRUST = 0.4  # and this part of that promise, for promises are made to second order


@dataclass(frozen=True, eq=False)
class Candidate:
    """One effect, weighed.

    Attributes
    ----------
    name : str
    log_evidence : float
        Averaged over its variants by their prior weights; -inf where none can act.
    best : Weighed or None
        Of the variant with the highest evidence.
    """

    name: str
    log_evidence: float
    best: Weighed | None

    @property
    def variant(self) -> Variant | None:
        """The best variant."""
        return self.best.hypothesis.variants[-1] if self.best else None


def promises(screen: Screen, effect: Effect) -> list[Promise]:
    """Screen every variant of an effect."""
    found = []
    for variant in effect.variants(screen.data.layout):
        names = [p.name for p in variant.parameters]
        if variant.scan:
            found.append(screen.scan(variant))
        elif len(names) == 1 and variant.parameters[0].log:
            one = variant.parameters[0]
            grid = sorted({*one.starts, *(one.location + one.scale * x for x in (-2.0, -1.2, -0.5, 0.0, 0.5, 1.2))})
            found.append(screen.direct(variant, grid))
        elif any(p.log or p.starts[0] for p in variant.parameters):
            found.append(_conditional(screen, variant))
        else:
            found.append(screen.linear(variant))
    return found


def _conditional(screen: Screen, variant: Variant) -> Promise:
    """Variants whose further parameters shape the first: screened by the first with the others at their starts."""
    size = variant.parameters[0]
    layout = screen.data.layout

    def apply(table: FloatArray, values: Mapping[str, FloatArray], where: object) -> None:
        fixed = {
            p.name: np.where(p.members >= 0, np.exp(p.starts[0]) if p.log else p.starts[0], 0.0)[None]
            * np.ones((len(table), 1))
            for p in variant.parameters[1:]
        }
        variant.apply(table, {**values, **fixed}, layout)
        del where

    single = Variant(variant.label, (size,), apply, variant.scope, variant.weight)
    promise = screen.linear(single)
    return Promise(variant, promise.gain, {p.name: np.full(p.size, p.starts[0]) for p in variant.parameters})


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

    def one(promise: Promise) -> Weighed:
        hypothesis = base.hypothesis.extended(promise.variant)
        return hypothesis.fit(hypothesis.start_from(base.mode, promise.start))

    with ThreadPoolExecutor(workers) as pool:
        screened = dict(zip([e.name for e in effects], pool.map(lambda e: promises(screen, e), effects), strict=True))
        chosen: list[tuple[str, Promise]] = []
        for name, all_of in screened.items():
            ranked = sorted(all_of, key=lambda p: -p.gain - np.log(p.variant.weight))[:_FITS]
            bar = ranked[0].gain - _REACH - _TRUST * max(ranked[0].gain, 0.0) if ranked else 0.0
            chosen += [(name, p) for p in ranked if p.gain >= max(bar, _HOPELESS)]
        fitted = list(pool.map(lambda pair: one(pair[1]), chosen))
    found = {}
    for effect in effects:
        total = sum(p.variant.weight for p in screened[effect.name])
        mine = [(p, e) for (name, p), e in zip(chosen, fitted, strict=True) if name == effect.name]
        if not mine:
            best_promise = max((p.gain for p in screened[effect.name]), default=-np.inf)
            found[effect.name] = Candidate(effect.name, base.log_evidence + min(best_promise, -1.0), None)
            continue
        logs = [np.log(p.variant.weight / total) + e.log_evidence for p, e in mine]
        # What was not fitted counts with its promise, so that many hopeless variants still dilute.
        best = mine[int(np.argmax(logs))][1]
        found[effect.name] = Candidate(effect.name, float(logsumexp(logs)), best)
    return found


def everything() -> tuple[Effect, ...]:
    """The catalogue and the unknown."""
    return (*CATALOGUE.values(), UNKNOWN)
