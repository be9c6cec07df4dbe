"""Decisions on emulated bridges: how many exceed their limit with what was required at 95 %, and how dear that is."""

from functools import cache

import numpy as np
import pytest
from chains import LAWS, gusts, on_bridge, record, run, stable
from emulated import AMPLITUDE, GUSTY, STILL, TRUTHS, PowerLaw, decided, grown, held_at, knowing

from scruton.sizing.model import unit_cube

BRIDGES = 400
PROMISED, DEAREST = 0.07, 2.0  # share that exceed, at most; required over truly needed damping, medians


@pytest.fixture(scope="module")
def cube():
    return unit_cube(1 << 11, 5)


@pytest.mark.parametrize("name", TRUTHS)
def test_the_truth_stands_where_its_force_and_damping_balance(name):
    truth = TRUTHS[name]
    assert truth.excitation(AMPLITUDE) == pytest.approx(20.0, rel=1e-6 if isinstance(truth, PowerLaw) else 0.01)
    assert truth.on_curve(truth.excitation(0.03)) == pytest.approx(0.03)
    miss = np.array([0.0, 0.2])
    sc = held_at(np.array([0.03, 0.03]), truth, miss)
    assert sc[1] > sc[0]
    assert grown(sc, truth, miss) == pytest.approx(0.03, rel=1e-3)  # in time, from elsewhere


@pytest.mark.parametrize("law", ["van-der-pol", "constant"])
def test_the_oscillators_come_to_the_balance_of_work(law):
    late = np.abs(record(0.2 * stable(20.0, law), 20.0, 0.1, law)[-200:]).max()
    assert late == pytest.approx(stable(20.0, law) * np.exp(0.1), rel=0.01)
    over_section = {"van-der-pol": np.sqrt(4.0 / 3.0), "constant": 4.0 / np.pi}[law]
    assert on_bridge(0.006, 0.1, law, 200) == pytest.approx(
        3.0 * stable(36.0, law) * np.exp(0.1) * over_section, rel=0.01
    )


def test_the_wake_comes_to_one_amplitude_from_below_and_above():
    below, above = (np.abs(record(start, 20.0, 0.0, "wake")[-200:]).max() for start in (0.01, 0.09))
    assert below == pytest.approx(above, rel=0.02)
    assert above == pytest.approx(0.05, rel=0.02)
    gusty = (
        np.abs(record(0.05, 20.0, 0.0, "constant", gusts(np.random.default_rng(1))))[-3000:].reshape(30, -1).max(axis=1)
    )
    assert 0.005 < np.std(gusty) / np.mean(gusty) < 0.03


@pytest.mark.thorough
@pytest.mark.parametrize("name", TRUTHS)
def test_half_of_what_is_required_would_not_do(name, cube):
    """The suite can fail: with half the damping, half the bridges exceed."""
    cell = decided(3, name, 0.10, bridges=60, seed=1, cube=cube)
    assert np.mean(0.5 * cell.required < cell.needed) > 0.5


CELLS = [(name, tau, STILL) for name in TRUTHS for tau in (0.05, 0.10, 0.20)] + [(name, 0.10, GUSTY) for name in TRUTHS]
DEAR = pytest.mark.xfail(strict=True, reason="2.09 to 2.25; who knew law and discrepancy would ask for 1.8")
STEEP = ("n = -1", "van der Pol wake", "Rayleigh wake")  # a small amplitude takes much damping


@pytest.fixture(scope="module")
def cell(cube):
    """Give the decisions of a cell, made once."""
    return cache(lambda rigs, name, tau, seen: decided(rigs, name, tau, bridges=BRIDGES, seed=0, cube=cube, seen=seen))


@pytest.mark.slow
@pytest.mark.parametrize("rigs", [1, 3])
@pytest.mark.parametrize(("name", "tau", "seen"), CELLS)
def test_what_is_required_at_95_percent_is_enough(name, tau, seen, rigs, cell):
    found = cell(rigs, name, tau, seen)
    assert found.violated.mean() <= PROMISED
    assert (found.violated == (found.required < found.needed)).mean() > 0.99  # in time as by the balance


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "tau", "seen"),
    [pytest.param(*cell, marks=DEAR if cell[0] in STEEP and cell[1] == 0.20 else ()) for cell in CELLS],
)
def test_three_rigs_do_not_ask_for_too_much(name, tau, seen, cell):
    found = cell(3, name, tau, seen)
    assert found.dearer <= DEAREST


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("name", "curve", "level"), [(STEEP[0], 1.71, 1.85), (STEEP[1], 1.68, 1.80), (STEEP[2], 1.66, 1.77)]
)
def test_who_knew_law_and_discrepancy_would_ask_for_nearly_as_much(name, curve, level, cube):
    """Where rigs miss by 20 %: with the curve known, and with its level from three rigs; the promise is kept."""
    for known, dearer in ((True, curve), (False, level)):
        found = knowing(3, name, 0.20, bridges=BRIDGES, seed=0, cube=cube, curve=known)
        assert found.dearer == pytest.approx(dearer, abs=0.06)
        assert found.violated.mean() <= PROMISED


@pytest.mark.slow
def test_without_the_growth_with_distance_more_would_exceed_than_is_promised(cube, monkeypatch):
    """Three rigs tell a discrepancy of 20 % as 14 %, by its prior; that it grows beyond the tests makes up for it."""
    monkeypatch.setattr("scruton.griffin.coverage.WALK", 0.0)
    found = decided(3, "n = -1", 0.20, bridges=BRIDGES, seed=0, cube=cube)
    assert found.dearer < DEAREST
    assert found.violated.mean() > PROMISED


@pytest.mark.slow
def test_whole_chains_keep_their_limits():
    """At most one of six, which five in a hundred would exceed twice in 3 % of such runs."""
    links = run(6)
    assert all(link.converged and link.required is not None for link in links)
    assert sum(link.violated for link in links) <= 1
    assert {(link.law, link.gusty) for link in links} == {(law, gusty) for law in LAWS for gusty in (False, True)}
