"""The generator of the blind challenge: severities as stated, campaigns that load, answers that stay sealed."""

import json
from collections import Counter
from dataclasses import replace
from hashlib import sha256

import numpy as np
import pytest

from scruton.calibrate.challenge.case import simulate_case
from scruton.calibrate.challenge.make import KINDS, SEVERITIES, Plan, make_challenge
from scruton.calibrate.challenge.scenarios import CATALOGUE, OPEN, apply
from scruton.calibrate.challenge.sections import limit_cycle, random_body
from scruton.calibrate.execution import Execution
from scruton.campaign import Fluid, Kind, load_campaign
from scruton.campaign.write import save_campaign
from scruton.errors import InputError
from scruton.simulate import Disturbances, simulate_record
from scruton.workers import Workers

EFFECTS = (*CATALOGUE, *OPEN)
QUIET = {"turbulence": 0.0, "noise": 0.0}
FORCES = ("coulomb_friction", "structural_damping_nonlinearity", "aerodynamic_damping_nonlinearity")


def envelope(time, response, omega):
    """Amplitude of every cycle of a record of 28 samples a cycle: no part of the program."""
    whole = len(response) // 28
    angle = omega * time[: whole * 28].reshape(whole, 28)
    design = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    y = response[: whole * 28].reshape(whole, 28)
    return np.array([np.hypot(*np.linalg.lstsq(d, one, rcond=None)[0]) for d, one in zip(design, y, strict=True)])


def release(rig, disturbances, start, cycles):
    f = rig.wind.frequency
    time, x = simulate_record(
        rig.wind, initial_amplitude=start, duration=cycles / f, sample_rate=28 * f, seed=1, disturbances=disturbances
    )
    a = envelope(time, x, rig.wind.omega)
    return (np.arange(len(a)) + 0.5) / f, a


def records(campaign):
    return [r for owner in (*campaign.rigs, *campaign.tests) for r in owner.records]


def same(one, two):
    return all(a.response.tobytes() == b.response.tobytes() for a, b in zip(records(one), records(two), strict=True))


@pytest.mark.parametrize("severity", [0.1, 0.4])
@pytest.mark.parametrize("effect", FORCES)
@pytest.mark.parametrize("number", range(4))
def test_the_damping_at_the_stable_amplitude_is_the_severity(effect, severity, number):
    rng = np.random.default_rng([7, number])
    body = random_body(rng)
    made, drawn = apply(body, effect, severity, rng)
    j = 1 if 1 in drawn["rigs"] else drawn["rigs"][0]
    if j != 1:  # the middle rig is spared: lend it the disturbances of one that is not
        made = replace(
            made, rigs=(made.rigs[0], replace(made.rigs[1], disturbances=made.rigs[j].disturbances), made.rigs[2])
        )
    amplitude, rate = body.middle.undisturbed
    sign = -1.0 if drawn.get("coefficient", 1.0) > 0 else 1.0
    t, a = release(
        made.middle, made.middle.disturbances, (1.0 - 0.15 * sign) * amplitude, 1.2 * made.middle.wind.frequency / rate
    )
    # The bare rate vanishes at the bare stable amplitude, which the motion passes on its way.
    fit = np.polynomial.Polynomial.fit(t, a, 6)
    passing = t[0] + np.argmin(np.abs(fit(np.linspace(t[0], t[-1], 4001)) - amplitude)) * (t[-1] - t[0]) / 4000
    assert fit.deriv()(passing) / (rate * amplitude) == pytest.approx(sign * severity, rel=0.02, abs=0.003)


@pytest.mark.parametrize("effect", EFFECTS)
@pytest.mark.parametrize("severity", [0.1, 0.4])
def test_every_record_is_finite_and_every_rig_has_a_limit_cycle(effect, severity):
    campaign, answer = simulate_case(3, 8, effect, severity)
    assert len(records(campaign)) == 18
    assert [len(test.records) for test in campaign.tests] == [4, 4, 4]
    assert [r.kind for r in campaign.rigs[0].records] == [Kind.FREE_DECAY] * 2
    for record in records(campaign):
        assert np.isfinite(record.response).all()
        assert 12 <= len(record.time) / 28 <= 201
    numbers = [rig["scruton_number_without"] for rig in answer["rigs"]]
    assert numbers == sorted(numbers)
    assert numbers[2] / numbers[0] == pytest.approx(4.0, rel=0.5)
    low, high = (0.006, 0.2) if answer["motion"] == "heaving" else np.deg2rad([0.6, 6.5])
    assert all(low < rig["stable_amplitude"] < high for rig in answer["rigs"])
    json.dumps(answer)


@pytest.mark.parametrize("effect", [*FORCES, "spanwise_coherence_loss", "reduced_velocity_drift", "setting_dependence",
                                    "fluid_memory",
                                    "structural_damping_error", "damping_bump", "wake_oscillator"])  # fmt: skip
def test_the_stable_amplitude_of_the_answer_is_where_the_motion_goes(effect):
    campaign, answer = simulate_case(11, 2, effect, 0.2, **QUIET)
    for test, rig in zip(campaign.tests, answer["rigs"], strict=True):
        grown, fallen = test.records[0], test.records[2]
        ends = [np.sqrt(2.0) * r.response[-5 * 28 :].std() for r in (grown, fallen)]
        assert ends[0] == pytest.approx(rig["stable_amplitude"], rel=0.05)
        assert ends[1] == pytest.approx(rig["stable_amplitude"], rel=0.06)


def test_without_an_effect_nothing_is_disturbed():
    campaign, answer = simulate_case(4, 1, None, 0.4)
    assert answer["kind"] == "none"
    assert answer["effects"] == []
    assert answer["severity"] == 0.0
    for rig in answer["rigs"]:
        assert rig["disturbances"] == {}
        assert rig["records"] == {}
        assert rig["stable_amplitude"] == pytest.approx(rig["stable_amplitude_without"], rel=1e-6)
    stated = [rig.damping_ratio for rig in campaign.rigs]
    for said, rig in zip(stated, answer["rigs"], strict=True):
        assert 0.02 <= said.sd / said.mean <= 0.05
        assert abs(said.mean / rig["damping_ratio"] - 1) < 0.2


def test_turbulence_and_noise_are_as_drawn():
    scatter, hiss = [], []
    for index in range(3):
        campaign, answer = simulate_case(5, index, None, 0.0, turbulence=0.01, noise=0.02)
        smallest = min(rig["stable_amplitude"] for rig in answer["rigs"])
        quiet = simulate_case(5, index, None, 0.0, turbulence=0.01, noise=0.0)[0]
        for test, other, rig in zip(campaign.tests, quiet.tests, answer["rigs"], strict=True):
            for r, q in zip(test.records, other.records, strict=True):
                hiss.append((r.response - q.response).std() / smallest)
            tail = [envelope(q.time, q.response, 2 * np.pi * campaign.rigs[0].frequency.mean) for q in other.records]
            scatter += [one[-1] / rig["stable_amplitude"] - 1 for one in tail[:2]]
    np.testing.assert_allclose(hiss, 0.02, rtol=0.1)
    assert 0.005 < np.std(scatter) < 0.02


def test_gusts_move_the_amplitude_slowly_and_by_as_much_as_is_said():
    ends, steps = [], []
    for index in range(12):
        campaign, answer = simulate_case(5, index, None, 0.0, turbulence=0.0, noise=0.0, gusts=0.03)
        assert answer["gusts"] == 0.03
        for test, rig in zip(campaign.tests, answer["rigs"], strict=True):
            for r in test.records:
                a = envelope(r.time, r.response, 2 * np.pi * campaign.rigs[0].frequency.mean) / rig["stable_amplitude"]
                ends.append(a[-1] - 1)
                steps.append(np.diff(a[-10:]).std())
    # Ornstein-Uhlenbeck gusts of T relaxation times leave T/(1 + T) of their variance: 0.69 on average over 0.3 to 10
    assert np.std(ends) == pytest.approx(0.03 * np.sqrt(0.69), rel=0.2)
    assert np.median(steps) < 0.1 * np.std(ends)
    # Gusts move nothing else, and without them every byte is what it was.
    calm, quiet = simulate_case(5, 3, "fluid_memory", 0.2, gusts=0.0), simulate_case(5, 3, "fluid_memory", 0.2)
    assert same(calm[0], quiet[0])
    gusty = simulate_case(5, 3, "fluid_memory", 0.2, gusts=(0.01, 0.02))
    assert 0.01 < gusty[1]["gusts"] < 0.02
    assert {**gusty[1], "gusts": 0.0} == quiet[1]
    assert not same(gusty[0], quiet[0])


def test_severities_of_the_faults():
    rng = np.random.default_rng(0)
    body = random_body(rng)
    amplitude, rate = body.middle.undisturbed
    for s in SEVERITIES:
        made = {name: apply(body, name, s, rng) for name in EFFECTS}
        assert abs(made["sensor_gain_error"][1]["gain"] - 1.0) == pytest.approx(s)
        assert made["sensor_clipping"][1]["over_largest"] == pytest.approx(1 - 0.6 * s)
        assert made["spanwise_coherence_loss"][1]["amplitude"] == pytest.approx((0.15 + 0.85 * s) * amplitude)
        assert made["fluid_memory"][1]["time_s"] == pytest.approx(s / rate)
        assert abs(made["structural_damping_error"][1]["damping_ratio"]) == pytest.approx(
            s * rate / body.middle.wind.omega
        )
        drifted = made["reduced_velocity_drift"][0].rigs
        ratios = [rig.wind.Y1 / before.wind.Y1 for rig, before in zip(drifted, body.rigs, strict=True)]
        assert abs(ratios[2] - ratios[0]) == pytest.approx(2 * s)
        assert ratios[1] == pytest.approx(1.0)
        unordered = [r.wind.Y1 / b.wind.Y1 for r, b in zip(made["setting_dependence"][0].rigs, body.rigs, strict=True)]
        assert np.ptp(unordered) == pytest.approx(2 * s)
        np.testing.assert_allclose(np.abs(list(made["wind_speed_drift"][1]["drift"].values())), 0.75 * s)
        assert abs(made["stiffness_nonlinearity"][1]["change"]) == pytest.approx(0.06 * s)


def test_settings_differ_without_order_and_a_drift_follows_the_reduced_velocity():
    rng, depends = np.random.default_rng(1), []
    for _ in range(40):
        body = random_body(rng)
        for name in ("setting_dependence", "reduced_velocity_drift"):
            rigs = apply(body, name, 0.2, rng)[0].rigs
            speed = [rig.wind.wind_speed / rig.wind.frequency for rig in rigs]
            assert 0.019 < np.ptp(speed) / np.median(speed) < 0.09
            for parameter in ("Y1", "epsilon"):
                values = [getattr(rig.wind, parameter) for rig in rigs]
                if np.ptp(values) == 0.0:
                    continue
                order = abs(np.corrcoef(speed, values)[0, 1])
                assert order > 0.999 if name == "reduced_velocity_drift" else order < 0.31
                if name == "setting_dependence":
                    depends.append(parameter)
    assert depends.count("Y1") == 40
    assert 8 < depends.count("epsilon") < 32
    with pytest.raises(ValueError, match="needs three rigs"):
        apply(random_body(rng, 1), "setting_dependence", 0.2, rng)


def test_stiffness_changes_the_frequency_by_six_per_cent_of_the_severity():
    rng = np.random.default_rng(3)
    body = random_body(rng)
    made, drawn = apply(body, "stiffness_nonlinearity", 0.4, rng)
    largest = drawn["up_to"]
    rig = max(made.rigs, key=lambda one: one.undisturbed[0])
    f = rig.wind.frequency
    frequencies = []
    for start in (0.02 * largest, largest):
        time, x = simulate_record(
            rig.still,
            initial_amplitude=start,
            duration=6 / f,
            sample_rate=400 * f,
            seed=2,
            disturbances=rig.disturbances,
        )
        up = np.flatnonzero((x[1:] > 0) & (x[:-1] <= 0))
        zero = time[up] - x[up] * (time[up + 1] - time[up]) / (x[up + 1] - x[up])
        frequencies.append(1 / (zero[1] - zero[0]))
    assert frequencies[1] / frequencies[0] - 1 == pytest.approx(drawn["change"], rel=0.25)


def test_clipping_ends_the_largest_amplitude():
    open_, _ = simulate_case(6, 0, None, 0.0, **QUIET)
    clipped, answer = simulate_case(6, 0, "sensor_clipping", 0.4, **QUIET)
    hit = answer["parameters"]["sensor_clipping"]["rigs"]
    for j, (one, two) in enumerate(zip(open_.tests, clipped.tests, strict=True)):
        before, after = (max(np.abs(r.response).max() for r in t.records) for t in (one, two))
        assert after / before == pytest.approx(0.76 if j in hit else 1.0, abs=0.03)


def test_growth_lags_and_decay_leads_with_memory():
    bare, _ = simulate_case(6, 0, None, 0.0, **QUIET)
    late, answer = simulate_case(6, 0, "fluid_memory", 0.2, **QUIET)
    for one, two, rig in zip(bare.tests, late.tests, answer["rigs"], strict=True):
        for i in (0, 2):
            a, b = (r.records[i].response for r in (one, two))
            quarter = slice(len(a) // 6, len(a) // 6 + 56)
            away = [abs(np.sqrt(2) * x[quarter].std() - rig["stable_amplitude"]) for x in (a, b)]
            assert away[1] < away[0]


def test_the_wake_does_the_work_of_what_it_replaces():
    for index in range(3):
        _, answer = simulate_case(8, index, "wake_oscillator", 0.4)
        middle = answer["rigs"][1]
        assert middle["stable_amplitude"] == pytest.approx(middle["stable_amplitude_without"], rel=0.05)
        assert middle["disturbances"]["wake_share"] == 1.0


def test_limit_cycle_finds_the_bare_one_and_knows_where_there_is_none():
    rig = random_body(np.random.default_rng(2)).middle
    np.testing.assert_allclose(limit_cycle(rig.wind, Disturbances()), rig.undisturbed, rtol=1e-3)
    amplitude, rate = rig.undisturbed
    drained = Disturbances(friction=2.0 * rate * amplitude * rig.wind.omega, friction_scale=1e-9)
    assert np.isnan(limit_cycle(rig.wind, drained)[0])


def test_the_seed_and_the_number_settle_everything():
    one, answer = simulate_case(9, 4, ("coulomb_friction", "wind_speed_drift"), 0.2)
    two, again = simulate_case(9, 4, ("coulomb_friction", "wind_speed_drift"), 0.2)
    assert same(one, two)
    assert answer == again
    assert answer["kind"] == "two"
    assert not same(one, simulate_case(9, 5, ("coulomb_friction", "wind_speed_drift"), 0.2)[0])
    # What is given does not move what is drawn.
    given = simulate_case(9, 4, None, 0.0, turbulence=0.03)[1]
    free = simulate_case(9, 4, None, 0.0)[1]
    assert given["noise"] == free["noise"]
    assert given["rigs"][0]["Y1"] == free["rigs"][0]["Y1"]


def test_one_rig_has_no_still_air():
    campaign, answer = simulate_case(1, 1, "fluid_memory", 0.2, "one-rig")
    assert len(campaign.rigs) == len(answer["rigs"]) == 1
    assert campaign.rigs[0].records == ()
    assert len(campaign.tests[0].records) == 4


def test_blocks_hold_every_effect_at_every_severity():
    plan = Plan(3)
    size = len(plan.block())
    drawn = [plan.case(k) for k in range(1, 2 * size + 1)]
    count = Counter(drawn)
    assert count[((), 0.0)] == 16
    for name in EFFECTS:
        for s in SEVERITIES:
            assert count[((name,), s)] == 2
    two = [one for one in drawn if len(one[0]) == 2]
    assert len(two) == 12
    assert all(s >= 0.2 and set(names) <= set(CATALOGUE) for names, s in two)
    pairs = {Plan(3, effects=("two",)).case(k)[0] for k in range(1, 1500)}
    # all that there are, but for the two that would undo each other
    assert len(pairs) == len(CATALOGUE) * (len(CATALOGUE) - 1) // 2 - 1
    assert ("reduced_velocity_drift", "setting_dependence") not in pairs
    assert drawn[:size] != drawn[size:]
    assert not {"reduced_velocity_drift", "setting_dependence"} & set(Plan(3, design="one-rig").kinds)
    assert set(plan.kinds) == set(KINDS)


def challenge(out, cases=3, jobs=1, force=False, resume=False, **more):
    plan = Plan(**({"seed": 12, "effects": ("none", "sensor_gain_error"), "severities": (0.4,)} | more))
    return make_challenge(Execution(out, Workers(jobs), force, resume), plan, cases)


def bytes_of(out):
    return {str(p.relative_to(out)): p.read_bytes() for p in sorted(out.rglob("*")) if p.is_file()}


def test_a_challenge_loads_and_its_answers_are_sealed(tmp_path):
    out = challenge(tmp_path / "c", effects=None, cases=4)
    table = json.loads((out / "challenge.json").read_text())
    sealed = (out / "answers" / "answers.json").read_bytes()
    assert table["answers_sha256"] == sha256(sealed).hexdigest()
    assert table["cases"] == ["case-0001", "case-0002", "case-0003", "case-0004"]
    assert sorted(p.name for p in out.iterdir()) == [".scruton", "answers", *table["cases"], "challenge.json"]
    answers = json.loads(sealed)
    for index, name in enumerate(table["cases"], start=1):
        loaded = load_campaign(out / name)
        effects, severity = Plan(12, table["settings"]["effects"], (0.4,)).case(index)
        want, answer = simulate_case(12, index, effects, severity)
        assert answers[name] == json.loads(json.dumps(answer))
        for got, made in zip(records(loaded), records(want), strict=True):
            assert got.name == made.name
            assert got.kind is made.kind
            np.testing.assert_allclose(got.time, made.time, atol=1e-9)
            np.testing.assert_allclose(got.response, made.response, atol=2e-4 * np.abs(made.response).max())
        for got, made in zip(loaded.rigs, want.rigs, strict=True):
            assert got.damping_ratio == made.damping_ratio
            assert got.mass.mean == pytest.approx(made.mass.mean)
        text = (out / name / "campaign.toml").read_text()
        assert not any(effect in text for effect in EFFECTS)


@pytest.mark.thorough
def test_a_challenge_is_the_same_however_it_is_made(tmp_path):
    whole = challenge(tmp_path / "whole")
    stopped = challenge(tmp_path / "parts", cases=1)
    (stopped / "answers" / "answers.json").unlink()  # as if interrupted before the seal
    challenge(stopped, resume=True)
    assert bytes_of(stopped) == bytes_of(whole)
    assert bytes_of(challenge(tmp_path / "processes", jobs=2)) == bytes_of(whole)
    challenge(stopped, force=True, seed=13)
    assert bytes_of(stopped).keys() == bytes_of(whole).keys()
    assert bytes_of(stopped) != bytes_of(whole)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"cases": 0}, "cases: found 0; wanted at least 1"),
        ({"effects": ("wobble",)}, "effects: found 'wobble'; wanted some of: none, coulomb_friction"),
        ({"severities": (0.9,)}, "severities: found .* numbers above 0"),
        ({"design": "two-rig"}, "design: found 'two-rig'; wanted one of: full, one-rig"),
        ({"design": "one-rig", "effects": ("reduced_velocity_drift",)}, "the design full"),
        ({"design": "one-rig", "effects": ("setting_dependence",)}, "the design full"),
        ({"turbulence": (0.02, 0.01)}, "turbulence: found 0.02 to 0.01"),
        ({"gusts": (0.02, 0.3)}, "gusts: found 0.02 to 0.3"),
    ],
)
def test_settings_that_make_no_challenge(tmp_path, settings, message):
    with pytest.raises(InputError, match=message):
        challenge(tmp_path / "c", **settings)
    assert not (tmp_path / "c").exists()


def test_a_folder_is_not_overwritten(tmp_path):
    out = challenge(tmp_path / "c", cases=1)
    with pytest.raises(InputError, match=r"an earlier run \(challenge.json, .*wanted an empty folder, --resume"):
        challenge(out)
    with pytest.raises(InputError, match=r"a run with other seed \(12, now 13\)"):
        challenge(out, seed=13, resume=True)


def test_unknown_effects_and_designs_are_refused():
    with pytest.raises(ValueError, match="unknown effect 'wobble'"):
        simulate_case(1, 1, "wobble", 0.1)
    with pytest.raises(ValueError, match="unknown design 'two-rig'"):
        simulate_case(1, 1, None, 0.1, "two-rig")


def test_a_campaign_in_water_stays_in_water(small_campaign, tmp_path):
    campaign = load_campaign(small_campaign)
    assert campaign.section.fluid is Fluid.AIR
    save_campaign(replace(campaign, section=replace(campaign.section, fluid=Fluid.WATER)), tmp_path)
    assert load_campaign(tmp_path).section.fluid is Fluid.WATER


def test_a_test_beside_the_peak_is_written_as_one(small_campaign, tmp_path):
    campaign = load_campaign(small_campaign)
    first = campaign.tests[0]
    records = tuple(replace(record, name=f"other-{record.name}") for record in first.records)
    other = replace(first, name="another speed", peak=False, records=records)
    save_campaign(replace(campaign, tests=(*campaign.tests, other)), tmp_path)
    assert load_campaign(tmp_path).tests[-1].peak is False
