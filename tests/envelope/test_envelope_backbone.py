"""The frequency of a rig at one amplitude, and once it hardly moves."""

import numpy as np
import pytest

from scruton.envelope import Cycles
from scruton.envelope.backbone import backbone, bends_from


def track(amplitude, bend=0.0, off=0.0, error=0.01, seed=0):
    """A record of 8 Hz whose frequency falls by `bend` at an amplitude of 0.1."""
    f = 8.0 * (1.0 + off) * (1.0 - bend * (amplitude / 0.1) ** 2)
    errors = np.full_like(f, error)
    f = f + error * np.random.default_rng(seed).standard_normal(f.size)
    errors[::10] = np.nan  # a cycle that turns no phase
    t = np.arange(f.size) / 8.0
    return Cycles(t, amplitude, errors, t, f, errors, float(np.median(f)), 0.01)


STILL = np.geomspace(0.12, 0.01, 120)
GROWTH, DECAY = np.geomspace(0.005, 0.06, 80), 0.06 + 0.05 * np.exp(-np.arange(80) / 20.0)


@pytest.mark.parametrize("bend", [0.0, 0.03, -0.1])
@pytest.mark.parametrize("off", [0.0, 0.02])
def test_a_bend_is_no_shift(bend, off):
    tracks = track(STILL, bend), track(GROWTH, bend, off, seed=1), track(DECAY, bend, off, seed=2)
    curve = backbone(tracks)
    assert abs(curve.at_rest - 8.0) < 4.0 * curve.at_rest_sd < 0.1
    assert np.all(np.abs(curve.apart - off) < 4.0 * curve.apart_sd + abs(bend * off))  # the bend is shifted, too
    assert curve.apart_sd.max() < 0.002


def test_standard_errors_are_those_of_the_scatter():
    """Frequencies that wander in the wind by more than a cycle tells, which is four times as much here."""
    found = [backbone([track(STILL, 0.05, error=0.04, seed=seed)]) for seed in range(200)]
    told = [backbone([track(STILL, 0.05, error=0.01, seed=seed)]) for seed in range(200)]
    scatter = np.std([curve.at_rest for curve in found])
    assert np.median([curve.at_rest_sd for curve in found]) == pytest.approx(scatter, rel=0.2)
    assert np.std([curve.at_rest for curve in told]) == pytest.approx(scatter / 4.0, rel=0.2)


@pytest.mark.parametrize(
    ("bend", "off", "error", "known"),
    [(0.08, 0.0, 0.01, True), (0.08, 0.0, 3.0, False), (0.0, 0.08, 0.01, False), (0.08, 0.08, 0.01, False)],
    ids=["bends", "not known", "off", "bends and off"],
)
def test_a_spring_that_bends_is_told_from_a_frequency_that_is_off(bend, off, error, known):
    assert bends_from(track(STILL, bend, off, error), 8.0, 0.02) is known


def test_too_few_cycles_and_one_amplitude_are_no_curve():
    assert backbone([track(STILL[:4])]) is None
    assert backbone([track(STILL), track(GROWTH[:4])]) is None
    assert backbone([track(np.full(50, 0.05))]) is None
    assert backbone([track(STILL, error=0.0)]) is None
    assert not bends_from(track(STILL[:4]), 8.0, 1.0)
