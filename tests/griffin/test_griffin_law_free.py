"""The curve without a law, and the line by hand, on curves that are known."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from test_griffin_bands import TABLE_5
from test_griffin_predict import campaign_tree

from scruton.griffin import SharedCurve, law_curves, predict
from scruton.griffin.coverage import Coverage
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


def test_the_curve_read_the_other_way_gives_the_amplitudes_back():
    curve, samples = together(curve_of(5.0, (0.2, 2.0)), curve_of(30.0, (0.2, 2.0))), np.arange(50)
    sc = np.array([5.0, 12.0, 30.0, 45.0])
    log, variance = curve.log_amplitude(np.tile(sc, (50, 1)), samples)
    np.testing.assert_allclose(np.median(log, axis=0), np.log(GAIN / (sc + OFFSET)), atol=0.01)
    for k in range(4):
        found = curve.scruton_number_of(np.exp(log[:, k]), samples)
        np.testing.assert_allclose(found, sc[k], rtol=0.01)
    assert variance.shape == (50, 4)
    np.testing.assert_allclose(variance[0], np.var(log, axis=0), rtol=0.2, atol=1e-7)


def test_no_amplitude_is_told_where_no_transient_went():
    curve, samples = together(curve_of(5.0, (0.5, 2.0))), np.arange(50)
    log, _ = curve.log_amplitude(np.array([[-9.0, 5.0, 500.0]] * 50), samples)
    assert np.isnan(log[:, [0, 2]]).all()
    assert np.isfinite(log[:, 1]).all()


# ------------------------------------------------------------------------------------- beside the laws that predict


@pytest.mark.parametrize("number", [20.0, np.nan])
def test_damping_that_is_the_same_at_every_amplitude_or_known_at_none_tells_no_amplitude(number):
    """There was no grid of Scruton numbers to look into."""
    curve, _ = weighed()
    none = replace(curve.measured, scruton_number=np.full((40, 1, 200), number))
    at = np.array([20.0, 50.0])
    setting = replace(curve, measured=none).setting(at, curve.at(at))
    assert not setting.weight.any()
    np.testing.assert_allclose(setting.spread, replace(curve, measured=None).setting(at, curve.at(at)).spread)


def weighed(tau=0.1, off=0.3, reach=(0.1, 3.0)):
    """A curve by the law n = -1, tested at Sc 20, and transients that say exp(off) as much beyond x of 1."""
    sc, a_star, relaxation = 20.0, 0.05, 30.0
    amplitude = np.geomspace(reach[0] * a_star, reach[1] * a_star, 200)
    x = (a_star / amplitude) - 1.0
    bent = sc + relaxation * x * np.exp(off)
    measured = LawFree(amplitude[None], np.tile(bent, (40, 1))[:, None], np.array([sc]), np.array([relaxation]))
    draws = np.full(40, 1.0)
    coverage = Coverage(np.array([sc]), amplitude[:1], amplitude[-1:])
    laws = SharedCurve(
        sc, a_star * draws, relaxation * draws, -draws, tau * draws, {"n=-1": 1.0}, coverage=coverage,
        measured=measured, sample=np.arange(40),
    )  # fmt: skip
    return laws, lambda at: np.log(a_star / (1.0 + (at - sc) / (relaxation * np.exp(off))))


def with_transients(tree, off=0.3):
    """The same fit with the damping that transients of its first test showed, exp(off) as strong as the law's."""
    sc, a_star, slope = TABLE_5[0]
    amplitude = np.geomspace(0.2 * a_star, 2.5 * a_star, 40)
    numbers = sc + (1.0 / amplitude - 1.0 / a_star) / slope * np.exp(off)
    tree["law_free"] = xr.DataTree(
        xr.Dataset(
            {
                "level_amplitude": (("test", "level"), amplitude[None]),
                "level_scruton_number": (("sample", "test", "level"), np.tile(numbers, (40, 1))[:, None]),
            },
            coords={"test": ["T0"]},
        )
    )
    return tree


def test_at_a_tested_setting_the_laws_predict_and_far_from_it_the_measured_damping_has_half_the_say():
    curve, measured = weighed()
    for x, weight in ((0.0, 0.0), (0.2, 0.2 / 1.2), (1.0, 0.5), (3.0, 0.75)):
        at = np.array([20.0 + 30.0 * x])
        laws = curve.at(at)
        setting = curve.setting(at, laws)
        np.testing.assert_allclose(setting.weight, weight, atol=1e-3)
        np.testing.assert_allclose(setting.shift, weight * (measured(at) - np.log(laws)), atol=2e-3)
        np.testing.assert_allclose(setting.spread, 0.1 * np.sqrt(1.0 + weight), atol=1e-4)


def test_the_band_is_never_wider_for_a_second_witness_and_the_laws_stand_where_no_transient_went():
    curve, _ = weighed(reach=(0.6, 1.5))
    alone, sc = replace(curve, measured=None), np.linspace(0.0, 200.0, 81)
    laws = curve.at(sc)
    with_it, without = curve.setting(sc, laws), alone.setting(sc, laws)
    assert (with_it.spread <= without.spread + 1e-12).all()
    assert not with_it.weight[:, sc > 60.0].any()
    np.testing.assert_array_equal(with_it.shift[:, sc > 60.0], 0.0)
    np.testing.assert_allclose(with_it.spread[:, sc > 60.0], without.spread[:, sc > 60.0])
    assert (without.shift == 0.0).all()


def test_what_transients_scatter_by_takes_their_weight():
    curve, _ = weighed()
    own = curve.measured
    rng = np.random.default_rng(3)
    bent = own.tested[0] + (own.scruton_number - own.tested[0]) * np.exp(0.3 * rng.standard_normal((40, 1, 1)))
    vague = replace(curve, measured=replace(own, scruton_number=bent))
    at = np.array([50.0])
    sharp, dull = (one.setting(at, one.at(at)).weight[0, 0] for one in (curve, vague))
    assert 0.0 < dull < 0.7 * sharp


def test_without_a_discrepancy_the_laws_hold_everywhere_and_a_dead_draw_stays_dead():
    curve, _ = weighed(tau=0.0)
    at = np.array([50.0, 110.0])
    setting = curve.setting(at, curve.at(at))
    assert not setting.weight.any()
    assert not setting.spread.any()
    dead = weighed()[0].setting(at, np.zeros((40, 2)))
    assert not dead.shift.any()


def test_one_law_that_is_asked_for_is_that_law_alone():
    tree = with_transients(campaign_tree(TABLE_5[:1], laws={"n=-1": (-1.0, 1.0)}, tau=0.1))
    assert law_curves(tree).measured is not None
    assert law_curves(tree, law_n=-1.0).measured is None
    sc = 3.0 * TABLE_5[0][0] + 20.0
    with_it, alone = predict(tree, scruton_number=sc), predict(tree, scruton_number=sc, law_n=-1.0)
    assert alone.measured_weight == 0.0 < with_it.measured_weight
    assert with_it.to_json()["measured_weight"] == with_it.measured_weight
    assert any(with_it.measured in flag for flag in with_it.flags)
    assert with_it.measured == f"beside them the measured damping has a weight of {with_it.measured_weight:.0%}"
    assert not alone.measured
