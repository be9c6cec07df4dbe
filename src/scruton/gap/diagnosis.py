"""The verdict: the null model, one effect, two, or something that is in no catalogue."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scruton.campaign.schema import Campaign
from scruton.dynamics import effects as catalogue
from scruton.dynamics.effects import CATALOGUE, Effect
from scruton.gap import thresholds
from scruton.gap.attribute import Candidate, weigh
from scruton.gap.check import Check, SecondLine, check, second_lines
from scruton.gap.data import GapData, load_gap
from scruton.gap.hypothesis import FittedHypothesis, Hypothesis
from scruton.gap.null_model import null_model
from scruton.gap.probability import probabilities
from scruton.progress import Progress

NONE, UNKNOWN = "none", catalogue.UNKNOWN.name
PRIOR_NONE = 0.5
_NOISE = ("scatter", "noise", "gust_scatter", "gust_time", "set_point_scatter")
_STARTS = (0.0, -1.5, 1.2)  # of ln(aerodynamic rate), about the prior's centre


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What was found in a campaign.

    Attributes
    ----------
    data : GapData
    null : FittedHypothesis
        Of the null model.
    found : tuple of str
        Effects, strongest first; empty for none; ("unknown",) for what is in no catalogue.
    final : FittedHypothesis
        Of the hypothesis with the effects found (the best generic term for the unknown; the null model for none).
    singles : dict
        Every effect added to the null model alone, and the unknown.
    rivals : dict
        Every effect in place of the first one found, beside the others found.
    log_weights : dict
        Log evidence gain of `none`, every effect and `unknown`, after the absolute check, the others found given.
    probability : dict
    groups : tuple of tuple of str
        Effects that these data cannot tell apart, the verdict's first.
    checks : dict
        Absolute checks: of the null model ("none") and of the verdict's hypothesis.
    lines : tuple of SecondLine
    """

    data: GapData
    null: FittedHypothesis
    found: tuple[str, ...]
    final: FittedHypothesis
    singles: Mapping[str, Candidate]
    rivals: Mapping[str, Candidate]
    log_weights: Mapping[str, float]
    probability: Mapping[str, float]
    groups: tuple[tuple[str, ...], ...]
    checks: Mapping[str, Check]
    lines: tuple[SecondLine, ...]

    @property
    def verdict(self) -> str:
        """Name of the strongest effect, `none` or `unknown`."""
        return self.found[0] if self.found else NONE


def fit_null(data: GapData) -> tuple[GapData, FittedHypothesis]:
    """Fit the null model, refer sizes to its stable amplitude and relaxation rate, and fit it again."""
    null, starts = Hypothesis(null_model(data)), []
    # The best of several climbs: one start alone may end where turbulence explains what the wind does.
    for shift in _STARTS:
        starts.append(null.start())
        if (where := null.slices.get((None, "aerodynamic_rate"))) is not None:
            starts[-1][where] += shift
    fit = max((null.fit(start) for start in starts), key=lambda fit: fit.log_evidence)
    damping = data.layout.omega * data.nominal_damping
    amplitude, rate = data.layout.reference_amplitude, float(np.median(damping))
    if data.middle >= 0:
        amplitude, aero = (float(np.exp(fit.value(name)[0][0])) for name in ("stable_amplitude", "aerodynamic_rate"))
        rate = aero + damping[data.middle]
    data = data.referred_to(amplitude, rate)
    return data, Hypothesis(null_model(data)).fit(fit.mode)


def diagnose_data(
    data: GapData,
    campaign: Campaign,
    *,
    prior: Mapping[str, float] | None = None,
    prior_none: float = PRIOR_NONE,
    workers: int = 2,
    progress: Progress | None = None,
) -> Diagnosis:
    """Weigh the catalogue against the null model.

    Parameters
    ----------
    data : GapData
    campaign : Campaign
    prior : mapping, optional
        Relative prior weight of the effects and of `unknown`; 1 for those that are not named, 0 leaves one out.
    prior_none : float
        Prior probability of no gap.
    workers : int
        Threads.
    progress : callable, optional
        Told what is being done and the fraction done.
    """
    tell = progress or (lambda _what, _done: None)
    tell("null model", 0.0)
    data, null = fit_null(data)
    lines = second_lines(campaign, data.cycles)
    tell("single effects", 0.1)
    everything = (*CATALOGUE.values(), catalogue.UNKNOWN)
    effects = tuple(effect for effect in everything if (prior or {}).get(effect.name, 1.0) > 0.0)
    singles = weigh(null, effects, workers=workers)
    chain, base = _forward(null, singles, effects, workers, tell)
    generic = singles[UNKNOWN].log_evidence if UNKNOWN in singles else -np.inf
    if len(chain) > 1 and base.log_evidence < generic + thresholds.CHAIN_NATS * (len(chain) - 1):
        chain = chain[:1]
    tell("absolute check", 0.8)
    checks = {NONE: check(null)}
    base, rivals = null, dict(singles)
    if len(chain) > 1:
        # The strongest effect is judged with the others in place; those on damping come before those that only the
        # frequency shows.
        chain.sort(key=lambda candidate: CATALOGUE[candidate.name].channel == "frequency")
        beside = Hypothesis(null.hypothesis.null, tuple(c.variant for c in chain[1:] if c.variant))
        start = beside.start()
        start[: null.mode.size] = null.mode
        base = beside.fit(start)
        rivals = weigh(base, [e for e in effects if e.name not in {c.name for c in chain[1:]}], workers=workers)
    gains = {name: c.log_evidence - base.log_evidence for name, c in rivals.items()}
    names = tuple(c.name for c in chain)
    best = max((name for name in gains if name in CATALOGUE), key=lambda name: gains[name])
    leader = rivals[best].best if rivals[best].best and gains[best] > 0.0 else base
    assert leader is not None
    checks[best if leader is not base else NONE] = mark = check(leader)
    # Forms differ a little: what is left is measured by what was explained, at the noise that is left.
    explained = max(gains[best], 0.0, _explained(null, leader)) if leader is not base else 0.0
    left = _left_over(mark, lines, names, data) - thresholds.ALLOWED_SHARE * explained
    if UNKNOWN in gains:  # a card may leave it out
        gains[UNKNOWN] -= thresholds.PREFERENCE_NATS + thresholds.PREFERENCE_SHARE * max(gains[UNKNOWN], 0.0)
        gains[UNKNOWN] = max(gains[UNKNOWN], max(gains[best], 0.0) + left)
    gains[NONE] = 0.0
    probability = probabilities(gains, prior or {}, prior_none)
    top = max(probability, key=lambda name: probability[name])
    attributed: tuple[str, ...] = ()
    final = null
    if top == UNKNOWN:
        attributed, final = (top,), singles[top].best or null
    elif top != NONE:
        others = names if len(names) > 1 else ()
        attributed, final = (top, *(name for name in others if name != top)), rivals[top].best or null
    checks.setdefault(top, check(final))
    tell("done", 1.0)
    groups = _groups(gains, top)
    return Diagnosis(data, null, attributed, final, singles, rivals, gains, probability, groups, checks, lines)


def diagnose(campaign: Campaign, **options: object) -> Diagnosis:
    """Load and diagnose; see `diagnose_data` for the options."""
    return diagnose_data(load_gap(campaign), campaign, **options)  # type: ignore[arg-type]


def _forward(
    null: FittedHypothesis, singles: Mapping[str, Candidate], effects: Sequence[Effect], workers: int, tell: Progress
) -> tuple[list[Candidate], FittedHypothesis]:
    """Add catalogued effects one by one while each gains enough; the hypothesis with all of them comes with them."""
    chain: list[Candidate] = []
    base, candidates, first = null, singles, 0.0
    for step in range(thresholds.MOST_EFFECTS):
        taken = {candidate.name for candidate in chain}
        named = [candidate for name, candidate in candidates.items() if name in CATALOGUE and name not in taken]
        best = max(named, key=lambda candidate: candidate.log_evidence)
        gain = best.log_evidence - base.log_evidence
        needed = thresholds.SECOND_NATS + thresholds.SECOND_SHARE * first if chain else 0.0
        rival = candidates[UNKNOWN].log_evidence if UNKNOWN in candidates else -np.inf
        # A second effect has to beat the generic term: it would mend a first that is wrong, too.
        slack = thresholds.PREFERENCE_NATS + thresholds.FURTHER_SHARE * max(gain, 0.0)
        negligible = chain and best.best is not None and _largest_size(best.best) < thresholds.SMALLEST
        if gain < needed or best.best is None or negligible or (chain and best.log_evidence < rival - slack):
            break
        chain.append(best)
        base, first = best.best, max(first, gain)
        if step + 1 < thresholds.MOST_EFFECTS and gain > 0.0:
            tell(f"effects beside {best.name}", 0.3 + 0.2 * step)
            others = [effect for effect in effects if effect.name not in {*taken, best.name}]
            candidates = weigh(base, others, workers=workers)
    return chain, base


def _largest_size(fit: FittedHypothesis) -> float:
    """Largest size of the variant that was added last; infinite where it has none (a lag, a level)."""
    last = len(fit.hypothesis.variants) - 1
    variant = fit.hypothesis.variants[last]
    sizes = [p.name for p in variant.parameters if not p.log and p.name != variant.scan]
    return max((float(np.abs(fit.value(name, last)[0]).max()) for name in sizes), default=np.inf)


def _explained(base: FittedHypothesis, leader: FittedHypothesis) -> float:
    """Nats of misfit of the amplitudes that the leader takes away, both hypotheses at its noise."""
    u = base.mode.copy()
    for name in _NOISE:
        where = base.hypothesis.slices.get((None, name), slice(0))  # gusts are in wind alone
        u[where] = leader.mode[where]
    chi = []
    for hypothesis, at in ((base.hypothesis, u), (leader.hypothesis, leader.mode)):
        v, s = (x[0, : hypothesis.data.channels.size] for x in hypothesis.innovations(at[None]))
        chi.append(float(np.sum(v**2 / s)))
    return 0.5 * (chi[0] - chi[1])


def _left_over(mark: Check, lines: Sequence[SecondLine], names: Sequence[str], data: GapData) -> float:
    """Nats of misfit that no hypothesis of the catalogue has taken up."""
    excess = mark.excess - thresholds.ALLOWED_EXCESS
    still = {name for name, wind in zip(data.layout.records, data.layout.wind, strict=True) if not wind}
    # Of a force off the response such lines are the signature.
    forced = any(CATALOGUE[name].channel == "spectrum" for name in names)
    counted = [line.ratio for line in lines if not forced or line.record in still]
    line = sum(max(0.0, ratio - thresholds.LINE_NATS) for ratio in counted)
    return max(excess, line - thresholds.ALLOWED_EXCESS if line > 0.0 else -thresholds.ALLOWED_EXCESS)


def _groups(gains: Mapping[str, float], verdict: str) -> tuple[tuple[str, ...], ...]:
    if verdict in (NONE, UNKNOWN):
        return ()
    close = [
        name for name, gain in gains.items() if name in CATALOGUE and gain > gains[verdict] - thresholds.GROUP_NATS
    ]
    return (tuple(sorted(close, key=lambda name: -gains[name])),)
