"""What a motion that grows or dies away lacks in frequency, to second order in its rate."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from scruton.dynamics.cycles import Channels
from scruton.dynamics.effects.terms import COLUMNS, HATS, Term
from scruton.dynamics.extended import channel_innovations
from scruton.envelope import demodulate

OMEGA = 2.0 * np.pi * 5.0


def pushed_by_a_sign(count: int, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Motion of x'' + omega^2 x = F sgn(x'), from rest at -0.005: an arc of a circle about either end of the force."""
    force, time = 5e-4 * OMEGA**2, step * np.arange(count)
    half = np.floor(time * OMEGA / np.pi).astype(int)
    at = time * OMEGA - np.pi * half
    sign = np.where(half % 2, -1.0, 1.0)
    start = -sign * (0.005 + 2.0 * force / OMEGA**2 * half)
    centre = sign * force / OMEGA**2
    return time, centre + (start - centre) * np.cos(at)


def pushed_in_proportion(count: int, step: float) -> tuple[np.ndarray, np.ndarray]:
    """The same with a force F 4/pi that goes as the velocity over the amplitude."""
    time, force = step * np.arange(count), 4.0 / np.pi * 5e-4 * OMEGA**2

    def rate(_: float, y: np.ndarray) -> list[float]:
        x, v = y
        return [v, -(OMEGA**2) * x + force * v / OMEGA / np.hypot(x, v / OMEGA)]

    return time, solve_ivp(rate, (0.0, time[-1]), [-0.005, 0.0], t_eval=time, rtol=1e-9, atol=1e-12).y[0]


@pytest.mark.parametrize(("motion", "loss"), [(pushed_by_a_sign, 1.5), (pushed_in_proportion, 0.8)])
def test_how_much_frequency_growth_costs(motion, loss):
    """What the prior of `frequency_loss` rests on."""
    cycles = demodulate(*motion(2400, 0.005))
    turned = cycles.reference_frequency / 5.0 * 2.0 * np.pi
    pace = np.diff(cycles.phase) / np.diff(cycles.time) / OMEGA + cycles.reference_frequency / 5.0 - 1.0
    rate = 2.0 * np.diff(cycles.amplitude) / (cycles.amplitude[1:] + cycles.amplitude[:-1]) / turned
    steep = slice(1, 9)  # cycles in which it grows by a fifth to a tenth of itself
    assert np.median(-pace[steep] / rate[steep] ** 2) == pytest.approx(loss, abs=0.25)


def test_the_phase_of_a_growth_is_foretold():
    """With the loss that it has, the innovations of its phase vanish."""
    n, period, loss = 40, 2.0 * np.pi / OMEGA, 1.5
    amplitude = 0.05 * -np.expm1(-0.1 * np.arange(1, n + 1))
    grown = 2.0 * np.diff(amplitude) / (amplitude[1:] + amplitude[:-1])
    phase = np.r_[0.3, 0.3 - np.cumsum(loss * grown**2 / (2.0 * np.pi))]
    data = Channels(
        amplitude=amplitude, standard_error=np.full(n, 1e-5), phase=phase, third=np.zeros(n),
        third_error=np.full(n, 1e-5), gap=np.r_[-1.0, np.zeros(n - 1)], period=np.full(n, period),
        time=period * np.arange(n), place=np.linspace(-0.5, 0.5, n), record=np.zeros(n, dtype=np.intp),
        omega=np.full(n, OMEGA), has_phase=np.ones(n, dtype=bool), knots=np.linspace(-6.0, -2.0, HATS),
    )  # fmt: skip
    table = np.zeros((2, 1, COLUMNS))
    table[:, :, [Term.NOISE, Term.THIRD_NOISE]] = 1.0
    table[:, :, Term.PHASE_SCATTER] = 1e-6
    table[1, :, Term.FREQUENCY_LOSS] = loss
    innovations, _ = channel_innovations(data, table)
    without, within = np.abs(innovations[:, n : 2 * n]).max(axis=1)
    assert without > 0.05
    assert within < 1e-9
