"""Amplitude against reduced velocity: closed forms on draws that are known, edges, errors."""

import numpy as np
import pytest
import xarray as xr

from scruton.dynamics.laws import amplitude_ratio
from scruton.errors import InputError
from scruton.griffin.lock_in import has_speeds, lock_in_band, lock_in_draws, lock_in_velocities

GRID = np.linspace(6.0, 12.0, 241)
REFERENCE = 20.0
DRAWS = 400


def hump(v):
    return 0.04 * np.exp(-(((v - 9.0) / 1.5) ** 2))


def strength(v):
    return 30.0 + 2.0 * (v - 9.0)


def make_tree(*, tau=0.0, shift=0.0, spread=0.0, n=-1.0, strength=strength, draws=DRAWS) -> xr.DataTree:
    """The group as inference writes it, with draws of ln A that are `spread` apart and all else constant."""
    rng = np.random.default_rng(1)
    f = np.log(hump(GRID)) + spread * rng.standard_normal((1, draws, 1))
    h = np.broadcast_to(np.log(strength(GRID)), f.shape)
    scalar = ("chain", "draw")
    group = xr.Dataset(
        {
            "ln_amplitude": ((*scalar, "velocity"), f),
            "ln_relaxation": ((*scalar, "velocity"), h),
            "scale_shift": (scalar, np.full((1, draws), shift)),
            "discrepancy_amplitude": (scalar, np.full((1, draws), tau)),
            "shift": ((*scalar, "rig"), np.broadcast_to([0.0, 0.05], (1, draws, 2))),
            "rig_low": ("rig", [7.0, 7.0]),
            "rig_high": ("rig", [11.0, 10.0]),
            "point_velocity": ("point", [7.5, 9.0, 10.5]),
            "point_scruton_number": ("point", [20.0, 20.0, 20.0]),
            "point_rig": ("point", ["A", "A", "B"]),
        },
        coords={"velocity": GRID, "rig": ["A", "B"]},
        attrs={
            "law_n": n, "reference_scruton_number": REFERENCE, "tested_low": 7.5, "tested_high": 10.5,
            "drawn_low": 7.0, "drawn_high": 11.0,
        },
    )  # fmt: skip
    constant = xr.Dataset({"motion": "heaving", "law_n": n})
    return xr.DataTree.from_dict({"/speeds": group, "/constant_data": constant})


@pytest.mark.parametrize("n", [-1.0, 0.0, 1.0, 2.0])
def test_every_speed_is_carried_along_its_own_griffin_curve(n: float) -> None:
    v = np.array([7.5, 8.2, 9.0, 10.3])
    wide = make_tree(n=n, strength=lambda u: strength(u) + 40.0)
    for sc in (5.0, 20.0, 35.0):
        x = (sc - REFERENCE) / (strength(v) + 40.0 - n * REFERENCE)
        wanted = hump(v) * amplitude_ratio(x, n)
        draws = lock_in_draws(wide, sc, v)
        assert draws.shape == (DRAWS, 4)
        np.testing.assert_allclose(draws, np.broadcast_to(wanted, draws.shape), rtol=1e-3)


def test_a_vibration_that_dies_is_zero_and_one_without_bound_is_infinite() -> None:
    dies = make_tree(n=2.0, strength=lambda v: 60.0 + 0.0 * v)
    # 1 - 2 (Sc - 20)/20 = 0 at Sc = 30
    assert (lock_in_draws(dies, 29.0, [9.0]) > 0.0).all()
    assert (lock_in_draws(dies, 30.5, [9.0]) == 0.0).all()
    # below the strength at which vibration lives at the reference itself there is none at all
    assert (lock_in_draws(make_tree(n=2.0, strength=lambda v: 30.0 + 0.0 * v), 25.0, [9.0]) == 0.0).all()
    runaway = make_tree(strength=lambda v: 5.0 + 0.0 * v)
    assert np.isinf(lock_in_draws(runaway, -6.0, [9.0])).all()
    assert lock_in_band(runaway, -6.0, [9.0]).median[0] == np.inf


def test_a_new_setting_carries_the_discrepancy_along_its_whole_curve() -> None:
    tree = make_tree(tau=0.2, draws=4000)
    draws = np.log(lock_in_draws(tree, 20.0, [8.0, 9.0])) - np.log(hump(np.array([8.0, 9.0])))
    assert draws[:, 1].std() == pytest.approx(0.2, rel=0.05)
    np.testing.assert_allclose(draws[:, 0], draws[:, 1], atol=1e-3)
    np.testing.assert_array_equal(lock_in_draws(tree, 20.0, seed=4), lock_in_draws(tree, 20.0, seed=4))
    assert not np.array_equal(lock_in_draws(tree, 20.0, seed=4), lock_in_draws(tree, 20.0, seed=5))


def test_a_new_rig_has_a_lock_in_of_uncertain_place_and_a_tested_one_its_own() -> None:
    tree = make_tree(shift=0.03, draws=4000)
    v = np.array([10.0])
    slope = -2 * (10.0 - 9.0) / 1.5**2 * 10.0
    assert np.log(lock_in_draws(tree, 20.0, v)).std() == pytest.approx(abs(slope) * 0.03, rel=0.12)
    np.testing.assert_allclose(lock_in_draws(tree, 20.0, v, rig="A"), hump(10.0), rtol=1e-3)
    np.testing.assert_allclose(lock_in_draws(tree, 20.0, v, rig="B"), hump(10.0 * np.exp(0.05)), rtol=1e-3)


def test_band_is_the_quantiles_of_the_draws_and_marks_what_is_extrapolated() -> None:
    tree = make_tree(spread=0.1)
    v = np.array([6.5, 7.2, 9.0, 10.8, 11.5])
    band = lock_in_band(tree, 22.0, v)
    draws = lock_in_draws(tree, 22.0, v)
    assert np.isnan(draws[:, [0, 4]]).all()
    assert np.isnan(band.median[[0, 4]]).all()
    np.testing.assert_allclose(band.median[1:4], np.median(draws[:, 1:4], axis=0))
    for p in (0.5, 0.9, 0.95):
        np.testing.assert_allclose(
            band.intervals[p][:, 1:4], np.quantile(draws[:, 1:4], [0.5 - p / 2, 0.5 + p / 2], axis=0)
        )
    assert band.extrapolated.tolist() == [True, True, False, True, True]
    assert (band.unit, band.scruton_number) == ("A/D", 22.0)
    # x = (60 - 20)/50 = 0.8 from the nearest tested Scruton number
    assert lock_in_band(tree, 60.0, v).extrapolated.all()
    whole = lock_in_band(tree, 22.0)
    np.testing.assert_array_equal(whole.velocity, lock_in_velocities(tree))
    assert (whole.velocity[0], whole.velocity[-1]) == (7.0, 11.0)
    assert not np.isnan(whole.median).any()
    assert lock_in_band(tree, 22.0, rig="B").velocity[-1] == 10.0
    assert np.isnan(lock_in_band(tree, 22.0, [10.5], rig="B").median).all()


def test_errors_name_what_is_wrong() -> None:
    bare = xr.DataTree.from_dict({"/constant_data": xr.Dataset({"motion": "heaving"})})
    assert not has_speeds(bare)
    for call in (lock_in_band, lock_in_draws):
        with pytest.raises(InputError, match="three reduced velocities"):
            call(bare, 20.0)
        with pytest.raises(InputError, match=r"scruton_number.*finite"):
            call(make_tree(), np.nan)
        with pytest.raises(InputError, match=r"'C'.*one of: A, B"):
            call(make_tree(), 20.0, rig="C")
