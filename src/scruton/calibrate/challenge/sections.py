"""Random bodies, rigs and winds for the blind challenge: what a wind tunnel could well have tested."""

from dataclasses import dataclass, field, replace

import numpy as np

from scruton.arrays import FloatArray
from scruton.calibrate.thresholds import SAME_CYCLE, STEADY, USUAL
from scruton.campaign.schema import Motion, Section
from scruton.simulate import Disturbances, Truth, simulate_record
from scruton.simulate.equation import mean_rate

_MIDDLE = {Motion.HEAVING: (0.018, 0.09), Motion.TORSIONAL: (np.deg2rad(1.3), np.deg2rad(3.8))}
SAMPLES_PER_CYCLE = 28
_SPEED_SPREAD = 0.03  # relative, of the reduced velocity between the rigs' peak tests
_TRIES = 1000


@dataclass(frozen=True)
class RigTruth:
    """One rig and its peak test: the rig in its wind, and what disturbs all records, or one by number (wind first)."""

    wind: Truth
    disturbances: Disturbances = field(default_factory=Disturbances)
    own: dict[int, dict[str, float | str]] = field(default_factory=dict)

    @property
    def undisturbed(self) -> tuple[float, float]:
        """Stable amplitude and relaxation rate [1/s] without disturbances."""
        return self.wind.balance()

    @property
    def still(self) -> Truth:
        """The rig in still air."""
        return replace(self.wind, air_density=0.0, wind_speed=0.0, Y1=0.0, epsilon=0.0, Y2=0.0, shedding=0.0)

    @property
    def scruton_factor(self) -> float:
        """Scruton number per unit of damping ratio: 4 pi m/(rho B D), 4 pi J/(rho B^3 D) for torsion."""
        wind = self.wind
        area = wind.width * wind.depth * (wind.width**2 if wind.motion is Motion.TORSIONAL else 1.0)
        return 4.0 * np.pi * wind.mass / (wind.air_density * area)

    @property
    def scruton_number(self) -> float:
        """4 pi m xi/(rho B D), 4 pi J xi/(rho B^3 D) for torsion."""
        return self.scruton_factor * self.wind.damping_ratio


@dataclass(frozen=True)
class Body:
    """A section and its rigs, in the order of their Scruton numbers."""

    section: Section
    rigs: tuple[RigTruth, ...]

    @property
    def middle(self) -> RigTruth:
        """The rig that severities refer to."""
        return self.rigs[len(self.rigs) // 2]

    @property
    def every(self) -> list[int]:
        """Numbers of all rigs."""
        return list(range(len(self.rigs)))


def random_body(rng: np.random.Generator, rigs: int = 3) -> Body:
    """Draw a body, heaving or torsional, whose rigs all have an undisturbed limit cycle of a usual size.

    It has one rig, or three whose Scruton numbers stand about as 1 : 2 : 4.
    """
    for _ in range(_TRIES):
        body = _draw(rng, rigs)
        usual = USUAL[body.section.motion]
        measured = [
            {
                "amplitude": rig.undisturbed[0], "relaxation": rig.undisturbed[1] / rig.wind.omega,
                "scruton_number": rig.scruton_number, "damping_ratio": rig.wind.damping_ratio, "Y1": rig.wind.Y1,
            }
            for rig in body.rigs
        ]  # fmt: skip
        if all(low <= values[name] <= high for values in measured for name, (low, high) in usual.items()):
            return body
    raise RuntimeError("no section with a limit cycle of a usual size was drawn")  # pragma: no cover


def _draw(rng: np.random.Generator, rigs: int) -> Body:
    motion = Motion.HEAVING if rng.random() < 0.5 else Motion.TORSIONAL
    torsional = motion is Motion.TORSIONAL
    depth = float(np.round(_log_uniform(rng, 0.04, 0.12), 4))
    width = float(np.round(depth * rng.uniform(3.0, 9.0), 4))
    density = float(np.round(rng.uniform(1.18, 1.24), 3))
    frequency = float(np.round(_log_uniform(rng, 2.5, 12.0), 3))
    velocity = rng.uniform(6.5, 13.0)
    middle_sc = _log_uniform(rng, 16.0, 45.0)
    ratios = np.array([0.5, 1.0, 2.0]) * np.exp(rng.uniform(-0.15, 0.15, 3))
    sc = middle_sc * (ratios if rigs == 3 else ratios[1:2])
    damping = _log_uniform(rng, 0.002, 0.008)
    share = rng.uniform(0.2, 0.6)  # of the structure's damping in the relaxation
    amplitude = _log_uniform(rng, *_MIDDLE[motion])
    stiffness = rng.uniform(-0.008, 0.004)  # relative change of frequency by the wind
    tilt = rng.uniform(-_SPEED_SPREAD, _SPEED_SPREAD)
    area = density * width * depth * (width**2 if torsional else 1.0)
    mass = middle_sc * area / (4.0 * np.pi * damping)

    # The force from the middle rig's stable amplitude and relaxation rate, by the energy balance over a cycle.
    base = Truth(motion, width, depth, mass, frequency, damping, density, velocity * frequency * depth)
    natural = 2.0 * np.pi * frequency
    rate = natural * damping / share
    base = replace(base, Y2=-2.0 * stiffness * natural**2 / base.pressure)
    first = 2.0 * (natural * damping - rate) / (base.pressure * base.passage)
    second = -amplitude * np.pi * base.omega * rate / (2.0 * base.pressure * first)
    base = replace(base, Y1=float(first), epsilon=float(second))

    made = []
    for j, number in enumerate(sc):
        own_mass = mass * rng.uniform(0.97, 1.03)
        own_frequency = np.round(frequency * np.sqrt(mass / own_mass), 4)
        truth = replace(
            base, mass=float(own_mass), frequency=float(own_frequency),
            wind_speed=float(velocity * (1.0 + tilt * (j - (rigs - 1) / 2.0)) * own_frequency * depth),
        )  # fmt: skip
        made.append(RigTruth(replace(truth, damping_ratio=float(number / RigTruth(truth).scruton_factor))))
    made.sort(key=lambda rig: rig.scruton_number)
    return Body(Section(motion, width, depth), tuple(made))


def limit_cycle(truth: Truth, disturbances: Disturbances) -> tuple[float, float]:
    """Stable amplitude and relaxation rate [1/s] with what disturbs, by the work over a cycle.

    By simulation where the wake has an equation of its own.
    NaN where there is not one limit cycle that growth from a tenth and decay from 2.7 times the amplitude reach.
    """
    from scipy.optimize import brentq

    usual, usual_rate = truth.balance()
    if disturbances.wake_gain:
        ends = []
        for start in (0.12, 2.4):
            time, x = simulate_record(
                truth, initial_amplitude=start * usual, duration=16.0 / usual_rate,
                sample_rate=SAMPLES_PER_CYCLE * truth.frequency, seed=0, disturbances=disturbances,
            )  # fmt: skip
            halves = [float(np.sqrt(2.0) * half.std()) for half in np.array_split(x[time > 12.0 / usual_rate], 2)]
            if abs(halves[1] - halves[0]) > STEADY * usual:
                return np.nan, np.nan
            ends.append(float(np.mean(halves)))
        same = abs(ends[1] - ends[0]) <= SAME_CYCLE * usual
        return (float(np.mean(ends)), usual_rate) if same else (np.nan, np.nan)

    def rate(a: float) -> float:
        return float(mean_rate(truth, disturbances, np.array([a]))[0])

    grid: FloatArray = usual * np.geomspace(0.05, 4.0, 60)
    rates = mean_rate(truth, disturbances, grid)
    crossings = np.flatnonzero(np.sign(rates[1:]) != np.sign(rates[:-1]))
    falling = [i for i in crossings if grid[i] > 0.05 * usual and rates[i] > 0.0]
    if len(falling) != 1:
        return np.nan, np.nan
    i = falling[0]
    root = float(brentq(rate, grid[i], grid[i + 1], xtol=1e-12))
    slope = -(rate(1.01 * root) - rate(0.99 * root)) / (0.02 * root)
    between = mean_rate(truth, disturbances, root * np.array([0.1, 0.15, 0.2, 0.4, 0.7, 1.3, 1.7, 2.2, 2.7]))
    if not (np.all(between[:5] > 0.0) and np.all(between[5:] < 0.0)):
        return np.nan, np.nan
    return root, slope


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
