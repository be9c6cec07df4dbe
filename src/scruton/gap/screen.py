"""Score tests from one optimum: which variants of an effect are worth a fit, and from where.

A test is a generator that yields the coefficients which it wants to see filtered, and is sent innovations and
variances: those of many variants go through the filter side by side.
"""

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import replace
from math import comb
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from scruton.arrays import FloatArray
from scruton.dynamics.effects import Effect
from scruton.dynamics.effects.effect import SOME, Extent, Parameter, Variant
from scruton.dynamics.extended import channel_innovations
from scruton.gap.hypothesis import FittedHypothesis
from scruton.gap.thresholds import FEWEST_BEATS, MOST_DETUNING, TAKEN_UP

_NUDGE = 1e-4
_PROBE = 1e-3
_MOMENTS = np.arange(0.15, 0.86, 0.05)
_DETUNINGS = np.concatenate([np.arange(-MOST_DETUNING, -0.0045, 0.001), np.arange(0.005, MOST_DETUNING + 1e-4, 0.001)])
_ABOUT = (-2.0, -1.2, -0.5, 0.0, 0.5, 1.2, 2.0, 3.0)  # standard deviations of a prior
_AT_ONCE = 64  # points of tests whose filters run side by side, or those of one test where it has more

# Tables of coefficients (W, R, COLUMNS); innovations and variances, (W, 3 N) each; what is found in the end.
type Asking[Found] = Generator[FloatArray, tuple[FloatArray, FloatArray], Found]


class ScoreTest(NamedTuple):
    """A variant, the gain in log evidence that its score at the optimum lets expect, and where to start its fit."""

    variant: Variant
    gain: float
    start: Mapping[str, FloatArray]


def first_starts(variant: Variant) -> dict[str, FloatArray]:
    """Where the search begins in every parameter of a variant."""
    return {p.name: np.full(p.size, p.starts[0]) for p in variant.parameters}


def side_by_side[Found](askings: Sequence[Asking[Found]]) -> Asking[list[Found]]:
    """What several tests find, in their order; what they ask for is asked together."""
    found: dict[int, Found] = {}
    wanted: dict[int, FloatArray] = {}

    def go_on(k: int, told: tuple[FloatArray, FloatArray] | None) -> None:
        try:
            wanted[k] = next(askings[k]) if told is None else askings[k].send(told)
        except StopIteration as end:
            found[k] = end.value

    for k in range(len(askings)):
        go_on(k, None)
    while wanted:
        turn: dict[int, FloatArray] = {}
        for k in sorted(wanted):
            if turn and sum(map(len, turn.values())) + len(wanted[k]) > _AT_ONCE:
                break
            turn[k] = wanted.pop(k)
        v, s = yield np.concatenate(list(turn.values()))
        first = 0
        for k, tables in turn.items():
            own = slice(first, first + len(tables))
            go_on(k, (v[own], s[own]))
            first += len(tables)
    return [found[k] for k in range(len(askings))]


class Screen:
    """Score tests from one optimum, that of the hypothesis that variants are added to."""

    def __init__(self, base: FittedHypothesis) -> None:
        self.base, self.hypothesis, self.data = base, base.hypothesis, base.hypothesis.data
        # What each record tells of the base's parameters: derivatives of innovations and log variances.
        self.v, s, self.told = self.hypothesis.derivatives(base.mode)
        self.log_s, self.weight = np.log(s), 1.0 / s
        self.spread = 1.0 - self.v * self.v * self.weight
        self.table = base.table
        self._scans: dict[tuple[str, str], tuple[FloatArray, FloatArray, FloatArray, np.ndarray]] = {}

    def tests(self, effect: Effect) -> list[ScoreTest]:
        """Screen every variant of an effect."""
        return self.run(side_by_side([self._test(variant) for variant in effect.variants(self.data.layout)]))

    def run[Found](self, asking: Asking[Found]) -> Found:
        """Filter what is asked for until something is found."""
        try:
            tables = next(asking)
            while True:
                tables = asking.send(self._filtered(tables))
        except StopIteration as end:
            found: Found = end.value
            return found

    def _filtered(self, tables: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Innovations and variances of tables; the base goes first, so that what they share is not redone."""
        v, s = channel_innovations(self.data.channels, np.concatenate([self.table[None], tables]))
        return v[1:], s[1:]

    def _test(self, variant: Variant) -> Asking[ScoreTest]:
        alone = len(variant.parameters) == 1 and variant.parameters[0].log
        if variant.scan in ("moment", "detuning"):
            test = self.scan(variant)
        elif variant.scan:
            test = yield from self.along(variant)
        else:
            test = yield from (self.direct(variant, variant.parameters[0]) if alone else self.linear(variant))
        return test._replace(gain=test.gain + variant.seen)

    def _tables(self, variant: Variant, points: Sequence[Mapping[str, FloatArray]]) -> FloatArray:
        """The base with a variant at some values."""
        tables = np.repeat(self.table[None], len(points), axis=0)
        for i, values in enumerate(points):
            variant.apply(tables[i : i + 1], values, self.data.layout)
        return tables

    def linear(self, variant: Variant) -> Asking[ScoreTest]:
        """Laplace gain of a variant, the parameters of the base re-optimised to second order.

        Where further parameters shape the first one, they are held where their search begins; what they do by
        themselves (a lag moves the law's own terms) is gained or lost there.
        """
        shaped = any(p.log or p.starts[0] for p in variant.parameters)
        tested = variant.parameters[:1] if shaped else variant.parameters
        held = {p.name: _in_records(p, np.exp(p.starts[0]) if p.log else p.starts[0]) for p in variant.parameters}
        still = [held | {p.name: _in_records(p, 0.0) for p in tested}] if shaped else []
        points = [*still, *(held | {p.name: _in_records(p, _NUDGE)} for p in tested)]
        v, s = yield self._tables(variant, points)
        v0, log_s0, weight, spread, alone = self.v, self.log_s, self.weight, self.spread, 0.0
        if shaped:
            with np.errstate(all="ignore"):
                v0, log_s0, v, s = v[0], np.log(s[0]), v[1:], s[1:]
                weight = np.exp(-log_s0)
                spread = 1.0 - v0 * v0 * weight
                alone = 0.5 * float(np.sum(self.log_s - self.spread - log_s0 + spread))
        dv, ds = _slopes(v, s, v0, log_s0, _NUDGE)
        if not np.isfinite(alone) or not np.isfinite(np.stack([dv, ds])).all():  # the filter loses its way there
            return ScoreTest(variant, -np.inf, first_starts(variant))
        scales = np.concatenate([np.broadcast_to(p.scale, p.size) for p in tested])
        first = np.cumsum([0, *(p.size for p in tested)])
        score, curvature = np.zeros(scales.size), np.diag(1.0 / scales**2)
        mixed = np.zeros((scales.size, self.base.mode.size))
        for r, (block, (c, e)) in enumerate(zip(self.hypothesis.blocks, self.told, strict=True)):
            active = [i for i, p in enumerate(tested) if p.members[r] >= 0]
            if not active:
                continue
            place = np.array([first[i] + tested[i].members[r] for i in active])
            a, b = block.of(dv)[active], block.of(ds)[active]
            aw = a * block.of(weight)
            score[place] -= aw @ block.of(v0) + 0.5 * b @ block.of(spread)
            curvature[np.ix_(place, place)] += aw @ a.T + 0.5 * b @ b.T
            mixed[np.ix_(place, block.where)] += aw @ c.T + 0.5 * b @ e.T
        schur = curvature - mixed @ self.base.covariance @ mixed.T
        schur = 0.5 * (schur + schur.T)

        def gain(where: np.ndarray) -> float:
            return float(_gained(score[where], schur[np.ix_(where, where)], scales[where])[0])

        if variant.scope.extent is Extent.SOME_RECORDS:
            places = np.add.outer(np.arange(tested[0].size), first[:-1])
            order = np.argsort([-gain(place) for place in places])
            variant, found = _in_some(variant, variant.scope.members, order, lambda some: gain(places[some].ravel()))
        else:
            found = gain(np.arange(scales.size))
        return ScoreTest(variant, alone + found, first_starts(variant))

    def along(self, variant: Variant) -> Asking[ScoreTest]:
        """Test of a variant with many optima in a parameter that records share: the best of its starts."""
        starts = next(p.starts for p in variant.parameters if p.name == variant.scan)
        held = [
            [replace(p, starts=(start,)) if p.name == variant.scan else p for p in variant.parameters]
            for start in starts
        ]
        tests = yield from side_by_side([self.linear(replace(variant, parameters=tuple(one))) for one in held])
        best = max(tests, key=lambda test: test.gain)
        return ScoreTest(variant, best.gain - float(np.log(len(starts))), best.start)

    def direct(self, variant: Variant, parameter: Parameter) -> Asking[ScoreTest]:
        """Test of a variant of one positive parameter: the likelihood along a grid, and where the base then follows.

        Records tell of their own value alone, so that each is sought by itself: what acts in some is found in those.
        With a base that stays where it was a lag would promise a third of what it gains with another (Y1, epsilon).
        """
        about = (float(parameter.location + parameter.scale * x) for x in _ABOUT)
        grid = np.array(sorted({*parameter.starts, *about}))
        v, s = yield self._tables(variant, [{parameter.name: _in_records(parameter, np.exp(at))} for at in grid])
        with np.errstate(all="ignore"):
            ratio = -0.5 * (v * v / s + np.log(s) - self.v * self.v * self.weight - self.log_s)
        of_cycle = np.tile(parameter.members[self.data.channels.record], 3)
        value = np.stack([ratio[:, of_cycle == g].sum(axis=1) for g in range(parameter.size)])
        value = np.where(np.isfinite(value), value, -np.inf)
        best = value.argmax(axis=1)
        gain = float(value.max(axis=1).sum())
        found = {parameter.name: grid[best]}
        if np.isfinite(gain):
            followed = yield from self._followed(variant, parameter, grid[best])
            gain = max(gain, followed)
        return ScoreTest(variant, gain, found)

    def _followed(self, variant: Variant, parameter: Parameter, at: FloatArray) -> Asking[float]:
        """Gain in log posterior of a variant where the base has made one step of scoring with it."""
        values = {parameter.name: np.where(parameter.members >= 0, np.exp(at)[parameter.members], 0.0)[None]}
        v, s = yield self._tables(variant, [values])
        v, s = v[0], s[0]
        first, second = v / s - self.v * self.weight, 0.5 * (1.0 - v * v / s - self.spread)
        pull = np.zeros(self.base.mode.size)
        for block, (c, e) in zip(self.hypothesis.blocks, self.told, strict=True):
            pull[block.where] -= c @ block.of(first) + e @ block.of(second)
        moved = (self.base.mode + self.base.covariance @ pull)[None]
        table = self.hypothesis.table(moved)
        variant.apply(table, values, self.data.layout)
        v, s = yield table
        with np.errstate(all="ignore"):
            like = -0.5 * float(np.sum(v * v / s + np.log(s) - self.v * self.v * self.weight - self.log_s))
        gain = like + float(self.hypothesis.log_prior(moved)[0]) - self.base.log_prior
        return gain if np.isfinite(gain) else -np.inf

    def scan(self, variant: Variant) -> ScoreTest:
        """Test of a variant with many optima: the best place on a grid of its scanned parameter, value by value."""
        named = {p.name: p for p in variant.parameters}
        scanned = named[variant.scan]
        form = variant.effect, variant.form
        if form not in self._scans:  # variants that differ in their records alone share one
            self._scans[form] = self._scan_records(variant)
        grid, scores, curvatures, seen = self._scans[form]
        prior = np.array([p for p, _ in _probes(variant)])
        held = np.diag(1.0 / prior**2)
        best, gains = np.zeros(scanned.size, dtype=int), np.zeros(scanned.size)
        chosen = np.zeros((len(variant.scope.members), prior.size))
        alike = variant.scope.extent is Extent.SOME_RECORDS and scanned.size == 1
        if alike:
            variant = _in_some_alike(variant, scores, curvatures, prior)
            named = {p.name: p for p in variant.parameters}
            scanned = named[variant.scan]
        for g in range(scanned.size):
            inside = np.flatnonzero(scanned.members == g)
            if "phase" in named:  # of every record its own: what records find is their own, too
                gain, step = _gained(scores[:, inside], curvatures[:, inside] + held, prior)
                gain = np.where(seen[:, inside], gain, -np.inf)
                # a record too short for the slowest beats has no say, but forbids nothing to the others
                gain = np.where(np.isfinite(gain), gain, np.minimum(gain.max(axis=0, initial=0.0), 0.0) - 3.0)
                summed = gain.sum(axis=1)
            else:
                summed, step = _gained(scores[:, inside].sum(axis=1), curvatures[:, inside].sum(axis=1) + held, prior)
            best[g] = int(np.argmax(summed))
            gains[g] = float(logsumexp(summed)) - np.log(len(grid))
            chosen[inside] = step[best[g]]
        total = float(gains.sum())
        if variant.scope.extent in SOME and not alike:
            order, of_each = np.argsort(-gains), variant.scope.members
            variant, total = _in_some(variant, of_each, order, lambda some: float(gains[some].sum()))
            best = best[np.unique(scanned.members[variant.scope.records])]
            named = {p.name: p for p in variant.parameters}
        start = first_starts(variant) | {scanned.name: grid[best]}
        begin = {"size": chosen[:, 0]}  # where it is nothing, nothing holds the place that was found
        if "phase" in named:
            begin = {"size": np.hypot(*chosen.T), "phase": np.arctan2(chosen[:, 1], chosen[:, 0])}
        for name, each in begin.items():
            start[name] = np.array([each[named[name].members == g].mean() for g in range(named[name].size)])
        return ScoreTest(variant, total, start)

    def _scan_records(self, variant: Variant) -> tuple[FloatArray, FloatArray, FloatArray, np.ndarray]:
        """Grid; score and curvature of every record in wind, (G, R, probes) and so on; which have a say, (G, R)."""
        layout, records = self.data.layout, len(self.data.layout.records)
        probes = _probes(variant)
        grid = _MOMENTS if variant.scan == "moment" else _DETUNINGS
        nothing = {p.name: np.zeros((1, records)) for p in variant.parameters}
        seen = np.zeros((len(grid), records), dtype=bool)
        scores = np.zeros((len(grid), records, len(probes)))
        curvatures = np.zeros((*scores.shape, len(probes)))
        beats = layout.duration * layout.omega / (2.0 * np.pi)  # at a detuning of 1
        whole = self._of_the_whole(variant)
        chunk = max(1, 48 // len(probes))
        for begin in range(0, len(grid), chunk):
            part = grid[begin : begin + chunk]
            points = [
                nothing
                | {variant.scan: np.full((1, records), at)}
                | {name: np.where(layout.wind, value, 0.0)[None] for name, value in values.items()}
                for at in part
                for _, values in probes
            ]
            v, s = self._filtered(self._tables(variant, points))
            jv, js = _slopes(v, s, self.v, self.log_s, _PROBE)
            for r in np.flatnonzero(layout.wind):
                block = self.hypothesis.blocks[r]
                a, b = (block.of(slopes).reshape(len(part), len(probes), -1) for slopes in (jv, js))
                told = np.isfinite(a).all(axis=(1, 2)) & np.isfinite(b).all(axis=(1, 2))  # lost filters tell nothing
                if variant.scan == "detuning":
                    told &= np.abs(part) * beats[r] >= FEWEST_BEATS
                a, b = a[told], b[told]
                if whole is not None:
                    rest = (np.broadcast_to(block.of(slopes), (len(a), 1, a.shape[-1])) for slopes in whole)
                    a, b = (np.concatenate(both, axis=1) for both in zip((a, b), rest, strict=True))
                aw = a * block.of(self.weight)
                score = -aw @ block.of(self.v) - 0.5 * b @ block.of(self.spread)
                curvature = aw @ a.swapaxes(1, 2) + 0.5 * b @ b.swapaxes(1, 2)
                if whole is not None:  # which is given up
                    score, curvature = _given_up(score, curvature)
                at = begin + np.flatnonzero(told)
                scores[at, r], curvatures[at, r], seen[at, r] = score, curvature, True
        return grid, scores, curvatures, seen

    def _of_the_whole(self, variant: Variant) -> tuple[FloatArray, FloatArray] | None:
        """Slopes by what begins before a record does, (1, 3 N) each: the base takes up so much of what begins within.

        None of what is scanned by no moment.
        """
        if variant.scan != "moment":
            return None
        records = self.data.layout.wind
        point = {p.name: np.where(records, _PROBE if p.name == "size" else 0.0, 0.0)[None] for p in variant.parameters}
        v, s = self._filtered(self._tables(variant, [point]))
        jv, js = _slopes(v, s, self.v, self.log_s, _PROBE)
        return (jv, js) if np.isfinite(np.stack([jv, js])).all() else None


def _given_up(score: FloatArray, curvature: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Scores (G, d + 1) and curvatures (G, d + 1, d + 1) without their last, which is small and as it has to be."""
    share = curvature[:, :-1, -1] / (curvature[:, -1:, -1] + TAKEN_UP**-2.0)
    taken = share[:, :, None] * curvature[:, -1:, :-1]
    return score[:, :-1] - share * score[:, -1:], curvature[:, :-1, :-1] - taken


def _slopes(
    v: FloatArray, s: FloatArray, v0: FloatArray, log_s0: FloatArray, by: float
) -> tuple[FloatArray, FloatArray]:
    """Slopes of innovations and log variances that a step `by` moves from v0, log_s0; not finite where one is lost."""
    with np.errstate(all="ignore"):
        return (v - v0) / by, (np.log(s) - log_s0) / by


def _gained(score: FloatArray, curvature: FloatArray, prior: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Gain in log evidence and best small step, of scores (..., d) and curvatures, the prior's with them."""
    step = np.linalg.solve(curvature, score[..., None])[..., 0]
    gain = 0.5 * np.sum(score * step, axis=-1) - np.log(prior).sum() - 0.5 * np.linalg.slogdet(curvature)[1]
    return gain, step


def _in_some(
    variant: Variant, members: np.ndarray, order: np.ndarray, gain: Callable[[np.ndarray], float]
) -> tuple[Variant, float]:
    """A variant in the best of its records, the first of an order of its members, and what it gains in them.

    Any number of records (or tests) from two to all but one is as probable, and of as many any set.
    """
    count = order.size
    sets = [(order[:k], 1.0 / ((count - 2) * comb(count, k))) for k in range(2, count)]
    gains = [gain(some) for some, _ in sets]
    best = int(np.argmax([one + np.log(share) for one, (_, share) in zip(gains, sets, strict=True)]))
    some, share = sets[best]
    return variant.within(np.isin(members, some), share), gains[best]


def _in_some_alike(variant: Variant, scores: FloatArray, curvatures: FloatArray, prior: FloatArray) -> Variant:
    """A variant of one size and one place in the best of its records, by scores and curvatures (G, R, probes).

    Those come first that gain most by themselves at the place, and with the sign, that gain most together.
    """
    inside, many = np.flatnonzero(variant.scope.records), len(variant.scope.members)
    held = np.diag(1.0 / prior**2)
    alone, step = _gained(scores, curvatures + held, prior)
    mine = np.where(np.stack([step[..., 0] > 0.0, step[..., 0] <= 0.0]), alone, -np.inf)[:, :, inside]
    side, place = np.unravel_index(np.argmax(np.maximum(mine, 0.0).sum(axis=2)), mine.shape[:2])
    order = inside[np.argsort(-mine[side, place])]

    def together(some: np.ndarray) -> float:
        gains, _ = _gained(scores[:, some].sum(axis=1), curvatures[:, some].sum(axis=1) + held, prior)
        return float(logsumexp(gains)) - float(np.log(len(scores)))

    return _in_some(variant, np.arange(many), order, together)[0]


def _in_records(parameter: Parameter, value: float) -> FloatArray:
    """A value in the records that take the parameter, zero in others, (1, R)."""
    return np.where(parameter.members >= 0, value, 0.0)[None]


def _probes(variant: Variant) -> list[tuple[float | FloatArray, dict[str, float]]]:
    """Small steps in which the innovations are linear, with the scale of each: of a size and a phase, quadratures."""
    names = {p.name: p for p in variant.parameters}
    if "phase" in names:
        return [(names["size"].scale, {"size": _PROBE, "phase": angle}) for angle in (0.0, 0.5 * np.pi)]
    return [(p.scale, {p.name: _PROBE}) for p in variant.parameters if p.name != variant.scan]
