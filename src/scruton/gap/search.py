"""Which effects act together: one after another, in pairs where the generic term leads, and in place of each other."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from scruton.dynamics import effects as catalogue
from scruton.dynamics.effects import CATALOGUE, Effect, Layout, Variant
from scruton.dynamics.effects.effect import BENDS, Extent
from scruton.gap import thresholds
from scruton.gap.attribute import Candidate, best_of, weigh
from scruton.gap.hypothesis import FittedHypothesis, Hypothesis
from scruton.gap.negligible import added, negligible
from scruton.gap.pairs import best_pair, one_with
from scruton.progress import Progress

Weigh = Callable[..., dict[str, Candidate]]  # a base, the effects in it, and what stands in the place that is judged
Probable = Callable[["Place"], Mapping[str, float]]  # of every name that might stand in a place, and of none
_UNKNOWN = catalogue.UNKNOWN.name
_GAIN, _MEMORY = "sensor_gain_error", "fluid_memory"
_MISSTATED = "structural_damping_error"
_FRICTION, _NONLINEAR, _CLIPPING = "coulomb_friction", "structural_damping_nonlinearity", "sensor_clipping"


@dataclass(frozen=True, eq=False)
class Place:
    """One place in a chain of effects: what would stand there, weighed with the other effects found in the model.

    Attributes
    ----------
    base : FittedHypothesis
        The null model with the other effects.
    candidates : mapping
        Every effect that is not among the others, and the unknown, added to `base`.
    told : mapping
        Gains of those of which further records tell, those read, too: in place of the gain by those in `base`.
    left : bool
        Whether the effects in `base` are all that were found, and leave the generic term too much to be all there is.
    """

    base: FittedHypothesis
    candidates: Mapping[str, Candidate]
    told: Mapping[str, float] = field(default_factory=dict)
    left: bool = False

    @property
    def best(self) -> Candidate:
        """The catalogued effect with the most evidence."""
        return best_of(self.candidates)

    @property
    def gains(self) -> dict[str, float]:
        """Log evidence over that of the base, by name."""
        base = self.base.log_evidence
        return {name: self.told.get(name, one.log_evidence - base) for name, one in self.candidates.items()}


@dataclass(frozen=True, eq=False)
class Chain:
    """Effects that act together, each found with those before it in the model.

    Attributes
    ----------
    null : FittedHypothesis
    found : tuple of Candidate
    candidates : mapping
        What may stand beside them all; nothing where there are as many as there may be.
    """

    null: FittedHypothesis
    found: tuple[Candidate, ...]
    candidates: Mapping[str, Candidate]

    @property
    def end(self) -> FittedHypothesis:
        """The null model with all of them."""
        last = self.found[-1].best if self.found else None
        return last or self.null

    @property
    def evidence(self) -> float:
        """Log evidence of all of them together."""
        return self.end.log_evidence

    @property
    def generic(self) -> float:
        """Log evidence with the generic term beside them; -inf where that is not weighed."""
        return self.candidates[_UNKNOWN].log_evidence if _UNKNOWN in self.candidates else -np.inf

    @property
    def room(self) -> int:
        """How many more may join; what only the frequency shows counts for none."""
        return thresholds.MOST_EFFECTS - sum(not _of_frequency(one.name) for one in self.found)

    def joined_by(self, beside: Weigh, *others: Candidate) -> "Chain":
        """The chain with more effects, each found beside those before it."""
        longer = replace(self, found=(*self.found, *others), candidates={})
        if not longer.room:
            return longer
        return replace(longer, candidates=beside(longer.end, {one.name for one in longer.found}))


def search(
    null: FittedHypothesis,
    singles: Mapping[str, Candidate],
    effects: Sequence[Effect],
    *,
    probable: Probable,
    workers: int,
    progress: Progress,
    over: bool = True,
) -> list[Place]:
    """Places of the effects that act, strongest first; that of the best single effect where no two do.

    Effects join one by one while each gains enough.  Where the generic term still leads, pairs are tried: two effects
    that fit together may each lose to it alone.  Where it gains much beside all of them, its place is the first, and
    they are what may stand beside it, unless nothing left `over` is to be judged.  Then each is judged with the others
    in the model, and what does better in its place takes it.  A further one stays that is `probable` there, by a half
    at least: what mends a form that is off a little foretells nothing.  Where one effect alone is sure to act, the half
    may be shared by several names.
    """
    beside = _beside(null, singles, effects, workers, progress)
    # The generic term knows no frequency: what only the frequency shows joins first, and the rest competes beside it.
    bends = [single for single in singles.values() if _of_frequency(single.name) and single.best is not None]
    bend = max(bends, key=lambda single: single.log_evidence, default=None)
    root = Chain(null, (), singles)
    enough = bend is not None and bend.log_evidence > null.log_evidence + thresholds.SECOND_NATS
    if enough and bend and bend.name not in negligible(bend.best):
        root = root.joined_by(beside, bend)
    alike = partial(_or_alike, effects=effects, workers=workers, beside=beside)
    chain = alike(_joined(root, beside), len(root.found))
    if bend is not None and root.found:
        slack = thresholds.SECOND_SHARE * (bend.log_evidence - null.log_evidence)  # as its form may be off by
        chain = alike(chain, 0, slack=slack)
    at = root if chain.evidence < root.generic else chain
    if at.room > 1 and at.generic > at.evidence + _needed_of_two(at, root):
        progress("pairs of effects", 0.5)
        # Beside what was found any two would mend what is none of it, too, but for two that both damp.
        pair = best_pair(at.end, at.candidates, effects, damping=at is not root, workers=workers)
        if pair and pair[-1].log_evidence > max(chain.evidence, at.generic if at is chain else -np.inf):
            chain = _joined(at.joined_by(beside, *pair), beside)
    explained = chain.evidence - null.log_evidence
    if over and chain.evidence >= root.generic and chain.generic > chain.evidence + left_by(explained):
        found = [Place(null, {one.name: one}) for one in chain.found]
        return [Place(chain.end, chain.candidates, left=True), *found]
    if chain.evidence < root.generic:
        chain = root
        if root.found and root.generic > root.evidence + _needed_beside(root.end, null, root.candidates):
            # The bend is judged beside the unknown, too: of innovations that are not white it may gain by chance.
            if root.generic < singles[_UNKNOWN].log_evidence + thresholds.SECOND_NATS:
                return [Place(null, singles)]
            return [Place(root.end, root.candidates), Place(null, {one.name: one for one in root.found})]
    shared = _stays(Place(null, singles), probable, shared=True)
    together = list(chain.found)
    while len(together) > 1:
        places = _settled(null, together, beside)
        if any(place.base.is_lost for place in places):  # what goes with no other is no name
            break
        gains = [place.best.log_evidence - place.base.log_evidence for place in places]
        # What joined beside a form that another has replaced since may mend nothing any more.
        small = negligible(places[0].best.best)  # all of them are in that model, which is the one that is reported
        # what took the place of a bend of the frequency may be one too many
        crowded = sum(not _of_frequency(place.best.name) for place in places) > thresholds.MOST_EFFECTS
        doubted = [
            i for i, place in enumerate(places)
            if crowded or gains[i] < thresholds.SECOND_NATS
            or (i > 0 and (place.best.name in small or not _stays(place, probable, shared=shared)))
        ]  # fmt: skip
        if not doubted:
            return places
        weakest = min(doubted, key=lambda i: gains[i])
        together = [place.best for i, place in enumerate(places) if i != weakest]
    return [Place(null, singles)]


def beside_unknown(
    null: FittedHypothesis,
    places: Sequence[Place],
    singles: Mapping[str, Candidate],
    effects: Sequence[Effect],
    *,
    probable: Probable,
    workers: int,
    progress: Progress,
) -> list[Place]:
    """Places of the unknown, in that of the first effect found, and of those further effects that hold beside it.

    Each is judged as further effects are, with the unknown and the others in the model, against one more generic term,
    too.  What gains too little there, or is less `probable` than not, leaves: the unknown explains what it was found
    by.
    """
    beside, first = _beside(null, singles, effects, workers, progress), places[0]
    others = [place.best for place in places[1:]]
    while others:
        unknown = first.candidates[_UNKNOWN]
        acting = [unknown] if unknown.log_evidence > first.base.log_evidence else []
        judged, gains = [first], []
        for own in others:
            rest = [*acting, *(one for one in others if one is not own)]
            base = _together(null, rest)
            taken = {one.name for one in rest} - {_UNKNOWN}
            judged.append(place := Place(base, beside(base, taken, own)))
            gains.append(place.gains[own.name])
        doubted = [
            i for i, (own, place) in enumerate(zip(others, judged[1:], strict=True))
            if gains[i] < thresholds.SECOND_NATS or place.best.name != own.name or not _stays(place, probable)
        ]  # fmt: skip
        if not doubted:
            return judged
        others.pop(min(doubted, key=lambda i: gains[i]))
        if others:
            base = _together(null, others)
            first = Place(base, beside(base, {one.name for one in others}, unknown))
    return [Place(null, singles)]


def _stays(place: Place, probable: Probable, *, shared: bool = False) -> bool:
    """Whether the effect in a place, or a `shared` one by whatever name, is more probable than not.

    A structural damping that takes where friction adds mends the form of that friction, unless it is sure.
    """
    probability = probable(place)
    names = [name for name in probability if name in CATALOGUE] if shared else [place.best.name]
    return sum(probability[name] for name in names) >= (thresholds.SETTLED if _opposes(place.best.best) else 0.5)


def _opposes(fit: FittedHypothesis | None) -> bool:
    """Whether the effect that joined last is a structural damping that is negative, beside dry friction."""
    if fit is None:
        return False
    *others, last = fit.hypothesis.variants
    if last.effect != _NONLINEAR or all(other.effect != _FRICTION for other in others):
        return False
    return sum(float(np.sum(fit.value(p.name, len(others))[0])) for p in last.parameters) < 0.0


def _beside(
    null: FittedHypothesis,
    singles: Mapping[str, Candidate],
    effects: Sequence[Effect],
    workers: int,
    progress: Progress,
) -> Weigh:
    """Weighs what stands beside the effects in a base, all that are not among these.

    Beside a saturation, whose readings hide how far the amplitude strays, a memory of some cycles mends its form.
    """
    saturated = singles[_CLIPPING].log_evidence - null.log_evidence if _CLIPPING in singles else 0.0

    def beside(base: FittedHypothesis, taken: Collection[str], own: Candidate | None = None) -> dict[str, Candidate]:
        progress(f"effects beside {' and '.join(sorted(taken)) or _UNKNOWN}", 0.4)
        quick = set(CATALOGUE) - {own.name if own else ""}
        others = [effect for effect in effects if effect.name not in taken and one_with(effect.name).isdisjoint(taken)]
        weighed = weigh(base, others, workers=workers, quick=quick, known=own)
        memory = weighed.get(_MEMORY) if _CLIPPING in taken else None
        if memory and memory.log_evidence < base.log_evidence + thresholds.SECOND_SHARE * saturated:
            del weighed[_MEMORY]
        return weighed

    return beside


def _of_frequency(name: str) -> bool:
    return name in CATALOGUE and CATALOGUE[name].channel == "frequency"


def _needed_beside(base: FittedHypothesis, null: FittedHypothesis, candidates: Mapping[str, Candidate]) -> float:
    """Nats that the generic term must gain beside a bend of the frequency, to be a verdict with it.

    What bends the frequency further mends the form of that bend: below what a form may be off by, it is none.
    """
    needed = thresholds.UNKNOWN_NATS
    if (variant := candidates[_UNKNOWN].variant) is None:
        return needed
    further = bool(np.any(added(variant, base.hypothesis.data.layout)[:, list(BENDS)]))
    return needed + thresholds.SECOND_SHARE * (base.log_evidence - null.log_evidence) * further


def _needed_of_two(chain: Chain, root: Chain) -> float:
    """Nats that the generic term must gain beside what was found, for two effects to be sought there at once."""
    if chain is root:
        return 0.0
    return 2.0 * thresholds.SECOND_NATS + thresholds.SECOND_SHARE * (chain.evidence - root.evidence)


def _or_alike(
    chain: Chain, at: int, *, effects: Sequence[Effect], workers: int, beside: Weigh, slack: float = 0.0
) -> Chain:
    """A chain, or that of its effect number `at` alike in every rig, where it was found of each by its own.

    Effects that differ from rig to rig may be one, read with gains that differ: each by its own leaves a gain nothing
    to show.  The other chain may have less evidence by the `slack`.
    """
    found = chain.found[at].variant if at < len(chain.found) else None
    if found is None or found.scope.extent is not Extent.EACH_RIG:
        return chain
    own = next(effect for effect in effects if effect.name == chain.found[at].name)
    before = replace(chain, found=chain.found[:at])

    def everywhere(layout: Layout) -> list[Variant]:
        return [variant for variant in own.forms(layout) if variant.scope.extent is Extent.EVERYWHERE]

    shared = weigh(before.end, [replace(own, forms=everywhere)], workers=workers, quick=CATALOGUE)[own.name]
    if shared.best is None:
        return chain
    other = _joined(before.joined_by(beside, shared), beside)
    further = max(len(other.found) - len(chain.found), 0)  # each of which has to gain what any does
    return other if other.evidence > chain.evidence + thresholds.SECOND_NATS * further - slack else chain


def _joined(chain: Chain, beside: Weigh) -> Chain:
    """Add catalogued effects one by one while each gains enough."""
    first = 0.0
    while chain.room:
        best, base, rival = best_of(chain.candidates), chain.evidence, chain.generic
        gain = best.log_evidence - base
        # the generic term knows nothing of what the sensor does to the signal: a gain may mend a saturation's form
        mends = np.inf if best.name == _GAIN and any(one.name == _CLIPPING for one in chain.found) else rival - base
        needed = thresholds.SECOND_NATS + _misfit(first, mends) if chain.found else 0.0
        # A second effect has to beat the generic term: it would mend a first that is wrong, too.
        slack = slack_of_further(gain)
        small = chain.found and best.name in negligible(best.best)
        if gain < needed or best.best is None or small or (chain.found and best.log_evidence < rival - slack):
            break
        # What the readings show by themselves, rows of one value where a range ends, has no form that might be off, nor
        # has a constant that is stated wrong: they ask no more of a second effect.
        exact = best.name == _MISSTATED or (best.variant is not None and best.variant.seen > 0.0)
        first = first if exact else max(first, gain)
        chain = chain.joined_by(beside, best)
    return chain


def _misfit(first: float, rival: float) -> float:
    """Nats that the form of a first effect may be off by: a share of its gain, and what the generic term would mend."""
    share = thresholds.SECOND_SHARE * first
    return min(share, max(rival, 0.0)) if np.isfinite(rival) else share


def slack_of_further(gain: float) -> float:
    """Nats by which a further effect that gains so much may stay behind the generic term."""
    return thresholds.FURTHER_NATS + thresholds.FURTHER_SHARE * max(gain, 0.0)


def left_by(gain: float) -> float:
    """Nats that the generic term gains beside effects that explain so much, from which they leave too much to be all.

    Forms that differ from the true ones mostly leave up to 3 % of what they explain, causes of no catalogue a fifth and
    more.
    """
    return thresholds.UNKNOWN_NATS + thresholds.LEFT_SHARE * max(gain, 0.0)


def _settled(null: FittedHypothesis, chain: Sequence[Candidate], beside: Weigh) -> list[Place]:
    """Judge every effect with the others in the model, and let what does better there take its place."""
    # Those on damping come before those that only the frequency shows.
    chain = sorted(chain, key=lambda candidate: _of_frequency(candidate.name))
    places: list[Place] = []
    judged: dict[int, tuple[list[object], Place]] = {}  # beside which forms, of every place
    for _ in range(thresholds.ROUNDS):
        before, places = _forms(chain), []
        for i in reversed(range(len(chain))):
            others = [candidate for k, candidate in enumerate(chain) if k != i]
            forms = _forms(others)
            if i not in judged or judged[i][0] != forms:
                base = _together(null, others)
                judged[i] = forms, Place(base, beside(base, {candidate.name for candidate in others}, chain[i]))
            place = judged[i][1]
            places.insert(0, place)
            if place.best.best is not None:
                chain[i] = place.best
        if _forms(chain) == before:
            break
    return places


def _forms(chain: Sequence[Candidate]) -> list[object]:
    return [candidate.name if candidate.variant is None else candidate.variant.identity for candidate in chain]


def _together(null: FittedHypothesis, effects: Sequence[Candidate]) -> FittedHypothesis:
    """The null model with several effects, fitted from where searches begin and from where each effect was found.

    A force off the response or a jump has one optimum among many: from where its search begins it is not found again.
    """
    acting = [effect for effect in effects if effect.best is not None]
    hypothesis = Hypothesis(null.hypothesis.null, tuple(effect.variant for effect in acting if effect.variant))
    start = hypothesis.start()
    found = start.copy()
    shared = slice(null.mode.size)  # what the null model has comes first
    last = acting[-1].best if acting else None
    start[shared], found[shared] = null.mode, (last or null).mode[shared]
    for i, effect in enumerate(acting):
        for name, values in effect.optimum.items():
            found[hypothesis.slices[i, name]] = values
    return max((hypothesis.fit(point) for point in (start, found)), key=lambda fit: fit.log_evidence)
