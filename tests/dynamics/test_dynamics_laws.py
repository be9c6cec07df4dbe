"""The n-family: closed form against integration, continuity in n, limits."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from scruton.dynamics import amplitude_ratio, closed_form, extrapolation_index, flow_derivative, larsen, rate

FAMILY = [-1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0]


@pytest.mark.parametrize("n", FAMILY)
@pytest.mark.parametrize("a0", [0.004, 0.03, 0.12])
def test_closed_form_against_numerical_integration(n, a0):
    a_star, lam, t = 0.05, 0.7, np.linspace(0, 8, 40)
    numeric = solve_ivp(lambda _, a: rate(a, a_star, lam, n), (0, 8), [a0], t_eval=t, rtol=1e-10, atol=1e-14).y[0]
    np.testing.assert_allclose(closed_form(t, a0, a_star, lam, n), numeric, rtol=1e-7)


@pytest.mark.parametrize("n", FAMILY)
def test_flow_derivative_against_differences(n):
    h = 1e-7
    up, down = (closed_form(1.3, 0.03 + s * h, 0.05, 0.7, n) for s in (1, -1))
    assert flow_derivative(1.3, 0.03, 0.05, 0.7, n) == pytest.approx((up - down) / (2 * h), rel=1e-6)


def test_relaxation_rate_is_the_same_under_every_law():
    for n in FAMILY:
        a = closed_form(2.0, 0.05 * (1 + 1e-6), 0.05, 0.7, n)
        assert np.log((a / 0.05 - 1) / 1e-6) == pytest.approx(-1.4, rel=1e-4)


def test_continuous_through_n_zero():
    tiny = np.array([-1e-9, 0.0, 1e-9])
    assert np.ptp(closed_form(1.0, 0.02, 0.05, 0.7, tiny)) < 1e-10
    assert np.ptp(amplitude_ratio(0.4, tiny)) < 1e-8
    assert np.ptp(rate(0.02, 0.05, 0.7, tiny)) < 1e-10


def test_growth_from_rest_only_under_the_papers_law():
    assert closed_form(1.0, 0.0, 0.05, 0.7, -1.0) == pytest.approx(0.05 * (1 - np.exp(-0.7)))
    assert closed_form(1.0, 0.0, 0.05, 0.7, 2.0) == 0.0


def test_amplitude_ratios_of_the_four_laws_at_half():
    np.testing.assert_allclose(
        amplitude_ratio(0.5, [-1.0, 0.0, 1.0, 2.0]), [1 / 1.5, np.exp(-0.5), 0.5, 0.0], atol=1e-12
    )


def test_where_the_vibration_dies_and_where_no_amplitude_is_stable():
    np.testing.assert_array_equal(amplitude_ratio([0.6, 2.0], 2.0), 0.0)
    np.testing.assert_array_equal(amplitude_ratio([-1.0, -1.5], -1.0), np.inf)


@pytest.mark.parametrize("n", FAMILY)
def test_ratio_is_the_balance_of_damping(n):
    """a' is where da/dt under the tested damping equals the added damping's decay, omega0 (xi' - xi) a'."""
    x, lam = 0.3, 0.7
    a = 0.05 * amplitude_ratio(x, n)
    assert rate(a, 0.05, lam, n) == pytest.approx(x * lam * a, rel=1e-9)


def test_index_and_larsen():
    assert extrapolation_index(30.0, 20.0, 50.0) == pytest.approx(0.2)
    assert larsen(-0.5) == -1.0
