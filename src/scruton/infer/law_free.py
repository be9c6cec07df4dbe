"""The Griffin curve that the damping measured in each test gives, without a law between: group `law_free`."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray, end_to_end, thin
from scruton.dynamics.departure import relative_drift
from scruton.dynamics.laws import index_of
from scruton.infer.result_schema import dataset
from scruton.infer.results import TestResult
from scruton.infer.sampling import Sampling

if TYPE_CHECKING:
    import xarray as xr

SAMPLES, LEVELS = 400, 40


def law_free_group(
    tests: Sequence[TestResult], reach: Sequence[tuple[float, float]], sampling: Sampling
) -> "xr.Dataset":
    r"""Scruton numbers at which the amplitudes that a test's transients went through would be stable.

    Parameters
    ----------
    tests : sequence of TestResult
    reach : sequence of (float, float)
        Lowest and highest amplitude of their transients, NaN where there is none.
    sampling : Sampling
        For its seed.

    Notes
    -----
    What a transient grows or decays by at an amplitude is the damping that has to be added, or taken away, for it to
    stand still there (the paper's own idea, section 3.1):

    .. math:: Sc(A) = Sc + Sc_\lambda\, x(A/a^*)\, (1 + g(A))

    with the departure g from the law as the records tell it (`scruton.dynamics.departure`).  Where xi_s varies with
    amplitude Sc_lambda is that of the whole drift, and what xi_s(A) exceeds xi_s(a*) by is added: the damping of a
    setting elsewhere on the curve is a constant.
    """
    amplitude = np.full((len(tests), LEVELS), np.nan)
    numbers = np.full((SAMPLES, len(tests), LEVELS), np.nan)
    for k, (result, (low, high)) in enumerate(zip(tests, reach, strict=True)):
        stable = float(np.median(result.derived["a_star"]))
        if not result.posterior.data.size or not low < high:
            continue
        amplitude[k] = np.geomspace(min(low, 0.95 * stable), max(high, 1.05 * stable), LEVELS)
        rng = sampling.generator(f"departure of {result.test.name}")
        numbers[:, k] = _numbers(result, amplitude[k], rng)
    return dataset(
        "law_free", {"level_amplitude": amplitude, "level_scruton_number": numbers},
        test=[result.test.name for result in tests],
    )  # fmt: skip


def _numbers(result: TestResult, amplitude: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Draws of the Scruton numbers at which amplitudes (G,) are stable, (SAMPLES, G)."""
    chain = end_to_end(result.samples.chain)
    kept = np.resize(thin(len(chain), SAMPLES), SAMPLES)
    theta = result.posterior.departures(chain[kept], rng)
    sc, relaxation, a_star = (
        result.derived[name].reshape(-1)[kept, None]
        for name in ("scruton_number", "relaxation_scruton_number", "a_star")
    )
    ratio = amplitude / a_star
    index = index_of(np.log(ratio), result.posterior.exponents(chain[kept])[:, None])
    number = relaxation * index * relative_drift(ratio, theta[:, None, :])
    if varying := result.posterior.varying:
        factor = result.derived["mass_damping_factor"].reshape(-1)[kept, None]
        number *= result.posterior.rate_ratio(chain[kept])[:, None]
        number += factor * (varying.at(np.log(amplitude)) - varying.at(np.log(a_star)))
    return np.asarray(sc + number)
