"""Several modes at once, against ordinary random numbers."""

import numpy as np
import pytest
from sizing_room import LIMIT, mode_model

from scruton.campaign.quantity import Quantity
from scruton.sizing.model import COHERENCE, LAW, SECTION, SOURCES
from scruton.sizing.modes import exceedance
from scruton.sizing.together import joint_draws


def models():
    return [mode_model(0.2, 0.45, Quantity(0.9, 0.05, "beta")) for _ in range(3)]


def test_what_is_a_modes_own_is_not_tied_to_another_modes():
    draws = joint_draws(models(), 0, 1 << 12)
    for first, second in ((0, 1), (0, 2), (1, 2)):
        for name in ("damping_ratio", "discrepancy"):
            pair = np.corrcoef(getattr(draws[first], name), getattr(draws[second], name))
            assert abs(pair[0, 1]) < 0.05
        assert (draws[first].curve.amplitude == draws[second].curve.amplitude).all()


@pytest.mark.parametrize("seed", [0, 1])
def test_the_union_agrees_with_brute_force(seed):
    three = models()
    limits = [LIMIT, 1.2 * LIMIT, 1.4 * LIMIT]
    rng = np.random.default_rng(9)
    size = 200_000
    shared = rng.random((size, len(SOURCES)))
    exceeds = []
    for model, limit in zip(three, limits, strict=True):
        u = rng.random((size, len(SOURCES)))
        for source in (SECTION, LAW, COHERENCE):
            u[:, source] = shared[:, source]
        exceeds.append(model.draws(u).amplitude(0.0) > limit)
    found = exceedance(joint_draws(three, seed), limits, [0.0] * 3)
    assert found.each == pytest.approx([one.mean() for one in exceeds], abs=0.01)
    assert found.any == pytest.approx(np.any(exceeds, axis=0).mean(), abs=0.01)
