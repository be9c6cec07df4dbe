"""Prior distributions: each with its unit and its reason, sampled in the coordinate where it is simple.

A parameter that must be positive is sampled by its logarithm, others as they are; `Prior.to_sampled` and
`Prior.from_sampled` convert.  Densities are with respect to the sampled coordinate.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from scruton.arrays import FloatArray

_LOG_2PI = float(np.log(2.0 * np.pi))

# family -> (its parameters, whether the sampled coordinate is the logarithm)
FAMILIES: dict[str, tuple[tuple[str, str], bool]] = {
    "lognormal": (("median", "log_sd"), True),
    "loguniform": (("low", "high"), True),
    "normal": (("mean", "sd"), False),
    "uniform": (("low", "high"), False),
}


@dataclass(frozen=True)
class Prior:
    """One parameter's prior.

    Parameters
    ----------
    name : str
        The parameter.
    family : {"lognormal", "loguniform", "normal", "uniform"}
    first, second : float
        median and log_sd; low and high; mean and sd; low and high.
    unit, reason : str
        The unit of the parameter, and why this prior: both are printed in reports.

    Raises
    ------
    ValueError
        If the family is unknown or its numbers make no distribution.
    """

    name: str
    family: str
    first: float
    second: float
    unit: str = ""
    reason: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        if self.family not in FAMILIES:
            raise ValueError(f"prior of {self.name}: unknown family '{self.family}'; one of {', '.join(FAMILIES)}")
        (first, second), logarithmic = FAMILIES[self.family]
        if not (np.isfinite(self.first) and np.isfinite(self.second)):
            raise ValueError(f"prior of {self.name}: {first} and {second} must be finite")
        if logarithmic and self.first <= 0:
            raise ValueError(f"prior of {self.name}: {first} = {self.first:g} must be positive")
        if self._bounded and self.second <= self.first:
            raise ValueError(f"prior of {self.name}: high = {self.second:g} must exceed low = {self.first:g}")
        if not self._bounded and self.second <= 0:
            raise ValueError(f"prior of {self.name}: {second} = {self.second:g} must be positive")

    @property
    def logarithmic(self) -> bool:
        """Whether the sampled coordinate is the logarithm of the parameter."""
        return FAMILIES[self.family][1]

    @property
    def _bounded(self) -> bool:
        return self.family.endswith("uniform")

    @property
    def location(self) -> float:
        """Centre of the prior in the sampled coordinate."""
        first, second = self._sampled_numbers()
        return 0.5 * (first + second) if self._bounded else first

    @property
    def scale(self) -> float:
        """Standard deviation of the prior in the sampled coordinate."""
        first, second = self._sampled_numbers()
        return (second - first) / float(np.sqrt(12.0)) if self._bounded else second

    def _sampled_numbers(self) -> tuple[float, float]:
        if not self.logarithmic:
            return self.first, self.second
        return float(np.log(self.first)), float(np.log(self.second)) if self._bounded else self.second

    def to_sampled(self, value: FloatArray) -> FloatArray:
        """Parameter to sampled coordinate."""
        return np.log(value) if self.logarithmic else np.asarray(value, dtype=np.float64)

    def from_sampled(self, u: FloatArray) -> FloatArray:
        """Sampled coordinate to parameter."""
        # Beyond exp(+-700) a double overflows; no posterior lives there.
        return np.exp(np.clip(u, -700.0, 700.0)) if self.logarithmic else np.asarray(u, dtype=np.float64)

    def log_density(self, u: FloatArray) -> FloatArray:
        """Log density in the sampled coordinate, same shape; -inf outside the support."""
        first, second = self._sampled_numbers()
        u = np.asarray(u, dtype=np.float64)
        if self._bounded:
            return np.where((u >= first) & (u <= second), -np.log(second - first), -np.inf)
        z = (u - first) / second
        return np.asarray(-0.5 * (z * z + _LOG_2PI) - np.log(second))

    def draw(self, rng: np.random.Generator, size: int) -> FloatArray:
        """Draws of the sampled coordinate, (size,)."""
        first, second = self._sampled_numbers()
        return rng.uniform(first, second, size) if self._bounded else rng.normal(first, second, size)

    def supports(self, value: float) -> bool:
        """Whether the parameter's `value` (not the sampled coordinate) has positive density."""
        if not np.isfinite(value) or (self.logarithmic and value <= 0):
            return False
        return bool(np.isfinite(self.log_density(self.to_sampled(np.asarray(value)))))


def check_support(priors: Sequence[Prior], values: Sequence[float]) -> None:
    """Raise if a parameter value lies outside its prior, naming every offending parameter.

    Raises
    ------
    ValueError
        "stable_amplitude = -0.1 A/D lies outside its prior, lognormal(median = 0.05, log_sd = 1.5)".
    """
    faults = []
    for prior, value in zip(priors, values, strict=True):
        if not prior.supports(float(value)):
            (first, second), _ = FAMILIES[prior.family]
            unit = f" {prior.unit}" if prior.unit not in ("", "-") else ""
            faults.append(
                f"{prior.name} = {float(value):g}{unit} lies outside its prior, "
                f"{prior.family}({first} = {prior.first:g}, {second} = {prior.second:g})"
            )
    if faults:
        raise ValueError("; ".join(faults))


def finite_exp(x: FloatArray) -> FloatArray:
    """Exponential of coordinates that a search may take far out: beyond, where no posterior lives, it stays finite."""
    return np.asarray(np.exp(np.clip(x, -300.0, 300.0)))


def normal_log_density(deviation: FloatArray, log_sd: FloatArray) -> FloatArray:
    """Log density of a deviation from the mean of a normal whose standard deviation is known by its logarithm."""
    return np.asarray(-0.5 * (np.square(deviation * finite_exp(-log_sd)) + _LOG_2PI) - log_sd)
