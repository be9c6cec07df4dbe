"""What the tests of a campaign have in common beside the curve: how nearly one tunnel sets its wind again."""

from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray, IntArray
from scruton.infer.thresholds import CHANCE_OF_ALL, FEW_RATES, SET_POINT_IN_COMMON
from scruton.stats.posterior import Block
from scruton.stats.priors import Prior, normal_log_density

COMMON = "common_set_point_scatter"


@dataclass(frozen=True, eq=False)
class InCommon:
    """The set-point scatters of several tests, which lie about one that they share.

    Every test keeps the prior of the card, ln s_j ~ N(m, s^2); two of them are correlated by `SET_POINT_IN_COMMON`,
    rho: ln s_j = m + (c - m) + e_j, with c - m ~ N(0, rho s^2) and e_j ~ N(0, (1 - rho) s^2).  Two records that agree
    by chance tell little of a scatter, and those of one test are no more.

    Attributes
    ----------
    own : Prior
        Of the scatter of each test, lognormal.
    columns : (J,) array of int
        Where it stands among the coordinates, by test.
    """

    own: Prior
    columns: IntArray

    @property
    def prior(self) -> Prior:
        """Of the scatter that they lie about."""
        spread = float(np.sqrt(SET_POINT_IN_COMMON)) * self.own.scale
        return Prior(COMMON, "lognormal", float(np.exp(self.own.location)), spread, self.own.unit)

    @property
    def _spread(self) -> float:
        return float(np.sqrt(1.0 - SET_POINT_IN_COMMON)) * self.own.scale

    def blocks(self, common: IntArray) -> tuple[Block, Block]:
        """How the coordinate that they lie about is moved: given them, and with all of them.

        They lie closer about it than the records tell any of them: turn by turn neither would get far.
        """
        together = Block(common, np.arange(0), carried=self.columns, chance=CHANCE_OF_ALL)
        return Block(common, self.columns, unread=True), together

    def log_density(self, u: FloatArray, common: FloatArray) -> FloatArray:
        """Log prior of every test's coordinate given the common one (W,), (W, J)."""
        return normal_log_density(u[:, self.columns] - common[:, None], np.log(self._spread))

    def spread_about(self, u: FloatArray, common: FloatArray) -> None:
        """Turn draws of the tests' own priors, in place, into draws about the common one."""
        deviates = (u[:, self.columns] - self.own.location) / self.own.scale
        u[:, self.columns] = common[:, None] + self._spread * deviates

    def guess(self, u: FloatArray, rng: np.random.Generator) -> FloatArray:
        """A common scatter near those of the tests, (W,)."""
        return np.asarray(u[:, self.columns].mean(axis=1) + self._spread * rng.standard_normal(len(u)))


def departure_blocks(
    z: IntArray, curve: IntArray, levels: IntArray, rates: IntArray, scales: IntArray
) -> tuple[Block, ...]:
    """How the departure from the law that tests share is moved: given their rates, and with those of a few tests.

    What bends the transients of all tests moves the rates of all, and their reference: turn by turn neither would get
    far.  The rates of many tests at once are hardly ever accepted.

    Parameters
    ----------
    z : array of int
        Where it stands among the coordinates.
    curve : array of int
        Where the curve stands: its amplitude, its relaxation, and the rest.
    levels, rates, scales : arrays of int
        Where the tests' stable amplitudes, their rates and the scales of their departures stand.
    """
    alone = Block(z, np.r_[scales, rates])
    if rates.size > FEW_RATES:
        return (alone,)
    together = Block(np.r_[z, curve[1], rates], np.r_[np.delete(curve, 1), levels, scales])
    return tuple(block._replace(chance=0.5) for block in (alone, together))
