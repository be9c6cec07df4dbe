"""The one place that fits: a campaign and a card to draws of the campaign model."""

from dataclasses import dataclass, replace

import numpy as np

from scruton.arrays import FloatArray
from scruton.calibrate.truths import Drawn
from scruton.campaign.schema import Campaign
from scruton.infer.cards import ModelCard
from scruton.infer.fit import fit_campaign


@dataclass(frozen=True, eq=False)
class Fitted:
    """What is scored of a fit.

    Attributes
    ----------
    reference : Drawn
        Draws under the card's first law.
    averaged : Drawn
        Draws of the laws in proportion to their weights.
    converged : bool
    law_flag : bool or None
        Whether the fit says that the data speak against the first law.
    weights : tuple of float
        Of the laws.
    """

    reference: Drawn
    averaged: Drawn
    converged: bool
    law_flag: bool | None
    weights: tuple[float, ...]


def fit_quick(campaign: Campaign, card: ModelCard, seed: np.random.SeedSequence) -> Fitted:
    """Fit with the shortest run that passes the verdict on convergence."""
    chain, choice = seed.spawn(2)
    sampler = replace(card.sampler, ensembles=2, walkers=max(card.sampler.walkers // 2, 64))
    fit = fit_campaign(campaign, replace(card, sampler=sampler), seed=int(chain.generate_state(1)[0]), thorough=False)
    group = fit.tree["campaign_posterior"]
    reference = float(group.attrs["reference_scruton_number"])
    weight = fit.tree["laws"]["weight"]
    # (law, draw[, test]); laws of no weight need not have draws
    values = {name: _flat(group[name].to_numpy()) for name in _NAMES}
    size = values["n"].shape[1]
    share = np.nan_to_num(weight.sel(law=group["law"].to_numpy()).to_numpy().astype(np.float64))
    law = np.random.default_rng(choice).choice(share.size, size=size, p=share / share.sum())
    here = np.arange(size)
    return Fitted(
        Drawn(reference_scruton_number=reference, **{key: one[0] for key, one in values.items()}),
        Drawn(reference_scruton_number=reference, **{key: one[law, here] for key, one in values.items()}),
        fit.converged,
        fit.summary.get("laws", {}).get("flag"),
        tuple(float(one) for one in weight.to_numpy()),
    )


_NAMES = (
    "n", "reference_amplitude", "reference_relaxation", "discrepancy_amplitude",
    "a_star", "relaxation_rate", "damping_ratio", "mass_damping_factor", "Y1", "epsilon",
)  # fmt: skip


def _flat(values: np.ndarray) -> FloatArray:
    """(law, chain, draw, ...) to (law, chain * draw, ...)."""
    return np.asarray(values.reshape(values.shape[0], -1, *values.shape[3:]), dtype=np.float64)
