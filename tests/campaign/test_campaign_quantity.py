"""One reading of a stated number: its mean and its standard deviation, whatever it is asked for."""

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import quad

from scruton.campaign import Quantity

STATED = Quantity(0.003, 0.002)
QUANTITIES = [
    STATED,
    Quantity(0.003, 0.00135, minimum=0.001),
    Quantity(7.0, 0.03),
    Quantity(0.3, 0.003, "normal"),
    Quantity(0.3, 0.2, "normal", minimum=0.1),
    Quantity(0.9, 0.05, "beta"),
    Quantity(0.9, 0.05, "beta", minimum=0.85),
]


def moments(draws: np.ndarray) -> tuple[float, float]:
    """Distance of mean and median of 400,000 draws from those stated, in standard errors of the mean."""
    error = STATED.sd / np.sqrt(draws.size)
    return (draws.mean() - STATED.mean) / error, (np.median(draws) - STATED.median) / error


def test_what_is_drawn_has_the_mean_and_the_sd_that_are_stated() -> None:
    draws = STATED.draw(np.random.default_rng(1), 400_000)
    assert np.abs(moments(draws)).max() < 4.0
    assert draws.std() == pytest.approx(STATED.sd, rel=0.02)
    # as a fit read it once, with the stated number as the median: the test must see that
    other = STATED.mean * np.exp(STATED.log_sd * np.random.default_rng(1).standard_normal(400_000))
    assert np.abs(moments(other)).min() > 50.0


def test_the_lognormal_one_is_scipys() -> None:
    peer = stats.lognorm(STATED.log_sd, scale=STATED.median)
    assert (peer.mean(), peer.std()) == pytest.approx((0.003, 0.002), rel=1e-12)
    x = np.array([0.001, 0.003, 0.01])
    np.testing.assert_allclose(STATED.log_density(x), peer.logpdf(x), rtol=1e-12)
    np.testing.assert_allclose(STATED.interval(0.9), peer.interval(0.9), rtol=1e-12)
    assert STATED.log_density(np.array([-1.0, 0.0])).tolist() == [-np.inf, -np.inf]


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_draws_quantiles_and_density_are_of_one_distribution(quantity: Quantity) -> None:
    low, middle, high = quantity.quantile(np.array([0.2, 0.5, 0.8]))
    assert middle == pytest.approx(quantity.median)
    assert quantity.interval(0.6) == pytest.approx((low, high))
    for upper, below in ((low, 0.0), (high, 0.6)):
        inside = quad(lambda x: float(np.exp(quantity.log_density(np.array(x)))), low, upper, limit=200)[0]
        assert inside == pytest.approx(below, abs=1e-7)
    draws = quantity.draw(np.random.default_rng(2), (4, 5000))
    assert draws.shape == (4, 5000)
    assert draws.min() >= quantity.minimum
    assert stats.kstest(draws.ravel(), lambda x: np.interp(x, quantity.quantile(GRID), GRID)).pvalue > 1e-3


GRID = np.linspace(1e-5, 1.0 - 1e-5, 20_001)


@pytest.mark.parametrize("certain", [Quantity(2.0), Quantity(2.0, 0.0), Quantity(2.0, 0.1, "known")])
def test_what_is_certain_is_one_value(certain: Quantity) -> None:
    rng = np.random.default_rng(1)
    state = rng.bit_generator.state
    assert certain.draw(rng, 3).tolist() == [2.0, 2.0, 2.0]
    assert rng.bit_generator.state == state
    assert (certain.median, certain.interval(0.9)) == (2.0, (2.0, 2.0))
    with pytest.raises(ValueError, match="no density"):
        certain.log_density(np.array([2.0]))


def test_an_uncertainty_is_only_added_where_none_is_stated() -> None:
    assert Quantity(2.0).or_relative_sd(0.1) == Quantity(2.0, 0.2)
    assert Quantity(2.0, 0.5).or_relative_sd(0.1) == Quantity(2.0, 0.5)


@pytest.mark.parametrize(("mean", "sd", "minimum"), [(0.95, 0.03, 0.0), (0.5, 0.3, 0.0), (0.05, 0.1, 0.015)])
def test_many_quantiles_of_a_beta_distribution_are_those_of_few(mean: float, sd: float, minimum: float) -> None:
    quantity = Quantity(mean, sd, "beta", minimum)
    u = np.concatenate(([1e-9, 1e-6, 1.0 - 1e-6, 1.0 - 1e-9], GRID))
    exactly = np.concatenate([quantity.quantile(part) for part in np.array_split(u, 40)])
    np.testing.assert_allclose(quantity.quantile(u), exactly, rtol=0.0, atol=1e-8)
