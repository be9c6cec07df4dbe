"""The sampled posteriors: constraints, coordinates, and whether their bands cover."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from scruton.campaign.schema import Motion
from scruton.dynamics.cycles import EnvelopeData
from scruton.dynamics.departure import COLUMNS, ROUGH
from scruton.dynamics.likelihood import Wind, innovations
from scruton.envelope import Cycles
from scruton.infer.cards import load_card
from scruton.infer.fit import steady_amplitude
from scruton.infer.free_runs import _run, free_runs
from scruton.infer.models import WIND, SteadyAmplitude, StillAirPosterior, WindPosterior, _root
from scruton.infer.steady import SteadyVerdict
from scruton.stats.priors import Prior
from scruton.stats.sampler import sample

CARD = load_card()
PERIOD = 0.125
OMEGA0 = 2 * np.pi / PERIOD


def simulate(rng, a_star, lam, q, start, cycles, se, sub=40, gust=0.0, gust_rate=1.0):
    """Cycle means of the amplitude equation (n = -1) by small steps, each exact for the gust at its start."""
    h = PERIOD / sub
    phi = np.exp(-lam * h)
    kick = q * np.sqrt((1 - phi**2) / (2 * lam)) if lam else q * np.sqrt(h)
    keep = np.exp(-gust_rate * h)
    level = a_star + gust * rng.standard_normal() if gust else a_star
    a, means = start, np.empty(cycles)
    for k in range(cycles):
        values = np.empty(sub + 1)
        values[0] = a
        for i in range(sub):
            values[i + 1] = level + (values[i] - level) * phi + kick * rng.standard_normal()
            if gust:
                level = a_star + (level - a_star) * keep + gust * np.sqrt(1 - keep**2) * rng.standard_normal()
        a = values[-1]
        means[k] = np.trapezoid(values, dx=1 / sub)
    return means + se * rng.standard_normal(cycles)


def envelope(records, se):
    n = sum(map(len, records))
    gap = np.zeros(n)
    gap[np.cumsum([0, *[len(r) for r in records[:-1]]])] = -1.0
    return EnvelopeData(
        np.concatenate(records),
        np.full(n, se),
        gap,
        np.full(n, PERIOD),
        np.concatenate([np.arange(len(r)) * PERIOD for r in records]),
        np.concatenate([np.full(len(r), f"r{i}") for i, r in enumerate(records)]),
    )


def wind(data, damping=0.004, n=-1.0, steady=()):
    priors = tuple(CARD.prior(name, Motion.HEAVING) for name in WIND[:-1])
    return WindPosterior(
        (*priors, Prior("damping_ratio", "lognormal", damping, 0.03, "-", "-")), data, steady, OMEGA0, n
    )


def test_a_section_may_build_up_by_itself_under_the_papers_law():
    """Y1 of either sign: what relaxes more slowly than omega0 xi_s does not get another damping than its own."""
    posterior = wind(envelope([np.full(20, 0.05)], 1e-3))
    u = posterior.prior_draws(np.random.default_rng(0), 4000)
    log = posterior.named(u)
    below = log["relaxation_ratio"] < log["damping_ratio"]
    assert 0.02 < below.mean() < 0.6
    assert np.isfinite(posterior.log_prob(u[below])).all()


def test_log_prob_is_prior_plus_likelihood_and_never_nan():
    rng = np.random.default_rng(2)
    posterior = wind(envelope([simulate(rng, 0.05, 0.7, 0.001, 0.1, 30, 2e-4)], 2e-4))
    u = posterior.prior_draws(rng, 50)
    want = posterior.log_prior_terms(u).sum(axis=1) + posterior.log_likelihood(u)
    np.testing.assert_allclose(posterior.log_prob(u), want, rtol=1e-10)
    wild = rng.normal(0, 300, (200, len(WIND)))
    assert not np.isnan(posterior.log_prob(wild)).any()


def test_pointwise_terms_add_up():
    rng = np.random.default_rng(3)
    posterior = wind(envelope([simulate(rng, 0.05, 0.7, 0.001, s, 30, 2e-4) for s in (0.1, 0.005)], 2e-4))
    u = posterior.prior_draws(rng, 20)
    np.testing.assert_allclose(posterior.pointwise(u).sum(axis=1), posterior.log_likelihood(u), rtol=1e-9)


def test_steady_records_alone_give_the_amplitude_and_leave_the_rate_to_its_prior():
    posterior = wind(
        EnvelopeData.join({}), steady=(SteadyAmplitude(0.08, 0.001, 20.0), SteadyAmplitude(0.082, 0.001, 20.0))
    )
    samples = sample(posterior, CARD.sampler, np.random.SeedSequence(1))
    assert samples.convergence.converged
    natural = posterior.natural(samples.chain)
    assert np.median(natural["stable_amplitude"]) == pytest.approx(0.081, abs=2e-4)
    prior = posterior.prior_draws(np.random.default_rng(0), 20000)[:, 1]
    assert samples.chain[..., 1].std() == pytest.approx(prior.std(), rel=0.08)


def lock_in_amplitudes(rng, cycles, gust, gust_rate, set_point, scatter, lam=0.7):
    """Cycle by cycle about a stable amplitude of one: a gust that the amplitude follows, turbulence, a set-point."""

    def noise(sd, rate):
        keep = np.exp(-rate * PERIOD)
        kicks = sd * np.sqrt(1 - keep**2) * rng.standard_normal(cycles + burn)
        kicks[0] = sd * rng.standard_normal()
        return lfilter([1.0], [1.0, -keep], kicks)

    burn = int(10 / (lam * PERIOD))
    forget = np.exp(-lam * PERIOD)
    followed = lfilter([1 - forget], [1.0, -forget], noise(gust, gust_rate))
    return (1.0 + followed + noise(scatter, lam))[burn:] + set_point * rng.standard_normal()


@pytest.mark.parametrize(("length", "gust_time"), [(10, 10.0), (10, 1.0), (60, 10.0), (60, 1.0)])
def test_a_lock_in_mean_strays_as_its_variance_says(length, gust_time):
    """Lengths and times in relaxation times: gusts within a record count once, those that outlast it count whole."""
    rng, lam, count = np.random.default_rng(9), 0.7, 300
    wind_of = Wind(0.02, lam / gust_time, 0.01)
    cycles, z = int(length / (lam * PERIOD)), np.empty(count)
    for i in range(count):
        a = lock_in_amplitudes(rng, cycles, 0.02, lam / gust_time, 0.01, 0.01)
        nothing = np.zeros(cycles)
        record = Cycles(PERIOD * np.arange(cycles), a, *[nothing] * 4, 1.0 / PERIOD, 0.0)
        level = steady_amplitude(SteadyVerdict("r", (), record))
        z[i] = (level.mean - 1.0) / np.sqrt(level.variance(wind_of))
    assert np.sqrt(np.mean(z**2)) == pytest.approx(1.0, abs=0.2)


def test_a_lock_in_mean_does_not_know_the_stable_amplitude_better_than_its_set_point():
    posterior = wind(EnvelopeData.join({}), steady=(SteadyAmplitude(0.05, 0.0003, 60.0),))
    u = posterior.prior_draws(np.random.default_rng(0), 1).repeat(3, axis=0)
    log = posterior.named(u)
    log["stable_amplitude"], log["gust_scatter"] = np.log(0.049), np.log(1e-4)
    log["set_point_scatter"] = np.log([1e-4, 0.01, 0.02])
    variance = (0.049 * np.array([1e-4, 0.01, 0.02])) ** 2 + 0.0003**2
    want = -0.5 * (0.001**2 / variance + np.log(variance))
    np.testing.assert_allclose(posterior.log_likelihood(u), want, rtol=1e-4)


def test_still_air_recovers_the_damping_of_two_plucks():
    rng = np.random.default_rng(4)
    xi = 0.006
    plucks = [simulate(rng, 0.0, xi * OMEGA0, 2e-5, s, 80, 1e-4) for s in (0.06, 0.09)]
    priors = (
        replace(CARD.prior("structural_damping", Motion.HEAVING), name="damping_ratio"),
        CARD.prior("still_air_scatter", Motion.HEAVING),
        CARD.prior("noise_factor", Motion.HEAVING),
    )
    posterior = StillAirPosterior(priors, envelope(plucks, 1e-4), OMEGA0, 0.09)
    samples = sample(posterior, CARD.sampler, np.random.SeedSequence(1))
    assert samples.convergence.converged
    draws = np.exp(samples.chain[..., 0])
    low, high = np.quantile(draws, [0.005, 0.995])
    assert low < xi < high
    assert draws.std() / xi < 0.02


@pytest.mark.parametrize(("n", "start"), [(-1.0, 0.1), (2.0, 0.052)])
def test_free_runs_reproduce_the_data(n, start):
    """A replicate has the scatter of the data; the mean curve runs through it (near a_star all laws are one)."""
    rng = np.random.default_rng(6)
    y = simulate(rng, 0.05, 0.7, 0.0012, start, 200, 2e-4)
    posterior = wind(envelope([y], 2e-4), n=n)
    samples = sample(posterior, CARD.sampler, np.random.SeedSequence(2))
    mean, replicate = free_runs(posterior, samples.chain, rng)
    late = slice(80, None)
    assert replicate[:, late].std(axis=1).mean() == pytest.approx(y[late].std(), rel=0.3)
    assert np.median(mean[:, -1]) == pytest.approx(y[late].mean(), rel=0.01)
    inside = (np.quantile(replicate, 0.05, axis=0) <= y) & (y <= np.quantile(replicate, 0.95, axis=0))
    assert 0.75 < inside.mean() <= 1.0


def test_kernels_are_compiled_for_rows_alone_whether_the_exponent_is_free_or_not():
    u = np.random.default_rng(0).standard_normal((5, len(WIND) + 1))
    for n in (-1.0, None):
        found = replace(wind(envelope([np.full(20, 0.05)], 1e-3)), n=n).exponents(u[:, : len(WIND) + (n is None)])
        assert found.shape == (5,)
        assert found.flags.c_contiguous


def replicated(rng, y, se, wind_of, theta, n=-1.0, a_star=0.05, lam=0.7, q=2e-4):
    """Free runs of a record from its first amplitude on, one for each row of columns theta, (R, N)."""
    runs, data = len(theta), envelope([y], se)
    size = (runs, data.size)
    walkers = (np.full(runs, value) for value in (a_star, lam, q, 1.0, *wind_of.sizes))
    theta = np.concatenate([np.zeros((runs, 1)), theta], axis=1)
    mean, replicate = np.empty(size), np.empty(size)
    _run(
        data.amplitude, data.standard_error, data.gap, data.period, *walkers, theta, np.full(runs, n), 1.0,
        rng.standard_normal(size), rng.standard_normal((6, *size)), mean, replicate,
    )  # fmt: skip
    return replicate


@pytest.mark.parametrize(("n", "start"), [(-1.0, 2.0), (-1.0, 1.0), (2.0, 0.4)])
def test_replicates_scatter_as_the_filter_expects(n, start):
    """Mean and covariance of the second and third cycle given the first, the departure integrated over its prior."""
    rng, se, wind_of = np.random.default_rng(10), 1e-4, Wind(0.0005, 0.3, 0.0005, 0.3)
    first = start * 0.05

    def ahead(second):
        plain = (np.array([value]) for value in (0.05, 0.7, 2e-4, 1.0))
        y = np.array([first, second, 0.0])
        innovation, variance = innovations(envelope([y], se), *plain, wind_of, n=n)
        return (y - innovation[:, 0])[1:], variance[1:, 0]

    (second, _), (variance, _) = ahead(first)
    step = np.sqrt(variance)
    (_, low), (_, high) = (ahead(second + by)[0] for by in (-step, step))
    slope = (high - low) / (2.0 * step)
    (_, third), (_, beyond) = ahead(second)
    theta = 0.3 * rng.standard_normal((20_000, COLUMNS))
    found = replicated(rng, np.full(3, first), se, wind_of, theta, n)[:, 1:]
    np.testing.assert_allclose(found.mean(axis=0), [second, third], atol=0.1 * step)
    want = [variance, slope * variance, beyond + slope**2 * variance]
    np.testing.assert_allclose(np.cov(found.T)[np.triu_indices(2)], want, rtol=0.1)


def test_replicates_bend_about_the_ramps_of_the_departure():
    """Far from the stable amplitude: in the half cycle after the first amplitude, and in what is seen of the next."""
    rng, far, scale = np.random.default_rng(11), 20.0, 0.5
    y = np.full(2, far * 0.05)
    found = replicated(rng, y, 1e-4, Wind(0.0, 1.0, 0.0, scale), np.zeros((20_000, COLUMNS)))
    moved = (far - 1.0) * 0.05 * -np.expm1(-0.7 * PERIOD)
    assert found[:, 1].std() == pytest.approx(ROUGH * scale * np.sqrt(2.0) * 0.5 * moved, rel=0.1)


@pytest.mark.slow
def test_intervals_cover_at_their_nominal_rate():
    """90 % intervals over 200 pairs of records with 1.5 % turbulence, gusts and set-points as their priors have them.

    A likelihood without any of them must fail.
    """
    rng = np.random.default_rng(8)
    hits, narrow = np.zeros(2), np.zeros(2)
    cases = 200
    for case in range(cases):
        a_star, lam = 0.05 * np.exp(0.3 * rng.standard_normal()), 0.6 * np.exp(0.4 * rng.standard_normal())
        q = 0.015 * a_star * np.sqrt(2 * lam)
        gust, time, set_point = (np.exp(CARD.prior(name, Motion.HEAVING).draw(rng, 1)[0]) for name in WIND[4:7])
        records = []
        for s in (2.0, 0.15):
            level = a_star * (1 + set_point * rng.standard_normal())
            records.append(simulate(rng, level, lam, q, s * a_star, 60, 2e-4, gust=gust * a_star, gust_rate=lam / time))
        data = envelope(records, 2e-4)
        for count, fixed in ((hits, False), (narrow, True)):
            posterior = wind(data)
            if fixed:  # independent errors: no turbulence in the model
                priors = [
                    replace(prior, first=1e-4, second=1e-3) if prior.name.endswith("_scatter") else prior
                    for prior in posterior.priors
                ]
                posterior = replace(posterior, priors=tuple(priors))
            chain = sample(posterior, CARD.sampler, np.random.SeedSequence(case)).chain
            for i, truth in enumerate((np.log(a_star), np.log(lam / OMEGA0))):
                low, high = np.quantile(chain[..., i], [0.05, 0.95])
                count[i] += low < truth < high
    error = 3 * np.sqrt(0.9 * 0.1 / cases)
    assert np.abs(hits / cases - 0.9).max() < error, hits / cases
    assert (narrow / cases).min() < 0.75, "independent errors must be seen to fail"


def test_a_covariance_that_rounding_spoiled_has_a_root():
    """After all sampling was done it ended a fit: one of hundreds whose smallest eigenvalue rounds below zero."""
    good = np.diag([1.0, 2.0])
    bad = np.array([[1.0, 1.0 + 1e-7], [1.0 + 1e-7, 1.0]])
    root = _root(np.stack([good, bad, np.full((2, 2), np.nan)]))
    np.testing.assert_allclose(root @ np.swapaxes(root, 1, 2), [good, bad, np.zeros((2, 2))], atol=1e-6)
    np.testing.assert_array_equal(_root(good[None]), np.linalg.cholesky(good[None] + 1e-12 * np.eye(2)))
