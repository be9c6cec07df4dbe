"""Groups of the tree that the priors alone give: of every test in wind, and of its records."""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from scruton.arrays import FloatArray
from scruton.campaign.schema import Section
from scruton.dynamics.cycles import EnvelopeData
from scruton.infer.derived import derive
from scruton.infer.free_runs import RUNS
from scruton.infer.replication import prior_replicates
from scruton.infer.result_schema import dataset
from scruton.infer.results import TestResult
from scruton.infer.sampling import Sampling

PRIOR_DRAWS = 1000
EVERY = PRIOR_DRAWS // RUNS  # the records that a prior expects are drawn for every so many of its draws


def prior_groups(
    section: Section, tests: Sequence[TestResult], sampling: Sampling, *, thorough: bool
) -> dict[str, xr.Dataset]:
    """Group `prior`, by the names of the priors and of the posterior; where it is `thorough`, what records it expects.

    What the laboratory states of mass, air and wind is drawn anew, as for the posterior.
    """
    rng = sampling.generator("prior")
    coordinates = [result.posterior.prior_draws(rng, PRIOR_DRAWS) for result in tests]
    draws = [
        result.posterior.natural(u) | _derived(section, result, u, sampling)
        for result, u in zip(tests, coordinates, strict=True)
    ]
    stacked = {key: np.stack([values[key] for values in draws], axis=-1)[None] for key in draws[0]}
    groups = {"prior": dataset("prior", stacked, test=[result.test.name for result in tests])}
    if thorough and any(result.posterior.data.size for result in tests):
        expected = []
        for result, u, values in zip(tests, coordinates, draws, strict=True):
            law = {"n": result.posterior.exponents(u[::EVERY])}
            chosen = {name: column[::EVERY] for name, column in values.items()} | law
            of_records = sampling.generator(f"prior predictive of {result.test.name}")
            expected.append(replicates(result.posterior.data, chosen, of_records))
        groups["prior_predictive"] = dataset(
            "prior_predictive", {"amplitude": np.concatenate(expected, axis=1)[None].astype(np.float32)},
            draw=np.arange(PRIOR_DRAWS)[::EVERY], **by_record([result.posterior.data for result in tests]),
        )  # fmt: skip
    return groups


def replicates(data: EnvelopeData, prior: Mapping[str, FloatArray], rng: np.random.Generator) -> FloatArray:
    """Records of one test that draws of its prior expect, (R, N), each from its first observed amplitude on."""
    expected = np.empty((len(prior["n"]), data.size))
    for record in dict.fromkeys(data.record.tolist()):
        rows = data.record == record
        first = float(data.amplitude[rows][0])
        expected[:, rows] = prior_replicates(data.time[rows], data.standard_error[rows], first, dict(prior), rng)
    return expected


def by_record(data: Sequence[EnvelopeData]) -> dict[str, tuple[str, np.ndarray]]:
    """Coordinate `record` along the cycles, to choose or to group them by."""
    return {"record": ("cycle", np.concatenate([envelope.record for envelope in data]).astype(str))}


def _derived(section: Section, result: TestResult, u: FloatArray, sampling: Sampling) -> dict[str, FloatArray]:
    rng = sampling.generator(f"prior of the setting of {result.test.name}")
    assert result.rig.mass is not None, "the loader refuses a test whose rig has no mass"
    quantities = {
        "mass": result.rig.mass, "frequency": result.rig.frequency, "air_density": result.test.air_density,
        "wind_speed": result.test.wind_speed,
    }  # fmt: skip
    stated = {name: quantity.draw(rng, u.shape[:-1]) for name, quantity in quantities.items()}
    return dict(derive(section, stated, result.posterior, u, result.wind_frequency))
