r"""The model of tests at other wind speeds: amplitude and relaxation are smooth in the reduced velocity v = U/(f0 D).

A test has section parameters of its own, the stable amplitude A at a fixed reference Scruton number and the relaxation
Scruton number G at zero damping, which change smoothly through lock-in:

.. math:: \ln A(v) \sim GP(m_A, s_A^2 k), \quad \ln G(v) \sim GP(m_G, s_G^2 k), \quad
   k = (1 + r + r^2/3)\,e^{-r}, \; r = \sqrt 5\,|v - v'|/l

(Matern 5/2: the upper edge of lock-in is too steep for a smoother one).  Test i on rig r at Sc_i shows

.. math:: \ln a^*_i = \ln A(v_i e^{\delta_r}) + \tfrac1n \ln(1 - n x_i) + \tau z_i, \qquad
   \ln G_i = \ln G(v_i e^{\delta_r}) + \kappa w_i, \qquad x_i = (Sc_i - Sc_{ref})/(G - n\,Sc_{ref})

the second only where it has growth or decay records: a lock-in record and a point of a sweep tell a* alone, and so G
only through rigs of several Scruton numbers.

Lock-in does not sit at the same v on every rig: with damping its peak moves by several per cent, and wind speed and
frequency have errors that all tests of a rig share.  At its steep edge that is more than any discrepancy in amplitude;
hence the shift delta_r, normal with standard deviation s_v.  It is to speeds what joining the peak tests, wherever they
lie, is to the Griffin curve.  tau and kappa are those of the peak tests; half of their variance is common to all tests
of a rig: thirty points of one sweep are no thirty settings.

This is a second stage on purpose: the tests enter as the normal summaries of their own posteriors, the discrepancies
as they are known from the peak tests, and nothing found here feeds back into either.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.laws import amplitude_ratio
from scruton.infer.thresholds import COMMON
from scruton.stats.posterior import Coordinates, Posterior
from scruton.stats.priors import Prior

_CHUNK = 250  # draws at a time
_JITTER = 1e-8
_NODES = 29  # of s_v
_HALF_LOG_2PI = 0.5 * float(np.log(2.0 * np.pi))


@dataclass(frozen=True, eq=False)
class SpeedPoint:
    """What one test, or one point of a sweep, says.

    Attributes
    ----------
    name, rig : str
    velocity : float
        U/(f0 D) with the still-air frequency.
    scruton_number, log_scruton_sd : float
        Its Sc and the standard deviation of ln Sc.
    mean, covariance : (k,) and (k, k) array
        Of ln a* (k = 1), or of (ln a*, ln G) where records of growth or decay tell the relaxation (k = 2).
    """

    name: str
    rig: str
    velocity: float
    scruton_number: float
    log_scruton_sd: float
    mean: FloatArray
    covariance: FloatArray


def log_ratio(ln_relaxation: FloatArray, scruton_numbers: FloatArray, reference: float, n: float) -> FloatArray:
    """Log of the stable amplitude at `scruton_numbers` over that at the reference, arguments broadcast.

    -inf where vibration dies (also at the reference itself, where Sc_lambda is not positive there, n > 0); +inf where
    no amplitude is stable.
    """
    at_reference = np.exp(ln_relaxation) - n * reference
    with np.errstate(divide="ignore", invalid="ignore"):
        x = (scruton_numbers - reference) / at_reference
        log_amplitude_ratio: FloatArray = np.where(at_reference > 0.0, np.log(amplitude_ratio(x, n)), -np.inf)
    return log_amplitude_ratio


class Observations:
    """The points as one vector y, linear in (ln A, ln G) about `ln_relaxation` (P,): y = f(v) and c h(v), plus noise.

    Of the M entries, each of the point `of_point`, the first P are ln a* and the rest ln G where it is `known`: as
    summarised in `raw`, linearised in `y`; `on_amplitude` and `on_relaxation` are the coefficients of f and h. `noise`
    (M, M) is the covariance of everything that is not smooth, at the central discrepancies.
    """

    def __init__(
        self,
        points: tuple[SpeedPoint, ...],
        n: float,
        reference: float,
        discrepancy: tuple[float, float],
        ln_relaxation: FloatArray | float,
    ) -> None:
        self.points, self.n, self.reference, self.discrepancy = points, n, reference, discrepancy
        self.ln_relaxation, count = ln_relaxation, len(points)
        self.scruton_number = sc = np.array([point.scruton_number for point in points])
        self.velocity = np.array([point.velocity for point in points])
        self.known = np.flatnonzero([point.mean.size == 2 for point in points])
        self.of_point = np.concatenate([np.arange(count), self.known])
        self.rigs = tuple(dict.fromkeys(point.rig for point in points))
        self.rig_of = np.array([self.rigs.index(point.rig) for point in points])
        self.on_amplitude = np.repeat([1.0, 0.0], [count, self.known.size])
        # The law is linearised where vibration is stable at Sc and at the reference.
        centre = np.broadcast_to(ln_relaxation, sc.shape)
        least = n * np.maximum(sc, reference)
        centre = np.maximum(centre, np.log(1.05 * least)) if n > 0 else centre
        g = np.exp(centre)
        sc_lambda = g - n * sc  # Sc_lambda at each point's Sc
        x = (sc - reference) / (g - n * reference)
        self.on_relaxation = np.concatenate([x * g / sc_lambda, np.ones(self.known.size)])  # d ln a*/d ln G, then one
        self.raw = np.array([point.mean[0] for point in points] + [points[i].mean[1] for i in self.known])
        self.y = self.raw.copy()
        self.y[:count] += self.on_relaxation[:count] * centre - log_ratio(centre, sc, reference, n)
        # Covariance of the summaries; that of Sc is common to the tests of a rig.
        rigs = self.rig_of[self.of_point]
        same_rig = np.asarray(rigs[:, None] == rigs, dtype=float)
        self._measured = np.zeros((self.of_point.size, self.of_point.size))
        for i, point in enumerate(points):
            where = np.flatnonzero(self.of_point == i)
            self._measured[np.ix_(where, where)] = point.covariance
        lever = sc / sc_lambda * np.array([point.log_scruton_sd for point in points])
        self._measured[:count, :count] += np.outer(lever, lever) * same_rig[:count, :count]
        # Correlations of the discrepancies of amplitude and of relaxation.
        each, a = COMMON * same_rig + (1.0 - COMMON) * np.eye(self.of_point.size), self.on_amplitude
        self._discrepancies = each * np.outer(a, a), each * np.outer(1.0 - a, 1.0 - a)
        self.noise = self.noises(np.array([discrepancy]))[0]

    def noises(self, discrepancy: FloatArray) -> FloatArray:
        """Compute `noise` at each of (S, 2) discrepancies, (S, M, M)."""
        tau, kappa = (np.square(discrepancy[:, i])[:, None, None] for i in (0, 1))
        first, second = self._discrepancies
        return np.asarray(self._measured + tau * first + kappa * second)

    def linear(self, f: FloatArray, h: FloatArray) -> FloatArray:
        """What `y` would be without noise for functions whose first P columns are at the points, (S, M)."""
        return np.asarray(self.on_amplitude * f[:, self.of_point] + self.on_relaxation * h[:, self.of_point])

    def exact(self, f: FloatArray, h: FloatArray) -> FloatArray:
        """What `raw` would be without noise, (S, M)."""
        count = len(self.points)
        shift = log_ratio(h[:, :count], self.scruton_number, self.reference, self.n)
        return np.concatenate([f[:, :count] + shift, h[:, self.known]], axis=1)


def matern(distance: FloatArray, length: FloatArray) -> FloatArray:
    """Matern 5/2 correlation at |v - v'|, arguments broadcast."""
    r = np.sqrt(5.0) * distance / length
    return np.asarray((1.0 + r + r * r / 3.0) * np.exp(-r))


@dataclass(frozen=True, eq=False)
class SpeedPosterior(Posterior):
    """Posterior of ln s_A, ln s_G, ln l and of every rig's shift of ln v; the functions and s_v are integrated out.

    Attributes
    ----------
    scales : (Prior, Prior, Prior)
        Of s_A, s_G and l.
    shift : Prior
        Of s_v, the standard deviation of the shifts.
    data : Observations
    means : pair of (float, float)
        Mean and standard deviation of the normal priors of m_A and m_G.
    """

    scales: tuple[Prior, ...]
    shift: Prior
    data: Observations
    means: tuple[tuple[float, float], tuple[float, float]]

    @cached_property
    def priors(self) -> tuple[Prior, ...]:  # type: ignore[override]
        """Those of the scales, then for every rig's shift the normal prior that it has at the median of s_v."""
        typical = float(np.exp(self.shift.location))
        return (*self.scales, *(Prior(f"shift of {rig}", "normal", 0.0, typical) for rig in self.data.rigs))

    @cached_property
    def coordinates(self) -> Coordinates:
        """The logarithms of (s_A, s_G, l), and the shifts of the rigs."""
        return Coordinates({"scales": len(self.scales), "shift": len(self.data.rigs)})

    @cached_property
    def _nodes(self) -> tuple[FloatArray, FloatArray]:
        """Values of ln s_v and the logarithms of their probabilities."""
        ln_s = self.shift.location + self.shift.scale * np.linspace(-3.5, 3.5, _NODES)
        weight = self.shift.log_density(ln_s)
        return ln_s, weight - np.log(np.exp(weight).sum())

    def shift_terms(self, u: FloatArray) -> FloatArray:
        """Log joint density of the shifts and each node of s_v, (W, nodes)."""
        ln_s, weight = self._nodes
        shifts = self.named(u)["shift"]
        squares = np.square(shifts).sum(axis=1)[:, None]
        return np.asarray(weight - 0.5 * squares * np.exp(-2.0 * ln_s) - shifts.shape[1] * (ln_s + _HALF_LOG_2PI))

    def log_prior(self, u: FloatArray) -> FloatArray:
        """Log prior density, the shifts' scale integrated out, (W,)."""
        terms = self.shift_terms(u)
        top = terms.max(axis=1)
        total = np.log(np.exp(terms - top[:, None]).sum(axis=1)) + top
        for i, prior in enumerate(self.scales):
            total = total + prior.log_density(u[:, i])
        return np.asarray(total)

    def scale_shift(self, u: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Draw s_v given the shifts, (W,)."""
        terms = self.shift_terms(u)
        # the largest of terms with Gumbel noise is a draw
        return np.asarray(np.exp(self._nodes[0][np.argmax(terms + rng.gumbel(size=terms.shape), axis=1)]))

    def guesses(self, rng: np.random.Generator, size: int) -> FloatArray:
        """Prior draws, half of them with the rigs shifted until their largest amplitudes meet, or nearly.

        Sweeps that are laid over each other askew match here and there: other modes, of which the search must not be
        the prey.
        """
        u = self.prior_draws(rng, size)
        rigs = [[point for point in self.data.points if point.rig == rig] for rig in self.data.rigs]
        highest = np.log([points[np.argmax([point.mean[0] for point in points])].velocity for points in rigs])
        met = highest.mean() - highest
        self.named(u[: size // 2])["shift"] = met + 0.01 * rng.standard_normal((size // 2, met.size))
        return u

    def places(self, u: FloatArray) -> FloatArray:
        """Reduced velocity at which each point meets the functions, (W, P)."""
        return np.asarray(self.data.velocity * np.exp(self.named(u)["shift"][:, self.data.rig_of]))

    def _scales(self, u: FloatArray) -> FloatArray:
        """s_A, s_G and l, (3, ...)."""
        return np.moveaxis(np.exp(self.named(u)["scales"]), -1, 0)

    @cached_property
    def _departure(self) -> FloatArray:
        """Data less their prior mean, (M,)."""
        (a, _), (g, _) = self.means
        return np.asarray(self.data.y - a * self.data.on_amplitude - g * self.data.on_relaxation)

    @property
    def arrays(self) -> tuple[FloatArray, ...]:
        """Everything that the likelihood depends on."""
        return self.data.y, self.data.noise, self.data.velocity, self.data.on_relaxation, np.array(self.means)

    def covariance(self, u: FloatArray, noise: FloatArray) -> FloatArray:
        """Covariance of the data given the coordinates (W, d), (W, M, M)."""
        v = self.places(u)
        *scales, length = self._scales(u)
        k = matern(np.abs(v[:, :, None] - v[:, None, :]), length[:, None, None])
        k = k[:, self.data.of_point[:, None], self.data.of_point]
        total = np.broadcast_to(noise, k.shape).copy()
        coefficients = self.data.on_amplitude, self.data.on_relaxation
        for scale, c, (_, sd) in zip(scales, coefficients, self.means, strict=True):
            total += np.outer(c, c) * (np.square(scale)[:, None, None] * k + sd**2)
        return total

    def log_likelihood(self, u: FloatArray) -> FloatArray:
        """Log density of the data, (W,)."""
        size = self._departure.size
        bordered = np.empty((len(u), size + 1, size + 1))
        bordered[:, :size, :size] = self.covariance(u, self.data.noise)
        bordered[:, size, :size] = bordered[:, :size, size] = self._departure
        bordered[:, size, size] = 1e12 + np.square(self._departure).sum() / np.diag(self.data.noise).min()
        # The factor's last row is the whitened departure.
        factor = np.linalg.cholesky(bordered)
        half_log_determinant = np.log(np.diagonal(factor, axis1=1, axis2=2)[:, :size]).sum(axis=1)
        return np.asarray(-0.5 * np.square(factor[:, size, :size]).sum(axis=1) - half_log_determinant)

    def smoothed_relaxation(self, u: FloatArray) -> FloatArray:
        """Posterior mean of h at every point at one place (d,), (P,)."""
        v, (_, scale, length) = self.places(u[None])[0], self._scales(u)
        (_, _), (mean, sd) = self.means
        cross = (scale**2 * matern(np.abs(v[:, None] - v), length) + sd**2)[:, self.data.of_point]
        gain = np.linalg.solve(self.covariance(u[None], self.data.noise)[0], self._departure)
        return np.asarray(mean + (cross * self.data.on_relaxation) @ gain)

    def functions(
        self, u: FloatArray, discrepancy: FloatArray, grid: FloatArray, rng: np.random.Generator
    ) -> tuple[FloatArray, FloatArray]:
        """Draw (f, h) on the grid (V,) for each of (S, d) coordinates and (S, 2) discrepancies.

        Returns
        -------
        values : (S, 2, V) array
            Draws under the linearised law (a prior draw, corrected by its own misfit: Matheron's rule).
        log_weight : (S,) array
            Log likelihood under the exact law less that under the linearised one.
        """
        if len(u) > _CHUNK:
            parts = [slice(start, start + _CHUNK) for start in range(0, len(u), _CHUNK)]
            draws = [self.functions(u[part], discrepancy[part], grid, rng) for part in parts]
            values, log_weight = (np.concatenate(chunks) for chunks in zip(*draws, strict=True))
            return values, log_weight
        data, size, count = self.data, len(u), len(self.data.points)
        *scales, length = self._scales(u)[..., None]
        noise = data.noises(discrepancy)
        v = np.concatenate([self.places(u), np.broadcast_to(grid, (size, grid.size))], axis=1)
        k = matern(np.abs(v[:, :, None] - v[:, None, :]), length[:, None]) + _JITTER * np.eye(v.shape[1])
        root = np.linalg.cholesky(k)

        def normal(*shape: int) -> FloatArray:
            return rng.standard_normal((size, *shape))

        f, h = (
            m + sd * normal(1) + scale * (root @ normal(v.shape[1], 1))[..., 0]
            for scale, (m, sd) in zip(scales, self.means, strict=True)
        )
        error = (np.linalg.cholesky(noise) @ normal(data.y.size, 1))[..., 0]
        misfit = data.y - data.linear(f, h) - error
        gain = np.linalg.solve(self.covariance(u, noise), misfit[..., None])[..., 0]
        coefficients = data.on_amplitude, data.on_relaxation
        for function, scale, c, (_, sd) in zip((f, h), scales, coefficients, self.means, strict=True):
            weighted = (c * gain)[..., None]
            smooth = (k[:, :, data.of_point] @ weighted)[..., 0]
            function += np.square(scale) * smooth + sd**2 * weighted.sum(axis=1)
        exact = data.raw - data.exact(f, h)
        alive = np.isfinite(exact).all(axis=1)
        pair = np.stack([np.where(alive[:, None], exact, 0.0), data.y - data.linear(f, h)], axis=-1)
        cost = np.einsum("smi,smi->si", pair, np.linalg.solve(noise, pair))
        return np.stack([f, h], axis=1)[:, :, count:], np.where(alive, 0.5 * (cost[:, 1] - cost[:, 0]), -np.inf)
