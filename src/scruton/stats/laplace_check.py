"""Laplace's evidence checked: by importance sampling at the optimum, and by bridge sampling on a short run from it."""

from collections.abc import Callable

import numpy as np

from scruton.arrays import FloatArray
from scruton.stats.convergence import SamplerSettings
from scruton.stats.evidence import Evidence, _mean_weight, bridge_halves
from scruton.stats.posterior import Block
from scruton.stats.student_t import StudentT, conditional

LogProb = Callable[[FloatArray], FloatArray]

ENSEMBLES = 2
WALKERS, SETTLE, STEPS = 160, 60, 120
# Local moves get five times their weight once the proposal is fitted to draws: a third of all.
_MOVES = SamplerSettings(independence=0.65, differential_evolution=0.07, stretch=0.0)


def importance_evidence(log_prob: LogProb, proposal: StudentT, rng: np.random.Generator, draws: int = 600) -> Evidence:
    """Evidence from independent draws of one proposal.

    Parameters
    ----------
    log_prob : callable
        Unnormalised log density at points (N, d).
    proposal : StudentT
        At the optimum, a little wider than Laplace's approximation.
    """
    points = proposal.draw(np.random.RandomState(rng.bit_generator), draws)
    return _mean_weight(log_prob(points) - proposal.log_density(points), points, proposal, 0.0, 0.0)


def bridge_evidence(
    log_prob: LogProb,
    proposal: StudentT,
    seed: int,
    *,
    steps: int = STEPS,
    inside: Callable[[FloatArray], FloatArray] = lambda u: u,
) -> Evidence:
    """Evidence from draws of the posterior: slower than Laplace's, exact in the limit.

    Parameters
    ----------
    log_prob : callable
        Unnormalised log density at points (N, d).
    proposal : StudentT
        Laplace's approximation: starts the walkers and makes the first independence move.
    seed : int
    steps : int
        That are kept, of each of two independent ensembles.
    inside : callable, optional
        Moves starting points (N, d) into the support.

    Returns
    -------
    Evidence
        Each ensemble is bridged to a Student-t that was fitted to the other.
    """
    from scruton.stats.sampler import Ensembles  # emcee and, by it, scipy.stats: few diagnoses come here

    def one_part(u: FloatArray, _: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
        return log_prob(u)[:, None], np.empty((len(u), 0))

    halves = []
    for k in range(ENSEMBLES):
        rng = np.random.default_rng([seed, k])
        size = proposal.centre.size
        whole = Block(np.arange(size), np.arange(0))
        first = conditional(proposal, whole.members, whole.given)
        normal = rng.standard_normal((max(WALKERS, 2 * size + 2), size))
        start = inside(proposal.centre + normal @ proposal.cholesky.T)
        state = np.random.RandomState(np.random.MT19937(rng.integers(2**31))).get_state()
        ensemble = Ensembles(1, [whole], [[first]], start, log_prob(start), state)
        ensemble.advance(one_part, SETTLE, _MOVES)
        ensemble.adapt()
        ensemble.advance(one_part, steps, _MOVES)
        halves.append((ensemble.chain[0].swapaxes(0, 1), ensemble.log_probs[0].T))
    bridging = np.random.RandomState(np.random.MT19937(np.random.SeedSequence([seed, ENSEMBLES])))
    return bridge_halves(log_prob, (halves[0], halves[1]), bridging, WALKERS * steps // 4)
