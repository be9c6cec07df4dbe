"""Other modes that a release sets going: found, taken out, and what is none left where it is."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scruton.campaign import load_campaign
from scruton.campaign.remarks import Severity
from scruton.campaign.schema import Kind, Record
from scruton.envelope.inspection import record_cycles, usable
from scruton.envelope.other_modes import (
    OTHER_MODE,
    OtherMode,
    Tracked,
    remark_on,
    without_other_modes,
    without_suspected_modes,
)

RATE, F, LENGTH = 200.0, 5.0, 30.0
MODE = OtherMode(2.1, 0.25, 0.02 * np.exp(0.7j))


def record(*modes, steady=0.0, step=1.0 / RATE, jitter=0.0, quantum=0.0, kind=Kind.DECAY, seed=1):
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, LENGTH, step)
    t = np.sort(t + jitter * step * rng.uniform(-1.0, 1.0, t.size))
    y = (0.2 + 0.3 * np.exp(-0.12 * t)) * np.cos(2.0 * np.pi * F * t) + steady * np.cos(2.0 * np.pi * 2.1 * t)
    y = y + sum(mode.motion(t) for mode in modes) + 2e-4 * rng.standard_normal(t.size)
    return Record("a.csv", Path("a.csv"), kind, t, quantum * np.round(y / quantum) if quantum else y)


def again(left):
    return record_cycles(left, F)


def found(one):
    return taken(one)[1].released


def taken(one):
    cleared = without_other_modes(Tracked(one, record_cycles(one, F)), again)
    return cleared.record, cleared.cycles


def suspecting(one, suspect):
    cleared = without_suspected_modes(Tracked(one, record_cycles(one, F)), again, [suspect])
    return cleared.record, cleared.cycles.released


@pytest.mark.parametrize("how", [{}, {"jitter": 0.2}, {"quantum": 2e-3}], ids=["even", "jitter", "rounded"])
def test_a_mode_that_dies_away_is_found(how):
    (mode,) = found(record(MODE, **how))
    assert mode.frequency == pytest.approx(2.1, abs=0.003)
    assert mode.rate == pytest.approx(0.25, rel=0.1)
    assert abs(mode.amplitude) == pytest.approx(0.02, rel=0.1)
    assert mode.relative == pytest.approx(0.02 / 0.5, rel=0.15)


def test_several_are_found_largest_first():
    modes = found(record(MODE, OtherMode(8.4, 0.5, 0.01 + 0j)))
    assert [mode.frequency for mode in modes] == pytest.approx([2.1, 8.4], abs=0.02)


def test_what_is_taken_out_is_no_longer_there():
    one = record(MODE)
    left, clean = taken(one)
    track, bare = record_cycles(one, F), record_cycles(record(), F)
    assert np.std(clean.amplitude - bare.amplitude) < 0.1 * np.std(track.amplitude - bare.amplitude)
    assert found(left) == ()


@pytest.mark.parametrize(
    "one",
    [
        record(),
        record(steady=0.02),  # a line that lasts is no free vibration
        record(OtherMode(2.1, 0.25, 0.08 + 0j)),  # so large it is a motion of two modes
        record(OtherMode(10.02, 0.25, 0.02 + 0j)),  # a harmonic of the motion
        record(OtherMode(2.1, 2.0, 0.02 + 0j)),  # damped so much it is no vibration
        replace(record(MODE), band=(3.0, 7.0)),
    ],
    ids=["none", "lasts", "large", "harmonic", "damped", "filtered"],
)
def test_what_is_none_is_left_where_it_is(one):
    assert found(one) == ()


def test_a_record_that_the_sensor_cuts_off_is_left_as_it_is():
    one = record(MODE)
    assert found(replace(one, response=np.clip(one.response, -0.4, 0.4))) == ()


def test_the_remark_names_frequency_and_size():
    one = record(MODE)
    text = remark_on(one, found(one)).text
    assert re.match(r"another mode, (4|3\.9) % of the motion", text)
    assert "2.1 Hz" in text


def test_a_campaign_is_used_without_them(small_campaign):
    campaign = load_campaign(small_campaign)
    (rig,) = campaign.rigs
    still = rig.records[0]
    mode = OtherMode(2.9, 0.3, 0.02 * np.ptp(still.response), since=still.time[0])
    shaken = replace(still, response=still.response + mode.motion(still.time))
    kept, cycles = usable(replace(campaign, rigs=(replace(rig, records=(shaken,)),)))
    (remark,) = (one for one in kept.remarks if one.kind == OTHER_MODE)
    assert (remark.name, remark.severity) == (still.name, Severity.NOTE)
    bare = usable(campaign)[1][still.name].amplitude
    assert np.std(cycles[still.name].amplitude - bare) < 0.1 * np.std(record_cycles(shaken, 7.87).amplitude - bare)
    assert np.std(kept.rigs[0].records[0].response - still.response) < 0.1 * np.std(shaken.response - still.response)
    assert usable(kept)[0] is kept


def test_a_mode_so_near_a_harmonic_is_found_where_another_record_shows_it():
    """By itself it is taken for the third harmonic of the motion, which has none here."""
    near, suspect = OtherMode(15.1, 0.5, 0.005 + 0j), OtherMode(15.12, 0.4, 0.01 + 0j, relative=0.02)
    one, bare = record(near), record()
    for what, expected in ((one, 1), (bare, 0)):
        assert found(what) == ()
        assert len(suspecting(what, suspect)[1]) == expected
    left, released = suspecting(one, suspect)
    assert released[0].frequency == pytest.approx(15.1, abs=0.01)
    assert np.std(left.response - bare.response) < 0.1 * np.std(one.response - bare.response)


@pytest.mark.parametrize("frequency", [14.9, 15.3])
def test_a_third_harmonic_is_no_mode_of_another_record(frequency):
    """Of a sensor that saturates, it dies away with the motion."""
    one = record()
    one = replace(one, response=np.tanh(one.response))
    assert suspecting(one, OtherMode(frequency, 0.2, 0.01 + 0j, relative=0.02))[1] == ()
