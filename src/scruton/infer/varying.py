"""Structural damping that varies with amplitude, in the drift of a test in wind."""

from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.departure import DECAY, GROWTH, HEIGHT
from scruton.dynamics.laws import index_of
from scruton.infer.thresholds import LEAST_RATE

_STEP = 0.2  # in ln A: the slope of the curve is taken over as much on either side


@dataclass(frozen=True, eq=False)
class VaryingDamping:
    r"""xi_s(A) as ring-downs give it, held constant beyond them.

    A law is one of the aerodynamic damping.  At a constant xi_s the drift is its own; where xi_s varies it is

    .. math:: \dot a = \lambda\, a\, x(a/a^*) - \omega_0\, a\, [\xi_s(a) - \xi_s(a^*)]

    with lambda and x of the law.  Near the stable amplitude it relaxes at the rate

    .. math:: \lambda_t = \lambda + \omega_0\, d\xi_s/d\ln a\,|_{a^*}

    and further away it leaves the law of that rate by a departure that is known (`scruton.dynamics.departure`).

    Attributes
    ----------
    log_amplitude, damping_ratio : (G,) arrays
        ln A, A in A/D or rad, rising; and xi_s there.
    """

    log_amplitude: FloatArray
    damping_ratio: FloatArray

    @property
    def arrays(self) -> list[FloatArray]:
        """What a checkpoint of draws under it is told apart by."""
        return [self.log_amplitude, self.damping_ratio]

    def at(self, log_amplitude: FloatArray) -> FloatArray:
        """xi_s, shaped as the argument."""
        return np.asarray(np.interp(log_amplitude, self.log_amplitude, self.damping_ratio))

    def sampled(self, count: int) -> FloatArray:
        """Amplitudes, evenly in ln A, and xi_s there, (2, count)."""
        log = np.linspace(self.log_amplitude[0], self.log_amplitude[-1], count)
        return np.stack([np.exp(log), self.at(log)])

    def total_rate(self, log_stable: FloatArray, rate: FloatArray, omega0: float) -> FloatArray:
        """lambda_t [1/s] from ln a* and lambda [1/s], (W,) each; LEAST_RATE lambda where nothing is stable."""
        rise = (self.at(log_stable + _STEP) - self.at(log_stable - _STEP)) / (2.0 * _STEP)
        return np.asarray(np.maximum(rate + omega0 * rise, LEAST_RATE * rate))

    def departure(self, log_stable: FloatArray, rate: FloatArray, n: FloatArray, omega0: float) -> FloatArray:
        """Columns of the departure from the law of the rate lambda_t, (W, COLUMNS); arguments as of `total_rate`."""
        total = self.total_rate(log_stable, rate, omega0)[:, None]
        columns = []
        for knots in (GROWTH, DECAY):
            place = np.log(knots[1:])
            index = index_of(place, n[:, None])
            risen = self.at(log_stable[:, None] + place) - self.at(log_stable)[:, None]
            g = (rate[:, None] - omega0 * risen / index) / total - 1.0
            columns.append(np.diff(g, axis=1, prepend=0.0))
        return np.asarray(np.concatenate(columns, axis=1) / HEIGHT)
