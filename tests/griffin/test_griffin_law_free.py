"""The curve without a law, and the line by hand, on curves that are known."""

import numpy as np
import pytest
from test_griffin_bands import TABLE_5
from test_griffin_predict import campaign_tree

from scruton.griffin.law_free import LawFree, law_free, straight_line

GAIN, OFFSET = 2.0, 10.0  # A = GAIN/(Sc + OFFSET)


def curve_of(sc, reach, off=0.0, draws=50):
    """One test: its own curve, off the shared one by a factor in amplitude."""
    rng = np.random.default_rng(5)
    a_star = GAIN * np.exp(off) / (sc + OFFSET)
    amplitude = np.geomspace(reach[0] * a_star, reach[1] * a_star, 200)
    numbers = GAIN * np.exp(off) / amplitude - OFFSET
    return a_star, amplitude, numbers + 0.01 * rng.standard_normal((draws, 1)) * (numbers - sc)


def together(*tests):
    _, amplitude, numbers = zip(*tests, strict=True)
    return LawFree(
        np.array(amplitude), np.stack(numbers, axis=1), np.array([5.0, 30.0])[: len(tests)],
        np.array([15.0, 40.0])[: len(tests)],
    )  # fmt: skip


def test_it_passes_through_what_was_measured_and_follows_the_curve_between():
    curve = together(curve_of(5.0, (0.2, 2.0)), curve_of(30.0, (0.2, 2.0)))
    for sc in (5.0, 12.0, 20.0, 30.0, 45.0):
        found = curve.scruton_number_of(np.full(50, GAIN / (sc + OFFSET)), np.arange(50))
        assert np.median(found) == pytest.approx(sc, rel=0.01)


def test_a_setting_that_misses_the_curve_keeps_its_own_point():
    one, other = curve_of(5.0, (0.2, 2.0), 0.1), curve_of(30.0, (0.2, 2.0), -0.1)
    curve = together(one, other)
    for (stable, *_), sc in ((one, 5.0), (other, 30.0)):
        assert np.median(curve.scruton_number_of(np.full(50, stable), np.arange(50))) == pytest.approx(sc, abs=0.1)


def test_what_no_transient_went_through_is_not_told():
    curve = together(curve_of(5.0, (0.5, 2.0)))
    low, high = curve.reach
    samples = np.arange(50)
    assert np.isinf(curve.scruton_number_of(np.full(50, 0.9 * low), samples)).all()
    at_top = curve.scruton_number_of(np.full(50, high), samples)
    np.testing.assert_array_equal(curve.scruton_number_of(np.full(50, 3.0 * high), samples), at_top)
    amplitude, band = curve.band()
    assert (np.diff(band, axis=0) >= 0.0).all()
    assert (amplitude[0], amplitude[-1]) == pytest.approx((low, high))


def test_the_line_is_that_of_a_pocket_calculator():
    line = straight_line(campaign_tree())
    sc, a_star, *_ = np.array(TABLE_5).T
    slope, intercept = np.polyfit(sc, 1.0 / a_star, 1)
    assert (line.slope, line.intercept) == pytest.approx((slope, intercept), rel=1e-6)
    assert line.scruton_number(1.0 / (intercept + 40.0 * slope)) == pytest.approx(40.0)


def test_one_setting_has_no_line_and_an_older_fit_no_curve():
    tree = campaign_tree(rows=TABLE_5[:1])
    assert straight_line(tree) is None
    assert law_free(tree) is None
