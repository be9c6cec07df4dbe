"""Searches for the optimum: side by side as alone, where scipy finds it, off a wall, and no row asked for twice."""

import numpy as np
import pytest
from scipy.optimize import minimize

from scruton.infer.alike import of_each
from scruton.stats import optimum
from scruton.stats.optimum import FLAT, ImpossibleError, climb_side_by_side, find_optima, find_optimum
from scruton.stats.posterior import Posterior
from scruton.stats.priors import Prior


class Valley(Posterior):
    """A curved valley, steep across, and nothing at all beyond a wall that lies near its lowest point."""

    priors = tuple(Prior(name, "normal", 0.0, 3.0) for name in "xyz")
    wall = 1.3

    def log_likelihood(self, u):
        x, y, z = u.T
        return -50.0 * (y - x**2) ** 2 - (1.0 - x) ** 2 - 200.0 * (z + y) ** 2

    def inside(self, u):
        return u[:, 0] < self.wall


SCALE = np.array([1.0, 0.5, 2.0])


@pytest.mark.parametrize("wall", [1.3, np.inf])
def test_many_climbs_end_where_one_of_scipy_ends(wall):
    posterior = Valley()
    posterior.wall = wall
    starts = np.array([[-1.0, 1.5, -1.0], [0.5, 0.0, 0.5], [1.2, -2.0, 3.0], [-2.0, 3.0, -3.5]])
    found = climb_side_by_side(posterior, starts, np.repeat(SCALE[None], 4, axis=0))
    # without the wall, whose other side is no better
    free = minimize(
        lambda u: -float(np.sum(posterior.log_prior(u[None]) + posterior.log_likelihood(u[None]))), starts[1]
    )
    height = posterior.log_prob(found)
    np.testing.assert_allclose(height, -free.fun, atol=1e-3)
    for start, end in zip(starts, found, strict=True):
        np.testing.assert_allclose(climb_side_by_side(posterior, start[None], SCALE[None])[0], end, atol=1e-6)


def test_where_a_climb_ends_it_is_flat():
    end = climb_side_by_side(Valley(), np.array([[-1.0, 1.5, -1.0]]), SCALE[None])[0]
    for i, h in enumerate(1e-5 * SCALE):
        step = h * np.eye(3)[i]
        up, down = Valley().log_prob(np.array([end + step, end - step]))
        assert abs(up - down) / 2e-5 < 2.0 * FLAT


class Counted(Valley):
    asked = 0

    def log_likelihood(self, u):
        self.asked += 1
        return super().log_likelihood(u)


@pytest.mark.parametrize(("stalled", "goes_on"), [(1e-3, True), (1e6, False)])
def test_a_climb_ends_that_gains_next_to_nothing_in_many_steps(monkeypatch, stalled, goes_on):
    """Rounding has a slope everywhere: one of four climbs of a law that reaches no data went on for 400 steps."""
    monkeypatch.setattr(optimum, "STALLED", stalled)
    monkeypatch.setattr(optimum, "PATIENCE", 3)
    posterior = Counted()
    climb_side_by_side(posterior, np.array([[-1.0, 1.5, -1.0]]), SCALE[None])
    assert (posterior.asked > 6) is goes_on


class Gorge(Valley):
    """A valley so steep across that a climb along it takes many steps."""

    def log_likelihood(self, u):
        x, y, z = u.T
        return -5e4 * (y - x**2) ** 2 - 10.0 * (10.0 - x) ** 2 - 2e4 * (z + y) ** 2


@pytest.mark.parametrize(("behind", "given_up"), [(1e4, True), (-1e4, False)])
def test_a_climb_that_lacks_much_and_gains_little_is_given_up(monkeypatch, behind, given_up):
    """From where it is of use it is climbed to its end, point by point as if nothing were wanted."""
    monkeypatch.setattr(optimum, "PATIENCE", 5)
    start = np.array([[-3.0, 9.0, -9.0]])
    posterior = Gorge()
    posterior.wall = np.inf
    end = climb_side_by_side(posterior, start, SCALE[None])
    top = posterior.log_prob(end)[0]
    found = climb_side_by_side(posterior, start, SCALE[None], top + behind)
    assert bool(posterior.log_prob(found)[0] < top - 1.0) is given_up
    assert given_up or np.array_equal(found, end)


def test_searches_side_by_side_are_those_of_each_alone():
    rngs = [np.random.default_rng(seed) for seed in (1, 2)]
    together = find_optima(Valley(), rngs)
    for seed, peak in zip((1, 2), together, strict=True):
        alone = find_optimum(Valley(), np.random.default_rng(seed))
        np.testing.assert_allclose(alone.centre, peak.centre, atol=1e-6)
        np.testing.assert_allclose(alone.cholesky, peak.cholesky, rtol=1e-4, atol=1e-6)


class Peaks(Posterior):
    """A peak, another that is lower by a nat, and a third that is too low to matter."""

    priors = tuple(Prior(name, "uniform", -10.0, 10.0) for name in "xy")

    def log_likelihood(self, u):
        at = np.array([[5.0, 5.0], [-5.0, -5.0], [5.0, -5.0]])
        return np.logaddexp.reduce(
            [height - 2.0 * ((u - one) ** 2).sum(1) for one, height in zip(at, (0.0, -1.0, -12.0), strict=True)]
        )


def test_a_search_whose_ends_are_impossible_is_one_without_a_start():
    """A filter that all but loses its way lost it at other numbers of points side by side: NaN led on from there."""

    class Edge(Valley):
        def log_likelihood(self, u):
            return super().log_likelihood(u) if len(u) > 100 else np.full(len(u), -np.inf)

    with pytest.raises(ImpossibleError, match="no point of the prior has a finite likelihood"):
        find_optimum(Edge(), np.random.default_rng(1))


@pytest.mark.parametrize("seed", range(5))
def test_ensembles_start_from_every_optimum_that_was_found_and_matters(seed):
    found = find_optima(Peaks(), [np.random.default_rng([seed, k]) for k in range(4)])
    centres = {tuple(np.round(one.centre).tolist()) for one in found}
    assert centres == {(5.0, 5.0), (-5.0, -5.0)}


def test_rows_that_are_alike_are_asked_for_once():
    asked = []

    def function(rows):
        asked.append(len(rows))
        return rows.sum(axis=1)

    rows = np.repeat(np.arange(6.0).reshape(3, 2), [4, 1, 2], axis=0)[[0, 4, 1, 5, 2, 6, 3]]
    np.testing.assert_array_equal(of_each(function, rows), rows.sum(axis=1))
    np.testing.assert_array_equal(of_each(function, rows[[3, 1]]), rows[[3, 1]].sum(axis=1))
    assert of_each(function, rows[:0]).shape == (0,)
    assert asked == [3, 2, 0]
