"""Proposals of the ensemble: an independence move from a Student-t at the optimum, beside emcee's own.

emcee's `DESnookerMove` (3.1.6) is biased - a unit normal in four dimensions comes out with a standard deviation
of 0.86 - and is never used here.
"""

from dataclasses import dataclass
from functools import cached_property

import emcee
import numpy as np
from scipy.special import gammaln

from scruton.arrays import FloatArray
from scruton.stats.settings import SamplerSettings

# A proposal from the curvature at the optimum fits a near-normal posterior; one fitted to draws meets heavier tails.
AT_OPTIMUM, FITTED_TO_DRAWS = 10.0, 5.0


@dataclass(frozen=True, eq=False)
class StudentT:
    """Multivariate Student-t: `centre` (d,), `cholesky` (d, d) lower factor of its scale matrix."""

    centre: FloatArray
    cholesky: FloatArray
    degrees_of_freedom: float = AT_OPTIMUM

    def draw(self, rng: np.random.RandomState, size: int) -> FloatArray:
        """Draw from it, (size, d)."""
        nu, d = self.degrees_of_freedom, self.centre.size
        # The same bit stream, so that emcee's saved state covers it, read by numpy's newer and faster routines.
        fast = np.random.Generator(rng._bit_generator)
        z = fast.standard_normal((size, d))
        shrink = np.sqrt(fast.chisquare(nu, size) / nu)
        draws: FloatArray = self.centre + (z @ self.cholesky.T) / shrink[:, None]
        return draws

    def log_density(self, x: FloatArray) -> FloatArray:
        """Log density, (size,)."""
        nu, d = self.degrees_of_freedom, self.centre.size
        inverse, constant = self._inverse
        z = (x - self.centre) @ inverse
        density: FloatArray = constant - 0.5 * (nu + d) * np.log1p(np.einsum("ij,ij->i", z, z) / nu)
        return density

    @cached_property
    def _inverse(self) -> tuple[FloatArray, float]:
        """Transposed inverse of the Cholesky factor, and the logarithm of the normalising constant."""
        nu, d = self.degrees_of_freedom, self.centre.size
        constant = gammaln(0.5 * (nu + d)) - gammaln(0.5 * nu) - 0.5 * d * np.log(nu * np.pi)
        return np.linalg.inv(self.cholesky).T, float(constant - np.log(np.diag(self.cholesky)).sum())


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
