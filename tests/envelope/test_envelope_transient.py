"""The paper's amplitude once a cycle: unbiased above its noise floor, and as uncertain as it says."""

import numpy as np
import pytest

from scruton.envelope import demodulate
from scruton.envelope.amplitude import amplitude, detrend
from scruton.envelope.transient import front_end_cycles

F, A = 8.03, 0.05


def sine(rng, rate, noise, seconds=60.0, amplitude=A):
    t = np.arange(int(seconds * rate)) / rate
    return t, amplitude * np.cos(2 * np.pi * F * t + 0.7) + noise * rng.standard_normal(t.size)


@pytest.mark.parametrize("rate", [60, 100, 200, 500, 1000])
@pytest.mark.parametrize("ratio", [10, 30, 100, 1000])
def test_amplitude_is_unbiased_and_its_error_right(rate, ratio):
    """Motion over noise from 10, far below the noise of the velocity at the higher rates, to 1000."""
    found = front_end_cycles(*sine(np.random.default_rng(rate + ratio), rate, A / ratio))
    z = (found.amplitude - A) / found.standard_error
    assert abs(z.mean()) < 4 / np.sqrt(z.size)
    assert 0.85 < z.std() < 1.2


def test_without_the_floor_it_would_be_wrong():
    """Eq. (3) as it stands is too large by three standard errors of a cycle."""
    t, y = sine(np.random.default_rng(0), 500, A / 30)
    found = front_end_cycles(t, y)
    omega = 2 * np.pi * found.reference_frequency
    raw = np.sqrt(np.mean(amplitude(detrend(t, y, F), t[1] - t[0], omega) ** 2))
    assert raw - A > 3 * found.standard_error.mean()
    assert raw - A > 20 * abs(found.amplitude.mean() - A)


def test_all_but_the_amplitude_is_the_demodulation():
    t, y = sine(np.random.default_rng(0), 200, A / 100)
    found, regression = front_end_cycles(t, y), demodulate(t, y)
    for name in ("time", "phase", "frequency", "frequency_error", "reference_frequency", "noise_sd"):
        np.testing.assert_array_equal(getattr(found, name), getattr(regression, name))
    assert (found.amplitude != regression.amplitude).all()


def test_a_clean_transient_is_that_of_the_regression():
    t = np.arange(0.0, 20.0, 0.002)
    envelope = 0.03 + 0.06 * np.exp(-0.4 * t)
    y = envelope * np.cos(2 * np.pi * F * t) + 1e-6 * np.random.default_rng(1).standard_normal(t.size)
    found, regression = front_end_cycles(t, y), demodulate(t, y)
    np.testing.assert_allclose(found.amplitude, regression.amplitude, rtol=2e-4)


def test_motion_below_the_noise_of_the_velocity():
    """At a fifth of it the root errs by half the square root of the mean square's error, and no more than stated."""
    rng = np.random.default_rng(4)
    t, y = sine(rng, 1000, A / 3)
    found = front_end_cycles(t, y)
    assert (found.amplitude >= 0.0).all()
    z = (found.amplitude - A) / found.standard_error
    assert abs(z.mean()) < 0.3
    assert 0.85 < np.sqrt(np.mean(z**2)) < 1.25


@pytest.mark.parametrize("spoil", ["gap", "jitter"])
def test_steps_that_are_not_equal(spoil):
    rng = np.random.default_rng(5)
    t, _ = sine(rng, 500, 0.0)
    t = t[(t < 20.0) | (t > 22.3)] if spoil == "gap" else t + 0.3 / 500 * (rng.random(t.size) - 0.5)
    y = A * np.cos(2 * np.pi * F * t + 0.7) + A / 100 * rng.standard_normal(t.size)
    found = front_end_cycles(t, y)
    z = (found.amplitude - A) / found.standard_error
    assert abs(z.mean()) < 4 / np.sqrt(z.size)
    assert 0.85 < z.std() < 1.2
    if spoil == "gap":
        assert not ((found.time > 20.0) & (found.time < 22.3)).any()
