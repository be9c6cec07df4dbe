"""The posteriors that are sampled: a test in wind, a rig in still air, the trial function of one record.

Each is a `Posterior`: its priors, and a log likelihood over an array of walkers.  They know arrays only; the
campaign is unpacked in `scruton.infer.fit`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from scruton.arrays import FloatArray, end_to_end
from scruton.dynamics.cycles import EnvelopeData
from scruton.dynamics.departure import COLUMNS
from scruton.dynamics.filter import innovations_of
from scruton.dynamics.laws.law import Law
from scruton.dynamics.likelihood import Wind, innovations, log_likelihood, pointwise_log_likelihood, statics
from scruton.dynamics.trial_filter import trial_amplitudes, trial_log_likelihood
from scruton.infer.thresholds import DEPARTURE_IN_COMMON, MOST_GUSTS, MOST_SET_POINT
from scruton.infer.varying import VaryingDamping
from scruton.stats.posterior import Coordinates, Posterior
from scruton.stats.priors import Prior

TRIAL_GUESSES = 64  # prior draws looked at for each guess: with 16, 3 searches of 176 ended in a lesser optimum
# Parameters of a test in wind under a law that is given.
NOISE = (
    "amplitude_scatter", "noise_factor", "gust_scatter", "gust_time", "set_point_scatter", "departure_scale",
)  # fmt: skip
# What is more than this is no wind of a tunnel, but something that the model lacks.
_MOST = {"gust_scatter": MOST_GUSTS, "set_point_scatter": MOST_SET_POINT, "departure_scale": np.inf}
SHARED_DEPARTURE = "shared_departure"  # of several tests, by a campaign
WIND = ("stable_amplitude", "relaxation_ratio", *NOISE, "damping_ratio")


@dataclass(frozen=True, eq=False)
class SteadyAmplitude:
    """What a lock-in record without release says by itself.

    Attributes
    ----------
    mean, standard_error : float
        Mean amplitude, A/D or rad, and its standard error by what fluctuates within the record.
    length : float
        Of the record [s].
    """

    mean: float
    standard_error: float
    length: float

    def variance(self, wind: Wind) -> FloatArray:
        r"""Variance of the mean about the stable amplitude, (W,).

        The record has a set-point of its own.  A gust of scatter s_g moves its mean by a variance of s_g^2 v,

        .. math:: v = \frac{2}{x} \left(1 - \frac{1 - e^{-x}}{x}\right), \quad x = T/T_g,

        and fluctuates about that by s_g^2 (1 - v).  Its standard error knows of what fluctuates, and so of that share
        of the gust already; the other share v is added, none of a record that is long and all of one that is short.
        """
        x = np.maximum(wind.gust_rate * self.length, 1e-4)  # below, all digits cancel, and v is one
        v = 2.0 / x * (1.0 + np.expm1(-x) / x)
        return np.asarray(self.standard_error**2 + np.square(wind.set_point) + np.square(wind.gust * v))


@dataclass(frozen=True, eq=False)
class WindPosterior(Posterior):
    """One test in wind: (a*, lambda/omega0, its noise, xi_s) from the envelopes of its records.

    Noise is broad-band scatter, the factor on the standard errors, and gusts: a slow fluctuation of the stable
    amplitude, of a scatter over it and of a time in relaxation times; and the wind is set anew for every record, which
    gives the stable amplitude of each a scatter of its own.  Of no law it is sure: a smooth departure from it, of a
    scale that the records tell, is integrated out (`scruton.dynamics.departure`).

    Attributes
    ----------
    priors : tuple of Prior
        Of the parameters `WIND`, and of "law_exponent" where n is free; without a prior of gusts, set-points or
        departures there are none.
    data : EnvelopeData
        Cycles of the transient records, end to end.
    steady : sequence of SteadyAmplitude
        Lock-in records, each of which gives the stable amplitude alone, at a set-point of its own.
    omega0 : float
        Natural circular frequency in still air [rad/s].
    n : float or None
        The law; None where n is free, which makes it a parameter.
    initial_sd : float
        Prior of the initial amplitude.
    varying : VaryingDamping, optional
        xi_s(A) where it varies: then lambda and the law are those of the wind alone, and the drift has this in it.
    shares : bool
        Whether a campaign says, by z (W, COLUMNS), what the departure has in common with those of other tests: its
        columns are s (sqrt(rho) z + sqrt(1 - rho) e), rho = `DEPARTURE_IN_COMMON`, and e is integrated out.
    """

    priors: tuple[Prior, ...]
    data: EnvelopeData
    steady: Sequence[SteadyAmplitude]
    omega0: float
    n: float | None = -1.0
    initial_sd: float = 1.0
    varying: VaryingDamping | None = None
    shares: bool = False

    @cached_property
    def coordinates(self) -> Coordinates:
        """One column for each prior, and what a campaign may hold the priors of: a free exponent, and z."""
        names = self.names if self.n is not None else (*self.names, "law_exponent")
        of_campaign = {SHARED_DEPARTURE: COLUMNS} if self.shares else {}
        return Coordinates(dict.fromkeys(names) | of_campaign)

    def exponents(self, u: FloatArray) -> FloatArray:
        """N of every walker, (W,)."""
        # A column of u is another type than a row of numbers, for which kernels are compiled once more.
        return np.array(self.named(u)["law_exponent"]) if self.n is None else np.full(u.shape[:-1], self.n)

    def state_space(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, Wind]:
        """(a_star, lambda [1/s] of the whole drift, q, r, the rest) of the filter from coordinates, each (W,)."""
        log, none = self.named(u), np.full(len(u), -np.inf)
        a_star, lam, known = np.exp(log["stable_amplitude"]), np.exp(log["relaxation_ratio"]) * self.omega0, None
        if self.varying:
            known = self.varying.departure(log["stable_amplitude"], lam, self.exponents(u), self.omega0)
            lam = lam * self.rate_ratio(u)
        # Stationary sd of an Ornstein-Uhlenbeck process: q / sqrt(2 lambda).
        q = np.exp(log["amplitude_scatter"]) * a_star * np.sqrt(2.0 * lam)
        gust, set_point, departure = (
            np.minimum(np.exp(log[name] if name in self.names else none), most) for name, most in _MOST.items()
        )
        rate = lam * np.exp(-log["gust_time"]) if "gust_time" in self.names else lam
        own = 1.0
        if self.shares:
            own -= DEPARTURE_IN_COMMON
            shared = departure[:, None] * self.shared_columns(u)
            known = shared if known is None else known + shared
        wind = Wind(gust * a_star, rate, set_point * a_star, departure, known, own)
        return a_star, lam, q, np.exp(log["noise_factor"]), wind

    def shared_columns(self, u: FloatArray) -> FloatArray:
        """Mean of the columns of the departure over its scale, (W, COLUMNS), where other tests have a part in it."""
        return np.asarray(np.sqrt(DEPARTURE_IN_COMMON) * self.named(u)[SHARED_DEPARTURE])

    def rate_ratio(self, u: FloatArray) -> FloatArray:
        """Relaxation rate of the whole drift over that of the law, (W,): one where structural damping is constant."""
        if self.varying is None:
            return np.ones(len(u))
        log = self.named(u)
        rate = np.exp(log["relaxation_ratio"]) * self.omega0
        return self.varying.total_rate(log["stable_amplitude"], rate, self.omega0) / rate

    def departures(self, u: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Draw the columns of the departure from the law given the records, one draw a walker, (W, COLUMNS)."""
        mean, cov = statics(self.data, *self.state_space(u), n=self.exponents(u), initial_sd=self.initial_sd)
        mean = np.where(np.isfinite(mean), mean, 0.0)
        return np.asarray(mean + np.einsum("wij,wj->wi", _root(cov), rng.standard_normal(mean.shape)))

    def log_likelihood(self, u: FloatArray) -> FloatArray:
        """State-space likelihood of the transients, normal likelihood of the steady amplitudes, (W,)."""
        space = self.state_space(u)
        total = np.zeros(len(u))
        if self.data.size:
            total = log_likelihood(self.data, *space, n=self.exponents(u), initial_sd=self.initial_sd)
        return np.asarray(total + self.log_steady(u))

    def log_steady(self, u: FloatArray) -> FloatArray:
        """Normal log likelihood of the steady amplitudes, (W,)."""
        total = np.zeros(len(u))
        a_star, *_, wind = self.state_space(u)
        for level in self.steady:
            variance = level.variance(wind)
            total -= 0.5 * ((level.mean - a_star) ** 2 / variance + np.log(variance))
        return total

    def pointwise(self, u: FloatArray) -> FloatArray:
        """Conditional log likelihood of every cycle, (W, N)."""
        return pointwise_log_likelihood(*self.innovations(u)).T

    def innovations(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Innovations and their variances, (N, W)."""
        return innovations(self.data, *self.state_space(u), n=self.exponents(u), initial_sd=self.initial_sd)

    def standardised(self, chain: FloatArray) -> FloatArray:
        """Innovations over their standard deviations at the median of draws (..., d), (N,)."""
        innovation, variance = self.innovations(np.median(end_to_end(chain), axis=0)[None])
        return np.asarray(innovation[:, 0] / np.sqrt(variance[:, 0]))


def _root(cov: FloatArray) -> FloatArray:
    """A root of every covariance, (W, k, k): Cholesky's, and where rounding has left none the symmetric one.

    What a filter that lost its way gives, no numbers or infinite ones, has none, and then nothing departs.
    """
    cov = np.where(np.isfinite(cov).all(axis=(1, 2), keepdims=True), cov, 0.0)
    try:
        return np.linalg.cholesky(cov + 1e-12 * np.eye(cov.shape[-1]))
    except np.linalg.LinAlgError:
        value, vector = np.linalg.eigh(cov)
        return np.asarray(vector * np.sqrt(np.maximum(value, 0.0))[:, None, :])


@dataclass(frozen=True, eq=False)
class StillAirPosterior(Posterior):
    """The ring-downs of one rig: (xi_s, scatter, noise factor); the envelope relaxes to zero at omega0 xi_s.

    The scatter is the sd that the process noise builds up over one radian of decay, over the first amplitude: it
    takes up draughts and what a constant damping ratio leaves out, so that the posterior of xi_s is honest about both.
    """

    priors: tuple[Prior, ...]
    data: EnvelopeData
    omega0: float
    first_amplitude: float
    initial_sd: float = 1.0

    def state_space(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """(0, omega0 xi_s, q, r) of the filter, each (W,)."""
        log = self.named(u)
        lam = np.exp(log["damping_ratio"]) * self.omega0
        q = np.exp(log["still_air_scatter"]) * self.first_amplitude * np.sqrt(2.0 * lam)
        return np.zeros(len(u)), lam, q, np.exp(log["noise_factor"])

    def log_likelihood(self, u: FloatArray) -> FloatArray:
        """Exact state-space likelihood, (W,)."""
        return log_likelihood(self.data, *self.state_space(u), initial_sd=self.initial_sd)

    def innovations(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Innovations and their variances, (N, W)."""
        return innovations(self.data, *self.state_space(u), initial_sd=self.initial_sd)


@dataclass(frozen=True, eq=False)
class TrialPosterior(Posterior):
    r"""The constants of :math:`\bar A(t) = a e^{bt} + c e^{dt}` (Eq. 4) for one record.

    Sampled: b and b - d over omega, so that b > d and the twin in which the terms change places is excluded, and what
    describes the residual.  a and c enter linearly and are integrated out: where b is near d they cancel along a ridge
    on which samplers get lost.

    The residual is an Ornstein-Uhlenbeck process plus sensor noise: neighbouring cycles of a turbulent record are not
    independent, and constants fitted as if they were have bands that are several times too narrow.  It forgets itself
    within the record: one that does not is a constant, a third term beside the two, in a mode of its own.

    Attributes
    ----------
    priors : tuple of Prior
        Of what is sampled.
    amplitude : Prior
        Of a and of c over `scale`, normal.
    data : EnvelopeData
        Of one record.
    omega : float
        Circular frequency of the record [rad/s].
    scale : float
        Its largest amplitude, A/D or rad.
    """

    priors: tuple[Prior, ...]
    amplitude: Prior
    data: EnvelopeData
    omega: float
    scale: float

    def rates(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Give b and d of Eq. (4) [1/s], arrays of the leading shape."""
        values = self.named(u)
        b = values["b"] * self.omega
        return b, b - np.exp(values["rate_gap"]) * self.omega

    def residual(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Standard deviation (A/D or rad) and rate (1/s) of the residual; arrays of the leading shape."""
        log = self.named(u)
        slowest = 1.0 / (self.data.time[-1] - self.data.time[0])
        return np.exp(log["trial_residual"]) * self.scale, slowest + np.exp(log["trial_residual_rate"]) * self.omega

    def _model(self, u: FloatArray) -> tuple[EnvelopeData, tuple[FloatArray, ...], tuple[float, float]]:
        """What the filter takes at coordinates (W, d)."""
        theta = (*self.rates(u), *self.residual(u), np.exp(self.named(u)["noise_factor"]))
        return self.data, theta, (self.amplitude.first * self.scale, self.amplitude.second * self.scale)

    def log_likelihood(self, u: FloatArray) -> FloatArray:
        """Exact likelihood of trial function plus residual plus sensor noise, a and c integrated out, (W,)."""
        return trial_log_likelihood(*self._model(u))

    def constants(self, u: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, ...]:
        """(a, b, c, d) in A/D or rad and 1/s, time from the record's first cycle; arrays of the leading shape.

        a and c are drawn from their distribution given the coordinates.
        """
        flat = end_to_end(u)
        a, c = trial_amplitudes(*self._model(flat), rng.standard_normal((len(flat), 2)))
        b, d = self.rates(u)
        return a.reshape(b.shape), b, c.reshape(b.shape), d

    def guesses(self, rng: np.random.Generator, size: int) -> FloatArray:
        """Give the best of many prior draws: a lesser optimum keeps an ensemble for good."""
        u = self.prior_draws(rng, TRIAL_GUESSES * size)
        return u[np.argsort(-self.log_prob(u))[:size]]


@dataclass(frozen=True, eq=False)
class LawPosterior(Posterior):
    """Parameters of a law, scatter and noise factor of one test in wind, from the envelopes of its records.

    By the plain filter: for laws outside the n-family, from Python.

    Attributes
    ----------
    priors : tuple of Prior
        By name: one for each parameter of the law, "amplitude_scatter" (over the stable amplitude) and "noise_factor".
    data : EnvelopeData
    law : Law
    scale : float
        A typical amplitude, A/D or rad: stable amplitudes are sought from 0.004 to 8 times that.
    initial_sd : float
        Prior of the initial amplitude.
    """

    priors: tuple[Prior, ...]
    data: EnvelopeData
    law: Law
    scale: float
    initial_sd: float = 1.0

    def state_space(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Parameters of the law (W, P), stable amplitude, q and r of the filter, (W,) each."""
        value = self.natural(u)
        parameters = np.stack([value[name] for name in self.law.parameters], axis=-1)
        a_star = self.law.stable_amplitude(parameters, self.scale)
        q = value["amplitude_scatter"] * a_star * np.sqrt(2.0 * self.law.relaxation_rate(parameters, a_star))
        return parameters, a_star, q, value["noise_factor"]

    def log_likelihood(self, u: FloatArray) -> FloatArray:
        """State-space likelihood, (W,); -inf where no amplitude is stable."""
        parameters, a_star, q, r = self.state_space(u)
        total = np.full(len(u), -np.inf)
        stable = (a_star > 0.0) & np.isfinite(a_star)
        terms = innovations_of(
            self.law, self.data, parameters[stable], q[stable], r[stable], initial_sd=self.initial_sd
        )
        total[stable] = pointwise_log_likelihood(*terms).sum(axis=0)
        return total
