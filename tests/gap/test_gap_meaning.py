"""What a verdict means, in numbers and in words."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from scruton.calibrate.challenge.case import simulate_case
from scruton.dynamics.effects import CATALOGUE, UNKNOWN, Parameter
from scruton.dynamics.effects.effect import Extent
from scruton.gap.attribute import weigh
from scruton.gap.check import check, knocked
from scruton.gap.data import load_gap
from scruton.gap.diagnose import examine
from scruton.gap.diagnosis import fit_null
from scruton.gap.lines import SecondLine
from scruton.gap.meaning import foremost_line, lines_words, meaning
from scruton.gap.screen import Screen
from scruton.gap.shrink import _fraction
from scruton.gap.sizes import _quantiles, whose
from scruton.infer.cards import load_card
from scruton.report.chapters.gap import gap_summary
from scruton.report.chapters.gap_words import gap_sentence, shrink_sentence
from scruton.report.render_text import render_text
from tests.gap.few import among
from tests.report.fake_parts import GAP as MADE_UP

SEED = 900
GAP: dict[str, Any] = MADE_UP


def examined(effect: str, index: int, *rivals: str) -> dict[str, Any]:
    card = replace(load_card(), effect_weights=among(*rivals))
    return examine(simulate_case(SEED, index, effect, 0.3)[0], card, workers=1)[1]


@pytest.fixture(scope="module")
def jumped() -> dict[str, Any]:
    return examined("time_jump", 4, "wind_speed_drift", "aerodynamic_damping_nonlinearity", "fluid_memory")


@pytest.fixture(scope="module")
def settings() -> dict[str, Any]:
    return examined("setting_dependence", 6, "setting_dependence", "reduced_velocity_drift", "sensor_gain_error")


@pytest.mark.thorough
def test_an_unknown_cause_is_described(jumped: dict[str, Any]) -> None:
    assert jumped["verdict"] == "unknown"
    seen = jumped["unknown"]
    assert "of the drive" in seen["text"]
    assert seen["coloured"]
    assert seen["largest"] > 0.1
    assert seen["records"]
    assert seen["form"] in seen["text"]
    low, high = seen["amplitude"]
    assert 0.0 < low < high
    assert f"{high:.3g} A/D" in seen["text"] or f"{np.degrees(high):.3g} deg" in seen["text"]


def test_jumps_are_found_where_and_as_they_are() -> None:
    campaign, answer = simulate_case(900, 5, "time_jump", 0.3)
    data, null = fit_null(load_gap(campaign, load_card()))
    each = [one for one in UNKNOWN.variants(data.layout) if one.scan and one.scope.extent is Extent.EACH_RECORD]
    assert len(each) == 1
    found = null.with_variants(each[0], start=Screen(null).scan(each[0]).start)
    true = [record for rig in answer["rigs"] for record in rig["records"].values()]
    assert len(true) == np.count_nonzero(data.layout.wind)
    np.testing.assert_allclose(found.value("moment", 0)[0], [-one["jump_time"] for one in true], atol=0.02)
    np.testing.assert_array_equal(np.sign(found.value("size", 0)[0]), np.sign([one["jump_drive"] for one in true]))
    assert found.log_evidence > null.log_evidence + 100.0


def test_what_moves_is_said_at_the_bridges_own_scruton_numbers() -> None:
    campaign, _ = simulate_case(SEED, 7, "aerodynamic_damping_nonlinearity", 0.3)
    data, null = fit_null(load_gap(campaign))
    name = "aerodynamic_damping_nonlinearity"
    final = weigh(null, [CATALOGUE[name]])[name].best
    found: Any = SimpleNamespace(verdict=name, found=(name,), data=data, null=null, final=final)
    middle = data.layout.scruton_number[data.middle]
    (alone,) = (here := meaning(found))["at"]
    assert alone == {"scruton_number": middle, "amplitude_change": here["amplitude_change"]}
    assert "at the middle Scruton number moves by" in here["moves"]
    there = meaning(found, [middle, 2.0 * middle])
    same, other = (one["amplitude_change"] for one in there["at"])
    assert there["amplitude_change"] == same
    assert abs(same - other) > 1e-3
    assert f"at Sc {middle:.4g} moves by" in there["moves"]
    assert f", at Sc {2.0 * middle:.4g} moves by" in there["moves"]


def test_knocks_are_told_from_noise_and_named() -> None:
    campaign, _ = simulate_case(SEED, 1, None, 0.0)
    tests = list(campaign.tests)
    record = tests[1].records[0]
    _, quiet = fit_null(load_gap(campaign))
    assert check(quiet).knocks < 0.0
    omega, rate = 2.0 * np.pi * campaign.rigs[1].frequency.mean, 0.01
    since = record.time - 0.6 * record.time[-1]
    blow = 0.6 * np.abs(record.response).max() * np.exp(-rate * omega * np.maximum(since, 0.0)) * np.sin(omega * since)
    struck = replace(record, response=record.response + np.where(since > 0.0, blow, 0.0))
    tests[1] = replace(tests[1], records=(struck, *tests[1].records[1:]))
    _, null = fit_null(load_gap(replace(campaign, tests=tuple(tests))))
    assert check(null).knocks > 15.0
    assert [name for name, nats in knocked(null).items() if nats > 0.0] == [record.name]


@pytest.mark.thorough
def test_an_unknown_cause_has_advice_that_can_be_followed(jumped: dict[str, Any]) -> None:
    assert any(line.startswith("a repeat of ") and "comes again" in line for line in jumped["advice"])
    assert not any("no further record" in line for line in jumped["advice"])


@pytest.mark.thorough
def test_an_unknown_cause_widens_the_bands_and_says_so(jumped: dict[str, Any]) -> None:
    meaning = jumped["meaning"]
    assert meaning["amplitude_change"] >= 0.0
    assert "It has no equation" in meaning["text"]
    assert "`scruton fit CAMPAIGN --effect auto`, or `scruton report`, puts it in; " in meaning["text"]


@pytest.mark.thorough
def test_settings_that_differ_ask_for_one_rig_at_other_speeds(settings: dict[str, Any]) -> None:
    assert settings["verdict"] == "setting_dependence"
    (line, *_) = settings["advice"]
    assert "at two more wind speeds, U/(f D) =" in line
    assert settings["unknown"] == {}
    labels = set(settings["effects"]["setting_dependence"]["parameters"])
    tests = {test["test"] for test in settings["shrink"]["stable_amplitude"]}
    assert all(label.partition("[")[2].rstrip("]") in {"", *tests} for label in labels), "sizes are labelled by test"


@pytest.mark.thorough
def test_the_headline_counts_the_tests_that_were_left_out(settings: dict[str, Any]) -> None:
    shrink = settings["shrink"]
    head, tests = shrink["headline"], shrink["stable_amplitude"]
    assert head["tests"] == len(tests) == len(shrink["damping_discrepancy"]["tests"])
    assert head["amplitude_worse"] == sum(test["error_after"] > test["error_before"] for test in tests)
    assert head["amplitude_before"] == pytest.approx(np.median([test["error_before"] for test in tests]))
    words = shrink_sentence(shrink)
    assert words.startswith("Of tests left out in turn, the stable amplitude is off by")
    assert (f"made worse in {head['amplitude_worse']} of {head['tests']}" in words) == bool(head["amplitude_worse"])


def test_a_fraction_lies_between_minus_one_and_one() -> None:
    assert _fraction(np.array([10.0, 10.0]), np.array([5.0, 5.0])) == 0.5
    assert _fraction(np.array([10.0]), np.array([200.0])) == -1.0
    assert _fraction(np.array([10.0]), np.array([-200.0])) == 1.0


SURE = {
    "verdict": "coulomb_friction",
    "also": ["stiffness_nonlinearity"],
    "probability": {"none": 0.01, "coulomb_friction": 0.93, "fluid_memory": 0.06},
    "probability_also": {"stiffness_nonlinearity": 0.85},
}


def test_a_verdict_below_four_fifths_is_not_settled() -> None:
    assert gap_sentence(SURE) == (
        "The null model and the records part. What explains it: dry friction (probability 0.93) and frequency varies "
        "with amplitude (0.85)."
    )
    unsure = SURE | {"probability": {"none": 0.13, "coulomb_friction": 0.38, "fluid_memory": 0.32, "unknown": 0.17}}
    assert gap_sentence(unsure) == (
        "The null model and the records part. Not settled: dry friction (38 %) or the wake lags (32 %) or something "
        "that is not in the catalogue (17 %); no gap 13 %; beside it frequency varies with amplitude (0.85)."
    )


def test_a_further_effect_below_four_fifths_is_not_settled_either() -> None:
    weak = SURE | {
        "also": ["stiffness_nonlinearity", "structural_damping_nonlinearity"],
        "probability_also": {"stiffness_nonlinearity": 0.98, "structural_damping_nonlinearity": 0.071},
    }
    assert gap_sentence(weak) == (
        "The null model and the records part. What explains it: dry friction (probability 0.93) and frequency varies "
        "with amplitude (0.98); not settled: beside it perhaps structural damping that varies with amplitude (7 %)."
    )
    unsure = weak | {"probability": {"none": 0.13, "coulomb_friction": 0.45, "fluid_memory": 0.42}}
    assert gap_sentence(unsure).endswith(
        "no gap 13 %; beside it frequency varies with amplitude (0.98) and perhaps structural damping that varies with "
        "amplitude (7 %)."
    )
    least = weak | {"probability_also": {"stiffness_nonlinearity": 0.98, "structural_damping_nonlinearity": 0.0014}}
    assert gap_sentence(least).endswith("(below 1 %).")


def printed(**changes: Any) -> str:
    """The terminal's text of a diagnosis made up."""
    return render_text(gap_summary(GAP | changes, "rad"))


def test_the_terminal_says_of_every_further_effect_how_probable_it_is() -> None:
    beside = {"also": ["stiffness_nonlinearity"], "probability_also": {"stiffness_nonlinearity": 0.4}}
    text = printed(**beside)
    assert text.startswith(
        "Verdict: coulomb_friction; not settled: beside it perhaps stiffness_nonlinearity (40 %). Dry friction. "
        "Perhaps frequency varies with amplitude."
    )
    assert "beside it: stiffness_nonlinearity" in text
    assert printed().startswith("Verdict: coulomb_friction. Dry friction.")
    others = {"stiffness_nonlinearity": 0.4, "none": 0.2, "unknown": 0.05, "fluid_memory": 0.35}
    text = printed(**beside, in_its_place={"stiffness_nonlinearity": others})
    assert "not settled: beside it perhaps stiffness_nonlinearity (40 %) or fluid_memory (35 %). Dry friction" in text


def test_what_an_unsettled_verdict_would_mean_is_said_under_a_condition() -> None:
    likely = {"none": 0.1, "coulomb_friction": 0.5, "fluid_memory": 0.4}
    text = printed(probability=likely, meaning={"text": "The amplitude moves."})
    assert text.startswith(
        "Not settled: coulomb_friction (50 %) or fluid_memory (40 %); no gap 10 %. If it is coulomb_friction: dry "
        "friction. If it is fluid_memory: the wake lags."
    )
    assert "If it is coulomb_friction: the amplitude moves." in text
    assert "Parameters, if it is coulomb_friction" in text


def test_held_out_errors_stand_by_test_before_the_density() -> None:
    shrink = GAP["shrink"] | {
        "stable_amplitude": [{"test": "Sc 5", "rig": "r1", "scruton_number": 4.9, "measured": 0.1, "error_before": 0.05,
                              "error_after": 0.01}],
        "damping_discrepancy": {"tests": [{"test": "Sc 5", "before": 0.2, "after": 1.5}]},
    }  # fmt: skip
    text = printed(shrink=shrink)
    (row,) = [line.split() for line in text.splitlines() if line.startswith("Sc 5")]
    assert row == ["Sc", "5", "r1", "4.9", "5.73", "5.0", "%", "1.0", "%", "20.0", "%", "150.0", "%"]
    assert text.index("Sc 5") < text.index("Put into the model") < text.index("Probability")


def test_in_still_air_held_out_errors_stand_by_record() -> None:
    curves = {"tests": [], "records": [{"record": "one.csv", "rig": "r1", "before": 0.2, "after": 0.03}]}
    text = printed(shrink=GAP["shrink"] | {"damping_discrepancy": curves})
    (row,) = [line.split() for line in text.splitlines() if line.startswith("one.csv")]
    assert row == ["one.csv", "r1", "20.0", "%", "3.0", "%"]
    assert "over the structural damping" in text


def test_a_size_stands_with_what_it_belongs_to_and_as_a_person_would_write_it() -> None:
    size = {"median": -0.339, "interval90": [-0.399, -0.279], "unit": "tenths of the frequency", "form": "as A"}
    effects = {"stiffness_nonlinearity": {"parameters": {"size": size | {"of": "every record"}}}}
    text = printed(effects=effects)
    (row,) = [line for line in text.splitlines() if line.startswith("stiffness_nonlinearity")]
    assert row.split()[1:] == [
        "size", "every", "record", "-3.39", "-3.99", "..", "-2.79", "%", "of", "the", "frequency", "as", "A"
    ]  # fmt: skip


def test_what_sizes_belong_to_has_its_name() -> None:
    layout = SimpleNamespace(
        records=("a", "b", "c", "d", "e"), rig=np.array([0, 0, 0, 1, 1]), test=np.array([-1, 0, 0, -1, 1]),
        wind=np.array([False, True, True, False, True]),
    )  # fmt: skip
    data: Any = SimpleNamespace(layout=layout, rigs=("r1", "r2"), tests=("Sc 2", "Sc 9"))
    for records, words in {
        "abcde": "every record", "bce": "every test", "abc": "rig r1", "bc": "test Sc 2", "b": "record b",
        "e": "test Sc 9", "d": "record d", "bd": "records b, d", "abce": "4 records",
    }.items():  # fmt: skip
        assert whose(data, np.array([name in records for name in layout.records])) == words


@pytest.mark.thorough
def test_sizes_and_errors_name_rig_test_and_record(settings: dict[str, Any], jumped: dict[str, Any]) -> None:
    for one in settings["shrink"]["stable_amplitude"]:
        assert one["rig"].startswith("rig")
        assert one["scruton_number"] > 0.0
    for key, size in settings["effects"]["setting_dependence"]["parameters"].items():
        if "[" in key:
            assert size["of"] == f"test {key.partition('[')[2].rstrip(']')}"
    assert all(size["of"] for size in jumped["effects"]["unknown"]["parameters"].values())
    assert jumped["unknown"]["unit"] == "of the drive"
    jumps = [one for key, one in jumped["effects"]["unknown"]["parameters"].items() if key.startswith("size")]
    assert jumps
    assert all(one["unit"] == "of the drive" for one in jumps)


def test_the_line_that_stands_in_most_records_is_named() -> None:
    cycles = {name: SimpleNamespace(amplitude=np.full(9, 0.05), reference_frequency=10.0) for name in "abcd"}
    data: Any = SimpleNamespace(cycles=cycles)
    lines = [
        SecondLine("a", 14.66, 0.004, 90.0),
        SecondLine("b", 35.4, 0.0005, 40.0),
        SecondLine("c", 36.2, 0.001, 50.0),
        SecondLine("d", 7.0, 0.0001, 35.0),
    ]
    assert {line.record for line in foremost_line(lines)} == {"b", "c"}
    assert lines_words(lines, data) == (
        "35.4 to 36.2 Hz in 2 records, most in c (3.62 times the frequency of the response, 2 % of its amplitude), and "
        "others in 2 records"
    )
    assert lines_words(lines[:1], data).startswith("14.66 Hz in a (1.47 times")


@pytest.mark.thorough
def test_the_strongest_places_of_an_unknown_are_where_it_acts(jumped: dict[str, Any]) -> None:
    _, _, strongest = jumped["unknown"]["text"].partition("Strongest: ")
    there = set(jumped["unknown"]["records"])
    places = [place for place in jumped["where"] if place["record"] is not None]
    away = {f"{one['quantity']} in {one['record']}" for one in places if one["record"] not in there}
    assert not any(one in strongest for one in away)
    assert len(there) == len(jumped["where"]) or strongest


def test_a_runner_up_that_does_better_on_records_held_out_is_said() -> None:
    shrink = GAP["shrink"] | {"runner_up": {"effect": "fluid_memory", "fraction": 0.99, "amplitude_error": 0.03}}
    assert shrink_sentence(shrink).endswith(
        "Of records held out the verdict is not the best account: the runner-up (the wake lags) would close 99 %, and "
        "leave the amplitude off by 3.0 %."
    )
    worse = shrink | {"runner_up": shrink["runner_up"] | {"fraction": 0.5}}
    assert "not the best account" not in shrink_sentence(worse)


def test_places_have_their_units_and_lists_that_end_say_so() -> None:
    place = GAP["where"][0] | {"rig": "r"}
    kinds = ("test", "branch", "spectrum", "scatter", "frequency")
    where = [place | {"quantity": quantity, "excess": 0.01} for quantity in kinds]
    size = {"median": 0.1, "interval90": [0.09, 0.11], "unit": "of the relaxation damping", "form": "friction"}
    effects = {"coulomb_friction": {"parameters": {f"size[{i}]": size for i in range(9)}}}
    text = printed(where=where, effects=effects, sizes_refer_to="the null model at Sc 5")
    ends = {line.split()[0]: line.split()[-2:] for line in text.splitlines() if " r  still air" in line}
    assert ends["test"] == ends["branch"] == ends["frequency"] == ["1", "%"]
    assert ends["spectrum"] == ["0.573", "deg"]
    assert ends["scatter"][-1] == "0.01"
    told = place | {"quantity": "scatter", "detail": "excess kurtosis of the innovations"}
    assert "excess kurtosis of the innovations" in printed(where=[told]), "a number without a unit has words"
    assert "reference amplitude are those of the null model at Sc 5. 3 more are in gap.json." in text


def test_what_was_not_read_is_said() -> None:
    assert "  ! Left out" in printed(flags=["Left out of the diagnosis: B."])


def test_that_nothing_was_found_may_be_unsettled_too() -> None:
    likely = {"none": 0.27, "coulomb_friction": 0.16, "fluid_memory": 0.14, "unknown": 0.05}
    nothing = {"verdict": "none", "also": [], "probability": likely}
    assert gap_sentence(nothing) == (
        "Nothing is found that must be there. Not settled: no gap (27 %), or dry friction (16 %) or the wake lags "
        "(14 %)."
    )
    sure = {"none": 0.82, "coulomb_friction": 0.18}
    assert gap_sentence(nothing | {"probability": sure}) == "The null model and the records agree within their noise."


@pytest.mark.parametrize(("centre", "sd"), [(1.0, 0.1), (0.0, 1.0), (-2.0, 1.0), (-40.0, 1.0)])
def test_what_cannot_be_negative_has_an_interval_above_zero(centre: float, sd: float) -> None:
    size = Parameter("size", 0.0, 1.0, np.zeros(1, dtype=int), positive=True)
    low, middle, high = _quantiles(size, centre, sd)
    assert 0.0 < low < middle < high < np.inf
    above = stats.truncnorm((0.0 - centre) / sd, np.inf, centre, sd)
    assert (low, middle, high) == pytest.approx(above.ppf([0.05, 0.5, 0.95]), rel=1e-6)
