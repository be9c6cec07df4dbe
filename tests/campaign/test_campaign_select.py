"""The tests that a user names, and the peak tests."""

from pathlib import Path

import pytest

from scruton.campaign import Campaign, Motion, Quantity, Rig, Section, Test, peak_tests, tests_named, tests_used
from scruton.errors import InputError


def a_test(name: str, rig: str, stable: float | None = None, peak: bool | None = None) -> Test:
    amplitude = None if stable is None else Quantity(stable)
    return Test(name, rig, Quantity(1.2), Quantity(5.0), peak, amplitude)


def campaign(*tests: Test) -> Campaign:
    rigs = tuple(Rig(name, Quantity(8.0), Quantity(7.0)) for name in ("1#", "2#"))
    return Campaign(Path("campaign.toml"), "", "", Section(Motion.HEAVING, 0.3, 0.075), rigs, tests)


def names(tests: tuple[Test, ...]) -> list[str]:
    return [test.name for test in tests]


def test_only_the_named_tests_are_used() -> None:
    whole = campaign(a_test("a", "1#"), a_test("b", "1#"), a_test("c", "2#"))
    part = tests_used(whole, ["c", "a"])
    assert names(part.tests) == ["a", "c"]
    assert part.rigs == whole.rigs
    with pytest.raises(InputError, match='tests: found no test "Sc 2"; wanted "Sc 1"'):
        tests_used(campaign(a_test("Sc 1", "1#"), a_test("other", "1#")), ["Sc 2"])
    with pytest.raises(InputError, match="found no test"):
        tests_used(campaign(), ["a"])


@pytest.mark.parametrize(
    ("wanted", "found"),
    [
        ("light, 3.1 m/s", ["light, 3.1 m/s"]),
        (["light, 3.1 m/s"], ["light, 3.1 m/s"]),
        ("light,3.1  m/s", ["light, 3.1 m/s"]),
        ("heavy,light, 3.1 m/s", ["light, 3.1 m/s", "heavy"]),
        ("light, 3.1 m/s, light", ["light", "light, 3.1 m/s"]),
        ("light,light,heavy", ["light", "heavy"]),
        ("a,b", ["a,b"]),
        ("a, b,b", ["a,b", "b"]),
        (["b", "light", "b"], ["light", "b"]),
        (None, []),
        ([], []),
    ],
)
def test_names_may_hold_commas(wanted: str | list[str] | None, found: list[str]) -> None:
    tests = (a_test(name, "1#") for name in ("light", "light, 3.1 m/s", "heavy", "a,b", "b"))
    assert list(tests_named(campaign(*tests), wanted)) == found


@pytest.mark.parametrize("wanted", ["", ",", "light, 3.2 m/s", ["light", "heavi"], "light,"])
def test_a_name_that_no_test_has_is_said(wanted: str | list[str]) -> None:
    with pytest.raises(InputError, match="tests: found no test"):
        tests_named(campaign(a_test("light", "1#"), a_test("heavy", "1#")), wanted)


def test_a_stated_peak_wins() -> None:
    tests = (a_test("a", "1#", 0.05), a_test("b", "1#", 0.02, peak=True), a_test("c", "2#", 0.01))
    assert names(peak_tests(campaign(*tests))) == ["b", "c"]


def test_else_the_largest_amplitude_stated_or_given() -> None:
    tests = (a_test("a", "1#", 0.02), a_test("b", "1#", 0.05), a_test("c", "1#"))
    assert names(peak_tests(campaign(*tests))) == ["b"]
    assert names(peak_tests(campaign(*tests), {"c": 0.06, "a": 1.0})) == ["c"]


def test_a_test_that_denies_being_the_peak_is_passed_over() -> None:
    tests = (a_test("a", "1#", 0.05, peak=False), a_test("b", "1#", 0.02))
    assert names(peak_tests(campaign(*tests))) == ["b"]


def test_without_any_amplitude_the_first() -> None:
    assert names(peak_tests(campaign(a_test("a", "1#"), a_test("b", "1#")))) == ["a"]
