"""The Griffin curve that follows from the measured damping alone, and the straight line through stable amplitudes."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scruton.arrays import FloatArray
from scruton.griffin.posterior import draws_of, peak_names

if TYPE_CHECKING:
    import xarray as xr

_NEAR = 0.02  # relaxation Scruton numbers: nearer than this two tests are as good as each other


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
