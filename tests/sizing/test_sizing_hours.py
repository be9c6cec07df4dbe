"""Hours beyond the limit with the amplitude against the wind speed, against sums written out."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from sizing_room import LIMIT, mode_model

from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.errors import InputError
from scruton.sizing.bridge import Wind, load_bridge
from scruton.sizing.hours import LockInShape, assumed_remarks, lock_in_hours, lock_in_shape
from scruton.sizing.model import unit_cube
from scruton.sizing.transfer import TurbulenceClass

EVEN = Wind(np.array([30.0]), np.array([3000.0]))  # 100 hours in every m/s


def hours_of(model, shape, wind=EVEN, limit=LIMIT):
    model = replace(model, bridge=replace(model.bridge, wind=wind))
    return lock_in_hours([model], [model.draws(unit_cube(1 << 12, 0))], [limit], [shape], 0)


def triangle(low=8.0, top=9.5, high=10.0, cells=600):
    edges = np.linspace(low, high, cells + 1)
    v = 0.5 * (edges[1:] + edges[:-1])
    return LockInShape(edges, np.interp(v, [low, top, high], [0.0, 1.0, 0.0])[None], "a triangle")


def test_only_the_speeds_at_which_it_is_too_large_count():
    """Of a triangle the part above the limit: a share 1 - limit/A of the range."""
    model = mode_model()
    found = hours_of(model, triangle())
    speed = 0.3 * 3.0
    assert found.a_year[0] == pytest.approx(100.0 * 2.0 * speed)
    peak = model.draws(unit_cube(1 << 12, 0)).amplitude(0.0)
    share = np.maximum(1.0 - LIMIT / peak, 0.0)
    assert found.exceeding_a_year[0] == pytest.approx(found.a_year[0] * share.mean(), rel=0.01)
    for side, p in ((found.exceeding_low, 0.05), (found.exceeding_high, 0.95)):
        assert side[0] == pytest.approx(found.a_year[0] * np.quantile(share, p), rel=0.02)
    # as it was before, the peak over the whole range: far too many
    assert found.exceeding_a_year[0] < 0.5 * np.mean(peak > LIMIT) * found.a_year[0]


def test_the_curve_has_its_band():
    curve = hours_of(mode_model(0.2), triangle()).curves[0]
    peak = mode_model(0.2).draws(unit_cube(1 << 12, 0)).amplitude(0.0)
    top = int(curve.amplitude_50.argmax())
    assert curve.reduced_velocity[top] == pytest.approx(9.5, abs=0.01)
    assert curve.wind_speed[top] == pytest.approx(9.5 * 0.9, abs=0.01)
    for name, p in (("amplitude_05", 0.05), ("amplitude_50", 0.5), ("amplitude_95", 0.95)):
        assert getattr(curve, name)[top] == pytest.approx(np.quantile(peak, p), rel=0.01)


def test_classes_of_turbulence_share_the_time():
    model = mode_model()
    classes = (TurbulenceClass(0.25, None, Quantity(1.0)), TurbulenceClass(0.75, 0.2, Quantity(0.001)))
    both = hours_of(model, triangle(), replace(EVEN, turbulence=classes))
    assert both.exceeding_a_year[0] == pytest.approx(0.25 * hours_of(model, triangle()).exceeding_a_year[0], rel=1e-9)
    assert both.a_year == hours_of(model, triangle()).a_year


def test_hours_are_told_of_what_is_left_with_damping_added():
    model = replace(mode_model(0.2), bridge=replace(mode_model(0.2).bridge, wind=EVEN))
    draws = model.draws(unit_cube(1 << 12, 0))
    left = {"with_dampers": [draws.amplitude(0.004)]}
    found = lock_in_hours([model], [draws], [LIMIT], [triangle()], 0, left)
    share = np.maximum(1.0 - LIMIT / draws.amplitude(0.004), 0.0).mean()
    assert 0.0 < share < 0.1
    assert found.exceeding_with["with_dampers"][0] == pytest.approx(found.a_year[0] * share, rel=0.02)
    assert found.exceeding_a_year == hours_of(mode_model(0.2), triangle()).exceeding_a_year


def test_without_a_wind_climate_there_are_no_hours():
    assert hours_of(mode_model(), triangle(), None) is None


def tree_of(rigs=("A",) * 5, speeds=(7.5, 8.0, 9.0, 10.0, 10.5), n=-1.0, strength=30.0):
    """Three tests at their peaks, and the smooth functions of speed of a bell with a known band."""
    grid = np.linspace(6.0, 12.0, 241)
    log_amplitude = np.log(0.04) - ((grid - 9.0) / 1.2) ** 2 + 0.3 * np.array([[[-1.0], [1.0]]]) * (grid - 9.0)
    scalar = ("chain", "draw")
    zeros = np.zeros((1, 2))
    group = xr.Dataset(
        {
            "ln_amplitude": ((*scalar, "velocity"), log_amplitude),
            "ln_relaxation": ((*scalar, "velocity"), np.full((1, 2, 241), np.log(strength))),
            "scale_shift": (scalar, zeros), "discrepancy_amplitude": (scalar, zeros),
            "shift": ((*scalar, "rig"), np.zeros((1, 2, 1))), "rig_low": ("rig", [7.0]), "rig_high": ("rig", [11.0]),
            "point_velocity": ("point", np.array(speeds)), "point_rig": ("point", np.array(rigs)),
            "point_scruton_number": ("point", np.full(len(rigs), 20.0)),
        },
        coords={"velocity": grid, "rig": ["A"]},
        attrs={"law_n": n, "reference_scruton_number": 20.0, "tested_low": 7.5, "tested_high": 10.5,
               "drawn_low": 7.0, "drawn_high": 11.0},
    )  # fmt: skip
    constant = xr.Dataset(
        {"motion": "heaving", "law_n": n, "depth": 0.1, "peak": ("test", [True, True]),
         "wind_speed": ("test", [9.0, 8.0]), "frequency": ("test", [10.0, 10.0])},
        coords={"test": ["low", "high"]},
    )  # fmt: skip
    numbers = np.broadcast_to([5.0, 40.0], (1, 2, 2))
    posterior = xr.Dataset({"scruton_number": ((*scalar, "test"), numbers)}, coords={"test": ["low", "high"]})
    campaign = xr.Dataset(coords={"peak_test": ["low", "high"]}, attrs={"peak_tests": ["low", "high"]})
    return xr.DataTree.from_dict({"/speeds": group, "/constant_data": constant, "/posterior": posterior,
                                  "/campaign_posterior": campaign})  # fmt: skip


def test_tests_at_several_speeds_of_one_rig_give_the_shape_with_its_band():
    mode = mode_model().mode
    shape = lock_in_shape(tree_of(), mode, 20.0, 0)
    assert shape.source == "tests and sweeps at other wind speeds"
    assert not shape.assumed
    assert (shape.edges[0], shape.edges[-1]) == (7.0, 11.0)
    v = 0.5 * (shape.edges[1:] + shape.edges[:-1])
    log = -(((v - 9.0) / 1.2) ** 2) + 0.3 * np.array([[-1.0], [1.0]]) * (v - 9.0)
    np.testing.assert_allclose(shape.ratio, np.exp(log - 0.3**2 * 1.2**2 / 4.0), rtol=3e-3)
    stated = lock_in_shape(tree_of(), replace(mode, lock_in=(8.0, 12.0)), 20.0, 0)
    assert (stated.edges[0], stated.edges[-1]) == (8.0, 12.0)
    assert (stated.ratio[:, -1] > 0.0).all()  # beyond the tests it is held, not forgotten
    # where it dies at the bridge's Scruton number the shape of the tests stays, where there too, the peak
    dead = lock_in_shape(tree_of(n=2.0, strength=60.0), mode, 500.0, 0)
    np.testing.assert_allclose(dead.ratio, shape.ratio, rtol=1e-9)
    assert (lock_in_shape(tree_of(n=2.0), mode, 500.0, 0).ratio == 1.0).all()


def test_peaks_of_several_rigs_are_no_sweep():
    shape = lock_in_shape(tree_of(rigs=("A", "B", "C"), speeds=(8.1, 8.5, 9.6)), mode_model().mode, 4.0, 0)
    assert shape.assumed
    assert (shape.edges[0], shape.edges[-1]) == pytest.approx((0.9 * 9.0, 1.1 * 9.0))  # of the nearest peak test alone
    v = 0.5 * (shape.edges[1:] + shape.edges[:-1])
    assert v[shape.ratio[0].argmax()] == pytest.approx(9.0, abs=0.03)
    other = lock_in_shape(tree_of(rigs=("A", "B", "C"), speeds=(8.1, 8.5, 9.6)), mode_model().mode, 39.0, 0)
    assert other.edges[0] == pytest.approx(0.9 * 8.0)
    (said,) = assumed_remarks(["V1", "V2"], [shape, shape])
    assert "hours of modes V1, V2" in said
    assert "from 10 % below that speed to as much above it" in said
    swept = lock_in_shape(tree_of(), mode_model().mode, 20.0, 0)
    assert assumed_remarks(["V1"], [swept]) == []


def test_a_file_of_the_mode_speaks_first(tmp_path):
    text = 'format = 1\nwidth = "12 m"\ndepth = "3 m"\n[[modes]]\nname = "V1"\nfrequency = "0.3 Hz"\n'
    (tmp_path / "bridge.toml").write_text(text + 'lock_in_shape = "shape.csv"\n', encoding="utf-8")
    (tmp_path / "shape.csv").write_text("reduced velocity,amplitude [mm]\n8,0\n9,50\n10,0\n", encoding="utf-8")
    bridge = load_bridge(tmp_path, Motion.HEAVING)
    assert "shape.csv" in bridge.sha256
    shape = lock_in_shape(tree_of(), bridge.modes[0], 20.0, 0)
    v = 0.5 * (shape.edges[1:] + shape.edges[:-1])
    np.testing.assert_allclose(shape.ratio[0], 1.0 - np.abs(v - 9.0), atol=1e-12)
    (tmp_path / "shape.csv").write_text("reduced velocity,amplitude\n9,0\n8,50\n", encoding="utf-8")
    with pytest.raises(InputError, match="velocities rising"):
        load_bridge(tmp_path, Motion.HEAVING)
