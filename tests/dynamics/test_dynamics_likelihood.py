"""The state-space likelihood against slow, obvious evaluations."""

import numpy as np
import pytest
from grid_filter import grid_log_likelihood, motion
from scipy.interpolate import RectBivariateSpline
from scipy.stats import multivariate_normal

from scruton.dynamics.block_filter import block_filter
from scruton.dynamics.cycles import EnvelopeData
from scruton.dynamics.departure import COLUMNS, factor_at, relative_drift
from scruton.dynamics.likelihood import (
    Wind,
    _filtered,
    contiguous,
    innovations,
    log_likelihood,
    pointwise_log_likelihood,
    statics,
)
from scruton.dynamics.step_filter import step_filter
from scruton.dynamics.trial_filter import trial_amplitudes, trial_log_likelihood


def make_data(amplitudes, se, period, gaps=None, records=None):
    n = len(amplitudes)
    gap = np.zeros(n) if gaps is None else np.asarray(gaps, float)
    gap[0] = -1.0
    return EnvelopeData(
        amplitude=np.asarray(amplitudes, float),
        standard_error=np.broadcast_to(se, n).astype(float).copy(),
        gap=gap,
        period=np.full(n, period),
        time=np.arange(n) * period,
        record=np.full(n, "r") if records is None else np.asarray(records),
    )


def step_by_step(data, a_star, lam, q, r, wind=None, *, n=-1.0, initial_sd=1.0):
    """`innovations` by the plain filter, one walker after another."""
    wind = wind or Wind()
    return _filtered(data, contiguous(a_star, lam, q, r, *wind.sizes, n), initial_sd, wind)[:2]


def dense_log_likelihood(data, a_star, lam, q, r, sd0, gust=0.0, gust_rate=1.0, set_point=0.0, per_cycle=120):
    """Multivariate normal of the cycle means of one record, by quadrature over the covariance of the SDE."""
    nodes, weights = np.polynomial.legendre.leggauss(2)
    edges, start = [], 0.0
    for gap, period in zip(data.gap, data.period, strict=True):
        start += max(gap, 0.0)
        edges.append(start)
        start += period
    sub = data.period[0] / per_cycle
    cells = np.array([e + sub * (i + 0.5) for e in edges for i in range(per_cycle)])
    t = (cells[:, None] + 0.5 * sub * nodes[None, :]).ravel()
    w = np.tile(weights / 2 / per_cycle, cells.size)
    decay = np.exp(-lam * t)
    cov = q**2 / (2 * lam) * (np.exp(-lam * np.abs(t[:, None] - t[None, :])) - decay[:, None] * decay[None, :])
    cov += sd0**2 * decay[:, None] * decay[None, :] + set_point**2 * (1 - decay)[:, None] * (1 - decay)[None, :]
    if gust:  # the amplitude as a filter of the gust, by the trapezium rule on a grid of its own
        grid = np.linspace(0.0, t[-1] * 1.0001, 2500)
        lag = grid[:, None] - grid[None, :]
        response = np.where(lag >= 0.0, lam * np.exp(-lam * np.abs(lag)), 0.0) * (grid[1] - grid[0])
        response[:, 0] *= 0.5
        response[np.diag_indices(grid.size)] *= 0.5
        response[0, 0] = 0.0
        felt = response @ (gust**2 * np.exp(-gust_rate * np.abs(lag))) @ response.T
        cov += RectBivariateSpline(grid, grid, felt, kx=1, ky=1)(t, t)
    mean = a_star * (1 - decay)
    n, m = data.size, per_cycle * 2
    average = np.zeros((n, t.size))
    for k in range(n):
        average[k, k * m : (k + 1) * m] = w[k * m : (k + 1) * m]
    total = average @ cov @ average.T + np.diag((r * data.standard_error) ** 2)
    return multivariate_normal(average @ mean, total).logpdf(data.amplitude)


@pytest.fixture
def rng():
    return np.random.default_rng(7)


@pytest.mark.parametrize("lam", [0.02, 0.3, 3.0])
@pytest.mark.parametrize("gaps", [False, True])
def test_exact_for_the_papers_law(rng, lam, gaps):
    period, n = 0.125, 14
    t = np.arange(n) * period
    y = 0.05 + 0.06 * np.exp(-lam * t) + 0.001 * rng.standard_normal(n)
    gap = np.zeros(n)
    if gaps:
        gap[5], gap[9] = 2 * period, 0.7
    data = make_data(y, 0.0008 * (1 + 0.3 * rng.random(n)), period, gap)
    got = log_likelihood(data, *(np.array([x]) for x in (0.05, lam, 0.002, 1.2)), initial_sd=0.3)[0]
    assert got == pytest.approx(dense_log_likelihood(data, 0.05, lam, 0.002, 1.2, 0.3), abs=2e-3)


@pytest.mark.thorough
@pytest.mark.parametrize("set_point", [0.0, 0.004])
@pytest.mark.parametrize("gust_rate", [0.05, 0.3, 2.0])
@pytest.mark.parametrize("gaps", [False, True])
def test_exact_with_gusts_and_a_set_point(rng, gust_rate, set_point, gaps):
    period, n, lam = 0.125, 14, 0.3
    y = 0.05 + 0.06 * np.exp(-lam * np.arange(n) * period) + 0.001 * rng.standard_normal(n)
    gap = np.zeros(n)
    if gaps:
        gap[5], gap[9] = 2 * period, 0.7
    data = make_data(y, 0.0008 * (1 + 0.3 * rng.random(n)), period, gap)
    theta = [np.array([x]) for x in (0.05, lam, 0.002, 1.2)]
    got = log_likelihood(data, *theta, Wind(0.01, gust_rate, set_point), initial_sd=0.3)[0]
    wanted = dense_log_likelihood(data, 0.05, lam, 0.002, 1.2, 0.3, gust=0.01, gust_rate=gust_rate, set_point=set_point)
    assert got == pytest.approx(wanted, abs=2e-3)
    assert abs(got - log_likelihood(data, *theta, initial_sd=0.3)[0]) > 0.05


@pytest.mark.parametrize("n", [-1.0, 0.0, 0.7, 1.0, 2.0])
def test_fast_filters_are_the_plain_filter_with_a_gust(rng, n):
    size, walkers = 203, 7
    y = 0.05 + 0.002 * rng.standard_normal(size)
    gap = np.where(rng.random(size) < 0.05, 0.3, 0.0)
    gap[80] = -1.0
    data = make_data(y, 0.001, 0.1, gap)
    theta = [np.exp(rng.normal(m, 0.3, walkers)) for m in np.log([0.05, 0.4, 0.002, 1.0])]
    wind = Wind(*(np.exp(rng.normal(mean, 0.5, walkers)) for mean in (-6.0, -1.0, -6.0)))
    plain = pointwise_log_likelihood(*step_by_step(data, *theta, wind, n=n, initial_sd=0.2)).sum(axis=0)
    np.testing.assert_allclose(log_likelihood(data, *theta, wind, n=n, initial_sd=0.2), plain, rtol=1e-7)


def test_fast_filter_is_the_plain_filter(rng):
    n, walkers = 203, 7
    y = 0.05 + 0.002 * rng.standard_normal(n)
    gap = np.where(rng.random(n) < 0.05, 0.3, 0.0)
    gap[80] = -1.0
    data = make_data(y, 0.001, 0.1, gap)
    theta = [np.exp(rng.normal(m, 0.5, walkers)) for m in np.log([0.05, 0.4, 0.002, 1.0])]
    plain = pointwise_log_likelihood(*step_by_step(data, *theta, initial_sd=0.2)).sum(axis=0)
    np.testing.assert_allclose(log_likelihood(data, *theta, initial_sd=0.2), plain, rtol=1e-11)


def test_the_filters_are_compiled_for_one_type_of_arguments(rng):
    data = make_data(0.05 + 0.002 * rng.standard_normal(20), 0.001, 0.1)
    for walkers in (1, 7):
        theta = [np.full(walkers, value) for value in (0.05, 0.4, 0.002, 1.0)]
        for wind in (None, Wind(gust=np.full(walkers, 0.001)), Wind(departure=0.1)):
            log_likelihood(data, *theta, wind)
            innovations(data, *theta, wind, n=np.linspace(-1.0, 1.0, walkers) if walkers > 1 else -1.0)
    assert len(block_filter.signatures) == len(step_filter.signatures) == 1


def test_records_are_independent(rng):
    y = 0.05 + 0.002 * rng.standard_normal(20)
    theta = [np.array([x]) for x in (0.05, 0.4, 0.002, 1.0)]
    apart = sum(log_likelihood(make_data(part, 0.001, 0.1), *theta) for part in (y[:8], y[8:]))
    gap = np.zeros(20)
    gap[8] = -1
    together = log_likelihood(make_data(y, 0.001, 0.1, gap), *theta)
    np.testing.assert_allclose(together, apart, rtol=1e-12)


@pytest.mark.parametrize("n", [0.0, 1.0, 2.0, -0.5])
@pytest.mark.parametrize("start", [0.15, 2.0])
def test_linearised_filter_against_a_grid_filter(rng, n, start):
    """To 0.1 in log likelihood per 100 cycles, as growth and decay, with 2 % turbulence scatter."""
    a_star, lam = 0.05, 0.5
    q, se = 0.02 * a_star * np.sqrt(2 * lam), 0.0004

    def law(a):
        return -lam * a * np.log(a / a_star) if n == 0 else lam / n * a * (1 - (a / a_star) ** n)

    data = make_data(motion(rng, law, q, se, start * a_star), se, 0.125)
    got = log_likelihood(data, *(np.array([x]) for x in (a_star, lam, q, 1.0)), n=n, initial_sd=0.3)[0]
    assert got == pytest.approx(grid_log_likelihood(data, law, q, 1.0, 0.3), abs=0.1)


def three_records(rng, lam_dt, *, near_floor=False, count=60):
    """Decay, growth and lock-in with gaps; near the floor nothing but noise about a vanishing amplitude."""
    parts = []
    for start, period in ((2.2, 0.125), (0.08, 0.13), (1.0, 0.11)):
        gap = np.where(rng.random(count) < 0.06, rng.uniform(0.05, 1.5, count), 0.0)
        y = 0.05 * (1 + (start - 1) * np.exp(-lam_dt / period * np.cumsum(gap + period)))
        y = 1e-5 * start + 3e-4 * rng.standard_normal(count) if near_floor else y + 1e-3 * rng.standard_normal(count)
        parts.append((np.abs(y), np.r_[-1.0, gap[1:]], np.full(count, period)))
    y, gap, period = (np.concatenate(one) for one in zip(*parts, strict=True))
    se = (3e-4 if near_floor else 1e-3) * (0.5 + rng.random(y.size))
    return EnvelopeData(y, se, gap, period, np.cumsum(period), np.repeat(list("abc"), count))


def walkers_about(rng, lam_dt, size):
    a_star, lam, r = (m * np.exp(s * rng.standard_normal(size)) for m, s in ((0.05, 0.2), (8 * lam_dt, 0.4), (1, 0.4)))
    return a_star, lam, 0.01 * a_star * np.sqrt(2 * lam) * np.exp(0.7 * rng.standard_normal(size)), r


@pytest.mark.parametrize("near_floor", [False, True])
@pytest.mark.parametrize("lam_dt", [0.001, 0.01, 0.1, 0.5, 1.0])
@pytest.mark.parametrize("n", [0.0, 1.0, 2.0, -0.5, 0.7])
def test_fast_filter_of_a_curved_law_is_the_plain_filter(rng, n, lam_dt, near_floor):
    data, walkers = three_records(rng, lam_dt, near_floor=near_floor), walkers_about(rng, lam_dt, 64)
    plain = pointwise_log_likelihood(*step_by_step(data, *walkers, n=n, initial_sd=0.5)).sum(axis=0)
    fast = log_likelihood(data, *walkers, n=n, initial_sd=0.5)
    assert np.isfinite(plain).all()
    # Of walkers 1e8 nats off no more than eight digits are asked.
    np.testing.assert_allclose(fast, plain, rtol=1e-8, atol=1e-6)


def test_every_walker_may_have_a_law_of_its_own(rng):
    """The plain filter takes an array of n; each walker gets what the fast filter of its own law says."""
    laws = np.array([0.0, 1.0, 2.0, -0.5, 0.7, -1.0, 3.3])
    data, walkers = three_records(rng, 0.05), walkers_about(rng, 0.05, laws.size)
    alone = [log_likelihood(data, *(one[k : k + 1] for one in walkers), n=n)[0] for k, n in enumerate(laws)]
    np.testing.assert_allclose(log_likelihood(data, *walkers, n=laws), alone, rtol=1e-8, atol=1e-6)
    same = log_likelihood(data, *walkers, n=np.full(laws.size, 2.0))
    np.testing.assert_array_equal(same, log_likelihood(data, *walkers, n=2.0))


def test_a_walkers_likelihood_does_not_depend_on_its_neighbours(rng):
    """The fast filter chooses between a series and the closed form by the worst of all walkers."""
    data, walkers = three_records(rng, 0.02), walkers_about(rng, 0.02, 9)
    walkers[1][4] = 40.0
    for n in (0.0, 2.0):
        together = log_likelihood(data, *walkers, n=n)
        alone = [log_likelihood(data, *(one[k : k + 1] for one in walkers), n=n)[0] for k in range(9)]
        np.testing.assert_allclose(together, alone, rtol=1e-8, atol=1e-6)


def test_cost_of_a_wrong_relaxation_rate_is_seen(rng):
    """The likelihood must tell 0.3 from 0.6 per second on a decay of 60 cycles."""
    t = np.arange(60) * 0.125
    data = make_data(0.05 + 0.05 * np.exp(-0.3 * t) + 2e-4 * rng.standard_normal(60), 2e-4, 0.125)
    lam = np.array([0.3, 0.6])
    right, wrong = log_likelihood(data, np.full(2, 0.05), lam, np.full(2, 1e-4), np.ones(2))
    assert right > wrong + 10


def test_trial_likelihood_is_a_multivariate_normal(rng):
    """With a and c integrated out; and given all else, a and c have the normal distribution of a linear model."""
    period, n, walkers = 0.125, 25, 400_000
    gap = np.zeros(n)
    gap[11] = 0.4
    data = make_data(0.05 + 0.05 * rng.random(n), 0.001 * (1 + rng.random(n)), period, gap)
    t = np.arange(n) * period + np.cumsum(np.maximum(gap, 0))
    b, d, sd, rate, r, mean, spread = -0.01, -0.8, 0.004, 1.3, 1.1, 0.02, 0.3
    cov = sd**2 * np.exp(-rate * np.abs(t[:, None] - t[None, :])) + np.diag((r * data.standard_error) ** 2)
    basis = np.exp(np.outer(t, [b, d]))
    marginal = multivariate_normal(basis @ [mean, mean], cov + spread**2 * basis @ basis.T)
    theta = tuple(np.full(2, x) for x in (b, d, sd, rate, r))
    got = trial_log_likelihood(data, theta, (mean, spread))
    np.testing.assert_allclose(got, marginal.logpdf(data.amplitude), rtol=1e-9)

    precision = basis.T @ np.linalg.solve(cov, basis) + np.eye(2) / spread**2
    right = basis.T @ np.linalg.solve(cov, data.amplitude) + mean / spread**2
    centre = np.linalg.solve(precision, right)
    np.testing.assert_allclose(
        trial_amplitudes(data, theta, (mean, spread), np.zeros((2, 2))), centre[:, None] * [1, 1]
    )
    theta = tuple(np.full(walkers, x) for x in (b, d, sd, rate, r))
    drawn = np.stack(trial_amplitudes(data, theta, (mean, spread), rng.standard_normal((walkers, 2))))
    want = np.linalg.inv(precision)
    np.testing.assert_allclose(np.cov(drawn), want, rtol=0.015)
    assert np.abs(drawn.mean(axis=1) - centre).max() < 5 * np.sqrt(want.max() / walkers)


@pytest.mark.parametrize(("b", "d", "se"), [(0.3, 0.3 - 1e-7, 1e-4), (-0.2, -0.2001, 1e-7), (2.0, -3.0, 1e-6)])
def test_trial_likelihood_where_its_terms_can_hardly_be_told_apart(b, d, se):
    """Rates that are nearly one, a reading without noise, a term that explodes: against extended precision."""
    period, n, sd, rate, spread = 0.125, 12, 0.01, 0.5, 0.3
    t = (np.arange(n) * period).astype(np.longdouble)
    y = 0.02 + 0.05 * t + 1e-3 * np.cos(9 * t)
    basis = np.exp(t[:, None] * np.array([b, d], dtype=np.longdouble))
    cov = sd**2 * np.exp(-rate * np.abs(t[:, None] - t)) + spread**2 * basis @ basis.T
    cov += np.eye(n, dtype=np.longdouble) * np.longdouble(se) ** 2
    want = -0.5 * n * np.log(2 * np.pi)
    for k in range(n):  # eliminate one cycle after the other: LAPACK has no extended precision
        want -= 0.5 * (y[k] ** 2 / cov[k, k] + np.log(cov[k, k]))
        gain = cov[k + 1 :, k] / cov[k, k]
        y[k + 1 :] -= gain * y[k]
        cov[k + 1 :, k + 1 :] -= np.outer(gain, cov[k, k + 1 :])
    data = make_data(0.02 + 0.05 * t + 1e-3 * np.cos(9 * t), se, period)
    got = trial_log_likelihood(data, tuple(np.array([x]) for x in (b, d, sd, rate, 1.0)), (0.0, spread))
    assert got[0] == pytest.approx(float(want), abs=1e-4)


@pytest.mark.parametrize("n", [-1.0, 0.0, 0.7, 1.0, 2.0])
@pytest.mark.parametrize("departure", [0.0, 0.05, 0.5])
def test_fast_filter_with_departures_is_the_plain_filter(rng, n, departure):
    data, walkers = three_records(rng, 0.03), walkers_about(rng, 0.03, 21)
    wind = Wind(0.001 * np.exp(0.3 * rng.standard_normal(21)), 0.2, 0.001, departure * (0.5 + rng.random(21)))
    plain = pointwise_log_likelihood(*step_by_step(data, *walkers, wind, n=n, initial_sd=0.5)).sum(axis=0)
    fast = log_likelihood(data, *walkers, wind, n=n, initial_sd=0.5)
    kept = pointwise_log_likelihood(*innovations(data, *walkers, wind, n=n, initial_sd=0.5)).sum(axis=0)
    np.testing.assert_allclose(kept, fast, rtol=1e-9)
    np.testing.assert_allclose(fast, plain, rtol=1e-8, atol=1e-6)


def followed(law, starts, period, count, se, rng):
    """Amplitudes of a drift, cycle means by small steps, with sensor noise; one record a start."""
    parts = []
    for start in starts:
        a, means = start, []
        for _ in range(count):
            path = []
            for _ in range(50):
                a += law(a) * period / 50
                path.append(a)
            means.append(np.mean(path))
        parts.append(np.array(means) + se * rng.standard_normal(count))
    y = np.concatenate(parts)
    gap = np.zeros(y.size)
    gap[::count] = -1.0
    return make_data(y, se, period, gap)


@pytest.mark.parametrize(("true", "assumed"), [(-1.0, 2.0), (2.0, -1.0), (0.0, 1.0)])
def test_a_wrong_law_and_its_departure_are_the_drift_that_was(rng, true, assumed):
    a_star, lam, se = 0.05, 0.5, 5e-5

    def drift(a, n):
        return -lam * a * np.log(a / a_star) if n == 0 else lam / n * a * (1 - (a / a_star) ** n)

    data = followed(lambda a: drift(a, true), (0.15 * a_star, 2.2 * a_star), 0.1, 90, se, rng)
    one = [np.array([x]) for x in (a_star, lam, 1e-5, 1.0)]
    forgetful = Wind(gust_rate=20.0, departure=1.0)
    mean, cov = statics(data, *one, forgetful, n=assumed)
    theta = np.r_[0.0, mean[0]]
    for ratio in (0.25, 0.4, 0.6, 0.8, 1.2, 1.5, 1.9):
        a = ratio * a_star
        got = drift(a, assumed) * factor_at(a, a_star, theta)
        assert got == pytest.approx(drift(a, true), rel=0.12), ratio
    assert np.all(np.linalg.eigvalsh(cov[0]) > 0.0)
    wrong = log_likelihood(data, *one, n=assumed)[0]
    assert log_likelihood(data, *one, Wind(departure=0.5), n=assumed)[0] > wrong + 100.0


def test_departures_of_arrays_are_those_of_one_amplitude(rng):
    theta, ratio = rng.standard_normal((40, COLUMNS)), np.exp(rng.normal(0.0, 1.0, 40))
    one = [factor_at(0.05 * r, 0.05, np.r_[0.0, row]) for r, row in zip(ratio, theta, strict=True)]
    np.testing.assert_allclose(relative_drift(ratio, theta), one, rtol=1e-12)
    np.testing.assert_array_equal(relative_drift(np.ones(40), theta), 1.0)


def test_a_wake_that_remembers_passes_the_stable_amplitude_and_comes_back(rng):
    """A decay that undershoots: no drift of the amplitude alone does, and a* is where it ends."""
    a_star, lam, se, rate = 0.05, 0.5, 5e-5, 0.3
    wake = {"h": -0.6}

    def remembering(a):
        wake["h"] -= rate * wake["h"] * 0.1 / 50
        return lam * (a_star * (1.0 + wake["h"]) - a)

    data = followed(remembering, (2.2 * a_star,), 0.1, 250, se, rng)
    assert data.amplitude.min() < 0.97 * a_star
    levels = a_star * np.linspace(0.8, 1.2, 41)
    others = [np.full(41, x) for x in (lam, 1e-5, 1.0)]
    found = log_likelihood(data, levels, *others, Wind(gust_rate=rate, departure=0.8))
    assert levels[np.argmax(found)] == pytest.approx(a_star, rel=0.03)
    assert found.max() > log_likelihood(data, levels, *others, Wind(gust_rate=20.0, departure=0.8)).max() + 20.0


def test_where_the_law_holds_the_departure_is_nothing(rng):
    data = followed(lambda a: 0.5 * (0.05 - a), (0.005, 0.11), 0.1, 90, 5e-5, rng)
    one = [np.array([x]) for x in (0.05, 0.5, 1e-5, 1.0)]
    mean, cov = statics(data, *one, Wind(departure=0.3))
    assert np.all(np.abs(mean[0]) < 4.0 * np.sqrt(np.diag(cov[0])) + 0.02)
    without = log_likelihood(data, *one)[0]
    assert without > log_likelihood(data, *one, Wind(departure=0.3))[0]


@pytest.mark.parametrize("n", [-1.0, 0.0, 2.0])
def test_no_parameter_however_absurd_explains_the_records_better_than_the_noise_of_the_sensor(rng, n):
    """Far out the filter loses its way, and a variance that comes out negative must not pass for a good fit."""
    period, se, walkers = 0.79, 3e-5, 20_000
    t = np.arange(220) * period
    decay, growth = (0.02 * (1.0 + x * np.exp(-0.09 * t)) for x in (1.5, -0.9))
    gap = np.zeros(440)
    gap[220] = -1.0
    data = make_data(np.concatenate([decay, growth]) + se * rng.standard_normal(440), se, period, gap)
    a_star, lam = (np.exp(rng.uniform(np.log(low), np.log(high), walkers)) for low, high in ((2e-3, 2.0), (1e-3, 5.0)))
    q = np.exp(rng.uniform(np.log(1e-4), np.log(0.05), walkers)) * a_star * np.sqrt(2 * lam)
    wind = Wind(0.01 * rng.random(walkers) * a_star, lam * rng.random(walkers), 0.01 * rng.random(walkers) * a_star,
                0.3 * rng.random(walkers))  # fmt: skip
    r = np.full(walkers, 0.8)
    most = -0.5 * data.size * np.log(2 * np.pi * (0.8 * se) ** 2) + 5.0
    found = log_likelihood(data, a_star, lam, q, r, wind, n=n)
    assert np.nanmax(found) < most
    few = np.flatnonzero(~(found > -1e9))[:200]
    plain = pointwise_log_likelihood(
        *step_by_step(data, *(x[few] for x in (a_star, lam, q, r)), Wind(*(x[few] for x in wind.sizes)), n=n)
    ).sum(axis=0)
    assert np.nanmax(plain, initial=-np.inf) < most
