from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lfilter

from scruton.campaign.schema import Kind, Record
from scruton.envelope import assess, beats, record_cycles, swing
from scruton.envelope.thresholds import SWING
from scruton.envelope.types import Cycles

F, STABLE, RATE = 8.0, 0.05, 0.5  # Hz, A/D, 1/s


def cycles(amplitude):
    t = np.arange(amplitude.size) / F
    nothing = np.zeros_like(t)
    return Cycles(t, amplitude, np.full_like(t, 1e-4), nothing, np.full_like(t, F), nothing, F, 1e-4)


def assessed(record):
    return assess(record, record_cycles(record, F))


def remembering(memory, first, seconds=60.0):
    """dA/dt = rate (A/B) (stable - B), B the amplitude some time ago: integrated by scipy, with nothing of ours."""

    def rhs(_, s):
        return [RATE * s[0] / s[1] * (STABLE - s[1]), (s[0] - s[1]) / memory]

    t = np.arange(int(seconds * F)) / F
    return solve_ivp(rhs, (0.0, t[-1]), [first, first], t_eval=t, rtol=1e-9).y[0]


def noisy(amplitude, sd=0.01, seed=0):
    return amplitude * (1.0 + sd * np.random.default_rng(seed).standard_normal(amplitude.size))


@pytest.mark.parametrize("first", [0.15, 2.3])
def test_an_air_that_remembers_swings_past_and_stands_in_the_end(first):
    found = swing(cycles(noisy(remembering(3.0, first * STABLE))))
    assert found is not None
    assert found.beyond > SWING
    assert found.standing.amplitude.mean() == pytest.approx(STABLE, rel=0.02)
    assert np.all(np.abs(found.standing.amplitude / STABLE - 1.0) < 0.12)


@pytest.mark.parametrize("first", [0.15, 2.3])
def test_without_memory_nothing_swings(first):
    t = np.arange(480) / F
    assert swing(cycles(noisy(STABLE * (1 + (first - 1) * np.exp(-RATE * t)), 0.03))) is None
    assert swing(cycles(noisy(remembering(0.2, first * STABLE)))) is None, "hardly any memory"


@pytest.mark.parametrize("seed", range(40))
def test_slow_gusts_are_no_swing(seed):
    t, rng = np.arange(480) / F, np.random.default_rng(seed)
    fade = np.exp(-1.0 / F / rng.uniform(2.0, 20.0))
    gust = lfilter([0.03 * np.sqrt(1 - fade**2)], [1, -fade], rng.standard_normal(t.size + 2000))[2000:]
    aim, amplitude = STABLE * (1 + gust), np.empty(t.size)
    amplitude[0] = rng.choice([0.15, 2.3]) * STABLE
    for k in range(1, t.size):
        amplitude[k] = aim[k] + np.exp(-RATE / F) * (amplitude[k - 1] - aim[k])
    assert swing(cycles(amplitude)) is None


def test_a_record_that_does_not_come_to_stand_has_no_standing_part():
    assert swing(cycles(noisy(remembering(3.0, 0.15 * STABLE, seconds=15.0)))) is None, "it ends while it swings"
    assert swing(cycles(np.full(20, STABLE))) is None, "too short to tell"


def test_the_remark_says_how_far_and_no_other_is_made_of_the_kind():
    t, rng = np.arange(197 * 60) / 197, np.random.default_rng(2)
    slow = remembering(3.0, 0.15 * STABLE)
    y = np.interp(t, np.arange(slow.size) / F, slow) * np.cos(2 * np.pi * F * t + 1) + 2e-4 * rng.standard_normal(
        t.size
    )
    quality = assessed(Record("r1", Path("r1.csv"), Kind.GROWTH, t, y, field="records[0]"))
    assert quality.swing is not None
    assert quality.stable_amplitude == pytest.approx(STABLE, rel=0.02)
    assert [remark.kind for remark in quality.remarks] == ["swing"]
    assert "passes the one where it comes to stand by" in quality.warnings[0]


def beating(seconds=60.0):
    t = np.arange(int(seconds * F)) / F
    return 0.010 - 0.008 * np.cos(2 * np.pi * t / 7.3)


def test_an_amplitude_that_beats_has_no_one_stable_value():
    low, high = beats(cycles(noisy(beating())))
    assert (low, high) == pytest.approx((0.0022, 0.0178), rel=0.15)


@pytest.mark.parametrize("seed", range(10))
def test_gusts_drift_and_transients_are_no_beating(seed):
    t, rng = np.arange(480) / F, np.random.default_rng(seed)
    fade = np.exp(-1.0 / F / rng.uniform(0.5, 20.0))
    gust = lfilter([0.06 * np.sqrt(1 - fade**2)], [1, -fade], rng.standard_normal(t.size + 2000))[2000:]
    assert beats(cycles(STABLE * (1 + gust))) is None
    assert beats(cycles(noisy(STABLE * np.exp(0.02 * t)))) is None, "a drift"
    assert beats(cycles(noisy(STABLE * (1 - 0.9 * np.exp(-0.02 * t))))) is None, "a slow growth"
    assert beats(cycles(noisy(np.full(6, STABLE)))) is None, "too short to tell"


@pytest.mark.parametrize("kind", [Kind.STEADY, Kind.GROWTH])
def test_who_has_a_beating_record_is_told_that_no_one_amplitude_is_stable(kind):
    t, rng = np.arange(6000) / 100.0, np.random.default_rng(2)
    y = np.interp(t, np.arange(480) / F, beating()) * np.cos(2 * np.pi * F * t) + 1e-4 * rng.standard_normal(t.size)
    quality = assessed(Record("s1", Path("s1.csv"), kind, t, y, field="records[0]"))
    [said] = [one for one in quality.remarks if one.kind == "beat"]
    assert "no one stable amplitude" in said.text
    steady = assessed(Record("s1", Path("s1.csv"), kind, t, 0.01 * np.cos(2 * np.pi * F * t), field="records[0]"))
    assert not [one for one in steady.remarks if one.kind == "beat"]
