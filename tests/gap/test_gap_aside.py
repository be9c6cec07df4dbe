"""A weak record blocks no diagnosis."""

from dataclasses import replace

import numpy as np
import pytest

from scruton.calibrate.challenge.case import simulate_case
from scruton.campaign import load_campaign
from scruton.campaign.quantity import Quantity
from scruton.dynamics.cycles import ABSENT
from scruton.envelope.inspection import SET_ASIDE
from scruton.errors import InputError
from scruton.gap.data import load_gap
from scruton.gap.diagnose import examine, left_out_tests
from scruton.gap.finding import place
from scruton.infer.cards import load_card


def test_a_weak_record_is_set_aside(small_campaign):
    campaign = load_campaign(small_campaign)
    (test,) = campaign.tests
    noise = 1e-4 * np.random.default_rng(1).normal(size=test.records[1].time.size)
    weak = replace(test.records[1], response=noise)
    data = load_gap(replace(campaign, tests=(replace(test, records=(test.records[0], weak)),)))
    assert data.layout.records == ("still.csv", "decay.csv")
    assert [remark.name for remark in data.campaign.remarks if remark.kind == SET_ASIDE] == ["growth.csv"]


def test_a_band_leaves_no_third_harmonic_to_be_sure_of(small_campaign):
    campaign = load_campaign(small_campaign)
    (test,) = campaign.tests
    banded = tuple(replace(record, band=(4.0, 14.0)) for record in test.records)
    data = load_gap(replace(campaign, tests=(replace(test, records=banded),)))
    in_wind = sum(data.cycles[record.name].time.size for record in banded)
    assert np.count_nonzero(data.channels.third_error == ABSENT) == in_wind
    assert not np.any(load_gap(campaign).channels.third_error == ABSENT)


def test_a_test_at_another_wind_speed_is_left_out_and_said_to_be(small_campaign):
    campaign = load_campaign(small_campaign)
    (test,) = campaign.tests
    assert left_out_tests(load_gap(campaign)) == []
    records = tuple(
        replace(record, name=f"slow-{record.name}", response=0.5 * record.response) for record in test.records
    )
    wind = Quantity(0.9 * test.wind_speed.mean)
    slow = replace(test, name="slow", wind_speed=wind, records=records, stable_amplitude=None)
    data = load_gap(replace(campaign, tests=(replace(test, stable_amplitude=None), slow)))
    assert not any(name.startswith("slow") for name in data.layout.records)
    (flag,) = left_out_tests(data)
    assert flag.startswith("Left out of the diagnosis: slow. ")
    assert f"the peak test alone is read ({test.name})" in flag
    assert "`scruton fit` gives every test parameters of its own" in flag


def test_a_test_that_repeats_the_peak_test_is_read_with_it_and_said_to_be(small_campaign):
    campaign = load_campaign(small_campaign)
    (test,) = campaign.tests
    records = tuple(replace(record, name=f"again-{record.name}") for record in test.records)
    again = replace(test, name="again", records=records, peak=None, stable_amplitude=None)
    data = load_gap(replace(campaign, tests=(replace(test, peak=True), again)))
    in_wind = data.layout.wind
    assert [name for name, wind in zip(data.layout.records, in_wind, strict=True) if wind] == [
        record.name for record in (*test.records, *records)
    ]
    assert np.unique(data.layout.test[in_wind]).tolist() == [0]
    assert data.at_other_speeds is None
    (flag,) = left_out_tests(data)
    assert flag.startswith(f"Tests of the same rig in the same wind as its peak test: again (of {test.name}). ")
    own = place(data, data.layout.records.index(records[0].name), "damping", 1.0, 0.1, "")
    assert own.test == "again"
    for other in (replace(again, peak=False), replace(again, wind_speed=Quantity(1.02 * test.wind_speed.mean))):
        assert not load_gap(replace(campaign, tests=(replace(test, peak=True), other))).repeats


@pytest.mark.filterwarnings("error")
def test_a_peak_test_without_records_has_nothing_that_repeats_it(small_campaign):
    campaign = load_campaign(small_campaign)
    (test,) = campaign.tests
    bare = replace(test, name="stated alone", records=(), peak=True, stable_amplitude=Quantity(0.05))
    assert not load_gap(replace(campaign, tests=(bare, replace(test, peak=None)))).repeats


def test_what_a_record_says_against_what_is_stated_is_said_beside_the_verdict(small_campaign):
    """A clock 10 % fast changes every rate of a record; `check` warned of it, and a diagnosis said "no gap" alone."""
    campaign = load_campaign(small_campaign)
    (test,) = campaign.tests
    fast = replace(test.records[1], time=1.1 * test.records[1].time)
    slipped = replace(campaign, tests=(replace(test, records=(test.records[0], fast)),))
    _, content, *_ = examine(slipped, load_card(), workers=1)
    (doubt,) = content["doubts"]
    assert doubt.startswith("growth.csv: the line followed is at")
    assert not examine(campaign, load_card(), workers=1)[1]["doubts"]


def test_records_of_one_test_in_two_units_are_refused(small_campaign):
    """A fit refused them, a diagnosis did not."""
    campaign = load_campaign(small_campaign)
    (test,) = campaign.tests
    records = tuple(
        replace(record, response=record.response / 1000.0) if record.name == "decay.csv" else record
        for record in test.records
    )
    with pytest.raises(InputError, match=r"a factor .* off the .*in the same test"):
        load_gap(replace(campaign, tests=(replace(test, records=records),)))


def test_a_record_that_runs_on_after_rest_keeps_as_much_of_rest_as_of_motion(small_campaign):
    """Friction ends a decay; with six times as much noise behind it friction and a memory were called unknown, 0.98."""
    campaign = load_campaign(small_campaign)
    (rig,) = campaign.rigs
    (still,) = rig.records
    step = float(np.median(np.diff(still.time)))
    time = still.time[0] + step * np.arange(6 * still.time.size)
    rest = 1e-5 * np.random.default_rng(1).normal(size=time.size)
    moved = np.r_[still.response, np.zeros(5 * still.time.size)] + rest
    data = load_gap(replace(campaign, rigs=(replace(rig, records=(replace(still, time=time, response=moved),)),)))
    cycles = load_gap(campaign).cycles["still.csv"].time.size
    assert data.cycles["still.csv"].time.size == pytest.approx(2 * cycles, abs=4)


def test_the_scruton_number_is_that_of_the_damping_that_decays_show_where_none_is_stated():
    campaign, _ = simulate_case(9001, 1, None, 0.0)
    stated = load_gap(campaign).layout.scruton_number
    silent = replace(campaign, rigs=tuple(replace(rig, damping_ratio=None) for rig in campaign.rigs))
    found = load_gap(silent).layout.scruton_number
    wind = np.isfinite(stated)
    np.testing.assert_allclose(found[wind], stated[wind], rtol=0.25)
    assert np.ptp(np.log(found[wind])) > 0.3


def test_sizes_refer_to_an_amplitude_of_a_test_that_stands():
    """What is left of a middle test that dies out was the unit of all sizes, and no loss of coherence was found."""
    campaign, _ = simulate_case(9001, 1, None, 0.0)
    before = load_gap(campaign)
    middle = before.tests[before.layout.test[before.middle]]

    def dying(record):
        fade = np.exp(-8.0 * (record.time - record.time[0]) / np.ptp(record.time))
        return replace(record, response=record.response * fade)

    tests = tuple(
        replace(test, records=tuple(map(dying, test.records))) if test.name == middle else test
        for test in campaign.tests
    )
    after = load_gap(replace(campaign, tests=tests))
    assert after.tests[after.layout.test[after.middle]] == middle
    assert after.layout.reference_amplitude > 0.3 * before.layout.reference_amplitude
