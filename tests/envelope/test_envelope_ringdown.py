import numpy as np
import pytest

from scruton.envelope import Cycles, cycles_from_envelope, demodulate, ring_down
from scruton.errors import InputError

F0, XI = 8.0, 0.004
OMEGA = 2 * np.pi * F0


def pluck(rng, amplitude, seconds=20.0, fs=400.0, noise=1e-3, frequency=F0):
    t = np.arange(int(seconds * fs)) / fs
    y = amplitude(t) * np.cos(2 * np.pi * frequency * t + rng.uniform(0, 6)) + noise * rng.normal(size=len(t))
    return demodulate(t, y)


def integrate(damping, first, seconds=20.0):
    """Amplitude under xi(A), by small steps."""
    t = np.linspace(0, seconds, 40_000)
    a = np.empty(len(t))
    a[0] = first
    for i in range(1, len(t)):
        middle = a[i - 1] * (1 - 0.5 * OMEGA * damping(a[i - 1]) * t[1])
        a[i] = a[i - 1] - OMEGA * damping(middle) * middle * t[1]
    return lambda x: np.interp(x, t, a)


def test_constant_damping_and_frequency_with_honest_errors():
    rng, z = np.random.default_rng(0), []
    for _ in range(60):
        found = ring_down([pluck(rng, lambda t: np.exp(-XI * OMEGA * t), noise=0.02)])
        z.append([(found.damping_ratio - XI) / found.damping_ratio_sd, (found.frequency - F0) / found.frequency_sd])
    z = np.array(z)
    assert np.all(np.abs(z.mean(axis=0)) < 0.45)
    assert np.all((z.std(axis=0) > 0.6) & (z.std(axis=0) < 1.35))


def test_several_plucks_that_differ_are_believed_over_their_regressions():
    rng = np.random.default_rng(1)
    found = ring_down([pluck(rng, lambda t, x=x: np.exp(-x * OMEGA * t)) for x in (0.0038, 0.0040, 0.0045)])
    assert found.damping_ratio == pytest.approx(0.0041, rel=0.01)
    assert found.damping_ratio_sd == pytest.approx(np.std([0.0038, 0.0040, 0.0045], ddof=1) / np.sqrt(3), rel=0.1)
    assert all(band.plucks <= 3 for band in found.bands)


@pytest.mark.parametrize(
    "law",
    [lambda a: 0.002 + 0.01 * a, lambda a: 0.003 + 0.0004 / (a + 0.05), lambda a: 0.005 - 0.002 * np.sqrt(a)],
    ids=["quadratic drag", "dry friction", "square root"],
)
def test_damping_against_amplitude(law):
    rng = np.random.default_rng(2)
    envelope = integrate(law, 1.0)
    found = ring_down([pluck(rng, envelope) for _ in range(3)])
    a = np.geomspace(0.05, 0.9, 20)
    np.testing.assert_allclose(found.structural_damping(a), law(a), rtol=0.06)
    for band in found.bands:
        if band.plucks == 3 and band.lower > 0.03:
            middle = np.sqrt(band.lower * band.upper)
            assert band.damping_ratio == pytest.approx(law(middle), rel=0.08)
            assert band.upper == pytest.approx(2 * band.lower)


def test_the_curve_is_constant_beyond_its_ends():
    found = ring_down([pluck(np.random.default_rng(4), lambda t: np.exp(-XI * OMEGA * t))])
    ends = found.structural_damping(np.array([0.0, 1e-9, 100.0]))
    np.testing.assert_allclose(ends, found.curve_damping_ratio[[0, 0, -1]])


@pytest.mark.parametrize("jump", [0.25, -0.2])
def test_release_is_left_out(jump):
    rng = np.random.default_rng(5)

    def amplitude(t):
        return np.exp(-XI * OMEGA * t) * (1 + jump * (t < 1.5 / F0))

    found = ring_down([pluck(rng, amplitude)])
    assert found.damping_ratio == pytest.approx(XI, rel=0.005)
    assert found.bands[0].upper < 1.05


def test_the_noise_after_the_decay_is_left_out():
    found = ring_down([pluck(np.random.default_rng(6), lambda t: np.exp(-0.03 * OMEGA * t), seconds=30, noise=0.02)])
    assert found.damping_ratio == pytest.approx(0.03, rel=0.02)


def test_bands_at_stated_edges():
    found = ring_down(
        [pluck(np.random.default_rng(7), lambda t: np.exp(-XI * OMEGA * t))], edges=np.array([0.2, 0.4, 0.8])
    )
    assert [(b.lower, b.upper) for b in found.bands] == [(0.4, 0.8), (0.2, 0.4)]


def test_envelope_from_elsewhere():
    t = np.arange(8000) / 400.0
    found = ring_down([cycles_from_envelope(t, np.exp(-XI * OMEGA * t), F0)])
    assert found.damping_ratio == pytest.approx(XI, rel=1e-6)
    assert found.frequency == F0
    assert np.isinf(found.frequency_sd)


def test_nothing_above_the_noise():
    n = np.ones(10)
    flat = Cycles(np.arange(10.0), 0.1 * n, n, n, n, n, 1.0, 1.0)
    with pytest.raises(InputError, match="rig A: found no ring-down"):
        ring_down([flat], name="rig A")
