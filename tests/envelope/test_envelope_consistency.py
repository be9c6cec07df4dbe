"""Every slip that the envelopes tell is remarked on, and nothing else is."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from scruton.campaign import load_campaign
from scruton.campaign.remarks import Severity, sentences
from scruton.campaign.schema import Kind, Record
from scruton.dynamics.first_look import check
from scruton.envelope import gather, record_cycles, review, usable
from scruton.envelope.consistency import check_units
from scruton.envelope.stillness import before_release
from scruton.errors import InputError

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SERIOUS, DOUBT = Severity.SERIOUS, Severity.DOUBT


def found(folder):
    problems = []
    remarks = review(gather(load_campaign(folder), problems))
    assert problems == []
    return sorted((one.kind, one.name, one.severity) for one in remarks)


def resampled(rate):
    def change(time, response):
        even = np.arange(time[0], time[-1], 1.0 / rate)
        return even, np.interp(even, time, response)

    return change


def held(after, value):
    return lambda time, response: (time, np.where(time < after, response, value))


def held_first(seconds, noise=1e-3):
    """A model that is held before it is let go, under the noise of its sensor."""

    def change(time, response):
        step, rng = float(np.median(np.diff(time))), np.random.default_rng(3)
        before = np.arange(round(seconds / step)) * step
        whole = np.concatenate([np.zeros(before.size), response])
        return np.arange(whole.size) * step, whole + noise * np.ptp(response) * rng.standard_normal(whole.size)

    return change


def spoiled(at, size):
    def change(time, response):
        response = response.copy()
        response[np.searchsorted(time, at)] += size * np.ptp(response)
        return time, response

    return change


def rounded(part):
    return lambda time, response: (time, part * np.ptp(response) * np.round(response / (part * np.ptp(response))))


def test_a_clean_campaign_has_no_remark(small_campaign):
    assert found(small_campaign) == []


RECORDS = ("decay.csv", "growth.csv", "still.csv")


@pytest.mark.parametrize(
    ("slip", "remarks"),
    [
        (("7.87 Hz", "8.02 Hz"), []),
        (("7.87 Hz", "8.1 Hz"), [("natural frequency", "6#", DOUBT)]),
        (("7.87 Hz", "8.6 Hz"), [("natural frequency", "6#", SERIOUS)]),
        (
            ("7.87 Hz", "78.7 Hz"),
            [(kind, name, SERIOUS) for kind in ("alias", "frequency") for name in RECORDS]
            + [("reduced velocity", "Sc 21.7", DOUBT)],
        ),
        (("mean = 0.0065", "mean = 0.0075"), []),
        (("mean = 0.0065", "mean = 0.0085"), [("damping", "6#", DOUBT)]),
        (("mean = 0.0065", "mean = 0.65"), [("damping", "6#", SERIOUS), ("damping stated", "6#", SERIOUS)]),
        (("mean = 0.0065\nsd = 0.0004", "mean = 0.0072"), []),
        (("mean = 0.0065\nsd = 0.0004", "mean = 0.012"), [("damping", "6#", DOUBT)]),
        (("mean = 0.0065\nsd = 0.0004", "mean = 0.014"), [("damping", "6#", SERIOUS)]),
        (('"decay.csv", kind = "decay"', '"decay.csv", kind = "growth"'), [("kind", "decay.csv", SERIOUS)]),
        (('"growth.csv", kind = "growth"', '"growth.csv", kind = "decay"'), [("kind", "growth.csv", SERIOUS)]),
        (
            ("stable_amplitude = 0.0292", "stable_amplitude = 0.039"),
            [("stated level", "decay.csv", DOUBT), ("stated level", "growth.csv", DOUBT)],
        ),
    ],
)  # fmt: skip
def test_a_slip_in_what_is_stated(with_slip, slip, remarks):
    assert found(with_slip(*slip)) == remarks


CM, LEVEL = "time [s],displacement [cm]", ("stable_amplitude = 0.0292\n", "")


@pytest.mark.parametrize(
    ("slip", "remarks"),
    [
        (
            {"record": "decay.csv", "change": resampled(8.5)},
            [("alias", "decay.csv", SERIOUS), ("frequency", "decay.csv", SERIOUS)],
        ),
        ({"record": "decay.csv", "change": resampled(50.0)}, [("thinned", "decay.csv", DOUBT)]),
        ({"record": "growth.csv", "header": CM}, [("levels", "Sc 21.7", SERIOUS)]),
        ({"record": "growth.csv", "change": lambda t, y: (t, 1.4 * y)}, [("levels", "Sc 21.7", DOUBT)]),
        ({"record": "growth.csv", "change": lambda t, y: (t, 0.6 * y)}, [("levels", "Sc 21.7", DOUBT)]),
        ({"record": "growth.csv", "change": lambda t, y: (t, 1.1 * y)}, []),
        ({"record": "growth.csv", "change": lambda t, y: (1.03 * t, y)}, [("one test", "growth.csv", DOUBT)]),
        ({"record": "growth.csv", "change": lambda t, y: (1.01 * t, y)}, []),
        ({"record": "still.csv", "header": CM}, [("amplitude", "still.csv", DOUBT)]),
        ({"record": "decay.csv", "change": held(5.5, 0.0)}, [("dead", "decay.csv", DOUBT)]),
        ({"record": "still.csv", "change": held(4.0, 0.3)}, [("dead", "still.csv", DOUBT)]),
        ({"record": "still.csv", "change": held(7.0, 0.0)}, [("dead", "still.csv", DOUBT)]),
        ({"record": "still.csv", "change": rounded(2e-5)}, []),
        ({"record": "decay.csv", "change": held_first(1.5)}, [("held model", "decay.csv", DOUBT)]),
        ({"record": "still.csv", "change": held_first(2.0)}, [("held model", "still.csv", DOUBT)]),
        ({"record": "decay.csv", "change": held_first(0.1)}, [("let go", "decay.csv", DOUBT)]),
        ({"record": "growth.csv", "change": held_first(1.5)}, [("held model", "growth.csv", DOUBT)]),
        ({"record": "growth.csv", "change": spoiled(4.0, 2.0)}, [("outlier", "growth.csv", DOUBT)]),
        ({"record": "growth.csv", "change": spoiled(4.0, 0.05)}, []),
    ],
    ids=[
        "8.5 Hz", "50 Hz", "cm", "gain 1.4", "gain 0.6", "gain 1.1", "clock 1.03",
        "clock 1.01", "still cm", "zeros", "constant", "few zeros",
        "rounded", "held", "still held", "let go", "growth held", "spoiled", "hardly spoiled",
    ],
)  # fmt: skip
def test_a_slip_in_a_record(with_slip, slip, remarks):
    """The test states no stable amplitude, so that only the records speak of the level."""
    assert found(with_slip(*LEVEL, **slip)) == remarks


@pytest.mark.parametrize("name", ["decay.csv", "still.csv"])
def test_what_stands_still_amid_motion_is_left_out(with_slip, small_campaign, name):
    """Padding at either end, and a channel that drops out, leave the amplitudes as they were."""

    def dropped(time, response):
        gone = (time < 0.7) | ((time > 2.0) & (time < 2.4)) | (time > 5.5)
        return time, np.where(gone, 0.0, response)

    whole = gather(load_campaign(small_campaign), []).cycles[name]
    cut = gather(load_campaign(with_slip(record=name, change=dropped)), []).cycles[name]
    assert cut.time[0] > 0.7
    assert cut.time[-1] < 5.5
    assert not np.any((cut.time > 2.0) & (cut.time < 2.4))
    there = np.interp(cut.time, whole.time, whole.amplitude)
    assert np.abs(cut.amplitude - there).max() < 0.02 * there.max()


@pytest.mark.parametrize(("gain", "remarks"), [(1.0, []), (1.4, [("steady level", "decay.csv", DOUBT)])])
def test_a_steady_record_off_the_level_of_the_transients_is_said(with_slip, small_campaign, gain, remarks):
    _, growth = np.loadtxt(small_campaign / "growth.csv", delimiter=",", skiprows=1).T
    third = growth[-growth.size // 3 :]
    folder = with_slip(
        *LEVEL, '"decay.csv", kind = "decay"', '"decay.csv", kind = "steady"', record="decay.csv",
        change=lambda t, y: (t[: third.size], gain * third),
    )  # fmt: skip
    assert found(folder) == remarks


@pytest.mark.parametrize(("factor", "remarks"), [(1.0, []), (1.4, [("sweep level", "Sc 21.7", DOUBT)])])
def test_a_sweep_off_the_level_of_a_test_at_the_same_wind_speed_is_said(with_slip, factor, remarks):
    """Points at other speeds say nothing of the test's."""
    folder = with_slip()
    (folder / "sweep.csv").write_text(f"wind speed [m/s],A/D\n4.5,0.09\n5.04,{0.0292 * factor:.4f}\n5.5,0.001\n")
    toml = folder / "campaign.toml"
    sweep = '\n[[sweeps]]\nrig = "6#"\nair_density = "1.22 kg/m^3"\nfile = "sweep.csv"\n'
    toml.write_text(toml.read_text(encoding="utf-8") + sweep, encoding="utf-8")
    assert found(folder) == remarks


@pytest.mark.parametrize("kind", ["decay", "steady"])
def test_records_of_one_test_in_two_units_are_refused(with_slip, small_campaign, kind):
    """A fit of both went on for minutes, to no end."""
    _, growth = np.loadtxt(small_campaign / "growth.csv", delimiter=",", skiprows=1).T
    third = growth[-growth.size // 3 :]

    def change(time, response):
        return (time, response / 1000.0) if kind == "decay" else (time[: third.size], third / 1000.0)

    folder = with_slip(
        '"decay.csv", kind = "decay"', f'"decay.csv", kind = "{kind}"', record="decay.csv", change=change
    )
    name = "growth.csv" if kind == "decay" else "decay.csv"
    with pytest.raises(InputError, match=rf"{name}: tests\[0\].*a factor .* off the .*in the same test Sc 21.7.*unit"):
        check_units(gather(load_campaign(folder), []))
    check_units(gather(load_campaign(small_campaign), []))
    (problem,) = check(folder).problems  # what a fit would refuse, a check says first
    assert Path(problem.file).name == name
    assert not check(small_campaign).problems


def test_a_growth_that_dies_out_has_no_other_unit(with_slip):
    """Below some amplitude the span may lose its coherence: rest is a state beside the one that decays come to."""

    def dying(time, response):
        kept = time < time[0] + 4.0  # what is left is turbulence, in the line of the response
        return time[kept], (0.002 * np.exp(-1.5 * time) + 0.0002)[kept] * np.cos(2.0 * np.pi * 7.87 * time[kept])

    folder = with_slip(record="growth.csv", change=dying)
    assert ("levels", "Sc 21.7", SERIOUS) in found(folder)
    check_units(gather(load_campaign(folder), []))


def test_a_record_whose_time_has_another_unit_is_refused(with_slip):
    """Its line is of no motion of the section: a check goes on and says so among what cannot be used."""
    folder = with_slip(record="decay.csv", change=lambda time, response: (time / 60.0, response))
    with pytest.raises(
        InputError, match=r"decay.csv: tests\[0\].*a line at 472.* Hz, 60 times the f0.*unit of the time"
    ):
        check_units(gather(load_campaign(folder), []))


def test_a_time_in_milliseconds_is_named(with_slip):
    folder = with_slip(record="decay.csv", change=lambda time, response: (1000.0 * time, response))
    with pytest.raises(InputError, match=r"a motion near 7.87 Hz: its time is in ms, read as s"):
        check_units(gather(load_campaign(folder), []))


def test_a_record_that_holds_more_than_its_transient_is_told_by_amplitudes_that_it_has(with_slip):
    """An exponential that is led on over a rest goes below zero at one end."""
    rests = with_slip(*LEVEL, record="growth.csv", change=lambda t, y: (t, np.where(t > 0.75 * t[-1], 1e-4 * y, y)))
    told = review(gather(load_campaign(rests), []))
    (text,) = (one.text for one in told if (one.kind, one.name) == ("kind", "growth.csv"))
    assert " -" not in text
    assert "between them: start and stop choose the part that is one" in text


def test_what_is_sampled_too_coarsely_for_f0_is_called_an_alias(with_slip):
    folder = with_slip(record="decay.csv", change=resampled(10.0))
    with pytest.raises(
        InputError, match=r"10 samples a second, 1.3 per cycle of the f0 = 7.87 Hz.*alias.*47.2 a second"
    ):
        usable(load_campaign(folder), strict=True)


def test_the_end_of_a_drift_is_no_clipping(with_slip):
    def drifting(time, response):
        return time, response + 30.0 * np.ptp(response) + 5.0 * np.ptp(response) * time / time[-1]

    kinds = {kind for kind, _, _ in found(with_slip(record="growth.csv", change=drifting))}
    assert kinds == {"offset", "mean drift"}


def test_growth_filed_as_free_decay(with_slip, small_campaign):
    _, growth = np.loadtxt(small_campaign / "growth.csv", delimiter=",", skiprows=1).T
    folder = with_slip(record="still.csv", change=lambda t, y: (t, growth[: len(t)]))
    kinds = {kind for kind, name, _ in found(folder) if name == "still.csv"}
    assert "kind" in kinds


@pytest.mark.parametrize(
    ("stated", "remarks"),
    [
        ("8.0 Hz", []), ("8.2 Hz", [("other rigs", "light", DOUBT)]),
        ('{ mean = "8.2 Hz", sd = "0.15 Hz" }', []),
        ("8.8 Hz", [("frequency", "light-decay.csv", DOUBT), ("frequency", "light-growth.csv", DOUBT)]),
    ],
)  # fmt: skip
def test_a_rig_whose_frequency_the_wind_moves_as_no_other_is_named(two_rigs, tmp_path, stated, remarks):
    folder = Path(shutil.copytree(two_rigs("paper"), tmp_path / "two"))
    text = (folder / "campaign.toml").read_text(encoding="utf-8")
    head, light = text.split('name = "light"', 1)
    quoted = stated if stated.startswith("{") else f'"{stated}"'
    light = re.sub(r"^frequency *= *.*$", f"frequency = {quoted}", light, count=1, flags=re.MULTILINE)
    (folder / "campaign.toml").write_text(f'{head}name = "light"{light}', encoding="utf-8")
    assert [one for one in found(folder) if one[0] in ("frequency", "other rigs")] == remarks


def test_the_line_that_was_followed_is_named_with_its_ratio_to_f0(with_slip):
    folder = with_slip(record="decay.csv", change=resampled(8.5))
    lines = sentences(review(gather(load_campaign(folder), [])))
    (line,) = [one for one in lines if "line followed is at" in one]
    assert "decay.csv: the line followed is at 0.6309 Hz, 0.0802 times the f0 = 7.87 Hz stated for rig 6#" in line


def test_short_growths_and_decays_bracket_the_level_and_contradict_nothing(with_slip):
    cut = (
        '"decay.csv", kind = "decay"', '"decay.csv", kind = "decay", stop = "1 s"',
        '"growth.csv", kind = "growth"', '"growth.csv", kind = "growth", stop = "1 s"',
    )  # fmt: skip
    kinds = {kind for kind, _, severity in found(with_slip(*LEVEL, *cut)) if severity >= DOUBT}
    assert kinds == set()


def test_a_growth_that_does_not_bend_yet_says_nothing_of_where_it_settles(with_slip):
    """Van der Pol's growth is exponential at first: led on it headed for eight times the decay's level."""

    def slow(time, response):
        settled = np.abs(response[-response.size // 4 :]).max()
        ratio = 1.0 / np.sqrt(1.0 + 24.0 * np.exp(-4.86 * (time - time[0]) / (time[-1] - time[0])))
        return time, settled * ratio * np.cos(2.0 * np.pi * 7.87 * time)

    assert found(with_slip(*LEVEL, record="growth.csv", change=slow)) == [("length", "growth.csv", Severity.NOTE)]


def follows(ratio):
    """Write a record anew as 5 mm times `ratio` of the part of it that is over."""

    def change(time, _):
        return time, 5.0 * ratio((time - time[0]) / (time[-1] - time[0])) * np.cos(2.0 * np.pi * 7.87 * time)

    return change


def growth_to(level, rate):
    """Van der Pol's growth from a fortieth of its level, of which one exponential knows no rate."""
    return follows(lambda t: level / np.sqrt(1.0 + 1599.0 * np.exp(-2.0 * rate * t)))


def gusty_decay(t):
    """A decay that is over in a few cycles, and wanders by 2 % from then on."""
    return 1.0 + 0.3 * np.exp(-150.0 * t) + 0.02 * np.sin(2.0 * np.pi * 0.8 * t)


@pytest.mark.parametrize(
    ("level", "rate", "contradicts"),
    [
        (0.45, 6.0, True),
        (0.45, 15.0, True),
        (1.0, 15.0, False),
        (1.0, 6.0, False),
        (1.0, 4.0, False),
        (1.0, 2.0, False),
    ],
)
def test_growth_and_decay_that_stand_at_two_levels_are_told_whatever_their_shape(
    small_campaign, tmp_path, with_slip, level, rate, contradicts
):
    folder = with_slip(*LEVEL, record="growth.csv", change=growth_to(level, rate))
    head, *rows = (folder / "decay.csv").read_text(encoding="utf-8").splitlines()
    time = np.array([float(row.split(",")[0]) for row in rows])
    _, y = follows(gusty_decay)(time, None)
    lines = [f"{t:.6f},{x:.6f}" for t, x in zip(time, y, strict=True)]
    (folder / "decay.csv").write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
    assert ("levels" in {kind for kind, _, _ in found(folder)}) == contradicts


@pytest.mark.parametrize("name", sorted(one.parent.name for one in EXAMPLES.glob("*/campaign.toml")))
def test_the_shipped_examples_have_no_remark(name):
    assert found(EXAMPLES / name) == []


# What a person who looks at the measured records would say as well, and no more.
MEASURED = {
    "bristol-heave": {  # released from a depth and more; a reading 11 D off zero; friction and a stiffening suspension
        "amplitude": (DOUBT, 2), "offset": (Severity.NOTE, 2), "frequency drift": (Severity.NOTE, 2),
    },
    "cylinder-in-wind": {  # the edge of lock-in, where amplitudes beat; a second mode near 36 Hz
        "beat": (DOUBT, 5), "frequency drift": (Severity.NOTE, 11), "second line": (Severity.NOTE, 2),
        "other mode": (Severity.NOTE, 24),
    },
    "pendulum-air-drag": {"jitter": (Severity.NOTE, 1)},  # filmed
    "pendulum-dry-friction": {"amplitude": (DOUBT, 1), "frequency drift": (Severity.NOTE, 1)},  # swings by 55 degrees
    "ship-roll-decay": {},
    "ship-roll-speeds": {},
}  # fmt: skip


@pytest.mark.real
@pytest.mark.parametrize("name", sorted(MEASURED))
def test_measured_campaigns_have_the_remarks_that_a_person_would_make(name, shared_data):
    remarks = found(shared_data(name))
    kinds = {kind for kind, _, _ in remarks}
    counted = {
        kind: (max(s for k, _, s in remarks if k == kind), sum(k == kind for k, _, _ in remarks)) for kind in kinds
    }
    assert counted == MEASURED[name]


def test_a_growth_that_falls_first_is_used_from_its_lowest_cycle_on(with_slip, small_campaign):
    """Two wakes' bodies, released out of step with them: all of it put the stable amplitude 3 and 6 % too high."""

    def falling(time, response):
        return time, response * (1.0 + 12.0 * np.exp(-8.0 * (time - time[0])))

    folder = with_slip(record="growth.csv", change=falling)
    whole, cut = (usable(load_campaign(folder), clipped=clipped)[1]["growth.csv"] for clipped in (True, False))
    assert whole.amplitude[0] > 2.0 * whole.amplitude.min()
    assert cut.amplitude[0] == pytest.approx(whole.amplitude.min(), rel=0.02)
    assert cut.amplitude[-1] == pytest.approx(whole.amplitude[-1], rel=0.01)
    campaign, cycles = usable(load_campaign(folder))
    (said,) = (remark.sentence for remark in campaign.remarks if remark.kind == "falls")
    (record,) = (one for one, _, _ in campaign.records() if one.name == "growth.csv")
    again = record_cycles(record, campaign.rigs[0].frequency.mean)
    np.testing.assert_array_equal(again.amplitude, cycles["growth.csv"].amplitude)  # what a stored fit has, too
    assert usable(campaign)[0] is campaign
    assert "before it grows, and is used from there on" in said
    assert not usable(load_campaign(small_campaign))[0].remarks


@pytest.mark.parametrize("rate", [0.05, 0.3])
def test_a_growth_out_of_the_noise_is_not_held(rate):
    """By a share of itself in each cycle, from below the noise on."""
    time = np.arange(0.0, 60.0, 0.02)
    motion = np.minimum(1e-5 * np.exp(rate * 4.0 * time), 0.05) * np.sin(2.0 * np.pi * 4.0 * time)
    noise = 1e-3 * np.random.default_rng(2).standard_normal(time.size)
    assert not before_release(Record("g", Path("g"), Kind.GROWTH, time, motion + noise), 4.0).any()
    rests = np.where(time < 1.0, 0.0, 0.05 * -np.expm1(-0.2 * (time - 1.0))) * np.sin(2.0 * np.pi * 4.0 * time)
    gone = before_release(Record("g", Path("g"), Kind.GROWTH, time, rests + noise), 4.0)
    assert 0.9 < time[~gone][0] < 1.5
    knocked = np.where(time < 0.25, 3e-3 * np.sin(2.0 * np.pi * 4.0 * time), rests)  # something shows while it is held
    gone = before_release(Record("g", Path("g"), Kind.GROWTH, time, knocked + noise), 4.0)
    assert 0.9 < time[~gone][0] < 1.5


def test_a_model_is_held_under_a_noise_that_is_filtered():
    """It makes more of an amplitude than its scatter within a cycle tells, and the search ended amid it."""
    time = np.arange(0.0, 60.0, 0.02)
    noise = np.convolve(2e-4 * np.random.default_rng(2).standard_normal(time.size), np.ones(8) / 8.0, mode="same")
    motion = np.where(time < 3.0, 0.0, 0.05 * -np.expm1(-0.2 * (time - 3.0))) * np.sin(2.0 * np.pi * 4.0 * time)
    gone = before_release(Record("g", Path("g"), Kind.GROWTH, time, motion + noise), 4.0)
    assert 3.0 < time[~gone][0] < 3.2
