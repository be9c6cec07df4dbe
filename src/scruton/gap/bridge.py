"""Evidence of the leading hypotheses by bridge sampling on draws of emcee: slower than Laplace, exact in the limit."""

import emcee
import numpy as np

from scruton.arrays import FloatArray
from scruton.gap.hypothesis import Weighed
from scruton.gap.importance import log_density_of
from scruton.stats.evidence import Evidence, bridge_halves
from scruton.stats.moves import IndependenceMove
from scruton.stats.student_t import FITTED_TO_DRAWS, StudentT

ENSEMBLES = 2
WALKERS, SETTLE, STEPS = 160, 60, 120
_LOCAL = 0.35  # share of differential evolution, for walkers where an independent proposal is rarely taken


def bridge_evidence(leader: Weighed, seed: int, *, steps: int = STEPS) -> Evidence:
    """Evidence of a hypothesis, from draws of its posterior.

    Parameters
    ----------
    leader : Weighed
        Its mode and covariance start the walkers and make the first proposal.
    seed : int
    steps : int
        That are kept, of each of two independent ensembles.

    Returns
    -------
    Evidence
        Each ensemble is bridged to a Student-t that was fitted to the other.
    """
    halves = []
    for k in range(ENSEMBLES):
        halves.append(_draws(leader, np.random.default_rng([seed, k]), steps))
    rng = np.random.RandomState(np.random.MT19937(np.random.SeedSequence([seed, ENSEMBLES])))
    return bridge_halves(
        lambda u: log_density_of(leader.hypothesis, u), (halves[0], halves[1]), rng, WALKERS * steps // 4
    )


def _draws(leader: Weighed, rng: np.random.Generator, steps: int) -> tuple[FloatArray, FloatArray]:
    """Chains (walkers, steps, d) and their log densities."""
    root = np.linalg.cholesky(leader.covariance)
    hypothesis, size = leader.hypothesis, leader.mode.size
    proposal = StudentT(leader.mode, root)
    start = _inside(leader, leader.mode + rng.standard_normal((max(WALKERS, 2 * size + 2), size)) @ root.T)
    state = emcee.State(start, random_state=np.random.RandomState(np.random.MT19937(rng.integers(2**31))).get_state())

    def run(state: emcee.State, count: int, proposal: StudentT) -> emcee.EnsembleSampler:
        sampler = emcee.EnsembleSampler(
            len(start), size, lambda u: log_density_of(hypothesis, u), vectorize=True,
            moves=[(IndependenceMove(proposal), 1.0 - _LOCAL), (emcee.moves.DEMove(), _LOCAL)],
        )  # fmt: skip
        sampler.run_mcmc(state, count, skip_initial_state_check=True)
        return sampler

    first = run(state, SETTLE, proposal)
    recent = first.get_chain(discard=SETTLE // 2, flat=True)
    fitted = StudentT(recent.mean(axis=0), np.linalg.cholesky(np.cov(recent.T)), FITTED_TO_DRAWS)
    kept = run(first._previous_state, steps, fitted)
    return kept.get_chain().swapaxes(0, 1), kept.get_log_prob().T


def _inside(leader: Weighed, u: FloatArray) -> FloatArray:
    """Walkers moved to where every prior that is cut at zero has density."""
    u = u.copy()
    for one in leader.hypothesis.parameters:
        if one.positive:
            place = leader.hypothesis.places[one.name]
            u[:, place] = np.abs(u[:, place]) + 1e-6
    return u
