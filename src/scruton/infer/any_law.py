"""The posterior of one test in wind under any law, by the plain filter: for laws outside the n-family, from Python."""

from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.cycles import EnvelopeData
from scruton.dynamics.filter import innovations_of
from scruton.dynamics.laws.law import Law
from scruton.dynamics.likelihood import pointwise_log_likelihood
from scruton.stats.posterior import Posterior
from scruton.stats.priors import Prior


@dataclass(frozen=True, eq=False)
class LawPosterior(Posterior):
    """Parameters of a law, scatter and noise factor of one test in wind, from the envelopes of its records.

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
