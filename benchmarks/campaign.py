"""The hierarchical posterior of three rigs with six transient records each, laws weighed."""

import time
from pathlib import Path

import numpy as np

from benchmarks.result import Figure
from scruton.campaign.schema import Campaign, Kind, Motion, Quantity, Record, Rig, Section, Test
from scruton.infer.cards import load_card
from scruton.infer.fit import fit_campaign
from scruton.simulate import Noise, Truth, simulate_record

LIMIT = 60.0  # seconds
# rig: frequency [Hz], damping ratio, wind speed [m/s], Y1, epsilon, duration of a record [s]
RIGS = (
    ("1", 7.97, 0.00058, 5.735, -7.0, 0.036, 19.0),
    ("2", 7.87, 0.0065, 5.036, -7.6, 0.037, 14.0),
    ("3", 7.88, 0.0234, 4.802, -8.0, 0.038, 9.0),
)


def campaign() -> Campaign:
    """Simulate it: per rig three growths and three decays, 1 % scatter by turbulence."""
    rigs, tests = [], []
    for name, frequency, damping, speed, Y1, epsilon, duration in RIGS:
        truth = Truth(Motion.HEAVING, 0.3, 0.075, 7.2, frequency, damping, 1.22, speed, Y1, epsilon)
        stable = truth.balance()[0]
        records = []
        for i, (kind, start) in enumerate([(Kind.GROWTH, 0.1), (Kind.DECAY, 2.3)] * 3):
            time_, response = simulate_record(
                truth, initial_amplitude=start * stable, duration=duration, sample_rate=200.0,
                seed=np.random.SeedSequence([int(name), i]), noise=Noise(0.01, sensor_noise=1e-4),
            )  # fmt: skip
            records.append(Record(f"{name}-{i}.csv", Path(__file__), kind, time_, response))
        rigs.append(Rig(name, Quantity(frequency), Quantity(7.2, 0.036), Quantity(damping, 0.05 * damping)))
        tests.append(Test(name, name, Quantity(1.22), Quantity(speed), True, None, tuple(records)))
    return Campaign(Path(__file__), "benchmark", "", Section(Motion.HEAVING, 0.3, 0.075), tuple(rigs), tuple(tests))


def run() -> list[Figure]:
    data, card = campaign(), load_card()
    fit_campaign(data, card, seed=1, thorough=False)  # compiles
    wall, start = time.perf_counter(), time.process_time()
    fit = fit_campaign(data, card, seed=0, thorough=False)
    seconds, cpu = time.perf_counter() - wall, time.process_time() - start
    cycles = sum(len(one.time) for one in fit.cycles.values())
    return [
        Figure(f"{cycles} cycles, records to posterior (converged: {fit.converged})", seconds, "s", LIMIT),
        Figure("the same, processor time", cpu, "s"),
    ]
