"""Results to the content of a JSON document, and back."""

import json
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pytest

from scruton.arrays import BoolArray, FloatArray
from scruton.documents import as_json, from_json


@dataclass(frozen=True)
class Inner:
    value: float
    low: float | None = None


@dataclass(frozen=True, eq=False)
class Outer:
    name: str
    curve: FloatArray
    kept: BoolArray
    pair: tuple[float, float]
    inner: tuple[Inner, ...]
    by_law: Mapping[str, float | None]
    mass: float | None
    extra: Inner | None = None


def outer(**options):
    return Outer(
        "a", np.array([1.0, np.inf, np.nan]), np.array([True, False]), (1.0, 2.0), (Inner(np.nan), Inner(1.0, np.inf)),
        {"n=-1": None, "n=2": 3.0}, None, **options,
    )  # fmt: skip


def test_what_is_written_is_read_and_written_again_alike():
    content = as_json(outer())
    assert content == {
        "name": "a", "curve": [1.0, None, None], "kept": [True, False], "pair": [1.0, 2.0],
        "inner": [{"value": None}, {"value": 1.0, "low": None}], "by_law": {"n=-1": None, "n=2": 3.0}, "mass": None,
    }  # fmt: skip
    back = from_json(Outer, json.loads(json.dumps(content, allow_nan=False)))
    assert as_json(back) == content
    assert back.kept.dtype == bool
    assert np.isnan(back.inner[1].low)
    assert back.inner[0].low is None
    assert as_json(from_json(Outer, as_json(outer(extra=Inner(2.0)))))["extra"] == {"value": 2.0}


@pytest.mark.parametrize("key", ["name", "curve", "mass"])
def test_a_field_that_is_missing_is_an_error(key):
    content = as_json(outer())
    del content[key]
    with pytest.raises(KeyError, match=key):
        from_json(Outer, content)


def test_a_pair_of_three_is_an_error():
    with pytest.raises(ValueError, match="longer"):
        from_json(Outer, as_json(outer()) | {"pair": [1.0, 2.0, 3.0]})
