"""Every slip in what a campaign states is remarked on, and nothing else is."""

import shutil

import pytest

from scruton.campaign import Fluid, load_campaign
from scruton.campaign.plausibility import damping_flag, implausible
from scruton.campaign.remarks import Severity
from scruton.errors import InputError


def remarks(folder):
    return [(one.kind, one.name, one.severity) for one in implausible(load_campaign(folder))]


def test_a_clean_campaign_has_none(small_campaign):
    assert remarks(small_campaign) == []


SERIOUS, DOUBT = Severity.SERIOUS, Severity.DOUBT
WIDTH, DEPTH, HEAVING = 'width = "0.3 m"', 'depth = "0.075 m"', 'motion = "heaving"'


@pytest.mark.parametrize(
    ("slip", "found"),
    [
        ((WIDTH, 'width = "4.5 m"'), [("slenderness", "section", DOUBT)]),
        ((WIDTH, 'width = "0.01 m"'), [("slenderness", "section", DOUBT)]),
        (("1.22 kg/m^3", "0.7 kg/m^3"), [("density", "Sc 21.7", DOUBT)]),
        (("1.22 kg/m^3", "1.22 g/cm^3"), [("density", "Sc 21.7", SERIOUS)]),
        ((HEAVING, HEAVING + '\nfluid = "water"'), [("density", "Sc 21.7", SERIOUS)]),
        ((HEAVING, HEAVING + '\nfluid = "water"', "1.22 kg/m^3", "999 kg/m^3"), []),
        (("5.036 m/s", "0.5036 m/s"), [("reduced velocity", "Sc 21.7", DOUBT)]),
        (("5.036 m/s", "5036 m/s"), [("reduced velocity", "Sc 21.7", SERIOUS)]),
        (("7.292 kg/m", "7.292 g/m", "0.04 kg/m", "0.04 g/m"), [("mass", "6#", SERIOUS)]),
        (("7.292 kg/m", "7292 kg/m", "0.04 kg/m", "40 kg/m"), [("mass", "6#", SERIOUS)]),
        (("0.04 kg/m", "4 kg/m"), [("uncertainty", "6#", DOUBT)]),
        (("sd = 0.0004", "sd = 0.004"), [("uncertainty", "6#", DOUBT)]),
        (("mean = 0.0065", "mean = 0.65"), [("damping stated", "6#", SERIOUS)]),
        (("stable_amplitude = 0.0292", "stable_amplitude = 2.19"), [("amplitude", "Sc 21.7", SERIOUS)]),
        ((DEPTH, 'depth = "0.000075 km"'), [("unit", "section.depth", DOUBT)]),
        (("7.87 Hz", "248357000 1/year"), [("unit", "rigs[0].frequency", DOUBT)]),
        (("5.036 m/s", "18.13 km/h"), []),
        (("7.87 Hz", "472.2 rpm"), []),
    ],
)  # fmt: skip
def test_one_slip_is_one_remark(with_slip, slip, found):
    assert remarks(with_slip(*slip)) == found


def test_water_is_a_fluid_and_oil_is_not(with_slip):
    folder = with_slip(HEAVING, HEAVING + '\nfluid = "water"')
    assert load_campaign(folder).section.fluid is Fluid.WATER
    text = (folder / "campaign.toml").read_text(encoding="utf-8").replace('"water"', '"oil"')
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r'section\.fluid: found "oil"; wanted one of: air, water'):
        load_campaign(folder)


@pytest.mark.parametrize(
    ("points", "found"),
    [
        ("5,2\n", ["sweep"]),
        ("4,0\n5,0\n6,0\n", ["sweep"]),
        ("4,0\n5,200\n6,0\n", ["amplitude"]),
        ("400,0\n500,2\n600,0\n", ["reduced velocity"]),
        ("0,0\n4,0\n5,2\n6,0\n", []),
    ],
    ids=["one point", "zeros", "metres", "cm/s", "good"],
)
def test_sweeps(with_slip, points, found):
    sweep = '[[sweeps]]\nrig = "6#"\nair_density = "1.22 kg/m^3"\nfile = "sweep.csv"\n\n[[tests]]'
    folder = with_slip("[[tests]]", sweep)
    (folder / "sweep.csv").write_text(f"wind speed [m/s],amplitude [mm]\n{points}", encoding="utf-8")
    assert [kind for kind, _, _ in remarks(folder)] == found


GROWTH = '{ file = "growth.csv", kind = "growth" },'
STILL, DECAY = '{ file = "still.csv", kind = "free-decay" },', '{ file = "decay.csv", kind = "decay" },'


def test_one_file_under_two_names(with_slip):
    folder = with_slip(GROWTH, GROWTH + '\n{ file = "copy.csv", kind = "decay" },')
    shutil.copy(folder / "decay.csv", folder / "copy.csv")
    (one,) = implausible(load_campaign(folder))
    assert one.kind == "duplicate"
    assert one.severity is SERIOUS
    assert one.sentence == (
        "decay.csv and copy.csv: the same bytes, both in test Sc 21.7; what is measured once counts twice."
    )


def test_one_file_in_still_air_and_in_wind(with_slip):
    folder = with_slip(GROWTH, '{ file = "copy.csv", kind = "growth" },')
    shutil.copy(folder / "still.csv", folder / "copy.csv")
    (one,) = implausible(load_campaign(folder))
    assert "the same bytes, in rig 6# and in test Sc 21.7" in one.sentence


def test_the_same_numbers_in_a_file_that_was_saved_again(with_slip):
    folder = with_slip(GROWTH, GROWTH + '\n{ file = "copy.csv", kind = "decay" },')
    (folder / "copy.csv").write_text((folder / "decay.csv").read_text(encoding="utf-8") + "\n\n", encoding="utf-8")
    (one,) = implausible(load_campaign(folder))
    assert "the same samples" in one.text


def test_overlapping_windows_of_one_file(with_slip):
    windows = (
        '{ file = "decay.csv", kind = "decay", stop = "6 s" },\n{ file = "decay.csv", kind = "decay", start = "1 s" },'
    )
    (one,) = implausible(load_campaign(with_slip(DECAY, windows)))
    assert one.kind == "duplicate"
    assert "501 samples of one file (1 s to 6 s)" in one.text


def test_windows_that_follow_each_other_share_nothing(with_slip):
    windows = STILL.replace(" }", ', stop = "4 s" }') + "\n" + STILL.replace(" }", ', start = "4 s" }')
    assert remarks(with_slip(STILL, windows)) == []


def test_a_design_damping_that_no_structure_has():
    assert damping_flag(0.003) == damping_flag(1e-5) == ""
    assert damping_flag(0.3).startswith("the design damping is 30 %, outside 0.01 % to 10 %")
