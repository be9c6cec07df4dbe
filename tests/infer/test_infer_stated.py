"""Stable amplitudes that a campaign states, beside those of its posterior."""

from pathlib import Path

import numpy as np
import pytest

from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Campaign, Motion, Section, Test
from scruton.infer.stated import off_stated


def said(motion: Motion, stated: Quantity | None, middle: float, spread: float = 0.01) -> list[str]:
    test = Test("windy", "rig", Quantity(1.2), Quantity(9.0), stable_amplitude=stated)
    campaign = Campaign(Path(), "", "", Section(motion, 0.3, 0.05), (), (test,))
    draws = middle * np.exp(spread * np.random.default_rng(1).standard_normal((4, 500)))
    return off_stated(campaign, {"windy": draws})


@pytest.mark.parametrize(
    ("stated", "spread"),
    [
        (None, 0.01), (Quantity(0.05), 0.01), (Quantity(0.0515), 0.001), (Quantity(0.056), 0.1),
        (Quantity(0.056, 0.004), 0.01),
    ],
    ids=["nothing", "the same", "as tests repeat", "within the interval", "within what it is stated to"],
)  # fmt: skip
def test_what_agrees_is_not_mentioned(stated: Quantity | None, spread: float) -> None:
    assert said(Motion.HEAVING, stated, 0.05, spread) == []


def test_what_the_records_contradict_is_named() -> None:
    (line,) = said(Motion.HEAVING, Quantity(0.0354), 0.05)
    assert line.startswith("test windy: its stable amplitude is stated as 0.0354 A/D, 0.708 times what its records say")
    assert "(0.05 A/D, 95 % 0.049 A/D to 0.051 A/D)" in line
    (line,) = said(Motion.TORSIONAL, Quantity(np.radians(3.0)), np.radians(2.0), 1e-6)
    assert "stated as 3 deg, 1.5 times what its records say (2 deg, 95 % 2 deg to 2 deg)" in line
