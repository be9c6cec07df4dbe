"""Errors of records that were filtered to a band or integrated, and which line is followed beside strong hum."""

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from scruton.campaign.signal import band_limited
from scruton.envelope import demodulate, dominant_frequency
from scruton.envelope.amplitude import amplitude as transient_amplitude
from scruton.envelope.band import line_noise
from scruton.envelope.transient import front_end_cycles

F, RATE, BAND = 23.3, 1000.0, (15.0, 35.0)
TIME = np.arange(12000) / RATE


def amplitude(time: np.ndarray) -> np.ndarray:
    return 0.02 + 0.04 * np.exp(-0.3 * time)


def reading(rng: np.random.Generator, hum: float, noise: float, order: int = 0) -> np.ndarray:
    """What a sensor reads: a decay, three lines of mains hum that wander, white noise; sizes over the motion's."""
    omega = 2 * np.pi * F
    y = amplitude(TIME) * np.cos(omega * TIME + rng.uniform(0, 6.3))
    lines = sum(
        np.cos(2 * np.pi * f * TIME + np.cumsum(rng.normal(0, 0.03, TIME.size)) + rng.uniform(0, 6.3))
        for f in rng.uniform(126, 138, 3)
    )
    scale = 0.02 * (omega**order if order else 1.0)
    return (-(omega**2) * y if order else y) + scale * (hum * lines + noise * rng.normal(size=TIME.size))


def errors(cycles) -> tuple[float, float]:
    """Root mean square of errors over stated standard errors: of a cycle, and of means of sixteen."""
    error, stated = cycles.amplitude - amplitude(cycles.time), cycles.standard_error
    whole = len(error) // 16 * 16
    mean = error[:whole].reshape(-1, 16).mean(1)
    of_mean = np.sqrt((stated[:whole] ** 2).reshape(-1, 16).sum(1)) / 16
    return float(np.sqrt(np.mean((error / stated) ** 2))), float(np.sqrt(np.mean((mean / of_mean) ** 2)))


@pytest.mark.parametrize("demodulation", [demodulate, front_end_cycles])
@pytest.mark.parametrize("order", [0, 2])
@pytest.mark.parametrize(("hum", "noise"), [(0.0, 0.1), (1.0, 0.1), (2.0, 0.3)])
def test_standard_errors_are_right_in_a_band(hum, noise, order, demodulation):
    """Twelve records: the error of one cycle within a third, that of a mean of sixteen within a sixth."""
    found = []
    for seed in range(12):
        signal = reading(np.random.default_rng(seed), hum, noise, order)
        time, response = band_limited(TIME, signal, BAND, order)
        found.append(errors(demodulation(time, response, near=23.0, band=BAND)))
    one, sixteen = np.sqrt(np.mean(np.square(found), axis=0))
    assert 0.8 < one < 1.35
    assert 0.85 < sixteen < 1.17


def test_filtered_by_hand_they_are_not():
    """What the band is for: of a record filtered beforehand the residual shows a fourth of the error."""
    found = []
    for seed in range(4):
        signal = reading(np.random.default_rng(seed), 1.0, 0.1)
        by_hand = sosfiltfilt(butter(2, BAND, btype="band", fs=RATE, output="sos"), signal)
        found.append(errors(demodulate(TIME, by_hand, near=23.0)))
    assert np.min(found) > 3.0


@pytest.mark.parametrize("order", [0, 2])
def test_noise_at_the_line(order):
    """White noise of the sensor is found again to a tenth, at the line, beside a motion fifty times as large."""
    found = []
    for seed in range(8):
        signal = reading(np.random.default_rng(seed), 0.0, 0.02, order)
        time, response = band_limited(TIME, signal, BAND, order)
        found.append(line_noise(time, response, BAND, F))
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(0.02 * 0.02, rel=0.1)


def test_motion_that_turbulence_shakes_is_no_noise():
    """Its skirts would be taken for six times the noise; they are told apart, to a third."""
    found = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        steps = 0.0006 * (rng.normal(size=TIME.size) + 1j * rng.normal(size=TIME.size)) / np.sqrt(RATE)
        shaken = np.cumsum(steps) * np.exp(2j * np.pi * F * TIME)
        _, response = band_limited(TIME, reading(rng, 0.0, 0.005) + shaken.real, BAND)
        found.append(line_noise(TIME, response, BAND, F))
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(0.005 * 0.02, rel=0.33)


def test_the_rigs_frequency_says_which_line_is_followed():
    """Hum of six times the motion is the highest line; a frequency that is stated finds the motion beside it."""
    signal = reading(np.random.default_rng(0), 4.0, 0.1)
    assert dominant_frequency(TIME, signal) > 120.0
    assert dominant_frequency(TIME, signal, 23.0) == pytest.approx(F, rel=0.002)
    # where the stated frequency has no line, or next to none, the record speaks for itself
    assert dominant_frequency(TIME, signal, 60.0) > 120.0
    assert dominant_frequency(TIME, reading(np.random.default_rng(0), 400.0, 0.1), 23.0) > 120.0


def test_the_papers_amplitude_with_hum():
    """Eq. (3) takes hum by its velocity, five times the motion's: a tenth of the motion makes it a tenth too large."""
    omega, high = 2 * np.pi * F, []
    for seed in range(3):
        signal = reading(np.random.default_rng(seed), 0.1, 0.01)
        _, filtered = band_limited(TIME, signal, BAND)
        last = TIME > 10.0
        true = np.mean(amplitude(TIME[last]))
        high.append([np.mean(transient_amplitude(y, 1 / RATE, omega)[last]) / true - 1 for y in (signal, filtered)])
    raw, banded = np.mean(high, axis=0)
    assert 0.08 < raw < 0.15
    assert abs(banded) < 0.002
