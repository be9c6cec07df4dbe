"""Which variants are worth a fit: score tests from the optimum of the null model alone."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from threading import Lock

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import Variant
from scruton.dynamics.extended import channel_innovations
from scruton.gap.hypothesis import FittedHypothesis
from scruton.gap.thresholds import FEWEST_BEATS

_NUDGE = 1e-4
_MOMENTS = np.arange(0.15, 0.86, 0.05)
_DETUNINGS = np.concatenate([np.arange(-0.2, -0.0045, 0.001), np.arange(0.005, 0.2001, 0.001)])


@dataclass(frozen=True, eq=False)
class ScoreTest:
    """A variant, the gain in log evidence that its score at the optimum lets expect, and where to start its fit."""

    variant: Variant
    gain: float
    start: Mapping[str, FloatArray]


def first_starts(variant: Variant) -> dict[str, FloatArray]:
    """Where the search begins in every parameter of a variant."""
    return {p.name: np.full(p.size, p.starts[0]) for p in variant.parameters}


class Screen:
    """Score tests from one optimum.

    Parameters
    ----------
    base : FittedHypothesis
        Of the hypothesis that variants are added to.
    """

    def __init__(self, base: FittedHypothesis) -> None:
        self.base = base
        self.hypothesis = base.hypothesis
        self.data = self.hypothesis.data
        v, log_s, jv, js = self.hypothesis.derivatives(base.mode)
        self.v, self.weight, self.log_s = v, np.exp(-log_s), log_s
        self.spread = 1.0 - v * v * self.weight
        self.jv, self.js = jv, js
        self._scans: dict[tuple[str, str], tuple[FloatArray, FloatArray, FloatArray]] = {}
        self._lock = Lock()
        self.table = base.table
        self.value = -0.5 * float(np.sum(v * v * self.weight + log_s))

    def linear(self, variant: Variant) -> ScoreTest:
        """Test of a variant whose parameters start at zero."""
        columns, members, scales = [], [], []
        layout = self.data.layout
        tables = []
        for parameter in variant.parameters:
            values = {p.name: np.zeros((1, len(layout.records))) for p in variant.parameters}
            values[parameter.name] = np.where(parameter.members >= 0, _NUDGE, 0.0)[None]
            tables.append(self._with(variant, values))
        v, s = self._innovations(tables)
        for i, parameter in enumerate(variant.parameters):
            columns.append(((v[i] - self.v) / _NUDGE, (np.log(s[i]) - self.log_s) / _NUDGE))
            members.append(parameter.members)
            scales += [parameter.scale] * parameter.size
        gain = self._gain(columns, members, np.array(scales))
        return ScoreTest(variant, gain, first_starts(variant))

    def _innovations(self, tables: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Innovations and variances of some tables; the base's goes first, so that what they share is not redone."""
        v, s = channel_innovations(self.data.channels, np.concatenate([self.table[None], *tables]))
        return v[1:], s[1:]

    def _with(self, variant: Variant, values: dict[str, FloatArray]) -> FloatArray:
        table: FloatArray = self.table[None].copy()
        variant.apply(table, values, self.data.layout)
        return table

    def _gain(
        self, columns: Sequence[tuple[FloatArray, FloatArray]], members: Sequence[np.ndarray], scales: FloatArray
    ) -> float:
        """Laplace gain of new parameters, those of the base re-optimised to second order."""
        d, k = self.base.mode.size, scales.size
        starts = np.concatenate([[0], np.cumsum([int(m.max()) + 1 for m in members])])[:-1]
        score, own, mixed = np.zeros(k), np.diag(1.0 / scales**2), np.zeros((k, d))
        for r, (cycles, rows, where) in enumerate(self.hypothesis.blocks):
            active = [i for i in range(len(members)) if members[i][r] >= 0]
            if not active:
                continue
            place = np.array([starts[i] + members[i][r] for i in active])
            a = np.stack([columns[i][0][cycles] for i in active])
            b = np.stack([columns[i][1][cycles] for i in active])
            w = self.weight[cycles]
            score[place] -= (a * w) @ self.v[cycles] + 0.5 * b @ self.spread[cycles]
            own[np.ix_(place, place)] += (a * w) @ a.T + 0.5 * b @ b.T
            c, e = self.jv[np.ix_(rows, cycles)], self.js[np.ix_(rows, cycles)]
            mixed[np.ix_(place, where)] += (a * w) @ c.T + 0.5 * b @ e.T
        schur = own - mixed @ self.base.covariance @ mixed.T
        schur = 0.5 * (schur + schur.T)
        _, logdet = np.linalg.slogdet(schur)
        step = np.linalg.solve(schur, score)
        return float(0.5 * score @ step - np.log(scales).sum() - 0.5 * logdet)

    def direct(self, variant: Variant, grid: Sequence[float]) -> ScoreTest:
        """Test of a variant of one positive parameter: the likelihood along a grid, the base held still."""
        (parameter,) = variant.parameters
        tables = []
        for at in grid:
            value = np.where(parameter.members >= 0, np.exp(at), 0.0)[None]
            tables.append(self._with(variant, {parameter.name: value}))
        v, s = self._innovations(tables)
        with np.errstate(all="ignore"):
            value = -0.5 * np.sum(v * v / s + np.log(s), axis=1) - self.value
        value = np.where(np.isfinite(value), value, -np.inf)
        best = int(np.argmax(value))
        return ScoreTest(variant, float(value[best]), {parameter.name: np.full(parameter.size, float(grid[best]))})

    def _scanned(self, variant: Variant) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Grid, gain of every record in wind (G, R), and the best small step there (G, R, probes).

        Variants that differ in their records alone share one scan.
        """
        with self._lock:
            form = variant.effect, variant.form
            if form not in self._scans:
                self._scans[form] = self._scan_records(variant)
            return self._scans[form]

    def _scan_records(self, variant: Variant) -> tuple[FloatArray, FloatArray, FloatArray]:
        layout = self.data.layout
        linear = _probes(variant)
        grid = _MOMENTS if variant.scan == "moment" else _DETUNINGS
        records = len(layout.records)
        zero = np.zeros((1, records))
        gain = np.full((len(grid), records), -np.inf)
        scale = np.array([p.scale for p in linear])
        slopes = np.zeros((len(grid), records, len(linear)))
        cycles_in = layout.duration * layout.omega / (2.0 * np.pi)
        chunk = max(1, 48 // len(linear))
        for begin in range(0, len(grid), chunk):
            part = grid[begin : begin + chunk]
            tables = []
            for at in part:
                for p in linear:
                    values = {q.name: zero for q in variant.parameters}
                    values |= {variant.scan: np.full((1, records), at)} | p.at(layout.wind)
                    tables.append(self._with(variant, values))
            v, s = self._innovations(tables)
            jv, js = (v - self.v) / 1e-3, (np.log(s) - self.log_s) / 1e-3
            for i, at in enumerate(part):
                mine = slice(i * len(linear), (i + 1) * len(linear))
                for r in np.flatnonzero(layout.wind):
                    if variant.scan == "detuning" and abs(at) * cycles_in[r] < FEWEST_BEATS:
                        continue
                    cycles = self.hypothesis.blocks[r][0]
                    a, b, w = jv[mine, cycles], js[mine, cycles], self.weight[cycles]
                    score = -(a * w) @ self.v[cycles] - 0.5 * b @ self.spread[cycles]
                    own = (a * w) @ a.T + 0.5 * b @ b.T + np.diag(1.0 / scale**2)
                    _, logdet = np.linalg.slogdet(own)
                    slopes[begin + i, r] = np.linalg.solve(own, score)
                    gain[begin + i, r] = 0.5 * score @ slopes[begin + i, r] - np.log(scale).sum() - 0.5 * logdet
        return grid, gain, slopes

    def scan(self, variant: Variant) -> ScoreTest:
        """Test of a variant with many optima: the best place on a grid of its scanned parameter, value by value."""
        (scanned,) = (p for p in variant.parameters if p.name == variant.scan)
        grid, gain, slopes = self._scanned(variant)
        gain = np.where(variant.scope.records, gain, -np.inf)
        linear = _probes(variant)
        best, total = np.zeros(scanned.size), 0.0
        for g in range(scanned.size):
            # a record too short for the slowest beats has no say, but forbids nothing to the others
            summed = np.where(np.isfinite(gain), gain, np.minimum(gain.max(axis=0, initial=0.0), 0.0) - 3.0)
            summed = summed[:, scanned.members == g].sum(axis=1)
            best[g] = grid[int(np.argmax(summed))]
            total += float(summed.max()) - np.log(len(grid))
        start = first_starts(variant) | {scanned.name: best}
        place = {float(at): i for i, at in enumerate(grid)}
        chosen = np.array([slopes[place[float(best[m])], r] if m >= 0 else np.zeros(len(linear))
                           for r, m in enumerate(scanned.members)])  # fmt: skip
        start |= _from_probes(variant, chosen)
        return ScoreTest(variant, total, start)


@dataclass(frozen=True, eq=False)
class _Probe:
    """A small step in which the innovations are linear: values by name for the records of a scope."""

    scale: float | FloatArray
    values: Mapping[str, float]

    def at(self, scope: np.ndarray) -> dict[str, FloatArray]:
        return {name: np.where(scope, value, 0.0)[None] for name, value in self.values.items()}


def _probes(variant: Variant) -> list[_Probe]:
    """The linear parameters; for a size and a phase, the two quadratures."""
    names = {p.name: p for p in variant.parameters}
    if "phase" in names:
        scale = names["size"].scale
        return [_Probe(scale, {"size": 1e-3, "phase": angle}) for angle in (0.0, 0.5 * np.pi)]
    return [_Probe(p.scale, {p.name: 1e-3}) for p in variant.parameters if p.name != variant.scan]


def _from_probes(variant: Variant, slopes: FloatArray) -> dict[str, FloatArray]:
    """Starting values from the best linear combination of the probes in every record, (R, probes)."""
    found = {}
    for p in variant.parameters:
        if p.name == "phase":
            per_record = np.arctan2(slopes[:, 1], slopes[:, 0])
        elif p.name == "size" and any(q.name == "phase" for q in variant.parameters):
            per_record = np.hypot(slopes[:, 0], slopes[:, 1])
        else:
            continue
        found[p.name] = np.array([per_record[p.members == g].mean() for g in range(p.size)])
    return found
