"""Odd numbers of a bridge are remarked on, and none of an ordinary bridge is."""

from dataclasses import replace

import pytest

from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.sizing.bridge import Bridge, Mode
from scruton.sizing.limits import limit
from scruton.sizing.plausibility import odd_input

ORDINARY = Mode("V1", Quantity(0.3, 0.003), Quantity(20_000.0, 400.0))
DECK = Bridge("deck", Motion.HEAVING, 12.0, 3.0, 1.225, Quantity(0.95, 0.03, "beta"), (), (ORDINARY,))


def test_an_ordinary_bridge_is_not_remarked_on():
    assert not odd_input(DECK)
    inertia = replace(ORDINARY, mass=Quantity(2.4e6, 0.05e6), frequency=Quantity(0.42, 0.005))
    assert not odd_input(replace(DECK, motion=Motion.TORSIONAL, width=35.6, depth=2.98, modes=(inertia,)))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"frequency": Quantity(0.3, 0.3)}, "mode V1: the standard deviation of the frequency is 100 % of its mean"),
        ({"frequency": Quantity(300.0)}, "the frequency is 300 Hz"),
        ({"mass": Quantity(1e12)}, "the mass over that of the air displaced"),
        ({"mass": Quantity(20_000.0, 10_000.0)}, "standard deviation of the mass is 50 %"),
        ({"damping_ratio": Quantity(3e-6)}, "the damping is 0.0003 %"),
        ({"damping_ratio": Quantity(0.003, 0.006)}, "standard deviation of the damping ratio is 200 %"),
    ],
)
def test_odd_numbers_of_a_mode(change, words):
    remarks = odd_input(replace(DECK, modes=(replace(ORDINARY, **change),)))
    assert len(remarks) == 1
    assert words in remarks[0]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"coherence": Quantity(0.95, 0.1, "normal")}, "of the coherence lies above 1"),
        ({"coherence": Quantity(0.95, 0.1, "lognormal")}, "of the coherence lies above 1"),
        ({"width": 1200.0}, "B/D is 400"),
        ({"air_density": 1000.0}, "not air"),
    ],
)
def test_odd_numbers_of_the_bridge(change, words):
    assert any(words in remark for remark in odd_input(replace(DECK, **change)))


def test_alike_remarks_of_several_modes_are_one():
    modes = tuple(replace(ORDINARY, name=name, frequency=Quantity(0.3, sd)) for name, sd in (("V1", 0.3), ("V2", 0.2)))
    remarks = odd_input(replace(DECK, modes=modes))
    assert len(remarks) == 1
    assert "V1, V2" in remarks[0]


def test_a_limit_that_no_vortices_reach_is_remarked_on():
    """With its unit forgotten a limit of 0.9 m asks for no damper."""
    assert not odd_input(DECK, [limit("jtg"), limit("0.09 m"), limit("0.05")])
    (remark,) = odd_input(DECK, [limit("0.9")])
    assert "mode V1: the amplitude of the limit 0.9 is 0.9 A/D, outside" in remark
