"""Readings that stand in a row at the extreme: a range that ends, and all that looks like it and is none."""

import numpy as np
import pytest

from scruton.envelope.flat_tops import flat_top

FREQUENCY = 5.0


def decay(per_cycle: float, *, noise: float = 1e-3, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    time = np.arange(int(60 * per_cycle)) / (per_cycle * FREQUENCY)
    wave = np.exp(-0.05 * time) * np.cos(2.0 * np.pi * FREQUENCY * time + rng.uniform(0.0, 6.0))
    return time, wave + noise * rng.standard_normal(time.size)


@pytest.mark.parametrize("per_cycle", [18.3, 31.0, 64.7])
@pytest.mark.parametrize("bits", [12, 40])
def test_a_range_that_ends_is_seen_at_its_level(per_cycle: float, bits: int) -> None:
    time, wave = decay(per_cycle)
    quantum = 2.0 ** (1 - bits)
    found = flat_top(time, np.round(np.clip(wave, -0.93, 0.93) / quantum) * quantum, FREQUENCY)
    assert found.nats > 10.0
    assert found.levels == pytest.approx((0.93, 0.93), abs=0.01)


@pytest.mark.parametrize("bits", range(4, 16))
@pytest.mark.parametrize("per_cycle", [18.3, 31.0, 64.7])
def test_rounding_is_no_end_of_a_range(per_cycle: float, bits: int) -> None:
    time, wave = decay(per_cycle, noise=3e-4)
    quantum = 2.0 ** (1 - bits)
    assert flat_top(time, np.round(wave / quantum) * quantum, FREQUENCY).nats < 3.0


@pytest.mark.parametrize("per_cycle", [16, 20, 24, 40])
def test_sampling_in_step_with_the_motion_is_none(per_cycle: int) -> None:
    """Two samples beside every crest agree, however fine the reading is."""
    time = np.arange(60 * per_cycle) / (per_cycle * FREQUENCY)
    wave = np.cos(2.0 * np.pi * FREQUENCY * time + np.pi / per_cycle)
    for quantum in (1e-5, 1e-3, 1e-2):
        assert flat_top(time, np.round(wave / quantum) * quantum, FREQUENCY).nats < 3.0
    aside = np.cos(2.0 * np.pi * FREQUENCY * time + 0.3 / per_cycle)
    assert flat_top(time, aside, FREQUENCY).nats < 3.0


def test_samples_that_are_held_are_none() -> None:
    time, wave = decay(60.0)
    assert flat_top(time, np.repeat(wave[::3], 3)[: time.size], FREQUENCY).nats < 3.0


@pytest.mark.parametrize(("below", "levels"), [(-1.0, (0.73, np.inf)), (-0.6, (0.73, 0.8))])
def test_levels_are_from_the_centre_of_the_motion(below: float, levels: tuple[float, float]) -> None:
    """The mean of what is cut off on one side is not what the motion is about."""
    time, wave = decay(31.0)
    found = flat_top(time, np.clip(0.2 + wave, below, 0.93), FREQUENCY)
    assert found.levels == pytest.approx(levels, abs=0.01)


@pytest.mark.parametrize("per_cycle", [14.3, 25.4, 60.3])
def test_noise_that_comes_after_the_end_of_a_range_hides_no_plateau(per_cycle: float) -> None:
    """A converter's noise and a zero that creeps: no reading is repeated, and crests are level all the same."""
    time, wave = decay(per_cycle, noise=0.0)
    after = 3e-3 * np.random.default_rng(5).standard_normal(time.size) + 2e-4 * time
    found = flat_top(time, np.clip(wave, -0.7, np.inf) + after, FREQUENCY)
    assert found.nats > 10.0
    assert found.levels[0] == np.inf
    assert found.levels[1] == pytest.approx(0.7, abs=0.02)
    assert flat_top(time, wave + after, FREQUENCY).nats < 3.0
    assert flat_top(time, np.tanh(1.5 * wave) + after, FREQUENCY).nats < 3.0  # rounded, not cut off
