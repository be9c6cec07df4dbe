"""Evidence and the weights of laws, against integrals that are known."""

from dataclasses import dataclass
from functools import cached_property
from math import log

import numpy as np
import pytest
from scipy import stats

from scruton.campaign.schema import Motion
from scruton.dynamics.cycles import EnvelopeData
from scruton.infer.cards import load_card
from scruton.infer.models import WIND, WindPosterior
from scruton.stats.convergence import SamplerSettings
from scruton.stats.evidence import (
    _tempered,
    bridge,
    evidence_by_importance,
    log_evidence,
    log_prior_mass,
    widened,
)
from scruton.stats.optimum import find_optimum
from scruton.stats.posterior import Posterior
from scruton.stats.priors import Prior
from scruton.stats.sampler import sample
from scruton.stats.samples import Samples
from scruton.stats.stacking import posterior_weights, stacking_weights
from scruton.stats.student_t import StudentT, fit_student_t

SEEDS = 40


@dataclass(frozen=True, eq=False)
class Conjugate(Posterior):
    """y ~ N(B u, S) with u ~ N(m, diag(s^2)): the posterior is normal and the evidence is N(y; B m, B s^2 B' + S)."""

    d: int
    seed: int = 0

    @cached_property
    def priors(self):
        rng = np.random.default_rng([self.seed, 1])
        return tuple(
            Prior(f"x{i}", "normal", float(rng.normal(0, 2)), float(rng.uniform(0.5, 3))) for i in range(self.d)
        )

    @cached_property
    def parts(self):
        rng = np.random.default_rng([self.seed, 2])
        b = rng.standard_normal((self.d + 2, self.d))
        noise = np.diag(rng.uniform(0.05, 0.5, self.d + 2))
        return b, noise, b @ rng.normal(0, 2, self.d) + np.sqrt(np.diag(noise)) * rng.standard_normal(self.d + 2)

    def log_likelihood(self, u):
        b, noise, y = self.parts
        variance = np.diag(noise)
        return -0.5 * (np.square(y - u @ b.T) @ (1 / variance) + np.log(2 * np.pi * variance).sum())

    @cached_property
    def exact(self):
        b, noise, y = self.parts
        m, s = (np.array([getattr(one, key) for one in self.priors]) for key in ("location", "scale"))
        covariance = np.linalg.inv(np.diag(s**-2) + b.T @ np.linalg.inv(noise) @ b)
        centre = covariance @ (m / s**2 + b.T @ np.linalg.solve(noise, y))
        log_z = stats.multivariate_normal(b @ m, (b * s**2) @ b.T + noise).logpdf(y)
        return float(log_z), centre, np.linalg.cholesky(covariance)


@dataclass(frozen=True, eq=False)
class HalfSpace(Conjugate):
    """The same, cut through the middle of the posterior: half of it is left, and a known part of the prior."""

    @cached_property
    def bound(self):
        return self.exact[1][0]

    def inside(self, u):
        return u[:, 0] > self.bound

    @cached_property
    def log_mass(self):
        return float(stats.norm.logsf(self.bound, self.priors[0].location, self.priors[0].scale))

    @cached_property
    def exact_cut(self):
        return self.exact[0] + log(0.5) - self.log_mass


@dataclass(frozen=True, eq=False)
class Impossible(Conjugate):
    def inside(self, u):
        return np.zeros(len(u), dtype=bool)


@dataclass(frozen=True, eq=False)
class Banana(Posterior):
    """A curved posterior that no Student-t fits."""

    priors = (Prior("x", "normal", 0.0, 1.0), Prior("y", "normal", 1.0, 3.0))

    def log_likelihood(self, u):
        return -0.5 * ((u[:, 1] - u[:, 0] ** 2) / 0.3) ** 2


def samples_of(chain, posterior):
    """What the sampler returns, of draws (chains, draws, d) made otherwise; four ensembles."""
    log_prob = posterior.log_prob(chain.reshape(-1, chain.shape[-1])).reshape(chain.shape[:2])
    return Samples(posterior.names, chain, log_prob, np.arange(len(chain)) * 4 // len(chain), None)


def autocorrelated(rng, chains, draws, d, phi):
    """Unit normal AR(1) chains."""
    z = rng.standard_normal((chains, draws, d))
    for k in range(1, draws):
        z[:, k] = phi * z[:, k - 1] + np.sqrt(1 - phi**2) * z[:, k]
    return z


def conjugate_samples(posterior, rng, chains=64, draws=32, phi=0.0):
    _, centre, factor = posterior.exact
    return samples_of(centre + autocorrelated(rng, chains, draws, posterior.d, phi) @ factor.T, posterior)


def z_scores(evidences, exact):
    return np.array([(one.log_z - exact) / one.error for one in evidences])


def honest(z):
    """Mean 0 and sd 1 of so many z-scores, within what chance allows."""
    return abs(z.mean()) < 3.5 / np.sqrt(len(z)) * max(z.std(), 1.0) and 0.6 < z.std() < 1.6


@pytest.mark.parametrize("phi", [0.0, 0.9])
@pytest.mark.parametrize("d", [2, 8, 20])
def test_bridge_gives_a_known_evidence_with_an_honest_error(d, phi):
    posterior = Conjugate(d)
    found = []
    for i in range(SEEDS):
        samples = conjugate_samples(posterior, np.random.default_rng(i), phi=phi)
        found.append(log_evidence(posterior, samples, np.random.SeedSequence(i), 1024))
    z = z_scores(found, posterior.exact[0])
    assert honest(z), z
    assert max(one.error for one in found) < 0.1
    assert all(one.log_prior_mass == 0.0 and one.reliable for one in found)


@pytest.mark.parametrize("d", [2, 8, 20])
def test_importance_gives_a_known_evidence_with_an_honest_error(d):
    posterior = Conjugate(d)
    found = [evidence_by_importance(posterior, np.random.SeedSequence(i), draws=1024) for i in range(SEEDS)]
    z = z_scores(found, posterior.exact[0])
    assert honest(z), z
    assert max(one.error for one in found) < 0.1
    assert all(one.reliable for one in found)


@pytest.mark.parametrize("method", ["bridge", "importance"])
def test_the_mass_of_the_constraint_is_allowed_for(method):
    posterior = HalfSpace(3)
    _, centre, factor = posterior.exact
    found = []
    for i in range(SEEDS):
        if method == "importance":
            found.append(evidence_by_importance(posterior, np.random.SeedSequence(i), draws=1024))
            continue
        draws = centre + np.random.default_rng(i).standard_normal((8192, 3)) @ factor.T
        kept = draws[posterior.inside(draws)][:2048].reshape(64, 32, 3)
        found.append(log_evidence(posterior, samples_of(kept, posterior), np.random.SeedSequence(i), 2048))
    z = z_scores(found, posterior.exact_cut)
    assert honest(z), z
    assert all(one.reliable for one in found)
    assert found[0].log_prior_mass == pytest.approx(posterior.log_mass, abs=0.04)
    uncut = z_scores(found, posterior.exact_cut + posterior.log_mass)
    assert not honest(uncut), "without the mass it is another number, and this test would see it"


def test_an_optimum_that_leans_on_the_constraint_still_starts_wide_enough():
    """The curvature there is the wall's: a sliver in which all weights look well, however wrong the evidence."""
    posterior = HalfSpace(3)
    _, _, factor = posterior.exact
    slivers = 0
    for i in range(12):
        laplace = find_optimum(posterior, np.random.default_rng(i))
        sd, wide = (
            np.linalg.svd(np.linalg.solve(factor, one.cholesky), compute_uv=False)[-1]
            for one in (laplace, widened(posterior, laplace))
        )
        slivers += sd < 0.01
        assert wide > 0.3
    assert slivers >= 4, "the case that this is about"


def test_widening_an_optimum_that_leans_on_nothing_changes_little():
    posterior = Conjugate(8)
    laplace = find_optimum(posterior, np.random.default_rng(0))
    ratio = np.linalg.svd(np.linalg.solve(laplace.cholesky, widened(posterior, laplace).cholesky), compute_uv=False)
    assert (ratio > 0.999).all()
    assert (ratio < 1.3).all()


def test_a_proposal_narrower_than_the_posterior_is_found_out(monkeypatch):
    """The weights alone may pass: enough of them, of finite variance, and an evidence that is far too low."""
    posterior = HalfSpace(3)
    _, centre, factor = posterior.exact
    narrow = StudentT(centre, factor @ np.diag([0.25, 1.0, 1.0]), 5.0)
    monkeypatch.setattr("scruton.stats.evidence.MORE_ROUNDS", 1)
    found = [evidence_by_importance(posterior, np.random.SeedSequence(i), narrow, 1024, 1) for i in range(100)]
    z = np.abs(z_scores(found, posterior.exact_cut))
    fooled = [one.effective_size >= 100 and one.pareto_k <= 0.7 for one in found]
    assert (z[fooled] > 4).any(), "the case that this is about"
    assert not any(one.reliable for one, off in zip(found, z, strict=True) if off > 4)


def test_prior_mass_is_one_where_nothing_is_cut_and_honest_where_something_is():
    assert log_prior_mass(Conjugate(3), np.random.default_rng(0)) == (0.0, 0.0)
    found = np.array([log_prior_mass(HalfSpace(2), np.random.default_rng(i)) for i in range(SEEDS)])
    assert honest((found[:, 0] - HalfSpace(2).log_mass) / found[:, 1])
    assert (found[:, 1] < 0.011).all()
    with pytest.raises(ValueError, match="none of 262144 prior draws lies within the model's constraint"):
        log_prior_mass(Impossible(2), np.random.default_rng(0))


def test_a_curved_posterior_against_quadrature():
    posterior = Banana()
    x, y = np.linspace(-6, 6, 1201), np.linspace(-4, 20, 4801)
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    density = np.exp(posterior.log_prob(grid)).reshape(len(x), len(y))
    exact = log(np.trapezoid(np.trapezoid(density, y, axis=1), x))
    samples = sample(posterior, SamplerSettings(max_rhat=1.02), np.random.SeedSequence(5))
    assert samples.convergence.converged
    for found in (
        log_evidence(posterior, samples, np.random.SeedSequence(1)),
        evidence_by_importance(posterior, np.random.SeedSequence(1), draws=8192),
    ):
        assert abs(found.log_z - exact) < 4 * found.error
        assert found.error < 0.06
        assert found.overlap < 0.7, "no Student-t fits it"
    assert found.pareto_k > 0.7
    assert not found.reliable, "and importance sampling says so"


def test_draws_that_fitted_the_proposal_give_a_biased_evidence():
    """Why the draws are divided: the same 60 draws twice look too much like their proposal."""
    posterior = Conjugate(8)
    twice, divided = [], []
    for i in range(SEEDS):
        samples = conjugate_samples(posterior, np.random.default_rng(i), chains=20, draws=6)
        half = samples.chain[:10].reshape(-1, 8)
        proposal = fit_student_t(half, np.full(len(half), 1 / len(half)))
        new = proposal.draw(np.random.RandomState(i), 2048)
        at_new = posterior.log_prob(new) - proposal.log_density(new)
        at_half = (posterior.log_prob(half) - proposal.log_density(half)).reshape(10, 6)
        twice.append(bridge(at_half, at_new))
        divided.append(log_evidence(posterior, samples, np.random.SeedSequence(i)))
    assert honest(z_scores(divided, posterior.exact[0]))
    biased = z_scores(twice, posterior.exact[0])
    assert not honest(biased)
    assert abs(biased.mean()) > 0.7


def test_correlated_draws_counted_as_independent_give_an_error_too_small():
    posterior = Conjugate(8)
    naive, aware = [], []
    _, centre, factor = posterior.exact
    proposal = StudentT(centre + 0.8 * factor.sum(axis=1), factor, 5.0)
    for i in range(SEEDS):
        samples = conjugate_samples(posterior, np.random.default_rng(i), chains=16, draws=128, phi=0.95)
        new = proposal.draw(np.random.RandomState(i), 8192)
        at_new = posterior.log_prob(new) - proposal.log_density(new)
        at_draws = samples.log_prob - proposal.log_density(samples.chain.reshape(-1, 8)).reshape(16, 128)
        aware.append(bridge(at_draws, at_new))
        naive.append(bridge(at_draws.reshape(-1, 1), at_new))
    assert honest(z_scores(aware, posterior.exact[0]))
    assert z_scores(naive, posterior.exact[0]).std() > 1.6
    assert max(one.effective_size for one in aware) < 600 < naive[0].effective_size == 16 * 128


def test_draws_of_a_proposal_that_lie_absurdly_far_out_move_no_bridge():
    """A filter that all but loses its way gives a density that is finite, and of no size that a root is sought over."""
    rng = np.random.default_rng(5)
    at_draws, at_new = 3.0 + 0.3 * rng.standard_normal((4, 500)), 3.0 + 0.3 * rng.standard_normal(2000)
    plain = bridge(at_draws, np.append(at_new, [-np.inf, -np.inf]))
    for far in (-1e6, -1e250):
        found = bridge(at_draws, np.append(at_new, [far, far]))
        assert (found.log_z, found.error, found.overlap) == (plain.log_z, plain.error, plain.overlap)


def test_a_bridge_with_no_distance_is_exact():
    """Where posterior and proposal are proportional every term is the same: the constant, without error."""
    found = bridge(np.full((8, 50), 3.25), np.full(300, 3.25))
    assert found.log_z == pytest.approx(3.25, abs=1e-8)
    assert found.error == pytest.approx(0.0, abs=1e-12)
    assert found.overlap == pytest.approx(1.0)


@pytest.mark.parametrize("shift", [-1e5, 0.0, 3e4])
def test_a_large_constant_changes_nothing_else(shift):
    rng = np.random.default_rng(1)
    at_draws, at_new = rng.normal(0.5, 1, (20, 40)), rng.normal(-0.5, 1, 900)
    at_new[:50] = -np.inf
    here, there = bridge(at_draws, at_new), bridge(at_draws + shift, at_new + shift)
    assert there.log_z - shift == pytest.approx(here.log_z, abs=1e-6)
    assert there.error == pytest.approx(here.error, rel=1e-5)


def test_a_poor_start_takes_more_rounds_and_a_hopeless_one_is_not_called_reliable():
    posterior = Conjugate(8)
    log_z, centre, factor = posterior.exact
    far = StudentT(centre + 12 * factor.sum(axis=1), 0.5 * factor, 10.0)
    found = evidence_by_importance(posterior, np.random.SeedSequence(0), far)
    assert found.reliable
    assert abs(found.log_z - log_z) < 4 * found.error
    at_once = evidence_by_importance(posterior, np.random.SeedSequence(0), far, rounds=1)
    assert not at_once.reliable
    assert at_once.pareto_k > 0.7


def test_faults_by_their_words():
    posterior = Conjugate(2)
    flat = np.tile(posterior.exact[1], (8, 10, 1))
    with pytest.raises(ValueError, match="the draws fill no volume"):
        log_evidence(posterior, samples_of(flat, posterior), np.random.SeedSequence(0))
    with pytest.raises(ValueError, match="2 posterior draws are too few"):
        log_evidence(posterior, samples_of(flat[:1, :2], posterior), np.random.SeedSequence(0))
    outside = StudentT(HalfSpace(2).exact[1] - 1e6, np.eye(2))
    with pytest.raises(ValueError, match="no draw of the proposal lies in the posterior's support"):
        evidence_by_importance(HalfSpace(2), np.random.SeedSequence(0), outside)


def test_the_seed_is_the_only_randomness_and_is_not_advanced():
    posterior = HalfSpace(3)
    seed = np.random.SeedSequence(7)
    for _ in range(2):
        one, two = (evidence_by_importance(posterior, seed, draws=512) for _ in range(2))
        assert one.log_z == two.log_z
    assert evidence_by_importance(posterior, np.random.SeedSequence(8), draws=512).log_z != one.log_z
    assert seed.n_children_spawned == 0


# A test in wind.

PERIOD, RATE, SE = 0.125, 0.7, 2e-4


def wind(n=-1.0, cycles=40):
    """Two short transients of the paper's law with turbulence, cycle values taken at the middle of the cycle."""
    rng = np.random.default_rng(11)
    phi = np.exp(-RATE * PERIOD)
    records = []
    for start in (0.1, 0.005):
        a = np.empty(cycles)
        for k in range(cycles):
            start = 0.05 + (start - 0.05) * phi + 4e-4 * rng.standard_normal()
            a[k] = start
        records.append(a + SE * rng.standard_normal(cycles))
    size = 2 * cycles
    data = EnvelopeData(
        np.concatenate(records), np.full(size, SE), np.tile(np.r_[-1.0, np.zeros(cycles - 1)], 2),
        np.full(size, PERIOD), np.tile(np.arange(cycles) * PERIOD, 2), np.repeat(["r0", "r1"], cycles),
    )  # fmt: skip
    card = load_card()
    priors = (*(card.prior(one, Motion.HEAVING) for one in WIND[:-1]), Prior("damping_ratio", "lognormal", 0.004, 0.03))
    return WindPosterior(priors, data, (), 2 * np.pi / PERIOD, n)


@pytest.mark.parametrize("n", [-1.0, 1.0])
def test_both_ways_agree_on_a_test_in_wind(n):
    posterior = wind(n)
    samples = sample(posterior, SamplerSettings(), np.random.SeedSequence(0))
    one = log_evidence(posterior, samples, np.random.SeedSequence(1))
    two = evidence_by_importance(posterior, np.random.SeedSequence(2))
    assert one.reliable
    assert two.reliable
    assert abs(one.log_z - two.log_z) < 4 * np.hypot(one.error, two.error)
    assert max(one.error, two.error) < 0.03
    assert one.log_prior_mass == 0.0, "no law cuts the prior"


@pytest.mark.slow
@pytest.mark.parametrize("n", [-1.0, 1.0])
def test_a_test_in_wind_against_nested_sampling(n):
    """dynesty integrates over the uncut prior: its evidence holds the mass of the constraint."""
    dynesty = pytest.importorskip("dynesty")
    posterior = wind(n)
    location, scale = (np.array([getattr(one, key) for one in posterior.priors]) for key in ("location", "scale"))
    assert all(one.family in ("normal", "lognormal") for one in posterior.priors)

    def log_likelihood(u):
        value = posterior.log_likelihood(u[None])[0] if posterior.inside(u[None])[0] else -np.inf
        return float(value) if np.isfinite(value) else -1e300

    sampler = dynesty.NestedSampler(
        log_likelihood, lambda q: location + scale * stats.norm.ppf(q), 5, nlive=500, rstate=np.random.default_rng(0)
    )
    sampler.run_nested(dlogz=0.05, print_progress=False)
    samples = sample(posterior, SamplerSettings(), np.random.SeedSequence(0))
    for found in (
        log_evidence(posterior, samples, np.random.SeedSequence(1)),
        evidence_by_importance(posterior, np.random.SeedSequence(2)),
    ):
        nested = sampler.results.logz[-1] - found.log_prior_mass
        error = np.hypot(sampler.results.logzerr[-1], found.error)
        print(f"n={n:g}: nested {nested:.3f} +- {sampler.results.logzerr[-1]:.3f}, {found}")
        assert abs(found.log_z - nested) < 3.5 * error
        assert error < 0.2


# Weights of laws.


def test_posterior_weights():
    np.testing.assert_allclose(posterior_weights(np.log([1.0, 3.0]), np.array([0.5, 0.5])), [0.25, 0.75])
    np.testing.assert_allclose(posterior_weights(np.array([-1e6, -1e6 + log(3)]), np.array([0.75, 0.25])), [0.5, 0.5])
    np.testing.assert_array_equal(posterior_weights(np.array([1e5, 0.0, -np.inf]), np.array([0.1, 0.9, 1])), [1, 0, 0])
    np.testing.assert_array_equal(posterior_weights(np.array([50.0, 0.0]), np.array([0.0, 1.0])), [0, 1])
    with pytest.raises(ValueError, match="no model has both a finite log evidence and a positive prior weight"):
        posterior_weights(np.array([0.0, -np.inf]), np.array([0.0, 1.0]))


def mixture_score(weights, scores):
    """(M, K) weights and (K, R) scores to (M,)."""
    density = np.exp(scores - scores.max(axis=0))
    with np.errstate(divide="ignore"):
        return np.log(weights @ density).mean(axis=1)


@pytest.mark.parametrize("spread", [0.1, 1.0, 30.0])
@pytest.mark.parametrize("laws", [2, 3])
def test_stacking_against_a_grid(laws, spread):
    grid = np.stack([one.ravel() for one in np.meshgrid(*[np.linspace(0, 1, 101)] * laws)], axis=1)
    grid = grid[np.isclose(grid.sum(axis=1), 1.0)]
    for seed in range(6):
        scores = spread * np.random.default_rng(seed).standard_normal((laws, 9))
        found = stacking_weights(scores)
        value = mixture_score(grid, scores)
        assert mixture_score(found[None], scores)[0] >= value.max() - 1e-8
        np.testing.assert_allclose(found, grid[value.argmax()], atol=0.2 if spread < 1 else 0.02)


def test_stacking_is_robust_and_deterministic():
    none = -np.inf
    np.testing.assert_allclose(stacking_weights([[0.0, none], [none, 0.0]]), [0.5, 0.5])
    np.testing.assert_allclose(stacking_weights([[0.0, none, 5.0], [none, none, 1e6]]), [0.5, 0.5], atol=1e-6)
    np.testing.assert_allclose(stacking_weights([[0.0, 1e5], [-1e5, 0.0]]), [1.0, 0.0], atol=1e-8)
    np.testing.assert_allclose(stacking_weights([[1.0, 2.0]] * 2 + [[0.0, 0.0]]), [0.5, 0.5, 0.0], atol=1e-6)
    np.testing.assert_array_equal(stacking_weights(np.full((2, 3), none)), [0.5, 0.5])
    np.testing.assert_array_equal(stacking_weights([[3.0, none]]), [1.0])
    scores = np.random.default_rng(0).normal(0, 300, (5, 40))
    one = stacking_weights(scores)
    assert one.sum() == pytest.approx(1.0)
    assert (one >= 0).all()
    assert one.tobytes() == stacking_weights(scores).tobytes()
    np.testing.assert_allclose(stacking_weights(scores[::-1])[::-1], one, atol=1e-6)
    np.testing.assert_allclose(stacking_weights(scores + np.linspace(-1e4, 1e4, 40)), one, atol=1e-6)


def test_stacking_satisfies_the_optimality_conditions():
    """No law would gain by more weight: the mean over records of p_k over the mixture is at most one."""
    scores = np.random.default_rng(3).normal(0, 2, (4, 18))
    weights = stacking_weights(scores)
    density = np.exp(scores)
    gain = (density / (weights @ density)).mean(axis=1)
    assert (gain <= 1 + 1e-8).all()
    np.testing.assert_allclose(gain[weights > 1e-3], 1.0, atol=1e-5)
    equal = np.full(4, 0.25)
    assert ((density / (equal @ density)).mean(axis=1) > 1 + 1e-3).any(), "equal weights do not"


@pytest.mark.parametrize(
    ("scores", "words"), [([[np.nan, 0.0]], "NaN"), ([[np.inf]], "inf"), ([1.0, 2.0], "laws, records")]
)
def test_scores_that_mean_nothing(scores, words):
    with pytest.raises(ValueError, match=words):
        stacking_weights(np.array(scores))


def test_weights_of_few_draws_within_the_support_are_numbers():
    """Fewer draws than the effective size that is asked for: all alike, and none outside the support."""
    log_weight = np.array([0.0, -3.0, -np.inf, -40.0, -np.inf])
    weight = _tempered(log_weight, 100.0)
    np.testing.assert_allclose(weight, [1 / 3, 1 / 3, 0.0, 1 / 3, 0.0], rtol=1e-6)
    tempered = _tempered(log_weight, 2.0)
    assert 1.0 / np.square(tempered).sum() == pytest.approx(2.0, rel=1e-3)
    assert tempered[0] > tempered[1] > tempered[3] > tempered[2] == 0.0
    with pytest.raises(ValueError, match="no draw of the proposal"):
        _tempered(np.array([0.0, -np.inf]), 2.0)
