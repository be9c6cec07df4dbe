"""Scoring reaches the optimum, and learns on its way what its information does not hold."""

import numpy as np
import pytest

from scruton.stats.fisher_scoring import _learnt, _solved, climb

CENTRE, WIDTH = np.array([1.0, -2.0, 0.5]), np.array([0.1, 1.0, 3.0])


def bent(u: np.ndarray) -> np.ndarray:
    """Log density (W,) of a normal whose second coordinate follows the square of the first, (W, 3)."""
    z = (u - CENTRE - np.stack([0.0 * u[:, 0], 0.5 * u[:, 0] ** 2, 0.0 * u[:, 0]], axis=1)) / WIDTH
    return -0.5 * np.sum(z * z, axis=1)


def scores_of(density, part: float, seen: list[np.ndarray]):
    """Value, slopes by differences, and that part of the curvature at the optimum as the information, turned a bit."""

    def scores(u: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        seen.append(u)
        step = 1e-5 * np.eye(3)
        slope = (density(u + step) - density(u - step)) / 2e-5
        information = part * np.diag(1.0 / WIDTH**2)
        information[0, 2] = information[2, 0] = 0.5 * part / (WIDTH[0] * WIDTH[2])
        return float(density(u[None])[0]), slope, information

    return scores


@pytest.mark.parametrize("part", [0.2, 0.45, 1.0, 4.0])
def test_the_optimum_is_reached_though_the_information_is_off(part):
    seen: list[np.ndarray] = []
    u, (value, slope, _) = climb(scores_of(bent, part, seen), bent, np.zeros(3))
    assert value > -0.01
    assert np.abs(slope * WIDTH).max() < 0.2
    np.testing.assert_allclose(u[0], CENTRE[0], atol=0.2 * WIDTH[0])


def test_what_the_information_lacks_is_learnt():
    """Of a quadratic a secant a dimension is all that there is to learn."""

    def straight(u: np.ndarray) -> np.ndarray:
        z = (u - CENTRE) / WIDTH
        return -0.5 * np.sum(z * z, axis=1) - 0.45 * z[:, 0] * z[:, 2]

    seen: list[np.ndarray] = []
    _, (value, *_) = climb(scores_of(straight, 0.37, seen), straight, np.zeros(3), tolerance=1e-9)
    assert value > -1e-6
    assert len(seen) <= 8


def test_a_limit_holds_in_every_step():
    seen: list[np.ndarray] = []
    climb(scores_of(bent, 1.0, seen), bent, np.zeros(3), limit=lambda u: np.full(3, 0.25))
    steps = np.abs(np.diff(seen, axis=0))
    assert len(steps) > 2
    assert steps.max() <= 0.25 + 1e-12


def test_a_curvature_that_vanishes_or_a_gradient_that_is_none_stops_no_climb():
    """From there on the information alone is followed."""
    assert np.array_equal(_solved(np.zeros((2, 2)), np.ones(2), np.array([3.0, 4.0])), [3.0, 4.0])
    beside = np.eye(2)
    assert _learnt(beside, np.array([1.0, 0.0]), np.array([np.nan, 0.0])) is beside
    assert _learnt(beside, np.array([1.0, 0.0]), np.array([1.0, 0.0])) is beside
    np.testing.assert_allclose(_learnt(beside, np.array([2.0, 0.0]), np.array([6.0, 0.0])), [[3.0, 0.0], [0.0, 1.0]])
