"""The campaign model under the law with the most weight, as ArviZ reads a model: every group of the same draws.

Its tests are the peak tests.  Of an observed cycle the predictive is one step ahead, given the cycles before it, as its
log likelihood is: only so do they go together in leave-one-out checks.  Free runs are in the tree's own group
`posterior_predictive`.  Quantities that are one number (n of a law that is given) are left out: they have no R-hat.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from scruton.arrays import FloatArray, end_to_end
from scruton.infer.examined import leading, log_prior_of
from scruton.infer.free_runs import RUNS
from scruton.infer.peak_test import PeakTest
from scruton.infer.peaks import derive
from scruton.infer.result_schema import MODEL, SCHEMA, dataset, joined
from scruton.infer.results import Sampled
from scruton.infer.sampling import Sampling
from scruton.infer.tree_prior import by_record, replicates
from scruton.stats.samples import Samples

DRAWS = 2048  # of all chains together: what is kept by cycle is large; of half of them R-hat may be 1.01 by chance


def model_groups(sampled: Sampled, sampling: Sampling) -> dict[str, xr.Dataset]:
    """Groups of the tree below `campaign_model`, by their paths."""
    assert sampled.joint is not None, "a campaign without tests in wind has no such model"
    law, names = leading(sampled.joint), sampled.joint.tests
    posterior, samples = law.posterior, law.samples
    results = [result for name in names for result in sampled.tests if result.test.name == name]
    log_prob, chain = (joined(draws, samples.ensemble) for draws in (samples.log_prob, samples.chain))
    kept = np.arange(0, chain.shape[1], max(1, chain.shape[0] * chain.shape[1] // DRAWS))
    chain, log_prob = chain[:, kept], log_prob[:, kept]
    shape, flat = log_prob.shape, end_to_end(chain)

    def group(name: str, values: dict[str, Any], **labels: Any) -> xr.Dataset:
        of_tests = any("test" in one.dims for one in SCHEMA[f"{MODEL}/{name}"] if one.name in values)
        by_test = {"test": list(names)} if of_tests else {}
        return dataset(f"{MODEL}/{name}", values, **({"draw": kept} | by_test | labels))

    def known(values: dict[str, FloatArray]) -> dict[str, FloatArray]:
        return {name: value for name, value in values.items() if np.isfinite(value).all() and np.ptp(value) > 0.0}

    rng = sampling.generator("prior of the campaign model")
    prior = derive(sampled.campaign, results, posterior, posterior.prior_draws(rng, RUNS)[None])
    groups = {
        "": xr.Dataset(attrs={"law": law.label}),
        "posterior": group("posterior", known(derive(sampled.campaign, results, posterior, chain))),
        "prior": group("prior", known(prior), draw=np.arange(RUNS)),
        "sample_stats": group("sample_stats", {"lp": log_prob} | diagnostics(samples), parameter=list(samples.names)),
        "log_prior": group(
            "log_prior",
            {name: each.reshape(*shape, *each.shape[1:]) for name, each in log_prior_of(posterior, flat).items()},
        ),
    }
    winds = [(test, v) for test, v in posterior.winds(flat)]
    steady = np.stack([test.wind.log_steady(v).reshape(shape) for test, v in winds], axis=-1)
    likelihood = {"steady": steady}
    winds = [(test, v) for test, v in winds if test.wind.data.size]
    if winds:
        data, cycles = [test.wind.data for test, _ in winds], by_record([test.wind.data for test, _ in winds])
        likelihood["amplitude"] = _by_cycle((test.wind.pointwise(v) for test, v in winds), shape)
        ahead = _by_cycle((one_step(test, v, sampling) for test, v in winds), shape)
        expected = _by_cycle(
            (replicates(test.wind.data, _prior_of(prior, list(names).index(test.name)), rng) for test, _ in winds),
            (1, RUNS),
        )
        groups |= {
            "posterior_predictive": group("posterior_predictive", {"amplitude": ahead}, **cycles),
            "prior_predictive": group("prior_predictive", {"amplitude": expected}, draw=np.arange(RUNS), **cycles),
            "observed_data": dataset(
                f"{MODEL}/observed_data", {"amplitude": np.concatenate([one.amplitude for one in data])}, **cycles
            ),
        }
    groups["log_likelihood"] = group("log_likelihood", likelihood)
    return {f"{MODEL}/{name}".rstrip("/"): one for name, one in groups.items()}


def one_step(test: PeakTest, v: FloatArray, sampling: Sampling) -> FloatArray:
    """Amplitudes of every cycle given those observed before it, one for each row of the coordinates, (W, N)."""
    rng = sampling.generator(f"one step ahead in {test.name}")
    innovation, variance = test.wind.innovations(v)  # (N, W)
    centre = test.wind.data.amplitude[:, None] - innovation
    return np.asarray((centre + np.sqrt(variance) * rng.standard_normal(variance.shape)).T)


def diagnostics(samples: Samples) -> dict[str, Any]:
    """What the sampler says of itself, by the names of the group `sample_stats`."""
    verdict = samples.convergence
    return {
        "acceptance_rate": verdict.acceptance,
        "steps": verdict.steps,
        "stuck_walkers": verdict.stuck,
        "converged": verdict.converged,
        "autocorrelation_time": verdict.tau,
        "ess_bulk": verdict.ess_bulk,
        "ess_tail": verdict.ess_tail,
        "rhat_nested": verdict.rhat_nested,
    }


def _by_cycle(parts: Iterable[FloatArray], shape: tuple[int, ...]) -> np.ndarray:
    """Of all tests end to end, (chains, draws, N), in single precision, which holds one test at a time in double."""
    return np.concatenate([part.astype(np.float32) for part in parts], axis=1).reshape(*shape, -1)


def _prior_of(prior: dict[str, FloatArray], j: int) -> dict[str, FloatArray]:
    """Draws of the prior for one test, (R,) each."""
    return {name: value[0, :, j] if value.ndim == 3 else value[0] for name, value in prior.items()}
