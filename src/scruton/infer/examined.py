"""The model that predicts as `scruton criticise` examines it: the joint posterior of the law with the most weight.

Its draws by test, what they are conditioned on, and what they say of every cycle.  What the model would have done, run
freely, is of every law by its weight, as predictions are.  Tests at other wind speeds than the peak are no part of the
joint posterior: they are examined by their own, under the reference law.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from scruton.arrays import FloatArray, end_to_end
from scruton.infer.free_runs import RUNS, free_runs
from scruton.infer.hierarchy import SHARED, CampaignPosterior
from scruton.infer.joint import SCALES, evenly, mixed
from scruton.infer.models import NOISE, WindPosterior
from scruton.infer.result_schema import EXAMINED_LIKELIHOOD, SCHEMA, dataset, joined
from scruton.infer.results import LawResult, PeakResult, TestResult
from scruton.infer.sampling import Sampling

POINTWISE_THIN = 8  # the pointwise log likelihood is kept for every eighth draw
FACTORS = ("lp_prior", "lp_noise", "lp_still_air", "lp_records")


@dataclass(frozen=True, eq=False)
class Examined:
    """One test in the model that predicts.

    Attributes
    ----------
    name : str
    posterior : WindPosterior
        Of its law.
    chain : (C, D, d) array
        Coordinates of `posterior`, drawn from the model.
    values : mapping
        (C, D) arrays by the names of the tree's group `examined`: every quantity in its own unit, and the logarithms of
        what the posterior of this test is a product of: priors of curve, noise and damping ratio, and records.
    """

    name: str
    posterior: WindPosterior
    chain: FloatArray
    values: dict[str, FloatArray]


def leading(joint: PeakResult) -> LawResult:
    """The law with the most weight in predictions."""
    weight = dict(zip(joint.weights.labels, joint.weights.weight.tolist(), strict=True))
    return max(joint.laws, key=lambda law: weight[law.label])


def _alone(result: TestResult) -> Examined:
    chain = result.samples.chain
    terms = result.posterior.log_prior_terms(end_to_end(chain)).reshape(chain.shape)
    own, total = result.posterior.named(terms), terms.sum(axis=-1)
    noise, still_air = np.sum([own[name] for name in NOISE], axis=0), own["damping_ratio"]
    factors = (total - noise - still_air, noise, still_air, result.samples.log_prob - total)
    values = {**result.derived, **dict(zip(FACTORS, factors, strict=True))}
    return Examined(result.test.name, result.posterior, chain, values)


def _of_law(law: LawResult, names: Sequence[str], shape: tuple[int, ...]) -> dict[str, Examined]:
    """The peak tests in the joint posterior of one law.

    Priors of the card are those of the shared curve, and those that are meant to speak: of the discrepancies and of the
    test's own noise.  What joins a test to the curve is the model's.  The records are those of all tests.
    """
    posterior, samples = law.posterior, law.samples
    flat = end_to_end(samples.chain)
    kept = evenly(len(flat), int(np.prod(shape)))
    u = flat[kept]
    prior = log_prior_of(posterior, u)
    records = samples.log_prob.reshape(-1)[kept] - posterior.log_prior(u)
    found = {}
    for j, (name, (test, v)) in enumerate(zip(names, posterior.winds(u), strict=True)):
        noise = prior["discrepancy"] + prior["noise"][:, j]
        factors = dict(zip(FACTORS, (prior["curve"], noise, prior["damping_ratio"][:, j], records), strict=True))
        values = {
            key: column[..., j].reshape(-1)[kept].reshape(shape)
            for key, column in law.derived.items()
            if column.ndim == 3 and np.isfinite(column).all()
        }
        if posterior.exponent:
            values["law_exponent"] = law.derived["n"].reshape(-1)[kept].reshape(shape)
        values |= {key: factor.reshape(shape) for key, factor in factors.items()}
        found[name] = Examined(name, test.wind, v.reshape(*shape, -1), values)
    return found


def log_prior_of(posterior: CampaignPosterior, u: FloatArray) -> dict[str, FloatArray]:
    """Log densities of the priors that are meant to speak, (S,), or (S, tests) of what every test has of its own.

    What joins a test to the curve is the model's.
    """
    terms = posterior.log_prior_terms(u)
    of, own = posterior.named(terms), [coordinates.of(terms) for coordinates in posterior.own_coordinates]
    curve = (*SHARED[:2], *(["law_exponent"] if posterior.exponent else ()))
    return {
        "curve": np.sum([of[name] for name in curve], axis=0),
        "discrepancy": np.sum([of[name] for name in SCALES], axis=0),
        "noise": np.stack([np.sum([one[name] for name in NOISE], axis=0) for one in own], axis=-1),
        "damping_ratio": np.stack([one["damping_ratio"] for one in own], axis=-1),
    }


def examined_groups(
    tests: Sequence[TestResult], joint: PeakResult, ensemble: np.ndarray, sampling: Sampling
) -> dict[str, xr.Dataset]:
    """Groups of the tree: `examined`, and what the same draws say of every cycle."""
    law, runs = leading(joint), _runs(joint)
    shape = tests[0].samples.log_prob.shape  # all have as many chains and draws
    alone = {result.test.name: _alone(result) for result in tests if result.test.name not in joint.tests}
    by_law = {
        one.label: alone | _of_law(one, joint.tests, shape) for one in joint.laws if one is law or one.label in runs
    }
    parts = [by_law[law.label][result.test.name] for result in tests]
    known = [variable.name for variable in SCHEMA["examined"]]
    names = [name for name in known if all(name in part.values for part in parts)]
    group = dataset(
        "examined", {name: np.stack([part.values[name] for part in parts], axis=-1) for name in names},
        test=[part.name for part in parts], ensemble=ensemble,
    )  # fmt: skip
    group.attrs["law"], group.attrs["n"] = law.label, np.nan if law.posterior.exponent else law.posterior.n
    group.attrs["peaks"] = len(joint.tests)
    if len(runs) > 1:
        group.attrs["runs"] = ", ".join(f"{label} {100.0 * count / RUNS:.0f} %" for label, count in runs.items())
    streams = {label: "" if label == law.label else f", {label}" for label in runs}
    free = [
        _freely([(by_law[label][part.name], count, sampling.generator(f"predictive of {part.name}{streams[label]}"))
                 for label, count in runs.items()])
        for part in parts if part.posterior.data.size
    ]  # fmt: skip
    return {"examined": group, **_by_cycle(parts, free, ensemble)}


def _runs(joint: PeakResult) -> dict[str, int]:
    """How many of all free runs are of each law: as many as its weight says; laws without any are left out."""
    weight = dict(zip(joint.weights.labels, joint.weights.weight.tolist(), strict=True))
    of = mixed(np.array([weight[law.label] for law in joint.laws]), RUNS)
    return {law.label: count for k, law in enumerate(joint.laws) if (count := int(np.count_nonzero(of == k)))}


def _freely(of_laws: Iterable[tuple[Examined, int, np.random.Generator]]) -> tuple[FloatArray, FloatArray]:
    """So many free runs of one test under each law, (RUNS, N) in all: without noise, and with it."""
    each = [free_runs(one.posterior, one.chain, rng, count) for one, count, rng in of_laws]
    mean, replicate = (np.concatenate(runs) for runs in zip(*each, strict=True))
    return mean, replicate


def _by_cycle(
    parts: Sequence[Examined], free: Sequence[tuple[FloatArray, FloatArray]], ensemble: np.ndarray
) -> dict[str, xr.Dataset]:
    """Pointwise likelihood, free runs and innovations of every cycle; nothing where no test has any."""
    steady = np.stack([_log_steady(part, ensemble) for part in parts], axis=-1)
    names = [part.name for part in parts]
    parts = [part for part in parts if part.posterior.data.size]
    if not parts:
        return {}
    pointwise = []
    for part in parts:
        chain = joined(part.chain, ensemble)[:, ::POINTWISE_THIN]
        flat = part.posterior.pointwise(end_to_end(chain))
        pointwise.append(flat.reshape(*chain.shape[:2], -1))
    mean, replicate = (np.concatenate(run, axis=-1)[None] for run in zip(*free, strict=True))
    observed = np.concatenate([part.posterior.data.amplitude for part in parts])
    standardised = np.concatenate([part.posterior.standardised(part.chain) for part in parts])
    amplitude = np.concatenate(pointwise, axis=-1)
    kept = np.arange(amplitude.shape[1]) * POINTWISE_THIN
    likelihood = {"amplitude": amplitude, "steady": steady}
    return {
        EXAMINED_LIKELIHOOD: dataset(EXAMINED_LIKELIHOOD, likelihood, draw=kept, test=names),
        "posterior_predictive": dataset("posterior_predictive", {"amplitude": replicate, "mean_amplitude": mean}),
        "innovations": dataset("innovations", {"amplitude": standardised}),
        "observed_data": dataset("observed_data", {"amplitude": observed}),
    }


def _log_steady(part: Examined, ensemble: np.ndarray) -> FloatArray:
    """Log likelihood of a test's steady amplitudes, at the draws of the pointwise one."""
    chain = joined(part.chain, ensemble)[:, ::POINTWISE_THIN]
    return part.posterior.log_steady(end_to_end(chain)).reshape(chain.shape[:2])
