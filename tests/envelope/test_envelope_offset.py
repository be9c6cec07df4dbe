"""An offset that wanders within cycles, as slow drift of a sensor does: what it leaves in amplitude and phase."""

import numpy as np
import pytest

from scruton.envelope import demodulate
from scruton.envelope.offset import wandering_offset

F, PER_CYCLE = 8.2, 40


def grid(cycles):
    return np.arange(cycles * PER_CYCLE) / (F * PER_CYCLE)


def test_a_steady_motion_leaves_nothing():
    t = grid(50)
    slow = 0.3 * np.sin(0.02 * 2.0 * np.pi * F * t)
    offset = wandering_offset(t, 20.0 * np.cos(2.0 * np.pi * F * t + 1.0) + slow, F)
    inner = slice(PER_CYCLE, -PER_CYCLE)
    np.testing.assert_allclose(offset[inner], slow[inner], atol=2e-3)
    assert np.all(offset[: PER_CYCLE // 2] == offset[0])  # nothing is known of the ends
    np.testing.assert_allclose(wandering_offset(t, np.ones_like(t), F), 1.0)


def test_growth_and_a_frequency_that_is_off_leave_next_to_nothing():
    t = grid(100)
    motion = np.exp(0.01 * F * t) * np.cos(2.0 * np.pi * 1.01 * F * t)
    offset = wandering_offset(t, motion, F)
    assert np.max(np.abs(offset / np.exp(0.01 * F * t))[PER_CYCLE:-PER_CYCLE]) < 1e-3


def test_no_average_bridges_a_gap_or_a_record_that_is_too_short():
    t = grid(30)
    assert wandering_offset(t[: 2 * PER_CYCLE], np.cos(t[: 2 * PER_CYCLE]), F) is None
    gap = (t < 10.0 / F) | (t > 10.5 / F)
    assert wandering_offset(t[gap], np.cos(t[gap]), F) is None


@pytest.mark.parametrize("phase", [0.0, 0.25 * np.pi, 0.5 * np.pi])
def test_amplitude_and_phase_are_as_uncertain_as_is_said_wherever_a_record_begins(phase):
    """Errors by a random walk were 0.74 to 1.09 times what was said, and the next cycle's -0.26 of them."""
    rng, t, amplitudes, phases = np.random.default_rng(1), grid(200), [], []
    for _ in range(40):
        walk = 0.3 * np.cumsum(rng.normal(size=len(t)))
        found = demodulate(t, 200.0 * np.cos(2.0 * np.pi * F * t + phase) + walk, F)
        amplitudes.append((found.amplitude - 200.0) / found.standard_error)
        phases.append(200.0 * (found.phase - np.mean(found.phase)) / found.standard_error)
    of_amplitude, of_phase = (np.array(rows)[:, 2:-2] for rows in (amplitudes, phases))
    assert of_amplitude.std() == pytest.approx(0.97, abs=0.12)
    assert of_phase.std() == pytest.approx(of_amplitude.std(), rel=0.2)
    following = np.mean(of_amplitude[:, 1:] * of_amplitude[:, :-1]) / of_amplitude.var()
    assert abs(following) < 0.2


def test_white_noise_is_left_as_it_is(monkeypatch):
    def never(*_):
        raise AssertionError

    monkeypatch.setattr("scruton.envelope.cycles.wandering_offset", never)
    rng, t = np.random.default_rng(2), grid(200)
    demodulate(t, 100.0 * np.cos(2.0 * np.pi * F * t) + rng.normal(size=len(t)), F)
