"""The four measured campaigns that may lie beside the project."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from scruton.campaign import Kind, load_campaign, peak_tests

pytestmark = pytest.mark.real


def test_cylinder_in_wind(shared_data: Callable[[str], Path]) -> None:
    campaign = load_campaign(shared_data("cylinder-in-wind"))
    assert {rig.name: len(rig.records) for rig in campaign.rigs} == {"g1": 4, "g2": 5, "e2": 6}
    assert len(campaign.tests) == 16
    assert len(campaign.sha256 or {}) == 4
    names = [one.name for owner in (*campaign.rigs, *campaign.tests) for one in owner.records]
    assert len(set(names)) == 31
    # The laboratory's sqrt(2) r.m.s. over D at the peak of each rig.
    amplitudes = {test.name: float(np.sqrt(2) * test.records[0].response.std()) for test in campaign.tests}
    peaks = peak_tests(campaign, amplitudes)
    assert [test.name for test in peaks] == ["g1 U 15.8", "g2 U 15.8", "e2 U 15.4"]
    assert [round(amplitudes[test.name], 3) for test in peaks] == [0.084, 0.087, 0.066]
    first = campaign.rigs[0].records[0]
    assert first.kind is Kind.FREE_DECAY
    np.testing.assert_allclose(first.time[[0, 1, -1]], [2.68, 2.681, 4.57])


@pytest.mark.parametrize(
    ("name", "samples", "start", "largest"),
    [
        ("ship-roll-decay", 18653, 8.11, np.radians(10.415)),
        ("pendulum-dry-friction", 115801, 4.2, 0.986),
        ("pendulum-air-drag", 4206, 0.0, 0.414),
    ],
)
def test_still_air(shared_data: Callable[[str], Path], name: str, samples: int, start: float, largest: float) -> None:
    campaign = load_campaign(shared_data(name))
    (one,) = campaign.rigs[0].records
    assert campaign.tests == ()
    assert len(one.time) == len(one.response) == samples
    assert one.time[0] == pytest.approx(start, abs=0.01)
    assert np.abs(one.response).max() == pytest.approx(largest, rel=0.03)
