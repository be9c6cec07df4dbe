r"""From log evidences to probabilities: how far an evidence is believed.

A log evidence gain holds as it stands where the truth is one of the hypotheses. Nature's forms are never quite those of
the catalogue, so it is divided by a *temperature*; and what no hypothesis foresaw has a share, the *floor*, that is
dealt out evenly. Both were set by `scruton challenge tune` (temperatures.json).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from scruton.arrays import FloatArray
from scruton.gap.thresholds import ANY_TEMPERATURE, FLOOR, TEMPERATURE

_NONE = "none"


@dataclass(frozen=True)
class Temperatures:
    """How far an evidence is believed.

    Attributes
    ----------
    against_none : float
        Divides the log evidence gain of the leading effect over no gap.
    between : float
        Divides the log evidence of one effect over another.
    floor : float
        Probability that is dealt out evenly among all that is possible.
    """

    against_none: float = ANY_TEMPERATURE
    between: float = TEMPERATURE
    floor: float = FLOOR


def probabilities(
    log_weights: Mapping[str, float],
    prior: Mapping[str, float],
    prior_none: float,
    temperatures: Temperatures = Temperatures(),
) -> dict[str, float]:
    """Probability of no gap and of every effect.

    Parameters
    ----------
    log_weights : mapping
        Log evidence gain over `none`, which is among the names with a gain of zero; minus infinity for what these
        records cannot show.
    prior : mapping
        Relative prior weight of the effects; 1 for those that are not named, 0 leaves one out.
    prior_none : float
    temperatures : Temperatures
    """
    names = [name for name in log_weights if name != _NONE]
    share = np.array([prior.get(name, 1.0) for name in names])
    gains = np.array([log_weights[name] for name in names])
    p = tempered(gains, (1.0 - prior_none) * share / share.sum(), temperatures).tolist()
    by_name = dict(zip((_NONE, *names), p, strict=True))
    return {name: by_name[name] for name in log_weights}


def tempered(gains: FloatArray, prior: FloatArray, temperatures: Temperatures) -> FloatArray:
    r"""Probabilities of no gap (first) and of E effects, over any leading axes.

    .. math:: p_e \propto \pi_e \exp\left(\frac{g_*}{T_0} + \frac{g_e - g_*}{T}\right), \qquad g_* = \max_e g_e

    for gains :math:`g_e > 0`, :math:`\pi_e \exp(g_e)` for others, :math:`\pi_0` for none; then
    :math:`(1 - f) p + f/n` for the n that are possible.

    Parameters
    ----------
    gains : (..., E) array
        Log evidence over none; minus infinity for what is not possible.
    prior : (..., E) array
        Prior probability of the effects; what is left to one is that of none.
    temperatures : Temperatures

    Returns
    -------
    (..., 1 + E) array
    """
    best = gains.max(axis=-1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        lead = best / temperatures.against_none + (gains - best) / temperatures.between
        # A form that is not nature's may gain too much; none loses for that.  What the records speak against is neither
        # lifted by another effect's gain nor held up by a temperature.
        tempered_gains = np.where(gains > 0.0, lead, gains)
        logs = np.concatenate([np.log1p(-prior.sum(axis=-1, keepdims=True)), np.log(prior) + tempered_gains], axis=-1)
    p: FloatArray = np.exp(logs - logsumexp(logs, axis=-1, keepdims=True))
    possible = np.isfinite(logs)
    return (1.0 - temperatures.floor) * p + temperatures.floor * possible / possible.sum(axis=-1, keepdims=True)
