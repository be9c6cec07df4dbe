"""A weak record blocks no diagnosis."""

from dataclasses import replace

import numpy as np
import pytest

from scruton.campaign import load_campaign
from scruton.dynamics.cycles import ABSENT
from scruton.envelope.inspection import SET_ASIDE
from scruton.errors import InputError
from scruton.gap.data import load_gap
from scruton.gap.diagnose import left_out_tests


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
    slow = replace(test, name="slow", records=records, stable_amplitude=None)
    data = load_gap(replace(campaign, tests=(replace(test, stable_amplitude=None), slow)))
    assert not any(name.startswith("slow") for name in data.layout.records)
    (flag,) = left_out_tests(data)
    assert flag.startswith("Left out of the diagnosis: slow. ")
    assert f"the peak test alone is read ({test.name})" in flag
    assert "`scruton fit` gives every test parameters of its own" in flag


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
