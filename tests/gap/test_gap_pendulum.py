"""Pendulums from their equation of motion, damped by friction and by drag, of which either alone explains nothing."""

from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Campaign, Kind, Motion, Record, Rig, Section
from scruton.gap.diagnosis import diagnose

FREQUENCY = 0.8  # Hz
FRICTION, DRAG = "coulomb_friction", "structural_damping_nonlinearity"


def swing(release: float, seconds: float, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Times and angles [rad] of a swing, its damping ratio 0.4 % by friction and 0.4 % by drag at 0.2 rad."""
    friction, drag = 0.004 * 0.2 * np.pi / 2.0, 0.004 / 0.2 * 0.75 * np.pi
    omega = 2.0 * np.pi * FREQUENCY
    time = np.arange(0.0, seconds, 1.0 / rate)
    motion = solve_ivp(
        lambda _, y: [
            omega * y[1], omega * (-np.sin(y[0]) - friction * np.tanh(y[1] / 0.002) - drag * np.abs(y[1]) * y[1])
        ],
        (0.0, seconds), [release, 0.0], t_eval=time, rtol=1e-8, atol=1e-9, max_step=0.03,
    )  # fmt: skip
    return time, motion.y[0]


def campaign(motion: Motion, *records: Record) -> Campaign:
    rig = Rig("pendulum", Quantity(FREQUENCY), None, None, records)
    return Campaign(Path(), "", "", Section(motion, 1.0, 1.0), (rig,))


def test_friction_and_drag_are_named_though_either_alone_explains_nothing() -> None:
    records = []
    for k, (release, seconds) in enumerate([(0.5, 50.0), (0.35, 45.0)]):
        time, angle = swing(release, seconds, 100.0)
        step = 2.0 * np.pi / 2000.0  # of the encoder
        records.append(Record(f"{k}.csv", Path(f"{k}.csv"), Kind.FREE_DECAY, time, np.round(angle / step) * step))
    found = diagnose(campaign(Motion.TORSIONAL, *records), workers=1)
    assert {FRICTION, DRAG} <= set(found.found) <= {FRICTION, DRAG, "stiffness_nonlinearity"}
    assert found.probability[found.verdict] > 0.9
    own = min(found.singles[name].log_evidence for name in (FRICTION, DRAG)) - found.null.log_evidence
    both = found.final.log_evidence - found.null.log_evidence
    assert own < 0.05 * both


def test_a_film_of_a_swing_is_its_sine_damped_by_friction_and_drag() -> None:
    (time, angle), pixels = swing(0.7, 60.0, 30.0), 0.002
    noise = pixels * np.random.default_rng(3).standard_normal(time.size)
    film = np.round((np.sin(angle) + noise) / pixels) * pixels
    found = diagnose(campaign(Motion.HEAVING, Record("film", Path("film"), Kind.FREE_DECAY, time, film)), workers=1)
    assert set(found.found) == {FRICTION, DRAG, "sensor_clipping", "stiffness_nonlinearity"}
    assert min(found.also.values()) > 0.8
