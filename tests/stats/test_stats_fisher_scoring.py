"""Steps and covariances of an information that is too uneven to be solved for."""

import numpy as np
import pytest

from scruton.stats.fisher_scoring import climb, inverse, solved

UNEVEN = np.diag([1.0, 4.0, 0.0])


def test_a_step_is_newtons_where_there_is_one() -> None:
    information = np.array([[2.0, 0.5], [0.5, 1.0]])
    gradient = np.array([1.0, -1.0])
    assert solved(information, gradient) == pytest.approx(np.linalg.solve(information, gradient))
    np.testing.assert_array_equal(inverse(information, np.ones(2)), np.linalg.inv(information))


def test_a_singular_information_moves_what_it_tells_of() -> None:
    assert solved(UNEVEN, np.array([1.0, 2.0, 0.0])) == pytest.approx([1.0, 0.5, 0.0])
    both = np.array([[1.0, 3.0], [2.0, 4.0], [0.0, 0.0]])
    assert solved(UNEVEN, both) == pytest.approx(np.array([[1.0, 3.0], [0.5, 1.0], [0.0, 0.0]]))
    assert inverse(UNEVEN, np.array([1.0, 2.0, 3.0])) == pytest.approx(np.diag([1.0, 0.25, 0.0]))


def test_what_is_no_number_moves_nothing() -> None:
    lost = np.array([[np.inf, 0.0], [0.0, 0.0]])
    assert solved(lost, np.ones(2)) == pytest.approx(np.zeros(2))
    assert inverse(lost, np.array([1.0, 2.0])) == pytest.approx(np.diag([1.0, 4.0]))


def test_what_swings_does_not_hold_back_the_rest() -> None:
    """One coordinate bends five times as much as its information says, the other as much: it took 14 steps."""
    true, told = np.array([5.0, 1.0]), np.eye(2)
    asked = []

    def scores(u: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        asked.append(u)
        return -0.5 * float(u @ (true * u)), -true * u, told

    top, (value, *_) = climb(scores, lambda points: -0.5 * (points**2) @ true, np.array([3.0, 40.0]))
    assert value > -5e-3
    assert top == pytest.approx(np.zeros(2), abs=0.1)
    assert len(asked) <= 8


@pytest.mark.parametrize(("height", "moves"), [(0.4, False), (0.6, True)])
def test_a_climb_ends_where_a_full_step_foretells_enough(height: float, moves: bool) -> None:
    """Of a parabola a full step foretells all of the height: half a nat is enough, and no step is taken below it."""
    start = np.array([np.sqrt(2.0 * height)])

    def scores(u: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        return -0.5 * float(u @ u), -u, np.eye(1)

    top, _ = climb(scores, lambda points: -0.5 * np.sum(points**2, axis=1), start, enough=0.5)
    assert (top[0] != start[0]) == moves
    assert top[0] == pytest.approx(0.0 if moves else start[0])
