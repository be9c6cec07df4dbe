"""The moves of the walkers: emcee's, for several ensembles side by side, on all coordinates or on a block of them.

The walkers of all ensembles stand in one array, those of one ensemble next to each other, so that the posterior is
asked for all of them at once.  Ensembles know nothing of each other all the same: a proposal is an ensemble's own, and
what moves a walker by others moves it by those of its ensemble.
"""

from collections.abc import Sequence
from typing import Any

import emcee
import numpy as np
from emcee.moves import DEMove, StretchMove

from scruton.arrays import FloatArray, IntArray
from scruton.stats.convergence import SamplerSettings
from scruton.stats.student_t import Conditional
from scruton.stats.thresholds import MORE_LOCAL


class IndependenceMove(emcee.moves.MHMove):
    """Metropolis-Hastings with a block drawn from a fixed distribution given the others.

    Posteriors that look like their proposal accept almost all, so that successive draws are nearly independent.

    Parameters
    ----------
    proposals : sequence of Conditional
        One for each ensemble, or a single one for all.
    """

    def __init__(self, proposals: Sequence[Conditional]) -> None:
        self.proposals = proposals
        super().__init__(self._propose)

    def _propose(self, coords: FloatArray, rng: np.random.RandomState) -> tuple[FloatArray, FloatArray]:
        if len(self.proposals) == 1:
            return self.proposals[0].draw(coords, rng)
        parts = np.split(coords, len(self.proposals))
        new = [proposal.draw(part, rng) for proposal, part in zip(self.proposals, parts, strict=True)]
        return np.concatenate([points for points, _ in new]), np.concatenate([ratio for _, ratio in new])


class WithinEnsembles(emcee.moves.RedBlueMove):
    """A move of emcee by other walkers, DE or stretch, of a block and within each ensemble.

    Walkers of even place move by those of odd place, and then the other way round: ensembles are of even size.
    """

    def __init__(self, move: emcee.moves.RedBlueMove, ensembles: int, members: IntArray) -> None:
        self.move, self.ensembles, self.members = move, ensembles, members
        super().__init__(randomize_split=False, live_dangerously=True)

    def setup(self, coords: FloatArray) -> None:
        """As emcee's move wants it."""
        self.move.setup(coords[:, self.members])

    def get_proposal(
        self, s: FloatArray, c: list[FloatArray], random: np.random.RandomState
    ) -> tuple[FloatArray, FloatArray]:
        """Points with the block moved, and the log ratios of the densities of the way back and there."""
        pairs = zip(np.split(s[:, self.members], self.ensembles), np.split(c[0], self.ensembles), strict=True)
        moved = [self.move.get_proposal(own, [others[:, self.members]], random) for own, others in pairs]
        new = s.copy()
        new[:, self.members] = np.concatenate([points for points, _ in moved])
        return new, np.concatenate([ratio for _, ratio in moved])


class Sweep(emcee.moves.Move):
    """Every block in turn, each by one of its moves, drawn by their weights.

    Attributes
    ----------
    blocks : sequence of (sequence of Move, sequence of float)
        Moves of each block and their weights; one of weight zero is left out.
    """

    def __init__(self, blocks: Sequence[tuple[Sequence[emcee.moves.Move], Sequence[float]]]) -> None:
        self.blocks = [(moves, np.cumsum(weights) / np.sum(weights)) for moves, weights in blocks]

    def propose(self, model: Any, state: emcee.State) -> tuple[emcee.State, FloatArray]:
        """Move every walker; and the fraction of the proposals that each accepted."""
        accepted = np.zeros(len(state.coords))
        for moves, share in self.blocks:
            move = moves[int(np.searchsorted(share, model.random.random_sample(), side="right"))]
            state, good = move.propose(model, state)
            accepted += good
        return state, accepted / len(self.blocks)


def sweep(proposals: Sequence[Sequence[Conditional]], settings: SamplerSettings, ensembles: int) -> Sweep:
    """Return the move of one step, each block's by the card's weights.

    Where a proposal had to be fitted to draws it may lack what they have not reached yet: the local moves, which find
    it, get several times their weight.

    Parameters
    ----------
    proposals : sequence of sequence of Conditional
        By ensemble, or of all ensembles together, and by block.
    """
    blocks = []
    for own in zip(*proposals, strict=True):
        more = MORE_LOCAL if len(own[0].whole.parts) > 1 else 1.0
        local = (WithinEnsembles(move(), ensembles, own[0].members) for move in (DEMove, StretchMove))
        weights = settings.independence, more * settings.differential_evolution, more * settings.stretch
        blocks.append(((IndependenceMove(own), *local), weights))
    return Sweep(blocks)
