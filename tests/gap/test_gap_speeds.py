"""Tests at other speeds of a rig: what they say of a drift with the reduced velocity, and what they leave alone."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scruton.calibrate.challenge.case import simulate_case
from scruton.campaign.schema import Campaign, Kind, Quantity, Record, Test
from scruton.dynamics.effects import CATALOGUE
from scruton.gap.advise import advise
from scruton.gap.attribute import weigh
from scruton.gap.data import load_gap
from scruton.gap.diagnose import left_out_tests
from scruton.gap.diagnosis import diagnose, fit_null
from scruton.gap.search import Place
from scruton.gap.speeds import DRIFT, SETTING, _not_above_the_unknown, weighed_at_other_speeds
from scruton.simulate import Noise, Truth, simulate_record
from tests.gap.few import among

SEED = 71
ASKED = (CATALOGUE[DRIFT], CATALOGUE[SETTING])


def at_speed(campaign: Campaign, wind: Truth, k: int) -> Test:
    """A growth and a decay in a wind, as a test like the middle one of a campaign."""
    level, rate = wind.balance()
    records = []
    for i, (kind, start) in enumerate(((Kind.GROWTH, 0.15), (Kind.DECAY, 2.2))):
        time, response = simulate_record(
            wind, initial_amplitude=start * level, duration=5.0 / rate, sample_rate=28 * wind.frequency,
            seed=np.random.SeedSequence([SEED, k, i]), noise=Noise(0.01, 0.005 * level),
        )  # fmt: skip
        name = f"speed{k}-{kind.value}.csv"
        records.append(Record(name, Path(name), kind, time, response))
    speed = Quantity(wind.wind_speed)
    return replace(campaign.tests[1], name=f"speed {k}", wind_speed=speed, records=tuple(records))


def swept(effect: str | None, law: str) -> Campaign:
    """Three rigs, and of the middle one a growth and a decay at the speeds of the others.

    Its parameters are those of the others' peaks ("speed"), stay its own ("rig"), or fall off on both sides ("bell").
    """
    campaign, answer = simulate_case(SEED, 1, effect, 0.2)
    section, tests = campaign.section, list(campaign.tests)
    rig, truth, peak = campaign.rigs[1], answer["rigs"][1], campaign.tests[1]
    u = [t.wind_speed.mean / campaign.rigs[i].frequency.mean for i, t in enumerate(campaign.tests)]
    if not effect:  # speeds that differ, the parameters alike
        u = [u[1] * (1.0 + x) for x in (-0.03, 0.0, 0.03)]
        speeds = [Quantity(x * r.frequency.mean) for x, r in zip(u, campaign.rigs, strict=True)]
        tests = [replace(t, wind_speed=speed) for t, speed in zip(tests, speeds, strict=True)]
    for k in (0, 2):
        other = answer["rigs"][k] if law == "speed" else truth
        fall = 0.7 if law == "bell" else 1.0
        wind = Truth(
            section.motion, section.width, section.depth, rig.mass.mean, rig.frequency.mean, truth["damping_ratio"],
            peak.air_density.mean, (u[k] + 0.1 * (u[1] - u[k])) * rig.frequency.mean,
            Y1=other["Y1"], epsilon=fall * other["epsilon"],
        )  # fmt: skip
        tests.append(replace(at_speed(campaign, wind, k), peak=False))
    return replace(campaign, tests=tuple(tests))


def test_the_reduced_velocity_is_that_of_the_frequency_in_wind() -> None:
    """The wind changes the frequency: U/(f D) goes by that of the records, not by that of the rig at rest."""
    campaign, _ = simulate_case(SEED, 1, None, 0.0)
    first = campaign.tests[0]
    slower = tuple(replace(record, time=1.03 * record.time) for record in first.records)
    stretched = replace(campaign, tests=(replace(first, records=slower), *campaign.tests[1:]))
    before, after = (load_gap(one).layout for one in (campaign, stretched))
    own = before.test == 0
    assert after.reduced_velocity[own] == pytest.approx(1.03 * before.reduced_velocity[own], rel=1e-3)
    at_rest = first.wind_speed.mean / (campaign.rig(first.rig).frequency.mean * campaign.section.depth)
    assert before.reduced_velocity[own] == pytest.approx(at_rest, rel=0.01), "of the rig's own, as it was simulated"
    others = before.wind & ~own
    np.testing.assert_array_equal(after.reduced_velocity[others], before.reduced_velocity[others])


def test_those_between_the_peaks_are_read_beside_the_diagnosis() -> None:
    campaign = swept(None, "rig")
    data = load_gap(campaign)
    more = data.at_other_speeds
    assert more is not None
    assert not any(name.startswith("speed") for name in data.layout.records)
    assert more.layout.records == (*data.layout.records, *(r.name for t in campaign.tests[3:] for r in t.records))
    assert (more.middle, more.tests) == (data.middle, data.tests)
    (flag,) = left_out_tests(data)
    assert flag.startswith("Tests at other speeds of a rig: speed 0, speed 2. They are asked one thing alone")
    assert data.referred_to(0.1, 2.0).at_other_speeds.layout.reference_rate == 2.0


def test_those_beyond_the_peaks_are_left_out() -> None:
    campaign = swept(None, "rig")
    *others, last = campaign.tests
    fast = replace(last, wind_speed=Quantity(1.1 * last.wind_speed.mean))
    data = load_gap(replace(campaign, tests=(*others, fast)))
    assert set(data.at_other_speeds.layout.test) == {-1, 0, 1, 2, 3}
    speeds, left_out = left_out_tests(data)
    assert "speed 0. " in speeds
    assert left_out.startswith("Left out of the diagnosis: speed 2. ")


def test_peaks_at_one_speed_leave_nothing_to_ask() -> None:
    campaign = swept(None, "rig")
    tests = campaign.tests
    f = [campaign.rig(test.rig).frequency.mean for test in tests]
    alike = [
        replace(t, wind_speed=Quantity(tests[1].wind_speed.mean * x / f[1])) for t, x in zip(tests, f, strict=True)
    ]
    assert load_gap(replace(campaign, tests=(*alike[:3], *tests[3:]))).at_other_speeds is None


def one_rig(law: str, speeds: int) -> Campaign:
    """One rig whose epsilon is the same at every speed, rises by 30 %, falls off on both sides, or has no order."""
    campaign, answer = simulate_case(SEED, 1, None, 0.0)
    section, rig, truth, peak = campaign.section, campaign.rigs[0], answer["rigs"][0], campaign.tests[0]
    tests = []
    for k, x in enumerate(np.linspace(-0.5, 0.5, speeds)):
        change = {"same": 0.0, "rises": 0.3 * x, "bell": -1.2 * x**2, "zigzag": 0.15 * (-1) ** k}[law]
        wind = Truth(
            section.motion, section.width, section.depth, rig.mass.mean, rig.frequency.mean, truth["damping_ratio"],
            peak.air_density.mean, peak.wind_speed.mean * (1.0 + 0.12 * x), Y1=truth["Y1"],
            epsilon=truth["epsilon"] * (1.0 + change),
        )  # fmt: skip
        tests.append(replace(at_speed(campaign, wind, k), rig=rig.name, peak=k == speeds // 2))
    return replace(campaign, rigs=(rig,), tests=tuple(tests))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("law", "speeds", "read", "found"),
    [
        ("same", 3, 3, ()),
        ("rises", 5, 5, (DRIFT,)),
        ("rises", 2, 1, ()),  # one other speed has an epsilon of its own in any lock-in range
        ("bell", 5, 5, (DRIFT,)),
        ("zigzag", 5, 1, ()),
    ],
)
def test_one_rig_at_several_speeds(law: str, speeds: int, read: int, found: tuple[str, ...]) -> None:
    rivals = among(DRIFT, "wind_speed_drift", "aerodynamic_damping_nonlinearity")
    diagnosis = diagnose(one_rig(law, speeds), prior=rivals)
    assert len(diagnosis.data.first_in_wind) == read
    assert diagnosis.found == found
    (flag,) = left_out_tests(diagnosis.data)
    assert flag.startswith("Tests at several speeds of a rig" if read > 1 else "Left out of the diagnosis")
    assert not any("two more wind speeds" in line for line in advise(diagnosis))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "law", "told"),
    [
        (DRIFT, "speed", DRIFT),
        (DRIFT, "bell", None),
        (SETTING, "rig", SETTING),
        (SETTING, "bell", None),
        (None, "bell", None),
        (None, "rig", None),
    ],
)
def test_what_they_tell(effect: str | None, law: str, told: str | None) -> None:
    _, null = fit_null(load_gap(swept(effect, law)))
    place = Place(null, weigh(null, ASKED))
    before = {name: place.gains[name] for name in (DRIFT, SETTING)}
    after = before | weighed_at_other_speeds(place, ASKED, workers=1)
    if told is None:  # a lock-in range with its maximum is no gap, and speaks for nothing
        assert all(after[name] < before[name] + 2.0 for name in before)
        return
    other = {DRIFT: SETTING, SETTING: DRIFT}[told]
    assert after[told] - after[other] > before[told] - before[other] + 3.0


@pytest.mark.parametrize(
    ("unknown", "told", "kept"),
    [
        (125.0, {DRIFT: 6.0, SETTING: 156.0}, {DRIFT: -69.0, SETTING: 81.0}),  # it was asked nothing of them
        (85.0, {DRIFT: 6.0, SETTING: 156.0}, {DRIFT: 6.0, SETTING: 156.0}),  # the peak tests do not tell it apart
        (125.0, {DRIFT: 6.0, SETTING: 20.0}, {DRIFT: 6.0, SETTING: 20.0}),  # and what they take is taken
        (125.0, {}, {}),
    ],
)
def test_they_lift_nothing_above_an_unknown_that_the_peak_tests_put_ahead(
    unknown: float, told: dict[str, float], kept: dict[str, float]
) -> None:
    assert _not_above_the_unknown(told, {DRIFT: 4.0, SETTING: 81.0, "unknown": unknown}) == kept
