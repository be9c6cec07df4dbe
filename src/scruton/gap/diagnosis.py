"""The verdict: the null model, one effect, two, or something that is in no catalogue."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from scruton.campaign.schema import Campaign
from scruton.dynamics import effects as catalogue
from scruton.dynamics.effects import CATALOGUE
from scruton.dynamics.effects.terms import Belongs, Term
from scruton.gap import thresholds
from scruton.gap.attribute import Candidate, weigh
from scruton.gap.check import Check, check
from scruton.gap.contradictions import Contradiction, contradictions, creeping, worst_first
from scruton.gap.data import GapData, load_gap
from scruton.gap.held_out import predicts_better
from scruton.gap.hypothesis import FittedHypothesis, Hypothesis
from scruton.gap.lines import SecondLine, detuned_by, second_lines, unexplained_lines
from scruton.gap.null_model import null_model
from scruton.gap.probability import probabilities
from scruton.gap.search import Place, beside_unknown, left_by, search, slack_of_further
from scruton.gap.speeds import DRIFT, SETTING, one_law_holds, weighed_at_other_speeds
from scruton.progress import Progress

NONE, UNKNOWN = "none", catalogue.UNKNOWN.name
PRIOR_NONE = 0.5
_NOISE = ("scatter", "noise", "record_noise", "correlation", "gust_scatter", "gust_time", "set_point_scatter")
# Names of one thing where few records are: a smooth change through two or three tests is nearly any change; a wake that
# lags bends the damping, too.
ALIKE = (
    {DRIFT, SETTING},
    {"fluid_memory", "aerodynamic_damping_nonlinearity"},
)
_STARTS = (0.0, -1.5, 1.2)  # of ln(relaxation rate), about the prior's centre
_GUSTS, _LESS = 0.05, 0.5  # scatter by gusts that a climb starts from; by how much less ln(scatter by turbulence)
_BETTER = 0.1  # nats that it has to gain over the climb that starts without


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
    beside : dict
        Of each effect found but the first, by name: probability of it, and of what else might stand in its place, with
        the others in the model.
    places : dict
        The place that each of them was judged in.
    at_other_speeds : dict
        Log evidence over none of a drift with the reduced velocity and of settings that differ, in place of the first
        effect found, tests at other speeds of the rigs read, too; empty where there are none.
    base : FittedHypothesis or None
        With the further effects alone, which the first one stands beside; None is the null model.
    contradictions : tuple of Contradiction
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
    beside: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    places: Mapping[str, Place] = field(default_factory=dict)
    at_other_speeds: Mapping[str, float] = field(default_factory=dict)
    base: FittedHypothesis | None = None
    contradictions: tuple[Contradiction, ...] = ()

    @property
    def verdict(self) -> str:
        """Name of the strongest effect, `none` or `unknown`."""
        return self.found[0] if self.found else NONE

    @property
    def also(self) -> dict[str, float]:
        """Probability of each effect found but the first, by name."""
        return {name: probability[name] for name, probability in self.beside.items()}


def fit_null(data: GapData) -> tuple[GapData, FittedHypothesis]:
    """Fit the null model, refer sizes to its stable amplitude and relaxation rate, and fit it again."""
    null, starts = Hypothesis(null_model(data)), []
    # The best of several climbs: one start alone may end where turbulence explains what the wind does.
    for shift in _STARTS:
        starts.append(null.start())
        if (where := null.slices.get((None, "relaxation_rate"))) is not None:
            starts[-1][where] += shift
    fit = max((null.fit(start) for start in starts), key=lambda fit: fit.log_evidence)
    damping = data.layout.omega * data.nominal_damping
    amplitude, rate = data.layout.reference_amplitude, float(np.median(damping))
    if data.middle >= 0:
        stable, rate = (float(np.exp(fit.value(name)[0][0])) for name in ("stable_amplitude", "relaxation_rate"))
        amplitude = stable if stable >= thresholds.DIES_OUT * amplitude else amplitude
    data = data.referred_to(amplitude, rate)
    fit = Hypothesis(null_model(data)).fit(fit.mode)
    gusty = _in_gusts(fit)
    return data, gusty if gusty.log_evidence > fit.log_evidence + _BETTER else fit


def _null_of_one_law(data: GapData) -> tuple[GapData, FittedHypothesis]:
    """The null model of the peak tests; of a single rig's at other speeds, too, where one law holds for all of them."""
    if (every := data.at_other_speeds) is None or not data.of_one_rig:
        return fit_null(data)
    every, alike = fit_null(every)
    if one_law_holds(alike, set(every.first_in_wind) - set(data.first_in_wind)):
        return every, alike
    return fit_null(replace(data, at_other_speeds=None))


def _in_gusts(fit: FittedHypothesis) -> FittedHypothesis:
    """The null model climbed from large gusts: what they do turbulence does, too, a hundred nats worse at times.

    An effect whose fit finds them, where the null model has not, would gain what is theirs.
    """
    slices, start = fit.hypothesis.slices, fit.mode.copy()
    if (gusts := slices.get((None, "gust_scatter"))) is None:
        return fit
    start[gusts] = np.log(_GUSTS)
    scatter = slices[None, "scatter"].start  # of the tests first, then of still air
    start[scatter : scatter + gusts.stop - gusts.start] -= _LESS
    return fit.hypothesis.fit(start)


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
    prior = prior or {}
    tell = progress or (lambda _what, _done: None)
    tell("null model", 0.0)
    data, null = _null_of_one_law(data)
    lines = second_lines(campaign, data.cycles, data.modes)
    lasting, against = [line for line in lines if not line.dies], contradictions(data)
    tell("single effects", 0.1)
    everything = (*CATALOGUE.values(), catalogue.UNKNOWN)
    effects = tuple(effect for effect in everything if prior.get(effect.name, 1.0) > 0.0)
    singles = weigh(null, effects, workers=workers)
    tell("effects together", 0.3)

    def probable(place: Place) -> dict[str, float]:
        return _in_its_place(place, prior, prior_none)

    find = partial(search, null, singles, effects, probable=probable, workers=workers, progress=tell)
    readings = [find(), [Place(null, singles)]]
    tell("absolute check", 0.8)
    checks = {NONE: check(null)}
    # What stands beside an effect that is none after all is a verdict of its own.
    for places in readings:
        places = [replace(one, told=weighed_at_other_speeds(one, effects, workers=workers)) for one in places]
        gains, probability, top = _judged(null, places, lasting, against, checks, prior, prior_none, workers)
        reported = places
        if top == UNKNOWN and len(places) > 1:
            reported = beside_unknown(null, places, singles, effects, probable=probable, workers=workers, progress=tell)
            if len(reported) < len(places):  # what is weighed is what is reported
                alone = {UNKNOWN: reported[0].candidates[UNKNOWN]}
                fewer = [replace(places[0], candidates={**places[0].candidates, **alone}), *places[1:]]
                judged = _judged(null, fewer, lasting, against, checks, prior, prior_none, workers)
                if judged[-1] != UNKNOWN and places[0].left:  # it leads beside them alone, and they do not hold there
                    readings.insert(1, find(over=False))
                    continue
                places, (gains, probability, top) = fewer, judged
        if top != NONE or len(places) == 1:
            break
    if top == NONE and len(lasting) < len(lines):  # nothing else is wrong: the other mode is what the model lacks
        gains, probability, top = _judged(null, places, lines, against, checks, prior, prior_none, workers)
        reported = places
    first, *others = reported if top == UNKNOWN else places if top != NONE else [Place(null, singles)]
    final = first.candidates[top].best if top != NONE else null
    if final is None or (top == UNKNOWN and _says_nothing(first, gains[UNKNOWN])):
        final = first.base
    further = {place.best.name: place for place in others if place.best.name != top}
    checks.setdefault(top, check(final))
    # Beside what leaves a phase that can be foretold, no further name is sure either: it mends the form of the first.
    doubted = top != NONE and _refuted(checks[top], top, data)
    beside = {name: _in_its_place(place, prior, prior_none, doubted=doubted) for name, place in further.items()}
    attributed = () if top == NONE else (top, *beside)
    tell("done", 1.0)
    return Diagnosis(
        data,
        null,
        attributed,
        final,
        singles,
        places[0].candidates,
        gains,
        probability,
        _groups(gains, top),
        checks,
        lines,
        beside,
        further,
        places[0].told,
        first.base,
        worst_first([*against, *_creeping_beside(final, top)]),
    )


def diagnose(campaign: Campaign, **options: object) -> Diagnosis:
    """Load and diagnose; see `diagnose_data` for the options."""
    data = load_gap(campaign)
    return diagnose_data(data, data.campaign, **options)  # type: ignore[arg-type]


def _in_its_place(
    place: Place, prior: Mapping[str, float], prior_none: float, *, doubted: bool = False
) -> dict[str, float]:
    """Probabilities of what might stand in the place of a further effect, the others found in the model."""
    weights = place.gains | {NONE: 0.0}
    if UNKNOWN in weights:  # it is judged by the rule that it joined by
        own = weights[place.best.name]
        weights[UNKNOWN] -= slack_of_further(own)
        if doubted:
            weights[UNKNOWN] = max(weights[UNKNOWN], own - thresholds.UNEARNED_NATS)
    return probabilities(weights, prior, prior_none)


def _refuted(mark: Check, name: str, data: GapData) -> bool:
    """Whether a model leaves records in wind that vary more in one part than in another, or a phase to be foretold.

    A wind that drifts moves the frequency, too.
    """
    foretold = mark.phase < thresholds.FORETOLD and not _of_the_run(name)
    return bool(data.layout.wind.any()) and (mark.spread < thresholds.SPREADS or foretold)


def _of_the_run(name: str) -> bool:
    return name in CATALOGUE and CATALOGUE[name].belongs is Belongs.RUN


def _creeping_beside(fit: FittedHypothesis, name: str) -> list[Contradiction]:
    """Frequencies that creep beside what is named: a wind that drifts moves them."""
    return [] if _of_the_run(name) else creeping(fit)


def _judged(
    null: FittedHypothesis,
    places: Sequence[Place],
    lines: Sequence[SecondLine],
    against: Sequence[Contradiction],
    checks: dict[str, Check],
    prior: Mapping[str, float],
    prior_none: float,
    workers: int,
) -> tuple[dict[str, float], dict[str, float], str]:
    """Log weights and probabilities in the first place, and what leads; the check of the best there joins `checks`."""
    base, rivals, gains = places[0].base, places[0].candidates, places[0].gains
    best = rivals[max((name for name in gains if name in CATALOGUE), key=lambda name: gains[name])]
    leader = best.best if best.best and gains[best.name] > 0.0 else base
    checks[best.name if leader is not base else NONE] = mark = check(leader)
    # Forms differ a little: what is left is measured by what was explained, at the noise that is left.
    own = max(gains[best.name], 0.0)
    explained = max(own, _explained(null, leader)) if leader is not base else 0.0
    names = tuple(place.best.name for place in places if place.best.log_evidence > place.base.log_evidence)
    unexplained = unexplained_lines(lines, names, null.hypothesis.data)
    torn = sum(one.nats - thresholds.LINE_NATS for one in against) if against else -np.inf
    against = [*against, *_creeping_beside(leader, best.name if leader is not base else NONE)]
    seen = [*(one.ratio for one in unexplained), *(one.nats for one in against)]
    line = sum(seen) - thresholds.LINE_NATS * len(seen)
    allowed = thresholds.ALLOWED_EXCESS + thresholds.ALLOWED_SHARE * explained
    # What strikes has no form that might be off, which a model mends by being wide there; nor have clocks any.
    struck = max(mark.knocks - thresholds.ALLOWED_SHARE * own, torn) - thresholds.ALLOWED_EXCESS
    left = max(max(mark.excess, line) - allowed, struck)
    if UNKNOWN in gains:  # a card may leave it out
        gains[UNKNOWN] = max(_preferred(gains)[UNKNOWN], own + left)
        # Neither the catalogue nor the generic terms have a line beside the response, a clock, or what strikes: their
        # evidence has no say there. Nor has what explains less than it leaves.
        ahead = gains[UNKNOWN] > own and left <= own and line < allowed and struck <= 0.0
        # What gains so little that its lead over the unknown would be no preference holds nothing back.
        rival = leader is not base and gains[best.name] > thresholds.HOLDS_BACK_NATS
        if ahead and rival and not _earned(leader, best, rivals[UNKNOWN], gains[best.name], workers):
            gains[UNKNOWN] = gains[best.name] - thresholds.UNEARNED_NATS
        if rival and _refuted(mark, best.name, null.hypothesis.data):  # then it is not sure
            gains[UNKNOWN] = max(gains[UNKNOWN], gains[best.name] - thresholds.UNEARNED_NATS)
        # What beats with the response in still air, too, is no shedding, however well its equation follows.
        if rival and CATALOGUE[best.name].channel == "spectrum" and _beats_in_still_air(unexplained, leader):
            gains[UNKNOWN] = max(gains[UNKNOWN], gains[best.name] + thresholds.LINE_NATS)
    gains[NONE] = 0.0
    probability = probabilities(gains, prior, prior_none)
    return gains, probability, max(probability, key=lambda name: probability[name])


def _preferred(gains: Mapping[str, float]) -> dict[str, float]:
    """The same gains, the unknown's less what it must lead a catalogued effect by: against none it stands as it is."""
    found = dict(gains)
    if UNKNOWN in found:
        lead = thresholds.PREFERENCE_SHARE * max(found[UNKNOWN], 0.0)
        best = max((gain for name, gain in gains.items() if name in CATALOGUE), default=0.0)
        found[UNKNOWN] -= min(lead, max(best, 0.0))
    return found


def _says_nothing(place: Place, weight: float) -> bool:
    """Whether the generic term gains nothing, or so little that the unknown has its weight from a line, or a clock.

    Then what it would put into the model is no part of the cause.
    """
    gain = place.candidates[UNKNOWN].log_evidence - place.base.log_evidence
    return gain <= 0.0 or gain < min(thresholds.UNKNOWN_NATS, weight)


def _earned(leader: FittedHypothesis, best: Candidate, unknown: Candidate, gain: float, workers: int) -> bool:
    """Whether the unknown may lead: with more evidence than the catalogue, and no worse on records held out.

    An effect beside which the generic terms gain much leaves too much to be all, however it predicts.
    """
    if best.log_evidence >= unknown.log_evidence:
        return False
    if unknown.best is None or not predicts_better(leader, unknown.best, workers=workers):
        return True
    further = weigh(leader, [catalogue.UNKNOWN], workers=workers)[UNKNOWN]
    return further.log_evidence > leader.log_evidence + left_by(gain)


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


def _beats_in_still_air(unexplained: Sequence[SecondLine], forced: FittedHypothesis) -> bool:
    """Whether a line stands in still air where a force off the response is found in the wind."""
    data, rates = forced.hypothesis.data, forced.table[:, Term.FORCE_RATE]
    detuning = (rates / data.layout.omega)[rates != 0.0]
    return any(bool(np.any(np.abs(detuning - detuned_by(line, data)) < thresholds.SAME_LINE)) for line in unexplained)


def _groups(gains: Mapping[str, float], verdict: str) -> tuple[tuple[str, ...], ...]:
    if verdict in (NONE, UNKNOWN):
        return ()
    within = dict.fromkeys(gains, thresholds.GROUP_NATS)
    for twins in ALIKE:
        within |= dict.fromkeys(twins, thresholds.ALIKE_NATS) if verdict in twins else {}
    close = [name for name, gain in gains.items() if name in CATALOGUE and gain > gains[verdict] - within[name]]
    return (tuple(sorted(close, key=lambda name: -gains[name])),)
