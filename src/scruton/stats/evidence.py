r"""The evidence of a model: the integral of likelihood times prior, by bridge sampling or importance sampling.

Both compare the posterior, known up to its integral Z, with a Student-t g whose integral is one.  Bridge sampling
(Meng and Wong, Statistica Sinica 6, 1996) has draws from each and solves

.. math:: \sum_{u \sim g} \frac{N_p\,p(u)}{N_p\,p(u) + N_g Z g(u)} =
   \sum_{u \sim p/Z} \frac{N_g Z g(u)}{N_p\,p(u) + N_g Z g(u)}

for Z, every term of which lies between 0 and 1, so that no draw can dominate.  Its relative mean-squared error is
that of Fruehwirth-Schnatter (Econometrics Journal 7, 2004), with the effective number of the correlated posterior
draws.  Importance sampling needs draws from g alone; g adapts to the posterior in a few rounds.

`Posterior.log_prob` is cut to the model's joint constraint, the prior is not: its mass within the constraint is found
by drawing from the prior, and divides both.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf, log, nan, sqrt

import numpy as np
from scipy.optimize import brentq
from scipy.special import expit, logsumexp

from scruton.arrays import FloatArray, end_to_end
from scruton.stats.optimum import find_optimum
from scruton.stats.pareto import tail_shape
from scruton.stats.posterior import Posterior
from scruton.stats.ranks import FEWEST_DRAWS, effective_draws_of_mean
from scruton.stats.samples import Samples
from scruton.stats.student_t import StudentT, fit_student_t
from scruton.stats.thresholds import (
    DRAWS_A_DIMENSION,
    GOOD_PARETO_K,
    GOOD_SIZE,
    GOOD_WIDENING,
    MORE_ROUNDS,
    PRIOR_MASS_ERROR,
)

Halves = tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]

MASS_BATCH, MOST_MASS_DRAWS = 8192, 2**18  # draws of the prior at a time, and at most
PROBES = 24  # along every half-axis of a starting proposal
_SPAWN = 0xE71DE5CE  # sets the streams of this module apart from others of the same seed


@dataclass(frozen=True, eq=False)
class Evidence:
    """The logarithm of a model's evidence.

    Attributes
    ----------
    log_z : float
        Natural logarithm of the integral of likelihood times prior, the prior normalised within its constraint.
    error : float
        Standard error of `log_z`, that of the prior mass included.
    log_prior_mass : float
        Logarithm of the prior probability of the model's joint constraint; 0 where there is none.
    effective_size : float
        Independent draws that the posterior draws, or the weighted draws, are worth.
    overlap : float
        How alike posterior and proposal are, from 0 (disjoint) to 1 (the same): by bridge sampling the integral of
        the harmonic mean of their densities, by importance sampling the effective size a draw.
    pareto_k : float
        Shape of the tail of the importance weights (Vehtari et al., JMLR 25, 2024); NaN by bridge sampling, whose
        terms are bounded.
    widening : float
        Standard deviation of the weighted draws over that of their proposal, along the axis where it is largest and
        less what chance does; NaN by bridge sampling.  A proposal narrower than the posterior sees its own
        surroundings only, where all weights look well.
    """

    log_z: float
    error: float
    log_prior_mass: float
    effective_size: float
    overlap: float
    pareto_k: float = nan
    widening: float = nan

    @property
    def reliable(self) -> bool:
        """Whether the error can be believed: enough independent draws, light tails, a proposal wide enough."""
        fault = self.pareto_k > GOOD_PARETO_K or self.widening > GOOD_WIDENING
        return bool(self.effective_size >= GOOD_SIZE and not fault and np.isfinite(self.log_z))


def log_evidence(posterior: Posterior, samples: Samples, seed: np.random.SeedSequence, draws: int = 4096) -> Evidence:
    """Evidence from draws of the posterior, by bridge sampling.

    The proposal is fitted to one half of the draws and bridged to the other, then the halves change places, and the
    mean of both is the result: draws that a proposal was fitted to look more like it than the posterior does.  Halves
    share no ensemble where there are two or more.

    Parameters
    ----------
    samples : Samples
        Draws of this posterior, with `log_prob` as it gives them.
    seed : SeedSequence
        The only source of randomness; it is not advanced.
    draws : int
        Draws of the proposals, both together.

    Raises
    ------
    ValueError
        If the draws fill no volume, are fewer than four, or nothing of the prior lies within the constraint.
    """
    bridging, mass = _streams(seed, 2)
    chain, log_prob = samples.chain, samples.log_prob
    if log_prob.size < 4:
        raise ValueError(f"{log_prob.size} posterior draws are too few for an evidence")
    if len(chain) == 1:  # by time
        half = chain.shape[1] // 2
        halves = (chain[:, :half], log_prob[:, :half]), (chain[:, half:], log_prob[:, half:])
    else:  # by ensemble, or by chain where there is one ensemble
        _, label = np.unique(samples.ensemble, return_inverse=True)
        first = (label if label.max() > 0 else np.arange(len(chain))) % 2 == 0
        halves = (chain[first], log_prob[first]), (chain[~first], log_prob[~first])
    bridged = bridge_halves(posterior.log_prob, halves, np.random.RandomState(np.random.MT19937(bridging)), draws)
    log_mass, mass_error = log_prior_mass(posterior, np.random.default_rng(mass))
    error = float(np.hypot(bridged.error, mass_error))
    return replace(bridged, log_z=bridged.log_z - log_mass, error=error, log_prior_mass=log_mass)


def bridge_halves(
    log_prob: Callable[[FloatArray], FloatArray], halves: Halves, rng: np.random.RandomState, draws: int
) -> Evidence:
    """Bridge each half of the draws to a proposal that was fitted to the other; the mean of both.

    Parameters
    ----------
    log_prob : callable
        Unnormalised log density at points (N, d).
    halves : pair of (chain, log density)
        (chains, draws, d) and (chains, draws) arrays.
    draws : int
        Draws of the proposals, both together.
    """
    bridges = []
    for (fitted, _), (chain, density) in (halves, halves[::-1]):
        proposal = fit_student_t(end_to_end(fitted))
        new = proposal.draw(rng, -(-draws // 2))
        at_new = log_prob(new) - proposal.log_density(new)
        at_draws = density - proposal.log_density(end_to_end(chain)).reshape(density.shape)
        bridges.append(bridge(at_draws, at_new))
    first, second = bridges
    log_z = float(np.logaddexp(first.log_z, second.log_z) - log(2.0))
    # To first order the two share no draw.
    share = np.exp(np.array([first.log_z, second.log_z]) - log_z) / 2.0
    error = float(np.hypot(share[0] * first.error, share[1] * second.error))
    return Evidence(
        log_z, error, 0.0, first.effective_size + second.effective_size, 0.5 * (first.overlap + second.overlap)
    )


def bridge(at_draws: FloatArray, at_new: FloatArray) -> Evidence:
    """Integral of an unnormalised density p, from draws of it and of a normalised g (no constraint).

    Parameters
    ----------
    at_draws : (chains, draws) array
        ln p - ln g at draws of p, correlated along the second axis.
    at_new : (N,) array
        ln p - ln g at independent draws of g; -inf is allowed.
    """
    if not np.isfinite(at_new).any():
        raise ValueError("the proposal of the bridge has no draw in the posterior's support: too few posterior draws")
    size = float(at_draws.size)
    for _ in range(2):
        # First with every draw counted, then with the effective number of the term that is averaged over them.
        size = _effective_size(_solve(at_draws, at_new, size)[1])
    log_z, from_draws, from_new = _solve(at_draws, at_new, size)
    variance = [
        np.square(terms.std() / terms.mean()) / count for terms, count in ((from_draws, size), (from_new, at_new.size))
    ]
    # Mean of the logistic terms over g is N_p times the mean over it of p / (N_p p + N_g Z g).
    overlap = float(from_new.mean() * (size + at_new.size) / size)
    return Evidence(log_z, float(np.sqrt(sum(variance))), 0.0, size, min(overlap, 1.0))


def _solve(at_draws: FloatArray, at_new: FloatArray, size: float) -> tuple[float, FloatArray, FloatArray]:
    """Solve for ln Z, and return the terms of both sides; `size` is how many draws `at_draws` are worth."""
    log_ratio = log(size / at_new.size)

    def terms(log_z: float) -> tuple[FloatArray, FloatArray]:
        shift = log_ratio - log_z
        return expit(-(at_draws + shift)), expit(at_new + shift)

    def excess(log_z: float) -> float:
        from_draws, from_new = terms(log_z)
        return float(size * from_draws.mean() - at_new.size * from_new.mean())

    # One side rises with Z and the other falls: one root. A proposal may lie so far out that its density, which is
    # finite, would take a thousand steps to come back from: no more than the best of them is asked.
    ends = np.array([at_draws.min(), at_draws.max(), at_new.max()]) + log_ratio
    low, high = float(ends.min()) - 40.0, float(ends.max()) + 40.0
    log_z = float(brentq(excess, low, high, xtol=1e-10))
    return log_z, *terms(log_z)


def _effective_size(terms: FloatArray) -> float:
    """Effective number of draws for the mean of (chains, draws) values; at most as many as there are."""
    ess = effective_draws_of_mean(terms) if terms.shape[1] >= FEWEST_DRAWS else nan
    # Constant terms have no variance to divide; too short a chain counts as one draw.
    fallback = float(terms.size if np.ptp(terms) == 0.0 else terms.shape[0])
    return min(max(ess, 1.0), float(terms.size)) if np.isfinite(ess) else fallback


def evidence_by_importance(
    posterior: Posterior,
    seed: np.random.SeedSequence,
    start: StudentT | None = None,
    draws: int = 4096,
    rounds: int = 4,
) -> Evidence:
    """Evidence without draws of the posterior, by adaptive importance sampling; for near-normal posteriors.

    Every round but the last draws from the proposal of the round before and fits the next to all draws so far, weighted
    against the mixture that they came from, tempered where they rest on a few draws.  The last, of which the evidence
    is the mean weight, fits nothing; where it is not reliable it is not the last, up to three times as many rounds.

    Parameters
    ----------
    seed : SeedSequence
        The only source of randomness; it is not advanced.
    start : StudentT, optional
        Proposal of the first round, such as that of a posterior with one record more; the optimum's where None.
    draws : int
        Draws a round.
    rounds : int
        The last included; more where the start was poor.

    Raises
    ------
    ValueError
        If no draw meets the posterior's support.
    """
    search, drawing, mass = _streams(seed, 3)
    proposal = start or widened(posterior, find_optimum(posterior, np.random.default_rng(search)))
    rng = np.random.RandomState(np.random.MT19937(drawing))
    log_mass, mass_error = log_prior_mass(posterior, np.random.default_rng(mass))
    proposals: list[StudentT] = []
    points, heights = np.empty((0, proposal.centre.size)), np.empty(0)
    while True:
        new = proposal.draw(rng, draws)
        height = posterior.log_prob(new)
        proposals.append(proposal)
        if len(proposals) >= rounds:
            evidence = _mean_weight(height - proposal.log_density(new), new, proposal, log_mass, mass_error)
            if evidence.reliable or len(proposals) >= MORE_ROUNDS * rounds:
                break
        points, heights = np.concatenate([points, new]), np.concatenate([heights, height])
        mixture = logsumexp([earlier.log_density(points) for earlier in proposals], axis=0) - log(len(proposals))
        proposal = fit_student_t(points, _tempered(heights - mixture, DRAWS_A_DIMENSION * proposal.centre.size))
    if not np.isfinite(evidence.log_z):
        raise ValueError("no draw of the proposal lies in the posterior's support")
    return evidence


def _mean_weight(
    log_weight: FloatArray, points: FloatArray, proposal: StudentT, log_mass: float, mass_error: float
) -> Evidence:
    """Evidence from the log weights of independent draws of the proposal."""
    top = float(log_weight.max())
    if not np.isfinite(top):
        return Evidence(-inf, inf, log_mass, 0.0, 0.0, inf)
    weight = np.exp(log_weight - top)
    mean, count = float(weight.mean()), weight.size
    size = float(weight.sum() ** 2 / np.square(weight).sum())
    pareto_k = tail_shape(log_weight[np.isfinite(log_weight)])
    # About the proposal's centre: a posterior that lies to one side is as bad as one too wide.
    z = np.linalg.solve(proposal.cholesky, (points - proposal.centre).T)
    largest = float(np.linalg.eigvalsh((z * (weight / weight.sum())) @ z.T)[-1])
    error = float(np.hypot(weight.std() / mean / sqrt(count), mass_error))
    widening = sqrt(largest) / (1.0 + sqrt(len(z) / size))
    return Evidence(top + log(mean) - log_mass, error, log_mass, size, size / count, pareto_k, widening)


def widened(posterior: Posterior, proposal: StudentT) -> StudentT:
    """Widen a proposal along its axes to where the posterior falls by half a nat on the farther side.

    The curvature at an optimum that leans on the joint constraint is that of the wall, and the Student-t there has next
    to no width across it.
    """
    variance, axes = np.linalg.eigh(proposal.cholesky @ proposal.cholesky.T)
    sd = np.sqrt(np.maximum(variance, 0.0))
    largest = np.array([prior.scale for prior in posterior.priors]) @ np.abs(axes)
    # From one sd to the prior's, in equal ratios, on both sides of every axis.
    ratio = np.maximum(largest / np.maximum(sd, 1e-300), 1.0)
    reach = sd * ratio ** np.linspace(0.0, 1.0, PROBES)[:, None]
    offset = np.einsum("s,pj,ij->spji", np.array([1.0, -1.0]), reach, axes).reshape(-1, sd.size)
    height = posterior.log_prob(np.concatenate([proposal.centre[None], proposal.centre + offset]))
    near = (height[1:] >= height[0] - 0.5).reshape(2, PROBES, -1).any(axis=0)
    sd = np.maximum(sd, np.where(near, reach, 0.0).max(axis=0))
    return StudentT(proposal.centre, np.linalg.cholesky((axes * sd**2) @ axes.T), proposal.degrees_of_freedom)


def _tempered(log_weight: FloatArray, least: float) -> FloatArray:
    """Normalised weights, to the largest power up to one that leaves an effective size of `least`.

    Where fewer draws than that lie in the support, all of them weigh alike.
    """
    alive = np.isfinite(log_weight)
    if alive.sum() < 2:
        raise ValueError("no draw of the proposal lies in the posterior's support")
    below = np.where(alive, log_weight - log_weight.max(), 0.0)

    def weights(power: float) -> FloatArray:
        weight: FloatArray = np.where(alive, np.exp(power * below), 0.0)
        return weight / weight.sum()

    def enough(power: float) -> bool:
        return bool(np.square(weights(power)).sum() * least <= 1.0)

    if enough(1.0):
        return weights(1.0)
    low, high = 0.0, 1.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if enough(middle) else (low, middle)
    return weights(low)


def log_prior_mass(posterior: Posterior, rng: np.random.Generator) -> tuple[float, float]:
    """Logarithm of the prior probability of the joint constraint, and its standard error.

    Exactly (0, 0) of a posterior that does not override `Posterior.inside`.

    Raises
    ------
    ValueError
        If no prior draw lies within the constraint.
    """
    if type(posterior).inside is Posterior.inside:
        return 0.0, 0.0
    hits = count = 0
    while count < MOST_MASS_DRAWS:
        _, inside = posterior.prior_sample(rng, MASS_BATCH)
        hits, count = hits + int(inside.sum()), count + MASS_BATCH
        if count - hits <= PRIOR_MASS_ERROR**2 * hits * count:
            break
    if not hits:
        raise ValueError(f"none of {count} prior draws lies within the model's constraint")
    return log(hits / count), sqrt((count - hits) / (hits * count))


def _streams(seed: np.random.SeedSequence, count: int) -> list[np.random.SeedSequence]:
    """Children of a seed that is not advanced: the same seed gives the same evidence however often it is asked."""
    return [np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, _SPAWN, i)) for i in range(count)]
