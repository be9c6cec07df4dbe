"""A weak record is set aside, said, and blocks nothing; strictness and what cannot be done without do."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from scruton.campaign import load_campaign
from scruton.campaign.remarks import Severity, sentences
from scruton.envelope import gather, review, usable
from scruton.envelope.inspection import SET_ASIDE
from scruton.errors import InputError


def spoiled(folder, *names, undamped=False):
    """The campaign with noise in place of some records."""
    campaign = load_campaign(folder)
    rng = np.random.default_rng(3)

    def noisy(records):
        return tuple(
            replace(record, response=1e-4 * rng.normal(size=record.time.size)) if record.name in names else record
            for record in records
        )

    rigs = tuple(replace(rig, records=noisy(rig.records)) for rig in campaign.rigs)
    if undamped:
        rigs = tuple(replace(rig, damping_ratio=None) for rig in rigs)
    tests = tuple(replace(test, records=noisy(test.records)) for test in campaign.tests)
    return replace(campaign, rigs=rigs, tests=tests)


def test_a_good_campaign_stays_as_it_is(small_campaign):
    campaign = load_campaign(small_campaign)
    kept, cycles = usable(campaign)
    assert kept is campaign
    assert set(cycles) == {"still.csv", "decay.csv", "growth.csv"}


@pytest.mark.parametrize("weak", ["still.csv", "growth.csv"])
def test_a_weak_record_is_set_aside(small_campaign, weak):
    campaign = spoiled(small_campaign, weak)
    kept, cycles = usable(campaign)
    assert weak not in cycles
    assert weak not in {record.name for owner in (*kept.rigs, *kept.tests) for record in owner.records}
    (remark,) = (one for one in kept.remarks if one.kind == SET_ASIDE)
    assert (remark.name, remark.severity) == (weak, Severity.SERIOUS)
    (said,) = (line for line in sentences(review(gather(campaign)), Severity.DOUBT) if weak in line)
    assert "set aside" in said
    assert "oscillation" in said or "line in the spectrum" in said


def test_strictness_refuses_it(small_campaign):
    with pytest.raises(InputError, match=r"growth.csv.*tests\[0\].records\[1\]"):
        usable(spoiled(small_campaign, "growth.csv"), strict=True)


def test_what_cannot_be_done_without_is_refused(small_campaign):
    with pytest.raises(InputError, match=r"still.csv.*rigs\[0\].records\[0\]"):
        usable(spoiled(small_campaign, "still.csv", undamped=True))
    with pytest.raises(InputError, match=r"still\.csv"):
        usable(spoiled(small_campaign, "still.csv", "decay.csv", "growth.csv"))


def test_check_says_it_and_goes_on(small_campaign, tmp_path, capsys):
    from scruton.cli import main

    folder = tmp_path / "campaign"
    shutil.copytree(small_campaign, folder)
    file = folder / "growth.csv"
    header, *rows = file.read_text().splitlines()
    noise = np.random.default_rng(4).normal(size=len(rows))
    cells = [",".join([*row.split(",")[:-1], f"{value:.4f}"]) for row, value in zip(rows, noise, strict=True)]
    file.write_text("\n".join([header, *cells]) + "\n")
    assert main(["check", str(folder)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "growth.csv: set aside: no" in said
    assert "No warnings" not in said
    assert main(["check", str(folder), "--strict"]) == 2


def of_decay(campaign, change):
    def changed(record):
        return replace(record, response=change(record.time, record.response)) if record.name == "decay.csv" else record

    tests = tuple(replace(test, records=tuple(changed(one) for one in test.records)) for test in campaign.tests)
    return replace(campaign, tests=tests)


@pytest.mark.parametrize(
    ("rate", "gain", "reason"),
    [(1.5, 1.0, "a decay that dies out"), (0.0, 200.0, "a largest amplitude of"), (0.05, 1.0, "")],
    ids=["dies", "another unit", "slow"],
)
def test_a_record_of_no_vortex_induced_vibration_is_set_aside(small_campaign, rate, gain, reason):
    """A model finds a stable amplitude somewhere on the way to nothing."""
    noise = 1e-4 * np.random.default_rng(5).normal(size=100_000)

    def change(time, response):
        return gain * response * np.exp(-rate * (time - time[0])) + noise[: time.size]

    kept, cycles = usable(of_decay(load_campaign(small_campaign), change))
    assert ("decay.csv" in cycles) == (not reason)
    assert [reason in one.text for one in kept.remarks] == [True] * bool(reason)


def test_where_no_record_in_wind_can_be_used_none_is_left_out(small_campaign):
    """Metres filed as millimetres were set aside, and what was left, still air alone, was fitted and done."""
    campaign = load_campaign(small_campaign)
    (test,) = campaign.tests
    large = tuple(replace(record, response=1000.0 * record.response) for record in test.records)
    with pytest.raises(InputError, match=r"decay\.csv: .*a largest amplitude of .* wanted at most 5 A/D"):
        usable(replace(campaign, tests=(replace(test, records=large),)))
    _, cycles = usable(replace(campaign, tests=()))
    assert cycles


@pytest.mark.parametrize("clipped", [False, True])
def test_a_decay_that_is_pushed_first_is_used_from_its_largest_cycle_on(with_slip, small_campaign, clipped):
    """By hand, for a second, and the record tells nothing of it: it was a wake that remembers, or a gain."""

    def pushed(time, response):
        since = time - time[0]
        return time, response * np.where(since < 1.0, 0.1 + 0.9 * since, 1.0)

    campaign, cycles = usable(load_campaign(with_slip(record="decay.csv", change=pushed)), clipped=clipped)
    amplitude = cycles["decay.csv"].amplitude
    assert int(np.argmax(amplitude)) == 0
    (said,) = (remark.sentence for remark in campaign.remarks if remark.kind == "pushed")
    assert "rises before it decays (a push), and is used from there on" in said
    assert usable(campaign, clipped=clipped)[0] is campaign
    assert not usable(load_campaign(small_campaign), clipped=clipped)[0].remarks
