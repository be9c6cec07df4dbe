"""What follows the time and not the amplitude: a damper that warms, springs that creep, records that differ."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Campaign, Kind, Motion, Record, Rig, Section, Test
from scruton.dynamics.effects import UNKNOWN
from scruton.gap.data import load_gap
from scruton.gap.diagnosis import Diagnosis, diagnose
from scruton.gap.meaning import describe_unknown
from tests.gap.few import among

FREQUENCY, RATE = 5.0, 100.0  # Hz
OMEGA = 2.0 * np.pi * FREQUENCY
TIME = np.arange(0.0, 25.0, 1.0 / RATE)
WARMS_IN = 8.0  # s
RELEASES = (0.1, 0.05, 0.025)
STEADY = OMEGA * 0.006 * TIME


def ring_down(release: float, lost: FloatArray, seed: int, turned: FloatArray = OMEGA * TIME) -> Record:
    """A decay by exp(-lost), read to 0.3 % of the largest release."""
    noise = 3e-4 * np.random.default_rng(seed).standard_normal(TIME.size)
    reading = release * np.exp(-lost) * np.cos(turned) + noise
    return Record(f"{seed}", Path(f"{seed}.csv"), Kind.FREE_DECAY, TIME, reading)


def campaign(*records: Record) -> Campaign:
    rig = Rig("A", Quantity(FREQUENCY), None, None, records)
    return Campaign(Path(), "", "", Section(Motion.HEAVING, 1.0, 1.0), (rig,))


def unknown(*records: Record) -> Diagnosis:
    found = diagnose(campaign(*records), workers=1)
    assert found.verdict == "unknown"
    assert found.probability["unknown"] > 0.9
    return found


def test_a_damper_that_warms_is_no_damping_of_the_amplitude() -> None:
    """Its damping ratio falls from 0.8 to 0.4 %."""
    warm = OMEGA * (0.008 * TIME - 0.004 * (TIME - WARMS_IN * -np.expm1(-TIME / WARMS_IN)))
    found = unknown(*(ring_down(release, warm, k) for k, release in enumerate(RELEASES)))
    seen = describe_unknown(found, ())
    assert "structural damping that changes as a record goes on" in seen["form"]
    assert seen["unit"] == "of the relaxation damping"
    size, time = (found.final.value(name, 0)[0][0] for name in ("size", "time"))
    assert size < 0.0
    np.testing.assert_allclose(np.exp(time), WARMS_IN, rtol=0.1)


def test_records_that_differ_in_damping_are_told() -> None:
    ratios = (0.005, 0.006, 0.007, 0.0055)
    found = unknown(*(ring_down(0.1, OMEGA * ratio * TIME, k) for k, ratio in enumerate(ratios)))
    assert describe_unknown(found, ())["form"] == "structural damping of every record by its own"


def test_springs_that_creep_are_no_bend_of_the_amplitude() -> None:
    turned = OMEGA * (TIME - 0.01 * TIME**2 / TIME[-1])  # 2 % over the record
    found = unknown(*(ring_down(release, STEADY, k, turned) for k, release in enumerate(RELEASES)))
    seen = describe_unknown(found, ())
    assert "frequency that changes as a record goes on" in seen["form"]
    np.testing.assert_allclose(seen["largest"], 0.02, rtol=0.1)
    assert seen["unit"] == "of the frequency"


def test_a_frequency_that_creeps_by_less_than_anybody_would_notice_is_no_gap() -> None:
    turned = OMEGA * (TIME - 0.001 * TIME**2 / TIME[-1])  # 0.2 %
    found = diagnose(campaign(*(ring_down(one, STEADY, k, turned) for k, one in enumerate(RELEASES))), workers=1)
    assert found.verdict != "unknown"


def test_of_one_decay_time_and_amplitude_are_one() -> None:
    layout = load_gap(campaign(ring_down(0.1, STEADY, 0))).layout
    assert not any("as a record goes on" in variant.form for variant in UNKNOWN.variants(layout))


def in_wind(start: float, ratio: float, seed: int, wind: FloatArray, eased: FloatArray) -> Record:
    """A record of da/dt = -(eased xi omega + l U) a + c U^2, stirred by 0.5 %: Eq. (10) in a wind that changes."""
    rng, a = np.random.default_rng(seed), np.empty(TIME.size)
    a[0], step, l1, c = start, 1.0 / RATE, 0.25, 0.02
    push = 0.005 * 0.05 * np.sqrt(2.0 * 0.4 * step) * rng.standard_normal(TIME.size)
    for k in range(TIME.size - 1):
        drift = c * wind[k] ** 2 - (eased[k] * ratio * OMEGA + l1 * wind[k]) * a[k]
        a[k + 1] = a[k] + step * drift + push[k]
    reading = a * np.cos(OMEGA * TIME) + 3e-4 * rng.standard_normal(TIME.size)
    kind = Kind.GROWTH if start < 0.03 else Kind.DECAY
    return Record(f"{seed}", Path(f"{seed}.csv"), kind, TIME, reading)


def in_two_rigs(wind: FloatArray, eased: FloatArray) -> Diagnosis:
    rigs, tests = [], []
    for k, ratio in enumerate((0.004, 0.009)):
        still = tuple(
            replace(ring_down(release, OMEGA * ratio * TIME, 10 * k + i), name=f"still {k} {i}")
            for i, release in enumerate((0.12, 0.06))
        )
        rigs.append(Rig(f"{k}", Quantity(FREQUENCY), Quantity(5.0), Quantity(ratio), still))
        records = tuple(in_wind(start, ratio, 10 * k + i, wind, eased) for i, start in enumerate((0.008, 0.1)))
        tests.append(Test(f"T{k}", f"{k}", Quantity(1.2), Quantity(5.0), records=records))
    two = replace(campaign(), rigs=tuple(rigs), tests=tuple(tests))
    rivals = among("wind_speed_drift", "structural_damping_nonlinearity", "aerodynamic_damping_nonlinearity")
    return diagnose(two, prior=rivals, workers=1)


def test_a_wind_that_settles_is_a_wind_and_a_damper_that_warms_in_it_is_none() -> None:
    """Either moves the stable amplitude alike as a record goes on; ring-downs are over before the damper warms."""
    settles, steady = -np.expm1(-TIME / WARMS_IN), np.ones(TIME.size)
    winds = in_two_rigs(1.0 + 0.2 * settles, steady)
    assert winds.verdict == "wind_speed_drift"
    assert "change that settles" in winds.final.hypothesis.variants[0].form
    warms = in_two_rigs(steady, 1.0 - 0.4 * settles)
    assert warms.verdict == "unknown"
    form = describe_unknown(warms, ())["form"]
    assert form == "structural damping that changes as a record goes on, of every test by its own, in wind"
