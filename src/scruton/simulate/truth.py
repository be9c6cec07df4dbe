"""A rig in a wind and the force that acts on it, in SI units."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import gamma

from scruton.campaign.schema import Motion

FORCES = ("paper", "ehsan-scanlan", "power")

LOG_MEAN = 0.5 - float(np.log(2.0))  # of 2 sin^2 ln abs(sin) over a cycle


def power_mean(n: float) -> float:
    """Mean of 2 abs(sin)^(n+2) over a cycle: what a velocity to the power n+1 does to the amplitude."""
    return float(2.0 * gamma(0.5 * n + 1.5) / (np.sqrt(np.pi) * gamma(0.5 * n + 2.0)))


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
    force : {"paper", "ehsan-scanlan", "power"}
    exponent : float
        n >= 0 of the force "power", rho U^2 Y1 [1 - epsilon (u^n - 1)/n] D eta'/U with u = abs(eta')/omega, and
        ln u in place of the fraction where n = 0: its aerodynamic damping is that of the law n.
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
    exponent: float = 0.0
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
        if self.force == "power":
            n, share = self.exponent, (1.0 - linear / drive) / self.epsilon
            slope = drive * self.epsilon
            if n == 0.0:
                return float(np.exp(share - LOG_MEAN)), slope
            power = max(1.0 + n * share, 0.0)
            return float((power / power_mean(n)) ** (1.0 / n)), slope * power
        rate = linear - drive
        return -2.0 * self.pressure * self.Y1 * self.epsilon / (np.pi * self.omega * rate), rate

    @property
    def wind_exponent(self) -> float:
        """Relative change of the stable amplitude over that of the wind speed, by `balance`."""
        faster, slower = (replace(self, wind_speed=self.wind_speed * factor).balance()[0] for factor in (1.001, 0.999))
        return float(np.log(faster / slower) / 0.002)

    def power_law(self, stable: float, rate: float, exponent: float) -> "Truth":
        """The same rig under the force "power" that gives it a stable amplitude and a relaxation rate [1/s]."""
        linear = 2.0 * np.pi * self.frequency * self.damping_ratio
        if exponent == 0.0:
            slope, drive = rate, linear + rate * (float(np.log(stable)) + LOG_MEAN)
        else:
            slope = rate / (power_mean(exponent) * stable**exponent)
            drive = linear + (rate - slope) / exponent
        Y1 = 2.0 * drive / (self.pressure * self.passage)
        return replace(self, Y1=Y1, epsilon=slope / drive, force="power", exponent=exponent)
