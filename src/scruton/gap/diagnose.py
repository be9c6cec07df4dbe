"""A campaign's gap.json: where the null model and the measurement part, which effect, how far the gap shrinks."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from scruton.campaign import Campaign, load_campaign
from scruton.campaign.remarks import Severity, sentences
from scruton.documents import as_json
from scruton.envelope.inspection import SET_ASIDE
from scruton.gap.advise import advise, confusions
from scruton.gap.data import GapData, load_gap
from scruton.gap.diagnosis import NONE, Diagnosis, diagnose_data
from scruton.gap.finding import Finding
from scruton.gap.hypothesis import FittedHypothesis
from scruton.gap.invisible import invisible
from scruton.gap.locate import locate
from scruton.gap.locate_curves import Curves, excess_curves
from scruton.gap.meaning import describe_unknown, meaning
from scruton.gap.results import FORMAT
from scruton.gap.shrink import shrink
from scruton.gap.sizes import found_parameters
from scruton.gap.thresholds import ANY_TEMPERATURE, FLOOR, LEAST, LOST, TEMPERATURE, TUNED_ON
from scruton.infer.cards import ModelCard
from scruton.progress import Progress
from scruton.provenance import provenance
from scruton.stats.evidence import Evidence
from scruton.stats.laplace_check import bridge_evidence, importance_evidence

_LEADERS = 2
_METHODS = (("importance", "error", "effective_draws"), ("bridge", "bridge_error", "bridge_effective_draws"))
SEED = 0  # of the few draws that a diagnosis makes


def examine(
    source: Path | Campaign,
    card: ModelCard,
    *,
    workers: int = 2,
    thorough: bool = False,
    design_sc: Sequence[float] = (),
    progress: Progress | None = None,
) -> tuple[Diagnosis, dict[str, Any], tuple[Finding, ...], Curves | None]:
    """Diagnose a campaign, or the one in a folder, and keep what the picture needs.

    That is the diagnosis, the content of gap.json, the findings, and the curves where they were made.

    `thorough` adds the evidence of the leaders by bridge sampling, which takes half a minute or more.  What the verdict
    moves is said at `design_sc`, the bridge's Scruton numbers, where there are some.
    """
    campaign = source if isinstance(source, Campaign) else load_campaign(source)
    data = load_gap(campaign, card)
    campaign = data.campaign
    diagnosis = diagnose_data(
        data, campaign, prior=card.effect_weights, prior_none=card.prior_none, workers=workers, progress=progress
    )
    gap = diagnosis.verdict != NONE
    curves = excess_curves(diagnosis.null) if gap else None
    findings = locate(diagnosis, curves) if gap else ()
    groups = confusions(diagnosis)
    content = {
        "format": FORMAT,
        "verdict": diagnosis.verdict,
        "also": list(diagnosis.found[1:]),
        "probability": _rounded(diagnosis.probability),
        "probability_also": _rounded(diagnosis.also),
        "in_its_place": {name: _rounded(probability) for name, probability in diagnosis.beside.items()},
        # before the temperatures: what `challenge tune` sets them by
        "log_weights": _weighed(diagnosis.log_weights),
        "indistinguishable": [list(group) for group in groups],
        "meaning": meaning(diagnosis, design_sc),
        "unknown": describe_unknown(diagnosis, findings),
        "where": [finding.to_json() for finding in findings],
        "shrink": shrink(diagnosis, alike=groups[0], workers=workers) if gap else {},
        "effects": {name: {"parameters": found_parameters(diagnosis, name)} for name in diagnosis.found},
        "advice": advise(diagnosis),
        "invisible": invisible(diagnosis),
        "calibrated_on": _temperatures(),
        "sizes_refer_to": _reference(diagnosis.data),
        "evidence": _evidence(diagnosis, thorough),
        "checks": as_json({name: vars(mark) for name, mark in diagnosis.checks.items()}),
        "flags": left_out_tests(diagnosis.data),
        "set_aside": sentences(remark for remark in campaign.remarks if remark.kind == SET_ASIDE),
        "doubts": sentences((remark for remark in data.remarks if remark.kind != SET_ASIDE), Severity.DOUBT),
        "card": card.name,
        "card_sha256": card.sha256,
        "sha256": dict(campaign.sha256 or {}),
        "provenance": provenance(
            "diagnose", seed=SEED, sha256=campaign.sha256 or {}, settings={"thorough": thorough},
            card={"name": card.name, "sha256": card.sha256},
        ),
    }  # fmt: skip
    return diagnosis, content, findings, curves


def _weighed(nats: Mapping[str, float]) -> dict[str, float | None]:
    """Nats by name, None of what cannot be weighed."""
    return {name: one if abs(one) < -0.5 * LOST else None for name, one in nats.items()}


def _rounded(probability: Mapping[str, float]) -> dict[str, float]:
    return {name: round(p, 6) for name, p in probability.items()}


def _temperatures() -> str:
    """What turns evidences into probabilities, and by what it was set."""
    least = " and ".join(f"{one:g}" for one in LEAST)
    by = f"set by {TUNED_ON} simulated campaigns"
    if (ANY_TEMPERATURE, TEMPERATURE) == LEAST:
        by = f"set no lower than {least}, which is more than {TUNED_ON} simulated campaigns ask for"
    return (
        f"evidences are divided by {ANY_TEMPERATURE:g} against none and by {TEMPERATURE:g} between effects, {by}; "
        f"{100.0 * FLOOR:g} % is dealt out evenly"
    )


def left_out_tests(data: GapData) -> list[str]:
    """What was not read, or of one thing alone, and what can be done with it: tests of a rig beside its peak test."""
    numbers = [(j, test.name) for j, test in enumerate(data.campaign.tests) if test.records]
    asked = data.first_in_wind if data.at_other_speeds is None else data.at_other_speeds.first_in_wind
    read = [name for j, name in numbers if j in data.first_in_wind]
    again = {name: data.tests[data.repeats[j]] for j, name in numbers if j in data.repeats}
    speeds = [name for j, name in numbers if j in asked and j not in data.first_in_wind]
    left_out = [name for j, name in numbers if j not in asked and name not in again]
    of_rigs = {test.rig for j, test in enumerate(data.campaign.tests) if j in data.first_in_wind}
    said = []
    if len(of_rigs) < len(read):
        said.append(
            f"Tests at several speeds of a rig: {', '.join(read)}. They are read together, for one pair of aerodynamic "
            "parameters, or one that changes smoothly with the reduced velocity, holds for all of them; the Griffin "
            "curve of `scruton fit` is that of the peak alone."
        )
    if again:
        pairs = ", ".join(f"{name} (of {of})" for name, of in again.items())
        said.append(
            f"Tests of the same rig in the same wind as its peak test: {pairs}. Their records are read as that test's "
            "own; in `campaign.toml` they may stand in one test, whose amplitude all of them then tell."
        )
    if speeds:
        said.append(
            f"Tests at other speeds of a rig: {', '.join(speeds)}. They are asked one thing alone, whether what "
            "differs between the peak tests follows the reduced velocity or belongs to the rig; a Y1 and an epsilon of "
            "their own are no gap, for within lock-in they change with the speed."
        )
    if left_out:
        said.append(
            f"Left out of the diagnosis: {', '.join(left_out)}. The null model has one pair of aerodynamic parameters, "
            f"so that of every rig the peak test alone is read ({', '.join(read) or 'none with records'}). "
            "`scruton fit` gives every test parameters of its own; `scruton diagnose --tests` with another of them in "
            "the place of a peak test diagnoses that one."
        )
    return said


def _reference(data: GapData) -> str:
    """What sizes are relative to."""
    layout, written = data.layout, data.campaign.section.motion.amplitude_text
    amplitude, rate = written(layout.reference_amplitude), f"{layout.reference_rate:.4g} 1/s"
    share = f"{layout.reference_rate / layout.reference_omega:.3%} of omega"
    if data.middle < 0:
        return f"the rigs in still air: damping rate {rate} ({share}), amplitude {amplitude}"
    test = data.tests[layout.test[data.middle]]
    return f"the null model at {test}: relaxation rate {rate} ({share}), stable amplitude {amplitude}"


def _evidence(diagnosis: Diagnosis, thorough: bool) -> dict[str, Any]:
    """Log evidence over the null model by Laplace; for the leaders by importance sampling, and by bridge sampling."""
    ranked = sorted(diagnosis.singles.values(), key=lambda candidate: -candidate.log_evidence)
    rng, null = np.random.default_rng(SEED), diagnosis.null

    def sampled(fit: FittedHypothesis, seed: int) -> tuple[Evidence, Evidence | None]:
        density, proposal = fit.hypothesis.log_density, fit.proposal()
        importance = importance_evidence(density, proposal, rng)
        return importance, bridge_evidence(density, proposal, seed, inside=fit.hypothesis.inside) if thorough else None

    base, checked = sampled(null, 0), {}
    for k, candidate in enumerate(ranked[:_LEADERS], 1):
        if (fit := candidate.best) is None:
            continue
        checked[candidate.name] = {"laplace": fit.log_evidence - null.log_evidence}
        for (value, error, draws), over, under in zip(_METHODS, sampled(fit, k), base, strict=True):
            if over and under:
                checked[candidate.name] |= {
                    value: over.log_z - under.log_z, error: float(np.hypot(over.error, under.error)),
                    draws: over.effective_size,
                }  # fmt: skip
    gains = {candidate.name: candidate.log_evidence - null.log_evidence for candidate in ranked}
    return {
        "gain": _weighed(gains), "leaders": checked,
        "at_other_speeds": dict(diagnosis.at_other_speeds),
    }  # fmt: skip
