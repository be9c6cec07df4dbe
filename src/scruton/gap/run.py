"""A campaign's gap.json: where the bare model and the measurement part, which effect, how far the gap shrinks."""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri

from scruton.campaign import Campaign, load_campaign
from scruton.dynamics.effects import Variant
from scruton.dynamics.effects.terms import Parameter
from scruton.gap.advise import advise, confusions, invisible
from scruton.gap.bare import reference
from scruton.gap.bridge import bridge_evidence
from scruton.gap.data import load_gap
from scruton.gap.diagnosis import ANY_TEMPERATURE, NONE, TEMPERATURE, UNSEEN, Diagnosis, diagnose_data
from scruton.gap.importance import importance
from scruton.gap.locate import Curves, Finding, excess_curves, locate
from scruton.gap.results import FORMAT
from scruton.gap.shrink import shrink
from scruton.infer.cards import ModelCard, load_card
from scruton.progress import Progress
from scruton.provenance import provenance

_LEADERS = 2
SEED = 0  # of the few draws that a diagnosis makes


def diagnose_campaign(
    folder: Path, card: ModelCard | None = None, *, workers: int = 2, progress: Progress | None = None
) -> dict[str, Any]:
    """Diagnose a campaign on disk.

    Parameters
    ----------
    folder : Path
        With a campaign.toml.
    card : ModelCard, optional
        The shipped default by default: its prior weights of effects.
    workers : int
        Threads.
    progress : callable, optional
        Told what is being done and the fraction done.

    Returns
    -------
    dict
        The content of gap.json.

    Raises
    ------
    InputError
        If the campaign cannot be read or holds no record.
    """
    return examine(folder, card or load_card(), workers=workers, progress=progress)[1]


def examine(
    source: Path | Campaign,
    card: ModelCard,
    *,
    workers: int = 2,
    thorough: bool = False,
    progress: Progress | None = None,
) -> tuple[Diagnosis, dict[str, Any], tuple[Finding, ...], Curves | None]:
    """Diagnose a campaign, or the one in a folder, and keep what the picture needs.

    That is the diagnosis, the content of gap.json, the findings, and the curves where they were made.

    `thorough` adds the evidence of the leaders by bridge sampling, which takes half a minute or more.
    """
    campaign = source if isinstance(source, Campaign) else load_campaign(source)
    data = load_gap(campaign)
    diagnosis = diagnose_data(
        data, campaign, prior=card.effect_weights, prior_none=card.prior_none, workers=workers, progress=progress
    )
    gap = diagnosis.verdict != NONE
    curves = excess_curves(diagnosis.bare) if gap else None
    findings = locate(diagnosis, curves) if gap else ()
    shrunk = shrink(diagnosis, workers=workers) if gap else None
    content = {
        "format": FORMAT,
        "verdict": diagnosis.verdict,
        "also": list(diagnosis.found[1:]),
        "probability": {name: round(p, 6) for name, p in diagnosis.probability.items()},
        "indistinguishable": [list(group) for group in confusions(diagnosis)],
        "where": [one.to_json() for one in findings],
        "shrink": shrunk.to_json() if shrunk else {},
        "effects": {name: {"parameters": found_parameters(diagnosis, name)} for name in diagnosis.found},
        "advice": advise(diagnosis),
        "invisible": invisible(diagnosis),
        "calibrated_on": (
            "simulated campaigns of three rigs from the full equation of motion, 0.5 to 1.5 % turbulence; "
            f"evidences are divided by {TEMPERATURE:g} between effects, by {ANY_TEMPERATURE:g} against none"
        ),
        "sizes_refer_to": reference(diagnosis.data.layout),
        "evidence": _evidence(diagnosis, thorough),
        "checks": {name: vars(one) for name, one in diagnosis.checks.items()},
        "card": card.name,
        "card_sha256": card.sha256,
        "sha256": dict(campaign.sha256 or {}),
        "provenance": provenance(
            "diagnose", seed=SEED, sha256=campaign.sha256 or {}, settings={"thorough": thorough},
            card={"name": card.name, "sha256": card.sha256},
        ),
    }  # fmt: skip
    return diagnosis, content, findings, curves


def _evidence(diagnosis: Diagnosis, thorough: bool) -> dict[str, Any]:
    """Log evidence over the bare model by Laplace; for the leaders by importance sampling, and by bridge sampling."""
    ranked = sorted(diagnosis.singles.values(), key=lambda one: -one.log_evidence)
    rng = np.random.default_rng(SEED)
    bare = importance(diagnosis.bare, rng)
    bridged = bridge_evidence(diagnosis.bare, 0) if thorough else None
    checked: dict[str, dict[str, float]] = {}
    for k, one in enumerate(ranked[:_LEADERS]):
        if one.best is None:
            continue
        found = importance(one.best, rng)
        checked[one.name] = {
            "laplace": one.best.log_evidence - diagnosis.bare.log_evidence,
            "importance": found.log_evidence - bare.log_evidence,
            "error": float(np.hypot(found.error, bare.error)), "effective_draws": found.effective,
        }  # fmt: skip
        if bridged is not None:
            over = bridge_evidence(one.best, k + 1)
            checked[one.name] |= {
                "bridge": over.log_z - bridged.log_z, "bridge_error": float(np.hypot(over.error, bridged.error)),
                "bridge_effective_draws": over.effective_size,
            }  # fmt: skip
    gains = {one.name: one.log_evidence - diagnosis.bare.log_evidence for one in ranked}
    return {"gain": {k: v if np.isfinite(v) else None for k, v in gains.items()}, "leaders": checked}


def found_parameters(diagnosis: Diagnosis, name: str) -> dict[str, Any]:
    """Median and 90 % interval of every parameter of an effect that was found, in its own unit."""
    evidence = diagnosis.final
    found: dict[str, Any] = {}
    for i, variant in enumerate(evidence.hypothesis.variants):
        if not _belongs(name, variant):
            continue
        for p in variant.parameters:
            centre, sd = evidence.value(f"{i}:{p.name}")
            for j in range(p.size):
                scope = [r for r, m in zip(diagnosis.data.layout.records, p.members, strict=True) if m == j]
                key = p.name if p.size == 1 else f"{p.name}[{j + 1}]"
                low, middle, high = _quantiles(p, float(centre[j]), float(sd[j]))
                found[key] = {
                    "median": middle, "interval90": [low, high], "unit": p.unit, "form": variant.label.split("#")[0],
                    "records": scope if len(scope) < len(diagnosis.data.layout.records) else "all",
                }  # fmt: skip
    return found


def _belongs(name: str, variant: Variant) -> bool:
    """Whether a variant is a form of the effect: each effect has a module of its name."""
    return variant.apply.__module__.rsplit(".", 1)[-1] == ("generic" if name == UNSEEN else name)


def _quantiles(parameter: Parameter, centre: float, sd: float) -> tuple[float, float, float]:
    """5, 50 and 95 % points of a parameter in its own unit; one that cannot be negative is cut off at zero."""
    below = float(ndtr(-centre / sd)) if parameter.positive and not parameter.log else 0.0
    low, middle, high = (centre + sd * float(ndtri(below + (1.0 - below) * p)) for p in (0.05, 0.5, 0.95))
    return (float(np.exp(low)), float(np.exp(middle)), float(np.exp(high))) if parameter.log else (low, middle, high)
