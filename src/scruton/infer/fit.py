"""From a campaign to its posteriors: envelopes, ring-downs, tests in wind, trial functions.

Every posterior is sampled on its own, with a seed of its own that depends on the run's seed and on its name alone,
so that leaving one test out changes no number of another.
"""

from collections.abc import Mapping, Sequence
from dataclasses import astuple, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from scruton.arrays import FloatArray
from scruton.campaign import peak_tests
from scruton.campaign.remarks import Severity, sentences
from scruton.campaign.schema import Campaign, Kind, Record, Rig, Test
from scruton.dynamics.cycles import EnvelopeData
from scruton.envelope import Cycles, RingDown, review, usable, weigh
from scruton.envelope.consistency import check_units
from scruton.errors import InputError
from scruton.infer.cards import ModelCard
from scruton.infer.damping import (
    damping_prior,
    draws_over_amplitudes,
    ends,
    stated_damping,
    varying_damping,
    varying_of,
)
from scruton.infer.derived import derive
from scruton.infer.flagged import departing, lock_in_not_used, set_apart, unconstrained
from scruton.infer.front import damping_varies, front_ends_of, ringdowns_of
from scruton.infer.joint import (
    RIG,
    SCALES,
    TEST,
    joint_draws,
    left_at_prior,
    reference_remark,
    scales_remark,
    unconverged,
)
from scruton.infer.models import WIND, SteadyAmplitude, StillAirPosterior, TrialPosterior, WindPosterior
from scruton.infer.off_curve import off_curve
from scruton.infer.peaks import weighed_peaks
from scruton.infer.results import TRIAL, Fit, RigResult, Sampled, TestResult, TrialResult
from scruton.infer.sampling import Known, Sampling, fewer_walkers
from scruton.infer.speeds import NAME as SPEEDS
from scruton.infer.speeds import fit_speeds
from scruton.infer.stated import off_stated
from scruton.infer.steady import SteadyVerdict, judge_steady, judge_swings, steady_posterior
from scruton.infer.store import convergence_frame
from scruton.infer.thresholds import NOT_WHITE, STEADY_FLOOR
from scruton.infer.tree import build_tree, convergence_group, provenance_of_fit, summarise
from scruton.progress import Progress
from scruton.stats import whiteness
from scruton.stats.priors import Prior, check_support
from scruton.stats.ranks import effective_draws_of_mean

type AskedTrial = tuple[str, TrialPosterior, *tuple[FloatArray, ...]]  # see `scruton.infer.sampling.Asked`

TRANSIENTS = (Kind.GROWTH, Kind.DECAY)
LOCK_IN = "lock-in of"  # how the posterior of one lock-in record is named, before the record
# What is sampled of a trial function, and the priors of the card that it has.
TRIAL_PRIORS = {"b": "trial_slow_rate", "rate_gap": "trial_rate_gap"}
TRIAL_PRIORS |= {name: name for name in ("trial_residual", "trial_residual_rate", "noise_factor")}


def fit_campaign(
    campaign: Campaign,
    card: ModelCard,
    *,
    seed: int = 0,
    checkpoints: Path | None = None,
    report: Progress | None = None,
    known: Known | None = None,
    asked: Mapping[str, Any] = {},
    thorough: bool = True,
) -> Fit:
    """Sample every posterior of a campaign.

    Parameters
    ----------
    campaign : Campaign
        Restricted beforehand to the tests that shall be used.
    card : ModelCard
    seed : int
        The one source of randomness.
    checkpoints : path, optional
        Folder for checkpoints, to be removed by the caller once the results are written.
    report : callable, optional
        Told the name of the posterior being sampled and the fraction done.
    known : dict, optional
        What earlier fits drew, so that it is not drawn again; what is drawn here is added.
    asked : mapping
        For the provenance: the `command`, and the `tests` that the campaign was restricted to.
    thorough : bool
        False leaves out all that predictions of stable amplitudes do not need (trial functions, free runs, stacking,
        other wind speeds), for studies that fit many campaigns.

    Raises
    ------
    InputError
        If the campaign holds nothing to fit, or no record that can be used.
    """
    sampling = Sampling(card, seed, checkpoints, report, Known() if known is None else known)
    campaign, cycles = usable(campaign, card.envelope_source)
    if not cycles:
        wanted = "at least one [[rigs.records]] or [[tests.records]]"
        raise InputError(campaign.path, "", "no record in any rig or test", wanted)
    ringdowns = dict(ringdowns_of(campaign, cycles))
    inspection = weigh(campaign, cycles, ringdowns, card.damping_relative_sd)
    check_units(inspection)
    transients = [one for test in campaign.tests for one in test.records if one.kind in TRANSIENTS] if thorough else []
    of_trials = {record.name: trial_of(campaign, record, cycles[record.name], card) for record in transients}
    # Beside, from the last: those that are not begun are sampled here in their order.
    for trial in reversed(of_trials.values()):
        sampling.begin(*trial)
    rigs = {rig.name: fit_rig(campaign, rig, cycles, ringdowns.get(rig.name), sampling) for rig in campaign.rigs}
    tests = [fit_test(campaign, test, rigs[test.rig], cycles, sampling) for test in campaign.tests if test.records]
    levels = {result.test.name: float(np.median(result.derived["a_star"])) for result in tests}
    names = {test.name for test in peak_tests(campaign, levels)}
    peaks = [result for result in tests if result.test.name in names]
    misfits = misfit(tests)
    joint = weighed_peaks(campaign, peaks, sampling, white=not misfits, thorough=thorough) if peaks else None
    sampling.flags += [
        *sentences(review(inspection), Severity.DOUBT),
        *misfits,
        *varying_damping(campaign, rigs, tests),
        *departing(tests),
        *set_apart(tests),
        *lock_in_not_used(tests),
        *([remark] if joint and (remark := joint.weights.flag or reference_remark(joint.weights)) else []),
    ]
    trials = [
        fit_trial(result, record, of_trials[record.name], sampling)
        for result in tests
        for record in result.test.records
        if record.name in of_trials
    ]
    sampled = Sampled(campaign, card, cycles, ringdowns, tuple(rigs.values()), tuple(tests), joint, tuple(trials))
    provenance = provenance_of_fit(campaign, card, seed=seed, asked=asked)
    return assemble(sampled, sampling, provenance, thorough=thorough, misfit=bool(misfits))


def known_of(campaign: Campaign, known: Known) -> Known:
    """What is known of the rigs and tests of a campaign, each by itself."""
    names = [f"{RIG} {rig.name}" for rig in campaign.rigs] + [f"{TEST} {test.name}" for test in campaign.tests]
    names += [f"{LOCK_IN} {record.name}" for test in campaign.tests for record in test.records]
    return Known({name: known[name] for name in names if name in known})


def assemble(
    sampled: Sampled,
    sampling: Sampling,
    provenance: Mapping[str, Any],
    *,
    thorough: bool = True,
    misfit: bool = False,
) -> Fit:
    """Put every posterior into one `Fit`, and fit the model over wind speeds to them where it is `thorough`."""
    campaign, card, samples = sampled.campaign, sampled.card, sampled.samples
    tree = build_tree(sampled, sampling, provenance, thorough=thorough)
    if sampled.joint:
        priors = {prior.name: prior for prior in sampled.joint.laws[0].posterior.shared if prior.name in SCALES}
        at_prior = left_at_prior(joint_draws(tree).shared, priors)
        tree["campaign_posterior"].attrs["left_at_prior"] = ",".join(at_prior)
        if apart := off_curve(sampled.joint, list(sampled.tests)):
            tree["campaign_posterior"].attrs["off_curve"] = apart
            sampling.flags.append(apart)
    joint = joint_draws(tree)
    amplitudes = {one.test.name: one.derived["a_star"] for one in sampled.tests}
    stated = off_stated(campaign, amplitudes | {name: draws["a_star"] for name, draws in joint.tests.items()})
    if stated and sampled.joint:
        tree["campaign_posterior"].attrs["off_stated"] = "\n".join(stated)
    sampling.flags += [*stated, *unconstrained(sampled, joint), *([remark] if (remark := scales_remark(joint)) else [])]
    # before the speeds are sampled: a record too short for the procedure is refused now
    fronts = dict(front_ends_of(campaign, tree, sampled.ringdowns))
    if sampled.joint and thorough:
        speeds = fit_speeds(tree, campaign, sampling)
        if speeds is not None:
            tree["speeds"] = xr.DataTree(speeds.group)
            samples[SPEEDS] = speeds.samples
    tree["convergence"] = xr.DataTree(convergence_group(samples))
    convergence, needed = convergence_frame(tree), unconverged(tree)
    flags = (*of_convergence(sampling.faults, needed), *sampling.flags)
    summary = summarise(sampled, joint, convergence, provenance, flags, converged=not needed, misfit=misfit)
    return Fit(
        campaign, card, tree, sampled.cycles, sampled.ringdowns, fronts, convergence, flags, summary["converged"],
        summary,
    )  # fmt: skip


def of_convergence(faults: Mapping[str, str], needed: Sequence[str]) -> list[str]:
    """What is said of posteriors that did not converge: of each that is needed, then of all others in one sentence.

    Only those that are needed bring the verdict on a fit down, and only they are called not converged.
    """
    spare = [name for name in faults if name not in needed]
    said = f"sampled to less than the card's criteria, which the verdict does not count: {', '.join(spare)}; little or "
    said += "nothing that is printed or predicted rests on their draws"
    return [f"{name}: {faults[name]}" for name in needed] + ([said] if spare else [])


def admit(card: ModelCard, where: str, priors: Sequence[Prior], values: Sequence[float]) -> None:
    """Raise InputError, naming the parameters, where the records show what the card's priors exclude."""
    try:
        check_support(priors, values)
    except ValueError as error:
        wanted = f"priors in the model card '{card.name}' that admit what the records show"
        raise InputError(where, "", str(error), wanted) from error


def fit_rig(
    campaign: Campaign, rig: Rig, cycles: Mapping[str, Cycles], ringdown: RingDown | None, sampling: Sampling
) -> RigResult:
    """Posterior of a rig's structural damping ratio, from its ring-downs and what the laboratory states."""
    card, motion = sampling.card, campaign.section.motion
    prior, name = stated_damping(rig, card, campaign), f"{RIG} {rig.name}"
    priors = (prior, card.prior("still_air_scatter", motion), card.prior("noise_factor", motion))
    data = EnvelopeData.join({r.name: cycles[r.name] for r in rig.records})
    if not data.size or ringdown is None:
        rng = sampling.generator(name)
        settings = fewer_walkers(card.sampler, len(priors))  # laid out as those of rigs that were sampled
        shape = (settings.ensembles * settings.walkers, settings.draws)
        draws = prior.from_sampled(prior.draw(rng, shape[0] * shape[1])).reshape(shape)
        return RigResult(rig, None, None, draws, prior)
    posterior = StillAirPosterior(
        priors, data, 2 * np.pi * rig.frequency.mean, float(data.amplitude.max()), card.initial_amplitude_sd
    )
    admit(card, name, [prior], [ringdown.damping_ratio])
    samples = sampling.run(name, posterior, data.amplitude, data.standard_error, data.time)
    draws = np.exp(posterior.named(samples.chain)["damping_ratio"])
    if damping_varies(ringdown) is None:
        return RigResult(rig, posterior, samples, draws, prior)
    # the constant that was sampled is an average over the ring-downs, known far better than any one amplitude's
    draws = draws_over_amplitudes(ringdown, sampling.generator(f"amplitudes of {name}"), draws.shape)
    return RigResult(rig, posterior, samples, draws, prior, ringdown)


def fit_test(
    campaign: Campaign, test: Test, rig: RigResult, cycles: Mapping[str, Cycles], sampling: Sampling
) -> TestResult:
    """Posterior of one test in wind."""
    card, motion, name = sampling.card, campaign.section.motion, f"{TEST} {test.name}"
    omega0 = 2 * np.pi * rig.rig.frequency.mean
    # What still air says of ln xi_s enters as a normal prior: it is close to one, and the wind-on records add little.
    records = [cycles[record.name] for record in test.records]
    damping = damping_prior(rig, records, campaign.section.amplitude_unit)
    priors = (*(card.prior(parameter, motion) for parameter in WIND[:-1]), damping)
    verdicts = [
        judge_lock_in(r, cycles[r.name], priors, omega0, sampling) for r in test.records if r.kind is Kind.STEADY
    ]
    verdicts += judge_swings({r.name: cycles[r.name] for r in test.records if r.kind in TRANSIENTS})
    # Lock-in that fluctuates as broad-band turbulence makes it counts like a transient; of other lock-in, the mean.
    judged = {verdict.record for verdict in verdicts}
    informative = {r.name: cycles[r.name] for r in test.records if r.name not in judged}
    informative |= {verdict.record: verdict.cycles for verdict in verdicts if verdict.usable}
    data = EnvelopeData.join(informative)
    steady = [steady_amplitude(verdict) for verdict in verdicts if not verdict.usable]
    priors += (card.exponent,) if card.exponent else ()
    varying = varying_of(rig)
    posterior = WindPosterior(priors, data, steady, omega0, card.law_n, card.initial_amplitude_sd, varying)
    levels = np.array([astuple(amplitude) for amplitude in steady])
    tails = ends(records)
    admit(card, name, [posterior.prior("stable_amplitude")] * len(tails), tails)
    read = [data.amplitude, data.standard_error, data.time, levels]
    read += varying.arrays if varying else []
    samples = sampling.run(name, posterior, *read)
    frequency = float(np.median([cycles[r.name].reference_frequency for r in test.records]))
    # Mass and frequency belong to the rig and are the same draws in all its tests.
    assert rig.rig.mass is not None, "the loader refuses a test whose rig has no mass"
    quantities = {"mass": rig.rig.mass, "frequency": rig.rig.frequency}
    quantities |= {"air_density": test.air_density, "wind_speed": test.wind_speed}
    stated = {}
    for key, quantity in quantities.items():
        owner = rig.rig.name if key in ("mass", "frequency") else test.name
        rng = sampling.generator(f"{key.replace('_', ' ')} of {owner}")
        stated[key] = quantity.draw(rng, samples.log_prob.shape)
    derived = derive(campaign.section, stated, posterior, samples.chain, frequency)
    return TestResult(test, rig.rig, posterior, samples, stated, frequency, derived, tuple(verdicts))


def judge_lock_in(
    record: Record, cycles: Cycles, priors: tuple[Prior, ...], omega0: float, sampling: Sampling
) -> SteadyVerdict:
    """Whether the fluctuations of a lock-in record may tell the relaxation rate, judged by its own posterior."""
    posterior = steady_posterior(record.name, cycles, priors, omega0, sampling.card.initial_amplitude_sd)
    data = posterior.data
    samples = sampling.run(f"{LOCK_IN} {record.name}", posterior, data.amplitude, data.standard_error, data.time)
    return judge_steady(record.name, cycles, samples, posterior)


def steady_amplitude(verdict: SteadyVerdict) -> SteadyAmplitude:
    """Mean amplitude of a lock-in record and its standard error, autocorrelation allowed for."""
    cycles = verdict.cycles
    a = cycles.amplitude
    mean = float(a.mean())
    ess = effective_draws_of_mean(a[None, :]) if a.size >= 8 else 1.0
    ess = ess if np.isfinite(ess) and ess >= 1.0 and verdict.settled else 1.0
    length = float(cycles.time[-1] - cycles.time[0]) + 1.0 / cycles.reference_frequency
    return SteadyAmplitude(mean, float(np.hypot(a.std() / np.sqrt(ess), STEADY_FLOOR * mean)), length)


def trial_of(campaign: Campaign, record: Record, cycles: Cycles, card: ModelCard) -> AskedTrial:
    """Name and posterior of a record's trial function, and what the likelihood reads."""
    data = EnvelopeData.join({record.name: cycles})
    motion = campaign.section.motion
    priors = tuple(replace(card.prior(of, motion), name=name) for name, of in TRIAL_PRIORS.items())
    posterior = TrialPosterior(
        priors, card.prior("trial_amplitude", motion), data, 2 * np.pi * cycles.reference_frequency,
        float(data.amplitude.max()),
    )  # fmt: skip
    return f"{TRIAL} {record.name}", posterior, data.amplitude, data.standard_error, data.time


def fit_trial(result: TestResult, record: Record, asked: AskedTrial, sampling: Sampling) -> TrialResult:
    """Posterior of the constants a, b, c, d of one transient record (Eq. 4)."""
    where, posterior, *arrays = asked
    samples = sampling.run(where, posterior, *arrays)
    rng = sampling.generator(f"amplitudes of {where}")
    names = ("a", "b", "c", "d", "residual_sd", "residual_rate")
    constants = (*posterior.constants(samples.chain, rng), *posterior.residual(samples.chain))
    return TrialResult(record, result.test, posterior, samples, dict(zip(names, constants, strict=True)))


def misfit(tests: Sequence[TestResult]) -> list[str]:
    """Records whose innovations can be predicted: the law or the noise of the model is not theirs.

    The innovations are those of each test's own posterior at its median; p-values are adjusted over all records.
    """
    parts = [result for result in tests if result.posterior.data.size]
    if not parts:
        return []
    checks = whiteness.judge(
        np.concatenate([result.posterior.standardised(result.samples.chain) for result in parts]),
        np.concatenate([result.posterior.data.amplitude for result in parts]),
        np.repeat([result.test.name for result in parts], [result.posterior.data.size for result in parts]),
        np.concatenate([result.posterior.data.record for result in parts]),
    )
    not_white: dict[str, list[str]] = {}
    for check in checks:
        if check.name in whiteness.PREDICTABLE and check.adjusted < NOT_WHITE:
            not_white.setdefault(check.test, []).append(f"{check.name}{f' of {check.record}' if check.record else ''}")
    return [
        f"test {test}: the innovations of the filter are not white ({'; '.join(what)}); the law or the noise of the "
        "model is not that of the records, `scruton criticise` says more"
        for test, what in not_white.items()
    ]
