"""The arviz DataTree of a fit, its summary, and both on disk."""

import json
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from scruton.arrays import FloatArray
from scruton.campaign.schema import Campaign
from scruton.envelope import Cycles, FrontEnd, RingDown
from scruton.infer.cards import ModelCard
from scruton.infer.flags import standardised_innovations
from scruton.infer.peaks import PeakResult
from scruton.infer.predictive import free_runs
from scruton.infer.results import Fit, RigResult, TestResult, TrialResult
from scruton.infer.run import Sampling
from scruton.infer.speeds import NAME as SPEEDS
from scruton.infer.speeds import PRIORS as SPEED_PRIORS
from scruton.infer.speeds import fit_speeds, speeds_dataset
from scruton.infer.steady import SteadyVerdict
from scruton.stats.priors import Prior
from scruton.stats.sampler import Samples

POINTWISE_THIN = 8  # the pointwise log likelihood is kept for every eighth draw
PRIOR_DRAWS = 1000
INTERVALS = (0.50, 0.90, 0.95)
PACKAGES = ("scruton", "numpy", "scipy", "emcee", "arviz", "numba")


def assemble(
    campaign: Campaign,
    card: ModelCard,
    rigs: Mapping[str, RigResult],
    tests: Sequence[TestResult],
    joint: PeakResult | None,
    trials: Sequence[TrialResult],
    cycles: Mapping[str, Cycles],
    ringdowns: Mapping[str, RingDown],
    fronts: Mapping[str, FrontEnd],
    sampling: Sampling,
    *,
    command: str,
    only: tuple[str, ...],
    thorough: bool,
    misfit: bool,
) -> Fit:
    """Put the results of every posterior into one `Fit`."""
    provenance = {
        "command": command,
        "seed": sampling.seed,
        "tests": list(only),
        "versions": {"python": platform.python_version()} | {name: version(name) for name in PACKAGES},
        "sha256": dict(campaign.sha256 or {}),
        "card": {"name": card.name, "sha256": card.sha256, "text": card.text, "resolved": card.resolved},
        "campaign": {
            "title": campaign.title,
            "source": campaign.source,
            "motion": campaign.section.motion.value,
            "width": campaign.section.width,
            "depth": campaign.section.depth,
        },
    }
    groups: dict[str, xr.Dataset] = {}
    rig_list = list(rigs.values())
    groups["rig_posterior"] = _dataset(
        {"damping_ratio": np.stack([one.damping for one in rig_list], axis=-1)},
        "rig", [one.rig.name for one in rig_list],
        _ensembles(next((one.samples for one in rig_list if one.samples), None), len(rig_list[0].damping)),
    )  # fmt: skip
    groups["constant_data"] = xr.Dataset(
        {"width": campaign.section.width, "depth": campaign.section.depth, "law_n": _law(card)}
    ).assign(motion=campaign.section.motion.value, amplitude_unit=campaign.section.amplitude_unit)
    peaks = joint.tests if joint else ()
    if tests:
        groups |= _test_groups(campaign, tests, sampling, peaks, groups["constant_data"], thorough)
    if joint:
        groups |= _campaign_groups(joint)
    if trials:
        groups["trial_function"] = _trial_group(trials)
    tree = xr.DataTree.from_dict({f"/{name}": one for name, one in groups.items()})
    tree.attrs["provenance"] = json.dumps(provenance, sort_keys=True)
    sampled = _sampled(rig_list, tests, joint, trials)
    if joint and thorough:
        speeds = fit_speeds(tree, campaign, *_speed_priors(campaign, card), sampling)
        if speeds is not None:
            tree["speeds"] = xr.DataTree(speeds_dataset(speeds))
            sampled.append((SPEEDS, speeds.samples))
    convergence = _convergence(sampled)
    converged = bool(convergence["converged"].all()) if len(convergence) else True
    verdicts: dict[Any, Any] = convergence.to_dict(orient="index")
    summary = {
        "format": 1,
        "title": campaign.title,
        "converged": converged,
        "flags": list(sampling.flags),
        "law_n": _law(card),
        "laws": _laws(joint, misfit),
        "campaign": _campaign_parameters(joint),
        "amplitude_unit": campaign.section.amplitude_unit,
        "tests": [
            {
                "name": one.test.name,
                "rig": one.rig.name,
                "peak": one.test.name in peaks,
                "wind_frequency": one.wind_frequency,
                "lock_in": [_lock_in(verdict) for verdict in one.steady],
                "parameters": _parameters(one.derived, f"test {one.test.name}", verdicts),
            }
            for one in tests
        ],
        "rigs": [
            {
                "name": one.rig.name,
                "parameters": _parameters({"damping_ratio": one.damping}, f"rig {one.rig.name}", verdicts),
                "bands": _bands(ringdowns.get(one.rig.name)),
            }
            for one in rig_list
        ],
        "records": [
            {
                "name": one.record.name,
                "test": one.test.name,
                "parameters": _parameters(_trial_constants(one), f"trial function of {one.record.name}", verdicts),
            }
            for one in trials
        ],
        "provenance": provenance,
    }
    return Fit(
        campaign,
        card,
        tree,
        cycles,
        ringdowns,
        fronts,
        convergence,
        tuple(sampling.flags),
        converged,
        summary,
    )


def _dataset(arrays: Mapping[str, FloatArray], dim: str, labels: Sequence[str], ensemble: np.ndarray) -> xr.Dataset:
    dataset = xr.Dataset({name: (("chain", "draw", dim), one) for name, one in arrays.items()})
    sizes = dataset.sizes
    return dataset.assign_coords(
        {
            "chain": np.arange(sizes["chain"]),
            "draw": np.arange(sizes["draw"]),
            dim: list(labels),
            "ensemble": ("chain", ensemble),
        }
    )


def _ensembles(samples: Samples | None, chains: int) -> np.ndarray:
    return np.zeros(chains, dtype=int) if samples is None else samples.ensemble


def _test_groups(
    campaign: Campaign,
    tests: Sequence[TestResult],
    sampling: Sampling,
    peaks: tuple[str, ...],
    constants: xr.Dataset,
    thorough: bool,
) -> dict[str, xr.Dataset]:
    names = [one.test.name for one in tests]
    ensemble = tests[0].samples.ensemble
    parameters = tests[0].posterior.names

    def stack(of: Any) -> FloatArray:
        return np.stack([of(one) for one in tests], axis=-1)

    groups = {
        "posterior": _dataset(
            {key: stack(lambda t, k=key: t.derived[k]) for key in tests[0].derived}, "test", names, ensemble
        ),
        "sample_stats": _dataset({"lp": stack(lambda t: t.samples.log_prob)}, "test", names, ensemble),
    }
    terms = []
    for one in tests:
        chain = one.samples.chain
        terms.append(one.posterior.log_prior_terms(chain.reshape(-1, chain.shape[-1])).reshape(chain.shape))
    groups["log_prior"] = _dataset(
        {name: np.stack([t[..., i] for t in terms], axis=-1) for i, name in enumerate(parameters)},
        "test",
        names,
        ensemble,
    )
    rng = np.random.default_rng(sampling.seed_of("prior"))
    draws = [one.posterior.natural(one.posterior.prior_draws(rng, PRIOR_DRAWS)) for one in tests]
    groups["prior"] = _dataset(
        {name: np.stack([one[name] for one in draws], axis=-1)[None] for name in parameters},
        "test",
        names,
        np.zeros(1, int),
    )
    per_cycle = [one for one in tests if one.posterior.data.size]
    if per_cycle and thorough:
        groups |= _cycle_groups(per_cycle, sampling)
    test_constants = {
        "mass": [one.rig.mass.mean for one in tests if one.rig.mass],
        "air_density": [one.test.air_density.mean for one in tests],
        "wind_speed": [one.test.wind_speed.mean for one in tests],
        "frequency": [one.rig.frequency.mean for one in tests],
        "wind_frequency": [one.wind_frequency for one in tests],
        "rig": [one.rig.name for one in tests],
        "peak": [int(one.test.name in peaks) for one in tests],
        "stable_amplitude": [one.test.stable_amplitude.mean if one.test.stable_amplitude else np.nan for one in tests],
        "stable_amplitude_sd": [
            one.test.stable_amplitude.sd if one.test.stable_amplitude and one.test.stable_amplitude.sd else np.nan
            for one in tests
        ],
    }
    constants = constants.assign({key: ("test", value) for key, value in test_constants.items()}).assign_coords(
        test=names
    )
    if per_cycle:
        data = [one.posterior.data for one in per_cycle]
        constants = constants.assign(
            time=("cycle", np.concatenate([one.time for one in data])),
            standard_error=("cycle", np.concatenate([one.standard_error for one in data])),
            record=("cycle", np.concatenate([one.record for one in data]).astype(str)),
            record_test=(
                "cycle",
                np.repeat([one.test.name for one in per_cycle], [one.size for one in data]),
            ),
        )
    groups["constant_data"] = constants
    return groups


def _lock_in(verdict: SteadyVerdict) -> dict[str, Any]:
    """Whether the fluctuations of a lock-in record were used, and the conditions for it."""
    conditions = [{"name": one.name, "holds": one.holds, "sentence": one.sentence} for one in verdict.conditions]
    return {"record": verdict.record, "used": verdict.usable, "conditions": conditions}


def _law(card: ModelCard) -> float:
    """Exponent of the reference law; NaN where it is free."""
    return np.nan if card.law_n is None else card.law_n


def _campaign_groups(joint: PeakResult) -> dict[str, xr.Dataset]:
    """The campaign model: (law, chain, draw) of the shared curve, (law, chain, draw, peak_test) of the tests."""
    laws = joint.laws
    variables = {}
    for key, first in laws[0].derived.items():
        dims = ("law", "chain", "draw") if first.ndim == 2 else ("law", "chain", "draw", "peak_test")
        variables[key] = (dims, np.stack([one.derived[key] for one in laws]))
    chains, draws = laws[0].samples.log_prob.shape
    labels = [one.label for one in laws]
    group = xr.Dataset(variables).assign_coords(
        law=labels,
        chain=np.arange(chains),
        draw=np.arange(draws),
        peak_test=list(joint.tests),
        ensemble=("chain", laws[0].samples.ensemble),
    )
    group.attrs["reference_scruton_number"], group.attrs["reference_mass_damping_factor"] = laws[0].posterior.reference
    weights = joint.weights
    rows = {
        "prior_weight": weights.prior,
        "weight": weights.weight,
        "stacking_weight": weights.stacking,
        "log_evidence": weights.log_evidence,
        "log_evidence_error": weights.error,
        "sampled": weights.sampled,
    }
    table = xr.Dataset({key: ("law", np.asarray(value, dtype=float)) for key, value in rows.items()})
    return {"campaign_posterior": group, "laws": table.assign_coords(law=list(weights.labels))}


def _laws(joint: PeakResult | None, misfit: bool) -> dict[str, Any]:
    """Laws and their weights, as fit.json has them; numbers that do not exist are null.

    The flag says that the data speak against the reference law: by evidence, or by its innovations where it is alone.
    """
    if joint is None:
        return {}
    one = joint.weights
    rows = zip(one.labels, one.prior, one.weight, one.stacking, one.log_evidence, one.error, one.sampled, strict=True)
    return {
        "flag": bool(one.flag) or (len(one.labels) == 1 and misfit),
        "weights": {
            label: {
                "prior": float(prior),
                "weight": float(weight),
                "stacking": float(stacked) if np.isfinite(stacked) else None,
                "log_evidence": float(log_z) if np.isfinite(log_z) else None,
                "log_evidence_error": float(error) if np.isfinite(error) else None,
                "sampled": bool(sampled),
            }
            for label, prior, weight, stacked, log_z, error, sampled in rows
        },
    }


def _campaign_parameters(joint: PeakResult | None) -> dict[str, Any]:
    """The shared curve, the discrepancies and the peak tests in the campaign model, under the reference law."""
    if joint is None:
        return {}
    sc, _ = joint.laws[0].posterior.reference
    derived = {key: value for key, value in joint.laws[0].derived.items() if np.isfinite(value).all()}
    shared = {key: value for key, value in derived.items() if value.ndim == 2}
    tests = [
        {
            "name": name,
            "parameters": _parameters({k: v[..., j] for k, v in derived.items() if v.ndim == 3}, "", {}),
        }
        for j, name in enumerate(joint.tests)
    ]
    return {"reference_scruton_number": sc, "parameters": _parameters(shared, "", {}), "tests": tests}


def _cycle_groups(tests: Sequence[TestResult], sampling: Sampling) -> dict[str, xr.Dataset]:
    pointwise, runs = [], []
    for one in tests:
        chain = one.samples.chain[:, ::POINTWISE_THIN]
        flat = one.posterior.pointwise(chain.reshape(-1, chain.shape[-1]))
        pointwise.append(flat.reshape(*chain.shape[:2], -1))
        rng = np.random.default_rng(sampling.seed_of(f"predictive of {one.test.name}"))
        runs.append(free_runs(one.posterior, one.samples.chain, rng))
    standardised = [standardised_innovations(one) for one in tests]
    log_likelihood = np.concatenate(pointwise, axis=-1)
    mean, replicate = (np.concatenate([run[i] for run in runs], axis=-1) for i in (0, 1))
    observed = np.concatenate([one.posterior.data.amplitude for one in tests])
    cycle = np.arange(observed.size)
    dims = ("chain", "draw", "cycle")
    return {
        "log_likelihood": xr.Dataset({"amplitude": (dims, log_likelihood)}).assign_coords(
            chain=np.arange(log_likelihood.shape[0]),
            draw=np.arange(log_likelihood.shape[1]) * POINTWISE_THIN,
            cycle=cycle,
        ),
        "posterior_predictive": xr.Dataset(
            {"amplitude": (dims, replicate[None]), "mean_amplitude": (dims, mean[None])}
        ).assign_coords(chain=[0], draw=np.arange(len(mean)), cycle=cycle),
        "innovations": xr.Dataset({"amplitude": ("cycle", np.concatenate(standardised))}).assign_coords(cycle=cycle),
        "observed_data": xr.Dataset({"amplitude": ("cycle", observed)}).assign_coords(cycle=cycle),
    }


def _trial_constants(one: TrialResult) -> dict[str, FloatArray]:
    a, b, c, d = one.posterior.constants(one.samples.chain)
    sd, rate = one.posterior.residual(one.samples.chain)
    return {"a": a, "b": b, "c": c, "d": d, "residual_sd": sd, "residual_rate": rate}


def _trial_group(trials: Sequence[TrialResult]) -> xr.Dataset:
    constants = [_trial_constants(one) for one in trials]
    group = _dataset(
        {key: np.stack([one[key] for one in constants], axis=-1) for key in constants[0]},
        "record", [one.record.name for one in trials], trials[0].samples.ensemble,
    )  # fmt: skip
    return group.assign(
        origin=("record", [one.posterior.data.time[0] for one in trials]),
        end=("record", [one.posterior.data.time[-1] for one in trials]),
        record_test=("record", [one.test.name for one in trials]),
    )


def _speed_priors(campaign: Campaign, card: ModelCard) -> tuple[dict[str, Prior], tuple[Prior, Prior]]:
    """Priors of the smooth model over wind speeds, and of the discrepancies."""
    motion = campaign.section.motion
    own = {name: card.prior(name, motion) for name in (*SPEED_PRIORS, "speed_shift")}
    return own, (card.prior("discrepancy_amplitude", motion), card.prior("discrepancy_relaxation", motion))


def _sampled(
    rigs: Sequence[RigResult], tests: Sequence[TestResult], joint: PeakResult | None, trials: Sequence[TrialResult]
) -> list[tuple[str, Samples]]:
    """Every sampled posterior by its name."""
    sampled = [(f"rig {one.rig.name}", one.samples) for one in rigs if one.samples]
    sampled += [(f"test {one.test.name}", one.samples) for one in tests]
    sampled += [(f"campaign, {one.label}", one.samples) for one in (joint.laws if joint else ())]
    return sampled + [(f"trial function of {one.record.name}", one.samples) for one in trials]


def _convergence(sampled: Sequence[tuple[str, Samples]]) -> pd.DataFrame:
    rows = []
    for posterior, samples in sampled:
        verdict = samples.convergence
        for i, name in enumerate(samples.names):
            rows.append(
                {
                    "posterior": posterior,
                    "parameter": name,
                    "rhat_nested": verdict.rhat_nested[i],
                    "ess_bulk": verdict.ess_bulk[i],
                    "ess_tail": verdict.ess_tail[i],
                    "tau": verdict.tau[i],
                    "steps": verdict.steps,
                    "acceptance": verdict.acceptance,
                    "stuck": verdict.stuck,
                    "converged": verdict.converged,
                }
            )
    columns = [
        "posterior",
        "parameter",
        "rhat_nested",
        "ess_bulk",
        "ess_tail",
        "tau",
        "steps",
        "acceptance",
        "stuck",
        "converged",
    ]
    return pd.DataFrame(rows, columns=columns).set_index(["posterior", "parameter"])


# Sampled parameters under the names that users meet.
_SAMPLED = {"a_star": "stable_amplitude", "relaxation_rate": "relaxation_ratio", "d": "rate_gap"}


def _parameters(
    values: Mapping[str, FloatArray], posterior: str, convergence: Mapping[Any, Mapping[str, Any]]
) -> dict[str, Any]:
    found = {}
    for name, draws in values.items():
        entry: dict[str, Any] = {
            "median": float(np.median(draws)),
            "mean": float(draws.mean()),
            "sd": float(draws.std()),
            "interval": {
                f"{p:.2f}": [float(x) for x in np.quantile(draws, [0.5 - p / 2, 0.5 + p / 2])] for p in INTERVALS
            },
        }
        row = convergence.get((posterior, _SAMPLED.get(name, name)))
        if row is not None:
            entry |= {column: float(row[column]) for column in ("rhat_nested", "ess_bulk", "ess_tail")}
        found[name] = entry
    return found


def _bands(ringdown: RingDown | None) -> list[dict[str, Any]]:
    """Structural damping by band of amplitude, as the ring-downs show it."""
    if ringdown is None:
        return []
    return [
        {"amplitude": [one.lower, one.upper], "damping_ratio": one.damping_ratio, "sd": one.sd, "plucks": one.plucks}
        for one in ringdown.bands
    ]
