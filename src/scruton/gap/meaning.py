"""What a verdict means: what is in the predictions, what it moves, how it is put in; and what an unknown looks like."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects import CATALOGUE
from scruton.dynamics.effects.terms import Belongs, Term
from scruton.dynamics.limit_cycle import limit_cycle_amplitude, transferred
from scruton.gap.bands import discrepancy_of_the_unknown
from scruton.gap.diagnosis import NONE, UNKNOWN, Diagnosis
from scruton.gap.finding import Finding
from scruton.gap.hypothesis import FittedHypothesis
from scruton.gap.thresholds import COLOURED, PLACES_DESCRIBED


def meaning(diagnosis: Diagnosis) -> dict[str, Any]:
    """What the verdict does to the bridge, and the command that puts it into the predictions.

    Returns
    -------
    dict
        `amplitude_change`: relative, of the bridge's stable amplitude at the middle setting, once the effects found are
        in the model and what is the rig's own stays there; of an unknown cause the standard deviation of ln(amplitude)
        that it adds; None without a test in wind.  `command`: the option of `scruton fit`, `predict` and `size` that
        puts it in.  `text`: the same for people.  Empty where there is no gap.
    """
    if diagnosis.verdict == NONE:
        return {}
    change = _change(diagnosis)
    # the verdict's own name follows what another run finds
    command = "--effect auto"
    owners = {CATALOGUE[name].belongs for name in diagnosis.found if name in CATALOGUE}
    parts = [f"Predictions contain it only where they are told to: `scruton fit CAMPAIGN {command}` puts it in."]
    if change is None:
        parts = ["There is no test in wind: nothing is predicted from these records."]
    elif diagnosis.verdict == UNKNOWN:
        parts.append(f"It has no equation: the bands of ln(amplitude) widen by {change:.2g}.")
    else:
        percent = f"{100.0 * change:+.2g} %".replace("-", "−")
        parts.append(f"The bridge's stable amplitude at the middle Scruton number moves by {percent}.")
    if "wind_speed_drift" in diagnosis.found:
        parts.append("A step of the wind at one moment leaves much the same: look at the logged wind speed.")
    if Belongs.RIG in owners and change is not None:
        parts.append(
            "What belongs to the rig stays in the laboratory; the wind's part, freed of it, goes to the bridge."
        )
    if owners & {Belongs.SENSOR, Belongs.RUN}:
        parts.append("What belongs to a sensor or a run is better mended: take the records anew, or leave them out.")
    return {"amplitude_change": change, "command": command, "text": " ".join(parts)}


def _change(diagnosis: Diagnosis) -> float | None:
    data, r = diagnosis.data, diagnosis.data.middle
    if r < 0:
        return None
    if diagnosis.verdict == UNKNOWN:
        return discrepancy_of_the_unknown(diagnosis)

    def settled(fit: FittedHypothesis) -> float:
        row = transferred(fit.table[r])[None]
        return float(limit_cycle_amplitude(row, data.channels.knots, data.layout.reference_amplitude)[0])

    before, after = settled(diagnosis.null), settled(diagnosis.final)
    return after / before - 1.0 if before > 0.0 and np.isfinite(after) else None


def describe_unknown(diagnosis: Diagnosis, findings: Sequence[Finding]) -> dict[str, Any]:
    """What an unknown cause looks like: its form, where, at what amplitudes, how large, and whether it has colour.

    Returns
    -------
    dict
        `form`; `amplitude`: range, A/D or rad, None where it is of no amplitude; `records`; `largest`: excess damping
        over the relaxation damping, relative scatter of the drive, or a relative change of it; `coloured`: whether what
        the null model leaves is predictable from cycle to cycle; `text`.  Empty where the verdict is another.
    """
    if diagnosis.verdict != UNKNOWN or not diagnosis.final.hypothesis.variants:
        return {}
    layout, variant = diagnosis.data.layout, diagnosis.final.hypothesis.variants[-1]
    table, null = diagnosis.final.table, diagnosis.null.table
    hats = table[:, Term.HAT :] / layout.rate[:, None]
    amplitude: tuple[float, float] | None = None
    acting = np.abs(table - null).max(axis=1) > 0.0
    if np.any(hats):
        each = np.abs(hats)
        knots = layout.knots[np.any(each > 0.5 * each.max(), axis=0)]
        amplitude, largest, what = (
            (float(knots.min()), float(knots.max())),
            float(each.max()),
            "of the relaxation damping",
        )
        acting = each.max(axis=1) > 0.5 * each.max()
    elif variant.scan == "moment":
        jump = np.abs(table[:, Term.JUMP])
        largest, what, acting = float(jump.max()), "of the drive", jump > 0.5 * jump.max()
    elif np.any(table[:, Term.GUST] > null[:, Term.GUST]):
        scatter = _over(table[:, Term.GUST], table[:, Term.DRIVE])
        largest, what, acting = float(scatter.max()), "of the drive", scatter > 0.5 * scatter.max()
    else:
        largest, what = (
            float(np.abs(table - null)[:, [Term.STIFFNESS, Term.STIFFNESS_LINEAR]].max()),
            "of the frequency",
        )
    coloured = bool(diagnosis.checks[NONE].colour < COLOURED)
    records = [name for name, acts in zip(layout.records, acting, strict=True) if acts]
    where = (
        f"{len(records)} of {len(layout.records)} records" if len(records) > PLACES_DESCRIBED else ", ".join(records)
    )
    unit = diagnosis.data.campaign.section.amplitude_unit
    at = f" at {amplitude[0]:.3g} to {amplitude[1]:.3g} {unit}" if amplitude else ""
    colour = "what the null model leaves is coloured: something that lasts" if coloured else "what is left is white"
    seen = [f"{finding.quantity} in {finding.record or finding.test or finding.rig}" for finding in findings]
    strongest = "; ".join(dict.fromkeys(seen[:PLACES_DESCRIBED]))
    text = (
        f"It looks like {variant.label}: up to {largest:.2g} {what}{at}, in {where}; {colour}. Strongest: {strongest}."
    )
    return {
        "form": variant.label, "amplitude": amplitude, "records": records, "largest": largest, "coloured": coloured,
        "text": text,
    }  # fmt: skip


def _over(part: FloatArray, whole: FloatArray) -> FloatArray:
    return np.asarray(np.divide(part, whole, out=np.zeros_like(part), where=whole > 0.0))
