"""A natural frequency that the free decays contradict is not used in silence."""

from dataclasses import replace

import pytest

from scruton.campaign import load_campaign
from scruton.envelope import gather, inspection, usable
from scruton.envelope.inspection import record_cycles
from scruton.errors import InputError


def stated(folder, frequency, sd=None):
    campaign = load_campaign(folder)
    (rig,) = campaign.rigs
    return replace(campaign, rigs=(replace(rig, frequency=replace(rig.frequency, mean=frequency, sd=sd)),))


@pytest.mark.parametrize(
    ("frequency", "sd", "used"),
    [(7.87, None, 7.87), (7.95, None, 7.95), (8.6, None, 7.87), (6.9, None, 7.87), (8.6, 0.5, 8.6)],
    ids=["right", "retuned", "high", "low", "uncertain"],
)
def test_the_free_decays_decide_beyond_what_is_stated(small_campaign, frequency, sd, used):
    campaign = stated(small_campaign, frequency, sd)
    for found in (usable(campaign)[0], gather(campaign).campaign):
        assert found.rigs[0].frequency.mean == pytest.approx(used, rel=1e-3)
        assert [one.kind for one in found.remarks] == ([] if used == frequency else ["natural frequency"])
    once = usable(campaign)[0]
    assert usable(once)[0] is once


def test_another_frequency_altogether_is_refused(small_campaign):
    campaign = stated(small_campaign, 10.2)
    with pytest.raises(InputError, match=r"campaign.toml: rigs\[0\].frequency: found 10.2 Hz; wanted .*7.8"):
        usable(campaign)
    assert gather(campaign).campaign.rigs[0].frequency.mean == 10.2  # a check goes on, and remarks on the records


def test_a_record_that_fails_at_the_frequency_found_is_set_aside(small_campaign, monkeypatch):
    """It brought the command down."""

    def fails(record, frequency, *more):
        if record.name == "decay.csv" and frequency < 8.0:
            raise InputError(record.path, record.field, "no motion", "one")
        return record_cycles(record, frequency, *more)

    monkeypatch.setattr(inspection, "record_cycles", fails)
    kept, cycles = usable(stated(small_campaign, 8.6))
    assert sorted(cycles) == ["growth.csv", "still.csv"]
    assert [one.kind for one in kept.remarks] == ["natural frequency", inspection.SET_ASIDE]
