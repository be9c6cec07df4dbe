"""What a verdict means: what is in the predictions, what it moves, how it is put in; and what an unknown looks like."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects import CATALOGUE
from scruton.dynamics.effects.effect import BENDS, DAMPING, DRIVE, FREQUENCY
from scruton.dynamics.effects.terms import HATS, Belongs, Term
from scruton.gap.attribute import best_of
from scruton.gap.bands import discrepancy_of_the_unknown
from scruton.gap.check import knocked
from scruton.gap.contradictions import Contradiction
from scruton.gap.data import GapData
from scruton.gap.diagnosis import NONE, UNKNOWN, Diagnosis
from scruton.gap.finding import Finding, amplitudes_of
from scruton.gap.hypothesis import FittedHypothesis, Hypothesis
from scruton.gap.lines import SecondLine, unexplained_lines
from scruton.gap.thresholds import COLOURED, PLACES_DESCRIBED, SAME_LINE, UNKNOWN_NATS, UNMOVED

WIND = "wind_speed_drift"
_EXCESS = range(Term.HAT, Term.BUMP + 1)
_COLOUR = {
    True: "what the null model leaves is coloured: something that lasts",
    False: "what the null model leaves is white",
    None: "whether what the null model leaves is coloured is not tested, for its records are too short",
}


def meaning(diagnosis: Diagnosis, design_sc: Sequence[float] = ()) -> dict[str, Any]:
    """What the verdict does to the bridge, and the command that puts it into the predictions.

    Parameters
    ----------
    diagnosis : Diagnosis
    design_sc : sequence of float
        Scruton numbers of the bridge; the middle one of the tests where none is known.

    Returns
    -------
    dict
        `amplitude_change`: relative, of the bridge's stable amplitude at its first Scruton number, once the effects
        found are in the model and what is the rig's own stays there; of an unknown cause the standard deviation of
        ln(amplitude) that it adds; None without a test in wind.  `at`: `scruton_number` and `amplitude_change` of each
        (not of an unknown cause, which adds the same at all).  `command`: the option of `scruton fit` and `report`
        that puts it in, None where nothing is to be put in.  `moves`: the change for people.  `remarks`: what else is
        to be known, a sentence each.  `text`: all of it for people, of predictions that were told nothing.
    """
    at = _changes(diagnosis, design_sc)
    change = discrepancy_of_the_unknown(diagnosis) if _adds_spread(diagnosis) else at[0][1] if at else None
    # the verdict's own name follows what another run finds
    command: str | None = "--effect auto"
    owners = {CATALOGUE[name].belongs for name in diagnosis.found if name in CATALOGUE}
    moves = _moves(diagnosis, change, at if design_sc else [])
    remarks = []
    if WIND in diagnosis.found or is_step(diagnosis):
        remarks.append("A step of the wind at one moment leaves much the same: look at the logged wind speed.")
    if Belongs.RIG in owners and change is not None:
        remarks.append(
            "What belongs to the rig stays in the laboratory; the wind's part, freed of it, goes to the bridge."
        )
    if owners & {Belongs.SENSOR, Belongs.RUN}:
        remarks.append("What belongs to a sensor or a run is better mended: take the records anew, or leave them out.")
    if diagnosis.verdict == NONE:
        command, first = None, "There is nothing to be put into the predictions."
    elif change is None:
        command, first = None, "There is no test in wind: nothing is predicted from these records."
    elif diagnosis.verdict == UNKNOWN and change < UNMOVED:
        command, first = None, f"{moves} Predictions stay as they are, with `{command}` or without."
    else:
        named = [name for name in diagnosis.found if name in CATALOGUE]
        alone = " or ".join(f"`--effect {name}`" for name in named) if len(diagnosis.found) > 1 else ""
        first = (
            "Predictions contain it only where they are told to: "
            f"`scruton fit CAMPAIGN {command}`, or `scruton report`, puts {'all of it' if alone else 'it'} in"
            f"{f', {alone} that alone' if alone else ''}; the same command without it takes it out. {moves}"
        )
    each = [{"scruton_number": number, "amplitude_change": moved} for number, moved in at]
    text = " ".join([first, *remarks])
    return {
        "amplitude_change": change, "at": each, "command": command, "moves": moves, "remarks": remarks, "text": text,
    }  # fmt: skip


def is_step(diagnosis: Diagnosis) -> bool:
    """Whether an unknown cause is a drive that is another from one moment on, as a step of the wind leaves it."""
    variants = diagnosis.final.hypothesis.variants
    return UNKNOWN in diagnosis.found and any(variant.scan == "moment" for variant in variants)


def _adds_spread(diagnosis: Diagnosis) -> bool:
    return diagnosis.verdict == UNKNOWN and diagnosis.data.middle >= 0


def _moves(diagnosis: Diagnosis, change: float | None, design: Sequence[tuple[float, float | None]]) -> str:
    """What the bridge's amplitude does, in a sentence."""
    if change is None:
        return ""
    if diagnosis.verdict == UNKNOWN and change < UNMOVED:
        return "It has no equation, and moves no stable amplitude."
    if diagnosis.verdict == UNKNOWN:
        return f"It has no equation: the bands of ln(amplitude) widen by {change:.2g}."
    known = [(f"at Sc {number:.4g}", moved) for number, moved in design if moved is not None]
    each = known or [("at the middle Scruton number", change)]
    moves = [f"{where} moves by {100.0 * moved:+.2g} %".replace("-", "−") for where, moved in each]
    return f"The bridge's stable amplitude {', '.join(moves)}."


def _changes(diagnosis: Diagnosis, design_sc: Sequence[float]) -> list[tuple[float, float | None]]:
    """Scruton numbers with the relative change of the bridge's stable amplitude there; None where there is none."""
    r = diagnosis.data.middle
    if r < 0 or diagnosis.verdict in (NONE, UNKNOWN):
        return []

    def settled(fit: FittedHypothesis, number: float | None) -> float:
        return float(fit.hypothesis.stable_amplitude(fit.mode[None], r, scruton_number=number, bridge=True)[0])

    changes: list[tuple[float, float | None]] = []
    for number in design_sc or (None,):
        before, after = (settled(fit, number) for fit in (diagnosis.null, diagnosis.final))
        moved = after / before - 1.0 if before > 0.0 and np.isfinite(after) else None
        changes.append((float(diagnosis.data.layout.scruton_number[r]) if number is None else number, moved))
    return changes


def strange_lines(diagnosis: Diagnosis) -> list[SecondLine]:
    """Lines beside the response that nothing in the catalogue brings here, strongest first."""
    leader = best_of(diagnosis.rivals).name if set(diagnosis.rivals) & set(CATALOGUE) else NONE
    leads = diagnosis.log_weights.get(leader, 0.0) > 0.0
    names = [*([leader] if leads else []), *diagnosis.found[1:]]
    return unexplained_lines(diagnosis.lines, names, diagnosis.data)


def known_by_lines(diagnosis: Diagnosis) -> list[SecondLine]:
    """Those lines, where no generic term says anything of an unknown cause; else none."""
    return [] if _generic_says(diagnosis) else strange_lines(diagnosis)


def known_by_contradictions(diagnosis: Diagnosis) -> tuple[Contradiction, ...]:
    """What the records cannot do, likewise."""
    return () if _generic_says(diagnosis) else diagnosis.contradictions


def _generic_says(diagnosis: Diagnosis) -> bool:
    alone = diagnosis.singles.get(UNKNOWN)
    return bool(alone and alone.best and alone.log_evidence - diagnosis.null.log_evidence >= UNKNOWN_NATS)


def foremost_line(lines: Sequence[SecondLine]) -> list[SecondLine]:
    """Of lines in several records the one that stands in most of them, then the largest; all records that it is in.

    Those of neighbouring frequencies are one: a mode's follows the amplitude and the setting a little.
    """
    groups: list[list[SecondLine]] = []
    for line in sorted(lines, key=lambda one: one.frequency):
        near = bool(groups) and line.frequency <= groups[-1][-1].frequency * (1.0 + SAME_LINE)
        groups = [*groups[:-1], [*groups[-1], line]] if near else [*groups, [line]]
    return max(groups, key=lambda group: (len({one.record for one in group}), max(one.amplitude for one in group)))


def lines_words(lines: Sequence[SecondLine], data: GapData) -> str:
    """Where the foremost of some lines stands, how large it is beside the response, and how many others there are."""
    group = foremost_line(lines)

    def share(line: SecondLine) -> float:
        return line.amplitude / float(np.median(data.cycles[line.record].amplitude))

    largest = max(group, key=share)
    ends = [f"{end:.4g}" for end in (group[0].frequency, group[-1].frequency)]
    count = len({one.record for one in group})
    off = largest.frequency / data.cycles[largest.record].reference_frequency
    where = f"{largest.record}" if count == 1 else f"{count} records, most in {largest.record}"
    words = (
        f"{' to '.join(dict.fromkeys(ends))} Hz in {where} ({off:.3g} times the frequency of the response, "
        f"{100.0 * share(largest):.2g} % of its amplitude)"
    )
    others = len({one.record for one in lines if one not in group})
    return f"{words}, and others in {others} record{'s' if others > 1 else ''}" if others else words


def describe_unknown(diagnosis: Diagnosis, findings: Sequence[Finding]) -> dict[str, Any]:
    """What an unknown cause looks like: its form, where, at what amplitudes, how large, and whether it has colour.

    Returns
    -------
    dict
        `form`; `amplitude`: range in the records in which it acts, A/D or rad; `records`: those; `largest`: excess
        damping over the relaxation damping, relative scatter of the drive, a relative change of it or of the frequency,
        play over the largest amplitude, or a line's over the response's median one, which `unit` says, None for
        nothing; `coloured`: whether what the null model leaves is predictable from cycle to cycle, None where no record
        is long enough to tell;
        `lines`: beside the response, each with `record`, `frequency` (Hz), `amplitude` (A/D or rad); `text`.  Empty
        where the verdict is another.
    """
    if diagnosis.verdict != UNKNOWN:
        return {}
    data, layout = diagnosis.data, diagnosis.data.layout
    lines, by_lines, against = strange_lines(diagnosis), known_by_lines(diagnosis), diagnosis.contradictions
    p, unit = diagnosis.checks[NONE].colour, data.campaign.section.motion.amplitude_text
    coloured = None if np.isnan(p) else bool(p < COLOURED)
    if by_lines:
        lined = {line.record for line in lines}
        acting = np.array([name in lined for name in layout.records])
        form, what = "a line beside the response", "of the response's amplitude"
        largest = max(line.amplitude / float(np.median(data.cycles[line.record].amplitude)) for line in lines)
    elif worst := next(iter(known_by_contradictions(diagnosis)), None):
        alike = [one for one in against if one.kind == worst.kind]
        form, largest, what = worst.form, max(one.share for one in alike), worst.of
        acting = np.isin(layout.records, [one.record for one in alike])
    elif any(one.effect == UNKNOWN for one in diagnosis.final.hypothesis.variants):
        form = diagnosis.final.hypothesis.variants[-1].label
        largest, what, acting = _of_generic(diagnosis)
    else:
        form, largest, what = "none of the generic terms", 0.0, ""
        acting = layout.wind if layout.wind.any() else ~layout.wind
        struck = {name for name, nats in knocked(diagnosis.final).items() if nats > 0.0}
        if diagnosis.checks[NONE].knocks > UNKNOWN_NATS:
            form, acting = "sudden knocks", np.array([name in struck for name in layout.records])
    amplitude = _amplitudes(diagnosis, acting)
    records = [name for name, acts in zip(layout.records, acting, strict=True) if acts]
    where = (
        f"{len(records)} of {len(layout.records)} records" if len(records) > PLACES_DESCRIBED else ", ".join(records)
    )
    size = f"up to {largest:.2g} {what} at" if what else "at"
    own = [finding for finding in findings if finding.effect is None and _within(finding, data, acting)]
    seen = dict.fromkeys(f"{finding.quantity} in {finding.record or finding.test or finding.rig}" for finding in own)
    strongest = "; ".join([*seen][:PLACES_DESCRIBED])
    parts = [f"It looks like {form}: {size} {' to '.join(map(unit, amplitude))}, in {where}; {_COLOUR[coloured]}."]
    if lines:
        parts.append(f"Beside the response stands a line: {lines_words(lines, data)}.")
    for worst in {one.kind: one for one in reversed(against)}.values():
        more = sum(one.kind == worst.kind for one in against) - 1
        others = f", and {more} more likewise" if more else ""
        parts.append(f"{worst.words}{others}: {worst.cause}.")
    if not by_lines and strongest:
        parts.append(f"Strongest: {strongest}.")
    return {
        "form": form, "amplitude": amplitude, "records": records, "largest": largest,
        "unit": what or None, "coloured": coloured,
        "lines": [{"record": one.record, "frequency": one.frequency, "amplitude": one.amplitude} for one in lines],
        "text": " ".join(parts),
    }  # fmt: skip


def _within(finding: Finding, data: GapData, acting: np.ndarray) -> bool:
    """Whether all records that a place belongs to are among those that something acts in, (R,) of bool."""
    layout, inside = data.layout, np.ones(len(data.layout.records), dtype=bool)
    if finding.record is not None:
        inside = np.array(layout.records) == finding.record
    elif finding.test is not None:
        inside = np.array([i >= 0 and data.tests[i] == finding.test for i in layout.test])
    elif finding.rig is not None:
        inside = np.array([data.rigs[i] == finding.rig for i in layout.rig])
    return bool(np.all(acting[inside]))


def _of_generic(diagnosis: Diagnosis) -> tuple[float, str, np.ndarray]:
    """How large a generic term is, of what, and the records, (R,) of bool, in which it is more than half of that."""
    layout, fit = diagnosis.data.layout, diagnosis.final
    rest = Hypothesis(fit.hypothesis.null, fit.hypothesis.variants[:-1])
    without = rest.table(fit.mode[None, : rest.size])[0]
    own = np.abs(fit.table - without)
    own[:, Term.WARMING] *= -np.expm1(-own[:, Term.WARMING_PACE])
    if np.any(damping := own[:, [*_EXCESS, Term.STRUCTURAL, Term.WARMING]]):
        each, what = (damping / layout.rate[:, None]).max(axis=1), DAMPING
    elif np.any(own[:, Term.JUMP]):
        each, what = own[:, Term.JUMP], DRIVE
    elif np.any(own[:, Term.GUST]):
        each, what = _over(fit.table[:, Term.GUST], fit.table[:, Term.DRIVE]), DRIVE
    elif np.any(own[:, Term.FREQUENCY_TREND]):
        each, what = own[:, Term.FREQUENCY_TREND], FREQUENCY
    elif np.any(own[:, Term.FORCE_TWICE]):
        each, what = np.hypot(own[:, Term.FORCE_COS], own[:, Term.FORCE_SIN]) / layout.rate, DAMPING
    elif np.any(own[:, Term.CLIP]):
        return float((own[:, Term.CLIP] / layout.largest).max()), "of the largest amplitude", own[:, Term.CLIP] > 0.0
    else:
        return float(own[:, list(BENDS)].max()), FREQUENCY, own.max(axis=1) > 0.0
    return float(each.max()), what, each > 0.5 * each.max()


def _amplitudes(diagnosis: Diagnosis, acting: np.ndarray) -> tuple[float, float]:
    """Range of the amplitudes at which an unknown cause acts, in these records: of hats, where they are large."""
    table = diagnosis.final.table
    bumps = table[table[:, Term.BUMP] != 0.0]
    if bumps.size and not known_by_lines(diagnosis):  # as far as half of it
        half = np.sqrt(2.0 * np.log(2.0)) * bumps[0, Term.BUMP_WIDTH]
        low, high = np.exp(bumps[0, Term.BUMP_AT] + np.array([-half, half])).tolist()
        return low, min(high, float(diagnosis.data.layout.largest.max()))
    hats = np.abs(table[:, Term.HAT : Term.HAT + HATS] / diagnosis.data.layout.rate[:, None])
    if not np.any(hats) or known_by_lines(diagnosis):
        return amplitudes_of(diagnosis.data, acting)
    knots = diagnosis.data.layout.knots[np.any(hats > 0.5 * hats.max(), axis=0)]
    return float(knots.min()), float(knots.max())


def _over(part: FloatArray, whole: FloatArray) -> FloatArray:
    return np.asarray(np.divide(part, whole, out=np.zeros_like(part), where=whole > 0.0))
