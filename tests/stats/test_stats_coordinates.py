import numpy as np
import pytest

from scruton.stats import Coordinates, Posterior, Prior

LAYOUT = Coordinates({"level": None, "damping": 3, "gain": 1, "none": 0, "n": None})


def test_scalars_and_vectors_stand_in_the_order_given():
    assert dict(LAYOUT) == {
        "level": 0, "damping": slice(1, 4), "gain": slice(4, 5), "none": slice(5, 5), "n": 5,
    }  # fmt: skip
    assert LAYOUT.size == 6


def test_a_block_may_start_anywhere():
    own = Coordinates({"a": None, "b": 2}, start=LAYOUT.stop)
    assert (own["a"], own["b"], own.size, own.start, own.stop) == (6, slice(7, 9), 3, 6, 9)


@pytest.mark.parametrize("shape", [(6,), (4, 6), (2, 3, 6)])
def test_values_are_views_and_writing_goes_through(shape):
    u = np.arange(np.prod(shape), dtype=float).reshape(shape)
    before, values = u.copy(), LAYOUT.of(u)
    np.testing.assert_array_equal(values["n"], before[..., 5])
    assert values["damping"].shape == (*shape[:-1], 3)
    values["damping"] = -1.0
    np.testing.assert_array_equal(u[..., 1:4], -1.0)
    np.testing.assert_array_equal(np.delete(u, [1, 2, 3], axis=-1), np.delete(before, [1, 2, 3], axis=-1))


def test_an_unknown_name_is_an_error_not_a_column():
    with pytest.raises(KeyError, match="dampings"):
        LAYOUT.of(np.zeros((2, 6)))["dampings"]


class Reordered(Posterior):
    def __init__(self, *names):
        self.priors = tuple(Prior(name, "normal", 0.0, 1.0) for name in names)

    def log_likelihood(self, u):
        here = self.named(u)
        return -((here["a"] - 1.0) ** 2) - 3.0 * here["b"]


def test_the_order_of_the_priors_is_nothing_to_the_likelihood():
    u = np.random.default_rng(0).standard_normal((5, 2))
    swapped = Reordered("b", "a")
    np.testing.assert_array_equal(Reordered("a", "b").log_likelihood(u), swapped.log_likelihood(u[:, ::-1]))
    assert swapped.prior("a").name == "a"
