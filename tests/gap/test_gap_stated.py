"""How far a damping that is stated without a standard deviation is believed."""

import numpy as np
import pytest

from scruton.campaign.quantity import Quantity
from scruton.gap.stated import damping_sd

USUAL = 0.1


def stated(*off: float, sd: float | None = None) -> list[Quantity | None]:
    """Statements that are off by shares of the truth, 0.004 in every rig; NaN: none."""
    return [None if np.isnan(x) else Quantity(0.004 * (1.0 + x), sd) for x in off]


def shown(count: int, measured: int | None = None) -> np.ndarray:
    return np.array(
        [0.004] * (count if measured is None else measured) + [np.nan] * (0 if measured is None else count - measured)
    )


def test_without_ring_downs_it_is_the_card_s():
    np.testing.assert_allclose(damping_sd(stated(0.0, 0.3), shown(2, 0), USUAL), USUAL)


def test_of_one_rig_too_whose_own_ring_down_proves_nothing_of_its_statement():
    np.testing.assert_allclose(damping_sd(stated(0.0), shown(1), USUAL), USUAL)


def test_two_rigs_that_are_stated_well_have_a_third_believed_the_more():
    sd = damping_sd(stated(0.01, -0.01, 0.3), shown(3), USUAL)
    assert sd[2] == pytest.approx(np.sqrt((0.5 * USUAL**2 + 2e-4) / 2.5), rel=0.02)
    np.testing.assert_allclose(sd[:2], USUAL)  # beside one that is off they are believed as the card has it, no less


def test_a_rig_without_a_ring_down_is_believed_as_the_others_are():
    sd = damping_sd(stated(0.01, -0.01, 0.3), shown(3, 2), USUAL)
    assert sd[2] < 0.5 * USUAL
    assert sd[0] == pytest.approx(np.sqrt((0.5 * USUAL**2 + 1e-4) / 1.5), rel=0.02)


def test_what_is_stated_with_a_standard_deviation_keeps_it_and_proves_nothing():
    sd = damping_sd([*stated(0.0, 0.0), Quantity(0.004, 0.00012), None], shown(4), USUAL)
    np.testing.assert_allclose(sd[2:], [0.03, 1.0])
    assert sd[0] == pytest.approx(np.sqrt(0.5 * USUAL**2 / 1.5))
