"""The plain filter: the fast ones against it, and a law outside the n-family through it to a posterior."""

import numpy as np
import pytest
from grid_filter import grid_log_likelihood, motion
from numba import njit

from scruton.dynamics.cycles import EnvelopeData
from scruton.dynamics.equation import drift
from scruton.dynamics.filter import innovations_of
from scruton.dynamics.laws.law import Law
from scruton.dynamics.likelihood import innovations, log_likelihood, pointwise_log_likelihood
from scruton.infer.models import LawPosterior
from scruton.stats.optimum import find_optimum
from scruton.stats.priors import Prior

A_STAR, PERIOD = 0.05, 0.125


@njit
def _family(a, c):
    return drift(a, c[0], c[1], c[2])


_NAMES = {"a_star": "A/D or rad", "relaxation_rate": "1/s", "n": "exponent"}
N_FAMILY = Law("n-family", _family, _NAMES)
PAPER = Law("paper", _family, _NAMES, linear=True)  # n = -1


@pytest.fixture
def rng():
    return np.random.default_rng(7)


@njit
def _fifth_order(a, c):
    growth, cubic, fifth = c[0], c[1], c[2]
    return a * (growth - a**2 * (cubic + fifth * a**2)), growth - a**2 * (3.0 * cubic + 5.0 * fifth * a**2)


@njit
def _wrong_slope(a, c):
    return _fifth_order(a, c)[0], -0.5 * c[0]


VAN_DER_POL = {"growth": "1/s, at small amplitude", "cubic": "1/s per amplitude^2", "fifth": "1/s per amplitude^4"}
FIFTH = Law("van-der-pol-fifth", _fifth_order, VAN_DER_POL)
TRUTH = np.array([0.4, 60.0, 4e4])  # stable at 0.05


def envelopes(*records, se):
    """Records with cycles of one period, end to end."""
    size = [len(y) for y in records]
    gap = np.zeros(sum(size))
    gap[np.cumsum([0, *size[:-1]])] = -1.0
    y = np.concatenate(records)
    time = np.concatenate([PERIOD * np.arange(n) for n in size])
    return EnvelopeData(y, np.full(y.size, se), gap, np.full(y.size, PERIOD), time, np.repeat(range(len(size)), size))


def resolved(rng, lam_dt):
    """Decay, growth and lock-in with gaps, amplitudes far above their uncertainty."""
    parts = []
    for start in (2.2, 0.3, 1.0):
        gap = np.where(rng.random(60) < 0.06, rng.uniform(0.05, 0.5, 60), 0.0)
        y = A_STAR * (1 + (start - 1) * np.exp(-lam_dt / PERIOD * np.cumsum(gap + PERIOD)))
        parts.append((y + 2e-4 * rng.standard_normal(60), np.r_[-1.0, gap[1:]]))
    y, gap = (np.concatenate(part) for part in zip(*parts, strict=True))
    se = 2e-4 * (0.5 + rng.random(y.size))
    return EnvelopeData(y, se, gap, np.full(y.size, PERIOD), np.cumsum(gap + PERIOD), np.repeat(list("abc"), 60))


def walkers_about(rng, lam_dt, size):
    a_star, lam, r = (
        m * np.exp(s * rng.standard_normal(size)) for m, s in ((A_STAR, 0.1), (lam_dt / PERIOD, 0.2), (1.0, 0.2))
    )
    return a_star, lam, 0.01 * a_star * np.sqrt(2 * lam), r


@pytest.mark.parametrize(("lam_dt", "tolerance"), [(0.002, 1e-8), (0.01, 1e-8), (0.1, 1e-7), (0.5, 1e-5)])
@pytest.mark.parametrize("n", [-1.0, 0.0, 1.0, 2.0, -0.5, 0.7])
def test_the_fast_filters_of_the_family_are_the_plain_one(rng, n, lam_dt, tolerance):
    """The series by which the fast filters spare logarithms are good to 1e-8.

    For n = -1 the fast filter's mean over a cycle is exact, the plain one's by Simpson's rule, whose error goes with
    the fourth power of the rate.
    """
    data, (a_star, lam, q, r) = resolved(rng, lam_dt), walkers_about(rng, lam_dt, 16)
    tolerance = max(tolerance, 1e-2 * lam_dt**4) if n == -1.0 else tolerance
    law, parameters = PAPER if n == -1.0 else N_FAMILY, np.column_stack([a_star, lam, np.full(16, n)])
    v, s = innovations_of(law, data, parameters, q, r, initial_sd=0.3)
    plain = pointwise_log_likelihood(v, s).sum(axis=0)
    np.testing.assert_allclose(log_likelihood(data, a_star, lam, q, r, n=n, initial_sd=0.3), plain, rtol=tolerance)


def test_the_filter_with_a_law_for_every_walker_is_the_plain_one(rng):
    data, (a_star, lam, q, r) = resolved(rng, 0.02), walkers_about(rng, 0.02, 5)
    n = np.array([0.0, 1.0, 2.0, -0.5, 3.3])
    want = innovations_of(N_FAMILY, data, np.column_stack([a_star, lam, n]), q, r, initial_sd=0.3)
    got = innovations(data, a_star, lam, q, r, n=n, initial_sd=0.3)
    np.testing.assert_allclose(got[0], want[0], atol=1e-8 * A_STAR)
    np.testing.assert_allclose(got[1], want[1], rtol=1e-6)


@pytest.mark.parametrize("n", [-1.0, -0.5, 0.0, 0.7, 2.0])
def test_the_drift_of_the_family_states_its_derivative_and_its_stable_amplitude(n):
    parameters, a, h = np.array([[A_STAR, 0.5, n]]), np.array([[0.01, 0.05, 0.11]]), 1e-7
    up, down = (N_FAMILY.rates(parameters, a + step)[0] for step in (h, -h))
    np.testing.assert_allclose(N_FAMILY.rates(parameters, a)[1], (up - down) / (2 * h), rtol=1e-6)
    stable = N_FAMILY.stable_amplitude(parameters, 0.02)
    assert stable[0] == pytest.approx(A_STAR, rel=1e-9)
    assert N_FAMILY.relaxation_rate(parameters, stable)[0] == pytest.approx(0.5, rel=1e-6)


@pytest.mark.thorough
@pytest.mark.parametrize("start", [0.15, pytest.param(2.0, marks=pytest.mark.slow)])
def test_a_law_outside_the_family_against_a_grid_filter(rng, start):
    """To 0.1 in log likelihood per 100 cycles; with a wrong derivative of the drift it is not."""
    q, se = 0.02 * A_STAR, 0.0004

    def rate(a):
        return _fifth_order(a, TRUTH)[0]

    data = envelopes(motion(rng, rate, q, se, start * A_STAR), se=se)
    want = grid_log_likelihood(data, rate, q, 1.0, 0.3)
    got, wrong = (
        pointwise_log_likelihood(
            *innovations_of(law, data, TRUTH[None], np.array([q]), np.ones(1), initial_sd=0.3)
        ).sum()
        for law in (FIFTH, Law("wrong", _wrong_slope, VAN_DER_POL))
    )
    assert got == pytest.approx(want, abs=0.1)
    assert abs(wrong - want) > 0.5


def test_a_law_outside_the_family_has_a_posterior(rng):
    """A growth and a decay tell the three parameters, and the stable amplitude better than any of them."""
    stable = FIFTH.stable_amplitude(TRUTH[None], 0.04)
    rate = FIFTH.relaxation_rate(TRUTH[None], stable)[0]
    assert stable[0] == pytest.approx(np.sqrt((-60.0 + np.sqrt(60.0**2 + 4 * 4e4 * 0.4)) / (2 * 4e4)), rel=1e-9)
    q, se = 0.01 * stable[0] * np.sqrt(2 * rate), 3e-4
    records = [motion(rng, lambda a: _fifth_order(a, TRUTH)[0], q, se, start, cycles=160) for start in (0.006, 0.12)]
    priors = (
        Prior("growth", "lognormal", 0.3, 1.0), Prior("cubic", "lognormal", 40.0, 1.0),
        Prior("fifth", "lognormal", 2e4, 1.0), Prior("amplitude_scatter", "lognormal", 0.02, 1.0),
        Prior("noise_factor", "lognormal", 1.0, 0.3),
    )  # fmt: skip
    posterior = LawPosterior(priors, envelopes(*records, se=se), FIFTH, 0.05)
    found = find_optimum(posterior, rng)
    u = found.draw(rng, 500)
    truth = np.log([*TRUTH, 0.01, 1.0])
    assert (np.abs(u.mean(axis=0) - truth) < 3.0 * u.std(axis=0)).all()
    a_star = posterior.state_space(u)[1]
    assert a_star.mean() == pytest.approx(stable[0], abs=3.0 * a_star.std())
    assert a_star.std() < 0.01 * stable[0]
    assert u[:, 0].std() < 0.3
    # Where no amplitude is stable there is no likelihood.
    dead = LawPosterior(priors, posterior.data, Law("dead", _fifth_order, VAN_DER_POL), 1e-6)
    assert np.isneginf(dead.log_likelihood(truth[None])).all()
