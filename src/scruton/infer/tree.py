"""What is kept of a fit: the arviz DataTree, laid out as `scruton.infer.result_schema` has it, and fit.json."""

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from scruton.arrays import FloatArray, end_to_end
from scruton.campaign.schema import Campaign
from scruton.documents import as_json
from scruton.dynamics.cycles import EnvelopeData
from scruton.infer.cards import ModelCard
from scruton.infer.drift import departure_group
from scruton.infer.examined import examined_groups
from scruton.infer.joint import RIG, TEST, Joint, reference_holds
from scruton.infer.law_free import law_free_group
from scruton.infer.result_schema import EITHER, SCHEMA, dataset
from scruton.infer.results import TRIAL, PeakResult, Sampled, TestResult, TrialResult
from scruton.infer.sampling import Sampling
from scruton.infer.store import pack
from scruton.infer.thresholds import SEEN
from scruton.infer.tree_campaign import diagnostics, model_groups
from scruton.infer.tree_prior import prior_groups
from scruton.provenance import provenance
from scruton.said import parts_of
from scruton.stats.convergence import monte_carlo_error
from scruton.stats.samples import Samples

if TYPE_CHECKING:
    import pandas as pd

INTERVALS = (0.50, 0.90, 0.95)
# Sampled parameters under the names that users meet.
_SAMPLED = {"a_star": "stable_amplitude", "relaxation_rate": "relaxation_ratio", "d": "rate_gap"}


def build_tree(sampled: Sampled, sampling: Sampling, provenance: Mapping[str, Any], *, thorough: bool) -> xr.DataTree:
    """Every posterior of a campaign in one tree, and what it is conditioned on, its provenance among the attributes.

    There is something by cycle (free runs, innovations, pointwise likelihood) only where it is `thorough`.
    """
    rigs = sampled.rigs
    ensembles, walkers = sampled.card.sampler.ensembles, len(rigs[0].damping)
    ensemble = np.repeat(np.arange(ensembles), walkers // ensembles)
    damping = {"damping_ratio": np.stack([rig.damping for rig in rigs], axis=-1)}
    groups = {
        "rig_posterior": dataset("rig_posterior", damping, rig=[rig.rig.name for rig in rigs], ensemble=ensemble),
        "constant_data": _constants(sampled),
    }
    if sampled.tests:
        groups |= _test_groups(sampled.tests)
        groups |= prior_groups(sampled.campaign.section, sampled.tests, sampling, thorough=thorough)
        reach = [transient_range(result.posterior.data) for result in sampled.tests]
        groups["law_free"] = law_free_group(sampled.tests, reach, sampling)
        if thorough:
            groups["departure"] = departure_group(sampled, sampling)
    if sampled.joint:
        groups |= _campaign_groups(sampled.joint)
        if thorough:
            ensemble = sampled.tests[0].samples.ensemble
            groups |= examined_groups(sampled.tests, sampled.joint, ensemble, sampling)
            groups |= model_groups(sampled, sampling)
    if sampled.trials:
        groups["trial_function"] = _trial_group(sampled.trials)
    groups["inputs"] = inputs_group(sampled.campaign, sampled.card)
    for group in groups.values():
        for column in group.data_vars.values():
            if column.attrs.get("units") == EITHER:
                column.attrs["units"] = sampled.campaign.section.amplitude_unit
    tree = xr.DataTree.from_dict({f"/{name}": group for name, group in groups.items()})
    tree.attrs["provenance"] = json.dumps(provenance, sort_keys=True)
    return tree


def inputs_group(campaign: Campaign, card: ModelCard) -> xr.Dataset:
    """Group `inputs`: the campaign and the resolved model card as data, to be read back by `scruton.load_fit`."""
    document, numbers = pack(campaign.path.parent, campaign=campaign, card=card)
    group = dataset("inputs", {"document": document, "numbers": numbers})
    # Times of samples are mostly regular.
    group["numbers"].encoding = {"zlib": True, "complevel": 4, "shuffle": True}
    return group


def convergence_group(samples: Mapping[str, Samples]) -> xr.Dataset:
    """Group `convergence`: a row for every parameter of every posterior."""
    rows: dict[str, list[Any]] = {variable.name: [] for variable in SCHEMA["convergence"]}
    for posterior, draws in samples.items():
        for i, parameter in enumerate(draws.names):
            of = {"posterior": posterior, "parameter": parameter} | vars(draws.convergence)
            for key, column in rows.items():
                column.append(of[key][i] if isinstance(of[key], np.ndarray) else of[key])
    return dataset("convergence", rows)


def _constants(sampled: Sampled) -> xr.Dataset:
    """What is known, of the section, the tests and their cycles."""
    section, tests = sampled.campaign.section, sampled.tests
    values: dict[str, Any] = {
        "width": section.width,
        "depth": section.depth,
        "law_n": np.nan if sampled.card.law_n is None else sampled.card.law_n,
        "motion": section.motion.value,
        "amplitude_unit": section.amplitude_unit,
    }
    if not tests:
        return dataset("constant_data", values)
    measured = [result.test.stable_amplitude for result in tests]
    values |= {
        "mass": [result.rig.mass.mean for result in tests if result.rig.mass],
        "air_density": [result.test.air_density.mean for result in tests],
        "wind_speed": [result.test.wind_speed.mean for result in tests],
        "frequency": [result.rig.frequency.mean for result in tests],
        "wind_frequency": [result.wind_frequency for result in tests],
        "rig": [result.rig.name for result in tests],
        "peak": [int(result.test.name in sampled.peaks) for result in tests],
        "stable_amplitude": [amplitude.mean if amplitude else np.nan for amplitude in measured],
        "stable_amplitude_sd": [amplitude.sd if amplitude and amplitude.sd else np.nan for amplitude in measured],
    }
    reach = [transient_range(result.posterior.data) for result in tests]
    values |= {"transient_low": [low for low, _ in reach], "transient_high": [high for _, high in reach]}
    data = [result.posterior.data for result in tests if result.posterior.data.size]
    if data:
        names = [result.test.name for result in tests if result.posterior.data.size]
        values |= {
            "time": np.concatenate([envelope.time for envelope in data]),
            "standard_error": np.concatenate([envelope.standard_error for envelope in data]),
            "record": np.concatenate([envelope.record for envelope in data]).astype(str),
            "record_test": np.repeat(names, [envelope.size for envelope in data]),
        }
    return dataset("constant_data", values, test=[result.test.name for result in tests])


def transient_range(data: EnvelopeData) -> tuple[float, float]:
    """Lowest and highest amplitude that records tell from their noise; NaN where there is none."""
    seen = data.amplitude[data.amplitude > SEEN * data.standard_error]
    return (float(seen.min()), float(seen.max())) if seen.size else (np.nan, np.nan)


def _test_groups(tests: Sequence[TestResult]) -> dict[str, xr.Dataset]:
    names, ensemble = [result.test.name for result in tests], tests[0].samples.ensemble

    def group(
        name: str, of_tests: Sequence[Mapping[str, FloatArray]], more: Mapping[str, Any] | None = None, **labels: Any
    ) -> xr.Dataset:
        stacked = {key: np.stack([values[key] for values in of_tests], axis=-1) for key in of_tests[0]}
        return dataset(name, {**stacked, **(more or {})}, test=names, ensemble=ensemble, **labels)

    log_prior, likelihood = [], []
    for result in tests:
        chain = result.samples.chain
        terms = result.posterior.log_prior_terms(end_to_end(chain)).reshape(chain.shape)
        log_prior.append({name: result.posterior.named(terms)[name] for name in result.posterior.names})
        likelihood.append({"records": result.samples.log_prob - terms.sum(axis=-1)})
    own = [diagnostics(result.samples) for result in tests]
    stats = group(
        "sample_stats", [{"lp": result.samples.log_prob} for result in tests],
        {name: np.stack([one[name] for one in own]) for name in own[0]}, parameter=list(tests[0].samples.names),
    )  # fmt: skip
    return {
        "posterior": group("posterior", [result.derived for result in tests]),
        "sample_stats": stats,
        "log_prior": group("log_prior", log_prior),
        "log_likelihood": group("log_likelihood", likelihood),
    }


def _campaign_groups(joint: PeakResult) -> dict[str, xr.Dataset]:
    """The campaign model of the peak tests under every law that was sampled, and the weights of all laws."""
    laws, weights = joint.laws, joint.weights
    group = dataset(
        "campaign_posterior",
        {key: np.stack([law.derived[key] for law in laws]) for key in laws[0].derived},
        law=[law.label for law in laws],
        peak_test=list(joint.tests),
        ensemble=laws[0].samples.ensemble,
    )
    group.attrs["reference_scruton_number"], group.attrs["reference_mass_damping_factor"] = laws[0].posterior.reference
    rows = {
        "prior_weight": weights.prior,
        "weight": weights.weight,
        "common_weight": np.broadcast_to(weights.common, weights.weight.shape),
        "stacking_weight": weights.stacking,
        "log_evidence": weights.log_evidence,
        "log_evidence_error": weights.error,
        "sampled": weights.sampled.astype(float),
    }
    table = dataset("laws", rows, law=list(weights.labels))
    rule = weights.rule
    table.attrs |= {"rule": rule.name, "explained": rule.sentence, "doubted": rule.why if rule.doubted else ""}
    return {"campaign_posterior": group, "laws": table}


def _trial_group(trials: Sequence[TrialResult]) -> xr.Dataset:
    times = [trial.posterior.data.time for trial in trials]
    return dataset(
        "trial_function",
        {key: np.stack([trial.derived[key] for trial in trials], axis=-1) for key in trials[0].derived}
        | {"origin": [time[0] for time in times], "end": [time[-1] for time in times]}
        | {"record_test": [trial.test.name for trial in trials]},
        record=[trial.record.name for trial in trials],
        ensemble=trials[0].samples.ensemble,
    )


def provenance_of_fit(campaign: Campaign, card: ModelCard, *, seed: int, asked: Mapping[str, Any]) -> dict[str, Any]:
    """Where the numbers come from: versions, seed, digests, the model card."""
    section, tests = campaign.section, list(asked.get("tests", ()))
    return provenance(
        asked.get("command", ""),
        seed=seed,
        sha256=campaign.sha256 or {},
        settings={"tests": tests, "envelope_source": card.envelope_source},
        card={"name": card.name, "sha256": card.sha256, "text": card.text, "resolved": card.resolved},
    ) | {
        "tests": tests,
        "campaign": {
            "title": campaign.title,
            "source": campaign.source,
            "motion": section.motion.value,
            "width": section.width,
            "depth": section.depth,
        },
    }


def summarise(
    sampled: Sampled,
    joint: Joint,
    convergence: "pd.DataFrame",
    provenance: Mapping[str, Any],
    flags: Sequence[str],
    *,
    converged: bool,
    misfit: bool,
) -> dict[str, Any]:
    """The content of fit.json; `misfit` says whether the innovations speak against the reference law.

    The parameters of a peak test are those of the model that predicts, mixed over the laws by their weights; what the
    test says alone under the reference law stands beside them.  Of other tests there is nothing else.
    """
    verdicts: dict[Any, Any] = convergence.to_dict(orient="index")
    chains = sampled.card.sampler.ensembles

    def sampled_alone(draws: Mapping[str, FloatArray], posterior: str) -> dict[str, Any]:
        return parameters(draws, posterior, verdicts, chains=chains)

    peaks = {name: parameters(draws, chains=chains) for name, draws in joint.tests.items()}
    alone = {result.test.name: sampled_alone(result.derived, f"{TEST} {result.test.name}") for result in sampled.tests}
    bands = {rig: ringdown.bands for rig, ringdown in sampled.ringdowns.items()}
    return {
        "format": 1,
        "title": sampled.campaign.title,
        "converged": converged,
        "flags": list(map(str, flags)),
        **({"flag_parts": parts} if (parts := parts_of(flags)) else {}),
        "law_n": np.nan if sampled.card.law_n is None else sampled.card.law_n,
        "laws": _laws(sampled.joint, misfit) if sampled.joint else {},
        "campaign": _campaign(sampled.joint, joint, peaks, chains) if sampled.joint else {},
        "amplitude_unit": sampled.campaign.section.amplitude_unit,
        **({"conventions": conventions} if (conventions := sampled.campaign.conventions) else {}),
        "envelope_source": sampled.card.envelope_source,
        "tests": [
            {
                "name": result.test.name,
                "rig": result.rig.name,
                "peak": result.test.name in sampled.peaks,
                "wind_frequency": result.wind_frequency,
                # Whether the fluctuations of lock-in records were used, and the conditions for it.
                "lock_in": [
                    {
                        "record": verdict.record,
                        "used": verdict.usable,
                        "conditions": [
                            {"name": c.name, "holds": c.holds, "sentence": c.sentence} for c in verdict.conditions
                        ],
                    }
                    for verdict in result.steady
                ],
                "parameters": peaks.get(result.test.name, alone[result.test.name]),
                **({"alone": alone[result.test.name]} if result.test.name in peaks else {}),
            }
            for result in sampled.tests
        ],
        "rigs": [
            {
                "name": rig.rig.name,
                "parameters": sampled_alone({"damping_ratio": rig.damping}, f"{RIG} {rig.rig.name}"),
                "bands": [
                    {
                        "amplitude": [band.lower, band.upper],
                        "damping_ratio": band.damping_ratio,
                        "sd": band.sd,
                        "plucks": band.plucks,
                    }
                    for band in bands.get(rig.rig.name, ())
                ],
            }
            for rig in sampled.rigs
        ],
        "records": [
            {
                "name": trial.record.name,
                "test": trial.test.name,
                "parameters": sampled_alone(trial.derived, f"{TRIAL} {trial.record.name}"),
            }
            for trial in sampled.trials
        ],
        "provenance": dict(provenance),
    }


def parameters(
    values: Mapping[str, FloatArray],
    posterior: str = "",
    convergence: Mapping[Any, Mapping[str, Any]] | None = None,
    *,
    chains: int = 1,
) -> dict[str, Any]:
    """Median, mean, sd and intervals of every parameter, with what sampling says of it where it was sampled.

    The Monte Carlo error is that of the median; the draws are those of so many chains, one after the other.
    """
    entries = {}
    for name, draws in values.items():
        entry: dict[str, Any] = {
            "median": float(np.median(draws)),
            "mean": float(draws.mean()),
            "sd": float(draws.std()),
            "monte_carlo_error": as_json(monte_carlo_error(draws.reshape(chains, -1), 0.5)),
            "interval": {
                f"{p:.2f}": [float(x) for x in np.quantile(draws, [0.5 - p / 2, 0.5 + p / 2])] for p in INTERVALS
            },
        }
        row = (convergence or {}).get((posterior, _SAMPLED.get(name, name)))
        if row is not None:
            entry |= {column: float(row[column]) for column in ("rhat_nested", "ess_bulk", "ess_tail")}
        entries[name] = entry
    return entries


def _laws(joint: PeakResult, misfit: bool) -> dict[str, Any]:
    """Laws and their weights; numbers that do not exist are null.

    The flag says that the data speak against the reference law: by evidence, or by its innovations where it is alone.
    """
    of = joint.weights
    columns = {
        "prior": of.prior,
        "weight": of.weight,
        "common": np.broadcast_to(of.common, of.weight.shape),
        "stacking": of.stacking,
        "log_evidence": of.log_evidence,
        "log_evidence_error": of.error,
        "sampled": of.sampled,
    }
    rows = {label: {name: column[k] for name, column in columns.items()} for k, label in enumerate(of.labels)}
    flag = bool(of.flag) or (len(of.labels) == 1 and misfit)
    return {
        "flag": flag,
        "forces_hold": reference_holds(of),
        **({"rule": of.rule.name, "explained": of.rule.sentence} if len(of.labels) > 1 else {}),
        "weights": as_json(rows),
    }


def _campaign(result: PeakResult, joint: Joint, peaks: Mapping[str, Any], chains: int) -> dict[str, Any]:
    """The shared curve, the discrepancies and the peak tests in the model that predicts."""
    sc, _ = result.laws[0].posterior.reference
    return {
        "reference_scruton_number": sc,
        "parameters": parameters(joint.shared, chains=chains),
        "left_at_prior": list(joint.at_prior),
        "tests": [{"name": name, "parameters": entries} for name, entries in peaks.items()],
    }
