import numpy as np
import pytest
from scipy.optimize import curve_fit

from scruton.envelope.trial import (
    TRIAL_FUNCTIONS,
    CubicSpline,
    Polynomial,
    SecondOrderExponential,
    block_means,
    trial_function,
)

T = np.linspace(3.0, 33.0, 1500)


def eq4(t, a, b, c, d):
    return a * np.exp(b * t) + c * np.exp(d * t)


@pytest.mark.parametrize(
    "truth",
    [
        (0.06, 0.0, 0.12, -0.3),  # decay to resonance
        (0.06, 0.0, -0.05, -0.25),  # growth to resonance
        (0.05, -0.02, 0.1, -0.9),  # slow decay beneath a fast one
        (-0.01, 0.03, 0.09, -0.05),  # decay that accelerates
        (0.02, 0.05, -0.01, -0.4),  # slow growth
        (1e-4, 0.15, 1e-4, -0.15),
    ],
)
def test_recovers_exact_constants_with_ordered_rates(truth):
    fit = SecondOrderExponential().fit(T, eq4(T - T[0], *truth))
    assert fit.constants["b"] > fit.constants["d"]
    np.testing.assert_allclose(list(fit.constants.values()), truth, rtol=1e-4, atol=1e-6)


def test_the_label_twin_gives_the_same_constants():
    one = SecondOrderExponential().fit(T, eq4(T - T[0], 0.06, 0.0, 0.12, -0.3))
    two = SecondOrderExponential().fit(T, eq4(T - T[0], 0.12, -0.3, 0.06, 0.0))
    np.testing.assert_allclose(list(one.constants.values()), list(two.constants.values()))


def test_no_worse_than_a_general_optimiser_started_at_the_truth():
    rng = np.random.default_rng(3)
    for truth in ((0.06, 0.0, 0.12, -0.3), (0.06, 0.0, -0.05, -0.25), (0.05, -0.02, 0.1, -0.9)):
        y = eq4(T - T[0], *truth) + 2e-3 * rng.normal(size=len(T))
        fit = SecondOrderExponential().fit(T, y)
        slow, _ = curve_fit(eq4, T - T[0], y, p0=truth, maxfev=20000)
        ours = np.sum((y - fit.value(T)) ** 2)
        assert ours <= np.sum((y - eq4(T - T[0], *slow)) ** 2) * (1 + 1e-6)


@pytest.mark.parametrize("name", [*TRIAL_FUNCTIONS, "polynomial 9", "cubic spline 4"])
def test_derivative_is_that_of_the_value(name):
    y = 0.06 + 0.1 * np.exp(-0.2 * (T - 3)) + 0.002 * np.sin(T)
    fit = trial_function(name).fit(T, y)
    t, h = np.linspace(4, 32, 50), 1e-4
    numerical = (fit.value(t + h) - fit.value(t - h)) / (2 * h)
    np.testing.assert_allclose(fit.derivative(t), numerical, rtol=1e-4, atol=1e-8)
    assert np.std(y - fit.value(T)) < 0.004
    assert all(np.isfinite(list(fit.constants.values())))


@pytest.mark.parametrize("form", [SecondOrderExponential(), Polynomial(5), CubicSpline(5)])
def test_thinned_least_squares_is_the_full_one(form, monkeypatch):
    rng = np.random.default_rng(4)
    t = np.linspace(0, 30, 60_000)
    y = 0.06 + 0.12 * np.exp(-0.3 * t) + 0.02 * rng.normal(size=len(t))
    thin = form.fit(t, y)
    monkeypatch.setattr("scruton.envelope.trial._POINTS", 10**9)
    full = form.fit(t, y)
    np.testing.assert_allclose(thin.value(t), full.value(t), atol=2e-6)


def test_block_means_weigh_by_count():
    t = np.arange(10_007.0)
    means, values, counts = block_means(t, t**2)
    assert counts.sum() == len(t)
    assert np.sum(counts * means) == pytest.approx(t.sum())
    assert np.sum(counts * values) == pytest.approx(np.sum(t**2))


def test_registry_and_its_errors():
    assert trial_function("polynomial 8") == Polynomial(8)
    assert trial_function("cubic spline 12") == CubicSpline(12)
    with pytest.raises(ValueError, match="unknown trial function 'gompertz'; known are second-order exponential"):
        trial_function("gompertz")
    with pytest.raises(ValueError, match="found 4"):
        SecondOrderExponential().fit(T[:4], T[:4])
    with pytest.raises(ValueError, match="order 6"):
        Polynomial().fit(T[:7], T[:7])
    with pytest.raises(ValueError, match="24 or more"):
        CubicSpline().fit(T[:20], T[:20])


def test_a_polynomial_that_the_amplitudes_do_not_determine_is_refused():
    time = np.linspace(0.0, 30.0, 3000)
    with pytest.raises(ValueError, match="a polynomial of order 400, which the amplitudes do not determine"):
        Polynomial(400).fit(time, np.exp(-0.1 * time))
