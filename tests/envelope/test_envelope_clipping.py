"""Cycles that the sensor cut off are left out of what is fitted, said, and kept for a diagnosis."""

import re
from dataclasses import replace

import numpy as np
import pytest

from scruton.campaign import load_campaign
from scruton.envelope import gather, review, usable
from scruton.errors import InputError

RECORDS = ("still.csv", "decay.csv")


def clipped(campaign, part, names=RECORDS):
    """The campaign with a range that ends at a part of the largest reading of each record."""

    def cut(records):
        return tuple(
            replace(one, response=np.clip(one.response, *(part * np.array([-1, 1]) * np.abs(one.response).max())))
            if one.name in names else one
            for one in records
        )  # fmt: skip

    rigs = tuple(replace(rig, records=cut(rig.records)) for rig in campaign.rigs)
    tests = tuple(replace(test, records=cut(test.records)) for test in campaign.tests)
    return replace(campaign, rigs=rigs, tests=tests)


@pytest.mark.parametrize("name", RECORDS)
@pytest.mark.parametrize("part", [0.9, 0.6])
def test_the_amplitudes_that_are_left_are_those_of_the_whole_wave(small_campaign, name, part):
    campaign = load_campaign(small_campaign)
    whole, cut = (usable(one)[1][name] for one in (campaign, clipped(campaign, part, [name])))
    largest = whole.amplitude.max()
    there = np.interp(cut.time, whole.time, whole.amplitude)
    assert np.abs(cut.amplitude - there).max() < 0.02 * largest
    assert cut.amplitude.max() < 1.02 * part * largest
    assert np.count_nonzero(whole.amplitude < 0.95 * part * largest) <= cut.time.size + 2


def test_it_is_said_in_one_line(small_campaign):
    remarks = review(gather(clipped(load_campaign(small_campaign), 0.6)))
    kinds = [(one.kind, one.name) for one in remarks if one.kind in ("clipped", "gap")]
    assert sorted(kinds) == [("clipped", "decay.csv"), ("clipped", "still.csv")]
    (said,) = (one.text for one in remarks if one.name == "decay.csv" and one.kind == "clipped")
    assert re.search(
        r"clipped above and below: readings stand in a row .*A/D from the mean.* left out of what is fitted", said
    )


def test_a_diagnosis_keeps_them(small_campaign):
    campaign = clipped(load_campaign(small_campaign), 0.6)
    kept, cycles = usable(campaign, clipped=True)
    assert kept is campaign
    assert cycles["decay.csv"].time.size > usable(campaign)[1]["decay.csv"].time.size


def test_a_record_that_is_clipped_throughout_is_set_aside(small_campaign):
    campaign = clipped(load_campaign(small_campaign), 0.1, ["decay.csv"])
    kept, cycles = usable(campaign)
    assert "decay.csv" not in cycles
    assert any("set aside: " in one.text and "beside the cycles that are clipped" in one.text for one in kept.remarks)
    with pytest.raises(InputError, match=r"decay.csv: .*beside the cycles that are clipped"):
        usable(campaign, strict=True)
