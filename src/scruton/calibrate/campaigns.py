"""One campaign from its truth to its scores: the unit of work, the same wherever it runs."""

from dataclasses import asdict, fields, replace
from typing import Any

import numpy as np

from scruton.calibrate.quantities import INTERVALS, inside, quantities, score
from scruton.calibrate.records import simulate_campaign
from scruton.calibrate.regimes import REGIMES
from scruton.calibrate.truths import Drawn, draw_normals, from_normals
from scruton.campaign.schema import Campaign
from scruton.infer.cards import ModelCard
from scruton.infer.fit import fit_campaign


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
    # It depends on nothing but the run's seed, the regime's place and the campaign's number.
    own = np.random.SeedSequence(seed, spawn_key=(list(REGIMES).index(regime_name), index))
    draw, simulate, fit, fresh = own.spawn(4)
    record: dict[str, Any] = {"regime": regime_name, "index": index}
    drawn, places, _ = from_normals(draw_normals(np.random.default_rng(draw), regime, card, 1), regime, card)
    try:
        posterior, facts = _fitted(simulate_campaign(regime, drawn, places, simulate), card, fit, regime.weighs_laws)
    except ValueError as error:  # a record that cannot be used is counted, not hidden
        return record | {"failed": str(error)}
    rng = np.random.default_rng(fresh)
    truths = {name: float(value[0]) for name, value in quantities(drawn, regime, rng.standard_normal(1)).items()}
    draws = quantities(posterior, regime, rng.standard_normal(posterior.n.size))
    scores = {name: asdict(score(truth, draws[name])) for name, truth in truths.items()}
    if regime.weighs_laws:
        for name, truth in truths.items():
            scores[name]["inside"] = {f"{p:g}": inside(truth, draws[name], p) for p in INTERVALS}
    return record | facts | {"scores": scores}


def _fitted(
    campaign: Campaign, card: ModelCard, seed: np.random.SeedSequence, averaged: bool
) -> tuple[Drawn, dict[str, Any]]:
    """Fit with the shortest run that passes the verdict on convergence.

    Draws of the laws in proportion to their weights, or under the card's first law; and whether the fit converged,
    whether it says that the data speak against the first law (perhaps None), and the weights of the laws.
    """
    chain, choice = seed.spawn(2)
    sampler = replace(card.sampler, ensembles=2, walkers=max(card.sampler.walkers // 2, 64))
    fit = fit_campaign(campaign, replace(card, sampler=sampler), seed=int(chain.generate_state(1)[0]), thorough=False)
    group, weight = fit.tree["campaign_posterior"], fit.tree["laws"]["weight"]
    # (law, draw[, test]); laws of no weight need not have draws
    stacked = {one.name: group[one.name].to_numpy() for one in fields(Drawn) if one.name in group}
    values = {name: value.reshape(len(value), -1, *value.shape[3:]) for name, value in stacked.items()}
    size = values["n"].shape[1]
    share = np.nan_to_num(weight.sel(law=group["law"].to_numpy()).to_numpy().astype(np.float64))
    law = np.random.default_rng(choice).choice(share.size, size=size, p=share / share.sum())
    chosen: Any = (law, np.arange(size)) if averaged else 0
    reference = float(group.attrs["reference_scruton_number"])
    posterior = Drawn(reference_scruton_number=reference, **{name: value[chosen] for name, value in values.items()})
    weights = tuple(weight.to_numpy().astype(np.float64).tolist())
    flag = fit.summary.get("laws", {}).get("flag")
    return posterior, {"converged": fit.converged, "law_flag": flag, "weights": weights}
