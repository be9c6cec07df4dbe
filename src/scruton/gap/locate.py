"""Where the null model and the measurement part: every place, with amplitude, time, rig, test, size and interval.

First the effects of the verdict, with the size that each reads of itself in the rigs, tests and records where it acts.
"""

from dataclasses import dataclass, replace
from operator import attrgetter, itemgetter
from typing import Any

import numpy as np
from scipy.special import ndtri

from scruton.arrays import FloatArray
from scruton.dynamics.effects import CATALOGUE, Effect
from scruton.dynamics.effects.effect import Parameter, Span, Station, Variant
from scruton.dynamics.effects.terms import Belongs
from scruton.dynamics.limit_cycle import amplitude_rates
from scruton.dynamics.reading import readings
from scruton.gap import locate_records, thresholds
from scruton.gap.data import GapData
from scruton.gap.diagnosis import UNKNOWN, Diagnosis
from scruton.gap.finding import Finding, alike, amplitudes_of, place
from scruton.gap.hypothesis import FittedHypothesis, Hypothesis
from scruton.gap.locate_curves import Curves, curve_findings, excess_curves


def locate(diagnosis: Diagnosis, curves: Curves | None = None) -> tuple[Finding, ...]:
    """Find where the null model and the measurement part.

    First where the effects of the verdict act, then what is seen without a look at the verdict, strongest first; at
    most `thresholds.MOST_FINDINGS`.  `curves` are `excess_curves(diagnosis.null)`, where they are there already.
    """
    scoped = scope_findings(diagnosis)
    explained = {_key(finding) for finding in scoped}
    seen = _places(diagnosis, curves or excess_curves(diagnosis.null))
    return tuple(
        [*scoped, *(finding for finding in seen if _key(finding) not in explained)][: thresholds.MOST_FINDINGS]
    )


def _key(finding: Finding) -> tuple[object, ...]:
    return finding.quantity, finding.rig, finding.test, finding.record, finding.excess > 0.0


def _places(diagnosis: Diagnosis, curves: Curves) -> list[Finding]:
    """Places that the null model leaves, whatever the verdict, strongest first.

    Most quantities move a little with any effect.  What a drift, a gain, a test or a stated damping would explain is
    listed only where such an effect gains about as much evidence as the best one.
    """
    looks = [
        locate_records.scatter_findings(curves.fit),
        locate_records.line_findings(diagnosis.lines, diagnosis.data),
        locate_records.wave_findings(diagnosis.data),
        locate_records.contradiction_findings(diagnosis.contradictions, diagnosis.data),
        *(
            look(diagnosis.null)
            for look, names in locate_records.CONTRASTS.items()
            if any(_credible(diagnosis, name) for name in names)
        ),
    ]
    findings = [*curve_findings(curves, diagnosis.data), *(finding for look in looks for finding in merged(look))]
    findings.sort(key=lambda finding: -finding.significance)
    quantities = [finding.quantity for finding in findings]
    late = [quantities[:i].count(quantity) >= thresholds.MOST_OF_A_QUANTITY for i, quantity in enumerate(quantities)]
    return [finding for _, finding in sorted(zip(late, findings, strict=True), key=itemgetter(0))]


def merged(findings: list[Finding]) -> list[Finding]:
    """The strongest of the findings of one kind and sign in several records of a test or rig."""
    kinds = alike(findings, lambda look: (look.quantity, look.rig, look.test, look.kind, look.excess > 0.0))
    return [max(several, key=attrgetter("significance")) for several in kinds]


def _credible(diagnosis: Diagnosis, effect: str) -> bool:
    """Whether an effect explains about as much as the best one does."""
    if effect in diagnosis.found:
        return True
    gains = {name: single.log_evidence - diagnosis.null.log_evidence for name, single in diagnosis.singles.items()}
    best = max((gain for name, gain in gains.items() if name != UNKNOWN), default=0.0)
    return gains.get(effect, 0.0) > max(0.0, thresholds.ECHO * best)


@dataclass(frozen=True, eq=False)
class _Placed:
    """A catalogued effect at its place in a fitted hypothesis."""

    effect: Effect
    number: int
    fit: FittedHypothesis

    @property
    def variant(self) -> Variant:
        return self.fit.hypothesis.variants[self.number]

    @property
    def data(self) -> GapData:
        return self.fit.hypothesis.data

    @property
    def size(self) -> Parameter:
        return next(p for p in self.variant.parameters if p.name == self.variant.size)

    @property
    def damps_a_rig(self) -> bool:
        return self.effect.belongs is Belongs.RIG and self.effect.size.quantity == "damping"

    def value(self) -> tuple[FloatArray, FloatArray]:
        """Size and standard error, (members,) each, in the sampled coordinate."""
        return self.fit.value(self.size.name, self.number)


def scope_findings(diagnosis: Diagnosis) -> list[Finding]:
    """One finding for every rig or test that an effect of the verdict acts in.

    Effects stand in the order of the verdict, the most significant place of each first.
    """
    fit = diagnosis.final
    scoped = []
    for name in diagnosis.found:
        numbers = [i for i, variant in enumerate(fit.hypothesis.variants) if variant.effect == name]
        if name not in CATALOGUE or not numbers:
            continue
        placed = _Placed(CATALOGUE[name], numbers[0], fit)
        own = placed.size.size
        findings = _findings(*_by_rig(placed))
        largest = max((abs(finding.excess) for finding in findings), default=0.0)
        # of sizes of their own, those that chance would hardly give among so many
        surely = -ndtri(0.05 / own) if own > 1 else 0.0
        findings = [
            finding
            for finding in findings
            if abs(finding.excess) > thresholds.NEGLIGIBLE_PLACE * largest and finding.significance > surely
        ]
        scoped += sorted(_strongest(findings), key=lambda finding: -finding.significance)
    return scoped


def _strongest(findings: list[Finding]) -> list[Finding]:
    """Of many records, one for each test and sign, the strongest."""
    if len(findings) <= thresholds.MOST_RECORDS_OF_AN_EFFECT:
        return findings
    kept = []
    for several in alike(findings, lambda finding: (finding.test or finding.rig, finding.excess > 0.0)):
        strongest = max(several, key=attrgetter("significance"))
        beside = ", ".join(str(finding.record) for finding in several if finding is not strongest)
        kept.append(replace(strongest, detail=f"{strongest.detail}; also {beside}") if beside else strongest)
    return kept


def _by_rig(placed: _Placed) -> tuple[_Placed, np.ndarray]:
    """Give an effect that acts in every rig alike a size of its own in each, to see in which it does.

    Returns it with the hypothesis to read sizes from, and the records in which it acts, (R,) of bool.
    """
    layout, size, hypothesis = placed.data.layout, placed.size, placed.fit.hypothesis
    inside = placed.variant.scope.records
    rigs = np.unique(layout.rig[inside])
    if size.size > 1 or not placed.damps_a_rig or rigs.size < 2 or size.log:
        return placed, inside
    members = np.where(inside, np.searchsorted(rigs, layout.rig), -1)
    own_size = replace(size, members=members)
    parameters = tuple(own_size if p is size else p for p in placed.variant.parameters)
    variants = list(hypothesis.variants)
    variants[placed.number] = replace(placed.variant, parameters=parameters)
    wider = Hypothesis(hypothesis.null, tuple(variants))
    start = wider.start()
    for key, where in hypothesis.slices.items():
        start[wider.slices[key]] = placed.fit.mode[where]
    fit = wider.fit(start)
    # Alike is what the evidence chose: only a rig that is nearer to nothing than to the others is left out.
    acts = fit.value(size.name, placed.number)[0] / float(placed.value()[0][0]) > 0.5
    if not acts.any():
        return placed, inside
    return replace(placed, fit=fit), inside & acts[members]


def _findings(placed: _Placed, acts: np.ndarray) -> list[Finding]:
    layout = placed.data.layout
    by_rig = placed.damps_a_rig or bool(np.any(acts & ~layout.wind))
    groups = layout.rig if by_rig else np.where(layout.wind, layout.test, -1)
    if placed.effect.belongs is Belongs.RUN:
        groups = np.arange(acts.size)
    every = (_finding(placed, acts & (groups == g)) for g in np.unique(groups[acts]))
    return [finding for finding in every if finding is not None]


def _finding(placed: _Placed, records: np.ndarray) -> Finding | None:
    data, effect = placed.data, placed.effect
    layout = data.layout
    in_wind = np.flatnonzero(records & layout.wind)
    record = int(in_wind[0] if in_wind.size else np.flatnonzero(records)[0])
    span = amplitudes_of(data, records)
    at = float(np.clip(placed.variant.read_at * layout.reference_amplitude, *span))
    value, sd = _size(placed, record, at, span)
    if value == 0.0 or not np.isfinite(sd) or not sd > 0.0:
        return None  # without an answer to its parameters: a rig that never reaches the level of clipping, say
    raw, raw_sd = placed.value()
    member = int(placed.size.members[record])
    fields: dict[str, Any] = {"effect": effect.name, "amplitude": span}
    if not placed.size.log:
        alone = float(abs(raw[member]) / raw_sd[member])
        # of several sizes one may be nothing where all together are not
        together = sum(p.unit == placed.size.unit for p in placed.variant.parameters) > 1
        fields["significance"] = max(alone, abs(value) / sd) if together else alone
    if effect.size.span is not None:
        fields["amplitude"] = effect.size.span(placed.fit.table[record], span)
    if np.any(records & ~layout.wind):
        fields["test"] = None
    if np.count_nonzero(records) > 1:
        fields |= {"record": None, "time": None}
    detail = f"{effect.title.lower()}: {effect.size.unit.format(at=data.campaign.section.motion.amplitude_text(at))}"
    return place(data, record, effect.size.quantity, value, sd, detail, **fields)


def _size(placed: _Placed, record: int, at: float, span: Span) -> tuple[float, float]:
    """What an effect adds in a record, and its standard error, to first order in its own parameters."""
    fit, number, hypothesis = placed.fit, placed.number, placed.fit.hypothesis
    others = Hypothesis(hypothesis.null, tuple(v for i, v in enumerate(hypothesis.variants) if i != number))
    coordinates = np.arange(hypothesis.size)
    inner = np.concatenate([coordinates[where] for (owner, _), where in hypothesis.slices.items() if owner == number])
    without = others.table(np.delete(fit.mode, inner)[None])[:, record]
    grid, knots = np.array([at]), placed.data.channels.knots

    def damping(rows: FloatArray) -> FloatArray:
        return -amplitude_rates(np.ascontiguousarray(rows), grid, knots)[:, 0] / at

    station = Station(at, span[1], float(placed.data.layout.omega[record]), damping, readings)
    read = placed.effect.size.read
    value, slopes = fit.slopes(lambda table: read(table[:, record], without, station), 1e-2, inner)
    variance = float(slopes @ fit.covariance[np.ix_(inner, inner)] @ slopes)
    return float(value), float(np.sqrt(max(variance, 0.0)))
