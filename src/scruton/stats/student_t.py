"""The multivariate Student-t that samplers and evidences propose from."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import gammaln

from scruton.arrays import FloatArray, IntArray, thin

# A proposal from the curvature at the optimum fits a near-normal posterior; one fitted to draws meets heavier tails.
AT_OPTIMUM, FITTED_TO_DRAWS = 10.0, 5.0
_ROUNDS = 12  # of the fits to draws
_ENOUGH = 2000  # draws that a mixture is fitted to
# Parts of a mixture fitted to draws; of the one of them all the weight, and how much wider it is than they are.
_PARTS, _WHOLE, _WIDER = 4, 0.15, 1.5


class NoVolumeError(ValueError):
    """Points fill no volume: no proposal can be fitted to them."""


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
        return self.log_density_at(self.distance(x))

    def log_density_at(self, distance: FloatArray) -> FloatArray:
        """Log density at squared distances, (size,)."""
        nu, d = self.degrees_of_freedom, self.centre.size
        return np.asarray(self.inverse[1] - 0.5 * (nu + d) * np.log1p(distance / nu))

    def distance(self, x: FloatArray) -> FloatArray:
        """Squared distance from the centre in units of the scale, (size,)."""
        z = (x - self.centre) @ self.inverse[0]
        return np.asarray(np.einsum("ij,ij->i", z, z))

    def marginal(self, columns: IntArray) -> "StudentT":
        """Of some coordinates, in the order asked for."""
        rows = self.cholesky[columns]
        return StudentT(self.centre[columns], np.linalg.cholesky(rows @ rows.T), self.degrees_of_freedom)

    @cached_property
    def inverse(self) -> tuple[FloatArray, float]:
        """Transposed inverse of the Cholesky factor, and the logarithm of the normalising constant."""
        nu, d = self.degrees_of_freedom, self.centre.size
        constant = gammaln(0.5 * (nu + d)) - gammaln(0.5 * nu) - 0.5 * d * np.log(nu * np.pi)
        return np.linalg.inv(self.cholesky).T, float(constant - np.log(np.diag(self.cholesky)).sum())


@dataclass(frozen=True, eq=False)
class Mixture:
    """Weighted Student-t: `weight` (K,), which sum to one, and as many `parts`."""

    weight: FloatArray
    parts: tuple[StudentT, ...]

    def distances(self, x: FloatArray) -> FloatArray:
        """Squared distances from each part, (K, size)."""
        return np.stack([part.distance(x) for part in self.parts])

    def log_terms(self, distances: FloatArray) -> FloatArray:
        """Log density of each part times its weight, (K, size), at distances from them."""
        density = [part.log_density_at(distance) for part, distance in zip(self.parts, distances, strict=True)]
        return np.log(self.weight)[:, None] + np.stack(density)


@dataclass(frozen=True, eq=False)
class Conditional:
    """Some coordinates of a mixture given others: a mixture whose centres are regressions on them.

    The scale of a part is that at the centre of the others; the exact one, which grows with their distance, would ask
    for a degree of freedom of its own, and as a proposal it need not be exact.

    Attributes
    ----------
    whole : Mixture
        Of the coordinates `given`, then of `members`.
    members, given : arrays of int
        Their columns among all coordinates; nothing need be given.
    """

    whole: Mixture
    members: IntArray
    given: IntArray

    @cached_property
    def _shares(self) -> FloatArray:
        """Log weights, (parts, 1)."""
        return np.asarray(np.log(self.whole.weight)[:, None])

    @cached_property
    def _centres(self) -> FloatArray:
        """Of the members, (parts, 1, members)."""
        return np.stack([part.centre[self.given.size :] for part in self.whole.parts])[:, None]

    @cached_property
    def _others(self) -> "_Stack":
        """What is given, by itself."""
        size = self.given.size
        parts = [StudentT(p.centre[:size], p.cholesky[:size, :size], p.degrees_of_freedom) for p in self.whole.parts]
        return _Stack(parts)

    @cached_property
    def _slopes(self) -> FloatArray:
        """Of the regressions on what is given, (parts, given, members)."""
        size = self.given.size
        roots = np.stack([part.cholesky for part in self.whole.parts])
        return np.linalg.solve(roots[:, :size, :size].swapaxes(1, 2), roots[:, size:, :size].swapaxes(1, 2))

    @cached_property
    def _residuals(self) -> "_Stack":
        """About the regressions."""
        size = self.given.size
        zero = np.zeros(self.members.size)
        return _Stack([StudentT(zero, p.cholesky[size:, size:], p.degrees_of_freedom) for p in self.whole.parts])

    def draw(self, x: FloatArray, rng: np.random.RandomState) -> tuple[FloatArray, FloatArray]:
        """Draw the members anew at points (N, d): (N, k), and log ratios of the densities of the way back and there."""
        size, residuals = self.given.size, self._residuals
        share, centres = self._shares, self._centres
        if size:
            away = x[:, self.given] - self._others.centre
            share = share + self._others.log_density(away)
            centres = centres + away @ self._slopes
        total = np.cumsum(np.exp(share - share.max(axis=0)), axis=0)
        which = (rng.random_sample(len(x)) * total[-1] >= total[:-1]).sum(axis=0)
        members = residuals.draw(which, rng)
        members += centres[which, np.arange(len(x)) if size else 0]

        def density(points: FloatArray) -> FloatArray:
            return np.asarray(np.logaddexp.reduce(share + residuals.log_density(points - centres), axis=0))

        return members, density(x[:, self.members]) - density(members)


class _Stack:
    """Several Student-t of as many dimensions, side by side."""

    def __init__(self, parts: Sequence[StudentT]) -> None:
        self.parts = parts
        self.centre = np.stack([part.centre for part in parts])[:, None]  # (parts, 1, d)
        self._inverse = np.stack([part.inverse[0] for part in parts])
        self._constant = np.array([part.inverse[1] for part in parts])[:, None]
        self._nu = np.array([part.degrees_of_freedom for part in parts])[:, None]

    def log_density(self, away: FloatArray) -> FloatArray:
        """Log densities at distances (parts, N, d) from their centres, (parts, N)."""
        z = away @ self._inverse
        distance = np.einsum("kij,kij->ki", z, z)
        return np.asarray(self._constant - 0.5 * (self._nu + z.shape[-1]) * np.log1p(distance / self._nu))

    def draw(self, which: IntArray, rng: np.random.RandomState) -> FloatArray:
        """Draw distances from the centre of the part that is asked for, (N, d)."""
        fast = np.random.Generator(rng._bit_generator)  # as `StudentT.draw`
        nu = self._nu[which, 0]
        z = fast.standard_normal((which.size, self.centre.shape[-1]))
        z /= np.sqrt(fast.chisquare(nu) / nu)[:, None]
        for k, part in enumerate(self.parts):
            rows = which == k
            z[rows] = z[rows] @ part.cholesky.T
        return z


def conditional(whole: StudentT, members: IntArray, given: IntArray) -> Conditional:
    """Coordinates of a Student-t given others of them; the rest is integrated out."""
    return Conditional(Mixture(np.ones(1), (whole.marginal(np.r_[given, members]),)), members, given)


def fit_mixture(points: FloatArray) -> Mixture:
    """Mixture of Student-t that looks like points (N, d): one of them all, and `_PARTS` of what parts they fall into.

    The one of all is wider than they are and has a fixed weight: tails that the others miss are proposed all the same.

    Raises
    ------
    NoVolumeError
        If the points fill no volume.

    Notes
    -----
    Expectation-maximisation; each part's scale holds d draws with that of all, so that few points fill a volume.
    """
    points = points[thin(len(points), _ENOUGH)]
    n, d = points.shape
    whole = maximum_likelihood(points, FITTED_TO_DRAWS)
    scale = whole.cholesky @ whole.cholesky.T
    z = np.linalg.solve(whole.cholesky, (points - whole.centre).T).T
    away = z[:, None] - z[np.random.default_rng(0).choice(n, _PARTS, replace=False)]
    log_share = np.einsum("nkd,nkd->kn", away, away) * (-0.5 / d)
    gain = np.ones((_PARTS, n))
    for _ in range(_ROUNDS):
        share = np.exp(log_share - np.logaddexp.reduce(log_share, axis=0))
        parts = []
        for r, g in zip(share, gain, strict=True):
            weight = r * g
            centre, squares = _weighted(points, weight)
            parts.append(StudentT(centre, _root((squares + d * scale) / (r.sum() + d)), AT_OPTIMUM))
        mixture = Mixture(share.mean(axis=1), tuple(parts))
        distances = mixture.distances(points)
        gain = (AT_OPTIMUM + d) / (AT_OPTIMUM + distances)
        log_share = mixture.log_terms(distances)
    wide = StudentT(whole.centre, whole.cholesky * _WIDER, FITTED_TO_DRAWS)
    return Mixture(np.r_[_WHOLE, (1.0 - _WHOLE) * mixture.weight], (wide, *mixture.parts))


def maximum_likelihood(points: FloatArray, degrees_of_freedom: float) -> StudentT:
    """Student-t of the greatest likelihood to points (N, d): those far out count for little.

    Raises
    ------
    NoVolumeError
        If the points fill no volume.

    Notes
    -----
    Expectation-maximisation, w_i = (nu + d)/(nu + z_i^2) (Liu & Rubin, Statistica Sinica 5, 1995).
    """
    d = points.shape[1]
    centre, scale = np.median(points, axis=0), np.atleast_2d(np.cov(points.T))
    for _ in range(_ROUNDS):
        z = np.linalg.solve(_root(scale), (points - centre).T)
        weight = (degrees_of_freedom + d) / (degrees_of_freedom + np.einsum("ij,ij->j", z, z))
        centre, squares = _weighted(points, weight)
        scale = squares / len(points)
    return StudentT(centre, _root(scale), degrees_of_freedom)


def _root(scale: FloatArray) -> FloatArray:
    """Lower Cholesky factor of the scale of points, (d, d)."""
    try:
        return np.linalg.cholesky(scale)
    except np.linalg.LinAlgError as error:
        raise NoVolumeError("the draws fill no volume: no proposal can be fitted to them") from error


def _weighted(points: FloatArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weighted mean of points (N, d), (d,), and the weighted sum of the squares about it, (d, d)."""
    centre = weight @ points / weight.sum()
    away = points - centre
    return centre, (away * weight[:, None]).T @ away


def fit_student_t(points: FloatArray, weight: FloatArray | None = None) -> StudentT:
    """Student-t with the mean and covariance of points (N, d) whose weights (N,) add up to one; equal if left out.

    Raises
    ------
    NoVolumeError
        If the points fill no volume.
    """
    weight = np.full(len(points), 1.0 / len(points)) if weight is None else weight
    centre = weight @ points
    deviation = points - centre
    covariance = (deviation * weight[:, None]).T @ deviation
    return StudentT(centre, _root(covariance), FITTED_TO_DRAWS)
