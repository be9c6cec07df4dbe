"""Laplace's evidence checked by importance sampling from a Student-t at the optimum."""

from dataclasses import dataclass

import numpy as np
from scipy.special import gammaln, logsumexp

from scruton.arrays import FloatArray
from scruton.gap.hypothesis import Hypothesis, Weighed

_FREEDOM = 8.0
_WIDEN = 1.05
_CHUNK = 100


@dataclass(frozen=True)
class Checked:
    """Log evidence by importance sampling.

    Attributes
    ----------
    log_evidence, error : float
        The error is the standard deviation of the logarithm.
    effective : float
        Effective number of draws.
    laplace : float
        What Laplace's approximation said.
    """

    log_evidence: float
    error: float
    effective: float
    laplace: float


def importance(evidence: Weighed, rng: np.random.Generator, draws: int = 600) -> Checked:
    """Importance-sample the evidence of a hypothesis.

    Parameters
    ----------
    evidence : Weighed
        Its mode and covariance make the proposal, a little wider, with Student-t tails.
    rng : Generator
    draws : int

    Notes
    -----
    A parameter with a prior cut at zero counts only where it is positive, with twice the density: as in the Laplace
    evidence.
    """
    hypothesis = evidence.hypothesis
    d = evidence.mode.size
    root = np.linalg.cholesky(evidence.covariance) * _WIDEN
    z = rng.standard_normal((draws, d))
    stretch = np.sqrt(_FREEDOM / rng.chisquare(_FREEDOM, draws))
    t = z * stretch[:, None]
    u = evidence.mode + t @ root.T
    log_density = (
        gammaln(0.5 * (_FREEDOM + d)) - gammaln(0.5 * _FREEDOM) - 0.5 * d * np.log(_FREEDOM * np.pi)
        - np.log(np.diag(root)).sum() - 0.5 * (_FREEDOM + d) * np.log1p(np.sum(t * t, axis=1) / _FREEDOM)
    )  # fmt: skip
    weights = log_density_of(hypothesis, u) - log_density
    total = float(logsumexp(weights))
    share = np.exp(weights - total)
    effective = 1.0 / float(np.sum(share**2))
    error = float(np.sqrt(max(1.0 / effective - 1.0 / draws, 0.0)))
    return Checked(total - float(np.log(draws)), error, effective, evidence.log_evidence)


def log_density_of(hypothesis: Hypothesis, u: FloatArray) -> FloatArray:
    """Log likelihood and prior at points (N, d), priors that are cut at zero with twice their density."""
    target = np.empty(len(u))
    for begin in range(0, len(u), _CHUNK):
        like, prior = hypothesis.log_prob(u[begin : begin + _CHUNK])
        target[begin : begin + _CHUNK] = like + prior
    for one in hypothesis.parameters:
        if one.positive:
            part = u[:, hypothesis.places[one.name]]
            target = np.where((part > 0.0).all(axis=1), target + one.size * np.log(2.0), -np.inf)
    return target
