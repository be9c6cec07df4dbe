"""Priors: densities, coordinates, support."""

import numpy as np
import pytest
from scipy import integrate, stats

from scruton.stats.priors import Prior, check_support

ALL = [
    Prior("x", "lognormal", 0.05, 1.5),
    Prior("x", "loguniform", 0.01, 2.0),
    Prior("x", "normal", -1.0, 0.3),
    Prior("x", "uniform", -2.0, 5.0),
]


@pytest.mark.parametrize("prior", ALL, ids=lambda p: p.family)
def test_density_integrates_to_one_and_draws_follow_it(prior):
    low, high = prior.location - 9 * prior.scale, prior.location + 9 * prior.scale
    total, _ = integrate.quad(lambda u: float(np.exp(prior.log_density(np.array(u)))), low, high, limit=400)
    assert total == pytest.approx(1.0, abs=1e-3)
    draws = prior.draw(np.random.default_rng(0), 20000)
    assert draws.mean() == pytest.approx(prior.location, abs=4 * prior.scale / np.sqrt(20000))
    assert draws.std() == pytest.approx(prior.scale, rel=0.03)


def test_lognormal_is_scipys_lognormal_in_its_logarithm():
    prior = Prior("x", "lognormal", 0.05, 1.5)
    value = np.array([0.003, 0.05, 0.4])
    want = stats.lognorm(1.5, scale=0.05).logpdf(value) + np.log(value)
    np.testing.assert_allclose(prior.log_density(prior.to_sampled(value)), want)


@pytest.mark.parametrize("prior", ALL, ids=lambda p: p.family)
def test_coordinates_round_trip(prior):
    u = prior.draw(np.random.default_rng(1), 50)
    np.testing.assert_allclose(prior.to_sampled(prior.from_sampled(u)), u, atol=1e-12)


def test_support_check_names_every_offender():
    priors = [
        Prior("stable_amplitude", "lognormal", 0.05, 1.5, "A/D"),
        Prior("rate", "uniform", 0.0, 1.0, "1/s"),
        Prior("fine", "normal", 0.0, 1.0),
    ]
    with pytest.raises(ValueError, match=r"stable_amplitude = -0.1 A/D lies outside .*; rate = 3 1/s lies outside"):
        check_support(priors, [-0.1, 3.0, 0.5])
    check_support(priors, [0.1, 0.5, 0.5])


@pytest.mark.parametrize(
    ("family", "numbers", "message"),
    [
        ("cauchy", (0, 1), "unknown family"),
        ("lognormal", (-1, 1), "median = -1 must be positive"),
        ("normal", (0, 0), "sd = 0 must be positive"),
        ("uniform", (2, 1), "high = 1 must exceed low = 2"),
        ("normal", (float("nan"), 1), "finite"),
    ],
)
def test_numbers_that_make_no_distribution(family, numbers, message):
    with pytest.raises(ValueError, match=message):
        Prior("x", family, *numbers)
