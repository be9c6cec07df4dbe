"""Predictions: widths that can be computed by hand, Table 5 from its own other rows, and the JSON that scripts read."""

import json

import numpy as np
import pytest
import xarray as xr
from test_griffin_bands import TABLE_5, make_tree

from scruton.campaign.schema import Quantity
from scruton.errors import InputError
from scruton.griffin import cross_predictions, griffin_draws, predict, predictive_draws

MANY = (20, 2000)


def log_sd(draws: np.ndarray) -> float:
    return float(np.log(draws).std())


def with_draws(tree: xr.DataTree, **draws: np.ndarray) -> xr.DataTree:
    groups = {f"/{name}": node.to_dataset() for name, node in tree.children.items()}
    groups["/posterior"] = groups["/posterior"].assign({k: (("chain", "draw", "test"), v) for k, v in draws.items()})
    return xr.DataTree.from_dict(groups)


def test_rows_of_table_5_predict_each_other_as_well_as_they_do() -> None:
    """Chords of the paper's Table 5: each row with its transient slope predicts the other rows to +18 ... -21 %."""
    errors = []
    for i, (_, _, _) in enumerate(TABLE_5):
        for j, (sc, amplitude, _) in enumerate(TABLE_5):
            if i != j:
                one = predict(make_tree(TABLE_5[i : i + 1]), scruton_number=sc, discrepancy_sd=0.0)
                errors.append(100 * (one.median / amplitude - 1))
    np.testing.assert_allclose(sorted(errors), sorted([4.0, 8.6, -21.0, 17.7, -12.2, -5.8]), atol=0.35)


def test_one_test_misses_another_setting_by_the_discrepancy() -> None:
    one = predict(make_tree(TABLE_5[:1], shape=MANY), scruton_number=10.0, discrepancy_sd=0.2)
    assert log_sd(one.draws) == pytest.approx(0.2, rel=0.02)


@pytest.mark.parametrize("count", [2, 3, 5])
def test_several_tests_pin_the_shared_curve(count: int) -> None:
    rows = [TABLE_5[0]] * count
    one = predict(make_tree(rows, shape=MANY), scruton_number=10.0, discrepancy_sd=0.2)
    assert log_sd(one.draws) == pytest.approx(0.2 * np.sqrt(0.5 + 0.5 / count), rel=0.02)
    np.testing.assert_allclose(list(one.weights.values()), 1 / count)


def test_a_vague_test_weighs_little() -> None:
    """Precision weights against the same formula by hand."""
    tree = make_tree([TABLE_5[0], TABLE_5[0]], shape=MANY, spread=0.0)
    a = tree["posterior"]["a_star"].values.copy()
    a[..., 1] *= np.exp(1.0 * np.random.default_rng(0).standard_normal(a.shape[:2]))
    tree = with_draws(tree, a_star=a)
    one = predict(tree, scruton_number=TABLE_5[0][0], discrepancy_sd=0.2)
    precision = np.array([1 / 0.02, 1 / 1.02])
    np.testing.assert_allclose(list(one.weights.values()), precision / precision.sum(), rtol=0.02)
    assert log_sd(one.draws) == pytest.approx(np.sqrt(1 / precision.sum() + 0.02), rel=0.02)


def test_only_peak_tests_are_used() -> None:
    one = predict(make_tree(peak=[1, 0, 1]), scruton_number=10.0, discrepancy_sd=0.1)
    assert list(one.weights) == ["T0", "T2"]


def test_without_discrepancy_one_test_is_its_own_posterior() -> None:
    tree = make_tree(spread=0.1, peak=[0, 1, 0])
    one = predict(tree, scruton_number=30.0, discrepancy_sd=0.0)
    np.testing.assert_allclose(one.draws, griffin_draws(tree, [30.0], "T1")[0][:, 0], rtol=1e-12)


def test_same_seed_same_numbers_and_another_seed_others() -> None:
    tree = make_tree(spread=0.1)

    def run(seed: int) -> np.ndarray:
        return predict(tree, damping_ratio=Quantity(0.003, 0.001), discrepancy_sd=0.2, seed=seed).draws

    np.testing.assert_array_equal(run(4), run(4))
    assert not np.array_equal(run(4), run(5))


def test_prediction_on_a_grid_is_the_prediction_at_each_point() -> None:
    tree = make_tree(spread=0.1)
    draws, _ = predictive_draws(tree, [5.0, 50.0], discrepancy_sd=0.2, seed=3)
    single = predict(tree, scruton_number=50.0, discrepancy_sd=0.2, seed=3)
    np.testing.assert_allclose(draws[:, 1], single.draws, rtol=1e-12)


def test_design_damping_becomes_a_scruton_number() -> None:
    tree = make_tree()
    by_damping = predict(tree, damping_ratio=0.01, discrepancy_sd=0.2)
    by_sc = predict(tree, scruton_number=30.0, discrepancy_sd=0.2)
    assert by_damping.scruton_number == pytest.approx(30.0)
    assert by_sc.damping_ratio == pytest.approx(0.01)
    np.testing.assert_allclose(by_damping.draws, by_sc.draws, rtol=1e-12)


def test_uncertain_design_damping_widens() -> None:
    tree = make_tree(TABLE_5[:1], shape=MANY)
    one = predict(tree, damping_ratio=Quantity(0.01, 0.004), discrepancy_sd=0.0)
    sc, a, slope = TABLE_5[0]
    log_variance = np.log1p(0.16)
    z = np.array([-1.644854, 1.644854])
    design = 30.0 * np.exp(-0.5 * log_variance + z * np.sqrt(log_variance))
    np.testing.assert_allclose(one.interval(0.90)[::-1], 1 / (1 / a + slope * (design - sc)), rtol=0.02)
    assert one.damping_ratio == pytest.approx(0.01 / np.sqrt(1.16), rel=0.02)


def test_the_rig_sets_the_damping_ratio_not_the_amplitude() -> None:
    tree = make_tree()
    xi = tree["posterior"]["damping_ratio"].values.copy()
    xi[..., 2] /= 2.0  # rig RT2 is twice as heavy: half the damping for the same Sc
    tree = with_draws(tree, damping_ratio=xi)
    first, heavy = (predict(tree, scruton_number=30.0, rig=rig, discrepancy_sd=0.1) for rig in ("RT0", "RT2"))
    assert heavy.damping_ratio == pytest.approx(first.damping_ratio / 2)
    np.testing.assert_array_equal(first.draws, heavy.draws)


def test_another_law_can_kill_the_vibration_and_zeros_stay() -> None:
    tree = make_tree(TABLE_5[:1], spread=0.2)
    one = predict(tree, scruton_number=9.5, law_n=2.0, discrepancy_sd=0.2)
    direct = griffin_draws(tree, [9.5], "T0", law_n=2.0)[0]
    assert 0.05 < one.dies < 0.95
    assert one.dies == pytest.approx(np.mean(direct == 0.0), abs=1e-12)
    assert len(one.draws) == 1000
    assert any("no vibration in" in flag for flag in one.flags)


def test_tests_that_disagree_whether_it_dies_vote_by_weight() -> None:
    rows = [TABLE_5[0], (60.0, 0.06551, 0.8927)]
    one = predict(make_tree(rows, shape=MANY), scruton_number=60.0, law_n=2.0, discrepancy_sd=0.2)
    assert one.dies == pytest.approx(0.5, abs=0.01)
    assert np.isfinite(one.draws).all()


def test_negative_scruton_number_and_unbounded_draws_are_said() -> None:
    one = predict(make_tree(TABLE_5[:1], spread=0.3), scruton_number=-15.0, discrepancy_sd=0.1)
    assert one.unbounded > 0.05
    content = json.loads(json.dumps(one.to_json(), allow_nan=False))
    assert content["amplitude"]["interval"]["0.95"][1] is None
    assert content["amplitude"]["mean"] is None
    assert any("negative Scruton number" in flag for flag in one.flags)
    assert any("no stable amplitude in" in flag for flag in one.flags)


def test_extrapolation_is_flagged_from_the_nearest_test() -> None:
    near = predict(make_tree(), scruton_number=23.0, discrepancy_sd=0.2)
    far = predict(make_tree(TABLE_5[:1]), scruton_number=23.0, discrepancy_sd=0.2)
    assert abs(near.extrapolation_index) < 0.3
    assert near.flags == ()
    assert far.extrapolation_index == pytest.approx((23.0 - 1.93) * 0.06551 * 0.8927)
    assert "x = 1.23 from the nearest test" in far.flags[0]


@pytest.mark.parametrize(("motion", "unit"), [("heaving", "A/D"), ("torsional", "rad")])
def test_json_is_what_scripts_read(motion: str, unit: str) -> None:
    content = json.loads(json.dumps(predict(make_tree(motion=motion), scruton_number=30, discrepancy_sd=0.2).to_json()))
    assert list(content)[:3] == ["sc", "damping_ratio", "amplitude"]
    amplitude = content["amplitude"]
    assert list(amplitude) == ["unit", "median", "mean", "sd", "interval"]
    assert amplitude["unit"] == unit
    assert list(amplitude["interval"]) == ["0.50", "0.90", "0.95"]
    lows, highs = zip(*amplitude["interval"].values(), strict=True)
    assert lows[2] < lows[1] < lows[0] < amplitude["median"] < highs[0] < highs[1] < highs[2]
    assert content["sc"] == 30.0


@pytest.mark.parametrize(
    ("design", "message"),
    [
        ({}, "either scruton_number or damping_ratio"),
        ({"scruton_number": 3.0, "damping_ratio": 0.01}, "either scruton_number or damping_ratio"),
        ({"scruton_number": float("nan")}, "finite number"),
        ({"damping_ratio": 1.2}, "between 0 and 1"),
        ({"damping_ratio": Quantity(0.01, -1.0)}, "between 0 and 1"),
        ({"scruton_number": 3.0, "rig": "R9"}, "found 'R9'; wanted a rig with a test in wind, one of: RT0, RT1, RT2"),
        ({"scruton_number": 3.0, "discrepancy_sd": -0.1}, "discrepancy_sd"),
        ({"scruton_number": 3.0, "seed": -1}, "seed"),
    ],
)
def test_a_design_that_makes_no_sense_is_refused(design: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        predict(make_tree(), **({"discrepancy_sd": 0.2} | design))


def test_still_air_predicts_nothing() -> None:
    tree = make_tree()
    del tree["posterior"]
    with pytest.raises(InputError, match="still air says nothing"):
        predict(tree, scruton_number=3.0, discrepancy_sd=0.2)


def test_each_test_is_predicted_from_the_others_alone() -> None:
    tree = make_tree(peak=[1, 0, 1])
    found = cross_predictions(tree, discrepancy_sd=0.0)
    assert list(found) == ["T0", "T2"]
    assert list(found["T0"].weights) == ["T2"]
    sc, a, slope = TABLE_5[2]
    assert found["T0"].median == pytest.approx(1 / (1 / a + slope * (TABLE_5[0][0] - sc)))
    assert cross_predictions(make_tree(TABLE_5[:1]), discrepancy_sd=0.2) == {}
