"""A mode of the bridge as a function of what is uncertain: from the unit cube to amplitudes and the damping they need.

Every source of uncertainty has one coordinate of the unit cube.  Risk curves, shares of variance and the value of
information all start from the same function of it, so they cannot disagree about the model.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtri

from scruton.arrays import FloatArray
from scruton.campaign.schema import Motion
from scruton.dynamics.laws import index_of
from scruton.dynamics.scruton_number import factor as scruton_number_factor
from scruton.griffin.curves import LawCurves, SharedCurve
from scruton.sizing.bridge import Bridge, Mode
from scruton.stats.convergence import monte_carlo_error

IntArray = NDArray[np.integer]
SECTION, LAW, DISCREPANCY, DAMPING, COHERENCE, MASS, FREQUENCY = range(7)
SOURCES = {
    SECTION: "section model's posterior",
    LAW: "law of aerodynamic damping",
    DISCREPANCY: "discrepancy between settings",
    DAMPING: "structural damping of the bridge",
    COHERENCE: "spanwise coherence",
    MASS: "mass of the mode",
    FREQUENCY: "frequency of the mode",
}
_REPETITIONS = 25  # most take five; one in a thousand meets a bend of the distance
_SC_GRID = 64  # Scruton numbers at which a curve with an effect in it is tabulated
_BLOCKS = 64  # of the posterior's draws, between which Monte Carlo errors look for differences


def unit_cube(count: int, seed: int, sources: int = len(SOURCES)) -> FloatArray:
    """Scrambled Sobol' points, (count, sources); `count` is a power of two.

    Rows of two cubes must not be paired: whatever their seeds, points of the same index share leading digits.
    """
    from scipy.stats import qmc

    points = qmc.Sobol(sources, scramble=True, rng=np.random.default_rng([seed, 0x512E])).random(count)
    return np.clip(points, 1e-9, 1.0 - 1e-9)


@dataclass(frozen=True)
class Spread:
    """Median, 5 and 95 % points of what is uncertain; None for a point that is not asked for.

    `mcse` has the Monte Carlo standard errors of the median, the 5 and the 95 % point, where they are told.
    """

    median: float
    low: float | None = None
    high: float | None = None
    mcse: tuple[float, float, float] | None = None


def spread(draws: FloatArray, u: FloatArray | None = None) -> Spread:
    """Median, 5 and 95 % points of draws; no interpolation, since some may be infinite.

    `u` are the points of the unit cube that the draws stand at, for their Monte Carlo errors.
    """
    low, median, high = np.quantile(draws, [0.05, 0.5, 0.95], method="inverted_cdf")
    mcse = None
    if u is not None:
        of_median, of_low, of_high = (sampling_error(draws, u, p) for p in (0.5, 0.05, 0.95))
        mcse = of_median, of_low, of_high
    return Spread(float(median), float(low), float(high), mcse)


def sampling_error(draws: FloatArray, u: FloatArray, probability: float | None = None) -> float:
    """Monte Carlo standard error of a quantile, or of the mean, of draws (N,) at points of the unit cube (N, sources).

    Notes
    -----
    Taken in the order of the posterior's draws that they stand on, one chain after the other: points that share a draw
    of the section's posterior, or neighbours of one chain, are not independent, and count for as many as they are.
    That the points are spread evenly over the other sources makes the error smaller than this.
    """
    ordered = draws[np.argsort(u[:, SECTION], kind="stable")]
    return monte_carlo_error(ordered.reshape(_BLOCKS, -1), probability)


@dataclass(frozen=True, eq=False)
class ModeModel:
    """One mode in the light of the section's posterior.

    `section_factor`, (S,), has draws of the Scruton number per unit of damping ratio of the section model, for a mode
    of the same mass ratio.
    """

    laws: LawCurves
    section_factor: FloatArray
    bridge: Bridge
    mode: Mode

    def uncertain(self) -> tuple[int, ...]:
        """Sources of which there is more than one value, that bear on the amplitude."""
        vary = {
            SECTION: True,
            LAW: np.count_nonzero(self.laws.weights > 0.0) > 1,
            DISCREPANCY: self.laws.discrepancy.max() > 0.0,
            DAMPING: not self.mode.damping_ratio.certain,
            COHERENCE: not self.bridge.coherence.certain,
            MASS: self.mode.mass is not None and not self.mode.mass.certain,
        }
        return tuple(source for source, varies in vary.items() if varies)

    def draws(self, u: FloatArray) -> "Draws":
        """Draws at points of the unit cube, (N, sources)."""
        laws = self.laws
        size = laws.n.shape[1]
        law = np.minimum(np.searchsorted(np.cumsum(laws.weights), u[:, LAW], side="right"), len(laws.labels) - 1)
        draw = np.minimum((u[:, SECTION] * size).astype(int), size - 1)
        # A curve with an effect in it is read from `table`: its coefficients need not be copied to every draw.
        curve = replace(laws, effect=None).choose(law, draw)
        length = self.bridge.depth if self.bridge.motion is Motion.HEAVING else 1.0
        z = ndtri(u[:, DISCREPANCY])
        scale = length * self.mode.shape.factor(curve.n) * self.bridge.coherence.quantile(u[:, COHERENCE])
        if self.mode.mass is None:
            factor = np.resize(self.section_factor, size)[draw]
        else:
            factor = scruton_number_factor(
                "paper", mass=self.mode.mass.quantile(u[:, MASS]), air_density=self.bridge.air_density,
                width=self.bridge.width, depth=self.bridge.depth, torsional=self.bridge.motion is Motion.TORSIONAL,
            )  # fmt: skip
        frequency = self.mode.frequency
        return Draws(
            curve, scale, self.mode.damping_ratio.quantile(u[:, DAMPING]), factor,
            frequency.quantile(u[:, FREQUENCY]) / frequency.mean - 1.0, z, draw, self.table,
        )  # fmt: skip

    @property
    def lever_arm(self) -> float:
        """Lever arm of dampers against torsion [m]; 1 for heaving."""
        if self.bridge.motion is Motion.HEAVING:
            return 1.0
        return self.bridge.damper.lever_arm or 0.5 * self.bridge.width

    @property
    def damper_positions(self) -> tuple[float, ...]:
        """Fractions of the span where the mode's dampers stand: as asked for, or all where the mode is largest."""
        request = self.bridge.damper
        if (places := request.places(self.mode.name)) is not None:
            return places
        x = self.mode.shape.position
        largest = x[int(np.abs(self.mode.shape.value).argmax())]
        return (float((largest - x[0]) / (x[-1] - x[0])),) * request.number

    @cached_property
    def table(self) -> "CurveTable | None":
        """Curves with an effect in them, each draw once; None where the law has a closed form."""
        effect = self.laws.effect
        if effect is None:
            return None
        centre = max(self.laws.reference, 1e-3)
        grid = np.geomspace(0.02 * centre, 60.0 * centre, _SC_GRID)
        with np.errstate(divide="ignore"):
            return CurveTable(grid, np.log(effect.at(grid)))


@dataclass(frozen=True, eq=False)
class Draws:
    """Draws of a mode from the section's curves, (N,) arrays.

    Attributes
    ----------
    scale : (N,) array
        Amplitude of the bridge [m] or [rad] over that of a section.
    damping_ratio : (N,) array
        Structural damping ratio of the bridge.
    factor : (N,) array
        Scruton number per unit of damping ratio.
    detuning : (N,) array
        Relative error of the frequency.
    discrepancy : (N,) array
        Standard normal deviate of the discrepancy.
    row : (N,) array
        Which draw of the posterior each one is.
    """

    curve: SharedCurve
    scale: FloatArray
    damping_ratio: FloatArray
    factor: FloatArray
    detuning: FloatArray
    discrepancy: FloatArray
    row: IntArray
    table: "CurveTable | None" = None

    def __len__(self) -> int:
        return len(self.scale)

    def scruton_number(self, added: ArrayLike) -> FloatArray:
        """Scruton number with added damping: (N,) for one a draw, (N, K) for (1, K) or (N, K)."""
        damping = self.damping_ratio if np.ndim(added) < 2 else self.damping_ratio[:, None]
        factor = self.factor if np.ndim(added) < 2 else self.factor[:, None]
        return np.asarray((damping + np.asarray(added)) * factor)

    def amplitude(self, added: ArrayLike) -> FloatArray:
        """Stable amplitude [m] or [rad] with added damping, shaped as `scruton_number`; zero where vibration dies."""
        sc = self.scruton_number(added)
        square = sc.reshape(len(self), -1)
        on_curve = self._on_curve(square)
        away = np.exp(self.curve.spread(square, on_curve) * self.discrepancy[:, None])
        return (self.scale[:, None] * on_curve * away).reshape(sc.shape)

    def spread(self, added: FloatArray) -> FloatArray:
        """Sd of ln(amplitude) that the discrepancy between settings means, with (1, K) or (N, K) added damping."""
        sc = self.scruton_number(added)
        return self.curve.spread(sc, self._on_curve(sc))

    def _on_curve(self, sc: FloatArray) -> FloatArray:
        return self.curve.at(sc) if self.table is None else self.table.amplitude(self.row, sc)

    def needed(self, limit: float) -> FloatArray:
        """Added damping at which the amplitude is down to the limit, (N,); below zero where none is needed.

        Notes
        -----
        The inverse of A(Sc) = A_ref (1 - n x)^(1/n), or of the table where the curve has an effect in it.  How far the
        setting lies off the curve depends a little on where it is: found by repetition.
        """
        with np.errstate(divide="ignore"):  # a coherence that comes out as zero keeps any limit
            target = limit / self.scale
        sc, on_curve = self.scruton_number(0.0), target
        for _ in range(_REPETITIONS):
            spread = self.curve.spread(sc[:, None], on_curve[:, None])[:, 0]
            on_curve = target * np.exp(-spread * self.discrepancy)
            sc = self._inverse(on_curve)
        return np.asarray(sc / self.factor - self.damping_ratio)

    def _inverse(self, on_curve: FloatArray) -> FloatArray:
        """Scruton numbers at which the curves have these amplitudes, (N,)."""
        if self.table is not None:
            return self.table.scruton_number(self.row, on_curve)
        curve = self.curve
        return np.asarray(curve.reference + curve.relaxation * index_of(np.log(on_curve / curve.amplitude), curve.n))


@dataclass(frozen=True, eq=False)
class CurveTable:
    """Curves with an effect in them, which have no closed form: ln(amplitude) on a grid of Scruton numbers.

    Attributes
    ----------
    grid : (G,) array
        Scruton numbers, in geometric steps.
    log_amplitude : (S, G) array
        -inf where vibration dies.
    """

    grid: FloatArray
    log_amplitude: FloatArray

    def amplitude(self, row: IntArray, sc: FloatArray) -> FloatArray:
        """Amplitude of curve `row` (N,) at (N, K) Scruton numbers."""
        last = self.grid.size - 1
        with np.errstate(divide="ignore"):
            place = np.interp(np.log(np.maximum(sc, self.grid[0])), np.log(self.grid), np.arange(last + 1))
        low = np.minimum(place.astype(int), last - 1)
        part = place - low
        before, after = self.log_amplitude[row[:, None], low], self.log_amplitude[row[:, None], low + 1]
        with np.errstate(invalid="ignore"):
            value = np.exp((1.0 - part) * before + part * after)
        return np.where(np.isneginf(after), np.where(part > 0.5, 0.0, np.exp(before)), value)

    def scruton_number(self, row: IntArray, target: FloatArray) -> FloatArray:
        """Largest Scruton number at which curve `row` still reaches the target amplitude, (N,)."""
        curve = self.log_amplitude[row]
        wanted = np.log(target)
        above = curve > wanted[:, None]
        last = np.where(above.any(axis=1), self.grid.size - 1 - above[:, ::-1].argmax(axis=1), -1)
        numbers = np.full(len(target), np.inf)  # still above where the table ends
        numbers[last == -1] = self.grid[0]
        inside = np.flatnonzero((last >= 0) & (last < self.grid.size - 1))
        k = last[inside]
        high, low = curve[inside, k], curve[inside, k + 1]
        alive = np.isfinite(low)
        part = np.where(alive, (high - wanted[inside]) / (high - np.where(alive, low, high - 1.0)), 0.5)
        numbers[inside] = np.exp(np.log(self.grid[k]) + part * np.diff(np.log(self.grid))[k])
        return numbers
