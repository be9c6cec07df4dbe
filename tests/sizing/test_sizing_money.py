"""Costs and the value of information, against nested simulation and against what must hold."""

import numpy as np
import pytest
from sizing_room import LIMIT, mode_model

from scruton.sizing.bridge import Cost
from scruton.sizing.dampers import Asked, Damper, MassMap
from scruton.sizing.model import DAMPING, DISCREPANCY, SOURCES, Spread, unit_cube
from scruton.sizing.money import cost_by_damping, cost_by_mass, information

COST = Cost("EUR", fixed=1e5, per_percent=1e6, failure=2e7)
ADDED = np.linspace(0.0, 0.012, 41)


def test_the_least_expected_cost_is_where_the_slopes_cancel():
    curve = cost_by_damping(COST, ADDED, np.exp(-ADDED / 0.001))
    exact = -0.001 * np.log(1e8 * 0.001 / 2e7)
    assert curve.best_added_damping == pytest.approx(exact, abs=ADDED[1])
    assert curve.total[0] == pytest.approx(2e7)  # nothing is bought, nothing fixed is paid


@pytest.mark.parametrize(
    ("stroke", "largest", "failure", "best"),
    [
        (None, 0.05, 1e6, 2e3),
        (0.5, 0.05, 1e6, 4e3),
        (None, 0.0015, 1e6, 1e3),
        (0.5, 0.0015, 1e6, 0.0),
        (None, 0.05, 1e3, 0.0),
    ],
)
def test_the_cheapest_mass_is_one_that_is_allowed(stroke, largest, failure, best):
    none = np.zeros(3)
    chart = MassMap(
        mass_ratio=np.array([0.001, 0.002, 0.004]), mass=np.array([1e3, 2e3, 4e3]),
        probability=np.array([0.1, 0.02, 0.015]), stroke=none, stroke_high=np.array([2.0, 1.0, 0.5]),
        added_damping=none,
    )  # fmt: skip
    spread = Spread(0.0)
    damper = Damper(
        Asked(0.05, 1, largest, stroke), 0.5, True, "", (), 0.002, 2e3, 0.02, spread, spread, (), chart
    )  # fmt: skip
    found = cost_by_mass(Cost("EUR", per_kg=10.0, failure=failure), 0.4, damper)
    assert found.best_mass == best
    assert found.best_total == (found.without if best == 0.0 else found.total[chart.mass == best][0])


def nested(model, source, outer=400, inner=2000):
    """Expected saving of knowing one source, by simulation in simulation."""
    first, second = unit_cube(512, 1)[:outer], unit_cube(2048, 2)[:inner]
    damper = cost_by_damping(COST, ADDED, np.zeros(ADDED.size)).damper
    best, mean = [], np.zeros(ADDED.size)
    for row in first:
        u = second.copy()
        u[:, source] = row[source]
        losses = damper + COST.failure * (model.draws(u).needed(LIMIT)[:, None] > ADDED).mean(axis=0)
        best.append(losses.min())
        mean += losses / len(first)
    return mean.min() - np.mean(best)


def test_perfect_information_agrees_with_nested_simulation():
    model = mode_model(0.2, 0.45)
    found = information(model, LIMIT, COST, ADDED)
    worth = {one.name: one.value for one in found.worth if one.kind == "perfect"}
    for source in (DAMPING, DISCREPANCY):
        exact = nested(model, source)
        assert worth[SOURCES[source]] == pytest.approx(exact, rel=0.2, abs=0.02 * found.perfect)


def test_information_is_ordered_as_it_must_be():
    found = information(mode_model(0.2, 0.45), LIMIT, COST, ADDED)
    worth = {one.name: one.value for one in found.worth}
    assert all(0.0 <= value <= 1.02 * found.perfect for value in worth.values())
    # a test tells less than the truth of what it measures
    assert worth["a damping test of the finished bridge"] < worth[SOURCES[DAMPING]]
    assert worth["a rig at the bridge's own Scruton number"] > worth["a rig at twice that Scruton number"]


def test_what_is_known_already_is_worth_nothing():
    found = information(mode_model(), 0.5, COST, ADDED)  # far from the limit
    assert found.perfect == pytest.approx(0.0, abs=1.0)
    assert all(one.value == pytest.approx(0.0, abs=1.0) for one in found.worth)
    assert "a damping test of the finished bridge" not in {one.name for one in found.worth}


def test_same_seed_same_worth():
    model = mode_model(0.2, 0.45)
    first, again = (information(model, LIMIT, COST, ADDED, seed=2, points=1 << 12) for _ in range(2))
    assert first.worth == again.worth


def test_knowing_everything_never_costs():
    """Where nothing is bought whatever is known, the noise of two estimates of one cost is no value."""
    free = Cost("EUR", fixed=1e9, per_percent=1.0, failure=1e3)
    for seed in range(4):
        assert information(mode_model(0.1, 0.45), LIMIT, free, ADDED, seed=seed).perfect >= 0.0
