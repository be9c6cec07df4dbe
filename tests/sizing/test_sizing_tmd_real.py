"""Dampers that stick and strike, and the laws' own 1/g, against the equations of motion integrated in time."""

import numpy as np
import pytest
from equations_of_motion import constant_force, force_by_displacement, settle

from scruton.sizing.tmd import respond
from scruton.sizing.tmd_draws import frequency_power
from scruton.sizing.tmd_real import Flaws, limit_cycle, respond_at


class Cases:
    """Random dampers on a mode in a force of constant size: its amplitude without a damper is one."""

    def __init__(self, count, seed):
        rng = np.random.default_rng(seed)
        self.damping = rng.uniform(0.002, 0.01, count)
        self.mu = np.exp(rng.uniform(np.log(0.002), np.log(0.02), count))
        self.f = rng.uniform(0.95, 1.05, count) / (1.0 + self.mu)
        self.zeta = rng.uniform(0.35, 1.6, count) * np.sqrt(self.mu)
        self.free = respond(self.mu[None], self.f[None], self.zeta[None])
        self.without = self.amplitude(self.free.added_damping, self.free.frequency)
        self.share = rng.random(count)

    def amplitude(self, added, g):
        return self.damping / (self.damping + added) / g

    def balance(self, flaws, largest=True):
        """Amplitude, stroke and frequency."""

        def respond_to(size):
            return respond_at(
                self.mu[None], self.f[None], self.zeta[None], np.broadcast_to(size, (1, self.mu.size)), flaws
            )

        size, found = limit_cycle(respond_to, self.amplitude, 1.0, largest=largest)
        return size, found.stroke[0] * size, found.frequency

    def simulate(self, flaws, start=1.2, cycles=400, steps=160):
        size, frequency, stroke, unsteady = settle(
            constant_force(0.5 * np.pi * self.damping), self.damping, self.mu, self.f, self.zeta, cycles=cycles,
            steps=steps, start=start, friction=flaws.friction, stop=flaws.stop, stiffness=flaws.stop_stiffness,
        )  # fmt: skip
        assert unsteady.max() < 0.02
        return size, stroke, frequency


def with_friction(cases):
    """Friction up to nine tenths of what holds the damper where it would be free."""
    return Flaws(friction=(0.02 + 0.88 * cases.share) * 0.25 * np.pi * cases.without)


@pytest.mark.parametrize("count", [12, pytest.param(200, marks=pytest.mark.slow)])
def test_friction_against_the_equations_of_motion(count):
    cases = Cases(count, 5)
    flaws = with_friction(cases)
    amplitude, stroke, frequency = cases.balance(flaws)
    want = cases.simulate(flaws)
    np.testing.assert_allclose(amplitude, want[0], rtol=0.03)
    np.testing.assert_allclose(stroke, want[1], rtol=0.03)
    np.testing.assert_allclose(frequency, want[2], atol=3e-3)
    # or friction could be left out
    assert np.max(np.abs(cases.without / want[0] - 1.0)) > 0.2


@pytest.mark.slow
def test_free_dampers_against_the_equations_of_motion():
    cases = Cases(200, 5)
    error = np.abs(cases.without / cases.simulate(Flaws())[0] - 1.0)
    assert np.median(error) < 0.002
    assert np.quantile(error, 0.95) < 0.011


@pytest.mark.thorough
def test_a_damper_that_friction_holds_is_mass_alone():
    cases = Cases(6, 1)
    held = Flaws(friction=3.0)
    amplitude, stroke, frequency = cases.balance(held)
    np.testing.assert_allclose(stroke, 0.0, atol=1e-3)
    np.testing.assert_allclose(frequency, 1.0 / np.sqrt(1.0 + cases.mu), rtol=1e-5)
    np.testing.assert_allclose(amplitude, np.sqrt(1.0 + cases.mu), rtol=1e-3)  # the 1/g of constant force
    np.testing.assert_allclose(cases.simulate(held, cycles=250, steps=640)[0], amplitude, rtol=8e-3)


def test_a_free_damper_is_the_linear_one():
    cases = Cases(6, 2)
    found = respond_at(cases.mu[None], cases.f[None], cases.zeta[None], np.ones((1, 6)), Flaws(1e-9, 1e6))
    np.testing.assert_allclose(found.added_damping, cases.free.added_damping, rtol=1e-5)
    np.testing.assert_allclose(cases.balance(Flaws(1e-9))[0], cases.without, rtol=2e-3)


def test_end_stops_against_the_equations_of_motion():
    """From above most of these strike: the damper is off tune, and the vibration stays several times as large."""
    cases = Cases(24, 6)
    flaws = Flaws(stop=(0.3 + 0.65 * cases.share) * cases.without * cases.free.stroke[0])
    amplitude, *_ = cases.balance(flaws)
    want = cases.simulate(flaws)
    error = np.abs(amplitude / want[0] - 1.0)
    assert np.median(error) < 0.02
    assert error.max() < 0.25  # the stops' third harmonic is left out
    assert np.median(want[0] / cases.without) > 2.0
    assert np.mean(want[1] > flaws.stop) == 1.0


@pytest.mark.thorough
def test_growth_from_rest_may_end_below_what_a_release_from_above_ends_in():
    cases = Cases(12, 7)
    flaws = Flaws(stop=1.1 * cases.without * cases.free.stroke[0])
    least, largest = cases.balance(flaws, largest=False)[0], cases.balance(flaws)[0]
    np.testing.assert_allclose(least, cases.without, rtol=5e-3)
    np.testing.assert_allclose(cases.simulate(flaws, start=1e-3)[0], least, rtol=0.02)
    apart = largest > 1.5 * least
    assert apart.any()
    np.testing.assert_allclose(cases.simulate(flaws)[0][apart], largest[apart], rtol=0.25)


# The laws: what stands on the section's curve is g a where the force goes with the velocity, a where with the place.


@pytest.mark.parametrize("n", [-1.0, 1.0, 2.0])
def test_the_frequency_of_the_response_in_the_amplitude_of_a_law(n):
    """The curve of each law is found by the same integration with more damping in the place of a damper."""
    rng = np.random.default_rng(8)
    mu, count = rng.uniform(0.008, 0.02, 8), 8
    f = np.array([0.95, 0.96, 0.97, 0.975, 1.025, 1.03, 1.04, 1.05]) / (1.0 + mu)
    zeta = rng.uniform(0.4, 0.6, count) * np.sqrt(mu)
    found = respond(mu[None], f[None], zeta[None])
    added, g = found.added_damping, found.frequency
    damping = np.full(count, 0.004)
    if n == -1.0:
        wind = constant_force(0.5 * np.pi * damping)
    else:
        wind = force_by_displacement(2.5 * (damping + added), 1.5 * (damping + added), n)
    options = {"cycles": 400, "start": 0.3}
    with_damper, frequency, _, unsteady = settle(wind, damping, mu, f, zeta, **options)
    on_curve, *_ = settle(wind, damping + added, 1e-9, 1.0, 0.5, **options)
    assert unsteady.max() < 5e-3
    np.testing.assert_allclose(frequency, g, atol=2e-3)
    assert np.ptp(g) > 0.03
    np.testing.assert_allclose(with_damper * g ** frequency_power(n), on_curve, rtol=0.022 if n < 0.0 else 0.01)
    wrong = with_damper * g ** (1.0 - frequency_power(n)) / on_curve
    assert np.max(np.abs(wrong - 1.0)) > 0.03  # or the power was not tested


def test_the_power_between_the_laws():
    np.testing.assert_array_equal(frequency_power([-2.0, -1.0, -0.25, 0.0, 1.0, 2.0]), [1.0, 1.0, 0.25, 0.0, 0.0, 0.0])


def test_each_draw_is_solved_by_itself():
    """What one draw comes to does not depend on how long another takes."""
    rng = np.random.default_rng(3)
    mu, f, zeta = np.full((2, 40), 0.003), rng.uniform(0.95, 1.03, (2, 40)), rng.uniform(0.02, 0.15, (2, 40))
    movement, flaws = rng.uniform(0.02, 0.3, (2, 40)), Flaws(0.004, 0.4)
    together = respond_at(mu, f, zeta, movement, flaws)
    for k in range(40):
        alone = respond_at(*(each[:, k : k + 1] for each in (mu, f, zeta, movement)), flaws)
        assert alone.frequency[0] == together.frequency[k]
        np.testing.assert_array_equal(alone.stroke[:, 0], together.stroke[:, k])
