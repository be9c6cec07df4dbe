"""Statistics that know no wind: priors, posteriors, optimum, ensembles, convergence, evidence, whiteness."""

from scruton.stats.coordinates import Coordinates
from scruton.stats.posterior import Posterior
from scruton.stats.priors import Prior
from scruton.stats.settings import SamplerSettings

__all__ = ["Coordinates", "Posterior", "Prior", "SamplerSettings"]
