"""One record: the equation of motion integrated from a release, and what the channel makes of it."""

from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.simulate.disturbances import OFF, Disturbances, read_out, schedules
from scruton.simulate.equation import STEPS_PER_CYCLE, integrate, terms
from scruton.simulate.truth import Truth

_OWN_STREAM = 0xD157


@dataclass(frozen=True)
class Noise:
    """What keeps a record from being a clean transient; nothing by default.

    Attributes
    ----------
    turbulence : float
        Scatter of the stationary amplitude over the stable amplitude that broad-band turbulence shall make.  In
        still air there is no turbulence.
    sensor_noise, quantum : float
        Standard deviation of white noise on the reading and step of its rounding, A/D or rad.
    gust_intensity, gust_time : float
        Relative standard deviation and time scale [s] of slow fluctuations of the wind speed, stationary from the
        release on.
    set_point : float
        Relative standard deviation of the wind speed from record to record, as it is set anew.
    """

    turbulence: float = 0.0
    sensor_noise: float = 0.0
    quantum: float = 0.0
    gust_intensity: float = 0.0
    gust_time: float = 1.0
    set_point: float = 0.0


def simulate_record(
    truth: Truth,
    *,
    initial_amplitude: float,
    duration: float,
    sample_rate: float,
    seed: int | np.random.SeedSequence,
    noise: Noise = Noise(),
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
    noise : Noise
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
    rng, disturbances = np.random.default_rng(seed), disturbances or OFF
    samples = int(np.floor(duration * sample_rate)) + 1
    substeps = max(1, int(np.ceil(STEPS_PER_CYCLE * truth.frequency / sample_rate)))
    kick = 0.0
    if noise.turbulence > 0 and not truth.still:
        stable, rate = truth.balance()
        if not (np.isfinite(stable) and stable > 0 and rate > 0):
            raise ValueError("turbulence is scaled by the stable amplitude, and this force has none")
        # White acceleration sigma: the part in phase with the velocity moves the amplitude, q = sigma/(sqrt(2) omega);
        # the stationary scatter of an amplitude that relaxes at `rate` is q/sqrt(2 rate).
        kick = 2.0 * truth.omega * noise.turbulence * stable * np.sqrt(rate)
    phase = rng.uniform(0.0, 2.0 * np.pi)
    steps = (samples - 1) * substeps
    white = rng.standard_normal((2, steps)) if kick or noise.gust_intensity else np.zeros((2, 0))
    time = np.arange(samples) / sample_rate
    response = np.empty(samples)
    # Disturbances have a stream of their own: the turbulence and the noise stay what they are without them.
    root = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
    extra_rng = np.random.default_rng(np.random.SeedSequence(root.entropy, spawn_key=(*root.spawn_key, _OWN_STREAM)))
    wind = np.array([noise.gust_intensity, noise.set_point])
    gust, set_point = wind * extra_rng.standard_normal(2) if wind.any() else wind
    start = initial_amplitude * np.array([np.cos(phase), -truth.omega * np.sin(phase)])
    speed, drive, rate_added = schedules(disturbances, time, still=truth.still, rng=extra_rng)
    integrate(
        response, np.append(start, gust), 1.0 / (sample_rate * substeps), substeps, terms(truth, disturbances),
        kick, noise.gust_intensity, noise.gust_time, white, speed + set_point, drive, rate_added,
    )  # fmt: skip
    response = read_out(disturbances, response, 1.0 / sample_rate, extra_rng)
    if noise.sensor_noise:
        response += noise.sensor_noise * rng.standard_normal(samples)
    if noise.quantum:
        response = np.round(response / noise.quantum) * noise.quantum
    return time, response
