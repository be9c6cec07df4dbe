"""Data sets of VIVyD, as VIVyD itself writes them."""

import datetime
import sys

import numpy as np
import pytest
from campaign_room import DEPTH, DISPLACEMENT, HEAVING, TIME, record

from scruton.errors import InputError

pq = pytest.importorskip("quantities")
vivyd = pytest.importorskip("vivyd.data.dataset")


@pytest.fixture
def data_set(tmp_path):
    from vivyd.data.bundle import Bundle
    from vivyd.data.experiment import Experiment
    from vivyd.data.signal import Signal
    from vivyd.data.source import Source
    from vivyd.data.study import Study
    from vivyd.data.value import Value

    uneven = TIME + 0.002 * np.sin(TIME)
    laser = Source(name="laser", info={}).add(
        Signal(name="y", data=1e3 * DISPLACEMENT, units=pq.mm, time=TIME),
        Signal(name="uneven", data=1e3 * DISPLACEMENT, units=pq.mm, time=uneven),
    )
    wind = Source(name="pitot", info={}).add(Value(name="U", data=5.2, units=pq.m / pq.s))
    run = Experiment(name="run 1", info={}, date=datetime.datetime(2024, 1, 1, tzinfo=datetime.UTC))
    study = Study(name="decay", info={}).add(run.add(Bundle(name="tunnel", info={}).add(laser, wind)))
    site = vivyd.Site(name="wind tunnel", location="here", institution="a laboratory")
    path = tmp_path / "set.vxp"
    vivyd.DataSet(name="a set", info={}, site=site).add(study).save(path)
    return path.read_bytes()


def test_a_signal_with_its_own_time_and_unit(room, data_set):
    read = room.record("set.vxp", data_set, 'variables = { displacement = "decay/run 1/tunnel/laser/y" }')
    assert read.response * DEPTH == pytest.approx(DISPLACEMENT)
    assert read.time == pytest.approx(TIME)


def test_uneven_times_are_named(room, data_set):
    lines = 'variables = { time = "laser/uneven.time", displacement = "laser/uneven" }'
    read = room.record("set.vxp", data_set, lines)
    assert read.time == pytest.approx(TIME + 0.002 * np.sin(TIME))


def test_a_value_is_the_wind_speed(room, data_set):
    speed = 'wind_speed = { file = "set.vxp", variable = "pitot/U" }'
    toml = HEAVING.replace('wind_speed = "5.735 m/s"', speed)
    toml += record("set.vxp", 'variables = { displacement = "laser/y" }')
    (test,) = room.load(toml, {"set.vxp": data_set}).tests
    assert test.wind_speed.mean == 5.2


@pytest.mark.parametrize(
    ("variable", "message"),
    [("laser/z", "no such signal or value; wanted one of: decay/run 1/tunnel/laser/y"), ("pitot/U", 'the unit "m/s"')],
)
def test_what_is_refused(room, data_set, variable, message):
    with pytest.raises(InputError, match=message):
        room.record("set.vxp", data_set, f'variables = {{ displacement = "{variable}" }}', 'sample_rate = "100 Hz"')


def test_damage_is_bad_input(room, data_set):
    with pytest.raises(InputError, match=r"set\.vxp"):
        room.record("set.vxp", data_set[: len(data_set) // 2], 'variables = { displacement = "laser/y" }')


def test_without_zarr_the_extra_is_named(room, data_set, monkeypatch):
    monkeypatch.setitem(sys.modules, "zarr", None)
    with pytest.raises(InputError, match=r"scruton\[vivyd\]"):
        room.record("set.vxp", data_set, 'variables = { displacement = "laser/y" }')
