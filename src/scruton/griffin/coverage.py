"""What the tests have covered of the Griffin plot, and how the discrepancy of a setting grows beyond it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray
from scruton.griffin.posterior import amplitude_range, draws_of, peak_names
from scruton.griffin.thresholds import FARTHEST, WALK

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class Coverage:
    """Scruton numbers of the peak tests, in ascending order, and the amplitudes that their transients run through.

    Attributes
    ----------
    scruton_number, low, high : (J,) arrays
        The amplitudes are in A/D or rad, the test's own stable amplitude among them.
    start : float, optional
        Scruton number of the one test that the curve starts from; None where all tests share it.
    """

    scruton_number: FloatArray
    low: FloatArray
    high: FloatArray
    start: float | None = None

    @property
    def passed(self) -> list[float]:
        """Scruton numbers that distances are measured from."""
        return self.scruton_number.tolist() if self.start is None else [self.start]

    @cached_property
    def _covered(self) -> list[tuple[float, float]]:
        """Logarithms of the amplitudes that transients run through, ranges that overlap as one."""
        joined: list[tuple[float, float]] = []
        for low, high in sorted(zip(np.log(self.low).tolist(), np.log(self.high).tolist(), strict=True)):
            if joined and low <= joined[-1][1]:
                low, high = joined[-1][0], max(joined.pop()[1], high)
            joined.append((low, high))
        return joined

    def tests_at(self, amplitude: float) -> int:
        """Number of tests whose transients run through an amplitude."""
        return int(np.sum((self.low <= amplitude) & (amplitude <= self.high)))

    def growth(self, index: FloatArray, amplitude: FloatArray) -> FloatArray:
        """Discrepancy of a new setting over that of a tested one, shaped as the arguments; see `variance`.

        Parameters
        ----------
        index : array
            Extrapolation index x from the nearest test.
        amplitude : array
            A/D or rad.
        """
        with np.errstate(divide="ignore"):
            return np.sqrt(self.variance(np.abs(index), np.log(amplitude)))

    def variance(self, distance: FloatArray, log_amplitude: FloatArray) -> FloatArray:
        r"""Variance of a new setting over that of a tested one, shaped as the arguments.

        Parameters
        ----------
        distance : array
            |x| from the nearest test.
        log_amplitude : array
            Of A/D or rad.

        Notes
        -----
        The curve walks away from its law: the variance grows as :math:`1 + w (|x| + \delta)`, delta the distance in
        ln(amplitude) from the nearest one that the transients of a test run through.  A curve that starts from one
        test alone has that test's discrepancy in it, too.
        """
        at = log_amplitude
        outside = (np.maximum(np.maximum(low - at, at - high), 0.0) for low, high in self._covered)
        settings = 1.0 if self.start is None else 2.0
        return np.asarray(settings + WALK * np.minimum(distance + reduce(np.minimum, outside), FARTHEST))


def coverage_of(tree: "xr.DataTree", tests: Sequence[str] | None = None) -> Coverage:
    """Coverage of the peak tests of a fit, or of these alone."""
    rows = [
        (float(np.median(draws_of(tree, "scruton_number", name))), *amplitude_range(tree, name))
        for name in tests or peak_names(tree)
    ]
    return Coverage(*np.array(sorted(rows)).T)
