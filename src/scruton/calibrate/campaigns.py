"""One campaign from its truth to its scores: the unit of work, the same wherever it runs."""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from scruton.calibrate.quantities import INTERVALS, inside, quantities, score
from scruton.calibrate.records import simulate_campaign
from scruton.calibrate.regimes import REGIMES
from scruton.calibrate.truths import Drawn, draw_normals, from_normals
from scruton.campaign.schema import Campaign
from scruton.infer.cards import ModelCard
from scruton.infer.fit import fit_campaign

_NAMES = (
    "n", "reference_amplitude", "reference_relaxation", "discrepancy_amplitude",
    "a_star", "relaxation_rate", "damping_ratio", "mass_damping_factor", "Y1", "epsilon",
)  # fmt: skip


def seed_of(seed: int, regime: str, index: int) -> np.random.SeedSequence:
    """Seed of one campaign: it depends on nothing but the run's seed, the regime's place and the campaign's number."""
    return np.random.SeedSequence(seed, spawn_key=(list(REGIMES).index(regime), index))


def run_campaign(regime_name: str, index: int, seed: int, base: ModelCard) -> dict[str, Any]:
    """Draw a truth, simulate and fit its campaign, and score every quantity.

    Returns
    -------
    dict
        What one line of the regime's file holds: `regime`, `index`; `failed` with the reason, or
        `converged`, `law_flag`, `weights` and `scores`, by quantity `truth`, `rank`, `z`, `posterior_sd`, and where
        laws are weighed `inside` by interval.
    """
    regime = REGIMES[regime_name]
    card = regime.card(base)
    draw, simulate, fit, fresh = seed_of(seed, regime_name, index).spawn(4)
    record: dict[str, Any] = {"regime": regime_name, "index": index}
    drawn, body, _ = from_normals(draw_normals(np.random.default_rng(draw), regime, card, 1), regime, card)
    try:
        fitted = fit_quick(simulate_campaign(regime, drawn, body, simulate), card, fit)
    except ValueError as error:  # a record that cannot be used is counted, not hidden
        return record | {"failed": str(error)}
    rng = np.random.default_rng(fresh)
    truths = {name: float(value[0]) for name, value in quantities(drawn, regime, rng.standard_normal(1)).items()}
    posterior = fitted.averaged if regime.weighs_laws else fitted.reference
    draws = quantities(posterior, regime, rng.standard_normal(posterior.n.size))
    scores = {name: asdict(score(truth, draws[name])) for name, truth in truths.items()}
    if regime.weighs_laws:
        for name, truth in truths.items():
            scores[name]["inside"] = {f"{p:g}": inside(truth, draws[name], p) for p in INTERVALS}
    return record | {
        "converged": fitted.converged, "law_flag": fitted.law_flag, "weights": fitted.weights, "scores": scores,
    }  # fmt: skip


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
    weight = fit.tree["laws"]["weight"]
    # (law, draw[, test]); laws of no weight need not have draws
    stacked = {name: group[name].to_numpy() for name in _NAMES}
    values = {name: value.reshape(len(value), -1, *value.shape[3:]) for name, value in stacked.items()}
    size = values["n"].shape[1]
    share = np.nan_to_num(weight.sel(law=group["law"].to_numpy()).to_numpy().astype(np.float64))
    law = np.random.default_rng(choice).choice(share.size, size=size, p=share / share.sum())
    reference = float(group.attrs["reference_scruton_number"])
    return Fitted(
        Drawn(reference_scruton_number=reference, **{name: value[0] for name, value in values.items()}),
        Drawn(
            reference_scruton_number=reference,
            **{name: value[law, np.arange(size)] for name, value in values.items()},
        ),
        fit.converged,
        fit.summary.get("laws", {}).get("flag"),
        tuple(weight.to_numpy().astype(np.float64).tolist()),
    )
