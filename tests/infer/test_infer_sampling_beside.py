"""Posteriors that a second process samples meanwhile."""

import numpy as np
import pytest

from scruton.errors import InputError
from scruton.infer.cards import load_card
from scruton.infer.sampling import ExcludedByPriorsError, Known, Sampling
from scruton.processes import SecondProcess


def held(known: Known) -> Known:
    return known


def refused(_: Known) -> Known:
    raise ExcludedByPriorsError("a", "", "a record", "another")


@pytest.fixture(scope="module")
def second():
    with SecondProcess() as second:
        yield second


def test_what_was_begun_is_known_once_it_is_waited_for(second):
    known = Known(second=second)
    known.begin("a", held, Known({"a": ("print", None)}))
    assert known.begun["a"].begun is not None
    known.wait("a")
    assert known == {"a": ("print", None)}
    known.begin("a", held, Known())  # it is known
    assert not known.begun


def test_what_fails_beside_is_left_to_who_asks_for_it(second):
    known = Known(second=second)
    known.begin("a", refused, Known())
    known.wait("a")
    assert not known


def test_what_is_not_begun_is_never_done_beside():
    nobody = SecondProcess(beside=False)
    known = Known(second=nobody)
    known.begin("a", held, Known({"a": ("print", None)}))
    known.wait("a")
    assert not known
    assert not nobody.waiting


def test_nothing_is_begun_without_a_second_process():
    sampling = Sampling(load_card(), 0)
    sampling.begin("a", None, np.zeros(1))
    assert not sampling.known.begun


def test_work_that_is_not_begun_is_done_where_its_result_is_wanted():
    nobody = SecondProcess(beside=False)
    assert nobody.begin(held, Known())() == {}
    with pytest.raises(InputError):
        nobody.begin(refused, Known())()
