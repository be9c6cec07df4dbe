"""What the departures of several tests from the law have in common: the part of one test, and that of all together."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import logsumexp

from scruton.dynamics.cycles import EnvelopeData
from scruton.dynamics.departure import COLUMNS
from scruton.infer.hierarchy import CampaignPosterior
from scruton.infer.in_common import departure_blocks
from scruton.infer.models import SHARED_DEPARTURE, WIND, WindPosterior
from scruton.infer.peak_test import PeakTest
from scruton.infer.thresholds import FEW_RATES
from scruton.stats.priors import Prior

OMEGA0, PERIOD, RATE, NOISE = 50.0, 0.125, 0.5, 0.02  # the last over the amplitude
FIXED = {"relaxation_ratio": RATE / OMEGA0, "amplitude_scatter": 0.01, "noise_factor": 1.0, "gust_scatter": 1e-5,
         "gust_time": 3.0, "set_point_scatter": 1e-5, "damping_ratio": 0.004}  # fmt: skip


def motion(rng, level, n):
    """A growth and a decay of the law n, whose a^-n relaxes exponentially, with some noise of the sensor."""
    t = (np.arange(60) + 0.5) * PERIOD
    parts = [(1.0 + (first**-n - 1.0) * np.exp(-RATE * t)) ** (-1.0 / n) for first in (0.2, 2.5)]
    noise = NOISE * level * rng.standard_normal(120)
    gap = np.zeros(120)
    gap[::60] = -1.0
    return EnvelopeData(
        np.abs(level * np.concatenate(parts) + noise), np.full(120, NOISE * level), gap, np.full(120, PERIOD),
        np.concatenate([t, t]), np.repeat(["growth", "decay"], 60),
    )  # fmt: skip


def of_law(name, level, n, scale, *, shares=True):
    """A test whose records follow the law n, under the law n = -1 with a departure of about this scale."""
    values = FIXED | {"stable_amplitude": level, "departure_scale": scale}
    priors = tuple(Prior(key, "lognormal", values[key], 0.3) for key in WIND)
    wind = WindPosterior(priors, motion(np.random.default_rng(4), level, n), (), OMEGA0, -1.0, shares=shares)
    return PeakTest(name, wind, 3000.0, np.zeros((1, len(WIND))))


def at_the_medians(wind, z):
    """Coordinates of a test, (W, d), at the medians of its priors and these z (W, COLUMNS)."""
    u = np.empty((len(z), wind.coordinates.size))
    u[:, : len(wind.priors)] = [prior.location for prior in wind.priors]
    if wind.shares:
        wind.named(u)[SHARED_DEPARTURE] = z
    return u


def marginal(tests, count=4_000):
    """Log likelihood of all records, z integrated out by Monte Carlo, and its standard error."""
    z = np.random.default_rng(7).standard_normal((count, COLUMNS))
    total = sum(test.wind.log_likelihood(at_the_medians(test.wind, z)) for test in tests)
    weights = np.exp(total - total.max())
    return logsumexp(total) - np.log(count), weights.std() / weights.mean() / np.sqrt(count)


def alone(tests):
    """The same of tests that share nothing."""
    return sum(marginal([replace(test, wind=replace(test.wind, shares=False))], 1)[0] for test in tests)


@pytest.mark.parametrize("scale", [0.05, 0.1])
def test_what_a_test_shares_leaves_its_own_prior_as_it_is(scale):
    """With nobody to share it with, a departure of which half is given and half integrated out is the whole."""
    test = of_law("A", 0.05, -1.0, scale)
    found, error = marginal([test])
    assert error < 0.03
    assert found == pytest.approx(alone([test]), abs=0.03 + 4.0 * error)


def test_tests_that_leave_the_law_alike_are_likelier_together_and_those_that_do_not_are_not():
    alike = [of_law("A", 0.05, 1.0, 0.6), of_law("B", 0.03, 1.0, 0.6)]
    unlike = [of_law("A", 0.05, 1.0, 0.6), of_law("B", 0.03, -2.5, 0.6)]
    gain = [marginal(tests)[0] - alone(tests) for tests in (alike, unlike)]
    assert max(marginal(tests)[1] for tests in (alike, unlike)) < 0.2
    assert gain[0] > 0.5
    assert gain[1] < -0.5


def test_what_is_known_of_one_test_foretells_the_departure_of_another():
    """At the z that the records of one ask for, the columns of another without transients lie where those of it do."""
    one = of_law("A", 0.05, 1.0, 0.6)
    z = np.random.default_rng(7).standard_normal((4_000, COLUMNS))
    u = at_the_medians(one.wind, z)
    log_weight = one.wind.log_likelihood(u)
    weight = np.exp(log_weight - logsumexp(log_weight))
    own = one.wind.departures(u, np.random.default_rng(1))
    empty = replace(one.wind, data=EnvelopeData.join({}))
    other = empty.departures(at_the_medians(empty, z), np.random.default_rng(2))
    np.testing.assert_allclose(weight @ other, 0.5 * (weight @ own), atol=0.05)
    assert np.abs(weight @ own).max() > 0.2


def test_walkers_move_what_is_shared_with_the_records():
    tests = [of_law("A", 0.05, -1.0, 0.1), of_law("B", 0.03, -1.0, 0.1)]
    shared = tuple(Prior("", "lognormal", median, 0.3) for median in (0.04, RATE / OMEGA0, 0.1, 0.2))
    posterior = CampaignPosterior(tests, shared)
    names = np.array(posterior.names)
    (block,) = [
        one for one in posterior.blocks if all(name.startswith(SHARED_DEPARTURE) for name in names[one.members])
    ]
    assert block.members.size == COLUMNS
    assert not block.unread
    assert set(names[block.given]) == {f"{key} of {j}" for j in "AB" for key in ("departure_scale", "relaxation_ratio")}
    moved = np.concatenate([one.members for one in posterior.blocks])
    assert set(moved.tolist()) == set(range(len(names)))
    # A rig that is left out leaves what all shared in its place; one alone says of it what its own records do.
    assert posterior.without_test("B").names[: -len(tests[0].parameters)][-COLUMNS:] == tuple(names[block.members])


def test_rates_move_with_what_they_share_where_they_are_few():
    few, many = np.arange(20, 23), np.arange(20, 20 + FEW_RATES + 1)
    z, curve = np.arange(4, 4 + COLUMNS), np.arange(4)
    alone_, together = departure_blocks(z, curve, few + 20, few, few + 40)
    assert together.members.tolist() == [*z, curve[1], *few]
    assert not set(together.members) & set(together.given)
    assert alone_.members.tolist() == z.tolist()
    assert alone_.chance == together.chance == 0.5
    (only,) = departure_blocks(z, curve, many + 20, many, many + 40)
    assert only.members.tolist() == z.tolist()
    assert only.chance == 1.0
