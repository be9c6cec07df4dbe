"""What the tests have covered of the Griffin plot, and how the discrepancy of a setting grows beyond it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray, IntArray
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
    """

    scruton_number: FloatArray
    low: FloatArray
    high: FloatArray

    def nearest(self, scruton_numbers: FloatArray) -> IntArray:
        """Which test lies nearest in Scruton number, shaped as the argument."""
        between = 0.5 * (self.scruton_number[1:] + self.scruton_number[:-1])
        return np.searchsorted(between, scruton_numbers)

    def tests_at(self, amplitude: float) -> int:
        """Number of tests whose transients run through an amplitude."""
        return int(np.sum((self.low <= amplitude) & (amplitude <= self.high)))

    def growth(self, index: FloatArray, amplitude: FloatArray) -> FloatArray:
        r"""Discrepancy of a new setting over that of a tested one, shaped as the arguments.

        Parameters
        ----------
        index : array
            Extrapolation index x from the nearest test.
        amplitude : array
            A/D or rad.

        Notes
        -----
        The curve walks away from its law: the variance grows as :math:`1 + w (|x| + \delta)`, delta the distance in
        ln(amplitude) from the nearest one that the transients of a test run through.
        """
        with np.errstate(divide="ignore"):
            log = np.log(amplitude)
        ranges = zip(np.log(self.low), np.log(self.high), strict=True)
        beyond = reduce(np.minimum, (np.maximum(np.maximum(low - log, log - high), 0.0) for low, high in ranges))
        variance = 1.0 + WALK * np.minimum(np.abs(index) + beyond, FARTHEST)
        return np.asarray(np.sqrt(variance))


def coverage_of(tree: "xr.DataTree", tests: Sequence[str] | None = None) -> Coverage:
    """Coverage of the peak tests of a fit, or of these alone."""
    rows = [
        (float(np.median(draws_of(tree, "scruton_number", name))), *amplitude_range(tree, name))
        for name in tests or peak_names(tree)
    ]
    return Coverage(*np.array(sorted(rows)).T)
