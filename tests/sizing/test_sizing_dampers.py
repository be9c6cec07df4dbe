"""Dampers of a bridge that can be built: what is kept on draws that neither tuned nor checked, and off frequency."""

from dataclasses import replace

import numpy as np
import pytest
from damped_mode import response
from sizing_room import LIMIT, mode_model

from scruton.campaign.quantity import Quantity
from scruton.errors import InputError
from scruton.sizing.bridge import Cost, identified
from scruton.sizing.damper_request import DamperRequest, RiskOf, delivered
from scruton.sizing.damper_table import damper_table
from scruton.sizing.dampers import TUNING_DRAWS, cheaper_between, damper, reality, shapes, struck_flag
from scruton.sizing.existing import as_built, existing, hung, offers
from scruton.sizing.mode_shape import sine
from scruton.sizing.model import unit_cube
from scruton.sizing.money import cost_by_mass
from scruton.sizing.remarks import stroke_remark, worst_remark
from scruton.sizing.tmd import TunedMass, den_hartog
from scruton.sizing.tmd_draws import DamperDraws
from scruton.sizing.together import any_mode_flag, exceedance_of, placed, sized_for_any, with_dampers

FREE = {"smallest_mass_ratio": 1e-4, "largest_stroke": 0.4}
EXACT = {"frequency_tolerance": 0.0, "damping_tolerance": 0.0, "mass_tolerance": 0.0}


def bridge_mode(request=None, name="V1", frequency=0.3, shape=None, **options):
    model = mode_model(0.1, 0.45, shape=shape, **options)
    mode = replace(model.mode, name=name, modal_mass=4e6, frequency=Quantity(frequency, 0.02 * frequency))
    return replace(model, mode=mode, bridge=replace(model.bridge, modes=(mode,), damper=request or DamperRequest()))


def left(model, found, seed, detuning=None, count=1 << 15):
    """Risk with dampers on other draws."""
    draws = model.draws(unit_cube(count, seed))
    made = delivered(model.bridge.damper, len(found.dampers), count, seed)
    real = reality(model, draws, made, seed)
    return DamperDraws(draws.amplitude, LIMIT, draws.detuning, shapes(model, found.positions), real).probability(
        found.dampers, detuning
    )


@pytest.fixture(scope="module")
def tight():
    """A case in which stroke and risk decide, not the smallest mass."""
    model = bridge_mode(DamperRequest(**FREE))
    return model, damper(model, LIMIT, 0)


def test_the_risk_left_is_at_most_the_risk_asked_on_draws_that_neither_tuned_nor_checked(tight):
    model, found = tight
    assert found.achievable
    assert 0.8 * 0.05 < max(found.probability, *(one.probability for one in found.detuned[1:3])) <= 0.05
    again = [left(model, found, seed) for seed in range(100, 116)]
    assert max(again) <= 0.05


def test_the_risk_is_kept_within_two_per_cent_of_the_frequency(tight):
    model, found = tight
    for error in (-0.02, 0.02):
        assert max(left(model, found, seed, error) for seed in (101, 102, 103)) <= 0.05
    sharp = bridge_mode(DamperRequest(kept_detuning=0.0, smallest_mass_ratio=1e-4, largest_stroke=9.0, **EXACT))
    sharp = replace(sharp, mode=replace(sharp.mode, frequency=Quantity(0.3, 0.0015)))
    loose = damper(sharp, LIMIT, 0)
    assert max(left(sharp, loose, 101, error) for error in (-0.02, 0.02)) > 0.1
    assert loose.mass < 0.6 * found.mass


@pytest.fixture(scope="module")
def usual():
    return damper(bridge_mode(), LIMIT, 0)


def test_defaults_that_practice_accepts(usual):
    found = usual
    assert found.mass_ratio >= 0.005
    assert found.stroke.high <= 1.0
    asked = found.asked
    assert (asked.kept_detuning, asked.largest_stroke, asked.smallest_mass_ratio) == (0.02, 1.0, 0.005)
    assert found.reason == "the smallest mass ratio, 0.5 %, decides on the mass"
    assert found.probability <= 0.05


@pytest.mark.parametrize("stroke", [1.0, 0.5])
def test_mass_to_spare_buys_robustness_not_a_short_stroke(usual, stroke):
    """Where the smallest mass decides, damping is somewhat above Den Hartog's, or as the stroke asks for."""
    asked = DamperRequest(largest_stroke=stroke)
    found = usual if asked == usual.asked else damper(bridge_mode(asked), LIMIT, 0)
    assert found.reason.startswith("the smallest mass ratio")
    assert found.stroke.high <= stroke
    ends = np.array([-0.02, 0.02])

    def added(dampers):
        return float(response(dampers, ends).added_damping.min())

    usual = den_hartog(found.mass_ratio)
    assert usual.damping_ratio < found.dampers[0].damping_ratio < 1.5 * usual.damping_ratio
    assert added(found.dampers) > 0.9 * added([usual])
    others = [replace(usual, damping_ratio=k * usual.damping_ratio) for k in (0.5, 2.0, 4.0)]
    assert all(added(found.dampers) > added([other]) for other in others)


def test_the_chart_of_masses_holds_the_dampers_that_are_specified():
    found = damper(bridge_mode(DamperRequest(smallest_mass_ratio=0.003)), LIMIT, 0)
    (place,) = np.flatnonzero(np.isclose(found.map.mass_ratio, found.mass_ratio, rtol=1e-9))
    row = (found.map.probability, found.map.stroke, found.map.stroke_high, found.map.added_damping)
    want = found.probability, found.stroke.median, found.stroke.high, found.added_damping.median
    assert tuple(column[place] for column in row) == want
    assert found.map.mass[place] == found.mass


def test_the_chart_is_fine_about_the_least_cost():
    cost = Cost("EUR", fixed=1e5, per_kg=200.0, failure=2e8)
    model = bridge_mode(DamperRequest(smallest_mass_ratio=1e-4))
    model = replace(model, bridge=replace(model.bridge, cost=cost))
    found = damper(model, LIMIT, 0)
    least = cost_by_mass(cost, 0.4, found)
    chart, total = found.map, least.total
    best = int(np.argmin(np.where(least.allowed, total, np.inf)))
    assert least.best_mass > 1.05 * found.mass
    assert chart.mass_ratio.size > 9
    step = chart.mass_ratio[best - 1 : best + 2]
    assert step[2] / step[0] < 1.2
    assert cheaper_between(cost, chart, found.asked, 0.4) is None
    # No mass between costs noticeably less than what is told.
    bought = cost.fixed + cost.per_kg * chart.mass[:-1] + cost.failure * chart.probability[1:]
    assert bought[least.allowed[1:]].min() > 0.979 * least.best_total


@pytest.mark.thorough
def test_every_tolerance_costs_risk(tight):
    model, found = tight

    def with_errors(**changes):
        request = replace(model.bridge.damper, **EXACT, **changes)
        return left(replace(model, bridge=replace(model.bridge, damper=request)), found, 200)

    exact = with_errors()
    assert with_errors(temperature_detuning=0.04) > exact + 0.002
    assert with_errors(start_acceleration=0.1) > exact + 0.002
    free = DamperRequest(smallest_mass_ratio=1e-4, largest_stroke=9.0)
    masses = [damper(bridge_mode(replace(free, temperature_detuning=error)), LIMIT, 0).mass for error in (0.0, 0.04)]
    assert masses[1] > 1.1 * masses[0]


def test_errors_of_the_damper_are_what_was_asked_for():
    request = DamperRequest(
        frequency_tolerance=0.01, damping_tolerance=0.2, mass_tolerance=0.03, temperature_detuning=0.02
    )
    made = delivered(request, 2, 1 << 14, 0)
    assert np.abs(made.damping - 1.0).max() == pytest.approx(0.2, rel=1e-2)
    assert np.abs(made.mass - 1.0).max() == pytest.approx(0.03, rel=1e-2)
    assert np.abs(made.frequency - 1.0).max() == pytest.approx(0.0302, rel=3e-2)
    assert np.corrcoef(made.damping)[0, 1] == pytest.approx(0.0, abs=0.03)
    assert np.corrcoef(made.frequency)[0, 1] == pytest.approx(0.8, abs=0.02)  # four parts in five are the weather's


def test_the_modal_mass_has_an_error():
    model = bridge_mode()
    draws, made = model.draws(unit_cube(1 << 14, 3)), delivered(DamperRequest(**EXACT), 1, 1 << 14, 3)
    assert np.std(np.log(reality(model, draws, made, 3).mass)) == pytest.approx(0.05, rel=0.05)
    stated = replace(model, mode=replace(model.mode, modal_mass_cov=0.1))
    assert np.std(np.log(reality(stated, draws, made, 3).mass)) == pytest.approx(0.1, rel=0.05)
    weighed = replace(model, mode=replace(model.mode, mass=Quantity(20000.0, 400.0)))
    draws = weighed.draws(unit_cube(1 << 14, 3))
    factor = reality(weighed, draws, made, 3).mass[0]
    assert np.std(np.log(factor)) == pytest.approx(0.02, rel=0.05)
    assert np.corrcoef(factor, 1.0 / draws.factor)[0, 1] > 0.999  # the heavier bridge has the lighter damper


@pytest.mark.slow  # quicker: a start from above, below, and the equations of motion in test_sizing_tmd_real.py
def test_end_stops_and_friction_are_designed_for():
    request = DamperRequest(start_acceleration=0.05, end_stop=0.5, largest_stroke=0.5, smallest_mass_ratio=1e-3)
    model = bridge_mode(request)
    found = damper(model, LIMIT, 0)
    assert found.achievable
    assert found.probability <= 0.05
    assert found.stroke.high <= 0.5
    assert found.probability_worst >= found.probability
    assert left(model, found, 300, count=1 << 12) <= 0.053
    assert found.struck is not None
    assert 0.0 < found.struck <= 0.05  # the stroke is kept with 95 % confidence


@pytest.mark.thorough
def test_a_start_from_above_never_leaves_less_risk_than_growth_does():
    """Dampers that rub a little: both are told of the same draws."""
    found = damper(bridge_mode(DamperRequest(start_acceleration=0.01, **FREE)), LIMIT, 1)
    assert 0.04 < found.probability <= found.probability_worst < found.probability + 0.01


def test_what_strikes_its_end_stops_is_said(tight):
    _, found = tight
    assert "strike their end stops" in struck_flag("V1", replace(found, struck=0.03))[0]
    assert struck_flag("V1", replace(found, struck=None)) == []
    assert struck_flag("V1", replace(found, struck=0.0, probability_worst=found.probability)) == []
    # with friction alone there are no stops to strike: what a start from above leaves is said all the same
    assert "but 5.8% where those count" in worst_remark("V1", replace(found, struck=None, probability_worst=0.058))[0]
    assert worst_remark("V1", replace(found, struck=0.03, probability_worst=0.05)) == []


def test_a_stroke_that_a_detuning_makes_too_large_is_remarked_on(tight):
    _, found = tight
    assert stroke_remark("V1", found) == [], "at 2 % it is within the tolerance of the stroke"
    far = replace(found, detuned=tuple(replace(one, stroke_high=1.1 * one.stroke_high) for one in found.detuned))
    (said,) = stroke_remark("V1", far)
    assert "below 0.4 m with 95 % confidence" in said
    assert "reaches 0.442 m where that is off by 2 %" in said
    assert "a largest stroke of 0.36 m" in said
    assert stroke_remark("V1", replace(far, asked=replace(far.asked, kept_detuning=0.0))) == []


@pytest.mark.thorough
def test_dampers_at_several_places_have_one_mass():
    model = bridge_mode(DamperRequest(positions={"V1": (0.5, 0.25)}))
    found = damper(model, LIMIT, 0)
    assert found.positions == (0.5, 0.25)
    first, second = found.dampers
    assert first.mass == pytest.approx(second.mass, rel=1e-6)
    assert second.mass_ratio == pytest.approx(0.5 * first.mass_ratio, rel=1e-3)  # sin^2 of a quarter
    assert found.mass == pytest.approx(first.mass + second.mass, rel=1e-6)


@pytest.fixture(scope="module")
def two_modes(tight):
    request = DamperRequest(**FREE, risk_of=RiskOf.ANY)
    models = [bridge_mode(request, "V1"), bridge_mode(request, "V2", 0.42, sine(2))]
    # whose risk it is changes nothing of a damper by itself
    return models, [replace(tight[1], asked=request), damper(models[1], LIMIT, 0)]


def test_dampers_of_each_mode_do_not_keep_the_risk_of_the_union_and_that_is_said(two_modes):
    models, alone = two_modes
    before = exceedance_of(with_dampers(placed(alone, models), models, [LIMIT, LIMIT], 40))
    assert before.any > 0.055
    assert max(before.each) <= 0.05
    request = models[0].bridge.damper
    assert "is asked" in any_mode_flag(("V1", "V2"), before, request)
    assert "sizes them for that" in any_mode_flag(("V1", "V2"), before, replace(request, risk_of=RiskOf.MODE))


@pytest.mark.slow  # quicker: of modes of either motion, in test_sizing_both.py
def test_dampers_for_any_mode_keep_the_risk_of_the_union(two_modes):
    models, alone = two_modes
    limits = [LIMIT, LIMIT]
    found = sized_for_any(models, limits, alone, 0, lambda what, done: None)
    assert all(one.achievable for one in found)
    after = [exceedance_of(with_dampers(placed(found, models), models, limits, seed)).any for seed in (40, 50, 60)]
    assert max(after) <= 0.05
    assert min(after) > 0.03
    assert sum(one.mass for one in found) > sum(one.mass for one in alone)


def test_an_existing_damper_is_judged(two_modes):
    models, alone = two_modes
    text = "; ".join(f"{p.mass} kg, {p.frequency} Hz, {p.damping_ratio}, {p.position}" for p in placed(alone, models))
    (same,) = existing(models, [LIMIT, LIMIT], hung(models, offers(text)), 10)
    want = exceedance_of(with_dampers(placed(alone, models), models, [LIMIT, LIMIT], 40))
    assert same.left == want
    assert same.as_designed is None
    assert max(same.stroke_high) <= 0.41
    one = placed(alone, models)[0]
    (half,) = existing(
        models,
        [LIMIT, LIMIT],
        hung(models, offers(f"{0.5 * one.mass} kg, {one.frequency} Hz, {one.damping_ratio}")),
        10,
    )
    assert half.dampers[0].position == pytest.approx(0.5)
    assert half.left.each[0] > 2.0 * want.each[0]
    assert half.left.each[1] > 0.5  # nothing is done about it


def test_what_is_identified_updates_the_risk(two_modes):
    models, alone = two_modes
    (offer,) = offers(
        "; ".join(f"{p.mass} kg, {p.frequency} Hz, {p.damping_ratio}, {p.position}" for p in placed(alone, models))
    )
    mode = identified(models[0].mode, Quantity(0.285), Quantity(0.006))
    assert mode.frequency.relative_sd == pytest.approx(0.005)
    assert mode.damping_ratio.relative_sd == pytest.approx(0.15)
    (built,) = existing([replace(models[0], mode=mode), models[1]], [LIMIT, LIMIT], [offer], 10)
    assert built.as_designed == exceedance_of(with_dampers(placed(alone, models), models, [LIMIT, LIMIT], 40))
    assert built.left.each[0] != built.as_designed.each[0]
    low = identified(models[0].mode, Quantity(0.285), Quantity(0.002))
    (worse,) = existing([replace(models[0], mode=low), models[1]], [LIMIT, LIMIT], [offer], 10)
    assert worse.left.each[0] > built.left.each[0]  # off frequency, and little damping of its own
    bridge = replace(models[0].bridge, modes=(models[0].mode,))
    (same,) = as_built(bridge, ["V1: 0.285 Hz, 0.006"]).modes
    assert (same.frequency, same.damping_ratio, same.designed) == (mode.frequency, mode.damping_ratio, mode.designed)
    assert as_built(bridge, ["V1: 0.285 +/- 0.001 Hz"]).modes[0].frequency.sd == pytest.approx(0.001)
    assert as_built(bridge, ["V1: , 0.006"]).modes[0].frequency == models[0].mode.frequency


def test_a_supplier_s_list(tmp_path):
    path = tmp_path / "list.csv"
    path.write_text("mass [kg],frequency [Hz],damping\n12000,0.29,0.08\n15000,0.3,0.1\n", encoding="utf-8")
    first, second = offers(str(path))
    assert (first.name, second.name) == ("list.csv, 1", "list.csv, 2")
    assert second.dampers[0].mass == 15000.0
    assert offers("12 t, 0.29 Hz, 0.08")[0].dampers == first.dampers
    path.write_text("mass,frequency,damping\n12000,-0.29,0.08\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"list\.csv: row 1, column 2: found -0\.29; wanted a number greater"):
        offers(str(path))
    path.write_text("mass,frequency\n12000,0.29\n", encoding="utf-8")
    with pytest.raises(InputError, match="rows of 2 columns"):
        offers(str(path))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("12 t, 0.29 Hz", "mass, frequency, damping"),
        ("12, 0.29 Hz, 0.08", "unit"),
        ("12 t, 0.29 Hz, 1.5", "below 1"),
        ("12 t, 0.29 Hz, 0.08, 2", "between 0 and 1"),
        ("12 +/- 1 t, 0.29 Hz, 0.08", "without a standard deviation"),
        ("none.csv", "no such file"),
    ],
)
def test_a_damper_that_is_none_is_refused(text, words):
    with pytest.raises(InputError, match=words):
        offers(text)


@pytest.mark.parametrize("text", ["V9: 0.3 Hz", "0.3 Hz", "V1:", "V1: 0.3 Hz, 2", "V1: 0.3 s", "V1: 1 Hz, 0.1, 3"])
def test_an_identification_that_is_none_is_refused(text):
    with pytest.raises(InputError, match="--identified"):
        as_built(bridge_mode().bridge, [text])


def test_the_table_of_other_dampers_is_off_by_no_more_than_it_says(tight):
    """Against the draws themselves, at places that the table was neither made nor checked with."""
    model, found = tight
    table = damper_table(model, LIMIT, found.dampers, 0)
    assert table is not None
    draws = model.draws(unit_cube(TUNING_DRAWS, 4))
    shape = shapes(model, model.damper_positions)
    real = reality(model, draws, delivered(model.bridge.damper, shape.size, TUNING_DRAWS, 4), 4)
    over = DamperDraws(draws.amplitude, LIMIT, draws.detuning, shape, real)
    rng, places = np.random.default_rng(7), []
    for _ in range(40):
        axes = (table.mass, table.tuning, table.damping)
        m, f, z = (float(np.exp(rng.uniform(*np.log(axis[[0, -1]])))) for axis in axes)
        one = found.dampers[0]
        true = over.outcome((TunedMass(m * one.mass_ratio, f * one.frequency_ratio, z * one.damping_ratio),))
        risk, stroke = table.at(m, f, z)
        off = abs(float(risk) - true.probability), abs(float(stroke) / true.stroke_high - 1.0)
        places.append((*off, true.probability))
    risk, stroke, true = np.array(places).T
    assert np.ptp(true) > 0.5, "the table spans good dampers and bad ones"
    assert risk.max() < 2.0 * table.error_probability < 0.1
    assert stroke.max() < 2.0 * table.error_stroke < 0.1


def test_a_bridge_off_frequency_is_read_off_at_dampers_tuned_otherwise(tight):
    model, found = tight
    one = found.dampers[0]
    draws = model.draws(unit_cube(256, 4))
    off = 1.03
    shifted = DamperDraws(draws.amplitude, LIMIT, (1.0 + draws.detuning) * off - 1.0)
    tuned = DamperDraws(draws.amplitude, LIMIT, draws.detuning)
    plain = TunedMass(one.mass_ratio, one.frequency_ratio, one.damping_ratio)
    other = replace(plain, frequency_ratio=plain.frequency_ratio / off)
    assert vars(shifted.outcome((plain,))) == pytest.approx(vars(tuned.outcome((other,))))


def test_a_bridge_that_its_dampers_stop_has_a_table_too(tight, monkeypatch):
    """Its stroke is zero, of which there is no logarithm."""
    model, found = tight
    found_by = DamperDraws.risk_and_stroke
    monkeypatch.setattr(DamperDraws, "risk_and_stroke", lambda *of: (found_by(*of)[0], 0.0))
    table = damper_table(model, LIMIT, found.dampers, 0)
    assert table is not None
    risk, stroke = table.at(1.0, 1.0, 1.0)
    assert np.isfinite(risk)
    assert 0.0 < stroke < 1e-3
    assert table.error_stroke < 1e-9


def test_there_is_no_table_without_dampers(tight):
    model, _ = tight
    assert damper_table(model, LIMIT, (), 0) is None


def test_a_table_of_strongly_damped_dampers_stays_below_critical_damping():
    model = bridge_mode(DamperRequest(**FREE))
    table = damper_table(model, LIMIT, (TunedMass(0.02, 0.98, 0.4),), 0)
    assert table.damping[-1] * 0.4 >= 1.0
    assert np.isfinite(table.probability).all()


def test_a_share_of_the_risk_that_no_draws_tell_leaves_none_of_them():
    """Modes that share a small risk are each sized for less than the draws can tell."""
    found = damper(bridge_mode(DamperRequest()), LIMIT, 0, risk=1e-5)
    assert found.achievable
    assert found.probability < 1e-4
