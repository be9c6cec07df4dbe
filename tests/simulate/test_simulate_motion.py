"""The equation of motion against a tight integration, and what turbulence does to it."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from scruton.campaign.schema import Motion
from scruton.dynamics import closed_form
from scruton.envelope import demodulate
from scruton.simulate import Noise, Truth, simulate_record

HEAVE = Truth(Motion.HEAVING, 0.3, 0.075, 7.292, 7.87, 0.0065, 1.22, 5.036, -11.111, 0.03235)
TWIST = Truth(Motion.TORSIONAL, 1.08, 0.0908, 2.110, 3.162, 0.00096, 1.228, 3.4, -0.02, 0.04)
DUFFING_FREE = Truth(Motion.HEAVING, 0.3, 0.075, 7.292, 7.87, 0.0065, 1.22, 5.036, 25.0, 1500.0, force="ehsan-scanlan")


def reference(truth, x0, v0, t):
    """LSODA-grade integration from one zero of the velocity to the next."""
    w0 = 2 * np.pi * truth.frequency

    def rhs(side):
        def f(_, s):
            if truth.force == "paper":
                drive = truth.Y1 * (truth.passage * s[1] - truth.epsilon * side)
            else:
                drive = truth.Y1 * (1 - truth.epsilon * s[0] ** 2) * truth.passage * s[1]
            return [
                s[1],
                -2 * truth.damping_ratio * w0 * s[1] - w0**2 * s[0] + truth.pressure * (drive + truth.Y2 * s[0]),
            ]

        return f

    out, now, state = np.empty_like(t), 0.0, [x0, v0]
    out[0] = x0
    while now < t[-1] - 1e-12:
        side = np.sign(state[1]) if abs(state[1]) > 1e-12 else -np.sign(state[0])

        def zero(_, s):
            return s[1]

        zero.terminal, zero.direction = True, -side
        run = solve_ivp(rhs(side), (now, t[-1]), state, events=zero, rtol=1e-10, atol=1e-14, dense_output=True)
        inside = (t >= now) & (t <= run.t[-1])
        out[inside] = run.sol(t[inside])[0]
        now, state = run.t[-1], [run.y[0, -1], 0.0 if run.t_events[0].size else run.y[1, -1]]
    return out


@pytest.mark.parametrize("truth", [HEAVE, TWIST, DUFFING_FREE], ids=["heaving", "torsional", "ehsan-scanlan"])
def test_against_a_tight_integration(truth):
    t, y = simulate_record(truth, initial_amplitude=0.05, duration=3.0, sample_rate=300.0, seed=5)
    phase = np.random.default_rng(5).uniform(0, 2 * np.pi)
    want = reference(truth, 0.05 * np.cos(phase), -0.05 * truth.omega * np.sin(phase), t)
    np.testing.assert_allclose(y, want, atol=2e-6)


@pytest.mark.parametrize("truth", [HEAVE, TWIST])
def test_stable_amplitude_is_that_of_the_energy_balance(truth):
    stable, rate = truth.balance()
    t, y = simulate_record(truth, initial_amplitude=stable, duration=10 / rate, sample_rate=200.0, seed=1)
    tail = demodulate(t, y).amplitude[-20:]
    assert tail.mean() == pytest.approx(stable, rel=2e-3)


@pytest.mark.parametrize("exponent", [0.0, 0.5, 1.0, 2.0])
def test_a_power_of_the_velocity_is_the_law_of_its_exponent(exponent):
    """Growth and decay end at the stable amplitude, by the closed form of the law on the way."""
    stable, rate = 0.031, 1.4
    truth = HEAVE.power_law(stable, rate, exponent)
    assert truth.balance() == pytest.approx((stable, rate))
    for start in (0.3, 2.2):
        t, y = simulate_record(
            truth, initial_amplitude=start * stable, duration=6.0 / rate, sample_rate=50.0 * truth.frequency, seed=3
        )
        want = closed_form(t, start * stable, stable, rate, exponent)
        # On the way the averaged equation is good to the first order in lambda/omega, here 3 %.
        for cycles, within in ((slice(200, 250), 0.02), (slice(-250, None), 0.005)):
            amplitude = np.sqrt(2.0 * np.mean(y[cycles] ** 2))
            assert amplitude == pytest.approx(np.sqrt(np.mean(want[cycles] ** 2)), rel=within)


def test_decay_relaxes_at_the_rate_of_the_energy_balance():
    stable, rate = HEAVE.balance()
    t, y = simulate_record(HEAVE, initial_amplitude=2 * stable, duration=4 / rate, sample_rate=200.0, seed=1)
    cycles = demodulate(t, y)
    deviation = cycles.amplitude - stable
    early = deviation > 0.1 * stable
    slope = np.polyfit(cycles.time[early], np.log(deviation[early]), 1)[0]
    assert -slope == pytest.approx(rate, rel=0.02)


def test_still_air_is_a_free_decay():
    still = Truth(Motion.HEAVING, 0.3, 0.075, 7.292, 7.87, 0.0065)
    t, y = simulate_record(still, initial_amplitude=0.05, duration=10.0, sample_rate=250.0, seed=2, noise=Noise(0.05))
    phase = np.random.default_rng(2).uniform(0, 2 * np.pi)
    w0, xi = 2 * np.pi * 7.87, 0.0065
    wd, x0, v0 = w0 * np.sqrt(1 - xi**2), 0.05 * np.cos(phase), -0.05 * w0 * np.sin(phase)
    want = np.exp(-xi * w0 * t) * (x0 * np.cos(wd * t) + (v0 + xi * w0 * x0) / wd * np.sin(wd * t))
    np.testing.assert_allclose(y, want, atol=1e-6)


@pytest.mark.parametrize("scatter", [0.01, 0.03])
def test_turbulence_makes_the_scatter_that_is_asked_for(scatter):
    stable, rate = HEAVE.balance()
    t, y = simulate_record(
        HEAVE, initial_amplitude=stable, duration=1200 / rate, sample_rate=100.0, seed=3, noise=Noise(scatter)
    )
    amplitude = demodulate(t, y).amplitude
    assert amplitude.std() / stable == pytest.approx(scatter, rel=0.12)


def test_one_seed_one_record_and_noise_as_asked():
    arguments = {"initial_amplitude": 0.03, "duration": 5.0, "sample_rate": 200.0}
    hiss = Noise(0.01, sensor_noise=1e-3)
    one, two = (simulate_record(HEAVE, **arguments, seed=9, noise=hiss)[1] for _ in range(2))
    assert one.tobytes() == two.tobytes()
    assert one.tobytes() != simulate_record(HEAVE, **arguments, seed=10, noise=hiss)[1].tobytes()
    clean = simulate_record(HEAVE, **arguments, seed=9, noise=Noise(0.01))[1]
    assert (one - clean).std() == pytest.approx(1e-3, rel=0.1)
    rounded = simulate_record(HEAVE, **arguments, seed=9, noise=Noise(0.01, quantum=1e-3))[1]
    np.testing.assert_allclose(rounded / 1e-3, np.round(rounded / 1e-3), atol=1e-9)


def test_gusts_make_the_scatter_and_the_memory_that_are_asked_for():
    """An amplitude that relaxes at `rate` towards a gust of rate k has its variance times rate/(rate + k)."""
    stable, rate = HEAVE.balance()
    wind = Noise(gust_intensity=0.02 / HEAVE.wind_exponent, gust_time=2.0 / rate)
    time, y = simulate_record(
        HEAVE, initial_amplitude=stable, duration=3000 / rate, sample_rate=100.0, seed=3, noise=wind
    )
    cycles = demodulate(time, y)
    x = cycles.amplitude / stable - 1.0
    assert x.std() == pytest.approx(0.02 * np.sqrt(2 / 3), rel=0.1)
    lag = round(2.0 / rate * HEAVE.frequency)  # two relaxation times: 2 exp(-1) - exp(-2) of it is left
    assert np.mean(x[lag:] * x[:-lag]) / x.var() == pytest.approx(2 * np.exp(-1) - np.exp(-2), abs=0.08)


@pytest.mark.parametrize("wind", [{"gust_intensity": 0.01, "gust_time": 1e6}, {"set_point": 0.01}])
def test_the_wind_differs_from_record_to_record_from_the_release_on(wind):
    stable, rate = HEAVE.balance()
    ends = []
    for seed in range(80):
        _, y = simulate_record(
            HEAVE, initial_amplitude=stable, duration=7 / rate, sample_rate=100.0, seed=seed, noise=Noise(**wind)
        )
        ends.append(np.sqrt(2.0 * np.mean(y[-int(100 * 10 / HEAVE.frequency) :] ** 2)) / stable - 1.0)
    assert np.std(ends) == pytest.approx(0.01 * HEAVE.wind_exponent, rel=0.2)
    assert np.mean(ends) == pytest.approx(0.0, abs=0.006)


def test_still_air_has_neither_gusts_nor_a_set_point():
    still = Truth(Motion.HEAVING, 0.3, 0.075, 7.292, 7.87, 0.0065)
    arguments = {"initial_amplitude": 0.03, "duration": 5.0, "sample_rate": 200.0, "seed": 4}
    gusty = simulate_record(still, **arguments, noise=Noise(gust_intensity=0.1, set_point=0.1))[1]
    np.testing.assert_array_equal(gusty, simulate_record(still, **arguments)[1])


def test_shedding_acts():
    quiet = simulate_record(HEAVE, initial_amplitude=0.03, duration=10.0, sample_rate=200.0, seed=1)[1]
    shed = Truth(**{**vars(HEAVE), "shedding": 0.05, "shedding_frequency": 9.0})
    assert (
        np.abs(simulate_record(shed, initial_amplitude=0.03, duration=10.0, sample_rate=200.0, seed=1)[1] - quiet).max()
        > 1e-4
    )


def test_bad_arguments():
    with pytest.raises(ValueError, match="must be positive"):
        simulate_record(HEAVE, initial_amplitude=0.03, duration=-1.0, sample_rate=200.0, seed=1)
    growing = Truth(**{**vars(HEAVE), "Y1": 11.0})
    with pytest.raises(ValueError, match="this force has none"):
        simulate_record(growing, initial_amplitude=0.03, duration=1.0, sample_rate=200.0, seed=1, noise=Noise(0.01))
