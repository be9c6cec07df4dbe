"""Proposals of the ensemble: an independence move from a Student-t at the optimum, beside emcee's own.

emcee's `DESnookerMove` (3.1.6) is biased - a unit normal in four dimensions comes out with a standard deviation
of 0.86 - and is never used here.
"""

import emcee
import numpy as np

from scruton.arrays import FloatArray
from scruton.stats.settings import SamplerSettings
from scruton.stats.student_t import AT_OPTIMUM, StudentT


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


def moves(proposal: StudentT, settings: SamplerSettings) -> list[tuple[emcee.moves.Move, float]]:
    """Return the mixture of moves with the card's weights; a weight of zero leaves a move out.

    Where the proposal had to be fitted to draws, the posterior is no Student-t, and walkers in its tails would wait
    long for an independent proposal: the local moves get five times their weight.
    """
    local = 1.0 if proposal.degrees_of_freedom == AT_OPTIMUM else 5.0
    mixture = [
        (IndependenceMove(proposal), settings.independence),
        (emcee.moves.DEMove(), local * settings.differential_evolution),
        (emcee.moves.StretchMove(), local * settings.stretch),
    ]
    return [(move, weight) for move, weight in mixture if weight > 0]
