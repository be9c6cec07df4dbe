"""A rig in a wind and the force that acts on it, in SI units."""

from dataclasses import dataclass, replace

import numpy as np

from scruton.campaign.schema import Motion

FORCES = ("paper", "ehsan-scanlan")


@dataclass(frozen=True)
class Truth:
    """A rig in a wind and the force that acts on it; SI units.

    Attributes
    ----------
    motion : Motion
    width, depth : float
        B and D [m].
    mass : float
        kg/m, or kg m^2/m for torsion.
    frequency, damping_ratio : float
        f0 [Hz] and xi_s in still air.
    air_density, wind_speed : float
        kg/m^3 and m/s; a wind speed of zero is still air.
    Y1, epsilon, Y2 : float
        Parameters of the force.
    force : {"paper", "ehsan-scanlan"}
    shedding, shedding_frequency, shedding_phase : float
        Coefficient, frequency [Hz] and phase of the vortex-shedding term.
    """

    motion: Motion
    width: float
    depth: float
    mass: float
    frequency: float
    damping_ratio: float
    air_density: float = 0.0
    wind_speed: float = 0.0
    Y1: float = 0.0
    epsilon: float = 0.0
    Y2: float = 0.0
    force: str = "paper"
    shedding: float = 0.0
    shedding_frequency: float = 0.0
    shedding_phase: float = 0.0

    @property
    def still(self) -> bool:
        """Whether the air is still."""
        return self.wind_speed == 0.0

    @property
    def pressure(self) -> float:
        """Factor of the braces: rho U^2/m, or rho U^2 B^2/J for torsion [1/s^2]."""
        length = self.width if self.motion is Motion.TORSIONAL else 1.0
        return self.air_density * self.wind_speed**2 * length**2 / self.mass

    @property
    def passage(self) -> float:
        """D/U for heaving, B/U for torsion [s]."""
        length = self.width if self.motion is Motion.TORSIONAL else self.depth
        return length / self.wind_speed

    @property
    def omega(self) -> float:
        """Circular frequency with the stiffness of the wind [rad/s]."""
        return float(np.sqrt((2.0 * np.pi * self.frequency) ** 2 - (0.0 if self.still else self.pressure * self.Y2)))

    def balance(self) -> tuple[float, float]:
        """Stable amplitude and relaxation rate [1/s] by the energy balance over one cycle.

        They scale initial amplitudes and turbulence; the integration does not use them.
        """
        linear = 2.0 * np.pi * self.frequency * self.damping_ratio
        drive = 0.5 * self.pressure * self.passage * self.Y1
        if self.force == "ehsan-scanlan":
            square = 4.0 / self.epsilon * (1.0 - linear / drive)
            return float(np.sqrt(max(square, 0.0))), 2.0 * (drive - linear)
        rate = linear - drive
        return -2.0 * self.pressure * self.Y1 * self.epsilon / (np.pi * self.omega * rate), rate

    @property
    def wind_exponent(self) -> float:
        """Relative change of the stable amplitude over that of the wind speed, by `balance`."""
        faster, slower = (replace(self, wind_speed=self.wind_speed * factor).balance()[0] for factor in (1.001, 0.999))
        return float(np.log(faster / slower) / 0.002)
