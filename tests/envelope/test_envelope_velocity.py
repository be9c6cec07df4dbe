import numpy as np
import pytest

from scruton.envelope.amplitude import amplitude, band_pass, detrend, velocity


def by_hand(y, dt):
    """Eq. (2) sample by sample, counted from 1 as in the paper, with the corrected ranges."""
    n, rate = len(y), []
    at = dict(enumerate(y, start=1))
    for i in range(1, n + 1):
        if 3 <= i <= n - 2:
            rate.append((-at[i + 2] + 8 * at[i + 1] - 8 * at[i - 1] + at[i - 2]) / (12 * dt))
        elif i <= 2:
            rate.append((-at[i + 2] + 4 * at[i + 1] - 3 * at[i]) / (2 * dt))
        else:
            rate.append((3 * at[i] - 4 * at[i - 1] + at[i - 2]) / (2 * dt))
    return np.array(rate)


@pytest.mark.parametrize("n", [5, 6, 7, 40])
def test_eq_2_matches_the_formula_written_out(n):
    y = np.random.default_rng(0).normal(size=n)
    np.testing.assert_allclose(velocity(y, 0.01), by_hand(y, 0.01), rtol=1e-12)


def test_orders_of_accuracy():
    t = np.linspace(0.0, 1.0, 21)
    step = t[1]
    quartic = velocity(t**4, step) - 4 * t**3
    assert np.max(np.abs(quartic[2:-2])) < 1e-12  # fourth order inside
    assert np.min(np.abs(quartic[[0, 1, -2, -1]])) > 1e-5  # second order at the ends
    np.testing.assert_allclose(velocity(t**2, step), 2 * t, atol=1e-12)


def test_interior_error_is_the_known_one():
    omega, step = 2 * np.pi, 0.02
    t = np.arange(200) * step
    ratio = velocity(np.sin(omega * t), step)[50] / (omega * np.cos(omega * t[50]))
    assert ratio - 1.0 == pytest.approx(-((omega * step) ** 4) / 30.0, rel=0.02)


def test_too_short_to_differentiate():
    with pytest.raises(ValueError, match="found 4"):
        velocity(np.zeros(4), 0.1)


def test_eq_3_of_a_sine_is_its_amplitude():
    t = np.arange(2000) / 500.0
    a = amplitude(0.3 * np.cos(2 * np.pi * 8 * t + 1), 1 / 500, 2 * np.pi * 8)
    np.testing.assert_allclose(a[2:-2], 0.3, rtol=1e-5)


def test_eq_3_needs_the_frequency_in_the_wind():
    t = np.arange(2000) / 500.0
    a = amplitude(np.cos(2 * np.pi * 8 * t), 1 / 500, 2 * np.pi * 7)
    assert np.ptp(a[2:-2]) == pytest.approx(8 / 7 - 1, rel=1e-2)


def test_noise_is_amplified_as_the_stencil_says_and_the_band_pass_takes_it_away():
    rng, f, fs = np.random.default_rng(1), 8.0, 500.0
    noise = 1e-3 * rng.normal(size=200_000)
    gain = np.std(velocity(noise, 1 / fs)) / (2 * np.pi * f) / 1e-3
    assert gain == pytest.approx(np.sqrt(130) / 12 * fs / (2 * np.pi * f), rel=0.02)
    t = np.arange(len(noise)) / fs
    y = 0.02 * np.cos(2 * np.pi * f * t) + noise
    raw = np.mean(amplitude(y, 1 / fs, 2 * np.pi * f)) / 0.02 - 1
    clean = np.mean(amplitude(band_pass(y, 1 / fs, 0.6 * f, 1.4 * f), 1 / fs, 2 * np.pi * f)) / 0.02 - 1
    assert raw == pytest.approx(0.06, abs=0.015)
    assert abs(clean) < 0.002


def test_detrend_takes_offset_and_drift_but_not_the_first_swings_of_a_decay():
    t = np.arange(4000) / 400.0
    decay = np.exp(-0.8 * t) * np.cos(2 * np.pi * 7.3 * t)
    np.testing.assert_allclose(detrend(t, decay + 3.0 - 0.2 * t, 7.3), decay, atol=5e-3)


def test_detrend_of_a_record_of_two_cycles_takes_the_mean():
    t = np.arange(100) / 400.0
    y = np.cos(2 * np.pi * 8 * t) + 1.0
    np.testing.assert_allclose(detrend(t, y, 8.0), y - y.mean())
