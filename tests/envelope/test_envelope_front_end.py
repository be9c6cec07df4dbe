import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from scruton.campaign.schema import Kind, Record
from scruton.envelope import front_end
from scruton.envelope.damping import aerodynamic_damping, griffin_curve, total_damping
from scruton.errors import InputError

F, F0, XI, FACTOR = 7.9, 8.0, 0.002, 3600.0
SETTING = {"frequency": F, "still_air_frequency": F0, "damping_ratio": XI, "mass_damping_factor": FACTOR}


def of(time, response, **options):
    return Record("r.csv", Path("r.csv"), Kind.DECAY, time, response, **options)


def transient(stable=0.06, first=0.18, rate=0.35, seconds=16.0, fs=400.0, noise=0.0, seed=0):
    """The paper's law, n = -1: amplitude relaxes to `stable` as one exponential."""
    t = 2.0 + np.arange(int(seconds * fs)) / fs
    a = stable + (first - stable) * np.exp(-rate * (t - t[0]))
    y = a * np.cos(2 * np.pi * F * t + 0.4)
    return t, y + noise * np.random.default_rng(seed).normal(size=len(t)), a


@pytest.mark.parametrize("first", [0.18, 0.01])
def test_recovers_the_griffin_line_of_the_law(first):
    t, y, _ = transient(first=first, noise=1e-4)
    found = front_end(of(t, y), **SETTING)
    # da/dt = -rate (a - stable): xi_s that makes `a` stable, in closed form
    a = found.griffin.amplitude
    xi_s = XI + 0.35 * (a - 0.06) / a * -1 / (2 * np.pi * F0)
    seen = a > 0.03
    np.testing.assert_allclose(found.griffin.scruton_number[seen], FACTOR * xi_s[seen], atol=0.02 * FACTOR * XI)
    assert found.griffin.scruton_number.min() < 0 or first < 0.06


def test_sign_and_frequency_ratio_of_step_8():
    curve = griffin_curve(np.array([-0.01, 0.004]), np.array([0.02, 0.09]), 1000.0, 2 * np.pi * 7.5, 2 * np.pi * 8)
    np.testing.assert_allclose(curve.scruton_number, [9.375, -3.75])


def test_stable_amplitude_maps_on_its_own_scruton_number():
    # at zero total damping Eqs. (6) and (8) must return the rig's xi_s, whatever omega/omega0
    aero = aerodynamic_damping(np.array([0.0]), np.array([0.06]), XI, 2 * np.pi * F, 2 * np.pi * F0)
    curve = griffin_curve(aero, np.array([0.06]), FACTOR, 2 * np.pi * F, 2 * np.pi * F0)
    assert curve.scruton_number[0] == pytest.approx(FACTOR * XI, rel=1e-12)


def test_structural_damping_may_vary_with_amplitude():
    total, a = np.array([0.001, -0.002]), np.array([0.1, 0.02])
    aero = aerodynamic_damping(total, a, lambda a: 0.002 + 0.01 * a, 10.0, 11.0)
    np.testing.assert_allclose(aero, total - np.array([0.003, 0.0022]) * 1.1)


def test_damping_is_undefined_where_a_polynomial_crosses_zero():
    assert np.isnan(total_damping(np.array([-0.1, 0.1]), np.array([0.1, 0.1]), 1.0)).tolist() == [True, False]


def test_envelope_enters_as_it_is():
    t, _, a = transient()
    found = front_end(of(t, a, is_envelope=True), **SETTING)
    np.testing.assert_allclose(found.smooth_amplitude, a, rtol=1e-6)
    assert found.residual_sd < 1e-7


def test_slightly_unequal_steps_and_a_gap():
    t, _, _ = transient()
    rng = np.random.default_rng(2)
    t = t + rng.uniform(-0.2, 0.2, len(t)) / 400
    t = t[(t < 7.0) | (t > 8.3)]
    a = 0.06 + 0.12 * np.exp(-0.35 * (t - 2.0))
    found = front_end(of(t, a * np.cos(2 * np.pi * F * t)), **SETTING)
    seen = (found.time > 2.1) & (found.time < 17.9)
    truth = 0.06 + 0.12 * np.exp(-0.35 * (found.time - 2.0))
    np.testing.assert_allclose(found.smooth_amplitude[seen], truth[seen], rtol=0.01)
    assert not np.any((found.time > 7.0) & (found.time < 8.3))


def test_trial_functions_by_name():
    t, y, a = transient(noise=1e-4)
    for name in ("polynomial", "cubic spline"):
        found = front_end(of(t, y), trial=name, **SETTING)
        np.testing.assert_allclose(found.smooth_amplitude[50:-50], a[50:-50], rtol=0.03)


def test_a_long_record_is_thinned_but_fitted_whole():
    t, y, _ = transient(seconds=200.0, noise=1e-3, rate=0.03)
    found = front_end(of(t, y), **SETTING)
    assert len(found.time) <= 20_000
    assert found.trial.constants["d"] == pytest.approx(-0.03, rel=0.03)
    again = front_end(of(t, y), **SETTING)
    np.testing.assert_array_equal(found.griffin.scruton_number, again.griffin.scruton_number)


def test_too_short():
    with pytest.raises(InputError, match=r"r\.csv: found 10 samples over .* wanted a record of at least 16"):
        front_end(of(np.arange(10.0), np.ones(10)), **SETTING)


def test_memory_of_a_million_samples():
    t, y, _ = transient(seconds=2500.0, noise=1e-3, rate=0.002)
    assert len(t) == 1_000_000
    front_end(of(t, y), **SETTING)  # imports outside the measurement
    tracemalloc.start()
    front_end(of(t, y), **SETTING)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 4 * (t.nbytes + y.nbytes)  # the record itself is the fifth
