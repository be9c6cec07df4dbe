"""Quantities that stand in a file, and a sweep of speeds in one."""

import io

import numpy as np
import pytest
import scipy.io
from campaign_room import DEPTH, DISPLACEMENT, HEAVING, TIME, csv, record

from scruton.errors import InputError

SPEEDS = (4.8, 5.2, 5.6)


def mat(**variables: object) -> bytes:
    stream = io.BytesIO()
    scipy.io.savemat(stream, variables)
    return stream.getvalue()


def struct_array() -> bytes:
    """DATA(1) to DATA(3), each with the wind speed U, time t and displacement y, as a traverse writes it."""
    data = np.zeros(3, dtype=[("U", object), ("t", object), ("y", object)])
    for k, speed in enumerate(SPEEDS):
        data[k] = (speed, TIME, (k + 1) * DISPLACEMENT)
    return mat(DATA=data, speeds=np.array(SPEEDS))


def toml(speed: str, *records: str) -> str:
    return HEAVING.replace('wind_speed = "5.735 m/s"', f"wind_speed = {speed}").replace(
        "stable_amplitude = 0.06551", ""
    ) + "".join(records)


RECORD = record(
    "sweep.mat",
    'variables = { time = "DATA[*].t", displacement = "DATA[*].y" }',
    'units = { time = "s", displacement = "m" }',
    kind="steady",
)


@pytest.mark.parametrize("variable", ["DATA[*].U", "speeds"])
def test_sweep_in_one_file(room, variable):
    speed = f'{{ file = "sweep.mat", variable = "{variable}", unit = "m/s" }}'
    campaign = room.load(toml(speed, RECORD), {"sweep.mat": struct_array()})
    assert [test.name for test in campaign.tests] == ["Sc 1.9 0", "Sc 1.9 1", "Sc 1.9 2"]
    assert [test.wind_speed.mean for test in campaign.tests] == list(SPEEDS)
    for k, test in enumerate(campaign.tests):
        assert test.records[0].response * DEPTH == pytest.approx((k + 1) * DISPLACEMENT)
    assert len({test.records[0].name for test in campaign.tests}) == 3
    assert campaign.tests[2].records[0].field == "tests[0][2].records[0]"


def test_scalar_of_a_struct(room):
    speed = '{ file = "sweep.mat", variable = "DATA[1].U", unit = "m/s" }'
    campaign = room.load(toml(speed), {"sweep.mat": struct_array()})
    (test,) = campaign.tests
    assert (test.name, test.wind_speed.mean) == ("Sc 1.9", 5.2)


def test_speeds_of_a_text_file_and_a_record_each(room):
    files = {"speeds.csv": csv("wind speed [mm/s]", 1e3 * np.array(SPEEDS))}
    files |= {f"run{k}.csv": csv("time [s],displacement [m]", TIME, (k + 1) * DISPLACEMENT) for k in range(3)}
    speed = '{ file = "speeds.csv", variable = "wind speed" }'
    campaign = room.load(toml(speed, record("run*.csv", kind="steady")), files)
    assert [test.wind_speed.mean for test in campaign.tests] == pytest.approx(SPEEDS)
    assert [test.records[0].path.name for test in campaign.tests] == ["run0.csv", "run1.csv", "run2.csv"]


@pytest.mark.parametrize(
    ("speed", "message"),
    [
        ('{ file = "sweep.mat", variable = "DATA[*].U" }', r"wind_speed.unit: found nothing, and none in the file"),
        ('{ file = "sweep.mat", variable = "DATA[*].V", unit = "m/s" }', 'no field "V"'),
        ('{ file = "sweep.mat", unit = "m/s" }', "wind_speed.variable: found nothing"),
        ('{ file = "sweep.mat", variable = "DATA[*].t", unit = "m/s" }', "200 values in .*wanted one value"),
        ('{ file = "sweep.mat", variable = "speeds", unit = "kg" }', r"tests\[0\]\[0\].wind_speed: found"),
        ('{ file = "sweep.mat", variable = "speeds", unit = "m/s", sign = 1 }', "wind_speed.sign"),
    ],
)
def test_what_is_refused(room, speed, message):
    with pytest.raises(InputError, match=message):
        room.load(toml(speed, RECORD), {"sweep.mat": struct_array()})


def test_quantities_of_two_lengths(room):
    speed = '{ file = "sweep.mat", variable = "speeds", unit = "m/s" }\nstable_amplitude = '
    speed += '{ file = "sweep.mat", variable = "levels" }'
    content = mat(speeds=np.array(SPEEDS), levels=np.array([0.01, 0.02]))
    with pytest.raises(InputError, match="stable_amplitude: found 2 values; wanted 3, as in wind_speed"):
        room.load(toml(speed), {"sweep.mat": content})
