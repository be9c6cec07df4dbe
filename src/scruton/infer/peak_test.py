"""One peak test in the campaign model."""

from dataclasses import dataclass
from functools import cached_property

from scruton.arrays import FloatArray
from scruton.infer.models import WIND, WindPosterior


@dataclass(frozen=True, eq=False)
class PeakTest:
    """A test at the wind speed of its rig's largest amplitude, as the campaign model has it.

    Attributes
    ----------
    name : str
    wind : WindPosterior
        Its likelihood and the priors of its scatter, noise factor and damping ratio.
    mass_damping_factor : float
        Scruton number per unit of damping ratio, at the stated mass and density.
    draws : (S, d) array
        Coordinates near the mode of `wind`, such as draws under any law: where the search for the optimum starts.
    factor_log_sd : float
        Standard deviation of the factor's logarithm, from mass and density.
    """

    name: str
    wind: WindPosterior
    mass_damping_factor: float
    draws: FloatArray
    factor_log_sd: float = 0.0

    @property
    def relaxes(self) -> bool:
        """Whether the records inform the relaxation rate."""
        return bool(self.wind.data.size)

    @cached_property
    def parameters(self) -> tuple[str, ...]:
        """Names of its coordinates: without records of the relaxation its deviation w stands for the rate."""
        names = tuple("w" if name == "relaxation_ratio" and not self.relaxes else name for name in WIND)
        return (*names, "mass_factor") if self.factor_log_sd else names
