"""Several modes at once, against ordinary random numbers."""

import numpy as np
import pytest
from sizing_room import LIMIT, mode_model

from scruton.campaign.quantity import Quantity
from scruton.sizing.damper_request import DamperRequest, RiskOf
from scruton.sizing.model import COHERENCE, LAW, SECTION, SOURCES
from scruton.sizing.modes import AllModes, exceedance, required_for_any
from scruton.sizing.remarks import any_mode_remarks
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


def test_the_damping_for_any_mode_keeps_its_risk_at_one_confidence_of_each():
    three = models()
    limits = [0.7 * LIMIT, 0.8 * LIMIT, 3.0 * LIMIT]
    found = required_for_any(joint_draws(three, 0), limits, 0.05)
    assert found.left.any <= 0.05
    assert found.left.any > 0.049, "the least that does"
    each = [joint_draws([model], 5)[0].needed(limit) for model, limit in zip(three, limits, strict=True)]
    for need, added in zip(each, found.required, strict=True):
        assert added == pytest.approx(max(np.quantile(need, found.confidence), 0.0), rel=0.03)
    assert found.required[2] == 0.0
    # on other draws, and against each mode's own 95 %, which keeps less
    other = joint_draws(three, 77)
    assert exceedance(other, limits, found.required).any == pytest.approx(0.05, abs=0.005)
    assert exceedance(other, limits, [max(np.quantile(need, 0.95), 0.0) for need in each]).any > 0.06
    assert required_for_any(joint_draws(three[:1], 0), limits[:1], 0.05) is None
    beyond = required_for_any(joint_draws(three, 0), [0.01 * LIMIT, *limits[1:]], 0.05)
    assert beyond.required[0] is None
    assert beyond.left is None


def drawn_at_random(three, seed: int, size: int = 1 << 12):
    """Draws of every mode at random points of the unit cube, with one section, law and coherence."""
    rng = np.random.default_rng([seed, 4])
    shared = rng.random((size, len(SOURCES)))
    found = []
    for model in three:
        u = rng.random((size, len(SOURCES)))
        for source in (SECTION, LAW, COHERENCE):
            u[:, source] = shared[:, source]
        found.append(model.draws(u))
    return found


def test_monte_carlo_errors_of_any_mode_are_what_seeds_differ_by():
    """The damping that any mode requires errs to the large side: its two errors are added up as if independent."""
    three, limits = models()[:2], [0.7 * LIMIT, 0.8 * LIMIT]
    every = [drawn_at_random(three, seed) for seed in range(40)]
    risks = [exceedance(draws, limits, [0.002, 0.002]) for draws in every]
    for risk, error in ((lambda one: one.any, lambda one: one.any_mcse),
                        (lambda one: one.each[1], lambda one: one.each_mcse[1])):  # fmt: skip
        ratio = np.std([risk(one) for one in risks], ddof=1) / np.mean([error(one) for one in risks])
        assert 0.7 < ratio < 1.35
    needed = [required_for_any(draws, limits, 0.05) for draws in every]
    for k in range(2):
        seen = np.std([one.required[k] for one in needed], ddof=1)
        assert 0.4 < seen / np.mean([one.required_mcse[k] for one in needed]) < 1.2
    beyond = required_for_any(every[0], [0.01 * LIMIT, 3.0 * LIMIT], 0.05)
    assert (beyond.required_mcse[0], beyond.required[0]) == (None, None)
    assert beyond.required_mcse[1] == 0.0, "nothing is required"


def remarks_of(found, request=DamperRequest(), *, weighed=True, damped=True):  # noqa: B008
    return list(any_mode_remarks(found, request, damped=damped, weighed=weighed))


def test_the_risk_of_any_mode_never_passes_in_silence():
    three, limits = models()[:2], [0.7 * LIMIT, 0.8 * LIMIT]
    draws = joint_draws(three, 0)
    needed = required_for_any(draws, limits, 0.05)
    each = [float(np.quantile(drawn.needed(limit), 0.95)) for drawn, limit in zip(draws, limits, strict=True)]
    required = exceedance(draws, limits, each)
    every = AllModes(("V1", "V2"), exceedance(draws, limits, [0.0, 0.0]), required, required_for_any=needed)
    (said,) = remarks_of(every, damped=False)
    assert f"the risk of any mode is {required.any:.1%}" in said
    assert f"{100.0 * needed.required[1]:.3g} % (V2)" in said
    assert remarks_of(every, DamperRequest(risk_of=RiskOf.ANY), damped=False) == []  # it is what is asked then
    assert "modal mass is not stated" in remarks_of(every, weighed=False)[-1]
    # dampers of which one mode does not keep its risk
    left = AllModes(("V1", "V2"), every.without, None, required, required_for_any=needed)
    (said,) = remarks_of(left, DamperRequest(risk=0.045))
    assert "of mode V1" in said
    assert "of any mode" in said
    assert "4.5% of each mode is asked" in said
