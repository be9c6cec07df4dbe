"""The moves of the walkers: Metropolis-Hastings on blocks of coordinates, for several ensembles side by side.

The walkers of all ensembles stand in one array, those of one ensemble next to each other, so that the posterior is
asked for all of them at once.  Ensembles know nothing of each other all the same: a proposal is an ensemble's own, and
what moves a walker by others, emcee's differential evolution and stretch, moves it by those of its ensemble.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any, Protocol

import emcee
import numpy as np
from emcee.moves import DEMove, StretchMove

from scruton.arrays import FloatArray, IntArray
from scruton.stats.convergence import SamplerSettings
from scruton.stats.posterior import Block
from scruton.stats.student_t import Conditional
from scruton.stats.thresholds import MORE_LOCAL

Assess = Callable[[FloatArray, FloatArray | None], tuple[FloatArray, FloatArray]]  # `Posterior.assess`
Drawn = tuple[FloatArray, FloatArray]  # points, and the log ratios of the densities of the way back and there


class Proposal(Protocol):
    """What proposes a block of coordinates anew."""

    def draw(self, walkers: FloatArray, others: FloatArray, rng: np.random.RandomState) -> Drawn:
        """Draw the block of walkers (N, d): (N, k), and the log ratios, (N,).

        `others` are walkers of the same ensembles that stand still meanwhile.
        """
        ...


class Independence:
    """A block drawn from a fixed distribution given the other coordinates.

    Posteriors that look like their proposal accept almost all, so that successive draws are nearly independent.

    Parameters
    ----------
    proposals : sequence of Conditional
        One for each ensemble, or a single one for all.
    """

    def __init__(self, proposals: Sequence[Conditional]) -> None:
        self.proposals = proposals

    def draw(self, walkers: FloatArray, others: FloatArray, rng: np.random.RandomState) -> Drawn:
        """See `Proposal`; of the others nothing is asked."""
        parts = np.split(walkers, len(self.proposals))
        drawn = [proposal.draw(part, rng) for proposal, part in zip(self.proposals, parts, strict=True)]
        members, ratio = zip(*drawn, strict=True)
        return np.concatenate(members), np.concatenate(ratio)


class ByOthers:
    """A block moved as a move of emcee by other walkers does it, within each ensemble."""

    def __init__(self, move: emcee.moves.RedBlueMove, ensembles: int, members: IntArray) -> None:
        self.move, self.ensembles, self.members = move, ensembles, members

    def draw(self, walkers: FloatArray, others: FloatArray, rng: np.random.RandomState) -> Drawn:
        """See `Proposal`."""
        own, rest = (np.split(u[:, self.members], self.ensembles) for u in (walkers, others))
        self.move.setup(own[0])
        moved = [self.move.get_proposal(one, [by], rng) for one, by in zip(own, rest, strict=True)]
        members, ratio = zip(*moved, strict=True)
        return np.concatenate(members), np.concatenate(ratio)


@dataclass(eq=False)
class Walkers:
    """Where the walkers stand, (W, d), and what `Posterior.assess` says there: (W, 1 + sets) and (W, sets)."""

    coords: FloatArray
    parts: FloatArray
    told: FloatArray


class Move(Protocol):
    """One turn of a sweep."""

    def make(self, at: Walkers, rng: np.random.RandomState) -> FloatArray:
        """Move the walkers in place; the fraction of the proposals that each accepted, (W,)."""
        ...


class AtOnce:
    """Blocks that know nothing of each other are moved at once, and each is accepted by itself.

    Attributes
    ----------
    blocks : sequence of Block
        One of the whole posterior, or some with parts of their own.
    proposals : sequence of Proposal
        One for each block.
    by_halves : bool
        Whether walkers of even place are moved by those of odd place, and then the other way round; ensembles are of
        even size.
    """

    def __init__(
        self, blocks: Sequence[Block], proposals: Sequence[Proposal], assess: Assess, *, by_halves: bool
    ) -> None:
        self.blocks, self.proposals, self.assess, self.by_halves = blocks, proposals, assess, by_halves
        self._unread = all(block.unread for block in blocks)
        self._parts = np.array([block.part for block in blocks])
        moved = [np.r_[block.members, block.carried] for block in blocks]
        self._moved = np.concatenate(moved)  # columns of all blocks, and which block each is of
        self._of = np.repeat(np.arange(len(blocks)), [columns.size for columns in moved])

    def make(self, at: Walkers, rng: np.random.RandomState) -> FloatArray:
        """See `Move`."""
        which = self._parts
        accepted = np.zeros(len(at.coords))
        for own, rest in self._turns():
            walkers, parts, told = at.coords[own], at.parts[own], at.told[own]  # views, which are moved
            new = walkers.copy()
            ratio = np.empty((len(walkers), len(which)))
            for k, (block, proposal) in enumerate(zip(self.blocks, self.proposals, strict=True)):
                new[:, block.members], ratio[:, k] = proposal.draw(walkers, at.coords[rest], rng)
                if block.carried.size:
                    new[:, block.carried] += new[:, block.members] - walkers[:, block.members]
            after, told_after = self.assess(new, told if self._unread else None)
            gain = after[:, which] - parts[:, which]
            good = np.log(rng.random_sample(ratio.shape)) < gain + ratio
            if which[0] == 0:  # the whole, which moves by itself
                for of, then in ((walkers, new), (parts, after), (told, told_after)):
                    np.copyto(of, then, where=good)
            else:
                # what is in none of the blocks stays as it is
                parts[:, 0] += np.where(good, gain, 0.0).sum(axis=1)
                for of, then, columns, where in (
                    (walkers, new, self._moved, good[:, self._of]),
                    (parts, after, which, good),
                    (told, told_after, which - 1, good),
                ):
                    of[:, columns] = np.where(where, then[:, columns], of[:, columns])
            accepted[own] = good.mean(axis=1)
        return accepted

    def _turns(self) -> Iterator[tuple[slice, slice]]:
        """Which walkers move, and which stand still, in turn."""
        if self.by_halves:
            yield slice(0, None, 2), slice(1, None, 2)
            yield slice(1, None, 2), slice(0, None, 2)
        else:
            yield slice(None), slice(0)


class Sweep(emcee.moves.Move):
    """Moves in turn, each drawn by its weight from those that may be made there.

    Attributes
    ----------
    assess : callable
        `Posterior.assess`, asked once for walkers that have not been moved by this sweep; then it is remembered.
    turns : sequence of (sequence of Move, sequence of float)
        Moves of each turn and their weights; one of weight zero is left out.
    chances : sequence of float, optional
        Of each turn to be made at all; one by default, and one at least is made always.
    """

    def __init__(
        self,
        assess: Assess,
        turns: Sequence[tuple[Sequence[Move], Sequence[float]]],
        chances: Sequence[float] | None = None,
    ) -> None:
        self.assess = assess
        self.turns = [(moves, np.cumsum(weights) / np.sum(weights)) for moves, weights in turns]
        self.chances = [1.0] * len(self.turns) if chances is None else list(chances)
        self._at = Walkers(*np.empty((3, 0, 0)))

    def propose(self, model: Any, state: emcee.State) -> tuple[emcee.State, FloatArray]:
        """Move every walker; and the fraction of the proposals that each accepted."""
        if self._at.coords is not state.coords:
            self._at = Walkers(state.coords, *self.assess(state.coords, None))
        accepted, made = np.zeros(len(state.coords)), 0
        for (moves, share), chance in zip(self.turns, self.chances, strict=True):
            if chance < 1.0 and model.random.random_sample() >= chance:
                continue
            made += 1
            move = moves[int(np.searchsorted(share, model.random.random_sample(), side="right"))]
            accepted += move.make(self._at, model.random)
        state.log_prob = self._at.parts[:, 0].copy()
        return state, accepted / made


def sweep(
    blocks: Sequence[Block],
    proposals: Sequence[Sequence[Conditional]],
    settings: SamplerSettings,
    ensembles: int,
    assess: Assess,
) -> Sweep:
    """Return the move of one step: each block's, or that of neighbours at once, by the card's weights.

    Where a proposal had to be fitted to draws it may lack what they have not reached yet: the local moves, which find
    it, get several times their weight.

    Parameters
    ----------
    proposals : sequence of sequence of Conditional
        By ensemble, or of all ensembles together, and by block.
    """
    turns, chances = [], []
    for _, group in groupby(range(len(blocks)), key=lambda i: -1 if blocks[i].part else i):
        of_turn = [(blocks[i], [own[i] for own in proposals]) for i in group]
        together = [block for block, _ in of_turn]
        fixed = [Independence(proposal) for _, proposal in of_turn]
        moves = [AtOnce(together, fixed, assess, by_halves=False)]
        for move in (DEMove, StretchMove):
            local = [ByOthers(move(), ensembles, block.members) for block in together]
            moves.append(AtOnce(together, local, assess, by_halves=True))
        more = MORE_LOCAL if len(of_turn[0][1][0].whole.parts) > 1 else 1.0
        weights = settings.independence, more * settings.differential_evolution, more * settings.stretch
        turns += [(moves, weights)] * together[0].times
        chances += [together[0].chance] * together[0].times
    return Sweep(assess, turns, chances)
