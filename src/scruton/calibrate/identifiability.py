r"""Which parameters a design can inform at all, computed before any record is simulated.

The expected (Fisher) information of the state-space likelihood is exact for a normal envelope
:math:`y \sim N(\mu(p), \Sigma(p))`,

.. math:: F_{ij} = \partial_i\mu^T\Sigma^{-1}\partial_j\mu
   + \tfrac12\,\mathrm{tr}\,\Sigma^{-1}\partial_i\Sigma\,\Sigma^{-1}\partial_j\Sigma

where mu relaxes exponentially from the initial amplitude and Sigma is that of an Ornstein-Uhlenbeck process that
starts there plus sensor noise.  Carried to the standard normals that make a truth, whose prior information is one, it
gives the posterior sd that can be expected of every quantity.  A quantity whose expected posterior sd exceeds half of
its prior sd is left out of the verdict on coverage.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.calibrate.quantities import quantities
from scruton.calibrate.records import (
    RELAXATIONS,
    RING_DOWN_RELAXATIONS,
    RING_DOWN_START,
    SAMPLES_PER_CYCLE,
    START,
    cycles_recorded,
)
from scruton.calibrate.regimes import FREQUENCY, Regime
from scruton.calibrate.thresholds import UNINFORMED
from scruton.calibrate.truths import draw_normals, from_normals, omega0
from scruton.infer.cards import ModelCard

TRUTHS, PRIOR_DRAWS = 24, 4000
_STEP = 1e-4
_SEED = 20  # fixed: the verdict belongs to the regime, not to the run

Moments = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


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
    rng = np.random.default_rng(_SEED)
    z = draw_normals(rng, regime, card, PRIOR_DRAWS)
    z = np.concatenate([z, rng.standard_normal((PRIOR_DRAWS, 1))], axis=1)
    prior = _log_quantities(z, regime, card)
    prior_sd = {name: float(one.std()) for name, one in prior.items()}
    expected = dict.fromkeys(prior, 0.0)
    for one in z[:truths]:
        covariance = np.linalg.inv(np.eye(one.size) + _information(one, regime, card))
        for name, gradient in _gradients(one, lambda points: _log_quantities(points, regime, card)).items():
            sd = float(np.sqrt(gradient @ covariance @ gradient))
            # The gradient of ln Y1 grows without bound towards Y1 = 0; a posterior is no wider than the prior for that.
            expected[name] += min(sd, prior_sd[name]) / truths
    return tuple(Identifiability(regime.name, name, prior_sd[name], expected[name]) for name in prior)


def _log_quantities(z: FloatArray, regime: Regime, card: ModelCard) -> dict[str, FloatArray]:
    """Logarithms of the magnitudes of all quantities; the last normal is the new setting's own deviation."""
    drawn, _, _ = from_normals(z[:, :-1], regime, card)
    return {name: np.log(np.abs(one)) for name, one in quantities(drawn, regime, z[:, -1]).items()}


def _gradients(z: FloatArray, function: Callable[[FloatArray], dict[str, FloatArray]]) -> dict[str, FloatArray]:
    """Gradients of named functions of the normals by central differences, (d,) each."""
    steps = _STEP * np.eye(z.size)
    up, down = function(z + steps), function(z - steps)
    return {name: (up[name] - down[name]) / (2.0 * _STEP) for name in up}


def _information(z: FloatArray, regime: Regime, card: ModelCard) -> FloatArray:
    """Information of all records of one campaign about the normals that made it, (d, d)."""

    def settings(points: FloatArray) -> dict[str, FloatArray]:
        drawn, _, _ = from_normals(points[:, :-1], regime, card)
        parts = {"a": drawn.a_star, "rate": drawn.relaxation_rate, "xi": drawn.damping_ratio}
        return {f"{key}{j}": np.log(one[:, j]) for key, one in parts.items() for j in range(one.shape[1])}

    drawn, _, _ = from_normals(z[None, :-1], regime, card)
    gradients = _gradients(z, settings)
    total = np.zeros((z.size, z.size))
    for j in range(len(regime.scruton_numbers)):
        slope = np.stack([gradients[f"a{j}"], gradients[f"rate{j}"]])
        a_star, rate = float(drawn.a_star[0, j]), float(drawn.relaxation_rate[0, j])
        total += slope.T @ transient_information(regime, card, a_star, rate) @ slope
        if regime.ring_downs:
            damping = gradients[f"xi{j}"]
            known = ring_down_information(regime, card, a_star, omega0(regime.motion) * drawn.damping_ratio[0, j])
            total += known * np.outer(damping, damping)
    return total


def transient_information(regime: Regime, card: ModelCard, a_star: float, rate: float) -> FloatArray:
    """Information of one test's transients about (ln a*, ln lambda), (2, 2), the nuisances integrated out.

    The nuisances are the scatter, the factor on the noise, and every record's initial amplitude.
    """
    nuisances = [card.prior(name, regime.motion) for name in ("amplitude_scatter", "noise_factor")]
    scatter = regime.turbulence or float(np.exp(nuisances[0].location))
    starts = [float(np.mean(START[kind])) * a_star for kind in regime.kinds]
    size = 4 + len(starts)
    total = np.zeros((size, size))
    total[2, 2], total[3, 3] = (1.0 / one.scale**2 for one in nuisances)
    times = _times(regime, rate, RELAXATIONS)
    for i in range(len(starts)):
        total += information(
            lambda p, i=i: _moments(times, p[4 + i], np.exp(p[0]), np.exp(p[1]), np.exp(p[2] + p[0]),
                                    _noise(regime, a_star) * np.exp(p[3])),  # type: ignore[misc]
            np.array([np.log(a_star), np.log(rate), np.log(scatter), 0.0, *starts]),
            np.array([*[_STEP] * 4, *[_STEP * a_star] * len(starts)]),
        )  # fmt: skip
    return _marginal(total, 2)


def ring_down_information(regime: Regime, card: ModelCard, a_star: float, rate: float) -> float:
    """Information of one rig's ring-downs about ln xi, the nuisances integrated out."""
    nuisances = [card.prior(name, regime.motion) for name in ("still_air_scatter", "noise_factor")]
    start = RING_DOWN_START * a_star
    scatter = float(np.exp(nuisances[0].location))
    times = _times(regime, rate, RING_DOWN_RELAXATIONS)
    each = information(
        lambda p: _moments(times, p[3], 0.0, np.exp(p[0]), np.exp(p[1]) * start, _noise(regime, a_star) * np.exp(p[2])),
        np.array([np.log(rate), np.log(scatter), 0.0, start]),
        np.array([_STEP, _STEP, _STEP, _STEP * start]),
    )
    each[1, 1] += 1.0 / nuisances[0].scale ** 2
    each[2, 2] += 1.0 / nuisances[1].scale ** 2
    return regime.ring_downs * float(_marginal(each, 1)[0, 0])


def information(moments: Moments, p: FloatArray, step: FloatArray) -> FloatArray:
    """Expected information about p of one normal vector whose mean and covariance `moments` gives, (d, d)."""
    _, covariance = moments(p)
    inverse = np.linalg.inv(covariance)
    slopes, bends = [], []
    for one in np.diag(step):
        (up, cov_up), (down, cov_down) = moments(p + one), moments(p - one)
        slopes.append((up - down) / (2.0 * one.sum()))
        bends.append(inverse @ (cov_up - cov_down) / (2.0 * one.sum()))
    mean = np.stack(slopes)
    spread = np.einsum("iab,jba->ij", bends, bends, optimize=True)
    return np.asarray(mean @ inverse @ mean.T + 0.5 * spread)


def _moments(
    t: FloatArray, start: float, a_star: float, rate: float, spread: float, noise: float
) -> tuple[FloatArray, FloatArray]:
    """Mean and covariance of an envelope at cycle times: stationary sd `spread`, sensor noise a cycle `noise`."""
    mean = a_star + (start - a_star) * np.exp(-rate * t)
    apart, since = np.abs(t[:, None] - t), t[:, None] + t
    covariance = spread**2 * (np.exp(-rate * apart) - np.exp(-rate * since))
    return mean, covariance + noise**2 * np.eye(t.size)


def _times(regime: Regime, rate: float, relaxations: float) -> FloatArray:
    cycles = int(cycles_recorded(rate, omega0(regime.motion), relaxations))
    return np.asarray((np.arange(cycles) + 0.5) / FREQUENCY[regime.motion], dtype=np.float64)


def _noise(regime: Regime, a_star: float) -> float:
    """Standard error of one cycle's amplitude."""
    return regime.sensor_noise * a_star * float(np.sqrt(2.0 / SAMPLES_PER_CYCLE))


def _marginal(full: FloatArray, keep: int) -> FloatArray:
    """Information about the first `keep` parameters when the others are integrated out (Schur complement)."""
    a, b, d = full[:keep, :keep], full[:keep, keep:], full[keep:, keep:]
    return np.asarray(a - b @ np.linalg.solve(d, b.T))
