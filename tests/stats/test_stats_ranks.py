"""Rank statistics of chains, against arviz's own."""

import numpy as np
import pytest
from arviz_stats.base import array_stats
from scipy import signal

from scruton.stats.ranks import effective_draws_of_mean, rank_statistics
from tests.test_project import loaded_by

AXES = {"chain_axis": 0, "draw_axis": 1}


def chains(keep: float, shape: tuple[int, int, int]) -> np.ndarray:
    """Chains of which every third repeats itself now and then, as those of a sampler that rejects do."""
    rng = np.random.default_rng(11)
    x = signal.lfilter([1.0], [1.0, -keep], rng.standard_normal(shape), axis=1)
    x[::3, 1::2] = x[::3, : 2 * (shape[1] // 2) : 2]
    x[: shape[0] // 4] += 0.3  # an ensemble that lies apart
    return x


@pytest.mark.parametrize("shape", [(4, 4, 1), (8, 5, 2), (8, 9, 3), (64, 33, 3), (16, 250, 2)])
@pytest.mark.parametrize("keep", [-0.9, 0.0, 0.9, 0.999])
def test_they_are_arvizs(keep: float, shape: tuple[int, int, int]) -> None:
    x = chains(keep, shape)
    bulk, tail, rhat = rank_statistics(x, 4)
    ids = np.repeat(np.arange(4), shape[0] // 4)
    assert bulk == pytest.approx(np.atleast_1d(array_stats.ess(x, method="bulk", **AXES)), rel=1e-9)
    assert tail == pytest.approx(np.atleast_1d(array_stats.ess(x, method="tail", prob=(0.05, 0.95), **AXES)), rel=1e-9)
    told = np.atleast_1d(array_stats.rhat_nested(x, superchain_ids=ids, **AXES))
    assert rhat == pytest.approx(told, rel=1e-9)
    for one in np.moveaxis(x, -1, 0):
        assert effective_draws_of_mean(one) == pytest.approx(float(array_stats.ess(one, method="mean", **AXES)))


def test_too_few_draws_and_draws_that_do_not_move_say_nothing() -> None:
    assert np.isnan(rank_statistics(chains(0.0, (8, 3, 2)), 4)).all()
    x = chains(0.0, (8, 20, 2))
    x[..., 0] = 1.0
    bulk, tail, rhat = rank_statistics(x, 4)
    assert bulk[0] == tail[0] == x[..., 0].size
    assert np.isnan(rhat[0])
    assert np.isfinite(rhat[1])


def test_sampling_does_without_arviz() -> None:
    code = (
        "import numpy as np; from scruton.stats.convergence import SamplerSettings, judge; "
        "judge(np.random.default_rng(0).standard_normal((8, 20, 2)), np.zeros((8, 20)), 4, 1.0, SamplerSettings())"
    )
    assert not any(name.startswith("arviz") for name in loaded_by(code))
