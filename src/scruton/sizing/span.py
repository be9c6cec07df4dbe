r"""The fitted curve along the span, each strip with its own amplitude: what Scruton number holds a mode's amplitude.

A section at the amplitude a takes as much from the wind as damping of the Scruton number G(a) dissipates: G is the
Griffin curve read the other way, and goes on where no amplitude is stable.  A mode of shape phi is held at its
amplitude A where the power balances over the span,

.. math:: Sc(A) = \int \varphi^2\, G(A|\varphi|) \Big/ \int \varphi^2

Where the force loses its coherence at small amplitude, what feeds the vibration is left with :math:`1 - \exp(-a/A_c)`,

.. math:: G(a) \to (G(a) + l)\,[1 - \exp(-a/A_c)] - l

with l the linear aerodynamic damping, which moves with the deck and is not lost: under the paper's law G + l is its
constant drive c over a.  l is :math:`Sc_\lambda \min(-n, -1/n) - Sc` for n < 0 (never below zero); for n >= 0, where no
such part can be told from the rest, it is zero, and the whole excitation loses coherence.

All of it follows from two functions of :math:`r = A/A_c` for a shape and an exponent, which are tabulated once
(`Strips`); nothing is integrated draw by draw.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from scruton.arrays import FloatArray
from scruton.dynamics.laws import index_of
from scruton.griffin.curves import EffectCurve, SharedCurve
from scruton.sizing.mode_shape import ModeShape

IntArray = NDArray[np.integer]
_LOG_RATIO = np.linspace(-7.0, 9.0, 321)  # ln(A/A_c): below it the drive is linear in A, above it whole
_LEVELS = 40  # exponents at which a free one is tabulated
_STEP = 1.0 / 20.0  # of ln(amplitude) in tables of curves
_REACH = (-6.0, 3.0)  # of ln(amplitude) in them, about the section's own; inf beyond, and zero below
_BLOCK = 1024  # draws at a time
_CREST = 64  # amplitudes among which the largest excitation of a draw is sought
_FAINTEST = 8.0  # ln(1/phi) of the strips that still count: their phi^2 is 1e-7


@dataclass(frozen=True, eq=False)
class Strips:
    """Means over the span of what is left of the drive, at ratios r = A/A_c; (R,) and (L, R) arrays.

    Attributes
    ----------
    exponent : (L,) array
        Exponents n, rising.
    log_share : (R,) array
        Logarithm of M_0, with M_n the mean of phi^(2+n) [1 - exp(-r phi)] over that of phi^2.
    shift : (L, R) array
        ln(M_n/M_0)/n + ln(Gamma_n): by how much the strips stand higher on the curve than with full coherence.
    """

    exponent: FloatArray
    log_share: FloatArray
    shift: FloatArray

    def at(self, log_ratio: FloatArray, n: FloatArray) -> tuple[FloatArray, FloatArray]:
        """M_0 and the shift at ln(r) (N, K) for exponents (N,)."""
        first, last = _LOG_RATIO[0], _LOG_RATIO.size - 1
        place = np.clip((log_ratio - first) / (_LOG_RATIO[1] - first), 0.0, last)
        low = np.minimum(place.astype(int), last - 1)
        part = place - low
        log_share = self.log_share[low] + part * np.diff(self.log_share)[low]
        level = np.interp(n, self.exponent, np.arange(self.exponent.size))
        row = np.minimum(level.astype(int), max(self.exponent.size - 2, 0))
        between = (level - row)[:, None]

        def along(of: IntArray) -> FloatArray:
            before = self.shift[of[:, None], low]
            return np.asarray(before + part * (self.shift[of[:, None], low + 1] - before))

        shift = along(row)
        if between.any():
            shift += between * (along(np.minimum(row + 1, self.exponent.size - 1)) - shift)
        return np.exp(log_share + np.minimum(log_ratio - first, 0.0)), shift


def strips(shape: ModeShape, n: FloatArray) -> Strips:
    """Tabulate the strips of a shape for all exponents of the draws."""
    levels = np.unique(np.append(n, -1.0))
    if levels.size > _LEVELS:  # a free exponent: smooth in n
        levels = np.union1d(np.linspace(levels[0], levels[-1], _LEVELS), [-1.0])
    moving = shape.value != 0.0
    size, weight = np.abs(shape.value[moving]), shape.weight[moving] / shape.integral(2.0)
    log_size = np.log(size)
    powers = weight * np.exp((2.0 + levels[:, None]) * log_size)  # (L, N)
    means = np.empty((levels.size + 2, _LOG_RATIO.size))
    rows = np.vstack([powers, weight * size**2, weight * size**2 * log_size])
    for k, ratio in enumerate(np.exp(_LOG_RATIO)):
        means[:, k] = rows @ -np.expm1(-ratio * size)
    whole = means[-2]
    with np.errstate(invalid="ignore", divide="ignore"):
        shift = np.log(means[:-2] / whole) / levels[:, None]
    shift[np.abs(levels) < 1e-6] = means[-1] / whole
    return Strips(levels, np.log(whole), shift + np.log(shape.factor(levels))[:, None])


@dataclass(frozen=True, eq=False)
class CurveTable:
    """Curves without a closed form: Scruton number on a grid of ln(amplitude).

    Attributes
    ----------
    log_amplitude : (G,) array
        In even steps.
    number : (S, G) array
        Falls from row to row; constant where the vibration dies of itself before it gets so small.
    """

    log_amplitude: FloatArray
    number: FloatArray

    def scruton_number(self, row: IntArray, amplitude: FloatArray) -> FloatArray:
        """Scruton number that brings curve `row` (N,) down to (N, K) amplitudes."""
        last = self.log_amplitude.size - 1
        step = (self.log_amplitude[-1] - self.log_amplitude[0]) / last
        with np.errstate(divide="ignore"):
            place = np.clip((np.log(amplitude) - self.log_amplitude[0]) / step, 0.0, last)
        low = np.minimum(place.astype(int), last - 1)
        before, after = self.number[row[:, None], low], self.number[row[:, None], low + 1]
        return np.asarray(before + (place - low) * (after - before))

    def amplitude(self, row: IntArray, sc: FloatArray) -> FloatArray:
        """Amplitude of curve `row` (N,) at (N, K) Scruton numbers: 0 where it dies, inf beyond the table."""
        low = np.zeros(sc.shape, dtype=np.intp)
        high = np.full(sc.shape, self.log_amplitude.size - 1, dtype=np.intp)
        for _ in range(int(np.ceil(np.log2(self.log_amplitude.size)))):
            middle = (low + high) // 2
            above = self.number[row[:, None], middle] > sc
            low, high = np.where(above, middle, low), np.where(above, high, middle)
        before, after = self.number[row[:, None], low], self.number[row[:, None], high]
        with np.errstate(invalid="ignore", divide="ignore"):
            part = np.where(before > after, np.clip((before - sc) / (before - after), 0.0, 1.0), 0.0)
        found = self.log_amplitude[low] + part * (self.log_amplitude[1] - self.log_amplitude[0])
        return np.where(before <= sc, 0.0, np.where(after > sc, np.inf, np.exp(found)))


@dataclass(frozen=True, eq=False)
class EffectOnSpan:
    """Draws (N,) of tabulated curves: which row of them each one is."""

    table: CurveTable
    row: IntArray

    def amplitude(self, sc: FloatArray) -> FloatArray:
        """As of `IncoherentCurve`."""
        return self.table.amplitude(self.row, sc)

    def scruton_number(self, amplitude: FloatArray) -> FloatArray:
        """As of `IncoherentCurve`."""
        return self.table.scruton_number(self.row, amplitude)


def falling(number: FloatArray) -> FloatArray:
    """What growth from small amplitudes comes down to: curves (S, G) made to fall, from their first crest on.

    Below the crest small amplitudes die out by themselves, so that the Scruton number of the crest is enough there.
    """
    number = number.copy()
    crest = np.argmax(np.diff(number, axis=1) < 0.0, axis=1)
    before = np.arange(number.shape[1]) < crest[:, None]
    np.copyto(number, np.take_along_axis(number, crest[:, None], axis=1), where=before)
    return np.asarray(np.minimum.accumulate(number, axis=1))


def effect_on_span(effect: EffectCurve, shape: ModeShape, *, driven: bool) -> CurveTable:
    """Curves with an effect in them, every strip at its own amplitude; see the notes of this module.

    Parameters
    ----------
    effect : EffectCurve
        S draws.
    driven : bool
        With the drive c and the coherence that the effect itself loses; without either, the rest alone, which need
        not fall.

    Notes
    -----
    Amplitudes are those of the mode over Gamma_-1, as for the paper's law, which the effect is added to.  Strips stand
    on the grid of ln(amplitude) itself, with weights that are the integrals of its hat functions, so the mean over
    the span is one product of matrices.
    """
    deep = int(_FAINTEST / _STEP)
    grid = np.log(effect.largest) + np.arange(_REACH[0] - deep * _STEP, _REACH[1] + 0.5 * _STEP, _STEP)
    section = effect.excitation(np.exp(grid), driven=driven)
    depth = -np.log(np.maximum(np.abs(shape.value), np.exp(-_FAINTEST))) / _STEP
    part = shape.weight * shape.value**2 / shape.integral(2.0)
    whole = np.minimum(depth.astype(int), deep - 1)
    weight = np.bincount(whole, part * (1.0 - (depth - whole)), deep + 1)
    weight += np.bincount(whole + 1, part * (depth - whole), deep + 1)
    count = grid.size - deep
    band = np.zeros((grid.size, count))
    for k, w in enumerate(weight):
        band[np.arange(count) + deep - k, np.arange(count)] = w
    number = section @ band
    return CurveTable(grid[deep:] - np.log(shape.factor(-1.0)), falling(number) if driven else number)


@dataclass(frozen=True, eq=False)
class IncoherentCurve:
    r"""Draws of a mode's curve where the coherence depends on the amplitude along the span, (N,) arrays.

    Amplitudes are those of the section: the mode's is Gamma_n times as large, times what `Draws.scale` has else.

    Attributes
    ----------
    log_ratio : (N,) array
        ln(A/A_c) where the section's amplitude is one.
    rest, row, drive : CurveTable, (N,) array, (N,) array, or None
        Where the curve has an effect in it: all but its drive, which row of it is each draw's, and the drive [Sc A/D].
    """

    curve: SharedCurve
    strips: Strips
    log_ratio: FloatArray
    rest: CurveTable | None = None
    row: IntArray | None = None
    drive: FloatArray | None = None

    def excitation(self, amplitude: FloatArray, draws: slice = slice(None)) -> FloatArray:
        """Scruton number that holds (N, K) amplitudes of some draws, stable or not."""
        curve = self.curve
        with np.errstate(divide="ignore"):
            log = np.log(amplitude)
        ratio = self.log_ratio[draws, None] + log
        if self.rest is not None and self.row is not None and self.drive is not None:
            # the mean of c/(A phi) [1 - exp(-r phi)]: M_-1 = M_0 exp(-shift) Gamma_-1
            share, shift = self.strips.at(ratio, np.full(len(log), -1.0))
            with np.errstate(over="ignore"):
                fed = self.drive[draws, None] * share * np.exp(-shift - log)
            return np.asarray(self.rest.scruton_number(self.row[draws], amplitude) + fed)
        share, shift = self.strips.at(ratio, curve.n[draws])
        n, relaxation = curve.n[draws, None], curve.relaxation[draws, None]
        with np.errstate(divide="ignore", over="ignore"):
            lost = np.where(n < 0.0, relaxation * np.minimum(-n, -1.0 / n) - curve.reference, 0.0)
            lost = np.maximum(lost, 0.0)
            drive = relaxation * index_of(log - np.log(curve.amplitude)[draws, None] + shift, n)
        return np.asarray((curve.reference + lost + drive) * share - lost)

    def scruton_number(self, amplitude: FloatArray) -> FloatArray:
        """Scruton number that brings the vibration down to (N, 1) amplitudes: below the crest, that of the crest."""
        at, most = self._crest
        return np.where(amplitude <= at, most, np.minimum(self.excitation(np.maximum(amplitude, 1e-12)), most))

    def amplitude(self, sc: FloatArray) -> FloatArray:
        """Stable amplitude of the section at (N, K) Scruton numbers: zero where vibration dies, inf where none is."""
        return self._table.amplitude(np.arange(len(sc)), sc) * self.curve.amplitude[:, None]

    @cached_property
    def _crest(self) -> tuple[FloatArray, FloatArray]:
        """Amplitude below which every vibration dies out by itself, and the Scruton number there, (N, 1) each."""
        if self.rest is None and self.curve.n.max() <= -1.0:  # what is left of these falls with the amplitude
            return np.zeros((len(self.log_ratio), 1)), np.full((len(self.log_ratio), 1), np.inf)
        grid = np.linspace(*_REACH, _CREST)
        number = self._on(grid)
        k = np.argmax(np.diff(number, axis=1) < 0.0, axis=1)[:, None]
        # A parabola through three points about it; at the first one the curve falls from the smallest amplitude on.
        inside = np.clip(k, 1, _CREST - 2)
        before, here, after = (np.take_along_axis(number, inside + step, axis=1) for step in (-1, 0, 1))
        bend = before - 2.0 * here + after
        move = np.clip(0.5 * (before - after) / np.where(bend < 0.0, bend, -np.inf), -1.0, 1.0)
        at = self.curve.amplitude[:, None] * np.exp(grid[inside] + move * (grid[1] - grid[0]))
        most = here - 0.25 * (before - after) * move
        return np.where(k == 0, 0.0, at), np.where(k == 0, np.inf, most)

    @cached_property
    def _table(self) -> CurveTable:
        grid = np.arange(_REACH[0], _REACH[1] + 0.5 * _STEP, _STEP)
        return CurveTable(grid, falling(self._on(grid)))

    def _on(self, grid: FloatArray) -> FloatArray:
        """Excitation of every draw on a grid of ln(amplitude) about its own, block by block: large arrays are slow."""
        number, amplitude = np.empty((len(self.log_ratio), grid.size)), np.exp(grid)
        for first in range(0, len(number), _BLOCK):
            block = slice(first, first + _BLOCK)
            number[block] = self.excitation(self.curve.amplitude[block, None] * amplitude, block)
        return number
