"""The multivariate Student-t that samplers and evidences propose from."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import gammaln

from scruton.arrays import FloatArray, IntArray

# A proposal from the curvature at the optimum fits a near-normal posterior; one fitted to draws meets heavier tails.
AT_OPTIMUM, FITTED_TO_DRAWS = 10.0, 5.0
_ROUNDS = 12  # of the fit to draws


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
        return np.asarray(self.centre + (z @ self.cholesky.T) / shrink[:, None])

    def log_density(self, x: FloatArray) -> FloatArray:
        """Log density, (size,)."""
        nu, d = self.degrees_of_freedom, self.centre.size
        inverse, constant = self._inverse
        z = (x - self.centre) @ inverse
        return np.asarray(constant - 0.5 * (nu + d) * np.log1p(np.einsum("ij,ij->i", z, z) / nu))

    def conditional(self, block: IntArray) -> "Conditional":
        """Coordinates `block` given the others."""
        return Conditional(self, block)

    @cached_property
    def _inverse(self) -> tuple[FloatArray, float]:
        """Transposed inverse of the Cholesky factor, and the logarithm of the normalising constant."""
        nu, d = self.degrees_of_freedom, self.centre.size
        constant = gammaln(0.5 * (nu + d)) - gammaln(0.5 * nu) - 0.5 * d * np.log(nu * np.pi)
        return np.linalg.inv(self.cholesky).T, float(constant - np.log(np.diag(self.cholesky)).sum())


@dataclass(frozen=True, eq=False)
class Conditional:
    """Some coordinates of a Student-t given the others: a Student-t whose centre is a regression on them.

    The scale is that at the centre of the others; the exact one, which grows with their distance, would ask for a
    degree of freedom of its own, and as a proposal it need not be exact.
    """

    whole: StudentT
    block: IntArray

    @cached_property
    def _parts(self) -> tuple[IntArray, FloatArray, StudentT]:
        """The others, the slope on them, and the residual's distribution."""
        scale = self.whole.cholesky @ self.whole.cholesky.T
        rest = np.setdiff1d(np.arange(self.whole.centre.size), self.block)
        across, inner = scale[np.ix_(rest, self.block)], scale[np.ix_(rest, rest)]
        slope = np.linalg.solve(inner, across)
        left = scale[np.ix_(self.block, self.block)] - across.T @ slope
        residual = StudentT(np.zeros(self.block.size), np.linalg.cholesky(left), self.whole.degrees_of_freedom)
        return rest, slope, residual

    def draw(self, rng: np.random.RandomState, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points (N, d) with the block drawn anew, and the log ratio of the densities of the way back and there."""
        rest, slope, residual = self._parts
        centre = self.whole.centre[self.block] + (x[:, rest] - self.whole.centre[rest]) @ slope
        away = residual.draw(rng, len(x))
        new = x.copy()
        new[:, self.block] = centre + away
        return new, residual.log_density(x[:, self.block] - centre) - residual.log_density(away)


def maximum_likelihood(points: FloatArray, degrees_of_freedom: float) -> StudentT:
    """Student-t of the greatest likelihood to points (N, d): those far out count for little.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the points fill no volume.

    Notes
    -----
    Expectation-maximisation, w_i = (nu + d)/(nu + z_i^2) (Liu & Rubin, Statistica Sinica 5, 1995).
    """
    d = points.shape[1]
    centre, scale = np.median(points, axis=0), np.cov(points.T)
    for _ in range(_ROUNDS):
        z = np.linalg.solve(np.linalg.cholesky(scale), (points - centre).T)
        weight = (degrees_of_freedom + d) / (degrees_of_freedom + np.einsum("ij,ij->j", z, z))
        centre = weight @ points / weight.sum()
        away = points - centre
        scale = (away * weight[:, None]).T @ away / len(points)
    return StudentT(centre, np.linalg.cholesky(scale), degrees_of_freedom)


def fit_student_t(points: FloatArray, weight: FloatArray) -> StudentT:
    """Student-t with the mean and covariance of points (N, d) whose weights (N,) add up to one.

    Raises
    ------
    ValueError
        If the points fill no volume.
    """
    centre = weight @ points
    deviation = points - centre
    covariance = (deviation * weight[:, None]).T @ deviation
    try:
        return StudentT(centre, np.linalg.cholesky(covariance), FITTED_TO_DRAWS)
    except np.linalg.LinAlgError as error:
        raise ValueError("the draws fill no volume: no proposal can be fitted to them") from error
