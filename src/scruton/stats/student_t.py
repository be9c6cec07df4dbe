"""The multivariate Student-t that samplers and evidences propose from."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import gammaln

from scruton.arrays import FloatArray

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
        return np.asarray(self.centre + (z @ self.cholesky.T) / shrink[:, None])

    def log_density(self, x: FloatArray) -> FloatArray:
        """Log density, (size,)."""
        nu, d = self.degrees_of_freedom, self.centre.size
        inverse, constant = self._inverse
        z = (x - self.centre) @ inverse
        return np.asarray(constant - 0.5 * (nu + d) * np.log1p(np.einsum("ij,ij->i", z, z) / nu))

    @cached_property
    def _inverse(self) -> tuple[FloatArray, float]:
        """Transposed inverse of the Cholesky factor, and the logarithm of the normalising constant."""
        nu, d = self.degrees_of_freedom, self.centre.size
        constant = gammaln(0.5 * (nu + d)) - gammaln(0.5 * nu) - 0.5 * d * np.log(nu * np.pi)
        return np.linalg.inv(self.cholesky).T, float(constant - np.log(np.diag(self.cholesky)).sum())


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
