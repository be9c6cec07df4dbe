"""The campaign model of the peak tests, under every law of the model card, and the weights of the laws."""

import contextlib
from collections.abc import Collection, Sequence
from dataclasses import astuple, replace

import numpy as np
from scipy.special import chdtrc, logsumexp

from scruton.arrays import FloatArray, end_to_end
from scruton.campaign.schema import Campaign
from scruton.dynamics import Setting, force_parameters
from scruton.infer.hierarchy import CampaignPosterior
from scruton.infer.joint import CAMPAIGN
from scruton.infer.models import NOISE, WIND
from scruton.infer.peak_test import PeakTest
from scruton.infer.results import LawResult, LawWeights, PeakResult, TestResult, Weighing
from scruton.infer.sampling import Asked, ExcludedByPriorsError, Sampling, kept_as
from scruton.infer.thresholds import (
    BEYOND_DOUBT,
    CARRIES,
    COARSENED,
    DEPARTS,
    DISPLACED,
    HOPELESS,
    LAWS_SHARE_ALONE,
    LAWS_SHARE_DOUBTED,
)
from scruton.stats.evidence import evidence_by_importance, log_evidence
from scruton.stats.optimum import Laplace, laplace_log_evidence
from scruton.stats.pareto import smoothed
from scruton.stats.stacking import posterior_weights, stacking_weights
from scruton.stats.student_t import fit_student_t


def weighed_peaks(
    campaign: Campaign, tests: Sequence[TestResult], sampling: Sampling, *, white: bool, thorough: bool
) -> PeakResult:
    """Sample the joint posterior of the peak tests under the laws of the card, and weigh the laws.

    A law that Laplace's approximation puts beyond any doubt is sampled roughly, if at all, and in full once the records
    give it weight.

    Parameters
    ----------
    white : bool
        Whether the innovations are.
    thorough : bool
        Whether to score the records and rigs that are left out, too, where nothing rests on it.
    """
    in_full: set[str] = set()
    before, every = len(sampling.flags), not white
    while True:
        del sampling.flags[before:]  # of a sampling that counts no longer
        result = fit_peaks(campaign, tests, sampling, every=every, in_full=in_full)
        leaves = leading_departure(result) or displaced_damping(result)
        if leaves and not all(result.weights.sampled) and not every:
            every = True
            continue
        # Where the laws are wrong alike these are dozens of evidences, hardly one of them reliable, that decide little.
        if sampling.card.averaging == "stacking" or ((thorough or not white) and not leaves):
            result = stack(result, sampling)
        result = settle(result, sampling, white=white)
        told = dict(zip(result.weights.labels, result.weights.told.tolist(), strict=True))
        carrying = {law.label for law in result.laws if law.roughly and told[law.label] >= CARRIES}
        if not carrying:
            return result
        in_full |= carrying


def fit_peaks(
    campaign: Campaign,
    tests: Sequence[TestResult],
    sampling: Sampling,
    *,
    every: bool = False,
    in_full: Collection[str] = (),
) -> PeakResult:
    """Sample the joint posterior of the peak tests under the laws of the card, and weigh the laws by their evidence.

    A law other than the reference that Laplace's approximation puts beyond doubt is sampled roughly; with several rigs
    one that has no hope has no weight either and is not sampled, unless `every` law is asked for.  One under which no
    point of the prior explains the records never is.

    Parameters
    ----------
    campaign : Campaign
    tests : sequence of TestResult
        The peak tests, one a rig.
    sampling : Sampling
    every : bool
        Whether to sample every law: where none explains the records the evidence between them decides nothing.
    in_full : collection of str
        Laws that are sampled in full whatever Laplace's approximation says.
    """
    card = sampling.card
    posteriors = [campaign_posterior(campaign, tests, sampling, n) for n in card.laws or (None,)]
    labels = tuple("n free" if candidate.exponent else f"n={candidate.n:g}" for candidate in posteriors)
    prior = np.array(card.law_weights or (1.0,))
    several = len(labels) > 1
    asked: list[Asked] = [
        (f"{CAMPAIGN} {label}", one, *data_of(one)) for label, one in zip(labels, posteriors, strict=True)
    ]
    if several:
        sampling.begin(*asked[0])  # beside, while the laws are screened
    log_z, error, unknown = np.full((3, len(labels)), np.nan)
    best = Laplace()
    for i, candidate in enumerate(posteriors if several else ()):
        screening = f"screening, {labels[i]}"
        found = sampling.once(
            screening, laplace_log_evidence, candidate, sampling.generator(screening), best.top - HOPELESS
        )
        best, log_z[i] = max(best, found), found.log_evidence
    sampled = ~(log_z <= log_z.max() - HOPELESS) | (len(tests) == 1) | every
    doubtless = log_z <= log_z.max() - BEYOND_DOUBT
    sampled[0], doubtless[0] = True, False
    roughly = [far and label not in in_full for far, label in zip(doubtless.tolist(), labels, strict=True)]
    for k in np.flatnonzero(sampled)[:0:-1]:
        sampling.begin(*asked[k], roughly=roughly[k])
    laws: dict[int, LawResult] = {}
    for k in np.roll(np.flatnonzero(sampled), -1).tolist():  # the first, which is begun already, comes last
        posterior = posteriors[k]
        try:
            samples = sampling.run(*asked[k], roughly=roughly[k])
        except ExcludedByPriorsError:
            if not laws and k == 0:
                raise
            sampled[k], log_z[k] = False, -np.inf
            continue
        if several:
            # Where walkers hardly moved, which the verdict says, Laplace's approximation has to do.
            with contextlib.suppress(ValueError):
                seed = sampling.seed_of(f"evidence, {labels[k]}")
                what = kept_as(f"evidence, {labels[k]}", roughly[k])
                evidence = sampling.once(what, log_evidence, posterior, samples, seed)
                log_z[k], error[k] = evidence.log_z, evidence.error
        derived = derive(campaign, tests, posterior, samples.chain)
        laws[k] = LawResult(labels[k], posterior, samples, derived, roughly[k])
    weight = posterior_weights(np.where(sampled, log_z / COARSENED, -np.inf), prior) if several else prior
    weights = LawWeights(labels, prior, weight, log_z, error, sampled, unknown)
    return PeakResult(tuple(test.test.name for test in tests), tuple(laws[k] for k in sorted(laws)), weights)


def _leading(result: PeakResult) -> LawResult | None:
    weights = result.weights
    best = weights.labels[int(np.argmax(weights.weight))]
    return next((one for one in result.laws if one.label == best), None)


def leading_departure(result: PeakResult) -> str:
    """A clause where, with 95 % certainty, the drift of one test at least leaves even the law that leads."""
    law = _leading(result)
    if law is None:
        return ""
    winds = [test.wind for test in law.posterior.tests]
    of = [j for j, wind in enumerate(winds) if wind.data.size and "departure_scale" in wind.names]
    scale = law.derived["departure_scale"][..., of]
    if not of or not float(np.quantile(scale.max(axis=-1), 0.05)) > DEPARTS:
        return ""
    median = np.median(scale, axis=(0, 1))
    far = int(np.argmax(median))
    name = law.posterior.tests[of[far]].name
    return (
        f"the drift leaves even {law.label}, by {median[far]:.0%} one e-fold from the stable amplitude of test {name}"
    )


def displaced_damping(result: PeakResult) -> str:
    """A clause where the law that leads can be had only by structural damping that is not what is known of it.

    No record in wind is read for xi_s: it moves by what the law makes of the rate alone.  Under a law that holds the
    squares of its moves, over the standard deviations of what is known, add up to less than those of as many normals.
    """
    law = _leading(result)
    if law is None:
        return ""
    priors = [test.wind.prior("damping_ratio") for test in law.posterior.tests]
    found = np.log(law.derived["damping_ratio"]).mean(axis=(0, 1))
    moved = (found - [prior.location for prior in priors]) / [prior.scale for prior in priors]
    if chdtrc(moved.size, np.sum(np.square(moved))) >= DISPLACED:
        return ""
    far = int(np.argmax(np.abs(moved)))
    return (
        f"{law.label}, which leads, asks for structural damping of {100.0 * np.exp(found[far]):.3g} % in test "
        f"{law.posterior.tests[far].name}, {abs(moved[far]):.1f} standard deviations from what is known of it"
    )


def settle(result: PeakResult, sampling: Sampling, *, white: bool) -> PeakResult:
    """The weights that predictions use: of the evidence, or of stacking where the card or the innovations ask for it.

    Where no law explains what the records hold, the evidence between them decides little, and what laws say of the
    records of one setting does not tell what they say of another.  Then a part of the weight goes by what tells how a
    curve moves with the Scruton number, see `foretold`; evenly, where there is one rig.
    """
    weights = result.weights
    asked = (not white or sampling.card.averaging == "stacking") and len(weights.labels) > 1
    stacked = asked and bool(np.isfinite(weights.stacking).all())
    use = weights.stacking if stacked else weights.weight
    if asked and weights.unscored:
        sampling.flags.append(
            "weights of the laws: no reliable evidence without " + ", ".join(weights.unscored) + "; "
            + ("the others that are left out decide" if stacked else "the laws are weighed by all records together")
        )  # fmt: skip
    alone = len(result.tests) == 1
    rule = Weighing(stacked)
    if weights.sampled.sum() > 1:
        if leaves := leading_departure(result):
            rule = Weighing(stacked, LAWS_SHARE_DOUBTED, not alone, leaves, doubted=True)
        elif moved := displaced_damping(result):
            rule = Weighing(stacked, LAWS_SHARE_DOUBTED, not alone, moved, doubted=True, displaced=True)
        elif not white:
            rule = Weighing(stacked, LAWS_SHARE_DOUBTED, not alone, "innovations are white under none", doubted=True)
        elif alone:
            rule = Weighing(stacked, LAWS_SHARE_ALONE, False, "one setting does not tell what the curve does elsewhere")
    common = np.zeros(len(weights.labels))
    if rule.shared:
        score = np.array([foretold(law) if rule.by_rigs else 0.0 for law in result.laws])
        common[weights.sampled] = rule.shared * posterior_weights(score, np.ones(score.size))
    settled = replace(weights, weight=(1.0 - rule.shared) * use + common, common=common, rule=rule)
    return replace(result, weights=settled)


def foretold(law: LawResult) -> float:
    """Log density of every rig's stable amplitude about the law's curve, given the other rigs, all rigs together.

    Given the curve the amplitude of a rig is normal; the curve without that rig comes from the draws by importance, its
    weights smoothed (Vehtari et al., JMLR 25, 2024).  The shapes of the transients, which a departure from the law can
    mend, have no say.
    """
    total = 0.0
    for density in law.posterior.amplitude_density(end_to_end(law.samples.chain)).T:
        log_weights = -density
        with contextlib.suppress(ValueError):  # a tail without any spread: unsmoothed weights are as good
            log_weights, _ = smoothed(-density)
        total += float(logsumexp(log_weights + density) - logsumexp(log_weights))
    return total


def stack(result: PeakResult, sampling: Sampling) -> PeakResult:
    """Weigh the sampled laws by stacking too: each record, and each rig, scored by its density given all others.

    The density is the ratio of two evidences, with the record and without it, both integrals over all parameters; one
    step ahead a filter would forgive a wrong law.  A record or rig without which the evidence of a law is not known
    reliably scores none of them; where no other is left, or one law was sampled, there are no weights.
    """
    weights = result.weights
    chosen = np.flatnonzero(weights.sampled)
    tests = result.laws[0].posterior.tests
    records = [name for test in tests for name in dict.fromkeys(test.wind.data.record.tolist())]
    rigs = [test.name for test in tests] if len(tests) > 1 else []
    left_out = [*records, *rigs]
    # One law alone is compared with none.
    stacking, unscored = np.full(len(weights.labels), np.nan), []
    if len(chosen) > 1 and left_out:
        scores = np.full((len(chosen), len(left_out)), np.nan)
        for i, law in enumerate(result.laws):
            near = fit_student_t(end_to_end(law.samples.chain))
            for j, name in enumerate(left_out):
                what = f"stacking, {law.label}, without {name}"
                if sampling.report:
                    sampling.report(what, (j + 1) / len(left_out))
                rest = law.posterior.without(name) if j < len(records) else law.posterior.without_test(name)
                # A test that keeps no transient has another coordinate, or none: then the search starts anew.
                start = near if rest.names == law.posterior.names else None
                with contextlib.suppress(ValueError):  # as of one that is not reliable
                    without = evidence_by_importance(rest, sampling.seed_of(what), start)
                    if without.reliable:
                        scores[i, j] = weights.log_evidence[chosen[i]] - without.log_z
        known = np.isfinite(scores).all(axis=0)
        unscored = [name for name, good in zip(left_out, known, strict=True) if not good]
        if known.any():
            stacking = np.zeros(len(weights.labels))
            stacking[chosen] = stacking_weights(scores[:, known])
    return replace(result, weights=replace(weights, stacking=stacking, unscored=tuple(unscored)))


def campaign_posterior(
    campaign: Campaign, tests: Sequence[TestResult], sampling: Sampling, n: float | None
) -> CampaignPosterior:
    """Build the joint posterior of these tests under one law; n is free where it is None."""
    card, motion = sampling.card, campaign.section.motion
    bent = [r for r in tests if r.posterior.data.size and "departure_scale" in r.posterior.names]
    names = ("stable_amplitude", "relaxation_ratio", "discrepancy_amplitude", "discrepancy_relaxation")
    peaks = []
    for result in tests:
        mass, density = result.rig.mass, result.test.air_density
        assert mass is not None, "the loader refuses a test whose rig has no mass"
        # The median of the factor over that of the means, as stated.
        median = mass.median / mass.mean * density.mean / density.median
        factor = float(_setting(campaign, result).mass_damping_factor) * median
        priors = tuple(p for p in result.posterior.priors if p.name in WIND)
        wind = replace(result.posterior, priors=priors, n=n, shares=len(bent) > 1)
        draws = end_to_end(result.samples.chain)
        peaks.append(PeakTest(result.test.name, wind, factor, draws, float(np.hypot(mass.log_sd, density.log_sd))))
    shared = tuple(card.prior(name, motion) for name in names)
    return CampaignPosterior(peaks, shared, -1.0 if n is None else n, card.exponent if n is None else None)


def data_of(posterior: CampaignPosterior) -> list[FloatArray]:
    """All arrays that the likelihood reads, for a checkpoint's fingerprint."""
    arrays = []
    for test in posterior.tests:
        data = test.wind.data
        arrays += [data.amplitude, data.standard_error, data.time]
        arrays.append(np.array([astuple(level) for level in test.wind.steady]))
        arrays.append(np.array([[prior.location, prior.scale] for prior in test.wind.priors]))
        arrays.append(np.array([test.mass_damping_factor, test.factor_log_sd]))
        arrays += test.wind.varying.arrays if test.wind.varying else []
    return arrays


def derive(
    campaign: Campaign, tests: Sequence[TestResult], posterior: CampaignPosterior, chain: FloatArray
) -> dict[str, FloatArray]:
    """Every quantity of the campaign model in its own unit, by the names of the tree's group `campaign_posterior`.

    From sampled coordinates, (chains, draws, d): those of the shared curve are (chains, draws), those of the tests
    (chains, draws, tests).
    """
    shape = chain.shape[:-1]
    u = end_to_end(chain)
    amplitude, relaxation, n = posterior.curve(u)
    s, log = posterior.settings(u), posterior.named(u)
    s |= {name: np.exp(posterior.of_tests(u, name)) for name in NOISE}
    s["relaxation_rate"] = s["relaxation_ratio"] * np.array([test.wind.omega0 for test in posterior.tests])
    forces = np.full((2, *s["a_star"].shape), np.nan)
    if posterior.exponent is None and posterior.n == -1.0:
        for j, result in enumerate(tests):
            setting = _setting(campaign, result, s["mass_damping_factor"][:, j], s["damping_ratio"][:, j])
            forces[:, :, j] = force_parameters(s["a_star"][:, j], s["relaxation_rate"][:, j], setting)
    s["Y1"], s["epsilon"] = forces
    shared = {
        "n": n,
        "reference_amplitude": amplitude,
        "reference_relaxation": relaxation,
        "discrepancy_amplitude": np.exp(log["discrepancy_amplitude"]),
        "discrepancy_relaxation": np.exp(log["discrepancy_relaxation"]),
    }
    by_test = (
        "a_star", "relaxation_rate", "damping_ratio", "scruton_number", "mass_damping_factor", *NOISE,
        "Y1", "epsilon",
    )  # fmt: skip
    curve = {key: value.reshape(shape) for key, value in shared.items()}
    return curve | {key: s[key].reshape(*shape, -1) for key in by_test}


def _setting(
    campaign: Campaign, result: TestResult, factor: FloatArray | None = None, damping: FloatArray | float = 0.0
) -> Setting:
    """Setting of a test, at the mass that a drawn mass-damping factor means."""
    assert result.rig.mass is not None
    section, mass = campaign.section, result.rig.mass.mean
    stated = Setting(
        section.motion, section.width, section.depth, mass, result.test.air_density.mean, result.test.wind_speed.mean,
        result.rig.frequency.mean, result.wind_frequency, damping,
    )  # fmt: skip
    if factor is None:
        return stated
    # m_r and the factor are reciprocal to each other: scaling the mass carries both.
    frequency, wind_speed = (np.resize(result.stated[key], factor.shape) for key in ("frequency", "wind_speed"))
    return replace(
        stated,
        mass=mass * factor / float(stated.mass_damping_factor),
        wind_speed=wind_speed,
        frequency=frequency,
        wind_frequency=result.wind_frequency * frequency / result.stated["frequency"].mean(),
    )
