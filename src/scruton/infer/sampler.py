"""emcee ensembles, each from its own optimised start, run in chunks until the verdict is good."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import emcee
import numpy as np

from scruton.campaign.schema import FloatArray
from scruton.infer.cards import SamplerSettings
from scruton.infer.checkpoint import Checkpoint, pack_random_state, unpack_random_state
from scruton.infer.convergence import Convergence, judge
from scruton.infer.models import Posterior
from scruton.infer.moves import StudentT, moves
from scruton.infer.optimum import find_optimum

FIRST_CHUNK = 48  # steps; then as many as the run already has, so that checks cost a fixed share
LARGEST_CHUNK = 1024
WARM_UP = 24  # steps of a warm-up round
WARM_UP_ROUNDS = 8
GOOD_ACCEPTANCE = 0.45  # below it the Student-t does not fit, and is fitted anew to the warm-up's draws

Progress = Callable[[int, Convergence], None]


@dataclass(frozen=True, eq=False)
class Samples:
    """What sampling gives.

    Attributes
    ----------
    names : tuple of str
    chain : (chains, draws, d) array
        Sampled coordinates, thinned to the card's number of draws.
    log_prob : (chains, draws) array
    ensemble : (chains,) array of int
    convergence : Convergence
        Judged on the unthinned run.
    proposals : tuple of StudentT
        Optimum of each ensemble.
    """

    names: tuple[str, ...]
    chain: FloatArray
    log_prob: FloatArray
    ensemble: np.ndarray
    convergence: Convergence
    proposals: tuple[StudentT, ...]


@dataclass(eq=False)
class _Ensemble:
    """One ensemble between chunks: everything that the next chunk depends on, and the chunks so far."""

    proposal: StudentT
    coords: FloatArray
    log_prob: FloatArray
    random_state: Any
    chain: list[FloatArray]
    log_probs: list[FloatArray]
    accepted: float = 0.0

    def advance(self, posterior: Posterior, steps: int, settings: SamplerSettings) -> None:
        sampler = emcee.EnsembleSampler(
            len(self.coords),
            self.coords.shape[1],
            posterior.log_prob,
            vectorize=True,
            moves=moves(self.proposal, settings),
        )
        state = emcee.State(self.coords, log_prob=self.log_prob, random_state=self.random_state)
        last = sampler.run_mcmc(state, steps, skip_initial_state_check=True)
        self.coords, self.log_prob, self.random_state = last.coords, last.log_prob, last.random_state
        self.chain.append(sampler.get_chain())
        self.log_probs.append(sampler.get_log_prob())
        self.accepted += float(sampler.backend.accepted.mean())


def sample(
    posterior: Posterior,
    settings: SamplerSettings,
    seed: np.random.SeedSequence,
    checkpoint: Checkpoint | None = None,
    progress: Progress | None = None,
) -> Samples:
    """Draw from a posterior.

    Parameters
    ----------
    posterior : Posterior
    settings : SamplerSettings
        Ensembles, walkers, moves and the stopping rule.
    seed : SeedSequence
        The only source of randomness: the same seed gives the same bytes.
    checkpoint : Checkpoint, optional
        Saved after every chunk and resumed from where it exists.
    progress : callable, optional
        Called after every chunk with the steps so far and the verdict.

    Returns
    -------
    Samples
        Also where the run did not converge: `Samples.convergence` says so.
    """
    stored = checkpoint.load() if checkpoint else None
    ensembles = _restore(stored) if stored is not None else _start(posterior, settings, seed)
    steps = sum(len(one) for one in ensembles[0].chain)
    verdict = _verdict(ensembles, steps, settings) if steps else None
    while verdict is None or not (steps >= settings.max_steps or _enough(verdict, settings)):
        chunk = min(max(FIRST_CHUNK, steps), LARGEST_CHUNK, settings.max_steps - steps)
        for one in ensembles:
            one.advance(posterior, chunk, settings)
        steps += chunk
        if checkpoint:
            checkpoint.save(_pack(ensembles))
        verdict = _verdict(ensembles, steps, settings)
        if progress:
            progress(steps, verdict)
    chain, log_prob = _kept(ensembles, steps)
    pick = np.unique(np.linspace(0, chain.shape[1] - 1, settings.draws).round().astype(int))
    return Samples(
        posterior.names,
        np.ascontiguousarray(chain[:, pick]),
        np.ascontiguousarray(log_prob[:, pick]),
        np.repeat(np.arange(len(ensembles)), len(ensembles[0].coords)),
        verdict,
        tuple(one.proposal for one in ensembles),
    )


def _enough(verdict: Convergence, settings: SamplerSettings) -> bool:
    return verdict.converged and verdict.steps >= settings.draws


def _start(posterior: Posterior, settings: SamplerSettings, seed: np.random.SeedSequence) -> list[_Ensemble]:
    ensembles = []
    for child in seed.spawn(settings.ensembles):
        search, chain = child.spawn(2)
        proposal = find_optimum(posterior, np.random.default_rng(search))
        rng = np.random.RandomState(np.random.MT19937(chain))
        walkers = max(settings.walkers, 2 * len(posterior.priors))
        coords, log_prob = _walkers(posterior, proposal, rng, walkers)
        one = _Ensemble(proposal, coords, log_prob, rng.get_state(), [], [])
        _warm_up(one, posterior, settings)
        ensembles.append(one)
    return ensembles


def _warm_up(one: _Ensemble, posterior: Posterior, settings: SamplerSettings) -> None:
    """Bring the walkers into the posterior and the proposal to its shape; these steps are thrown away."""
    for step in range(WARM_UP_ROUNDS):
        one.accepted = 0.0
        one.advance(posterior, WARM_UP * (1 + step // 2), settings)
        if one.accepted >= GOOD_ACCEPTANCE * WARM_UP * (1 + step // 2):
            break
        recent = np.concatenate(one.chain)[-(len(one.chain) * WARM_UP) // 2 :].reshape(-1, one.coords.shape[1])
        covariance = np.cov(recent.T) + 1e-12 * np.diag(recent.var(axis=0)) + 1e-300 * np.eye(recent.shape[1])
        try:
            one.proposal = StudentT(recent.mean(axis=0), np.linalg.cholesky(covariance))
        except np.linalg.LinAlgError:
            break  # the walkers fill no volume: DE and stretch must do
    one.chain, one.log_probs, one.accepted = [], [], 0.0


def _walkers(
    posterior: Posterior, proposal: StudentT, rng: np.random.RandomState, count: int
) -> tuple[FloatArray, FloatArray]:
    """Walkers drawn round the optimum, those with a finite posterior and not absurdly low."""
    coords, log_prob = np.empty((0, proposal.centre.size)), np.empty(0)
    top = posterior.log_prob(proposal.centre[None])[0]
    width = 1.0
    while len(coords) < count:
        tight = StudentT(proposal.centre, proposal.cholesky * width)
        new = tight.draw(rng, count)
        value = posterior.log_prob(new)
        good = value > top - 15.0
        coords, log_prob = np.concatenate([coords, new[good]]), np.concatenate([log_prob, value[good]])
        width *= 0.7
    return coords[:count].copy(), log_prob[:count].copy()


def _kept(ensembles: list[_Ensemble], steps: int) -> tuple[FloatArray, FloatArray]:
    """Chains without their first quarter, (chains, draws, d) and (chains, draws)."""
    burn = steps // 4
    chain = np.concatenate([np.swapaxes(np.concatenate(one.chain)[burn:], 0, 1) for one in ensembles])
    log_prob = np.concatenate([np.concatenate(one.log_probs)[burn:].T for one in ensembles])
    return chain, log_prob


def _verdict(ensembles: list[_Ensemble], steps: int, settings: SamplerSettings) -> Convergence:
    chain, log_prob = _kept(ensembles, steps)
    acceptance = sum(one.accepted for one in ensembles) / (len(ensembles) * steps)
    return judge(chain, log_prob, len(ensembles), acceptance, settings)


def _pack(ensembles: list[_Ensemble]) -> dict[str, Any]:
    return {
        "centre": np.array([one.proposal.centre for one in ensembles]),
        "cholesky": np.array([one.proposal.cholesky for one in ensembles]),
        "coords": np.array([one.coords for one in ensembles]),
        "log_prob": np.array([one.log_prob for one in ensembles]),
        "random_state": np.array([pack_random_state(one.random_state) for one in ensembles]),
        "chain": np.array([np.concatenate(one.chain) for one in ensembles]),
        "log_probs": np.array([np.concatenate(one.log_probs) for one in ensembles]),
        "accepted": np.array([one.accepted for one in ensembles]),
    }


def _restore(stored: dict[str, Any]) -> list[_Ensemble]:
    return [
        _Ensemble(
            StudentT(stored["centre"][i], stored["cholesky"][i]),
            stored["coords"][i],
            stored["log_prob"][i],
            unpack_random_state(str(stored["random_state"][i])),
            [stored["chain"][i]],
            [stored["log_probs"][i]],
            float(stored["accepted"][i]),
        )
        for i in range(len(stored["coords"]))
    ]
