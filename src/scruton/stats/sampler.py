"""emcee ensembles, each from its own optimised start, run in chunks until the verdict is good."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import emcee
import numpy as np

from scruton.arrays import FloatArray
from scruton.stats.checkpoint import Checkpoint, pack_random_state, unpack_random_state
from scruton.stats.convergence import Convergence, judge
from scruton.stats.moves import moves
from scruton.stats.optimum import find_optimum
from scruton.stats.posterior import Posterior
from scruton.stats.settings import SamplerSettings
from scruton.stats.student_t import FITTED_TO_DRAWS, StudentT
from scruton.stats.thresholds import ADAPTATIONS, FAR_BELOW, OVERDISPERSED

FIRST_CHUNK = 20  # steps; then as many as the run already has, so that checks cost a fixed share
LARGEST_CHUNK = 256

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


class _Vectorised(emcee.EnsembleSampler):
    """emcee's `vectorize=True` without its loop over the walkers: the posterior returns one array, never NaN."""

    def __init__(self, walkers: int, dimensions: int, log_prob: Callable[[FloatArray], FloatArray], moves: Any) -> None:
        super().__init__(walkers, dimensions, log_prob, vectorize=True, moves=moves)
        self.posterior = log_prob

    def compute_log_prob(self, coords: FloatArray) -> tuple[FloatArray, None]:
        return self.posterior(coords), None


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

    @property
    def steps(self) -> int:
        """Steps since the last adaptation."""
        return sum(len(one) for one in self.chain)

    def advance(self, posterior: Posterior, steps: int, settings: SamplerSettings) -> None:
        sampler = _Vectorised(
            len(self.coords), self.coords.shape[1], posterior.log_prob, moves=moves(self.proposal, settings)
        )
        state = emcee.State(self.coords, log_prob=self.log_prob, random_state=self.random_state)
        last = sampler.run_mcmc(state, steps, skip_initial_state_check=True)
        self.coords, self.log_prob, self.random_state = last.coords, last.log_prob, last.random_state
        self.chain.append(sampler.get_chain())
        self.log_probs.append(sampler.get_log_prob())
        self.accepted += float(sampler.backend.accepted.mean())

    def adapt(self) -> None:
        """Fit the proposal to the recent half of the draws, and forget them: they were for finding the posterior."""
        chain = np.concatenate(self.chain)
        recent = chain[len(chain) // 2 :].reshape(-1, self.coords.shape[1])
        covariance = np.cov(recent.T) + np.diag(1e-12 * recent.var(axis=0) + 1e-300)
        # Where the walkers fill no volume the old proposal stays: DE and stretch must do.
        with contextlib.suppress(np.linalg.LinAlgError):
            self.proposal = StudentT(recent.mean(axis=0), np.linalg.cholesky(covariance), FITTED_TO_DRAWS)
        self.chain, self.log_probs, self.accepted = [], [], 0.0


@dataclass(eq=False)
class _Run:
    """All ensembles between chunks, the steps run so far and the adaptations made."""

    ensembles: list[_Ensemble]
    total: int = 0
    rounds: int = 0

    def adapt(self) -> None:
        self.rounds += 1
        for one in self.ensembles:
            one.adapt()


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
    run = _restore(stored) if stored is not None else _Run(_start(posterior, settings, seed))
    while True:
        verdict = _verdict(run.ensembles, settings) if run.total else None
        if verdict is not None:
            if progress:
                progress(run.total, verdict)
            if _enough(verdict, settings) or run.total >= settings.max_steps:
                break
            if run.rounds < ADAPTATIONS:
                run.adapt()
        chunk = min(max(FIRST_CHUNK, run.total), LARGEST_CHUNK, settings.max_steps - run.total)
        for one in run.ensembles:
            one.advance(posterior, chunk, settings)
        run.total += chunk
        if checkpoint:
            checkpoint.save(_pack(run))
    ensembles = run.ensembles
    chain, log_prob = _kept(ensembles)
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
        ensembles.append(_Ensemble(proposal, coords, log_prob, rng.get_state(), [], []))
    return ensembles


def _walkers(
    posterior: Posterior, proposal: StudentT, rng: np.random.RandomState, count: int
) -> tuple[FloatArray, FloatArray]:
    """Walkers drawn round the optimum, wider than the posterior seems, so that ensembles that agree have mixed."""
    coords, log_prob = np.empty((0, proposal.centre.size)), np.empty(0)
    top = posterior.log_prob(proposal.centre[None])[0]
    width = OVERDISPERSED
    while len(coords) < count:
        tight = StudentT(proposal.centre, proposal.cholesky * width)
        new = tight.draw(rng, count)
        value = posterior.log_prob(new)
        good = value > top - FAR_BELOW
        coords, log_prob = np.concatenate([coords, new[good]]), np.concatenate([log_prob, value[good]])
        width *= 0.7
    return coords[:count].copy(), log_prob[:count].copy()


def _kept(ensembles: list[_Ensemble]) -> tuple[FloatArray, FloatArray]:
    """Chains without their first quarter, (chains, draws, d) and (chains, draws)."""
    burn = ensembles[0].steps // 4
    chain = np.concatenate([np.swapaxes(np.concatenate(one.chain)[burn:], 0, 1) for one in ensembles])
    log_prob = np.concatenate([np.concatenate(one.log_probs)[burn:].T for one in ensembles])
    return chain, log_prob


def _verdict(ensembles: list[_Ensemble], settings: SamplerSettings) -> Convergence:
    chain, log_prob = _kept(ensembles)
    acceptance = sum(one.accepted for one in ensembles) / (len(ensembles) * ensembles[0].steps)
    return judge(chain, log_prob, len(ensembles), acceptance, settings)


def _pack(run: _Run) -> dict[str, Any]:
    ensembles = run.ensembles
    return {
        "counts": np.array([run.total, run.rounds]),
        "centre": np.array([one.proposal.centre for one in ensembles]),
        "cholesky": np.array([one.proposal.cholesky for one in ensembles]),
        "degrees_of_freedom": np.array([one.proposal.degrees_of_freedom for one in ensembles]),
        "coords": np.array([one.coords for one in ensembles]),
        "log_prob": np.array([one.log_prob for one in ensembles]),
        "random_state": np.array([pack_random_state(one.random_state) for one in ensembles]),
        "chain": np.array([np.concatenate(one.chain) for one in ensembles]),
        "log_probs": np.array([np.concatenate(one.log_probs) for one in ensembles]),
        "accepted": np.array([one.accepted for one in ensembles]),
    }


def _restore(stored: dict[str, Any]) -> _Run:
    ensembles = [
        _Ensemble(
            StudentT(stored["centre"][i], stored["cholesky"][i], float(stored["degrees_of_freedom"][i])),
            stored["coords"][i],
            stored["log_prob"][i],
            unpack_random_state(str(stored["random_state"][i])),
            [stored["chain"][i]],
            [stored["log_probs"][i]],
            float(stored["accepted"][i]),
        )
        for i in range(len(stored["coords"]))
    ]
    total, rounds = (int(x) for x in stored["counts"])
    return _Run(ensembles, total, rounds)
