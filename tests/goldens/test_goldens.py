"""Nothing that a user sees has changed: the cheap part in every run, the whole with `make slow` or `make goldens`."""

import json

import pytest

from tests.goldens.__main__ import chosen, compare, main
from tests.goldens.leaves import differences, form, kept, leaves, spelled
from tests.goldens.masks import masked
from tests.goldens.parts import FAST, PARTS, compute, golden


@pytest.mark.parametrize("name", FAST)
def test_what_is_cheap_is_as_it_was(name, capsys):
    apart = compare(name, compute(name), "")
    assert not apart, capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in PARTS if name not in FAST])
def test_everything_is_as_it_was(name, capsys):
    code = main(["compare", "--only", name, "--jobs", "1"])
    assert code == 0, capsys.readouterr().out


def test_every_part_has_a_golden_and_every_golden_a_part():
    kept_files = {one.stem for one in golden("x").parent.glob("*.json")}
    assert kept_files == set(PARTS)


def test_a_difference_is_told_by_its_path():
    wanted = {"a": [1.0, "x"], "b": {"c": 2.0, "gone": True}}
    found = {"a": [1.0 + 1e-9, "y"], "b": {"c": 2.1, "new": None}}
    assert differences(wanted, found, 1e-6, 0.0) == [
        '/a[1]: wanted "x", found "y"',
        "/b/c: wanted 2.0, found 2.1",
        "/b/gone: wanted true, found (nothing)",
        "/b/new: wanted (nothing), found null",
    ]


def test_a_truth_is_no_number_and_an_empty_list_is_a_leaf():
    assert differences({"a": 1}, {"a": True}, 1.0, 1.0)
    assert differences({"a": []}, {"a": {}}, 1.0, 1.0)


def test_the_mean_of_what_cancels_may_move_with_its_extremes():
    wanted = {"min": -1.0, "max": 1.0, "mean": 1e-9}
    assert not differences(wanted, wanted | {"mean": -1e-9}, 1e-6, 0.0)
    assert differences(wanted, wanted | {"mean": 1e-5}, 1e-6, 0.0)


def test_long_arrays_are_summarised_and_texts_are_lines():
    found = kept({"x": list(range(100)), "y": [1.0, 2.0], "text": "a \nb\n"})
    assert found["x"] == {"shape": [100], "not finite": 0, "min": 0, "max": 99, "mean": 49.5, "first": 0, "last": 99}
    assert found["y"] == [1.0, 2.0]
    assert found["text"] == ["a", "b"]
    assert json.loads(spelled(found)) == found
    assert len(dict(leaves(found))) == 11


def test_of_another_arithmetic_the_form_is_compared():
    wanted = {"text": ["Sc 1.13  0.0024  -1e-3", "---- --", "dead"], "n": {"min": 1, "fine": True}}
    found = {"text": ["Sc 1.13 0.1 +2", "----- ---", "dead"], "n": {"min": 2.5, "fine": True}}
    assert form(wanted) == form(found)
    for other in (
        {"text": ["Sc 1 2", "--- ---", "dead"]},
        {"n": {"min": "nan", "fine": True}},
        {"n": {"min": 1, "fine": False}},
    ):
        assert form(wanted) != form(found | other)


def test_what_is_volatile_is_masked():
    found = masked({"versions": {"numpy": "2"}, "text": f"/room/x of 2026-01-02T03:04:05Z, {'0' * 64}"}, "/room")
    assert found == {"versions": "<volatile>", "text": "<room>/x of <moment>, <sha256>"}


def test_a_part_that_is_not_known_is_refused():
    assert chosen(["fit-py*"]) == ["fit-pylon", "fit-pylon-torsional"]
    with pytest.raises(SystemExit, match="no part is called nothing"):
        chosen(["nothing"])
