"""Limits as their codes have them: worked by hand from the clause's formula where the code prints no example."""

import numpy as np
import pytest
from sizing_room import mode_model

from scruton.campaign.schema import Motion
from scruton.errors import InputError
from scruton.sizing.governing import governing, outside
from scruton.sizing.limits import RULES, bd49, limit
from scruton.sizing.limits.iso2631 import W_F, W_K, motion_sickness, weighting
from scruton.sizing.risk import risk
from scruton.sizing.study import _mode

DECK = (12.0, 3.0)  # m, B and D
TO_CODE = 0.005  # of what the code prints, or of what its formula gives by hand


def of(text, f, motion=Motion.HEAVING):
    return limit(text).amplitude(motion, f, *DECK)


@pytest.mark.parametrize(
    ("frequency", "parameters", "printed"),
    [  # ISO 8041-1:2017, annex B, at the true centres of the bands 10^(n/10): tables B.5 and B.8; ISO 2631-1, table 3
        (10**-0.8, W_F, 1.004), (10**-1.0, W_F, 0.6951), (10**0.8, W_K, 1.054), (10**0.0, W_K, 0.482),
    ],
)  # fmt: skip
def test_weightings_are_those_that_the_standard_prints(frequency, parameters, printed):
    assert weighting(frequency, parameters) == pytest.approx(printed, rel=TO_CODE)


def test_weighted_acceleration_by_hand():
    """0.315 m/s^2 over W_k(1 Hz) = 0.482 is 0.6535 r.m.s., 0.9242 peak, over (2 pi)^2: 23.41 mm."""
    assert of("iso2631", 1.0) == pytest.approx(0.02341, rel=TO_CODE)
    assert of("iso2631", 1.0, Motion.TORSIONAL) == pytest.approx(0.02341 / 6.0, rel=TO_CODE)
    assert of("rms-acceleration", 1.0) == pytest.approx(0.02341 * 0.482, rel=TO_CODE)


def test_motion_sickness_by_hand():
    """At 0.1 Hz an amplitude of 2 m has 0.5583 m/s^2 r.m.s., weighted 0.3881; its dose in 1200 s is 13.44: 4.48 %."""
    assert motion_sickness(0.1, 2.0) == pytest.approx(0.0448, rel=TO_CODE)
    assert of("motion-sickness: 0.0448", 0.1) == pytest.approx(2.0, rel=TO_CODE)
    assert motion_sickness(0.1, 2.0, 4 * 1200.0) == pytest.approx(2 * motion_sickness(0.1, 2.0))


def test_k_d_of_bd49_by_hand():
    """K_D = f^2 y_max: 0.5^2 of 120 mm is 30; in torsion y_max is at the edge of the deck, 6 m out: 20 mrad."""
    assert of("kd", 0.5) == pytest.approx(0.120, rel=TO_CODE)
    assert of("kd", 0.5, Motion.TORSIONAL) == pytest.approx(0.020, rel=TO_CODE)
    # 30 mm/s^2 is 1.18 m/s^2 (0.12 g) at any frequency
    for f in (0.1, 1.0):
        assert of("kd", f) * (2 * np.pi * f) ** 2 == pytest.approx(1.184, rel=TO_CODE)


@pytest.mark.parametrize(
    ("kd", "name"),
    [(0.5, "only just perceptible"), (1.5, "acceptable"), (4.0, "tolerable"), (7.0, "tolerable to unpleasant"),
     (20.0, "unpleasant"), (30.0, "unpleasant"), (31.0, "pedestrian discomfort possible")],
)  # fmt: skip
def test_classes_of_table_1_of_bd49(kd, name):
    assert bd49.motion_class(kd) == name


def test_jtg_by_hand():
    """0.04/f is 0.1333 m at 0.3 Hz; 4.56/(B f) is 1.2667 deg, 22.11 mrad, there for B = 12 m; gamma_v = 0.8 of both."""
    assert of("jtg", 0.3) == pytest.approx(0.1333, rel=TO_CODE)
    assert of("jtg", 0.3, Motion.TORSIONAL) == pytest.approx(0.02211, rel=TO_CODE)
    assert of("jtg: 0.8", 0.3, Motion.TORSIONAL) == pytest.approx(0.8 * 0.02211, rel=TO_CODE)


def test_thirty_is_named_for_what_it_is():
    assert "top of" in RULES["kd"].title
    assert "unpleasant" in RULES["kd"].title
    assert limit("kd: tolerable").value == 5.0
    assert limit("KD: Unpleasant").value == limit("kd").value == 30.0
    with pytest.raises(InputError):
        limit("kd: pedestrian discomfort possible")


def test_the_static_load_of_bd49():
    """alpha = 0.4 K_D, 2.5 K_D for simply supported highway bridges: 12 and 75 % at 30 mm/s^2."""
    assert bd49.static_load(30.0) == pytest.approx(12.0)
    assert bd49.static_load(30.0, simply_supported=True) == pytest.approx(75.0)
    said = limit("kd").reading(Motion.TORSIONAL, 0.5, *DECK, 0.020)
    assert "K_D = 30 mm/s^2, unpleasant" in said
    assert "alpha = 12 % (75 %" in said
    assert "3.2 %, negligible" in limit("kd: tolerable").reading(Motion.HEAVING, 0.5, *DECK, 0.032)
    assert not limit("kd").reading(Motion.HEAVING, 0.5, *DECK, np.inf)
    assert not limit("jtg").reading(Motion.HEAVING, 0.5, *DECK, 0.1)


def test_the_critical_speed_of_bd49_by_hand():
    """6.5 f d up to b/d = 5, f d (0.7 b/d + 3) from there (8.6 at 8), 10 f d from b/d = 10."""
    assert bd49.critical_speed(0.3, 12.0, 3.0) == pytest.approx(5.85)
    assert bd49.critical_speed(0.5, 24.0, 3.0) == pytest.approx(12.9)
    assert bd49.critical_speed(0.5, 60.0, 3.0) == pytest.approx(15.0)
    assert not limit("kd").rule.outside(0.3, *DECK)
    assert "V_cr" in limit("kd").rule.outside(2.0, *DECK)


@pytest.mark.parametrize(("frequency", "printed"), [(1.17, 28.899), (1.3, 32.11)])
def test_the_critical_speed_of_bd49_as_a_published_calculation_prints_it(frequency, printed):
    """A deck of b = 12.6 m, d = 3.8 m of type 1A: github.com/CFCSL/AERODYNAMIC-EFFECTS-ON-BRIDGES, its notebook."""
    assert bd49.critical_speed(frequency, 12.6, 3.8) == pytest.approx(printed, rel=TO_CODE)


@pytest.mark.parametrize(
    ("name", "inside", "beyond"),
    [("iso2631", (0.5, 80.0), (0.49, 81.0)), ("rms-acceleration", (0.5, 2.0), (0.3, 0.49)),
     ("motion-sickness", (0.1, 0.5), (0.09, 0.51)), ("jtg", (0.01, 100.0), ())],
)  # fmt: skip
def test_the_range_of_a_rule(name, inside, beyond):
    rule = RULES[name]
    assert not any(rule.outside(f, *DECK) for f in inside)
    assert all(rule.outside(f, *DECK) for f in beyond)


def _risks(*texts):
    return [risk(mode_model(cov=0.3), limit(text)) for text in texts]


def test_a_rule_outside_its_range_does_not_govern_unflagged():
    """At 0.3 Hz 0.315 m/s^2 asks for 125 mm and JTG for 133: the former is not for 0.3 Hz."""
    acceleration, code, comfort = risks = _risks("rms-acceleration", "jtg", "kd: tolerable")
    assert acceleration.limit < code.limit
    assert acceleration.outside is not None
    assert code.outside is None
    assert governing(risks[:2]) is code
    assert governing(risks) is comfort
    said = list(outside("V1", risks[:2]))
    assert len(said) == 1
    assert "does not govern, though it is the smallest" in said[0]
    assert "0.5 to 80 Hz" in said[0]
    alone = list(outside("V1", risks[:1]))
    assert "governs, yet" in alone[0]


def test_a_risk_says_what_the_code_says_of_the_amplitude():
    against, code = _risks("kd", "jtg")
    assert code.reading is None
    assert against.reading.startswith("median K_D = ")
    assert "; 95 % K_D = " in against.reading
    y = float(against.curve.amplitude_50[0])
    assert f"median K_D = {1e3 * 0.3**2 * y:.3g} mm/s^2" in against.reading


def test_a_mode_is_sized_against_the_limit_that_holds():
    rules = [limit("rms-acceleration"), limit("jtg")]
    sized = _mode(mode_model(cov=0.3), rules, None, ["no damper is specified"], 0, lambda _what, _done: None)
    assert sized.governing == "jtg"
    assert sized.governing_limit.limit > sized.limits[0].limit
    assert any('"rms-acceleration" does not govern, though it is the smallest' in flag for flag in sized.flags)


def test_a_length_without_its_unit_is_no_amplitude_over_the_depth():
    """70, of millimetres, was a limit of 70 A/D, for which no damper is needed."""
    with pytest.raises(InputError, match=r'"70"; wanted .*a length has its unit.*, up to 5'):
        limit("70")
    assert limit("70 mm").value == pytest.approx(0.07)
