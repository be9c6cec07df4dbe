r"""The full equation of motion of a section in its rig, integrated in time.

Heaving, with eta = y/D (Eq. 9 of the Griffin-plot paper on the right):

.. math:: \ddot\eta + 2\xi\omega_0\dot\eta + \omega_0^2\eta = \frac{\rho U^2}{m}
   \{Y_1[D\dot\eta/U - \varepsilon\,\mathrm{sign}\,\dot\eta] + Y_2\eta + C\sin(\omega_{vs}t + \psi)\} + w(t)

and for torsion (Eq. 12) alpha in place of eta, J in place of m, rho U^2 B^2 in front and B alpha'/U in the bracket.
Ehsan and Scanlan's force has (1 - epsilon eta^2) D eta'/U in the bracket instead.  w is broad-band turbulence: white
near the resonance.  Nothing here is averaged over a cycle: that approximation is what the simulator is there to check.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from scruton.arrays import FloatArray
from scruton.campaign.schema import Motion
from scruton.simulate.disturbances import Disturbances, read_out, schedules
from scruton.simulate.disturbed import integrate

STEPS_PER_CYCLE = 120
_PAPER, _EHSAN_SCANLAN = 0, 1
_OWN_STREAM = 0xD157
FORCES = {"paper": _PAPER, "ehsan-scanlan": _EHSAN_SCANLAN}


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


def simulate_record(
    truth: Truth,
    *,
    initial_amplitude: float,
    duration: float,
    sample_rate: float,
    seed: int | np.random.SeedSequence,
    turbulence: float = 0.0,
    gust_intensity: float = 0.0,
    gust_time: float = 1.0,
    sensor_noise: float = 0.0,
    quantum: float = 0.0,
    disturbances: Disturbances | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Integrate one record.

    Parameters
    ----------
    truth : Truth
    initial_amplitude : float
        A/D or rad, released at a phase drawn from the seed.
    duration, sample_rate : float
        s and Hz.
    seed : int or SeedSequence
        The same seed gives the same bytes.
    turbulence : float
        Scatter of the stationary amplitude over the stable amplitude that broad-band turbulence shall make.  In
        still air there is no turbulence.
    gust_intensity, gust_time : float
        Relative standard deviation and time scale [s] of slow fluctuations of the wind speed.
    sensor_noise, quantum : float
        Standard deviation of white noise on the reading and step of its rounding, A/D or rad.
    disturbances : Disturbances, optional
        What the bare equation leaves out; the turbulence is scaled without it.

    Returns
    -------
    time, response : (N,) arrays
        s, and A/D or rad.

    Raises
    ------
    ValueError
        If a duration, rate or amplitude makes no record, or the force has no stable amplitude to scale to.
    """
    if not (duration > 0 and sample_rate > 0 and initial_amplitude >= 0):
        raise ValueError("duration and sample_rate must be positive, initial_amplitude zero or more")
    rng = np.random.default_rng(seed)
    samples = int(np.floor(duration * sample_rate)) + 1
    substeps = max(1, int(np.ceil(STEPS_PER_CYCLE * truth.frequency / sample_rate)))
    kick = 0.0
    if turbulence > 0 and not truth.still:
        stable, rate = truth.balance()
        if not (np.isfinite(stable) and stable > 0 and rate > 0):
            raise ValueError("turbulence is scaled by the stable amplitude, and this force has none")
        # White acceleration sigma: the part in phase with the velocity moves the amplitude, q = sigma/(sqrt(2) omega);
        # the stationary scatter of an amplitude that relaxes at `rate` is q/sqrt(2 rate).
        kick = 2.0 * truth.omega * turbulence * stable * np.sqrt(rate)
    phase = rng.uniform(0.0, 2.0 * np.pi)
    noise = rng.standard_normal((2, (samples - 1) * substeps)) if kick or gust_intensity else np.zeros((2, 0))
    start = np.array([initial_amplitude * np.cos(phase), -initial_amplitude * truth.omega * np.sin(phase)])
    response = np.empty(samples)
    step = 1.0 / (sample_rate * substeps)
    if disturbances is None or disturbances.off:
        _integrate(
            response, start, step, substeps,
            2.0 * np.pi * truth.frequency, truth.damping_ratio,
            0.0 if truth.still else truth.pressure, 0.0 if truth.still else truth.passage,
            truth.Y1, truth.epsilon, truth.Y2, FORCES[truth.force],
            truth.shedding, 2.0 * np.pi * truth.shedding_frequency, truth.shedding_phase,
            kick, gust_intensity, gust_time, noise,
        )  # fmt: skip
    else:
        own = np.random.default_rng(_beside(seed))
        times = schedules(disturbances, np.arange(samples) / sample_rate, still=truth.still, rng=own)
        integrate(
            truth, disturbances, response, start, step, substeps, kick, gust_intensity, gust_time, noise, *times
        )  # fmt: skip
        response = read_out(disturbances, response, 1.0 / sample_rate, own)
    if sensor_noise:
        response += sensor_noise * rng.standard_normal(samples)
    if quantum:
        response = np.round(response / quantum) * quantum
    return np.arange(samples) / sample_rate, response


def _beside(seed: int | np.random.SeedSequence) -> np.random.SeedSequence:
    """Give disturbances a stream of their own: the turbulence and the noise stay what they are without them."""
    root = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
    return np.random.SeedSequence(root.entropy, spawn_key=(*root.spawn_key, _OWN_STREAM))


@njit(cache=True)
def _acceleration(t, x, v, side, w0, xi, p, d, Y1, eps, Y2, force, c, wvs, psi, gust):  # type: ignore[no-untyped-def]
    """Acceleration; `side` is the sign of the velocity, held over a step that does not cross zero."""
    total = -2.0 * xi * w0 * v - w0 * w0 * x
    if p > 0.0:
        # The pressure goes with U^2, the passage with 1/U.
        wind = p * gust * gust
        if force == 0:
            total += wind * Y1 * (d / gust * v - eps * side)
        else:
            total += wind * Y1 * (1.0 - eps * x * x) * d / gust * v
        total += wind * (Y2 * x + c * np.sin(wvs * t + psi))
    return total


@njit(cache=True)
def _rk4(t, x, v, h, side, w0, xi, p, d, Y1, eps, Y2, force, c, wvs, psi, gust):  # type: ignore[no-untyped-def]
    a1 = _acceleration(t, x, v, side, w0, xi, p, d, Y1, eps, Y2, force, c, wvs, psi, gust)
    x2, v2 = x + 0.5 * h * v, v + 0.5 * h * a1
    a2 = _acceleration(t + 0.5 * h, x2, v2, side, w0, xi, p, d, Y1, eps, Y2, force, c, wvs, psi, gust)
    x3, v3 = x + 0.5 * h * v2, v + 0.5 * h * a2
    a3 = _acceleration(t + 0.5 * h, x3, v3, side, w0, xi, p, d, Y1, eps, Y2, force, c, wvs, psi, gust)
    x4, v4 = x + h * v3, v + h * a3
    a4 = _acceleration(t + h, x4, v4, side, w0, xi, p, d, Y1, eps, Y2, force, c, wvs, psi, gust)
    return x + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)


@njit(cache=True)
def _integrate(  # type: ignore[no-untyped-def]
    out, start, h, substeps, w0, xi, p, d, Y1, eps, Y2, force, c, wvs, psi, kick, intensity, gust_time, noise
):
    """Runge-Kutta between sign changes of the velocity, where the force of Eq. (9) jumps; a kick after each step."""
    x, v = start[0], start[1]
    out[0] = x
    t, k, wind = 0.0, 0, 0.0
    forget = np.exp(-h / gust_time)
    fresh = intensity * np.sqrt(1.0 - forget * forget)
    root = kick * np.sqrt(h)
    for i in range(1, out.size):
        for _ in range(substeps):
            gust = max(1.0 + wind, 0.05)
            # At rest the jump has no side: the spring decides where the motion goes.
            side = np.sign(v) if v != 0.0 else np.sign(-x)
            x1, v1 = _rk4(t, x, v, h, side, w0, xi, p, d, Y1, eps, Y2, force, c, wvs, psi, gust)
            if force == 0 and v1 * side < 0.0:
                # Split the step where the velocity crosses zero: secant, then one refinement.
                part = h * v / (v - v1)
                xm, vm = _rk4(t, x, v, part, side, w0, xi, p, d, Y1, eps, Y2, force, c, wvs, psi, gust)
                slope = _acceleration(t + part, xm, vm, side, w0, xi, p, d, Y1, eps, Y2, force, c, wvs, psi, gust)
                if slope != 0.0:
                    part = min(max(part - vm / slope, 0.0), h)
                xm, _ = _rk4(t, x, v, part, side, w0, xi, p, d, Y1, eps, Y2, force, c, wvs, psi, gust)
                x1, v1 = _rk4(t + part, xm, 0.0, h - part, -side, w0, xi, p, d, Y1, eps, Y2, force, c, wvs, psi, gust)
            x, v = x1, v1
            t += h
            if noise.shape[1] > 0:
                v += root * noise[0, k]
                wind = forget * wind + fresh * noise[1, k]
                k += 1
        out[i] = x
