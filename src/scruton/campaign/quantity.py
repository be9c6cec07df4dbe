"""The one reading of a stated number: "0.003 +/- 0.001" has that mean and that standard deviation, in every room."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.thresholds import NARROWEST_BETA

FAMILIES = ("lognormal", "normal", "beta", "known")
_NODES, _FARTHEST = 513, 6.1  # of a table of a beta distribution, in normal deviates: 1e-9 lies within
_MANY = 2 * _NODES  # numbers from which on the table is the shorter way


@dataclass(frozen=True)
class Quantity:
    """A number as somebody states it, SI, and the distribution that this means.

    Attributes
    ----------
    mean : float
    sd : float or None
        Standard deviation; None where no uncertainty was stated.
    family : {"lognormal", "normal", "beta", "known"}
        Lognormal unless stated, since what is stated is positive; beta lies between 0 and 1.  The mean and the standard
        deviation are those of the distribution: a lognormal one has the median mean/sqrt(1 + (sd/mean)^2) and the
        log-sd sqrt(log(1 + (sd/mean)^2)).
    minimum : float
        Smaller values are excluded; `mean` and `sd` are those before the cut.
    """

    mean: float
    sd: float | None = None
    family: str = "lognormal"
    minimum: float = 0.0

    @property
    def certain(self) -> bool:
        """Whether there is but one value."""
        return self.family == "known" or not self.sd

    @property
    def relative_sd(self) -> float:
        """Standard deviation over the mean; zero where none was stated."""
        return (self.sd or 0.0) / self.mean

    @property
    def log_sd(self) -> float:
        """Standard deviation of the logarithm of a lognormal quantity."""
        return float(np.sqrt(np.log1p(self.relative_sd**2)))

    @property
    def median(self) -> float:
        """Value that is exceeded with probability one half."""
        return float(self.quantile(np.array(0.5)))

    def or_relative_sd(self, relative: float) -> "Quantity":
        """The quantity itself; with this relative standard deviation where it was stated without any."""
        return self if self.sd is not None else replace(self, sd=relative * self.mean)

    def interval(self, probability: float) -> tuple[float, float]:
        """Quantiles that leave (1 - probability)/2 on either side."""
        low, high = self.quantile(np.array([0.5 - 0.5 * probability, 0.5 + 0.5 * probability]))
        return float(low), float(high)

    def quantile(self, u: FloatArray) -> FloatArray:
        """Value that is exceeded with probability 1 - u, for u in (0, 1)."""
        from scipy.special import betainc, betaincinv, ndtr, ndtri

        if self.certain:
            return np.full(np.shape(u), self.mean)
        if shapes := self._beta:
            cut = float(betainc(*shapes, self.minimum))
            if np.size(u) >= _MANY:
                return np.clip(_beta_table(*shapes, cut)(np.clip(ndtri(u), -_FARTHEST, _FARTHEST)), self.minimum, 1.0)
            return np.asarray(betaincinv(*shapes, cut + (1.0 - cut) * np.asarray(u)))
        centre, spread = self._normal
        below = float(ndtr((self._coordinate(self.minimum) - centre) / spread)) if self._is_cut else 0.0
        value = centre + spread * ndtri(below + (1.0 - below) * np.asarray(u))
        return np.asarray(np.exp(value) if self.family == "lognormal" else value)

    def draw(self, rng: np.random.Generator, size: int | tuple[int, ...]) -> FloatArray:
        """Draws of this shape; one value throughout, and no random number taken, where the quantity is certain."""
        from scipy.special import ndtr

        if self.certain:
            return np.full(size, self.mean)
        z = rng.standard_normal(size)
        if self.family == "lognormal" and not self._is_cut:
            log_variance = np.log1p(self.relative_sd**2)
            return np.asarray(self.mean * np.exp(np.sqrt(log_variance) * z - 0.5 * log_variance))
        return self.quantile(ndtr(z))

    def log_density(self, x: FloatArray) -> FloatArray:
        """Log density at `x`, same shape; minus infinity below the minimum.

        Raises
        ------
        ValueError
            For a quantity that is certain: it has no density.
        """
        from scipy.special import betainc, betaln, ndtr

        if self.certain:
            raise ValueError("a quantity that is certain has no density")
        x = np.asarray(x, dtype=np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            if shapes := self._beta:
                a, b = shapes
                density = (a - 1.0) * np.log(x) + (b - 1.0) * np.log1p(-x) - betaln(a, b)
                above = 1.0 - float(betainc(a, b, self.minimum))
                inside = (x >= self.minimum) & (x > 0.0) & (x < 1.0)
            else:
                centre, spread = self._normal
                z = (self._coordinate(x) - centre) / spread
                density = -0.5 * (z * z + np.log(2.0 * np.pi)) - np.log(spread)
                density -= np.log(x) if self.family == "lognormal" else 0.0
                above = 1.0
                inside = x > 0.0 if self.family == "lognormal" else np.isfinite(x)
                if self._is_cut:
                    above -= float(ndtr((self._coordinate(self.minimum) - centre) / spread))
                    inside &= x >= self.minimum
        return np.where(inside, density - np.log(above), -np.inf)

    @property
    def _is_cut(self) -> bool:
        """Whether the minimum excludes anything: a lognormal quantity is positive anyway."""
        return self.minimum > 0.0 or self.family != "lognormal"

    @property
    def _beta(self) -> tuple[float, float] | None:
        """Shape parameters of a beta distribution; None of others, and where it is as narrow as a normal one."""
        if self.family != "beta" or not self.sd or self.mean * (1.0 - self.mean) >= NARROWEST_BETA * self.sd**2:
            return None
        size = self.mean * (1.0 - self.mean) / self.sd**2 - 1.0
        return size * self.mean, size * (1.0 - self.mean)

    @property
    def _normal(self) -> tuple[float, float]:
        """Mean and standard deviation of the coordinate that is normal: the logarithm, or the number itself."""
        if self.family != "lognormal":
            return self.mean, self.sd or 0.0
        return float(np.log(self.mean) - 0.5 * self.log_sd**2), self.log_sd

    def _coordinate(self, value: FloatArray | float) -> FloatArray:
        return np.asarray(np.log(value) if self.family == "lognormal" else value)


@lru_cache(16)
def _beta_table(a: float, b: float, cut: float) -> Callable[[FloatArray], FloatArray]:
    """Quantile of a beta distribution without its lowest part, by normal deviate: to 1e-8, ten times as fast."""
    from scipy.interpolate import CubicSpline
    from scipy.special import betaincinv, ndtr

    z = np.linspace(-_FARTHEST, _FARTHEST, _NODES)
    table: Callable[[FloatArray], FloatArray] = CubicSpline(z, betaincinv(a, b, cut + (1.0 - cut) * ndtr(z)))
    return table
