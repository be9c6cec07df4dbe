"""The departure from the law as the model that predicts has it: group `departure`, for figures of damping."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from scruton.arrays import FloatArray, IntArray, end_to_end
from scruton.dynamics.departure import COLUMNS
from scruton.infer.joint import evenly, mixed
from scruton.infer.models import WindPosterior
from scruton.infer.result_schema import dataset, joined
from scruton.infer.results import PeakResult, Sampled
from scruton.infer.sampling import Sampling
from scruton.stats.samples import Samples

SAMPLES = 400
POINTS = 40  # of xi_s(A), evenly in ln A


def departure_group(sampled: Sampled, sampling: Sampling) -> xr.Dataset:
    """Columns of the departure, given the records, for some of the draws that are printed of every test.

    Of a peak test those are of the joint posterior, laws mixed by their weights as `joint_draws` mixes them, and what
    the departures of all of them share is beside them; of another test those of its own.
    """
    names = [result.test.name for result in sampled.tests]
    draw = np.zeros((SAMPLES, len(names)), dtype=int)
    columns, ratio = np.zeros((SAMPLES, len(names), COLUMNS)), np.ones((SAMPLES, len(names)))
    shared = np.full((SAMPLES, COLUMNS), np.nan)
    rngs = [sampling.generator(f"printed departure of {name}") for name in names]
    for k, result in enumerate(sampled.tests):
        draw[:, k] = evenly(result.samples.log_prob.size, SAMPLES)
        if result.test.name not in sampled.peaks and result.posterior.data.size:
            v = _coordinates(result.samples, draw[:, k])
            columns[:, k], ratio[:, k] = result.posterior.departures(v, rngs[k]), result.posterior.rate_ratio(v)
    for name, rows, places, wind, v in _of_peaks(sampled.joint) if sampled.joint else ():
        k = names.index(name)
        draw[rows, k] = places
        if wind.data.size:
            columns[rows, k], ratio[rows, k] = wind.departures(v, rngs[k]), wind.rate_ratio(v)
        if wind.shares:
            shared[rows] = wind.shared_columns(v)
    values = {"draw_number": draw, "column": columns}
    if np.isfinite(shared).all():
        values["shared_column"] = shared
    varying = [result.posterior.varying for result in sampled.tests]
    if any(varying):
        none = np.full((2, POINTS), np.nan)
        curves = np.stack([curve.sampled(POINTS) if curve else none for curve in varying], axis=1)
        values |= {"rate_ratio": ratio, "structural_amplitude": curves[0], "structural_damping": curves[1]}
    return dataset("departure", values, test=names)


def _of_peaks(joint: PeakResult) -> Iterator[tuple[str, IntArray, IntArray, WindPosterior, FloatArray]]:
    """By law and test: its name, which samples the law gives, their places among the draws, likelihood, coordinates."""
    of = joint.weights
    weights = np.array([of.weight[of.labels.index(law.label)] for law in joint.laws])
    size = joint.laws[0].samples.log_prob.size
    places = evenly(size, SAMPLES)
    law_of = mixed(weights / weights.sum(), size)[places]
    for k, law in enumerate(joint.laws):
        rows = np.flatnonzero(law_of == k)
        if rows.size:
            for test, v in law.posterior.winds(_coordinates(law.samples, places[rows])):
                yield test.name, rows, places[rows], test.wind, v


def _coordinates(samples: Samples, places: IntArray) -> FloatArray:
    """Sampled coordinates of draws in the order of the tree, (places, d)."""
    chain = joined(samples.chain, samples.ensemble)
    return np.asarray(end_to_end(chain)[places])
