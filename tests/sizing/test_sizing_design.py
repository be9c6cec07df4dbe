"""Lightest dampers whose table is off: it has one frequency for several that are delivered with errors of their own."""

from dataclasses import replace

import numpy as np
import pytest
from sizing_room import mode_model

from scruton.campaign.plausibility import damping_flag
from scruton.campaign.quantity import Quantity
from scruton.sizing.damper_request import DamperRequest
from scruton.sizing.dampers import damper
from scruton.sizing.tmd_design import design
from scruton.sizing.tmd_draws import Reality
from scruton.sizing.tmd_tuning import TuningDraws

COUNT, RISK = 1000, 0.05
BRIDGE = {"risk": RISK, "modal_mass": 1e6, "frequency": 0.3}


def draws_of(number, *, limit=0.12, delivered=1.0, seed=5, power=0.0, rate=0.005, **options):
    """A bridge with dampers that are delivered within 1 % of frequency and 20 % of damping, times `delivered`."""
    rng = np.random.default_rng(seed)
    section, rates = 0.25 * np.exp(0.2 * rng.standard_normal(COUNT)), rate * np.exp(0.3 * rng.standard_normal(COUNT))
    detuning = 0.02 * rng.standard_normal(COUNT)
    off = [1.0 + delivered * part * rng.uniform(-1.0, 1.0, (number, COUNT)) for part in (0.01, 0.2)]
    real = Reality(off[0], off[1], np.ones((number, COUNT)), power=np.full(COUNT, power))
    return TuningDraws(
        lambda added: section * rates / (rates + 0.002 + added), limit, detuning, number, 1.0,
        reality=real, kept=0.02, **options,
    )  # fmt: skip


def mass_ratio(found):
    return sum(one.mass_ratio for one in found.dampers)


def test_where_the_table_misses_the_stroke_the_lightest_that_keep_it_are_found():
    """Of two dampers one is the less damped, and swings wider than the table has it."""
    draws = draws_of(2, largest_stroke=0.35)
    pair = design(draws, **BRIDGE)
    assert pair.achievable
    assert draws.keeps(pair.dampers, RISK)
    right, lack = draws.set_right(pair.dampers, RISK)
    assert (
        lack
        <= 0.0
        < np.log(1.02)
        < draws.shortages(pair.dampers, RISK)[-1] - np.log(draws._by_table(pair.dampers, RISK)[-1])
    )
    assert pair.reason == "the stroke decides on the mass"
    assert lack > -0.01  # nothing to spare: neither stroke nor risk
    lighter, lacking = right.tune(0.98 * mass_ratio(pair), RISK, pair.dampers)
    assert lacking > 0.0
    assert not draws.keeps(lighter, RISK)


def test_two_dampers_without_errors_of_their_own_are_no_heavier_than_one():
    one, two = (design(draws_of(number, delivered=0.0, largest_stroke=0.35), **BRIDGE) for number in (1, 2))
    assert mass_ratio(two) <= 1.005 * mass_ratio(one)
    assert one.reason == two.reason == "the stroke decides on the mass"


def test_dampers_that_only_seem_to_keep_the_risk_are_tuned_again_not_made_heavier():
    """Mass without tuning does not help them, and was added in vain until an error was raised that was none."""
    draws = draws_of(2, limit=0.04, power=1.0, delivered=4.0, largest_stroke=2.0)
    pair = design(draws, **BRIDGE)
    assert pair.achievable
    assert draws.keeps(pair.dampers, RISK)
    assert -0.01 < draws.set_right(pair.dampers, RISK)[1] <= 0.0
    held = design(draws, **BRIDGE, mass_ratios=(1e-3, 0.97 * mass_ratio(pair)))
    assert (held.achievable, held.reason) == (
        False,
        f"not achievable with a mass ratio up to {97.0 * mass_ratio(pair):g} %: the risk is not kept",
    )


@pytest.mark.thorough
def test_a_bridge_with_damping_in_per_cent_is_sized():
    """A slip of the pen, which is remarked on: no error of the dampers."""
    model = mode_model(0.1)
    mode = replace(model.mode, damping_ratio=Quantity(0.5, 0.1), modal_mass=4e6, frequency=Quantity(0.3, 0.006))
    request = DamperRequest(largest_stroke=0.5)
    model = replace(model, mode=mode, bridge=replace(model.bridge, modes=(mode,), damper=request))
    assert "a percentage is a hundred times its ratio" in damping_flag(mode.damping_ratio.mean)
    found = damper(model, 0.0035, 0)
    assert not found.achievable or found.probability <= RISK
