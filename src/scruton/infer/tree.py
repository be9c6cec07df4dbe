"""The arviz DataTree of a fit, laid out as `scruton.infer.result_schema` has it."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from scruton.arrays import FloatArray
from scruton.campaign.schema import Campaign
from scruton.infer.cards import ModelCard
from scruton.infer.predictive import free_runs
from scruton.infer.result_schema import SCHEMA, dataset
from scruton.infer.results import PeakResult, Sampled, TestResult, TrialResult
from scruton.infer.sampling import Sampling
from scruton.infer.store import pack
from scruton.stats.sampler import Samples

POINTWISE_THIN = 8  # the pointwise log likelihood is kept for every eighth draw
PRIOR_DRAWS = 1000


def build_tree(sampled: Sampled, sampling: Sampling, provenance: Mapping[str, Any], *, thorough: bool) -> xr.DataTree:
    """Every posterior of a campaign in one tree, and what it is conditioned on.

    Parameters
    ----------
    sampled : Sampled
    sampling : Sampling
        For the seeds of prior draws and free runs.
    provenance : mapping
        Kept as a JSON text among the attributes.
    thorough : bool
        Whether there is anything by cycle: free runs, innovations, pointwise likelihood.
    """
    rigs = sampled.rigs
    chains = len(rigs[0].damping)
    ensemble = next((one.samples.ensemble for one in rigs if one.samples), np.zeros(chains, dtype=int))
    groups = {
        "rig_posterior": dataset(
            "rig_posterior",
            {"damping_ratio": np.stack([one.damping for one in rigs], axis=-1)},
            rig=[one.rig.name for one in rigs],
            ensemble=ensemble,
        ),
        "constant_data": _constants(sampled),
    }
    if sampled.tests:
        groups |= _test_groups(sampled.tests, sampling)
        by_cycle = [one for one in sampled.tests if one.posterior.data.size]
        if by_cycle and thorough:
            groups |= _cycle_groups(by_cycle, sampling)
    if sampled.joint:
        groups |= _campaign_groups(sampled.joint)
    if sampled.trials:
        groups["trial_function"] = _trial_group(sampled.trials)
    groups["inputs"] = inputs_group(sampled.campaign, sampled.card)
    tree = xr.DataTree.from_dict({f"/{name}": one for name, one in groups.items()})
    tree.attrs["provenance"] = json.dumps(provenance, sort_keys=True)
    return tree


def inputs_group(campaign: Campaign, card: ModelCard) -> xr.Dataset:
    """Group `inputs`: the campaign and the resolved model card as data, to be read back by `scruton.load_fit`."""
    document, numbers = pack(campaign.path.parent, campaign=campaign, card=card)
    group = dataset("inputs", {"document": document, "numbers": numbers})
    # Times of samples are mostly regular.
    group["numbers"].encoding = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
    return group


def convergence_group(samples: Mapping[str, Samples]) -> xr.Dataset:
    """Group `convergence`: a row for every parameter of every posterior."""
    rows: dict[str, list[Any]] = {one.name: [] for one in SCHEMA["convergence"]}
    for posterior, one in samples.items():
        for i, parameter in enumerate(one.names):
            of = {"posterior": posterior, "parameter": parameter} | vars(one.convergence)
            for key, column in rows.items():
                column.append(of[key][i] if isinstance(of[key], np.ndarray) else of[key])
    return dataset("convergence", rows)


def reference_law(card: ModelCard) -> float:
    """Exponent of the reference law; NaN where it is free."""
    return np.nan if card.law_n is None else card.law_n


def trial_constants(one: TrialResult) -> dict[str, FloatArray]:
    """Constants of Eq. (4) and of the residual about it, (chains, draws) each."""
    a, b, c, d = one.posterior.constants(one.samples.chain)
    sd, rate = one.posterior.residual(one.samples.chain)
    return {"a": a, "b": b, "c": c, "d": d, "residual_sd": sd, "residual_rate": rate}


def _constants(sampled: Sampled) -> xr.Dataset:
    """What is known, of the section, the tests and their cycles."""
    section, tests = sampled.campaign.section, sampled.tests
    values: dict[str, Any] = {
        "width": section.width,
        "depth": section.depth,
        "law_n": reference_law(sampled.card),
        "motion": section.motion.value,
        "amplitude_unit": section.amplitude_unit,
    }
    if not tests:
        return dataset("constant_data", values)
    measured = [one.test.stable_amplitude for one in tests]
    values |= {
        "mass": [one.rig.mass.mean for one in tests if one.rig.mass],
        "air_density": [one.test.air_density.mean for one in tests],
        "wind_speed": [one.test.wind_speed.mean for one in tests],
        "frequency": [one.rig.frequency.mean for one in tests],
        "wind_frequency": [one.wind_frequency for one in tests],
        "rig": [one.rig.name for one in tests],
        "peak": [int(one.test.name in sampled.peaks) for one in tests],
        "stable_amplitude": [one.mean if one else np.nan for one in measured],
        "stable_amplitude_sd": [one.sd if one and one.sd else np.nan for one in measured],
    }
    data = [one.posterior.data for one in tests if one.posterior.data.size]
    if data:
        names = [one.test.name for one in tests if one.posterior.data.size]
        values |= {
            "time": np.concatenate([one.time for one in data]),
            "standard_error": np.concatenate([one.standard_error for one in data]),
            "record": np.concatenate([one.record for one in data]).astype(str),
            "record_test": np.repeat(names, [one.size for one in data]),
        }
    return dataset("constant_data", values, test=[one.test.name for one in tests])


def _test_groups(tests: Sequence[TestResult], sampling: Sampling) -> dict[str, xr.Dataset]:
    def group(name: str, of_tests: Sequence[Mapping[str, FloatArray]], ensemble: np.ndarray) -> xr.Dataset:
        stacked = {key: np.stack([one[key] for one in of_tests], axis=-1) for key in of_tests[0]}
        return dataset(name, stacked, test=[one.test.name for one in tests], ensemble=ensemble)

    rng = np.random.default_rng(sampling.seed_of("prior"))
    prior = [one.posterior.natural(one.posterior.prior_draws(rng, PRIOR_DRAWS)) for one in tests]
    ensemble = tests[0].samples.ensemble
    return {
        "posterior": group("posterior", [one.derived for one in tests], ensemble),
        "sample_stats": group("sample_stats", [{"lp": one.samples.log_prob} for one in tests], ensemble),
        "log_prior": group("log_prior", [_log_prior(one) for one in tests], ensemble),
        "prior": group("prior", [{k: v[None] for k, v in one.items()} for one in prior], np.zeros(1, int)),
    }


def _log_prior(one: TestResult) -> dict[str, FloatArray]:
    """Log prior of every parameter, (chains, draws) each."""
    chain = one.samples.chain
    terms = one.posterior.named(one.posterior.log_prior_terms(chain.reshape(-1, chain.shape[-1])).reshape(chain.shape))
    return {name: terms[name] for name in one.posterior.names}


def _cycle_groups(tests: Sequence[TestResult], sampling: Sampling) -> dict[str, xr.Dataset]:
    pointwise, runs = [], []
    for one in tests:
        chain = one.samples.chain[:, ::POINTWISE_THIN]
        flat = one.posterior.pointwise(chain.reshape(-1, chain.shape[-1]))
        pointwise.append(flat.reshape(*chain.shape[:2], -1))
        rng = np.random.default_rng(sampling.seed_of(f"predictive of {one.test.name}"))
        runs.append(free_runs(one.posterior, one.samples.chain, rng))
    log_likelihood = np.concatenate(pointwise, axis=-1)
    mean, replicate = (np.concatenate(run, axis=-1)[None] for run in zip(*runs, strict=True))
    observed = np.concatenate([one.posterior.data.amplitude for one in tests])
    standardised = np.concatenate([one.posterior.standardised(one.samples.chain) for one in tests])
    kept = np.arange(log_likelihood.shape[1]) * POINTWISE_THIN
    return {
        "log_likelihood": dataset("log_likelihood", {"amplitude": log_likelihood}, draw=kept),
        "posterior_predictive": dataset("posterior_predictive", {"amplitude": replicate, "mean_amplitude": mean}),
        "innovations": dataset("innovations", {"amplitude": standardised}),
        "observed_data": dataset("observed_data", {"amplitude": observed}),
    }


def _campaign_groups(joint: PeakResult) -> dict[str, xr.Dataset]:
    """The campaign model of the peak tests under every law that was sampled, and the weights of all laws."""
    laws, weights = joint.laws, joint.weights
    group = dataset(
        "campaign_posterior",
        {key: np.stack([one.derived[key] for one in laws]) for key in laws[0].derived},
        law=[one.label for one in laws],
        peak_test=list(joint.tests),
        ensemble=laws[0].samples.ensemble,
    )
    group.attrs["reference_scruton_number"], group.attrs["reference_mass_damping_factor"] = laws[0].posterior.reference
    rows = {
        "prior_weight": weights.prior,
        "weight": weights.weight,
        "stacking_weight": weights.stacking,
        "log_evidence": weights.log_evidence,
        "log_evidence_error": weights.error,
        "sampled": weights.sampled.astype(float),
    }
    return {"campaign_posterior": group, "laws": dataset("laws", rows, law=list(weights.labels))}


def _trial_group(trials: Sequence[TrialResult]) -> xr.Dataset:
    constants = [trial_constants(one) for one in trials]
    times = [one.posterior.data.time for one in trials]
    return dataset(
        "trial_function",
        {key: np.stack([one[key] for one in constants], axis=-1) for key in constants[0]}
        | {"origin": [one[0] for one in times], "end": [one[-1] for one in times]}
        | {"record_test": [one.test.name for one in trials]},
        record=[one.record.name for one in trials],
        ensemble=trials[0].samples.ensemble,
    )
