"""Excess damping and excess frequency against amplitude, by rig, test and direction, inside the likelihood.

The excess of a group of records is the damping that the bare model needs there, with a smooth curve in ln(amplitude)
of its own added in every group, minus the damping of the bare model alone at its optimum.  That difference is what
the data tell: how it splits into the curve and the shared parameters is not.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.stats import norm

from scruton.arrays import FloatArray
from scruton.dynamics.effects.terms import HATS, Layout, Parameter, Term, Values, Variant, add, compact
from scruton.dynamics.limit_cycle import amplitude_rates
from scruton.gap.bare import TOLERANCES
from scruton.gap.data import GapData
from scruton.gap.finding import Finding, Range, amplitudes_of, interval, names_of, time_of
from scruton.gap.hypothesis import Weighed

GROWTH, DECAY, STEADY, STILL = "growth", "decay", "steady", "still air"
_DIRECTION = {1: GROWTH, -1: DECAY, 0: STEADY}
_SCALE = 0.5  # prior sd of the excess damping over the reference relaxation rate
_LENGTH = 1.0  # over which it varies, in ln(amplitude)
_BEND = 0.05  # prior sd of the relative change of frequency up to the largest amplitude
_IN_WIND = 2.0  # times what is tolerated in still air: gusts move phase and amplitude together
_FAST = 0.03  # growth ratio beyond which the frequency falls by half its square
_GRID = 41
_FALSE = 0.1  # probability that any curve of a campaign leaves zero by chance
_SHORT = 0.1  # ln(amplitude) that a place covers at least
_BRIDGE = 3  # points of the grid: places that close are one
_FEWEST = 4  # cycles


@dataclass(frozen=True, eq=False)
class Curve:
    """Excess against amplitude of a group of records.

    Attributes
    ----------
    quantity : {"damping", "frequency", "branch"}
    direction : {"growth", "decay", "steady", "still air"}
        "growth" minus "decay" for a branch.
    record : int
        The first of the group.
    records : (R,) array of bool
    amplitude, excess : (G,) arrays
        Damping ratio, or relative frequency from that at the smallest amplitude.
    covariance : (G, G) array
    critical : float
        Standard errors that no point of any curve of the campaign exceeds by chance, in 90 of 100 campaigns.
    """

    quantity: str
    direction: str
    record: int
    records: np.ndarray
    amplitude: FloatArray
    excess: FloatArray
    covariance: FloatArray
    critical: float

    @property
    def sd(self) -> FloatArray:
        """Standard error, (G,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 1e-300))

    def places(self) -> list[slice]:
        """Stretches of the grid where the 90 % band excludes zero and a point is beyond chance."""
        z = self.excess / self.sd
        sign = np.where(np.abs(z) > norm.isf(0.05), np.sign(z), 0.0)
        for i in range(1, z.size):  # small holes between places of one sign belong to them
            back = max(0, i - _BRIDGE)
            same = np.flatnonzero(sign[back:i] == sign[i]) + back
            if sign[i] != 0.0 and same.size and not np.any(sign[same[-1] + 1 : i] == -sign[i]):
                sign[same[-1] : i] = sign[i]
        edges = [0, *(np.flatnonzero(np.diff(sign)) + 1), z.size]
        found = [slice(a, b) for a, b in pairwise(edges) if sign[a] != 0.0]
        log_a = np.log(self.amplitude)
        return [
            one
            for one in found
            if np.abs(z[one]).max() > self.critical and log_a[one.stop - 1] - log_a[one.start] > _SHORT
        ]

    def mean(self, place: slice) -> tuple[float, float]:
        """Mean over a stretch, even in ln(amplitude), and its standard error."""
        return float(self.excess[place].mean()), float(np.sqrt(self.covariance[place, place].mean()))


@dataclass(frozen=True, eq=False)
class Curves:
    """All curves of a campaign and the fit that they come from.

    Attributes
    ----------
    fit : Weighed
        Of the bare model with a curve of damping and one of frequency in every group.
    damping, frequency, branch : tuple of Curve
    """

    fit: Weighed
    damping: tuple[Curve, ...]
    frequency: tuple[Curve, ...]
    branch: tuple[Curve, ...]


def excess_curves(bare: Weighed) -> Curves:
    """Fit the discrepancy of damping and frequency, from the optimum of the bare model.

    Parameters
    ----------
    bare : Weighed
        Of the bare model.
    """
    data = bare.hypothesis.bare.data
    layout = data.layout
    group, place = _groups(layout), _places(layout)
    hypothesis = bare.hypothesis.extended(_smooth(layout, group), _bends(layout, place))
    fit = hypothesis.fit(hypothesis.start_from(bare.mode, {}))
    grids = {g: _grid(data, group == g) for g in range(group.max() + 1)}
    shapes = sum(_knots_told(data, group == g) for g in grids)
    critical = float(norm.isf(0.5 * _FALSE / max(shapes, 1)))
    slopes = _Slopes(bare, fit)
    first = {g: int(np.flatnonzero(group == g)[0]) for g in grids}
    damping = []
    for g, grid in grids.items():
        value, rows = slopes.damping(first[g], grid)
        direction = _DIRECTION[int(layout.direction[first[g]])] if layout.wind[first[g]] else STILL
        damping.append(
            Curve("damping", direction, first[g], group == g, grid, value, slopes.covariance(rows), critical)
        )
    frequency = []
    bends = float(norm.isf(0.5 * _FALSE / (2.0 * (place.max() + 1))))
    for g in range(place.max() + 1):
        mine = place == g
        if not data.channels.has_phase[mine[data.channels.record]].any():
            continue
        record = int(np.flatnonzero(mine)[0])
        grid = _grid(data, mine, slopes.slow(record))
        value, rows = slopes.frequency(record, grid)
        allowed = slopes.tolerated(record, grid)
        covariance = slopes.covariance(rows) + np.outer(allowed, allowed)
        direction = "in wind" if layout.wind[record] else STILL
        frequency.append(Curve("frequency", direction, record, mine, grid, value, covariance, bends))
    branch = [c for t in np.unique(layout.test[layout.wind]) if (c := _branch(slopes, damping, data, int(t)))]
    return Curves(fit, tuple(damping), tuple(frequency), tuple(branch))


def curve_findings(curves: Curves, data: GapData) -> list[Finding]:
    """Places where curves leave zero."""
    return [
        _finding(curve, place, data)
        for curve in (*curves.damping, *curves.frequency, *curves.branch)
        for place in curve.places()
    ]


def _finding(curve: Curve, place: slice, data: GapData) -> Finding:
    rig, test, _ = names_of(data, curve.record)
    span = (float(curve.amplitude[place][0]), float(curve.amplitude[place][-1]))
    numbers = np.flatnonzero(curve.records)
    inside = [_cycles_within(data, int(r), span) for r in numbers]
    record = int(numbers[int(np.argmax(inside))])
    others = sum(count > 0 for count in inside) - 1
    beside = f", and {others} more record{'s' if others > 1 else ''}" if others > 0 else ""
    if curve.quantity == "frequency":
        step = curve.excess[place][-1]
        sd = float(curve.sd[place][-1])
        detail = f"frequency against amplitude, {curve.direction}: up to the largest amplitude{beside}"
        value = float(step)
    else:
        value, sd = curve.mean(place)
        what = "growth minus decay" if curve.quantity == "branch" else curve.direction
        detail = f"damping ratio, {what}{beside}"
    peak = float(np.abs(curve.excess[place] / curve.sd[place]).max())
    return Finding(
        curve.quantity, rig, test, data.layout.records[record], span, time_of(data, record, span), value,
        interval(value, sd), peak, detail,
    )  # fmt: skip


def _cycles_within(data: GapData, record: int, span: Range) -> int:
    a = data.channels.amplitude[data.channels.record == record]
    return int(np.count_nonzero((a >= span[0]) & (a <= span[1])))


def _groups(layout: Layout) -> np.ndarray:
    """Number of the group of every record: of a rig in still air, or of a test in one direction."""
    wind = 3 * (layout.test + 1) + layout.direction
    return compact(np.where(layout.wind, wind, 10_000 + layout.rig))


def _places(layout: Layout) -> np.ndarray:
    return compact(np.where(layout.wind, layout.test, 10_000 + layout.rig))


def _smooth(layout: Layout, members: np.ndarray) -> Variant:
    """Excess damping as a Gaussian process in ln(amplitude), through its independent coordinates."""
    distance = np.subtract.outer(np.log(layout.knots), np.log(layout.knots))
    kernel = np.exp(-0.5 * (distance / _LENGTH) ** 2) + 1e-6 * np.eye(HATS)
    root = _SCALE * np.linalg.cholesky(kernel)

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        normal = np.stack([values[f"shape{k}"] for k in range(HATS)], axis=-1)
        table[:, :, int(Term.HAT) : int(Term.HAT) + HATS] += normal @ root.T * layout.rate[:, None]

    parameters = tuple(Parameter(f"shape{k}", 0.0, 1.0, members) for k in range(HATS))
    return Variant("damping against amplitude", parameters, apply, members >= 0)


def _bends(layout: Layout, members: np.ndarray) -> Variant:
    largest = np.array([layout.largest[members == g].max() for g in members])

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        del layout
        add(table, Term.STIFFNESS_LINEAR, values["linear"] / largest)
        add(table, Term.STIFFNESS, values["square"] / largest**2)

    parameters = tuple(Parameter(name, 0.0, _BEND, members) for name in ("linear", "square"))
    return Variant("frequency against amplitude", parameters, apply, members >= 0)


def _grid(data: GapData, records: np.ndarray, least: float = 0.0) -> FloatArray:
    low, high = amplitudes_of(data, records)
    low = min(max(low, least), 0.5 * high)
    return np.geomspace(low, max(high, 1.0001 * low), _GRID)


def _knots_told(data: GapData, records: np.ndarray) -> int:
    """Number of knots of a group with enough cycles about them."""
    a = np.log(np.maximum(data.channels.amplitude[records[data.channels.record]], 1e-300))
    knots = np.log(data.layout.knots)
    step = knots[1] - knots[0]
    return int(sum(np.count_nonzero(np.abs(a - k) < step) >= _FEWEST for k in knots))


class _Slopes:
    """Curves at the optimum of the wide fit over those at the bare model's, and how they follow its coordinates."""

    def __init__(self, bare: Weighed, fit: Weighed) -> None:
        self.data = bare.hypothesis.bare.data
        self.fit = fit
        step = 1e-3 * np.sqrt(np.diag(fit.covariance))
        size = fit.mode.size
        self.step = step
        self.table = fit.hypothesis.table(
            np.concatenate([fit.mode[None], fit.mode + np.diag(step), fit.mode - np.diag(step)])
        )
        self.bare = bare.hypothesis.table(bare.mode[None])
        self.size = size

    def covariance(self, rows: FloatArray) -> FloatArray:
        """Covariance of a curve from its slopes, (G, d)."""
        return np.asarray(rows @ self.fit.covariance @ rows.T)

    def damping(self, record: int, grid: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Excess damping ratio, (G,), and its slopes in the coordinates, (G, d)."""

        def ratio(table: FloatArray) -> FloatArray:
            rates = amplitude_rates(np.ascontiguousarray(table[:, record]), grid, self.data.channels.knots)
            return np.asarray(-rates / grid / self.data.layout.omega[record])

        return self._excess(ratio(self.table), ratio(self.bare))

    def slow(self, record: int) -> float:
        """Amplitude above which the motion grows slowly enough for its frequency to be its own."""
        aero, drive, still = self.bare[0, record, [Term.AERO, Term.DRIVE, Term.STRUCTURAL]]
        return float(drive / (aero + still + _FAST * self.data.layout.omega[record]))

    def tolerated(self, record: int, grid: FloatArray) -> FloatArray:
        """Change of frequency that is too small to count: of stiffness, and half the square of the growth ratio."""
        ratio = amplitude_rates(self.bare[:, record], grid[:1], self.data.channels.knots)[0, 0] / grid[0]
        fast = 0.5 * (ratio / self.data.layout.omega[record]) ** 2
        share = (grid - grid[0]) / (grid[-1] - grid[0])
        stiffness = TOLERANCES["stiffness"] * (_IN_WIND if self.data.layout.wind[record] else 1.0)
        return np.asarray(stiffness * share + fast * (share > 0.0))

    def frequency(self, record: int, grid: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Relative frequency over that at the smallest amplitude, (G,), and its slopes, (G, d)."""

        def bend(table: FloatArray) -> FloatArray:
            one, two = table[:, record, Term.STIFFNESS_LINEAR, None], table[:, record, Term.STIFFNESS, None]
            return np.asarray(one * (grid - grid[0]) + two * (grid**2 - grid[0] ** 2))

        return self._excess(bend(self.table), np.zeros((1, grid.size)))

    def _excess(self, wide: FloatArray, bare: FloatArray) -> tuple[FloatArray, FloatArray]:
        up, down = wide[1 : self.size + 1], wide[self.size + 1 :]
        return wide[0] - bare[0], ((up - down) / (2.0 * self.step[:, None])).T


def _branch(slopes: _Slopes, damping: list[Curve], data: GapData, test: int) -> Curve | None:
    """Growth minus decay at the amplitudes that both of a test pass."""
    mine = {c.direction: c for c in damping if data.layout.test[c.record] == test}
    if GROWTH not in mine or DECAY not in mine:
        return None
    up, down = mine[GROWTH], mine[DECAY]
    low, high = max(up.amplitude[0], down.amplitude[0]), min(up.amplitude[-1], down.amplitude[-1])
    if not high > low * np.exp(_SHORT):
        return None
    grid = np.geomspace(low, high, _GRID)
    (a, rows_a), (b, rows_b) = slopes.damping(up.record, grid), slopes.damping(down.record, grid)
    covariance = slopes.covariance(rows_a - rows_b)
    return Curve("branch", "growth - decay", up.record, up.records | down.records, grid, a - b, covariance, up.critical)
