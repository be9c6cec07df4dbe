"""emcee ensembles, each from its own optimised start, run in chunks until the verdict is good.

emcee's `DESnookerMove` (3.1.6) is biased - a unit normal in four dimensions comes out with a standard deviation
of 0.86 - and is never used here.

A run that was killed resumes from the last chunk and gives, bit for bit, what the uninterrupted run gives, because
both go through the same chunks: a chunk depends only on the walkers' positions and the generator's state at its start.
"""

import contextlib
import math
import os
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import emcee
import numpy as np

from scruton.arrays import FloatArray, end_to_end, thin
from scruton.documents import replace_file, written_to
from scruton.errors import InputError
from scruton.stats.convergence import SamplerSettings, effective_draws, judge, promising
from scruton.stats.moves import Assess, sweep
from scruton.stats.optimum import find_optima
from scruton.stats.posterior import Block, Posterior
from scruton.stats.samples import Samples
from scruton.stats.student_t import Conditional, Mixture, NoVolumeError, StudentT, conditional, fit_mixture
from scruton.stats.thresholds import ADAPTATIONS, EARLY, FAR_BELOW, FAR_FROM_ENOUGH, LEAST_MORE, MET, OVERDISPERSED

BURNT = 4  # one in so many steps of a run, its first, is not kept
FIRST_CHUNK = 12  # steps; then as many as seem to be wanted, and at most as many as there were
LARGEST_CHUNK = 256
_PART = ("centre", "cholesky", "degrees_of_freedom")  # of a proposal's mixture


@dataclass(frozen=True)
class Checkpoint:
    """Where one posterior's chunks are kept, and the fingerprint of everything that determines them."""

    path: Path
    fingerprint: str

    def save(self, arrays: dict[str, Any]) -> None:
        """Write atomically: a reader sees the old file or the new one, never a part."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        temporary = self.path.with_suffix(".tmp")
        with written_to(self.path, temporary):
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


@dataclass(eq=False)
class Ensembles:
    """All ensembles between chunks: everything that the next chunk depends on, and the chunks so far.

    Attributes
    ----------
    count : int
    blocks : sequence of Block
        That are moved in turn.
    proposals : list of list of Conditional
        By ensemble, or one of all together, and by block.
    coords : (walkers, d) array
        Of all ensembles, one after the other, each of an even number of walkers.
    log_prob : (walkers,) array
    random_state : tuple
        As emcee takes it.
    chain, log_probs : list of (steps, walkers, d) and (steps, walkers) arrays
        Since the last adaptation.
    """

    count: int
    blocks: Sequence[Block]
    proposals: list[list[Conditional]]
    coords: FloatArray
    log_prob: FloatArray
    random_state: Any
    chain: list[FloatArray] = field(default_factory=list)
    log_probs: list[FloatArray] = field(default_factory=list)
    accepted: float = 0.0

    @property
    def steps(self) -> int:
        """Steps since the last adaptation."""
        return sum(len(part) for part in self.chain)

    def advance(self, assess: Assess, steps: int, settings: SamplerSettings) -> None:
        """Go on."""
        step = sweep(self.blocks, self.proposals, settings, self.count, assess)
        sampler = emcee.EnsembleSampler(*self.coords.shape, assess, moves=step)  # which the moves alone ask
        state = emcee.State(self.coords, log_prob=self.log_prob, random_state=self.random_state)
        last = sampler.run_mcmc(state, steps, skip_initial_state_check=True)
        self.coords, self.log_prob, self.random_state = last.coords, last.log_prob, last.random_state
        self.chain.append(sampler.get_chain())
        self.log_probs.append(sampler.get_log_prob())
        self.accepted += float(sampler.backend.accepted.mean())

    def kept(self) -> tuple[FloatArray, FloatArray]:
        """Chains without what is burnt of them, (walkers, steps, d), and their log posterior, (walkers, steps)."""
        burn = self.steps // BURNT
        return np.swapaxes(np.concatenate(self.chain)[burn:], 0, 1), np.concatenate(self.log_probs)[burn:].T

    def adapt(self, *, together: bool = False) -> None:
        """Fit the proposals to the recent half of the draws, and forget them: they were for finding the posterior.

        Ensembles that have met share what they have learnt.  Until then each has proposals of its own, so that each
        finds its way by itself; those that have found theirs `together` propose what any of them found: between
        modes there is no other way, and what no proposal joins goes on to differ.
        """
        chain = np.concatenate(self.chain)
        recent = np.split(chain[len(chain) // 2 :], self.count, axis=1)
        recent = [np.concatenate(recent)] if together or _met(recent) else recent
        # Where the walkers fill no volume no mixture fits them, and the old proposals stay: DE and stretch must do. All
        # else that goes wrong is an error.
        with contextlib.suppress(NoVolumeError):
            points = [end_to_end(draws) for draws in recent]
            self.proposals = [
                [
                    Conditional(fit_mixture(u[:, np.r_[block.given, block.members]]), block.members, block.given)
                    for block in self.blocks
                ]
                for u in points
            ]
        self.chain, self.log_probs, self.accepted = [], [], 0.0


def _met(parts: Sequence[FloatArray]) -> bool:
    """Whether ensembles, (steps, walkers, d) each, lie where the others do."""
    draws = np.array([end_to_end(part) for part in parts])
    within = draws.var(axis=1).mean(axis=0)
    return bool((draws.mean(axis=1).var(axis=0) < MET**2 * within).all())


def sample(
    posterior: Posterior,
    settings: SamplerSettings,
    seed: np.random.SeedSequence,
    checkpoint: Checkpoint | None = None,
    progress: Callable[[int, float], None] | None = None,
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
        Called after every chunk with the steps so far, and the effective draws over those wanted, at most one.

    Returns
    -------
    Samples
        Also where the run did not converge: `Samples.convergence` says so.
    """
    stored = checkpoint.load() if checkpoint else None
    total = rounds = 0
    more = 1.0  # steps that seem to be wanted, over those since the last adaptation
    if stored is None:
        ensembles = _start(posterior, settings, seed)
    else:
        total, rounds = (int(x) for x in stored["counts"])
        ensembles = _restore(stored, posterior.blocks)
    limit = settings.max_steps
    extended = math.ceil((1.0 + LEAST_MORE) * limit)  # of a run that was nearly long enough there
    if total > limit:
        limit = extended
    while True:
        if total:
            chain, log_prob = ensembles.kept()
            expected = effective_draws(chain)
            if progress:
                progress(total, min(expected / settings.min_ess, 1.0))
            # The full verdict only where it may be good, or is the last.
            last, more = total >= limit, 1.0
            if last or promising(chain, expected, settings):
                acceptance = ensembles.accepted / ensembles.steps
                verdict = judge(chain, log_prob, ensembles.count, acceptance, settings)
                more = verdict.wanting(settings)
                if total == settings.max_steps and more <= LEAST_MORE:  # what lacks next to nothing goes on
                    last, limit = False, extended
                if last or verdict.converged:
                    break
            if begins_anew(rounds, total, ensembles.steps, more, expected, settings):
                rounds += 1
                ensembles.adapt(together=rounds > EARLY)
        # Of a run that begins anew; what is kept of it is long enough to be judged.
        first = total if rounds < EARLY else max(total // 2, math.ceil(BURNT * settings.draws / (BURNT - 1)))
        chunk = max(FIRST_CHUNK, math.ceil(more * ensembles.steps) or first)
        chunk = min(chunk, LARGEST_CHUNK, limit - total)
        ensembles.advance(posterior.assess, chunk, settings)
        total += chunk
        if checkpoint:
            checkpoint.save({"counts": np.array([total, rounds]), **_pack(ensembles)})
    pick = thin(chain.shape[1], settings.draws)
    chain, log_prob = (np.ascontiguousarray(array[:, pick]) for array in (chain, log_prob))
    walker = np.repeat(np.arange(ensembles.count), len(chain) // ensembles.count)
    return Samples(posterior.names, chain, log_prob, walker, verdict)


def begins_anew(rounds: int, total: int, steps: int, more: float, expected: float, settings: SamplerSettings) -> bool:
    """Whether proposals are fitted once more, and all draws before forgotten.

    The first rounds are for that.  Later a run that is soon long enough is not begun anew, nor one of which what is
    left would be the shorter part, unless most of the draws that it wants lack.

    Parameters
    ----------
    rounds : int
        How often they have been.
    total, steps : int
        Steps in all, and since they were.
    more : float
        Steps that seem to be wanted, over those since.
    expected : float
        Effective draws so far.
    """
    if rounds < EARLY:
        return True
    far = rounds == EARLY and FAR_FROM_ENOUGH * expected < settings.min_ess
    left = total + steps <= settings.max_steps
    return rounds < ADAPTATIONS and more >= 1.0 and left and (far or 2 * steps >= total)


def _start(posterior: Posterior, settings: SamplerSettings, seed: np.random.SeedSequence) -> Ensembles:
    """Ensembles of walkers round optima, wider than the posterior seems, so that ensembles that agree have mixed."""
    d = len(posterior.priors)
    count = max(settings.walkers, 2 * max(block.members.size for block in posterior.blocks))
    count += count % 2
    *children, sampling = seed.spawn(settings.ensembles + 1)
    searches, drawings = zip(*(child.spawn(2) for child in children), strict=True)
    optima = find_optima(posterior, [np.random.default_rng(search) for search in searches])
    proposals, coords, log_prob = [], np.empty((0, d)), np.empty(0)
    for i, (proposal, drawing) in enumerate(zip(optima, drawings, strict=True), 1):
        rng = np.random.RandomState(np.random.MT19937(drawing))
        width, top = OVERDISPERSED, posterior.log_prob(proposal.centre[None])[0]
        while len(coords) < i * count:
            new = StudentT(proposal.centre, proposal.cholesky * width).draw(rng, count)
            value = posterior.log_prob(new)
            good = value > top - FAR_BELOW
            coords, log_prob = np.concatenate([coords, new[good]]), np.concatenate([log_prob, value[good]])
            width *= 0.7
        coords, log_prob = coords[: i * count], log_prob[: i * count]
        proposals.append([conditional(proposal, block.members, block.given) for block in posterior.blocks])
    state = np.random.RandomState(np.random.MT19937(sampling)).get_state()
    return Ensembles(settings.ensembles, posterior.blocks, proposals, coords.copy(), log_prob.copy(), state)


def _pack(ensembles: Ensembles) -> dict[str, Any]:
    """Arrays from which `_restore` makes the same ensembles; of a random state its keys, its counters, its cache."""
    state = ensembles.random_state
    packed = {
        "shape": np.array([ensembles.count, len(ensembles.proposals)]),
        **{key: getattr(ensembles, key) for key in ("coords", "log_prob", "accepted")},
        **{key: np.concatenate(getattr(ensembles, key)) for key in ("chain", "log_probs")},
        "keys": state[1],
        "counters": np.array(state[2:4]),
        "cache": np.array(state[4]),
    }
    for i, own in enumerate(ensembles.proposals):
        for j, one in enumerate(own):
            arrays = {"weight": one.whole.weight} | {
                key: np.array([getattr(part, key) for part in one.whole.parts]) for key in _PART
            }
            packed |= {f"{key} {i} {j}": value for key, value in arrays.items()}
    return packed


def _restore(stored: dict[str, Any], blocks: Sequence[Block]) -> Ensembles:
    count, owners = stored["shape"].tolist()
    state = ("MT19937", stored["keys"], *stored["counters"].tolist(), float(stored["cache"]))

    def proposal(i: int, j: int) -> Conditional:
        weight, *parts = (stored[f"{key} {i} {j}"] for key in ("weight", *_PART))
        each = tuple(StudentT(centre, cholesky, float(nu)) for centre, cholesky, nu in zip(*parts, strict=True))
        return Conditional(Mixture(weight, each), blocks[j].members, blocks[j].given)

    proposals = [[proposal(i, j) for j in range(len(blocks))] for i in range(owners)]
    chain, log_probs, accepted = [stored["chain"]], [stored["log_probs"]], float(stored["accepted"])
    start = stored["coords"], stored["log_prob"], state
    return Ensembles(count, blocks, proposals, *start, chain, log_probs, accepted)
