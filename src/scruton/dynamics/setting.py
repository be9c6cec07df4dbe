"""One rig in one wind, in the symbols of the paper."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from scruton.arrays import FloatArray
from scruton.campaign.schema import Motion
from scruton.dynamics.scruton_number import factor, floats


@dataclass(frozen=True, eq=False)
class Setting:
    """Everything that the equations need to know of a rig in a wind; numbers or arrays that broadcast.

    Attributes
    ----------
    motion : Motion
    width, depth : array_like
        B and D [m].
    mass : array_like
        m [kg/m] for heaving, inertia J_m [kg m^2/m] for torsion.
    air_density : array_like
        rho [kg/m^3].
    wind_speed : array_like
        U [m/s].
    frequency, wind_frequency : array_like
        f0 in still air and f in the wind [Hz].
    damping_ratio : array_like
        Structural damping ratio xi_s.
    """

    motion: Motion
    width: ArrayLike
    depth: ArrayLike
    mass: ArrayLike
    air_density: ArrayLike
    wind_speed: ArrayLike
    frequency: ArrayLike
    wind_frequency: ArrayLike
    damping_ratio: ArrayLike

    @property
    def torsional(self) -> bool:
        """Whether the section rotates."""
        return self.motion is Motion.TORSIONAL

    @property
    def omega0(self) -> FloatArray:
        """Natural circular frequency in still air [rad/s]."""
        return 2.0 * np.pi * floats(self.frequency)

    @property
    def omega(self) -> FloatArray:
        """Circular frequency in the wind [rad/s]."""
        return 2.0 * np.pi * floats(self.wind_frequency)

    @property
    def K0(self) -> FloatArray:
        """Reduced frequency in still air, omega0 D/U."""
        return self.omega0 * floats(self.depth) / floats(self.wind_speed)

    @property
    def K(self) -> FloatArray:
        """Reduced frequency, omega D/U."""
        return self.omega * floats(self.depth) / floats(self.wind_speed)

    @property
    def reduced_velocity(self) -> FloatArray:
        """U/(f0 D)."""
        return 2.0 * np.pi / self.K0

    @property
    def side_ratio(self) -> FloatArray:
        """B/D."""
        return floats(self.width) / floats(self.depth)

    @property
    def beta(self) -> FloatArray:
        """B/D for torsion, 1 for heaving: the factor of Y1 in the averaged equation (Eq. 10 and its twin)."""
        return self.side_ratio if self.torsional else np.asarray(1.0)

    @property
    def scruton_side(self) -> FloatArray:
        """Factor of K0 Sc in Eqs. (11) to (21): B/D for heaving; 1 for torsion, whose Sc is made with B^3 D."""
        return np.asarray(1.0) if self.torsional else self.side_ratio

    @property
    def mass_ratio(self) -> FloatArray:
        """m_r = rho D^2/m; for torsion mu_r = rho B^2 D^2/J_m."""
        lengths = np.square(floats(self.depth))
        if self.torsional:
            lengths = lengths * np.square(floats(self.width))
        return floats(self.air_density) * lengths / floats(self.mass)

    @property
    def mass_damping_factor(self) -> FloatArray:
        """Scruton number per unit of damping ratio: 4 pi m/(rho B D), or 4 pi J_m/(rho B^3 D) (Eqs. 7 and 8)."""
        m, rho, B, D = self.mass, self.air_density, self.width, self.depth
        return factor("paper", mass=m, air_density=rho, width=B, depth=D, torsional=self.torsional)

    @property
    def scruton_number(self) -> FloatArray:
        """Sc of Eq. (7) or (8)."""
        return self.mass_damping_factor * floats(self.damping_ratio)
