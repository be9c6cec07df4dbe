"""What sampling gives; apart from the sampler, so that who reads draws need not import emcee."""

from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.stats.convergence import Convergence


@dataclass(frozen=True, eq=False)
class Samples:
    """Draws of one posterior.

    Attributes
    ----------
    chain : (chains, draws, d) array
        Sampled coordinates, thinned to the card's number of draws.
    log_prob : (chains, draws) array
    ensemble : (chains,) array of int
    convergence : Convergence
        Judged on the unthinned run.
    """

    names: tuple[str, ...]
    chain: FloatArray
    log_prob: FloatArray
    ensemble: np.ndarray
    convergence: Convergence
