r"""Which parameters a design can inform at all, computed before any record is simulated.

The expected (Fisher) information of the state-space likelihood is exact for a normal envelope
:math:`y \sim N(\mu(p), \Sigma(p))`,

.. math:: F_{ij} = \partial_i\mu^T\Sigma^{-1}\partial_j\mu
   + \tfrac12\,\mathrm{tr}\,\Sigma^{-1}\partial_i\Sigma\,\Sigma^{-1}\partial_j\Sigma

where mu relaxes exponentially from the initial amplitude and Sigma is that of an Ornstein-Uhlenbeck process that
starts there, plus that of what follows a gust and a set-point from there, plus sensor noise.  Carried to the standard
normals that make a truth, whose prior information is one, it gives the posterior sd that can be expected of every
quantity.  A quantity whose expected posterior sd exceeds half of its prior sd is left out of the verdict on coverage.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import exprel

from scruton.arrays import FloatArray
from scruton.calibrate import campaigns
from scruton.calibrate.quantities import quantities
from scruton.calibrate.regimes import FREQUENCY, Regime
from scruton.calibrate.thresholds import UNINFORMED
from scruton.calibrate.truths import draw_normals, from_normals, omega0
from scruton.campaign.schema import Kind
from scruton.infer.cards import ModelCard
from scruton.infer.models import NOISE

TRUTHS, PRIOR_DRAWS = 24, 4000
_STEP = 1e-4
_SEED = 20  # fixed: the verdict belongs to the regime, not to the run

Moments = tuple[FloatArray, FloatArray]  # mean and covariance


@dataclass(frozen=True)
class Identifiability:
    """What a regime's design tells of one quantity.

    Attributes
    ----------
    regime, quantity : str
    prior_sd : float
        Of the logarithm of the quantity's magnitude.
    expected_sd : float
        Expected posterior sd of the same, at most the prior's, mean over a few truths of the prior.
    """

    regime: str
    quantity: str
    prior_sd: float
    expected_sd: float

    @property
    def ratio(self) -> float:
        """Expected posterior sd over prior sd."""
        return self.expected_sd / self.prior_sd

    @property
    def left_out(self) -> bool:
        """Whether the quantity is left out of the verdict."""
        return not self.ratio <= UNINFORMED


def identifiability(regime: Regime, card: ModelCard, truths: int = TRUTHS) -> tuple[Identifiability, ...]:
    """Expected posterior sd of every quantity of a regime, beside its prior sd.

    Parameters
    ----------
    regime : Regime
    card : ModelCard
        Of the regime; see `Regime.card`.
    truths : int
        Prior draws to average over.
    """

    def log_quantities(points: FloatArray) -> dict[str, FloatArray]:
        """Logarithms of the magnitudes; the last normal is the new setting's own deviation."""
        drawn, _, _ = from_normals(points[:, :-1], regime, card)
        return {name: np.log(np.abs(values)) for name, values in quantities(drawn, regime, points[:, -1]).items()}

    rng = np.random.default_rng(_SEED)
    z = draw_normals(rng, regime, card, PRIOR_DRAWS)
    z = np.concatenate([z, rng.standard_normal((PRIOR_DRAWS, 1))], axis=1)
    prior_sd = {name: float(values.std()) for name, values in log_quantities(z).items()}
    expected = dict.fromkeys(prior_sd, 0.0)
    for truth in z[:truths]:
        covariance = np.linalg.inv(np.eye(truth.size) + _information(truth, regime, card))
        for name, gradient in _gradients(truth, log_quantities).items():
            sd = float(np.sqrt(gradient @ covariance @ gradient))
            # The gradient of ln Y1 grows without bound towards Y1 = 0; a posterior is no wider than the prior for that.
            expected[name] += min(sd, prior_sd[name]) / truths
    return tuple(Identifiability(regime.name, name, prior_sd[name], expected[name]) for name in prior_sd)


def _gradients(z: FloatArray, function: Callable[[FloatArray], dict[str, FloatArray]]) -> dict[str, FloatArray]:
    """Gradients of named functions of the normals by central differences, (d,) or (d, J) each."""
    steps = _STEP * np.eye(z.size)
    up, down = function(z + steps), function(z - steps)
    return {name: (up[name] - down[name]) / (2.0 * _STEP) for name in up}


def _information(z: FloatArray, regime: Regime, card: ModelCard) -> FloatArray:
    """Information of all records of one campaign about the normals that made it, (d, d)."""

    def settings(points: FloatArray) -> dict[str, FloatArray]:
        drawn, _, _ = from_normals(points[:, :-1], regime, card)
        logs = {"amplitude": drawn.a_star, "rate": drawn.relaxation_rate, "damping": drawn.damping_ratio}
        return {key: np.log(values) for key, values in logs.items()}

    drawn, _, _ = from_normals(z[None, :-1], regime, card)
    gradients = _gradients(z, settings)
    total = np.zeros((z.size, z.size))
    for j in range(len(regime.scruton_numbers)):
        slope = np.stack([gradients["amplitude"][:, j], gradients["rate"][:, j]])
        a_star, rate = float(drawn.a_star[0, j]), float(drawn.relaxation_rate[0, j])
        total += slope.T @ transient_information(regime, card, a_star, rate) @ slope
        if regime.ring_downs:
            damping = gradients["damping"][:, j]
            known = ring_down_information(regime, card, a_star, omega0(regime.motion) * drawn.damping_ratio[0, j])
            total += known * np.outer(damping, damping)
    return total


def transient_information(regime: Regime, card: ModelCard, a_star: float, rate: float) -> FloatArray:
    """Information of one test's records about (ln a*, ln lambda), (2, 2), the nuisances integrated out.

    The nuisances are the scatter, the factor on the noise, gusts and set-points, and every record's initial amplitude.
    """

    def moments(a_star: float, rate: float, start: float, **unknown: float) -> Moments:
        mean, covariance = _moments(
            times, start, a_star, rate, unknown["amplitude_scatter"] * a_star, noise * unknown["noise_factor"]
        )
        gust = unknown["gust_scatter"] ** 2 * _gusts(times, rate, rate / unknown["gust_time"])
        moved = unknown["set_point_scatter"] * -np.expm1(-rate * times)
        covariance += a_star**2 * (gust + np.outer(moved, moved))
        if kind is Kind.STEADY:  # of lock-in so short the mean alone is used
            return np.mean(mean, keepdims=True), np.mean(covariance, keepdims=True)
        return mean, covariance

    priors = [card.prior(name, regime.motion) for name in NOISE]
    values = {prior.name: float(np.exp(prior.location)) for prior in priors}
    values |= {name: true for name, true in regime.noise.items() if true}
    values = {"a_star": a_star, "rate": rate} | values
    total = np.diag([0.0, 0.0, *(prior.scale**-2.0 for prior in priors)])
    for kind in regime.kinds:
        times, noise = _record(regime, a_star, rate, kind)
        start = float(np.mean(campaigns.START[kind])) * a_star
        total += _marginal(information(moments, values | {"start": start}), len(values))
    return _marginal(total, 2)


def ring_down_information(regime: Regime, card: ModelCard, a_star: float, rate: float) -> float:
    """Information of one rig's ring-downs about ln xi, the nuisances integrated out."""
    scatter, factor = (card.prior(name, regime.motion) for name in ("still_air_scatter", "noise_factor"))
    times, noise = _record(regime, a_star, rate, Kind.FREE_DECAY)
    first = campaigns.RING_DOWN_START * a_star  # what the scatter is a share of

    def moments(rate: float, scatter: float, factor: float, start: float) -> Moments:
        return _moments(times, start, 0.0, rate, scatter * first, noise * factor)

    values = {"rate": rate, "scatter": np.exp(scatter.location), "factor": 1.0, "start": first}
    each = information(moments, values) + np.diag([0.0, scatter.scale**-2.0, factor.scale**-2.0, 0.0])
    return regime.ring_downs * float(_marginal(each, 1)[0, 0])


def information(moments: Callable[..., Moments], values: Mapping[str, float]) -> FloatArray:
    """Expected information about the logarithms of the d positive parameters of one normal vector, (d, d).

    `moments` gives mean and covariance from the parameters by name; rows are in the order of the values.
    """
    inverse = np.linalg.inv(moments(**values)[1])
    slopes, bends = [], []
    for name, value in values.items():
        up, down = (moments(**{**values, name: value * np.exp(step)}) for step in (_STEP, -_STEP))
        slopes.append((up[0] - down[0]) / (2.0 * _STEP))
        bends.append(inverse @ (up[1] - down[1]) / (2.0 * _STEP))
    mean = np.stack(slopes)
    spread = np.einsum("iab,jba->ij", bends, bends, optimize=True)
    return np.asarray(mean @ inverse @ mean.T + 0.5 * spread)


def _moments(t: FloatArray, start: float, a_star: float, rate: float, spread: float, noise: float) -> Moments:
    """Mean and covariance of an envelope at cycle times: stationary sd `spread`, sensor noise a cycle `noise`."""
    mean = a_star + (start - a_star) * np.exp(-rate * t)
    apart, since = np.abs(t[:, None] - t), t[:, None] + t
    covariance = spread**2 * (np.exp(-rate * apart) - np.exp(-rate * since))
    return mean, covariance + noise**2 * np.eye(t.size)


def _gusts(t: FloatArray, rate: float, fade: float) -> FloatArray:
    """Covariance of what follows a stationary gust of unit sd from t = 0 on: the gust fades, the other relaxes."""
    apart = np.abs(t[:, None] - t)

    def pushed(t: FloatArray) -> FloatArray:
        return np.asarray(rate * t * np.exp(-rate * t) * exprel((rate - fade) * t))

    kept, moved = np.exp(-rate * t), pushed(t)
    started = np.outer(kept, kept) + np.outer(kept, moved) + np.outer(moved, kept)
    return np.asarray(rate / (rate + fade) * (np.exp(-rate * apart) + pushed(apart) - started))


def _record(regime: Regime, a_star: float, rate: float, kind: Kind) -> tuple[FloatArray, float]:
    """Times of the cycles [s] of a record, and the standard error of one cycle's amplitude."""
    cycles = int(campaigns.cycles_recorded(rate, omega0(regime.motion), kind))
    noise = regime.sensor_noise * a_star * float(np.sqrt(2.0 / campaigns.SAMPLES_PER_CYCLE))
    return np.asarray((np.arange(cycles) + 0.5) / FREQUENCY[regime.motion], dtype=np.float64), noise


def _marginal(full: FloatArray, keep: int) -> FloatArray:
    """Information about the first `keep` parameters when the others are integrated out (Schur complement)."""
    a, b, d = full[:keep, :keep], full[:keep, keep:], full[keep:, keep:]
    return np.asarray(a - b @ np.linalg.solve(d, b.T))
