"""Priors, model cards, likelihoods, ensembles, convergence: from envelopes to posteriors."""

from scruton.infer.cards import ModelCard, load_card, shipped_cards
from scruton.stats.priors import Prior, check_support
from scruton.stats.settings import SamplerSettings

__all__ = ["ModelCard", "Prior", "SamplerSettings", "check_support", "load_card", "shipped_cards"]
