"""Where the gap lies: places are where the effect acts, and where none acts there are none."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from scruton.calibrate.challenge.case import simulate_case
from scruton.dynamics.effects import CATALOGUE
from scruton.dynamics.limit_cycle import amplitude_rates
from scruton.gap.data import load_gap
from scruton.gap.diagnosis import Diagnosis, diagnose, fit_null
from scruton.gap.finding import Z90, Finding
from scruton.gap.lines import SecondLine, unexplained_lines
from scruton.gap.locate import locate, merged, scope_findings
from scruton.gap.locate_curves import DECAY, GROWTH, STILL, Curve, curve_findings, excess_curves
from scruton.gap.locate_records import CONTRASTS, _bursts, _colour, _tails, line_findings, wave_findings
from tests.gap.few import among

QUANTITIES = {"damping", "frequency", "scatter", "spectrum", "branch", "test", "signal"}


@pytest.fixture(scope="module")
def friction() -> tuple[Diagnosis, list[int]]:
    campaign, answer = simulate_case(5, 1, "coulomb_friction", 0.2)
    rivals = among("coulomb_friction", "structural_damping_nonlinearity", "structural_damping_error")
    return diagnose(campaign, prior=rivals), answer["parameters"]["coulomb_friction"]["rigs"]


@pytest.fixture(scope="module")
def findings(friction: tuple[Diagnosis, list[int]]) -> tuple[Finding, ...]:
    return locate(friction[0])


def test_friction_in_one_rig_is_said_to_be_in_that_rig_first(
    friction: tuple[Diagnosis, list[int]], findings: tuple[Finding, ...]
) -> None:
    diagnosis, rigs = friction
    told = [one for one in findings if one.effect == "coulomb_friction"]
    assert {one.rig for one in told} == {diagnosis.data.rigs[i] for i in rigs}
    assert findings[: len(told)] == tuple(told)
    # by construction of the severity: 0.2 of the relaxation damping at the middle rig's stable amplitude
    layout = diagnosis.data.layout
    assert told[0].excess == pytest.approx(0.2 * layout.reference_rate / layout.reference_omega, rel=0.25)
    assert told[0].interval90[0] > 0.0


def test_the_strongest_place_of_friction_is_still_air_at_small_amplitude(
    friction: tuple[Diagnosis, list[int]], findings: tuple[Finding, ...]
) -> None:
    diagnosis, rigs = friction
    strongest = next(one for one in findings if one.effect is None)
    assert (strongest.quantity, strongest.test, strongest.rig) == ("damping", None, diagnosis.data.rigs[rigs[0]])
    assert strongest.excess > 0.0
    assert strongest.amplitude is not None
    assert strongest.amplitude[0] < 0.2 * diagnosis.data.layout.largest.max()


def test_every_finding_is_whole_and_lies_in_its_record(
    friction: tuple[Diagnosis, list[int]], findings: tuple[Finding, ...]
) -> None:
    data = friction[0].data
    assert 0 < len(findings) <= 12
    for one in findings:
        entry = one.to_json()
        assert {"quantity", "rig", "test", "record", "amplitude", "time_s", "excess", "interval90"} <= set(entry)
        assert one.quantity in QUANTITIES
        assert one.interval90[0] <= one.excess <= one.interval90[1]
        if one.record is not None:
            record = data.layout.records.index(one.record)
            assert data.rigs[data.layout.rig[record]] == one.rig
            assert one.time is not None
            time = data.cycles[one.record].time
            assert time[0] <= one.time[0] <= one.time[1] <= time[-1]
            assert one.amplitude is not None
            assert one.amplitude[1] <= data.channels.amplitude.max() * 1.001


def test_the_curve_in_still_air_is_the_friction_that_was_put_in(friction: tuple[Diagnosis, list[int]]) -> None:
    diagnosis, rigs = friction
    data = diagnosis.data
    curves = excess_curves(diagnosis.null)
    curve = next(c for c in curves.damping if c.direction == STILL and data.layout.rig[c.record] == rigs[0])
    # the slow, obvious way: total damping from the found effect's own equation, minus that of the null model
    tables = [
        e.hypothesis.table(e.mode[None])[:, curve.record] for e in (diagnosis.final, diagnosis.null)
    ]  # both at their optimum
    with_it, bare = (-amplitude_rates(t, curve.amplitude, data.channels.knots)[0] / curve.amplitude for t in tables)
    truth = (with_it - bare) / data.layout.omega[curve.record]
    middle = slice(8, -8)
    assert curve.excess[middle] == pytest.approx(truth[middle], rel=0.15, abs=4e-4)


def test_no_effect_leaves_no_place_in_the_damping() -> None:
    campaign, _ = simulate_case(5, 2, None, 0.2)
    data, null = fit_null(load_gap(campaign))
    curves = excess_curves(null)
    assert [one for one in curve_findings(curves, data) if one.quantity == "damping"] == []
    assert wave_findings(data) == []
    directions = {c.direction for c in curves.damping}
    assert directions == {GROWTH, DECAY, STILL}
    # no worse than bands of 90 per cent
    outside = [np.mean(np.abs(c.excess) > 1.645 * c.sd) for c in curves.damping]
    assert np.mean(outside) < 0.15


def _curve(excess: np.ndarray, sd: float = 1.0, critical: float = 3.0) -> Curve:
    amplitude = np.geomspace(0.01, 0.1, excess.size)
    records = np.array([True])
    return Curve("damping", GROWTH, 0, records, amplitude, excess, sd**2 * np.eye(excess.size), critical)


@pytest.mark.parametrize(
    ("excess", "count"),
    [
        (np.zeros(40), 0),
        (np.full(40, 2.0), 0),  # outside of the band, but not beyond chance
        (np.where(np.arange(40) == 20, 5.0, 0.0), 0),  # a point is no place
        (np.where(np.arange(40) < 20, 5.0, 0.0), 1),
        (np.where(np.arange(40) < 20, 5.0, -5.0), 2),  # signs are not merged
        (np.where(np.abs(np.arange(40) - 15) < 1, 0.0, 5.0), 1),  # a hole is bridged
    ],
)
def test_places_of_a_curve(excess: np.ndarray, count: int) -> None:
    assert len(_curve(excess).places()) == count


def test_marks_of_scatter_know_noise_from_what_is_none() -> None:
    rng = np.random.default_rng(1)
    white = rng.standard_normal((200, 120))
    for mark in (_colour, _bursts, _tails):
        assert np.mean([mark(x).significance > 3.0 for x in white]) < 0.02
    coloured = np.convolve(rng.standard_normal(124), np.ones(5), mode="valid")
    assert _colour(coloured).significance > 5.0
    burst = np.where(np.arange(120) < 30, 3.0, 1.0) * white[0]
    found = _bursts(burst)
    assert found.significance > 3.0
    assert found.cycles == slice(0, 30)
    assert _tails(rng.standard_t(2, 300)).significance > 3.0


def test_lines_count_only_far_above_chance(friction: tuple[Diagnosis, list[int]]) -> None:
    data = friction[0].data
    record = data.layout.records[0]
    lines = [SecondLine(record, 1.5, 0.001, 80.0), SecondLine(record, 2.5, 0.001, 10.0)]
    (found,) = line_findings(lines, data)
    assert found.quantity == "spectrum"
    assert found.excess == 0.001
    assert found.interval90[0] > 0.0


def test_a_line_far_from_the_response_is_no_force_off_it(friction: tuple[Diagnosis, list[int]]) -> None:
    data, forced = friction[0].data, ["vortex_shedding_forcing"]
    record = data.layout.records[int(np.flatnonzero(data.layout.wind)[0])]
    frequency = data.cycles[record].reference_frequency
    near, far = (SecondLine(record, ratio * frequency, 0.001, 80.0) for ratio in (1.1, 1.4))
    assert unexplained_lines([near], forced, data) == []
    assert unexplained_lines([near], [], data) == [near]
    assert unexplained_lines([far], forced, data) == [far]


def test_flat_tops_are_seen_at_the_largest_amplitudes(friction: tuple[Diagnosis, list[int]]) -> None:
    data = friction[0].data
    channels = data.channels
    flat = np.where(channels.amplitude > 0.7 * channels.amplitude.max(), -0.03 * channels.amplitude, channels.third)
    found = wave_findings(replace(data, channels=replace(channels, third=flat)))
    largest = int(channels.record[np.argmax(channels.amplitude)])
    assert data.layout.records[largest] in {one.record for one in found}
    assert all(one.quantity == "signal" and one.excess == pytest.approx(-0.03, rel=0.1) for one in found)


def test_of_several_records_of_one_test_the_strongest_stands_for_all() -> None:
    def one(record: str, z: float, test: str = "t") -> Finding:
        return Finding("scatter", "rig", test, record, None, None, 0.5, (0.4, 0.6), z, "colour")

    found = merged([one("a", 4.0), one("b", 6.0), one("c", 5.0, "u")])
    assert [f.record for f in found] == ["b", "c"]


def test_a_look_that_two_effects_ask_for_is_made_once(
    friction: tuple[Diagnosis, list[int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    one = Finding("test", "rig", "t", None, None, None, 0.5, (0.4, 0.6), 1e3, "a test of its own")
    twins = ("reduced_velocity_drift", "setting_dependence")
    assert twins in CONTRASTS.values()
    monkeypatch.setattr("scruton.gap.locate_records.CONTRASTS", {lambda _null: [one]: twins})
    found = locate(replace(friction[0], found=twins))
    assert found.count(one) == 1


def test_how_surely_an_effect_of_several_sizes_acts_is_told_by_all_of_them() -> None:
    name = "stiffness_nonlinearity"
    data, null = fit_null(load_gap(simulate_case(5, 1, name, 0.3)[0]))
    several = next(one for one in CATALOGUE[name].variants(data.layout) if len(one.parameters) > 1)
    made_up: Any = SimpleNamespace(found=(name,), final=null.with_variants(several))
    found = scope_findings(made_up)
    assert found
    for one in found:
        low, high = one.interval90
        assert one.significance >= 0.99 * abs(one.excess) / (0.5 * (high - low) / Z90)
