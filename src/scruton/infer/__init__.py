"""Priors, model cards, likelihoods, ensembles, convergence: from envelopes to posteriors."""

from scruton.infer.cards import ModelCard, load_card, shipped_cards
from scruton.stats.convergence import SamplerSettings
from scruton.stats.priors import Prior, check_support

__all__ = ["ModelCard", "Prior", "SamplerSettings", "check_support", "load_card", "shipped_cards"]
