"""What fit.json says of a fit: medians, intervals and verdicts, by names that other programs read."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Campaign
from scruton.envelope import RingDown
from scruton.infer.cards import ModelCard
from scruton.infer.results import PeakResult, Sampled
from scruton.infer.steady import SteadyVerdict
from scruton.infer.tree import reference_law, trial_constants
from scruton.provenance import provenance

if TYPE_CHECKING:
    import pandas as pd

INTERVALS = (0.50, 0.90, 0.95)
# Sampled parameters under the names that users meet.
_SAMPLED = {"a_star": "stable_amplitude", "relaxation_rate": "relaxation_ratio", "d": "rate_gap"}


def provenance_of_fit(
    campaign: Campaign, card: ModelCard, *, seed: int, command: str, only: Sequence[str]
) -> dict[str, Any]:
    """Where the numbers come from: versions, seed, digests, the model card."""
    section = campaign.section
    return provenance(
        command,
        seed=seed,
        sha256=campaign.sha256 or {},
        settings={"tests": list(only)},
        card={"name": card.name, "sha256": card.sha256, "text": card.text, "resolved": card.resolved},
    ) | {
        "tests": list(only),
        "campaign": {
            "title": campaign.title,
            "source": campaign.source,
            "motion": section.motion.value,
            "width": section.width,
            "depth": section.depth,
        },
    }


def summarise(
    sampled: Sampled,
    convergence: "pd.DataFrame",
    provenance: Mapping[str, Any],
    flags: Sequence[str],
    *,
    misfit: bool,
) -> dict[str, Any]:
    """The content of fit.json.

    Parameters
    ----------
    sampled : Sampled
    convergence : DataFrame
        One row per parameter of every posterior.
    provenance : mapping
    flags : sequence of str
    misfit : bool
        Whether the innovations speak against the reference law.
    """
    verdicts: dict[Any, Any] = convergence.to_dict(orient="index")
    return {
        "format": 1,
        "title": sampled.campaign.title,
        "converged": bool(convergence["converged"].all()),
        "flags": list(flags),
        "law_n": reference_law(sampled.card),
        "laws": _laws(sampled.joint, misfit),
        "campaign": _campaign(sampled.joint),
        "amplitude_unit": sampled.campaign.section.amplitude_unit,
        "tests": [
            {
                "name": one.test.name,
                "rig": one.rig.name,
                "peak": one.test.name in sampled.peaks,
                "wind_frequency": one.wind_frequency,
                "lock_in": [_lock_in(verdict) for verdict in one.steady],
                "parameters": parameters(one.derived, f"test {one.test.name}", verdicts),
            }
            for one in sampled.tests
        ],
        "rigs": [
            {
                "name": one.rig.name,
                "parameters": parameters({"damping_ratio": one.damping}, f"rig {one.rig.name}", verdicts),
                "bands": _bands(sampled.ringdowns.get(one.rig.name)),
            }
            for one in sampled.rigs
        ],
        "records": [
            {
                "name": one.record.name,
                "test": one.test.name,
                "parameters": parameters(trial_constants(one), f"trial function of {one.record.name}", verdicts),
            }
            for one in sampled.trials
        ],
        "provenance": dict(provenance),
    }


def parameters(
    values: Mapping[str, FloatArray], posterior: str = "", convergence: Mapping[Any, Mapping[str, Any]] | None = None
) -> dict[str, Any]:
    """Median, mean, sd and intervals of every parameter, with what sampling says of it where it was sampled."""
    entries = {}
    for name, draws in values.items():
        entry: dict[str, Any] = {
            "median": float(np.median(draws)),
            "mean": float(draws.mean()),
            "sd": float(draws.std()),
            "interval": {
                f"{p:.2f}": [float(x) for x in np.quantile(draws, [0.5 - p / 2, 0.5 + p / 2])] for p in INTERVALS
            },
        }
        row = (convergence or {}).get((posterior, _SAMPLED.get(name, name)))
        if row is not None:
            entry |= {column: float(row[column]) for column in ("rhat_nested", "ess_bulk", "ess_tail")}
        entries[name] = entry
    return entries


def _lock_in(verdict: SteadyVerdict) -> dict[str, Any]:
    """Whether the fluctuations of a lock-in record were used, and the conditions for it."""
    conditions = [{"name": one.name, "holds": one.holds, "sentence": one.sentence} for one in verdict.conditions]
    return {"record": verdict.record, "used": verdict.usable, "conditions": conditions}


def _laws(joint: PeakResult | None, misfit: bool) -> dict[str, Any]:
    """Laws and their weights; numbers that do not exist are null.

    The flag says that the data speak against the reference law: by evidence, or by its innovations where it is alone.
    """
    if joint is None:
        return {}
    of = joint.weights
    rows = zip(of.labels, of.prior, of.weight, of.stacking, of.log_evidence, of.error, of.sampled, strict=True)
    return {
        "flag": bool(of.flag) or (len(of.labels) == 1 and misfit),
        "weights": {
            label: {
                "prior": float(prior),
                "weight": float(weight),
                "stacking": _known(stacked),
                "log_evidence": _known(log_z),
                "log_evidence_error": _known(error),
                "sampled": bool(sampled),
            }
            for label, prior, weight, stacked, log_z, error, sampled in rows
        },
    }


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _campaign(joint: PeakResult | None) -> dict[str, Any]:
    """The shared curve, the discrepancies and the peak tests in the campaign model, under the reference law."""
    if joint is None:
        return {}
    sc, _ = joint.laws[0].posterior.reference
    derived = {key: value for key, value in joint.laws[0].derived.items() if np.isfinite(value).all()}
    tests = [
        {"name": name, "parameters": parameters({k: v[..., j] for k, v in derived.items() if v.ndim == 3})}
        for j, name in enumerate(joint.tests)
    ]
    shared = {key: value for key, value in derived.items() if value.ndim == 2}
    return {"reference_scruton_number": sc, "parameters": parameters(shared), "tests": tests}


def _bands(ringdown: RingDown | None) -> list[dict[str, Any]]:
    """Structural damping by band of amplitude, as the ring-downs show it."""
    return [
        {"amplitude": [one.lower, one.upper], "damping_ratio": one.damping_ratio, "sd": one.sd, "plucks": one.plucks}
        for one in (ringdown.bands if ringdown else ())
    ]
