"""Rank statistics of chains: effective draws of the bulk and of the tails, and nested R-hat; arviz's numbers.

The normal scores that both the bulk and R-hat want are taken once, and arviz, which takes half a second to import,
is left out.
"""

import numpy as np
from scipy.special import ndtri

from scruton.arrays import FloatArray

FEWEST_DRAWS = 4  # a chain, for any of these
TAILS = (0.05, 0.95)
_BLOM = 0.375  # offset of the ranks


def rank_statistics(chain: FloatArray, ensembles: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Effective draws of the bulk, effective draws of the tails, and nested R-hat of every parameter, (d,) each.

    Parameters
    ----------
    chain : (chains, draws, d) array
        Chains of one ensemble are neighbours.
    ensembles : int

    Returns
    -------
    tuple of (d,) arrays
        NaN where there are fewer than four draws a chain; R-hat also of what is the same in every draw.

    Notes
    -----
    Vehtari et al., Bayesian Analysis 16, 667 (2021); nested R-hat by Margossian et al., Bayesian Analysis (2024).
    """
    bulk, tail, rhat = np.full((3, chain.shape[-1]), np.nan)
    if chain.shape[1] >= FEWEST_DRAWS:
        for i in np.flatnonzero(~np.isnan(chain).any(axis=(0, 1))):
            x = np.ascontiguousarray(chain[..., i])
            halves = _halves(x)
            scores = _normal_scores(halves)
            folded = _normal_scores(np.abs(halves - np.median(halves)))
            bulk[i] = _effective(scores)
            tail[i] = min(_effective(_halves((x <= q).astype(float))) for q in np.quantile(x, TAILS))
            rhat[i] = max(_nested_rhat(scores, ensembles), _nested_rhat(folded, ensembles))
    return bulk, tail, rhat


def effective_draws_of_mean(draws: FloatArray) -> float:
    """Effective number of draws, (chains, draws), for their mean, every chain split into its halves."""
    return _effective(_halves(draws))


def _halves(x: FloatArray) -> FloatArray:
    """First and second halves of chains (chains, draws), without what is in the middle of an odd number."""
    half = x.shape[1] // 2
    return np.concatenate([x[:, :half], x[:, -half:]])


def _normal_scores(x: FloatArray) -> FloatArray:
    """Normal quantiles of the ranks among all values; ties share their mean rank."""
    flat = x.ravel()
    order = np.argsort(flat)
    ordered = flat[order]
    first = np.flatnonzero(np.r_[True, ordered[1:] != ordered[:-1]])  # of every run of ties
    count = np.diff(np.r_[first, flat.size])
    score = ndtri((first + 0.5 * (count + 1.0) - _BLOM) / (flat.size - 2.0 * _BLOM + 1.0))
    scores = np.empty(flat.size)
    scores[order] = np.repeat(score, count)
    return scores.reshape(x.shape)


def _nested_rhat(x: FloatArray, ensembles: int) -> float:
    """Nested R-hat of half-chains, first halves before second ones."""
    half_chains = x.reshape(2, ensembles, -1, x.shape[1])
    means = half_chains.mean(axis=-1)
    within = half_chains.var(axis=-1, ddof=1).mean(axis=(0, 2))
    within += means.swapaxes(0, 1).reshape(ensembles, -1).var(axis=1, ddof=1)
    with np.errstate(all="ignore"):
        return float(np.sqrt(1.0 + means.mean(axis=(0, 2)).var(ddof=1) / within.mean()))


def _effective(x: FloatArray) -> float:
    """Effective number of draws, (chains, draws), by Geyer's initial monotone sequence, as arviz has it."""
    if np.ptp(x) < np.finfo(float).resolution:
        return float(x.size)
    length = x.shape[1]
    means = x.mean(axis=1)
    transform = np.fft.rfft(x - means[:, None], 1 << (2 * length - 1).bit_length(), axis=1)
    power = np.square(transform.real) + np.square(transform.imag)
    covariance = np.fft.irfft(power.mean(axis=0))[:length] / length
    within = covariance[0] * length / (length - 1.0)
    rho = 1.0 - (within - covariance) / (covariance[0] + means.var(ddof=1))
    rho[0] = 1.0
    last = max(0, (length - 3) // 2)  # the pair that the sum ends with: the first that is not positive
    pairs = rho[: 2 * last + 2].reshape(-1, 2).sum(axis=1)
    negative = np.flatnonzero(pairs <= 0.0)
    last = int(negative[0]) if negative.size else last
    rest = rho[2 * last] if pairs[last] >= 0.0 else max(rho[2 * last], 0.0)
    tau = 2.0 * np.minimum.accumulate(pairs[:last]).sum() - 1.0 + rest
    return float(x.size / max(tau, 1.0 / np.log10(x.size)))
