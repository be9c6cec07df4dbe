"""The mode with dampers against a tight integration, and against what is known in closed form."""

import numpy as np
import pytest
from damped_mode import limit_cycle, simulate_damped
from scipy.integrate import solve_ivp

from scruton.campaign.schema import Motion
from scruton.simulate import Truth

COULOMB = Truth(Motion.HEAVING, 0.3, 0.075, 7.292, 7.87, 0.0065, 1.22, 5.036, -11.111, 0.03235)
DUFFING_FREE = Truth(Motion.HEAVING, 0.3, 0.075, 7.292, 7.87, 0.0065, 1.22, 5.036, 25.0, 1500.0, force="ehsan-scanlan")
STILL = Truth(Motion.HEAVING, 0.3, 0.075, 7.292, 7.87, 0.0065)
DAMPERS = {"mass_ratios": [0.01, 0.005], "frequency_ratios": [0.97, 1.04], "damping_ratios": [0.04, 0.02]}


def reference(truth, start, t):
    """Tight integration from one zero of the mode's velocity to the next, time in units of 1/omega."""
    mu, f, zeta = (np.array(v) for v in DAMPERS.values())
    w = truth.omega

    def rhs(side):
        def rates(_, s):
            x, r, v, u = s[0], s[1:3], s[3], s[4:]
            bracket = truth.passage * w * v - truth.epsilon * side
            if truth.force != "paper":
                bracket = (1.0 - truth.epsilon * x**2) * truth.passage * w * v
            a = -x - 2.0 * truth.damping_ratio * v + truth.pressure * truth.Y1 * bracket / w**2
            a += np.sum(mu * (2.0 * zeta * f * u + f**2 * r))
            return np.concatenate([[v], u, [a], -a - 2.0 * zeta * f * u - f**2 * r])

        return rates

    out, now, state = np.empty((3, t.size)), 0.0, np.array(start, dtype=float).ravel()
    while now < t[-1] - 1e-12:
        side = np.sign(state[3]) if abs(state[3]) > 1e-12 else -np.sign(state[0])

        def zero(_, s):
            return s[3]

        zero.terminal, zero.direction = True, -side
        run = solve_ivp(rhs(side), (now, t[-1]), state, events=zero, rtol=1e-10, atol=1e-14, dense_output=True)
        inside = (t >= now) & (t <= run.t[-1])
        out[:, inside] = run.sol(t[inside])[:3]
        now, state = run.t[-1], run.y[:, -1].copy()
        if run.t_events[0].size:
            state[3] = 0.0
    return out


@pytest.mark.parametrize("truth", [COULOMB, DUFFING_FREE], ids=["paper", "ehsan-scanlan"])
def test_against_a_tight_integration(truth):
    start = np.array([[0.05, -0.1, 0.2], [0.01, 0.3, -0.1]])
    t, y = simulate_damped(truth, **DAMPERS, cycles=12.0, start=start)
    np.testing.assert_allclose(y, reference(truth, start, t * truth.omega), atol=3e-6)


def test_the_wind_s_stiffness_moves_the_mode_and_the_dampers_with_it():
    stiff = Truth(Motion.HEAVING, 0.3, 0.075, 7.292, 7.87, 0.0065, 1.22, 5.036, -11.111, 0.03235, Y2=-40.0)
    start = np.array([[0.05, 0.0, 0.0], [0.0, 0.0, 0.0]])
    cycles = [
        limit_cycle(simulate_damped(truth, **DAMPERS, cycles=200.0, start=start)[1]).frequency
        for truth in (stiff, COULOMB)
    ]
    assert stiff.omega > 1.03 * COULOMB.omega
    assert cycles[0] == pytest.approx(cycles[1], abs=2e-3)


def test_a_damper_of_no_mass_leaves_the_stable_amplitude_alone():
    stable, rate = COULOMB.balance()
    _, y = simulate_damped(
        COULOMB, mass_ratios=[1e-9], frequency_ratios=[1.0], damping_ratios=[0.1],
        cycles=10.0 * COULOMB.frequency / rate, start=[[2.0 * stable, 0.0], [0.0, 0.0]],
    )  # fmt: skip
    found = limit_cycle(y)
    assert found.amplitude == pytest.approx(stable, rel=5e-3)
    assert found.strokes[0] == pytest.approx(1.0 / (2.0 * 0.1), rel=1e-2)  # resonance of a damper on a shaking table
    assert found.unsteadiness < 2e-3


def test_no_energy_comes_from_nowhere():
    """In still air, without damping, mode and dampers keep their energy."""
    free = Truth(Motion.HEAVING, 0.3, 0.075, 7.292, 7.87, 0.0)
    mu, f = np.array([0.05]), np.array([0.95])
    t, y = simulate_damped(
        free, mass_ratios=mu, frequency_ratios=f, damping_ratios=[1e-12],
        cycles=50.0, start=[[0.05, 0.0], [0.0, 0.0]], samples_per_cycle=400,
    )  # fmt: skip
    x, r = y
    v, u = np.gradient(y, t * free.omega, axis=1)
    energy = 0.5 * (v**2 + x**2) + 0.5 * mu[0] * ((v + u) ** 2 + f[0] ** 2 * r**2)
    np.testing.assert_allclose(energy[10:-10], energy[10], rtol=1e-3)


def test_still_air_decays():
    _, y = simulate_damped(STILL, **DAMPERS, cycles=200.0, start=[[0.05, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert np.abs(y[0, -200:]).max() < 1e-4


def test_a_beat_is_called_unsteady():
    t = np.arange(40 * 100) / 40.0
    steady = np.cos(2 * np.pi * 0.98 * t)
    beating = steady + 0.1 * np.cos(2 * np.pi * 1.05 * t)
    assert limit_cycle(np.stack([steady, steady])).unsteadiness < 1e-3
    assert limit_cycle(np.stack([steady, steady])).frequency == pytest.approx(0.98, abs=1e-4)
    assert limit_cycle(np.stack([beating, steady])).unsteadiness > 0.1


def test_lengths_and_signs_are_checked():
    with pytest.raises(ValueError, match="every damper has a mass ratio"):
        simulate_damped(STILL, **DAMPERS, cycles=1.0, start=np.zeros((2, 2)))
    with pytest.raises(ValueError, match="must be positive"):
        simulate_damped(
            STILL, mass_ratios=[0.0], frequency_ratios=[1.0], damping_ratios=[0.1], cycles=1.0, start=np.zeros((2, 2))
        )
