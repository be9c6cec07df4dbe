"""How far predictions follow what the model card says of tau, of kappa and of the laws, beside what records say."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.griffin.posterior import draws_of, motion_of, peak_names
from scruton.griffin.predict import predictive_draws
from scruton.infer.joint import SCALES, law_weights, mixed
from scruton.infer.sensitivity import Band, PredictionSensitivity, beyond_chance, scaled_weights
from scruton.infer.store import stored_inputs
from scruton.stats.convergence import by_chain
from scruton.stats.priors import Prior
from scruton.stats.ranks import FEWEST_DRAWS, effective_draws_of_mean

if TYPE_CHECKING:
    import xarray as xr

    from scruton.infer.criticism import Criticism

Point = tuple[str, float]
LAWS = "law weights"
_FACTORS = (0.5, 2.0)
_BAND = (0.5, 0.05, 0.95)


def points_of(tree: "xr.DataTree", design: Sequence[float] = ()) -> list[Point]:
    """Where predictions are examined: at the design, else between the tests and at twice the largest tested Sc."""
    if design:
        return [("design", float(sc)) for sc in design]
    tested = sorted(float(np.median(draws_of(tree, "scruton_number", name))) for name in peak_names(tree))
    between = [("between tests", float(np.sqrt(low * high))) for low, high in pairwise(tested) if high > 1.05 * low]
    widest = max(between, key=lambda point: _gap(tested, point[1]), default=None)
    return [*([widest] if widest else []), ("twice the largest tested", 2.0 * tested[-1])]


def _gap(tested: Sequence[float], sc: float) -> float:
    """Ratio of the tested Scruton numbers on both sides."""
    return min(high for high in tested if high > sc) / max(low for low in tested if low < sc)


def prediction_sensitivity(
    tree: "xr.DataTree", points: Sequence[Point], *, seed: int = 0
) -> tuple[PredictionSensitivity, ...]:
    """Sensitivity of the stable amplitude at every point to the priors of tau and kappa and to the weights of the laws.

    Parameters
    ----------
    tree : xarray.DataTree
        Of a fit that holds its model card.
    points : sequence of (str, float)
        As of `points_of`.
    seed : int
        As of `predict`.

    Notes
    -----
    Draws are reweighted: by the prior density to a power (Kallioinen et al., 2024), and by the density of the prior
    whose median is halved or doubled over that of the card's.  Where several laws have weight, these weights are raised
    to a power, and the odds of the law with the most are halved and doubled.
    """
    labels, weights = law_weights(tree)
    group = tree["campaign_posterior"].to_dataset()
    draw = np.arange(group["n"].isel(law=0).size)
    law = mixed(weights, draw.size)
    if "effect" in tree:  # the curve with an effect is the reference law's alone
        law, labels = np.zeros_like(law), labels[:1]
    sc = np.array([number for _, number in points])
    used = np.unique(law)
    draws = np.empty((law.size, sc.size))
    for k in used:
        rows = law == k
        draws[rows] = predictive_draws(_of_law(tree, labels[k]), sc, seed=seed)[rows]
    sources = []
    card = stored_inputs(tree)[1]
    for name, sign in SCALES.items():
        prior = card.prior(name, motion_of(tree))
        log = np.log(group[name].to_numpy().reshape(len(weights), -1)[law, draw])
        moved = [_moved(prior, log, factor) for factor in _FACTORS]
        sources.append((sign, prior.log_density(log), moved))
    if used.size > 1:
        leading = law == np.argmax(weights)
        moved = [np.where(leading, np.log(factor), 0.0) for factor in _FACTORS]
        sources.append((LAWS, np.log(weights[law]), moved))
    rows = []
    for j, (where, number) in enumerate(points):
        own = draws[:, j]
        finite = np.where(np.isfinite(own), own, np.nan)
        # no distance is measured to infinity
        bounded = np.minimum(own, 10.0 * np.nanmax(finite) if np.isfinite(finite).any() else 1.0)
        at, errors = weighted_band(own, np.zeros(len(own)), group.sizes["chain"])
        for source, log_density, moved in sources:
            distance = beyond_chance(bounded, scaled_weights(log_density, tail=source != LAWS))
            (halved, of_halved), (doubled, of_doubled) = (
                weighted_band(own, log_weight, group.sizes["chain"]) for log_weight in moved
            )
            rows.append(
                PredictionSensitivity(
                    where, number, source, distance, *at, halved, doubled, errors, of_halved, of_doubled
                )
            )
    return tuple(rows)


def criticised(
    tree: "xr.DataTree", summary: Mapping[str, Any], design: Sequence[float] = (), *, seed: int = 0
) -> "Criticism":
    """Run every check of `criticise_tree`; of a fit that predicts with its sensitivity at `points_of` the design."""
    from scruton.infer.criticism import criticise_tree

    found = criticise_tree(tree, summary, seed=seed)
    if "campaign_posterior" not in tree:
        return found
    return replace(found, predictions=prediction_sensitivity(tree, points_of(tree, design), seed=seed))


def _moved(prior: Prior, log: FloatArray, factor: float) -> FloatArray:
    """Log density of the prior whose median is `factor` times the card's, over the card's, at logarithms (S,)."""
    if prior.family == "lognormal":
        other = replace(prior, first=prior.first * factor)
    else:
        other = replace(prior, first=prior.first * factor, second=prior.second * factor)
    with np.errstate(invalid="ignore"):
        return np.asarray(other.log_density(log) - prior.log_density(log))


def _of_law(tree: "xr.DataTree", label: str) -> "xr.DataTree":
    """The same tree with all weight on one law."""
    import xarray as xr

    alone = tree.copy()
    table = tree["laws"].to_dataset()
    alone["laws"] = xr.DataTree(table.assign(weight=(table["law"] == label).astype(float)))
    return alone


def weighted_band(draws: FloatArray, log_weights: FloatArray, chains: int) -> tuple[Band, Band]:
    """Median, 5 and 95 % points of weighted draws, and the Monte Carlo standard error of each.

    Draws, (S,) chain after chain, may be infinite.  What the share of the weight below a quantile is uncertain by moves
    the quantile; the error is NaN where a step from it leads to infinity, and of chains that are too short to tell.
    """
    weights = np.exp(log_weights - log_weights.max())
    weights /= weights.mean()
    order = np.argsort(draws)
    ordered, share = draws[order], np.cumsum(weights[order])
    share /= share[-1]

    def quantiles(probabilities: Sequence[float]) -> list[float]:
        found: list[float] = ordered[np.minimum(np.searchsorted(share, probabilities), len(draws) - 1)].tolist()
        return found

    def error(probability: float, quantile: float) -> float:
        if ordered[0] == ordered[-1] < np.inf:
            return 0.0
        told = by_chain(weights * ((draws <= quantile) - probability), chains)
        if told.shape[1] < FEWEST_DRAWS:
            return np.nan
        sd = float(told.std() / np.sqrt(effective_draws_of_mean(told)))
        low, high = quantiles((max(probability - sd, 0.0), probability + sd))
        return 0.5 * (high - low) if np.isfinite([sd, high]).all() else np.nan

    median, low, high = quantiles(_BAND)
    of_median, of_low, of_high = (error(p, at) for p, at in zip(_BAND, (median, low, high), strict=True))
    return (median, low, high), (of_median, of_low, of_high)
