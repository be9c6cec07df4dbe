import numpy as np
import pytest
from scipy.signal import butter, lfilter, sosfilt

from scruton.envelope import cycles_from_envelope, demodulate, dominant_frequency
from scruton.envelope.windows import cut, fit_cycles
from scruton.errors import InputError

F = 8.0


def grid(cycles, per_cycle):
    return np.arange(int(cycles * per_cycle)) / (F * per_cycle)


def scatter(amplitude, cycles, per_cycle, replicates, seed=1, frequency=F, noise=None):
    """Errors of the amplitude over their standard errors, (replicates, cycles); noise of one standard deviation."""
    rng = np.random.default_rng(seed)
    t, rows = grid(cycles, per_cycle), []
    for _ in range(replicates):
        n = rng.normal(size=len(t)) if noise is None else noise(rng, len(t))
        found = demodulate(t, amplitude(t) * np.cos(2 * np.pi * F * t + rng.uniform(0, 6.3)) + n, frequency)
        rows.append((found.amplitude - amplitude(found.time)) / found.standard_error)
    shortest = min(map(len, rows))
    return np.array([row[:shortest] for row in rows])


def test_regression_of_each_cycle_matches_plain_least_squares():
    rng = np.random.default_rng(0)
    t = grid(12, 13.7)
    y = np.exp(-0.3 * t) * np.cos(50 * t) + 0.3 + 0.1 * rng.normal(size=len(t))
    windows = cut(t, F)
    rate = rng.normal(size=len(windows.number)) + 1j * rng.normal(size=len(windows.number))
    drift = rng.normal(size=len(windows.number))
    fit = fit_cycles(t, y, windows, rate=rate, drift=drift, harmonics=2)
    for k in range(len(windows.number)):
        part = slice(windows.first[k], windows.stop[k])
        tau = t[part] - windows.middle[k]
        wave = np.exp((rate[k] + 2j * np.pi * F) * tau)
        columns = [wave.real, -wave.imag, np.ones_like(tau), (wave**2).real, -(wave**2).imag]
        design = np.stack(columns, axis=1)
        coefficient, squares, *_ = np.linalg.lstsq(design, y[part] - drift[k] * tau, rcond=None)
        found = [fit.z[k].real, fit.z[k].imag, fit.offset[k], fit.second[k].real, fit.second[k].imag]
        np.testing.assert_allclose(found, coefficient, rtol=1e-8)
        assert fit.squares[k] == pytest.approx(squares[0], rel=1e-8)
        assert fit.cov_rr[k] == pytest.approx(np.linalg.inv(design.T @ design)[0, 0], rel=1e-8)


def test_windows_do_not_overlap_and_hold_one_cycle():
    t = grid(30, 9.3)
    windows = cut(t, F)
    assert np.all(windows.first[1:] == windows.stop[:-1])
    assert set(windows.stop - windows.first) <= {9, 10}
    np.testing.assert_allclose(np.diff(windows.middle), 1 / F)


@pytest.mark.parametrize("per_cycle", [50.0, 47.3, 13.7, 7.5])
@pytest.mark.parametrize("xi", [0.03, 0.01, -0.03, -0.003])
def test_amplitude_at_mid_cycle_of_fast_decay_and_growth(xi, per_cycle):
    t = grid(40, per_cycle)
    found = demodulate(t, np.exp(-xi * 2 * np.pi * F * t) * np.cos(2 * np.pi * F * t + 0.7))
    truth = np.exp(-xi * 2 * np.pi * F * found.time)
    assert np.max(np.abs(found.amplitude / truth - 1)) < 1e-3
    strong = truth > 0.05 * truth.max()
    np.testing.assert_allclose(found.frequency[strong], F, rtol=1e-4)


@pytest.mark.parametrize("per_cycle", [6.3, 9.1, 50.0])
def test_steady_motion_is_exact_whatever_the_sample_rate(per_cycle):
    t = grid(60, per_cycle)
    found = demodulate(t, 0.05 * np.cos(2 * np.pi * F * t + 1))
    np.testing.assert_allclose(found.amplitude, 0.05, rtol=1e-8)
    assert found.reference_frequency == pytest.approx(F, rel=1e-6)
    assert np.all(found.standard_error > 0)


@pytest.mark.parametrize("per_cycle", [50.0, 7.6])
@pytest.mark.parametrize("ratio", [1.0, 2.0, 3.0, 5.0, 10.0, 29.0])
def test_unbiased_where_noise_is_as_large_as_the_motion(ratio, per_cycle):
    error = np.sqrt(2 / per_cycle)
    z = scatter(lambda t: ratio * error + 0 * t, 400, per_cycle, 40)
    # the length of the complex amplitude would be too large by 0.5/ratio, 0.05 even at the tenth of these
    assert abs(z.mean()) < 0.06
    assert z.std() == pytest.approx(1.0, abs=0.05)
    assert abs(np.mean(z[:, 1:] * z[:, :-1])) < 0.03
    if ratio == 1.0:
        assert np.mean(z < -ratio) > 0.1  # negative estimates do occur


def test_the_length_of_the_complex_amplitude_would_fail_that_test():
    rng = np.random.default_rng(0)
    z = np.abs(2.0 + rng.normal(size=4000) + 1j * rng.normal(size=4000)) - 2.0
    assert z.mean() > 0.2


@pytest.mark.parametrize("xi", [0.006, 0.03])
def test_unbiased_when_a_decay_sinks_into_the_noise(xi):
    z = scatter(lambda t: 100 * np.exp(-xi * 2 * np.pi * F * t), 150, 50.0, 120, frequency=None)
    assert abs(z.mean()) < 0.03
    assert np.max(np.abs(z.mean(axis=0))) < 0.4  # no single cycle stands out: sd 0.09 each, 150 of them
    assert z.std() == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("kind", ["ar", "walk", "low-pass"])
def test_standard_error_under_coloured_noise(kind):
    low_pass = butter(4, 60, fs=400, output="sos")

    def noise(rng, n):
        white = rng.normal(size=n)
        if kind == "ar":
            return lfilter([0.44], [1, -0.9], white)
        return 0.05 * np.cumsum(white) if kind == "walk" else sosfilt(low_pass, white)

    z = scatter(lambda t: 20 * (0.2 + np.exp(-0.2 * t)), 200, 50.0, 20, frequency=None, noise=noise)
    assert 0.8 < z.std() < 1.2
    assert abs(z.mean()) < 0.15


@pytest.mark.parametrize("quantum", [0.002, 0.01, 0.05, 0.2])
def test_standard_error_of_a_rounded_record(quantum):
    rng, rows = np.random.default_rng(5), []
    for _ in range(25):
        t = grid(200, 50.7)
        y = np.exp(-t / 6) * np.cos(2 * np.pi * F * t + rng.uniform(0, 6)) / quantum + rng.uniform(0, 1)
        found = demodulate(t, np.round(y) * quantum)
        rows.append((found.amplitude - np.exp(-found.time / 6)) / found.standard_error)
    assert 0.7 < np.std(np.concatenate(rows)) < 1.3


def test_offset_drift_and_second_harmonic_leave_the_amplitude_alone():
    t = grid(60, 47.3)
    other = 5 + 0.07 * t + 0.05 * np.cos(4 * np.pi * F * t + 1)
    found = demodulate(t, np.cos(2 * np.pi * F * t) + other)
    np.testing.assert_allclose(found.amplitude, 1.0, rtol=1e-4)


@pytest.mark.parametrize("reference", [None, 8.24])
def test_frequency_that_varies_costs_no_amplitude(reference):
    t = grid(100, 47.3)
    turn = 2 * np.pi * F * (t + 0.05 * (t - t * t / 25))  # 8.4 Hz to 8.0 Hz
    found = demodulate(t, np.exp(-0.5 * t) * np.cos(turn), reference)
    np.testing.assert_allclose(found.amplitude, np.exp(-0.5 * found.time), rtol=1e-3)
    local = F * (1.05 - 0.1 * found.time / 25)
    np.testing.assert_allclose(found.frequency[3:-3], local[3:-3], rtol=1e-3)


def test_frequency_error_matches_its_scatter():
    rng, t, rows = np.random.default_rng(8), grid(100, 40), []
    for _ in range(40):
        found = demodulate(t, np.cos(2 * np.pi * F * t) + 0.1 * rng.normal(size=len(t)), F)
        rows.append((found.frequency - F) / found.frequency_error)
    assert np.std(rows) == pytest.approx(1.0, abs=0.1)


def test_unequal_steps_and_gaps():
    rng = np.random.default_rng(3)
    t = grid(100, 40) + rng.uniform(-0.3, 0.3, 4000) / (40 * F)
    t = t[((t < 3.0) | (t > 4.2)) & ((t < 8.0) | (t > 8.1))]
    found = demodulate(t, np.exp(-0.2 * t) * np.cos(2 * np.pi * F * t) + 1e-3 * rng.normal(size=len(t)))
    z = (found.amplitude - np.exp(-0.2 * found.time)) / found.standard_error
    assert np.std(z) == pytest.approx(1.0, abs=0.2)
    assert abs(np.mean(z)) < 0.3
    steps = np.diff(found.time) * found.reference_frequency
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    short, long = sorted(np.round(steps).astype(int))[-2:]
    assert short in (2, 3)
    assert long in (11, 12)
    np.testing.assert_allclose(np.delete(steps, np.argsort(steps)[-2:]), 1.0, atol=1e-6)
    assert np.all((found.time < 3.0) | (found.time > 4.2))


def test_dominant_frequency_ignores_stronger_drift_and_white_noise():
    t = grid(300, 50)
    y = np.exp(-0.1 * t) * np.cos(2 * np.pi * F * t)
    assert dominant_frequency(t, y + 3 * t) == pytest.approx(F, rel=1e-3)
    for seed in range(20):
        noise = np.random.default_rng(seed).normal(size=len(t))
        assert dominant_frequency(t, y + 0.03 * np.cumsum(noise)) == pytest.approx(F, rel=2e-3)
        assert dominant_frequency(t, y + noise) == pytest.approx(F, rel=2e-3)


@pytest.mark.parametrize("xi", [0.0, 0.01, 0.03])
@pytest.mark.parametrize("cycles", [6, 8, 12])
def test_dominant_frequency_of_a_short_record(cycles, xi):
    t = grid(cycles, 50)
    for phase in np.linspace(0, 6, 7):
        y = np.exp(-xi * 2 * np.pi * F * t) * np.cos(2 * np.pi * F * t + phase)
        assert dominant_frequency(t, y) == pytest.approx(F, rel=0.05)


def test_shift_of_time_and_scale_of_response_change_nothing():
    rng, t = np.random.default_rng(6), grid(80, 31.4)
    y = np.exp(-0.3 * t) * np.cos(2 * np.pi * F * t) + 0.01 * rng.normal(size=len(t))
    one, two = demodulate(t, y), demodulate(t + 1000.0, 1e-4 * y)
    np.testing.assert_allclose(two.amplitude, 1e-4 * one.amplitude, rtol=1e-4, atol=1e-8)
    np.testing.assert_allclose(two.standard_error, 1e-4 * one.standard_error, rtol=1e-4)


def test_a_million_samples():
    rng, t = np.random.default_rng(7), np.arange(1_000_000) / 500.0
    y = np.cos(2 * np.pi * F * t) + 0.02 * rng.normal(size=len(t))
    found = demodulate(t, y)
    assert len(found.time) == pytest.approx(16_000, abs=2)


@pytest.mark.parametrize(
    ("t", "y", "frequency", "message"),
    [
        (grid(60, 50), np.ones(3000), None, "found a constant signal"),
        (grid(60, 50), np.random.default_rng(0).normal(size=3000), None, "wanted a record that oscillates"),
        (grid(60, 50), np.random.default_rng(0).normal(size=3000), F, "no oscillation that stands out"),
        (grid(60, 50), np.exp(-grid(60, 50)), None, "wanted a record that oscillates"),
        (grid(60, 50), np.cumsum(np.random.default_rng(0).normal(size=3000)), None, "wanted a record that oscillates"),
        (grid(4, 50), np.cos(50 * grid(4, 50)), F, "found [34] whole cycles"),
        (grid(60, 5), np.cos(50 * grid(60, 5)), F, "found 5.0 samples per cycle"),
        (np.arange(1.0), np.ones(1), None, "found 1 samples"),
        (grid(60, 50)[::-1], np.cos(grid(60, 50)), None, "wanted strictly increasing time"),
        (grid(60, 50), np.full(3000, np.nan), None, "not finite"),
        (grid(60, 50), np.cos(50 * grid(60, 50)), -1.0, "wanted a positive frequency"),
    ],
)
def test_unusable_records_say_why(t, y, frequency, message):
    with pytest.raises(InputError, match=f"r.csv.*{message}"):
        demodulate(t, y, frequency, name="r.csv")


def test_envelope_from_elsewhere():
    rng = np.random.default_rng(9)
    t = np.arange(5000) / 100.0
    truth = 0.06 + 0.1 * np.exp(-0.2 * t)
    found = cycles_from_envelope(t, truth + 1e-3 * rng.normal(size=len(t)), 4.0)
    error = found.amplitude - (0.06 + 0.1 * np.exp(-0.2 * found.time))
    assert len(found.time) == 198
    assert found.standard_error[0] == pytest.approx(1e-3 / 5, rel=0.25)
    assert np.std(error) == pytest.approx(1e-3 / 5, rel=0.2)
    assert np.all(np.isinf(found.frequency_error))


@pytest.mark.parametrize("per_cycle", [2.0, 2.056, 2.9])
def test_an_envelope_of_crests_and_troughs_has_no_steps_where_a_cycle_holds_three(per_cycle):
    """An offset lifts crests and lowers troughs: the mean of three of them was off by a third of it, and a knock."""
    f, t = 5.12, np.arange(400) / (5.12 * per_cycle)
    truth = 0.06 + 0.1 * np.exp(-0.2 * t)
    found = cycles_from_envelope(t, truth + 3e-3 * np.cos(2.0 * np.pi * f * t), f)
    error = found.amplitude - (0.06 + 0.1 * np.exp(-0.2 * found.time))
    assert len(found.time) == pytest.approx(400 / per_cycle - 2, abs=1.01)
    assert np.abs(error).max() < (2e-5 if per_cycle == 2.0 else 4e-4)


@pytest.mark.parametrize("rounded", [0, 1, 2])
def test_the_ends_that_a_filter_has_rounded_are_left_out(rounded):
    rng = np.random.default_rng(4)
    t = np.arange(120) * 0.1 + 0.05
    a = np.exp(-0.1 * t) + 3e-4 * rng.normal(size=t.size)
    a[: 2 * rounded] = a[2 * rounded]  # it stands, and falls later
    a[t.size - 2 * rounded :] *= 1.05
    found = cycles_from_envelope(t, a, 5.0)
    left = max(rounded, 1)
    assert len(found.time) == 60 - 2 * left
    assert found.time[0] == pytest.approx(0.1 + 0.2 * left)


def test_a_growth_and_a_short_envelope_keep_what_follows_their_ends():
    t = np.arange(40) * 0.1
    for a in (1e-3 * np.exp(2.0 * t), 1.0 - np.exp(-0.8 * t - 0.05)):
        assert len(cycles_from_envelope(t, a + 1e-4 * np.sin(17.0 * t), 5.0).time) == 18
    assert len(cycles_from_envelope(t[:12], np.r_[5.0, np.ones(11)], 5.0).time) == 6


def test_cycles_of_an_envelope_without_samples_are_left_out():
    t = np.arange(200) * 0.1
    t = t[(t < 5.0) | (t > 9.0)]
    found = cycles_from_envelope(t, np.exp(-0.1 * t), 2.0)
    assert not np.any((found.time > 5.3) & (found.time < 8.7))
    assert found.amplitude == pytest.approx(np.exp(-0.1 * found.time), rel=1e-2)


def test_peaks_coarser_than_a_cycle_stay_as_they_are():
    t = np.arange(40) * 0.5
    found = cycles_from_envelope(t, np.exp(-0.3 * t), 4.0)
    np.testing.assert_array_equal(found.time, t)
    assert np.all(found.standard_error > 0)
    # a fast decay is no noise
    assert found.standard_error[0] < 1e-6


def test_envelope_too_short():
    with pytest.raises(InputError, match="wanted an envelope of at least five cycles"):
        cycles_from_envelope(np.arange(100) / 100, np.ones(100), 2.0)
    with pytest.raises(InputError, match="found 0 cycles"):
        cycles_from_envelope(np.arange(100) / 1000, np.ones(100), 2.0)
    assert len(cycles_from_envelope(np.arange(100) / 20, np.r_[np.zeros(90), np.ones(10)], 5.0).time) == 23, (
        "no warning"
    )


@pytest.mark.parametrize("per_cycle", [17.3, 25.4])
def test_the_harmonics_of_a_bent_wave_do_not_leak_into_its_amplitude(per_cycle):
    """Cycles of a whole number of samples are none of the motion: a third harmonic beat by 0.4 % of the amplitude."""
    time = np.arange(int(80 * per_cycle)) / (5.0 * per_cycle)
    wave = np.clip(np.cos(2.0 * np.pi * 5.0 * time + 0.4), -0.7, 0.7)
    noise = 1e-4 * np.random.default_rng(3).standard_normal(time.size)
    amplitude = demodulate(time, wave + noise, 5.0).amplitude[1:-1]
    assert amplitude.std() < 2e-3
    assert amplitude.mean() == pytest.approx(2.0 * np.mean(wave * np.cos(2.0 * np.pi * 5.0 * time + 0.4)), abs=2e-3)
