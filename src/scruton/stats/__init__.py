"""Statistics that know no wind: priors, posteriors, optimum, ensembles, convergence, evidence, whiteness."""

from scruton.stats.convergence import SamplerSettings
from scruton.stats.posterior import Coordinates, Posterior
from scruton.stats.priors import Prior

__all__ = ["Coordinates", "Posterior", "Prior", "SamplerSettings"]
