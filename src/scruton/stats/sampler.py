"""emcee ensembles, each from its own optimised start, run in chunks until the verdict is good.

emcee's `DESnookerMove` (3.1.6) is biased - a unit normal in four dimensions comes out with a standard deviation
of 0.86 - and is never used here.

A run that was killed resumes from the last chunk and gives, bit for bit, what the uninterrupted run gives, because
both go through the same chunks: a chunk depends only on the walkers' positions and the generator's state at its start.
"""

import contextlib
import os
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import emcee
import numpy as np

from scruton.arrays import FloatArray, IntArray, thin
from scruton.documents import replace_file
from scruton.errors import InputError
from scruton.stats.convergence import Convergence, SamplerSettings, judge
from scruton.stats.optimum import find_optimum
from scruton.stats.posterior import Posterior
from scruton.stats.student_t import AT_OPTIMUM, FITTED_TO_DRAWS, StudentT, maximum_likelihood
from scruton.stats.thresholds import ADAPTATIONS, FAR_BELOW, OVERDISPERSED

FIRST_CHUNK = 20  # steps; then as many as the run already has, so that checks cost a fixed share
LARGEST_CHUNK = 256
_PROPOSAL = ("centre", "cholesky", "degrees_of_freedom")


@dataclass(frozen=True)
class Checkpoint:
    """Where one posterior's chunks are kept, and the fingerprint of everything that determines them."""

    path: Path
    fingerprint: str

    def save(self, arrays: dict[str, Any]) -> None:
        """Write atomically: a reader sees the old file or the new one, never a part."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        temporary = self.path.with_suffix(".tmp")
        with temporary.open("wb") as stream:
            np.savez(stream, fingerprint=np.array(self.fingerprint), **arrays)
            stream.flush()
            os.fsync(stream.fileno())
        replace_file(temporary, self.path)

    def load(self) -> dict[str, Any] | None:
        """Read what was saved, None if nothing was.

        Raises
        ------
        InputError
            If it is damaged, or belongs to another run: other data, card, seed or version.
        """
        if not self.path.is_file():
            return None
        wanted = "the same inputs as in the interrupted run, or --force to start again"
        try:
            with np.load(self.path, allow_pickle=False) as stored:
                arrays = {key: stored[key] for key in stored.files}
            fingerprint = str(arrays.pop("fingerprint"))
        except (OSError, ValueError, KeyError, EOFError, BadZipFile, zlib.error) as error:
            raise InputError(self.path, "", f"a damaged checkpoint ({error})", wanted) from error
        if fingerprint != self.fingerprint:
            found = "a checkpoint of other data, another model card, seed or version"
            raise InputError(self.path, "", found, wanted)
        return arrays


@dataclass(frozen=True, eq=False)
class Samples:
    """What sampling gives.

    Attributes
    ----------
    chain : (chains, draws, d) array
        Sampled coordinates, thinned to the card's number of draws.
    log_prob : (chains, draws) array
    ensemble : (chains,) array of int
    convergence : Convergence
        Judged on the unthinned run.
    """

    names: tuple[str, ...]
    chain: FloatArray
    log_prob: FloatArray
    ensemble: np.ndarray
    convergence: Convergence


class IndependenceMove(emcee.moves.MHMove):
    """Metropolis-Hastings with proposals drawn from one fixed distribution.

    Near-normal posteriors accept almost every proposal, so that successive draws are nearly independent.
    """

    def __init__(self, proposal: StudentT) -> None:
        self.proposal = proposal
        super().__init__(self._propose, ndim=proposal.centre.size)

    def _propose(self, coords: FloatArray, rng: np.random.RandomState) -> tuple[FloatArray, FloatArray]:
        new = self.proposal.draw(rng, len(coords))
        return new, self.proposal.log_density(coords) - self.proposal.log_density(new)


class BlockMove(emcee.moves.MHMove):
    """Metropolis-Hastings with a block drawn given the other coordinates: many are well drawn a few at a time."""

    def __init__(self, proposal: StudentT, block: IntArray) -> None:
        given = proposal.conditional(block)
        super().__init__(lambda coords, rng: given.draw(rng, coords), ndim=proposal.centre.size)


def moves(
    proposal: StudentT, settings: SamplerSettings, blocks: Sequence[IntArray] = ()
) -> list[tuple[emcee.moves.Move, float]]:
    """Return the mixture of moves with the card's weights; a weight of zero leaves a move out.

    Where the proposal had to be fitted to draws, the posterior is no Student-t, and walkers in its tails would wait
    long for an independent proposal of all coordinates: the local moves get five times their weight.  Blocks share one
    step among them, and the local moves keep their weight in it.
    """
    local = 1.0 / len(blocks) if blocks else 1.0 if proposal.degrees_of_freedom == AT_OPTIMUM else 5.0
    distinct = {id(block): BlockMove(proposal, block) for block in blocks}  # one may stand among them several times
    independent = [distinct[id(block)] for block in blocks] or [IndependenceMove(proposal)]
    mixture = [
        *((move, settings.independence / len(independent)) for move in independent),
        (emcee.moves.DEMove(), local * settings.differential_evolution),
        (emcee.moves.StretchMove(), local * settings.stretch),
    ]
    return [(move, weight) for move, weight in mixture if weight > 0]


class _Vectorised(emcee.EnsembleSampler):
    """emcee's `vectorize=True` without its loop over the walkers: the posterior returns one array, never NaN."""

    def compute_log_prob(self, coords: FloatArray) -> tuple[FloatArray, None]:
        return self.log_prob_fn.f(coords), None


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
        return sum(len(part) for part in self.chain)

    def advance(
        self,
        log_prob: Callable[[FloatArray], FloatArray],
        steps: int,
        settings: SamplerSettings,
        blocks: Sequence[IntArray] = (),
    ) -> None:
        """Go on; with blocks a step has as many moves."""
        mixture, moves_a_step = moves(self.proposal, settings, blocks), max(len(blocks), 1)
        sampler = _Vectorised(*self.coords.shape, log_prob, vectorize=True, moves=mixture)
        state = emcee.State(self.coords, log_prob=self.log_prob, random_state=self.random_state)
        last = sampler.run_mcmc(state, steps, thin_by=moves_a_step, skip_initial_state_check=True)
        self.coords, self.log_prob, self.random_state = last.coords, last.log_prob, last.random_state
        self.chain.append(sampler.get_chain())
        self.log_probs.append(sampler.get_log_prob())
        self.accepted += float(sampler.backend.accepted.mean())

    def adapt(self) -> None:
        """Fit the proposal to the recent half of the draws, and forget them: they were for finding the posterior."""
        chain = np.concatenate(self.chain)
        recent = chain[len(chain) // 2 :].reshape(-1, self.coords.shape[1])
        # Where the walkers fill no volume the old proposal stays: DE and stretch must do.
        with contextlib.suppress(np.linalg.LinAlgError):
            self.proposal = maximum_likelihood(recent, FITTED_TO_DRAWS)
        self.chain, self.log_probs, self.accepted = [], [], 0.0


def sample(
    posterior: Posterior,
    settings: SamplerSettings,
    seed: np.random.SeedSequence,
    checkpoint: Checkpoint | None = None,
    progress: Callable[[int, Convergence], None] | None = None,
) -> Samples:
    """Draw from a posterior.

    Parameters
    ----------
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
    total = rounds = 0
    if stored is None:
        ensembles = _start(posterior, settings, seed)
    else:
        total, rounds = (int(x) for x in stored["counts"])
        ensembles = _restore(stored)
    while True:
        if total:
            burn = ensembles[0].steps // 4  # chains without their first quarter
            chain = np.concatenate([np.swapaxes(np.concatenate(ensemble.chain)[burn:], 0, 1) for ensemble in ensembles])
            log_prob = np.concatenate([np.concatenate(ensemble.log_probs)[burn:].T for ensemble in ensembles])
            acceptance = sum(ensemble.accepted for ensemble in ensembles) / (len(ensembles) * ensembles[0].steps)
            verdict = judge(chain, log_prob, len(ensembles), acceptance, settings)
            if progress:
                progress(total, verdict)
            if (verdict.converged and verdict.steps >= settings.draws) or total >= settings.max_steps:
                break
            if rounds < ADAPTATIONS:
                rounds += 1
                for ensemble in ensembles:
                    ensemble.adapt()
        chunk = min(max(FIRST_CHUNK, total), LARGEST_CHUNK, settings.max_steps - total)
        for ensemble in ensembles:
            posterior.forget()
            ensemble.advance(posterior.log_prob, chunk, settings, posterior.blocks)
        total += chunk
        if checkpoint:
            checkpoint.save({"counts": np.array([total, rounds]), **_pack(ensembles)})
    pick = thin(chain.shape[1], settings.draws)
    chain, log_prob = (np.ascontiguousarray(array[:, pick]) for array in (chain, log_prob))
    walker = np.repeat(np.arange(len(ensembles)), len(ensembles[0].coords))
    return Samples(posterior.names, chain, log_prob, walker, verdict)


def _start(posterior: Posterior, settings: SamplerSettings, seed: np.random.SeedSequence) -> list[_Ensemble]:
    """Ensembles of walkers round optima, wider than the posterior seems, so that ensembles that agree have mixed."""
    ensembles = []
    for child in seed.spawn(settings.ensembles):
        search, chain = child.spawn(2)
        proposal = find_optimum(posterior, np.random.default_rng(search))
        rng = np.random.RandomState(np.random.MT19937(chain))
        count, width = max(settings.walkers, 2 * len(posterior.priors)), OVERDISPERSED
        coords, log_prob = np.empty((0, proposal.centre.size)), np.empty(0)
        top = posterior.log_prob(proposal.centre[None])[0]
        while len(coords) < count:
            new = StudentT(proposal.centre, proposal.cholesky * width).draw(rng, count)
            value = posterior.log_prob(new)
            good = value > top - FAR_BELOW
            coords, log_prob = np.concatenate([coords, new[good]]), np.concatenate([log_prob, value[good]])
            width *= 0.7
        ensembles.append(_Ensemble(proposal, coords[:count].copy(), log_prob[:count].copy(), rng.get_state(), [], []))
    return ensembles


def _pack(ensembles: list[_Ensemble]) -> dict[str, Any]:
    """Arrays from which `_restore` makes the same ensembles; of a random state its keys, its counters, its cache."""
    states = [ensemble.random_state for ensemble in ensembles]
    return {
        **{key: np.array([getattr(ensemble.proposal, key) for ensemble in ensembles]) for key in _PROPOSAL},
        **{
            key: np.array([getattr(ensemble, key) for ensemble in ensembles])
            for key in ("coords", "log_prob", "accepted")
        },
        **{
            key: np.array([np.concatenate(getattr(ensemble, key)) for ensemble in ensembles])
            for key in ("chain", "log_probs")
        },
        "keys": np.array([state[1] for state in states]),
        "counters": np.array([state[2:4] for state in states]),
        "cache": np.array([state[4] for state in states]),
    }


def _restore(stored: dict[str, Any]) -> list[_Ensemble]:
    ensembles = []
    for i, counters in enumerate(stored["counters"].tolist()):
        saved = {key: value[i] for key, value in stored.items() if key != "counts"}
        proposal = StudentT(saved["centre"], saved["cholesky"], float(saved["degrees_of_freedom"]))
        state = ("MT19937", saved["keys"], *counters, float(saved["cache"]))
        chain, log_probs, accepted = [saved["chain"]], [saved["log_probs"]], float(saved["accepted"])
        ensembles.append(_Ensemble(proposal, saved["coords"], saved["log_prob"], state, chain, log_probs, accepted))
    return ensembles
