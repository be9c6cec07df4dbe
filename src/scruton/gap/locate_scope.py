"""Where the effects of the verdict act: rigs, tests and records, with the size that each effect reads of itself."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import norm

from scruton.arrays import FloatArray
from scruton.dynamics.effects import CATALOGUE, Effect
from scruton.dynamics.effects.effect import Parameter, Span, Station, Variant
from scruton.dynamics.effects.terms import Belongs
from scruton.dynamics.limit_cycle import amplitude_rates
from scruton.dynamics.reading import readings
from scruton.gap.data import GapData
from scruton.gap.diagnosis import Diagnosis
from scruton.gap.finding import Finding, amplitudes_of, place
from scruton.gap.hypothesis import FittedHypothesis, Hypothesis
from scruton.gap.thresholds import MOST_RECORDS_OF_AN_EFFECT, NEGLIGIBLE_PLACE


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
    found = []
    for name in diagnosis.found:
        numbers = [i for i, variant in enumerate(fit.hypothesis.variants) if variant.effect == name]
        if name not in CATALOGUE or not numbers:
            continue
        findings = _findings(*_by_rig(_Placed(CATALOGUE[name], numbers[0], fit)))
        largest = max((abs(finding.excess) for finding in findings), default=0.0)
        findings = [finding for finding in findings if abs(finding.excess) > NEGLIGIBLE_PLACE * largest]
        found += sorted(_strongest(findings), key=lambda finding: -finding.significance)
    return found


def _strongest(findings: list[Finding]) -> list[Finding]:
    """Of many records, one for each test and sign, the strongest."""
    if len(findings) <= MOST_RECORDS_OF_AN_EFFECT:
        return findings
    kinds: dict[tuple[str | None, bool], list[Finding]] = {}
    for finding in findings:
        kinds.setdefault((finding.test or finding.rig, finding.excess > 0.0), []).append(finding)
    found = []
    for several in kinds.values():
        strongest = max(several, key=lambda finding: finding.significance)
        beside = ", ".join(str(finding.record) for finding in several if finding is not strongest)
        found.append(replace(strongest, detail=f"{strongest.detail}; also {beside}") if beside else strongest)
    return found


def _by_rig(placed: _Placed) -> tuple[_Placed, np.ndarray]:
    """Give an effect that acts in every rig alike a size of its own in each, to see in which it does.

    Returns
    -------
    placed : _Placed
        With the hypothesis to read sizes from.
    records : (R,) array of bool
        Where the effect acts.
    """
    layout, size, hypothesis = placed.data.layout, placed.size, placed.fit.hypothesis
    inside = placed.variant.scope.records
    rigs = np.unique(layout.rig[inside])
    if size.size > 1 and not size.log:
        # sizes of their own: those that chance would hardly give among so many
        value, sd = placed.value()
        acts = np.abs(value) > norm.isf(0.05 / size.size) * sd
        return placed, inside & acts[size.members] & (size.members >= 0)
    if not placed.damps_a_rig or rigs.size < 2 or size.log:
        return placed, inside
    members = np.where(inside, np.searchsorted(rigs, layout.rig), -1)
    own_size = replace(size, members=members)
    freed = replace(
        placed.variant,
        parameters=tuple(own_size if p is size else p for p in placed.variant.parameters),
    )
    variants = [freed if i == placed.number else variant for i, variant in enumerate(hypothesis.variants)]
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
    found = []
    for g in np.unique(groups[acts]):
        mine = acts & (groups == g)
        each: Iterable[np.ndarray] = [mine]
        if placed.effect.belongs is Belongs.RUN:
            each = (np.arange(mine.size) == r for r in np.flatnonzero(mine))
        found += [finding for records in each if (finding := _finding(placed, records)) is not None]
    return found


def _finding(placed: _Placed, mine: np.ndarray) -> Finding | None:
    data, effect = placed.data, placed.effect
    layout = data.layout
    in_wind = np.flatnonzero(mine & layout.wind)
    record = int(in_wind[0] if in_wind.size else np.flatnonzero(mine)[0])
    span = amplitudes_of(data, mine)
    at = float(np.clip(layout.reference_amplitude, *span))
    value, sd = _size(placed, record, at, span)
    if value == 0.0 or not np.isfinite(sd) or not sd > 0.0:
        return None  # without an answer to its parameters: a rig that never reaches the level of clipping, say
    raw, raw_sd = placed.value()
    member = int(placed.size.members[record])
    fields: dict[str, Any] = {"effect": effect.name, "amplitude": span}
    if not placed.size.log:
        fields["significance"] = float(abs(raw[member]) / raw_sd[member])
    if effect.size.span is not None:
        fields["amplitude"] = effect.size.span(placed.fit.table[record], span)
    if np.any(mine & ~layout.wind):
        fields["test"] = None
    if np.count_nonzero(mine) > 1:
        fields |= {"record": None, "time": None}
    detail = f"{effect.title.lower()}: {effect.size.unit.format(at=at)}"
    return place(data, record, effect.size.quantity, value, sd, detail, **fields)


def _size(placed: _Placed, record: int, at: float, span: Span) -> tuple[float, float]:
    """What an effect adds in a record, and its standard error, to first order in its own parameters."""
    fit, number, hypothesis = placed.fit, placed.number, placed.fit.hypothesis
    others = Hypothesis(hypothesis.null, tuple(v for i, v in enumerate(hypothesis.variants) if i != number))
    coordinates = np.arange(hypothesis.size)
    own = np.concatenate([coordinates[where] for (owner, _), where in hypothesis.slices.items() if owner == number])
    without = others.table(np.delete(fit.mode, own)[None])[:, record]
    grid, knots = np.array([at]), placed.data.channels.knots

    def damping(rows: FloatArray) -> FloatArray:
        return -amplitude_rates(np.ascontiguousarray(rows), grid, knots)[:, 0] / at

    station = Station(at, span[1], float(placed.data.layout.omega[record]), damping, readings)
    read = placed.effect.size.read
    value, slopes = fit.slopes(lambda table: read(table[:, record], without, station), 1e-2, own)
    variance = float(slopes @ fit.covariance[np.ix_(own, own)] @ slopes)
    return float(value), float(np.sqrt(max(variance, 0.0)))
