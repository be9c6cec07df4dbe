"""Uncertain numbers of a bridge, by their quantile functions: what is drawn is the quantile of a uniform number."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import betainc, betaincinv, ndtr, ndtri

from scruton.arrays import FloatArray

FAMILIES = ("lognormal", "normal", "beta", "known")


_NARROW = 1e7  # shape parameters of a beta distribution that is a normal one, whose quantiles can be had


@dataclass(frozen=True)
class Uncertain:
    """A number that is not known for certain.

    Attributes
    ----------
    family : {"lognormal", "normal", "beta", "known"}
        Beta lies between 0 and 1.
    mean, sd : float
        Of the distribution before it is cut off at `minimum`.
    minimum : float
        Smaller values are excluded.
    """

    family: str
    mean: float
    sd: float = 0.0
    minimum: float = 0.0

    @property
    def certain(self) -> bool:
        """Whether there is but one value."""
        return self.family == "known" or self.sd == 0.0

    def quantile(self, u: FloatArray) -> FloatArray:
        """Value that is exceeded with probability 1 - u, for u in (0, 1)."""
        if self.certain:
            return np.full(np.shape(u), self.mean)
        if self.family == "beta" and self.mean * (1.0 - self.mean) < _NARROW * self.sd**2:
            size = self.mean * (1.0 - self.mean) / self.sd**2 - 1.0
            a, b = size * self.mean, size * (1.0 - self.mean)
            cut = float(betainc(a, b, self.minimum))
            found: FloatArray = betaincinv(a, b, cut + (1.0 - cut) * np.asarray(u))
            return found
        log = self.family == "lognormal"
        spread = np.sqrt(np.log1p((self.sd / self.mean) ** 2)) if log else self.sd
        centre = np.log(self.mean) - 0.5 * spread**2 if log else self.mean
        shown: Callable[[float], float] = np.log if log else float
        below = float(ndtr((shown(self.minimum) - centre) / spread)) if self.minimum > 0.0 or not log else 0.0
        value = centre + spread * ndtri(below + (1.0 - below) * np.asarray(u))
        return np.asarray(np.exp(value) if log else value)


def known(value: float) -> Uncertain:
    """One value."""
    return Uncertain("known", value)
