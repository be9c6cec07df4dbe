"""A campaign in memory: its records from the full equation of motion, never from the amplitude equation."""

from pathlib import Path

import numpy as np

from scruton.calibrate.regimes import DEPTH, FREQUENCY, WIDTH, Regime
from scruton.calibrate.truths import Body, Drawn, omega0, setting, stated, wind_speed
from scruton.campaign.schema import Campaign, Kind, Quantity, Record, Rig, Test
from scruton.dynamics import ehsan_scanlan_parameters, force_parameters
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


def simulate_campaign(regime: Regime, drawn: Drawn, body: Body, seed: np.random.SeedSequence) -> Campaign:
    """Simulate all records of one campaign.

    Parameters
    ----------
    regime : Regime
    drawn : Drawn
        The truth, of one draw.
    body : Body
        True mass and density, of one draw.
    seed : SeedSequence

    Returns
    -------
    Campaign
        With mass, density and damping as the laboratory states them.
    """
    rigs, tests = [], []
    for j, child in enumerate(seed.spawn(len(regime.scruton_numbers))):
        rig, test = _rig_and_test(regime, drawn, body, j, child)
        rigs.append(rig)
        tests.append(test)
    return Campaign(
        Path(f"{regime.name}.toml"), regime.title, "simulated from the full equation of motion", regime.section,
        tuple(rigs), tuple(tests),
    )  # fmt: skip


def _rig_and_test(regime: Regime, drawn: Drawn, body: Body, j: int, seed: np.random.SeedSequence) -> tuple[Rig, Test]:
    wind = _force(regime, drawn, body, j)
    a_star, rate = float(drawn.a_star[0, j]), float(drawn.relaxation_rate[0, j])
    choices, *children = seed.spawn(1 + len(regime.kinds) + regime.ring_downs)
    rng = np.random.default_rng(choices)
    frequency, natural = FREQUENCY[regime.motion], omega0(regime.motion)

    def record(truth: Truth, kind: Kind, start: float, relaxes: float, relaxations: float, number: int) -> Record:
        time, response = simulate_record(
            truth,
            initial_amplitude=start * a_star,
            duration=cycles_recorded(relaxes, natural, relaxations) / frequency,
            sample_rate=SAMPLES_PER_CYCLE * frequency,
            seed=children[number],
            noise=Noise(regime.turbulence, sensor_noise=regime.sensor_noise * a_star),
        )
        name = f"{kind.value}-{j + 1}-{number + 1}"
        return Record(name, Path(f"{name}.csv"), kind, time, response)

    transients = [
        record(wind, kind, rng.uniform(*START[kind]), rate, RELAXATIONS, i) for i, kind in enumerate(regime.kinds)
    ]
    still = Truth(regime.motion, WIDTH, DEPTH, wind.mass, frequency, wind.damping_ratio)
    decay = natural * wind.damping_ratio
    downs = [
        record(still, Kind.FREE_DECAY, RING_DOWN_START, decay, RING_DOWN_RELAXATIONS, len(regime.kinds) + i)
        for i in range(regime.ring_downs)
    ]
    said, damping = stated(regime)
    rig = Rig(
        f"rig {j + 1}", Quantity(frequency), _quantity(float(said.mass[j]), regime.mass_sd),
        _quantity(float(damping[j]), regime.damping_sd), tuple(downs),
    )  # fmt: skip
    test = Test(
        f"test {j + 1}", rig.name, _quantity(float(said.air_density[j]), regime.density_sd),
        Quantity(wind_speed(regime.motion)), peak=True, records=tuple(transients),
    )  # fmt: skip
    return rig, test


def _force(regime: Regime, drawn: Drawn, body: Body, j: int) -> Truth:
    xi = drawn.damping_ratio[0, j]
    place = setting(regime.motion, Body(body.mass[0, j], body.air_density[0, j]), xi)
    find, name = (ehsan_scanlan_parameters, "ehsan-scanlan") if regime.n == 2.0 else (force_parameters, "paper")
    Y1, epsilon = find(drawn.a_star[0, j], drawn.relaxation_rate[0, j], place)
    return Truth(
        regime.motion, WIDTH, DEPTH, float(body.mass[0, j]), FREQUENCY[regime.motion], float(xi),
        float(body.air_density[0, j]), wind_speed(regime.motion), float(Y1), float(epsilon), force=name,
    )  # fmt: skip


def _quantity(mean: float, relative: float) -> Quantity:
    return Quantity(mean, relative * mean if relative else None)
