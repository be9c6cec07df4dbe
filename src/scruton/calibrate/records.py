"""A campaign in memory: its records from the full equation of motion, never from the amplitude equation."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from scruton.calibrate.regimes import DEPTH, FREQUENCY, WIDTH, Regime
from scruton.calibrate.truths import Drawn, omega0, stated, wind_speed
from scruton.campaign.schema import Campaign, Kind, Quantity, Record, Rig, Test
from scruton.dynamics import Setting
from scruton.simulate import Noise, Truth, simulate_record

SAMPLES_PER_CYCLE = 28
RELAXATIONS = 5.5  # times that a transient is recorded for, within CYCLES
CYCLES = (15.0, 250.0)
START = {Kind.GROWTH: (0.1, 0.2), Kind.DECAY: (2.2, 2.5)}  # over the stable amplitude
RING_DOWN_START = 2.0
RING_DOWN_RELAXATIONS = 3.0


def cycles_recorded(rate: float, natural: float, relaxations: float = RELAXATIONS) -> float:
    """Length in cycles of a record of something that relaxes at `rate` [1/s]."""
    return float(np.clip(relaxations * natural / (2.0 * np.pi * rate), *CYCLES))


def simulate_campaign(regime: Regime, drawn: Drawn, places: Setting, seed: np.random.SeedSequence) -> Campaign:
    """Simulate all records of one campaign, of which `drawn` and `places` hold one draw.

    Mass, density and damping of the campaign are as the laboratory states them.
    """
    rigs, tests = [], []
    frequency, natural, kinds = FREQUENCY[regime.motion], omega0(regime.motion), regime.kinds
    for j, child in enumerate(seed.spawn(len(regime.scruton_numbers))):
        a_star, rate, xi = (float(one[0, j]) for one in (drawn.a_star, drawn.relaxation_rate, drawn.damping_ratio))
        mass, density = (float(np.asarray(one)[0, j]) for one in (places.mass, places.air_density))
        still = Truth(regime.motion, WIDTH, DEPTH, mass, frequency, xi)
        wind = replace(
            still, air_density=density, wind_speed=wind_speed(regime.motion), Y1=float(drawn.Y1[0, j]),
            epsilon=float(drawn.epsilon[0, j]), force="ehsan-scanlan" if regime.n == 2.0 else "paper",
        )  # fmt: skip
        choices, *children = child.spawn(1 + len(kinds) + regime.ring_downs)
        rng = np.random.default_rng(choices)
        plans = [(wind, kind, rng.uniform(*START[kind]), rate, RELAXATIONS) for kind in kinds]
        ring_down = (still, Kind.FREE_DECAY, RING_DOWN_START, natural * xi, RING_DOWN_RELAXATIONS)
        records = []
        for number, (truth, kind, start, relaxes, times) in enumerate([*plans, *[ring_down] * regime.ring_downs], 1):
            time, response = simulate_record(
                truth, initial_amplitude=start * a_star,
                duration=cycles_recorded(relaxes, natural, times) / frequency,
                sample_rate=SAMPLES_PER_CYCLE * frequency, seed=children[number - 1],
                noise=Noise(regime.turbulence, sensor_noise=regime.sensor_noise * a_star),
            )  # fmt: skip
            name = f"{kind.value}-{j + 1}-{number}"
            records.append(Record(name, Path(f"{name}.csv"), kind, time, response))
        errors = (regime.mass_sd, regime.density_sd, regime.damping_sd)
        means = (float(one[j]) for one in stated(regime))
        said = [Quantity(mean, sd * mean if sd else None) for mean, sd in zip(means, errors, strict=True)]
        rigs.append(Rig(f"rig {j + 1}", Quantity(frequency), said[0], said[2], tuple(records[len(kinds) :])))
        speed = Quantity(wind_speed(regime.motion))
        tests.append(
            Test(f"test {j + 1}", f"rig {j + 1}", said[1], speed, peak=True, records=tuple(records[: len(kinds)]))
        )
    path, source = Path(f"{regime.name}.toml"), "simulated from the full equation of motion"
    return Campaign(path, regime.title, source, regime.section, tuple(rigs), tuple(tests))
