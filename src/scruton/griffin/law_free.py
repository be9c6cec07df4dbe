"""The Griffin curve that follows from the measured damping alone, and the straight line through stable amplitudes."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scruton.arrays import FloatArray
from scruton.griffin.posterior import draws_of, peak_names

if TYPE_CHECKING:
    import xarray as xr

_NEAR = 0.02  # relaxation Scruton numbers: nearer than this two tests are as good as each other
_LEVELS = 80  # amplitudes, evenly spaced in ln A, at which the curve is read the other way


@dataclass(frozen=True, eq=False)
class LawFree:
    """Draws of Sc(A), what each peak test says of it by the damping that it measured; J tests, G amplitudes.

    Attributes
    ----------
    amplitude : (J, G) array
        A/D or rad, rising.
    scruton_number : (M, J, G) array
        At which they would be stable.
    tested, relaxation : (J,) arrays
        Sc and Sc_lambda of the tests.
    """

    amplitude: FloatArray
    scruton_number: FloatArray
    tested: FloatArray
    relaxation: FloatArray

    @property
    def reach(self) -> tuple[float, float]:
        """Lowest and highest amplitude that any transient went through."""
        return float(self.amplitude[:, 0].min()), float(self.amplitude[:, -1].max())

    def scruton_number_of(self, amplitude: FloatArray, sample: NDArray[np.integer]) -> FloatArray:
        """Scruton number at which amplitudes (N,) are stable, by draws (N,) of 0 to M - 1.

        Above the highest amplitude of any test it is that of the highest, which errs to more damping; below the lowest
        it is infinite: no record tells.

        Notes
        -----
        Tests that went through an amplitude are weighed by the inverse square of how far their setting is from there,
        in their own relaxation Scruton numbers: the curve passes through what was measured.
        """
        low, high = self.reach
        wanted = np.minimum(amplitude, high)
        weighted, weights = np.zeros((2, wanted.size))
        for j in range(len(self.tested)):
            number = self._of_test(j, wanted, sample)
            distance = (number - self.tested[j]) / self.relaxation[j]
            weight = np.where(np.isfinite(number), 1.0 / (distance**2 + _NEAR**2), 0.0)
            weighted += np.where(weight > 0.0, weight * number, 0.0)
            weights += weight
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where((wanted >= low) & (weights > 0.0), weighted / weights, np.inf)

    def log_amplitude(self, scruton_number: FloatArray, sample: NDArray[np.integer]) -> tuple[FloatArray, FloatArray]:
        """Logarithms of the amplitudes that are stable at Scruton numbers (N, K), by draws (N,), and their variance.

        NaN where no transient went through such an amplitude; of several it is the largest.  The variance is over all
        draws, shaped as the Scruton numbers.
        """
        grid, log, variance = self._at_scruton_numbers
        if grid.size < 2:  # damping that does not vary with the amplitude, or is known at none
            return np.full(scruton_number.shape, np.nan), np.full(scruton_number.shape, np.nan)
        low = np.clip(np.searchsorted(grid, scruton_number, side="right") - 1, 0, grid.size - 2)
        with np.errstate(invalid="ignore"):
            part = (scruton_number - grid[low]) / (grid[low + 1] - grid[low])
            part[~((scruton_number >= grid[0]) & (scruton_number <= grid[-1]))] = np.nan
        at = low + grid.size * sample[:, None]  # in the draws end to end
        found = (1.0 - part) * log.take(at) + part * log.take(at + 1)
        return np.asarray(found), np.asarray((1.0 - part) * variance[low] + part * variance[low + 1])

    @cached_property
    def _at_scruton_numbers(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Scruton numbers (G,), rising, ln A there by draw (M, G), NaN where there is none, and its variance (G,)."""
        low, high = self.reach
        levels, samples = np.linspace(np.log(low), np.log(high), _LEVELS), np.arange(len(self.scruton_number))
        amplitudes = np.clip(np.exp(levels), low, high)
        numbers = np.stack([self.scruton_number_of(np.full(samples.size, one), samples) for one in amplitudes], axis=1)
        middle = np.median(numbers, axis=0)
        grid = np.unique(middle[np.isfinite(middle)])
        log = np.full((samples.size, grid.size), np.nan)
        for k, sc in enumerate(grid):
            above = numbers >= sc
            crossed = above[:, :-1] & ~above[:, 1:]
            last = _LEVELS - 2 - np.argmax(crossed[:, ::-1], axis=1)
            before, after = numbers[samples, last], numbers[samples, last + 1]
            with np.errstate(invalid="ignore", divide="ignore"):
                part = np.where(crossed.any(axis=1), (before - sc) / (before - after), np.nan)
            log[:, k] = levels[last] + part * (levels[1] - levels[0])
        known = np.isfinite(log)
        mean = np.where(known, log, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
        square = np.where(known, (log - mean) ** 2, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
        return grid, log, np.asarray(square)

    def _of_test(self, j: int, amplitude: FloatArray, sample: NDArray[np.integer]) -> FloatArray:
        """What test j says, (N,); NaN where it did not go through the amplitude."""
        grid = np.log(self.amplitude[j])
        with np.errstate(divide="ignore"):
            place = (np.log(amplitude) - grid[0]) / (grid[1] - grid[0])
        inside = (place >= -1e-9) & (place <= grid.size - 1 + 1e-9)
        left = np.clip(np.where(inside, place, 0.0).astype(int), 0, grid.size - 2)
        part = np.where(inside, place, 0.0) - left
        rows = self.scruton_number[sample, j]
        at = np.arange(len(amplitude))
        return np.where(inside, (1.0 - part) * rows[at, left] + part * rows[at, left + 1], np.nan)

    def band(self, count: int = 60) -> tuple[FloatArray, FloatArray]:
        """Amplitudes (count,), and the 5, 50 and 95 % points of Sc there, (3, count)."""
        low, high = self.reach
        levels, samples = np.geomspace(low, high, count), np.arange(len(self.scruton_number))
        draws = [self.scruton_number_of(np.full(samples.size, level), samples) for level in levels]
        return levels, np.quantile(draws, [0.05, 0.5, 0.95], axis=1)


def law_free(tree: "xr.DataTree") -> LawFree | None:
    """What the transients of the peak tests say by themselves; None where there are none, or an older fit."""
    if "law_free" not in tree:
        return None
    group, kept = tree["law_free"], []
    for name in peak_names(tree):
        if np.isfinite(group["level_amplitude"].sel(test=name).to_numpy()).all():
            kept.append(name)
    if not kept:
        return None
    amplitude, number = (group[f"level_{of}"].sel(test=kept).to_numpy() for of in ("amplitude", "scruton_number"))
    tested, relaxation = (
        np.array([np.median(draws_of(tree, quantity, name)) for name in kept])
        for quantity in ("scruton_number", "relaxation_scruton_number")
    )
    return LawFree(amplitude, number, tested, relaxation)


@dataclass(frozen=True)
class StraightLine:
    """1/A = intercept + slope Sc, least squares through the stable amplitudes of the peak tests: a check by hand."""

    intercept: float
    slope: float

    def scruton_number(self, amplitude: float) -> float:
        """Scruton number at which an amplitude is stable."""
        return (1.0 / amplitude - self.intercept) / self.slope


def straight_line(tree: "xr.DataTree") -> StraightLine | None:
    """The line through median stable amplitudes; None with one setting, or where amplitude does not fall with Sc."""
    points = [
        (np.median(draws_of(tree, "scruton_number", name)), 1.0 / np.median(draws_of(tree, "a_star", name)))
        for name in peak_names(tree)
    ]
    sc, inverse = np.array(points).T
    if len(points) < 2 or not np.ptp(sc) > 0.0:
        return None
    slope, intercept = np.polyfit(sc, inverse, 1)
    return StraightLine(float(intercept), float(slope)) if slope > 0.0 else None
