"""One campaign from its truth to its scores: the unit of work, the same wherever it runs."""

from dataclasses import asdict
from typing import Any

import numpy as np

from scruton.calibrate.fitting import fit_quick
from scruton.calibrate.quantities import inside, quantities, score
from scruton.calibrate.records import simulate_campaign
from scruton.calibrate.regimes import REGIMES
from scruton.calibrate.truths import draw_normals, from_normals
from scruton.infer.cards import ModelCard


def seed_of(seed: int, regime: str, index: int) -> np.random.SeedSequence:
    """Seed of one campaign: it depends on nothing but the run's seed, the regime's place and the campaign's number."""
    return np.random.SeedSequence(seed, spawn_key=(list(REGIMES).index(regime), index))


def run_one(regime_name: str, index: int, seed: int, base: ModelCard) -> dict[str, Any]:
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
    found: dict[str, Any] = {"regime": regime_name, "index": index}
    drawn, body, _ = from_normals(draw_normals(np.random.default_rng(draw), regime, card, 1), regime, card)
    try:
        fitted = fit_quick(simulate_campaign(regime, drawn, body, simulate), card, fit)
    except ValueError as error:  # a record that cannot be used is counted, not hidden
        return found | {"failed": str(error)}
    rng = np.random.default_rng(fresh)
    truths = quantities(drawn, regime, rng.standard_normal(1))
    posterior = fitted.averaged if regime.weighs_laws else fitted.reference
    draws = quantities(posterior, regime, rng.standard_normal(posterior.n.size))
    scores = {name: asdict(score(float(truths[name][0]), draws[name])) for name in truths}
    if regime.weighs_laws:
        for name, one in scores.items():
            one["inside"] = {f"{p:g}": inside(float(truths[name][0]), draws[name], p) for p in (0.5, 0.9, 0.95)}
    return found | {
        "converged": fitted.converged,
        "law_flag": fitted.law_flag,
        "weights": fitted.weights,
        "scores": scores,
    }
