"""Diagnosis of campaigns that hold a record or two: nothing can be held out of one record, and that is said."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from scruton.cli import main
from scruton.report.chapters.gap_tables import held_out_table
from scruton.report.chapters.gap_words import shrink_sentence
from scruton.report.wording import TERMINAL
from scruton.simulate import write_campaign

HEAD = """
format = 1
title = "A record or two"
source = "simulated for the tests"

[section]
motion = "heaving"
width = "0.3 m"
depth = "0.075 m"

[simulation]
sample_rate = 100
turbulence = 0.01
sensor_noise = 0.0001

[[rigs]]
name = "6#"
mass = "7.292 kg/m"
frequency = "7.87 Hz"
damping_ratio = {{ mean = 0.0065, sd = 0.0004 }}
disturbances = {{ friction = 0.3, cubic_stiffness = {stiffness} }}
"""

STILL = """
[[rigs.records]]
file = "still.csv"
kind = "free-decay"
initial_amplitude = 0.06
duration = 8
"""

TEST = """
[[tests]]
name = "Sc 21.7"
rig = "6#"
air_density = "1.22 kg/m^3"
wind_speed = "5.036 m/s"
truth = { Y1 = -11.111, epsilon = 0.03235 }
"""

RECORD = """
[[tests.records]]
file = "{kind}.csv"
kind = "{kind}"
initial_amplitude = {start}
duration = {duration}
disturbances = {{ jump_time = {jump}, jump_drive = 0.3 }}
"""

GROWTH = RECORD.format(kind="growth", start=0.1, duration=9, jump=0)
DECAY = RECORD.format(kind="decay", start=2.5, duration=9, jump=0)
STEADY = RECORD.format(kind="steady", start=1.0, duration=30, jump=15)

# Records, how stiff the rig gets, and which records can be held out.
CAMPAIGNS = {
    "a ring-down": (STILL, 20.0, ()),
    "a growth": (TEST + GROWTH, 80.0, ()),
    "a decay": (TEST + DECAY, 20.0, ()),
    "a steady record": (TEST + STEADY, 0.0, ()),
    "a growth and a decay": (TEST + GROWTH + DECAY, 20.0, ("growth.csv", "decay.csv")),
    "a ring-down and a decay": (STILL + TEST + DECAY, 20.0, ("decay.csv",)),
}
# Records that can be held out, and the effects of which one is named; of a single one that it comes first.
FRICTION, DAMPING = "coulomb_friction", "structural_damping_nonlinearity"
MEASURED = {
    "pendulum-dry-friction": (0, {FRICTION}), "pendulum-air-drag": (0, {DAMPING}), "ship-roll-decay": (0, {DAMPING}),
    "ship-roll-speeds": (2, {FRICTION, DAMPING}), "bristol-heave": (2, {FRICTION, DAMPING}),
}  # fmt: skip


def diagnosed(campaign: Path, out: Path, capsys: pytest.CaptureFixture[str]) -> tuple[dict[str, Any], str]:
    """What `scruton diagnose` writes and prints."""
    assert main(["diagnose", str(campaign), "-o", str(out)]) == 0
    assert (out / "gap.png").stat().st_size > 10_000
    content = (out / "gap.json").read_text(encoding="utf-8")
    return json.loads(content, parse_constant=pytest.fail), capsys.readouterr().out


def check(found: dict[str, Any], text: str, held_out: int) -> None:
    """The layout of gap.json, and words that say what was not measured."""
    assert sum(found["probability"].values()) == pytest.approx(1.0, abs=1e-4)
    assert found["indistinguishable"][0][0] == found["verdict"]
    assert found["advice"]
    shrink = found["shrink"]
    assert shrink["measurable"]
    assert shrink["after"] < shrink["before"]
    assert shrink["fraction"] == pytest.approx(1.0 - shrink["after"] / shrink["before"])
    assert (shrink["held_out"] is None) == (held_out == 0)
    assert f"Put into the model, it closes {100 * shrink['fraction']:.0f} % " in text
    halves = bool(shrink["damping_discrepancy"].get("amplitudes"))  # of one record, if its transient lasts
    assert ("Of the large and the small amplitudes of " in text) == halves
    assert ("no record can be left out" in text) == (held_out == 0 and not halves)
    if held_out:
        assert len(shrink["held_out"]["records"]) == held_out
        assert (shrink["held_out"]["interval90"] is None) == (held_out == 1), "a lone record cannot be resampled"
    else:
        assert shrink["interval90"] is None
        assert shrink["runner_up"]["fraction"] is None


# a decay by itself is what a growth is, and stands beside others
@pytest.mark.parametrize(
    "records", [pytest.param(one, marks=pytest.mark.slow) if one == "a decay" else one for one in CAMPAIGNS]
)
def test_a_record_or_two_are_diagnosed(records: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, stiffness, held_out = CAMPAIGNS[records]
    (tmp_path / "spec.toml").write_text(HEAD.format(stiffness=stiffness) + text, encoding="utf-8")
    campaign = write_campaign(tmp_path / "spec.toml", tmp_path / "campaign", seed=3)
    found, said = diagnosed(campaign, tmp_path / "gap", capsys)
    assert found["verdict"] != "none"
    check(found, said, len(held_out))
    if held_out:
        assert tuple(found["shrink"]["held_out"]["records"]) == held_out


def test_a_lone_record_without_a_gap_has_nothing_to_shrink(
    small_campaign: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (small_campaign / "campaign.toml").read_text(encoding="utf-8")
    (tmp_path / "campaign.toml").write_text(text.partition("[[tests]]")[0], encoding="utf-8")
    (tmp_path / "still.csv").write_bytes((small_campaign / "still.csv").read_bytes())
    found, said = diagnosed(tmp_path, tmp_path / "gap", capsys)
    assert (found["verdict"], found["shrink"], found["where"]) == ("none", {}, [])
    assert "agree within their noise" in said


# one, and one whose records can be held out; of the others test_gap_measured.py asks which effect is named
EACH = [
    one if one in ("pendulum-dry-friction", "ship-roll-speeds") else pytest.param(one, marks=pytest.mark.slow)
    for one in MEASURED
]


@pytest.mark.real
@pytest.mark.parametrize("name", EACH)
def test_measured_ring_downs_are_diagnosed(
    name: str, shared_data: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    held_out, effects = MEASURED[name]
    found, text = diagnosed(shared_data(name), tmp_path, capsys)
    check(found, text, held_out)
    assert effects & {found["verdict"], *(found["also"] if len(effects) > 1 else ())}


def test_the_sentence_says_what_is_not_known() -> None:
    alone = {"measurable": True, "fraction": 0.9, "interval90": None, "held_out": None,
             "runner_up": {"effect": "coulomb_friction", "fraction": None}}  # fmt: skip
    assert shrink_sentence(alone) == (
        "Put into the model, it closes 90 % (a single record: no interval) of the gap on the records used; no record "
        "can be left out to test that on what the model has not seen."
    )
    small = alone | {"measurable": False, "fraction": None}
    assert shrink_sentence(small) == (
        "The gap in the amplitudes of the cycles is too small to measure how far it shrinks."
    )
    head = {"tests": 3, "amplitude_before": 0.051, "amplitude_after": 0.129, "amplitude_worse": 2,
            "damping_before": 0.072, "damping_after": 0.19, "damping_worse": 0}  # fmt: skip
    known = small | {"headline": head, "held_out": {"fraction": None, "interval90": None}}
    off = (
        "Of tests left out in turn, the stable amplitude is off by 5.1 % (median) before and 13 % after, made worse in "
        "2 of 3; the damping curve by 7.2 % and 19 % of the relaxation damping. The gap in the amplitudes of the "
        "cycles is too small to measure how far it shrinks"
    )
    assert shrink_sentence(known) == f"{off}.", "what a user predicts first is told whatever the density tells"
    rival = {"runner_up": {"effect": "fluid_memory", "fraction": None, "amplitude_error": 0.058}}
    assert shrink_sentence(known | rival) == (
        f"{off}. Of records held out the verdict is not the best account: the runner-up (the wake lags) would leave "
        "the stable amplitude off by 5.8 % only."
    )
    far = {"runner_up": {"effect": "fluid_memory", "fraction": None, "amplitude_error": 0.16}}
    assert shrink_sentence(known | far).endswith(
        "; the runner-up (the wake lags) would leave the stable amplitude off by 16 %."
    )
    one_out = alone | {"interval90": [0.8, 0.95], "held_out": {"fraction": 0.7, "interval90": None}}
    assert shrink_sentence(one_out) == (
        "Put into the model, it closes 90 % (90 % interval 80 % to 95 %) of the gap on the records used, and 70 % "
        "(a single record: no interval) on records held out."
    )
    assert shrink_sentence({}) == ""


@pytest.mark.parametrize(
    ("head", "words"),
    [
        ({"tests": 3, "amplitude_before": 0.051, "damping_before": 0.07},
         " Of tests left out in turn, the stable amplitude is off by 5.1 % (median) and the damping curve by 7.0 % of "
         "the relaxation damping."),
        ({"test": "light", "records": 2, "damping_before": 0.07},
         " Of the records of light left out in turn, the damping curve is off by 7.0 % of the relaxation damping."),
        ({"records": 2, "damping_before": 0.07},
         " Of records left out in turn, the damping curve is off by 7.0 % of the structural damping."),
        ({"records": 1, "damping_before": None}, ""),
        (None, ""),
    ],
)  # fmt: skip
def test_where_nothing_can_be_put_in_there_is_no_after(head: dict[str, object] | None, words: str) -> None:
    entry = {"measurable": False, "put_in": False, "headline": head, "held_out": None, "fraction": None}
    assert shrink_sentence(entry) == f"There is nothing that could be put into the model.{words}"
    assert not held_out_table({"shrink": entry}, TERMINAL, "A/D").rows
