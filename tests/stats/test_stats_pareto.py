"""The tail of importance weights, against arviz's own estimate of its shape."""

import numpy as np
import pytest
from arviz_stats.base import array_stats

from scruton.stats.pareto import FEWEST, scaled, smoothed, tail_shape


def heavy(rng, size):
    return np.log1p(rng.pareto(rng.uniform(0.5, 5.0), size))


def wide(rng, size):
    return rng.standard_normal(size) * rng.uniform(0.1, 5.0)


def bounded(rng, size):
    return -rng.exponential(rng.uniform(0.5, 4.0), size)


@pytest.mark.parametrize("weights", [heavy, wide, bounded])
@pytest.mark.parametrize("size", [FEWEST, 130, 600, 4096])
def test_the_shape_of_a_tail_and_the_weights_that_it_smooths_are_arvizs(weights, size):
    rng = np.random.default_rng(size)
    for _ in range(20):
        drawn = weights(rng, size)
        found, shape = smoothed(drawn)
        told, told_shape = array_stats.psislw(-drawn)
        np.testing.assert_allclose(found, told, rtol=1e-9, atol=1e-9)
        for one in (shape, tail_shape(drawn)):
            assert one == pytest.approx(float(told_shape), rel=1e-9, nan_ok=True)
        for alpha in (0.99, 1.01):
            np.testing.assert_allclose(
                scaled(drawn, alpha), array_stats.power_scale_lw(drawn, alpha=alpha), rtol=1e-9, atol=1e-9
            )


def test_weights_without_a_tail_are_not_smoothed():
    with pytest.raises(ValueError, match="without any spread"):
        smoothed(np.zeros(1000))
    with pytest.raises(ValueError, match="too few"):
        smoothed(np.arange(20.0))


def test_a_known_tail_is_found():
    drawn = np.log1p(np.random.default_rng(1).pareto(2.0, 100_000))  # of shape a half
    assert tail_shape(drawn) == pytest.approx(0.5, abs=0.07)


def test_too_few_weights_say_nothing_and_equal_ones_have_no_tail():
    assert tail_shape(np.zeros(FEWEST - 1)) == np.inf
    assert np.isnan(tail_shape(np.zeros(1000)))
