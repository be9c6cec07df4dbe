"""Slips of the pen as a user meets them: in `check`, in fit.json, at the design."""

import json
import re

import numpy as np
import pytest

from scruton.cli import main
from scruton.infer.cards import load_card

CARD = """extends = "paper"
name = "quick"
[sampler]
ensembles = 2
walkers = 32
draws = 8
min_ess = 50
max_rhat = 1.5
max_steps = 200
"""


def run(*arguments, capsys):
    code = main([str(one) for one in arguments])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def resampled(time, response):
    even = np.arange(time[0], time[-1], 1.0 / 8.5)
    return even, np.interp(even, time, response)


LINE = (
    "serious: the line followed is at 0.1 times the f0 stated for its rig in 3 records: still.csv, decay.csv, "
    "growth.csv."
)


@pytest.mark.parametrize(
    ("slip", "flag"),
    [
        (("mean = 0.0065", "mean = 0.065"), "the ring-downs show a damping of 0.65 %, 0.1 times the 6.5 % stated"),
        (("7.87 Hz", "8.6 Hz"), "rig 6#: its free decays ring at 7.87 Hz, 0.915 times the f0 = 8.6 Hz stated"),
    ],
    ids=["0.065", "8.6 Hz"],
)
def test_a_slip_is_in_check_and_among_the_flags_of_the_fit(with_slip, tmp_path, slip, flag, capsys):
    folder = with_slip(*slip)
    code, out, _ = run("check", folder, capsys=capsys)
    assert code == 0
    assert flag in out
    (tmp_path / "quick.toml").write_text(CARD, encoding="utf-8")
    code, _, error = run(
        "fit", folder, "-o", tmp_path / "fit", "--model", tmp_path / "quick.toml", "--quiet", capsys=capsys
    )
    assert code in (0, 1)
    flags = json.loads((tmp_path / "fit" / "fit.json").read_text(encoding="utf-8"))["flags"]
    assert sum(flag in one for one in flags) == 1
    assert flag in error


@pytest.mark.parametrize(
    ("slip", "kwargs", "said", "refused"),
    [
        (("7.87 Hz", "78.7 Hz"), {}, LINE, "campaign.toml: rigs[0].frequency: found 78.7 Hz; wanted the f0"),
        (
            ("mean = 0.0065", "mean = 0.65"),
            {},
            "serious: rig 6#: the ring-downs show a damping of 0.65 %, 0.01 times the 65 % stated",
            "campaign.toml: rigs[0].damping_ratio: found 0.65, 1",
        ),
        (
            (),
            {"record": "decay.csv", "change": resampled},
            "decay.csv: the line followed is at 0.6309 Hz, 0.0802 times",
            "decay.csv: tests[0].records[0]: found a line at 0.6309 Hz, 0.08 times the f0 of its rig",
        ),
    ],
    ids=["78.7 Hz", "65 %", "8.5 samples a second"],
)
def test_a_slip_that_nothing_can_be_fitted_with_is_refused_before_any_work(
    with_slip, tmp_path, slip, kwargs, said, refused, capsys
):
    """It was fitted, and the flag said that all of it was wrong."""
    folder = with_slip(*slip, **kwargs)
    code, out, _ = run("check", folder, capsys=capsys)
    assert code == 2
    assert said in out
    assert refused in out
    code, _, error = run("fit", folder, "-o", tmp_path / "fit", "--quiet", capsys=capsys)
    assert code == 2
    assert refused in error
    assert not (tmp_path / "fit").exists()


@pytest.mark.parametrize(("gain", "stable"), [(1.15, r"0\.029\d* \.\. 0\.03[34]\d* \*"), (1.0, r"  0\.029\d* \*")])
def test_records_that_stand_apart_have_a_range_in_check(with_slip, capsys, gain, stable):
    folder = with_slip(
        "stable_amplitude = 0.0292\n", "", record="growth.csv", change=lambda time, response: (time, gain * response)
    )
    _, out, _ = run("check", folder, capsys=capsys)
    assert re.search(stable, out)


def test_a_campaign_without_a_slip_has_no_flag(small_results):
    flags = json.loads((small_results / "fit.json").read_text(encoding="utf-8"))["flags"]
    assert not any("serious" in one or "stated" in one for one in flags)


def test_check_puts_the_worst_first_and_folds_what_is_alike(with_slip, capsys):
    folder = with_slip("7.87 Hz", "78.7 Hz", "0.04 kg/m", "4 kg/m")
    _, out, _ = run("check", folder, capsys=capsys)
    head, _, rest = out.partition(" warnings, worst first")  # after what cannot be used
    lines = [one for one in rest.splitlines() if one.startswith("  ! ")]
    assert head.endswith(f"\n{len(lines)}")
    assert lines[0] == f"  ! {LINE}"
    assert [one.startswith("  ! serious: ") for one in lines] == [True, True, False, False]


def test_predict_flags_a_damping_that_no_structure_has(small_results, capsys):
    code, out, _ = run("predict", small_results, "--damping", 0.3, capsys=capsys)
    assert code == 0
    assert "the design damping is 30 %, outside 0.01 % to 10 %" in out
    _, out, _ = run("predict", small_results, "--damping", 0.3, "--damping", 0.01, "--json", capsys=capsys)
    high, usual = json.loads(out)["predictions"]
    assert any("design damping is 30 %" in flag for flag in high["flags"])
    assert not any("design damping is 30 %" in flag for flag in usual["flags"])


@pytest.mark.usefixtures("no_figures")
def test_size_flags_a_damping_that_no_structure_has(quick_results, tmp_path, capsys):
    arguments = ("size", quick_results, "--limit", "0.02", "--damping", "0.3", "-o", tmp_path / "sizing", "--quiet")
    assert run(*arguments, capsys=capsys)[0] == 0
    flags = json.loads((tmp_path / "sizing" / "sizing.json").read_text(encoding="utf-8"))["flags"]
    assert any("mode section: the design damping is 30 %" in one for one in flags)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("predict", "--sc", "30", "--law", "nan"), "--law: found nan"),
        (("predict", "--sc", "30", "--law", "inf"), "--law: found inf"),
        (("predict", "--damping", "0.003 +/- inf"), '--damping: found "0.003 +/- inf"'),
        (("predict", "--damping", "0.003 +/- nan"), '--damping: found "0.003 +/- nan"'),
        (("predict", "--damping", "0.003 +/- -1"), '--damping: found "0.003 +/- -1"'),
        (("predict", "--damping", "nan"), '--damping: found "nan"'),
        (("size", "--limit", "0.02", "--law", "nan"), "--law: found nan"),
        (("size", "--limit", "0.02", "--damping", "0.003 +/- inf"), '--damping: found "0.003 +/- inf"'),
    ],
)  # fmt: skip
def test_numbers_that_are_none_are_refused(small_results, arguments, named, capsys):
    verb, *rest = arguments
    code, _, error = run(verb, small_results, *rest, capsys=capsys)
    assert code == 2
    assert named in error


def test_a_prior_in_another_unit_is_refused(small_campaign, tmp_path, capsys):
    card = tmp_path / "mine.toml"
    text = load_card().text
    assert 'unit = "A/D"' in text
    card.write_text(text.replace('unit = "A/D"', 'unit = "mm"'), encoding="utf-8")
    code, _, error = run("fit", small_campaign, "-o", tmp_path / "fit", "--model", card, capsys=capsys)
    assert code == 2
    assert f'{card}: priors.stable_amplitude.heaving.unit: found "mm"; wanted unit = "A/D"' in error
    assert not (tmp_path / "fit").exists()
