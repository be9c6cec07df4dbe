"""Excess damping and excess frequency against amplitude, by rig, test and direction, inside the likelihood.

The excess of a group of records is the damping that the null model needs there, with a smooth curve in ln(amplitude)
of its own added in every group, minus the damping of the null model alone at its optimum.  That difference is what
the data tell: how it splits into the curve and the shared parameters is not.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.special import ndtri

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import Extent, Parameter, Scope, Values, Variant, add, bend_at
from scruton.dynamics.effects.terms import HATS, Layout, Term, compact
from scruton.dynamics.limit_cycle import amplitude_rates
from scruton.gap.data import GapData
from scruton.gap.finding import Finding, amplitudes_of, place, time_of
from scruton.gap.hypothesis import FittedHypothesis
from scruton.gap.thresholds import CURVE_FALSE, FAST_GROWTH, FEWEST_CYCLES_OF_A_KNOT, SHORTEST_PLACE, STIFFNESS_IN_WIND

GROWTH, DECAY, STEADY, STILL = "growth", "decay", "steady", "still air"
_DIRECTION = {1: GROWTH, -1: DECAY, 0: STEADY}
_SCALE = 0.5  # prior sd of the excess damping over the reference relaxation rate
_LENGTH = 1.0  # over which it varies, in ln(amplitude)
_BEND = 0.05  # prior sd of the relative change of frequency up to the largest amplitude
_GRID = 41
_BRIDGE = 3  # points of the grid: places that close are one
_STEP = 1e-3  # of a standard deviation, of the slopes in the coordinates


@dataclass(frozen=True, eq=False)
class Curve:
    """Excess against amplitude of a group of records."""

    quantity: str  # damping, frequency or branch
    direction: str  # growth, decay, steady or still air; for a branch, growth minus decay
    record: int  # the first of the group
    records: np.ndarray  # (R,) of bool
    amplitude: FloatArray  # (G,)
    excess: FloatArray  # (G,): damping ratio, or relative frequency from that at the smallest amplitude
    covariance: FloatArray  # (G, G)
    critical: float  # standard errors that no point of any curve exceeds by chance, in 90 of 100 campaigns

    @property
    def sd(self) -> FloatArray:
        """Standard error, (G,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 1e-300))

    def places(self) -> list[slice]:
        """Stretches of the grid where the 90 % band excludes zero and a point is beyond chance."""
        z = self.excess / self.sd
        sign = np.where(np.abs(z) > -ndtri(0.05), np.sign(z), 0.0)
        for i in range(1, z.size):  # small holes between places of one sign belong to them
            back = max(0, i - _BRIDGE)
            same = np.flatnonzero(sign[back:i] == sign[i]) + back
            if sign[i] != 0.0 and same.size and not np.any(sign[same[-1] + 1 : i] == -sign[i]):
                sign[same[-1] : i] = sign[i]
        edges = [0, *(np.flatnonzero(np.diff(sign)) + 1), z.size]
        log_a = np.log(self.amplitude)
        return [
            slice(i, j)
            for i, j in pairwise(edges)
            if sign[i] != 0.0 and np.abs(z[i:j]).max() > self.critical and log_a[j - 1] - log_a[i] > SHORTEST_PLACE
        ]


@dataclass(frozen=True, eq=False)
class Curves:
    """All curves of a campaign and the fit that they come from."""

    fit: FittedHypothesis  # of the null model with a curve of damping and one of frequency in every group
    damping: tuple[Curve, ...]
    frequency: tuple[Curve, ...]
    branch: tuple[Curve, ...]


def excess_curves(null: FittedHypothesis) -> Curves:
    """Fit the discrepancy of damping and frequency, from the optimum of the null model."""
    data, layout = null.hypothesis.data, null.hypothesis.data.layout
    wind = 3 * (layout.test + 1) + layout.direction
    # of a rig in still air, or of a test in one direction; of a rig or a test
    group = compact(np.where(layout.wind, wind, 10_000 + layout.rig))
    setting = compact(np.where(layout.wind, layout.test, 10_000 + layout.rig))
    fit = null.with_variants(_smooth(layout, group), _bends(layout, setting))
    groups = [group == g for g in range(group.max() + 1)]
    settings = [setting == g for g in range(setting.max() + 1)]
    # looks: the knots of every group with enough cycles about them
    knots, record = np.log(layout.knots), data.channels.record
    near = np.abs(np.log(np.maximum(data.channels.amplitude, 1e-300))[:, None] - knots) < knots[1] - knots[0]
    looks = sum(np.count_nonzero(near[members[record]].sum(axis=0) >= FEWEST_CYCLES_OF_A_KNOT) for members in groups)
    critical = float(-ndtri(0.5 * CURVE_FALSE / max(looks, 1)))
    damping = []
    for members in groups:
        r = int(np.flatnonzero(members)[0])
        grid = _grid(data, members)
        excess, covariance = _excess(null, fit, {r: 1.0}, grid)
        direction = _DIRECTION[int(layout.direction[r])] if layout.wind[r] else STILL
        damping.append(Curve("damping", direction, r, members, grid, excess, covariance, critical))
    bends = float(-ndtri(0.5 * CURVE_FALSE / (2.0 * len(settings))))
    phased = [members for members in settings if data.channels.has_phase[members[record]].any()]
    frequency = [_frequency_curve(null, fit, members, bends) for members in phased]
    branch = [curve for test in data.first_in_wind if (curve := _branch(null, fit, damping, test))]
    return Curves(fit, tuple(damping), tuple(frequency), tuple(branch))


def _excess(
    null: FittedHypothesis, fit: FittedHypothesis, weights: dict[int, float], grid: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Excess damping ratio, (G,), of a weighted sum of records, and its covariance."""
    data = fit.hypothesis.data

    def ratio(table: FloatArray) -> FloatArray:
        total = np.zeros((len(table), grid.size))
        for r, weight in weights.items():
            rates = amplitude_rates(np.ascontiguousarray(table[:, r]), grid, data.channels.knots)
            total += -weight * rates / grid / data.layout.omega[r]
        return total

    value, slopes = fit.slopes(ratio, _STEP)
    return value - ratio(null.table[None])[0], slopes.T @ fit.covariance @ slopes


def _frequency_curve(null: FittedHypothesis, fit: FittedHypothesis, members: np.ndarray, critical: float) -> Curve:
    """Relative frequency over that at the smallest amplitude at which the motion grows slowly, of a rig or a test."""
    data = fit.hypothesis.data
    r = int(np.flatnonzero(members)[0])
    omega, wind, row = data.layout.omega[r], bool(data.layout.wind[r]), null.table[r]
    slow = float(row[Term.DRIVE] / (row[Term.AERO] + row[Term.STRUCTURAL] + FAST_GROWTH * omega))
    grid = _grid(data, members, slow)

    def bend(table: FloatArray) -> FloatArray:
        change = bend_at(table[:, r, None], grid)
        return change - change[:, :1]

    value, slopes = fit.slopes(bend, _STEP)
    # What is too small to count: a tolerated stiffness, and half the square of the growth ratio.
    growth = amplitude_rates(row[None], grid[:1], data.channels.knots)[0, 0] / grid[0]
    share = (grid - grid[0]) / (grid[-1] - grid[0])
    stiffness = data.priors["stiffness"].scale * (STIFFNESS_IN_WIND if wind else 1.0)
    allowed = stiffness * share + 0.5 * (growth / omega) ** 2 * (share > 0.0)
    covariance = slopes.T @ fit.covariance @ slopes + np.outer(allowed, allowed)
    return Curve("frequency", "in wind" if wind else STILL, r, members, grid, value, covariance, critical)


def _branch(null: FittedHypothesis, fit: FittedHypothesis, damping: list[Curve], test: int) -> Curve | None:
    """Growth minus decay at the amplitudes that both of a test pass."""
    curves = {c.direction: c for c in damping if fit.hypothesis.data.layout.test[c.record] == test}
    if GROWTH not in curves or DECAY not in curves:
        return None
    up, down = curves[GROWTH], curves[DECAY]
    low, high = max(up.amplitude[0], down.amplitude[0]), min(up.amplitude[-1], down.amplitude[-1])
    if not high > low * np.exp(SHORTEST_PLACE):
        return None
    grid = np.geomspace(low, high, _GRID)
    excess, covariance = _excess(null, fit, {up.record: 1.0, down.record: -1.0}, grid)
    return Curve(
        "branch", "growth - decay", up.record, up.records | down.records, grid, excess, covariance, up.critical
    )


def curve_findings(curves: Curves, data: GapData) -> list[Finding]:
    """Places where curves leave zero."""
    every = (*curves.damping, *curves.frequency, *curves.branch)
    return [_finding(curve, stretch, data) for curve in every for stretch in curve.places()]


def _finding(curve: Curve, stretch: slice, data: GapData) -> Finding:
    a, excess, sds = data.channels.amplitude, curve.excess[stretch], curve.sd[stretch]
    span = (float(curve.amplitude[stretch][0]), float(curve.amplitude[stretch][-1]))
    cycles = np.bincount(data.channels.record[(a >= span[0]) & (a <= span[1])], minlength=curve.records.size)
    inside = np.where(curve.records, cycles, -1)
    record, others = int(np.argmax(inside)), int(np.count_nonzero(inside > 0)) - 1
    beside = f", and {others} more record{'s' if others > 1 else ''}" if others > 0 else ""
    if curve.quantity == "frequency":
        value, sd = float(excess[-1]), float(sds[-1])
        detail = f"frequency against amplitude, {curve.direction}: up to the largest amplitude{beside}"
    else:
        # the mean over the stretch, even in ln(amplitude)
        value, sd = float(excess.mean()), float(np.sqrt(curve.covariance[stretch, stretch].mean()))
        what = "growth minus decay" if curve.quantity == "branch" else curve.direction
        detail = f"damping ratio, {what}{beside}"
    time, peak = time_of(data, record, span), float(np.abs(excess / sds).max())
    return place(data, record, curve.quantity, value, sd, detail, amplitude=span, time=time, significance=peak)


def _smooth(layout: Layout, members: np.ndarray) -> Variant:
    """Excess damping as a Gaussian process in ln(amplitude), through its independent coordinates."""
    distance = np.subtract.outer(np.log(layout.knots), np.log(layout.knots))
    kernel = np.exp(-0.5 * (distance / _LENGTH) ** 2) + 1e-6 * np.eye(HATS)
    root = _SCALE * np.linalg.cholesky(kernel)

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        normal = np.stack([values[f"shape{k}"] for k in range(HATS)], axis=-1)
        table[:, :, int(Term.HAT) : int(Term.HAT) + HATS] += normal @ root.T * layout.rate[:, None]

    parameters = tuple(Parameter(f"shape{k}", 0.0, 1.0, members) for k in range(HATS))
    return Variant("damping against amplitude", parameters, apply, Scope(Extent.GROUPS, members))


def _bends(layout: Layout, members: np.ndarray) -> Variant:
    largest = np.array([layout.largest[members == g].max() for g in members])

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        del layout
        add(table, Term.STIFFNESS_LINEAR, values["linear"] / largest)
        add(table, Term.STIFFNESS, values["square"] / largest**2)

    parameters = tuple(Parameter(name, 0.0, _BEND, members) for name in ("linear", "square"))
    return Variant("frequency against amplitude", parameters, apply, Scope(Extent.GROUPS, members))


def _grid(data: GapData, records: np.ndarray, least: float = 0.0) -> FloatArray:
    low, high = amplitudes_of(data, records)
    low = min(max(low, least), 0.5 * high)
    return np.geomspace(low, max(high, 1.0001 * low), _GRID)
