"""Mode shapes: what lies between their points, and integrals along the span against closed forms."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.special import gamma

from scruton.sizing.mode_shape import make_shape, sine, uniform

STEP = np.array([0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1.0])


@pytest.mark.parametrize("half_waves", [1, 2, 7, 100])
@pytest.mark.parametrize(("n", "within"), [(-1.9, 3e-5), (-1.5, 1e-6), (-1.0, 1e-12), (0.5, 1e-12), (4.0, 1e-12)])
def test_the_integrals_of_a_sine_are_their_closed_form(half_waves, n, within):
    power = 2.0 + n
    exact = gamma(0.5 * (power + 1.0)) / (np.sqrt(np.pi) * gamma(0.5 * power + 1.0))
    assert sine(half_waves).integral(power) == pytest.approx(exact, rel=within)


def test_a_step_stays_a_step_where_a_spline_makes_the_modal_mass_a_sixth_smaller():
    shape = make_shape(np.linspace(0.0, 1.0, 11), STEP, "step")
    assert (shape.value.min(), shape.value.max()) == (0.0, 1.0)
    assert (np.diff(shape.value) >= 0.0).all()
    # by hand: half of the span moves by one, and in the cell between the shape is 3 t^2 - 2 t^3, whose square has 13/35
    assert shape.integral(2.0) == pytest.approx(0.5 + 0.1 * 13.0 / 35.0, rel=1e-12)
    x = np.linspace(0.0, 1.0, 20001)
    spline = CubicSpline(np.linspace(0.0, 1.0, 11), STEP)(x)
    assert np.mean((spline / np.abs(spline).max()) ** 2) / shape.integral(2.0) == pytest.approx(0.83, abs=0.005)


def test_a_shape_that_changes_sign_has_its_nodes_among_the_points():
    shape = make_shape(np.linspace(0.0, 1.0, 8), np.sin(2.0 * np.pi * np.linspace(0.0, 1.0, 8)) + 0.1, "waves")
    x = (np.arange(2_000_000) + 0.5) / 2_000_000
    for power in (1.0, 2.0, 2.7):
        assert shape.integral(power) == pytest.approx(np.mean(np.abs(shape.curve(x)) ** power), rel=1e-5)
    assert shape.weight.sum() == pytest.approx(1.0)


def test_a_sampled_sine_is_a_sine():
    x = np.linspace(0.0, 1.0, 41)
    shape = make_shape(30.0 + 400.0 * x, 0.02 * np.sin(2.0 * np.pi * x), "sampled")
    assert shape.integral(2.0) == pytest.approx(0.5, rel=1e-3)
    assert float(shape.factor(-1.0)) == pytest.approx(4.0 / np.pi, rel=1e-3)
    assert shape.at(0.3) == pytest.approx(np.sin(0.6 * np.pi), abs=1e-3)
    assert uniform().integral(1.7) == 1.0
