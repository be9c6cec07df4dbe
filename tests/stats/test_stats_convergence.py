"""Monte Carlo errors: against the scatter of estimates over many runs, and where draws are infinite."""

import numpy as np
import pytest
from scipy import signal, stats

from scruton.stats.convergence import monte_carlo_error


def chains(rng: np.random.Generator, keep: float, shape: tuple[int, int]) -> np.ndarray:
    """Autoregressive chains of unit variance, each started in its stationary distribution."""
    noise = rng.standard_normal(shape)
    noise[:, 1:] *= np.sqrt(1.0 - keep**2)
    return signal.lfilter([1.0], [1.0, -keep], noise, axis=1)


@pytest.mark.parametrize("keep", [0.0, 0.8])
@pytest.mark.parametrize("probability", [0.05, 0.5, 0.95, None])
def test_the_error_is_the_scatter_of_the_estimate(keep: float, probability: float | None) -> None:
    rng = np.random.default_rng(5)
    runs = [chains(rng, keep, (16, 250)) for _ in range(120)]
    estimates = [run.mean() if probability is None else np.quantile(run, probability) for run in runs]
    told = np.median([monte_carlo_error(run, probability) for run in runs])
    # 120 runs tell a standard deviation to 6.5 %
    assert told == pytest.approx(np.std(estimates), rel=0.25)


def test_correlated_draws_count_for_less() -> None:
    rng = np.random.default_rng(6)
    alone, together = (
        np.median([monte_carlo_error(chains(rng, k, (16, 250)), 0.5) for _ in range(20)]) for k in (0, 0.9)
    )
    assert together / alone > 2.0


def test_infinite_draws_do_not_spoil_the_quantiles_below_them() -> None:
    x = np.random.default_rng(7).standard_normal((40, 100))
    some = np.where(x > 1.0, np.inf, x)
    assert monte_carlo_error(some, 0.5) == pytest.approx(monte_carlo_error(x, 0.5))
    edge = stats.norm.cdf(1.0)
    assert monte_carlo_error(some, edge - 0.001) == np.inf, "it may be infinite"
    assert np.isnan(monte_carlo_error(some, 0.95)), "it is"
    assert monte_carlo_error(some) == np.inf


def test_what_is_the_same_in_every_draw_has_no_error() -> None:
    assert monte_carlo_error(np.zeros((4, 10)), 0.5) == 0.0
    assert np.isnan(monte_carlo_error(np.full((4, 10), np.inf), 0.5))
    dead = np.maximum(np.random.default_rng(8).standard_normal((40, 100)), 0.0)
    assert monte_carlo_error(dead, 0.05) == 0.0


@pytest.mark.parametrize("shape", [(1, 4), (2, 5), (4, 9), (4, 10), (16, 250), (4, 1001)])
@pytest.mark.parametrize("keep", [-0.9, 0.0, 0.9, 0.999])
def test_it_is_arvizs_error(keep: float, shape: tuple[int, int]) -> None:
    from arviz_stats.base import array_stats

    rng, axes = np.random.default_rng(8), {"chain_axis": 0, "draw_axis": 1}
    for _ in range(5):
        x = chains(rng, keep, shape)
        x = np.where(x < -1.0, -1.0, x)  # ties, as where a vibration dies
        told = float(array_stats.mcse(x, method="mean", **axes))
        assert monte_carlo_error(x) == pytest.approx(told, rel=1e-9)
        for probability in (0.05, 0.5, 0.95):
            told = float(array_stats.mcse(x, method="quantile", prob=probability, **axes))
            if np.quantile(x, probability, method="inverted_cdf") < x.max():
                assert monte_carlo_error(np.minimum(x, 1e9), probability) == told
