"""What stands beside a required damping: where it agrees with the law, where it does not, and what is then said."""

from dataclasses import replace

import numpy as np
import pytest
from sizing_room import LIMIT, at_most, mode_model

from scruton.griffin.coverage import Coverage
from scruton.griffin.law_free import LawFree, StraightLine
from scruton.sizing.checks import LAW_FREE, Evidence, reach_of
from scruton.sizing.limits.rule import limit_words
from scruton.sizing.model import unit_cube
from scruton.sizing.remarks import farther_limits
from scruton.sizing.risk import remarks, risk
from scruton.sizing.thresholds import LARGEST_ADDED

A_STAR, SC, RELAXATION = 0.06551, 0.00058, 0.005139  # the section of `sizing_room`


class Card(Evidence):
    """Evidence whose card holds two laws, without a fit on disk."""

    def each_law(self, near):
        assert near > 0.0
        return {f"n={n:g}": mode_model(0.1, exponents=(n,)).laws for n in (-1.0, 2.0)}


def measured(strength=1.0, reach=(0.1, 2.0)):
    """The damping of the paper's law below the stable amplitude, times a factor."""
    amplitude = np.geomspace(reach[0] * A_STAR, reach[1] * A_STAR, 300)
    numbers = SC + strength * RELAXATION * (A_STAR / amplitude - 1.0)
    return LawFree(amplitude[None], np.tile(numbers, (20, 1, 1)), np.array([SC]), np.array([RELAXATION]))


def model(reach=(0.2, 2.0), discrepancy=0.1):
    covered = Coverage(np.array([SC]), np.array([reach[0] * A_STAR]), np.array([reach[1] * A_STAR]))
    of = mode_model(discrepancy)
    return replace(of, laws=replace(of.laws, coverage=covered))


def checked(strength=1.0, reach=(0.2, 2.0), line=None, stated=None):
    evidence = Card(None, measured(strength, reach), line, stated or {})
    return risk(model(reach), at_most(LIMIT), evidence=evidence)


def test_where_the_transients_follow_the_law_they_ask_for_the_same():
    found = checked()
    assert found.required_by_law["n=-1"]["0.50"] == pytest.approx(found.required["0.50"], abs=5e-5)
    # Its draws have no spread of amplitude and relaxation; the growth of the discrepancy is the law's.
    for confidence in ("0.50", "0.84", "0.95"):
        of = found.required_by_law[LAW_FREE][confidence]
        assert of == pytest.approx(found.required[confidence], rel=0.06)
    assert found.required_by_law["n=2"]["0.95"] < found.required["0.95"]
    assert not remarks("V1", "0.95", replace(found, reach={}))


def test_one_quantity_has_one_number():
    """The headline, the law that has all the weight, and one rig's row of the discrepancy that it is sized for."""
    found = checked(stated={"0.10": model().laws, "0.20": model(discrepancy=0.2).laws})
    assert found.required_by_law["n=-1"] == found.required == found.required_at_discrepancy["0.10"]
    assert found.required_at_discrepancy["0.20"] != found.required


def test_where_the_measured_damping_asks_for_more_it_is_said():
    found = checked(strength=2.0)
    assert found.required_by_law[LAW_FREE]["0.95"] > 1.3 * found.required["0.95"]
    (sentence,) = remarks("V1", "0.95", replace(found, reach={}))
    assert "is the law's" in sentence
    assert "n=2" in sentence
    assert not remarks("V1", "0.95", replace(found, reach={}), coherent=False), "transients know nothing of A_c"


def test_a_limit_below_every_transient_is_beyond_the_records():
    found = checked(reach=(0.8, 2.0))
    assert found.required_by_law[LAW_FREE]["0.95"] is None
    reach = found.reach["0.95"]
    assert (reach.covered_by, reach.tests, reach.trusted) == (0, 1, False)
    (sentence,) = remarks("V1", "0.95", found)
    assert "it is the law's alone" in sentence
    assert f"law-free: more than {100.0 * LARGEST_ADDED:.0f} %" in sentence


def test_a_limit_that_no_damping_keeps_is_an_extrapolation_too():
    """What cannot be had is said of a place that was not tested, as what can."""
    found = risk(model(), at_most(0.01 * LIMIT), evidence=Card(None, measured(), None, {}))
    assert found.required["0.95"] is None
    reach = found.reach["0.95"]
    assert reach.scruton_number == pytest.approx(0.003 + LARGEST_ADDED)
    assert (reach.covered_by, reach.trusted) == (0, False)
    (sentence,) = remarks("V1", "0.95", found)
    assert "(more than 5 %) lies beyond Sc 0.053, an extrapolation index of at least 10.2" in sentence
    *_, other = farther_limits("V1", checked(), [checked(), found])
    assert "(more than 5 %) lies beyond Sc 0.053" in other


def test_the_extrapolation_is_that_of_the_damping_that_is_required():
    found = checked()
    for name, added in found.required.items():
        reach = found.reach[name]
        assert reach.scruton_number == pytest.approx(0.003 + added)
        x = (0.003 + added - SC) / RELAXATION
        assert reach.extrapolation_index == pytest.approx(x, rel=0.01)
        assert reach.trusted == (x <= 0.3)


def test_the_extrapolation_is_that_of_the_median_scruton_number():
    """Where Scruton number and relaxation go together, the median of x is another number."""
    draws = model().draws(unit_cube(1 << 10, 0))
    rising = np.linspace(0.5, 2.0, len(draws))
    relaxation = RELAXATION * (0.5 + np.abs(rising - 1.25))
    draws = replace(draws, damping_ratio=0.003 * rising, curve=replace(draws.curve, relaxation=relaxation))
    reach = reach_of(draws, LIMIT, 0.001)
    x = np.median((reach.scruton_number - SC) / draws.curve.relaxation)
    assert reach.extrapolation_index == pytest.approx(x)
    assert x != pytest.approx(np.median((draws.scruton_number(0.001) - SC) / draws.curve.relaxation), rel=0.02)


def test_the_straight_line_is_inverted_at_the_medians():
    line = StraightLine(10.0, 4000.0)
    found = checked(line=line)
    amplitude = LIMIT / (3.0 * 4.0 / np.pi)
    assert found.required_by_hand == pytest.approx((1.0 / amplitude - 10.0) / 4000.0 - 0.003, rel=1e-3)
    at = found.by_hand
    assert 1.0 / at.amplitude == pytest.approx(at.intercept + at.slope * at.scruton_number)
    assert found.required_by_hand == pytest.approx(at.scruton_number - at.damping_ratio)  # a factor of 1


def test_one_rig_is_stated_at_two_discrepancies():
    found = checked(stated={f"{tau:.2f}": mode_model(tau).laws for tau in (0.1, 0.2)})
    stated = found.required_at_discrepancy
    assert stated["0.10"]["0.95"] < stated["0.20"]["0.95"]
    assert 100.0 * stated["0.20"]["0.95"] == pytest.approx(0.59, abs=0.01), "the worked case of a known discrepancy"
    assert any("rests on one rig" in sentence and "20 %" in sentence for sentence in remarks("V1", "0.95", found))


def test_a_limit_that_does_not_govern_is_said_to_lie_far_from_the_tests():
    governs, other = checked(), replace(checked(reach=(0.8, 2.0)), rule="other")
    (said,) = farther_limits("V1", governs, [governs, other])
    assert '"other", which does not govern, requires at 95 %' in said
    shown = "".join(part if isinstance(part, str) else part.words or part.text for part in said.parts)
    assert f"what {limit_words('other', other.title)}, which does not govern" in shown, "by its code in a report"
    assert "transients of 0 of 1 tests" in said
    assert not list(farther_limits("V1", other, [other]))
    none = replace(other, required=dict.fromkeys(other.required, 0.0))
    assert not list(farther_limits("V1", governs, [governs, none]))


def test_nothing_that_is_not_required_is_an_extrapolation():
    found = checked(reach=(0.8, 2.0))
    nothing = replace(found, required=dict.fromkeys(found.required, 0.0), required_by_law={})
    assert remarks("V1", "0.95", nothing) == []


def test_a_law_that_was_not_fitted_starts_where_it_has_its_own_answer():
    """From the far test a flat law needs nothing, which lies at the near one, and from there it does need something."""

    class Far(Card):
        def each_law(self, near):
            flat = mode_model(0.1, exponents=(0.0,)).laws
            far = replace(flat, reference=0.012, amplitude=0.05 * flat.amplitude)
            return {"n=0": flat if near < 0.006 else far}

    found = risk(model(), at_most(LIMIT), evidence=Far(None, None, None, {}))
    assert found.reach["0.50"].scruton_number < 0.006 < found.reach["0.95"].scruton_number
    row = list(found.required_by_law["n=0"].values())
    assert row == sorted(row)
    assert row[2] > 0.001
