"""Priors, model cards, likelihoods, ensembles, convergence: from envelopes to posteriors."""

from scruton.infer.cards import ModelCard, SamplerSettings, load_card, shipped_cards
from scruton.infer.priors import Prior, check_support

__all__ = ["ModelCard", "Prior", "SamplerSettings", "check_support", "load_card", "shipped_cards"]
