"""Channels of DASP: the samples in one file, what they mean in another."""

import numpy as np
import pytest
from campaign_room import DEPTH, DISPLACEMENT, HEAVING, TIME, record

from scruton.errors import InputError

TSP = "100,1,4,0,0,2,8,50,0,\"mm\"\n测点\n\n\n[SampleChannelPara]\n'ChNodeGain'=2.000000\n"
STS = (1e3 * DISPLACEMENT * 2 * 50).astype("<f4").tobytes()
VARIABLES = 'variables = { displacement = "signal" }'


def load(room, tsp: str = TSP, sts: bytes = STS):
    files = {"run.sts": sts, "run.tsp": tsp.encode("gbk")}
    return room.load(HEAVING + record("run.sts", VARIABLES), files)


def test_samples_over_gain_and_sensitivity(room):
    campaign = load(room)
    read = campaign.tests[0].records[0]
    assert read.time == pytest.approx(TIME)
    assert np.abs(read.response * DEPTH - DISPLACEMENT).max() < 1e-6 * np.abs(DISPLACEMENT).max()
    assert set(campaign.sha256) >= {"run.sts", "run.tsp"}  # both are inputs


def test_without_sections_the_gain_of_the_first_line_holds(room):
    assert load(room, TSP.split("[")[0]).tests[0].records[0].response.size == TIME.size


@pytest.mark.parametrize(
    ("tsp", "sts", "message"),
    [
        (TSP.replace("=2.0", "=4.0"), STS, r"run.tsp: found two gains, 2 and ChNodeGain = 4"),
        (TSP.replace("100,1", "x,1"), STS, "a first line without rate, gain and sensitivity"),
        (TSP.replace(",50,", ",0,"), STS, "sensitivity 0; wanted none of them zero"),
        (TSP, STS[:-1], "799 bytes; wanted a multiple of 4"),
    ],
)
def test_what_is_refused(room, tsp, sts, message):
    with pytest.raises(InputError, match=message):
        load(room, tsp, sts)


def test_the_tsp_must_be_there(room):
    with pytest.raises(InputError, match=r"run\.tsp: found no such file"):
        room.load(HEAVING + record("run.sts", VARIABLES), {"run.sts": STS})
