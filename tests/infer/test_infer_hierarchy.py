"""The campaign model: density against a slow obvious formula, prior draws against the density, a record left out."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from scruton.dynamics.cycles import EnvelopeData
from scruton.dynamics.likelihood import Wind, innovations, pointwise_log_likelihood
from scruton.infer.hierarchy import SHARED, CampaignPosterior
from scruton.infer.models import NOISE, SHARED_DEPARTURE, WIND, SteadyAmplitude, WindPosterior
from scruton.infer.peak_test import PeakTest
from scruton.infer.thresholds import SET_POINT_IN_COMMON
from scruton.stats.convergence import SamplerSettings
from scruton.stats.optimum import _Directions, _laplace, climb_side_by_side
from scruton.stats.priors import Prior
from scruton.stats.sampler import sample

LAWS = [-1.0, -0.5, 0.0, 1.0, 2.0, None]
OMEGA0 = 50.0
EXPONENT = Prior("law_exponent", "normal", -0.5, 0.5)


def lognormal(name, median, log_sd):
    return Prior(name, "lognormal", median, log_sd)


def envelope(rng, records):
    """Records of 15 cycles, as noise about 0.03 to 0.05: the density must be right for any data."""
    size = 15 * len(records)
    gap = np.zeros(size)
    gap[::15] = -1.0
    gap[7::15] = 0.4
    return EnvelopeData(
        np.abs(0.04 + 0.005 * rng.standard_normal(size)), np.full(size, 8e-4), gap, np.full(size, 0.125),
        np.arange(size) * 0.125, np.repeat(np.array(records, dtype="U8"), 15),
    )  # fmt: skip


def peak_test(name, n, data, damping, factor, log_sd, steady=()):
    priors = (
        lognormal("stable_amplitude", 0.05, 1.5),
        lognormal("relaxation_ratio", 0.01, 1.2),
        lognormal("amplitude_scatter", 0.02, 0.4),
        lognormal("noise_factor", 1.0, 0.3),
        lognormal("gust_scatter", 0.01, 0.5),
        lognormal("gust_time", 3.0, 0.4),
        lognormal("set_point_scatter", 0.008, 0.3),
        lognormal("departure_scale", 0.1, 0.5),
        lognormal("damping_ratio", damping, 0.05),
    )
    draws = np.zeros((2, len(WIND)))
    draws[1, WIND.index("damping_ratio")] = 0.05
    draws[1, WIND.index("relaxation_ratio")] = 2.0 if name == "B" else 0.05  # the damping of B is known far better
    return PeakTest(name, WindPosterior(priors, data, steady, OMEGA0, n), factor, draws, log_sd)


def campaign(n, *, shares=False):
    """Three tests: uncertain mass; mass known; lock-in alone, which says nothing of the relaxation."""
    rng = np.random.default_rng(3)
    tests = [
        peak_test("A", n, envelope(rng, ["a1", "a2"]), 0.003, 3000.0, 0.02),
        peak_test("B", n, envelope(rng, ["b1"]), 0.006, 2800.0, 0.0),
        peak_test("C", n, EnvelopeData.join({}), 0.009, 3000.0, 0.03, (SteadyAmplitude(0.03, 0.002, 20.0),)),
    ]
    shared = (
        lognormal("", 0.04, 0.4), lognormal("", 0.03, 0.3), lognormal("", 0.09, 0.4), lognormal("", 0.20, 0.4),
    )  # fmt: skip
    free = n is None
    tests = [replace(one, wind=replace(one.wind, shares=shares)) for one in tests]
    return CampaignPosterior(tests, shared, -1.0 if free else n, EXPONENT if free else None)


normal = stats.norm.logpdf


class Counted(CampaignPosterior):
    """Counts the points that it is asked for; `whole` hides which coordinates are apart."""

    whole = False

    @property
    def apart(self):
        return () if self.whole else super().apart

    def log_parts(self, u):
        Counted.asked += len(u)
        return super().log_parts(u)


def test_the_parts_of_the_tests_know_their_own_coordinates_alone():
    three = campaign(-1.0)
    u = three.prior_draws(np.random.default_rng(8), 40)
    before = three.log_parts(u)
    np.testing.assert_allclose(before[:, 0], three.log_prior(u) + three.log_likelihood(u), rtol=1e-12)
    for j, members in enumerate(three.apart, 1):
        moved = u.copy()
        moved[:, members] += 1e-3
        change = three.log_parts(moved) - before
        np.testing.assert_allclose(change[:, 0], change[:, j], atol=1e-6)
        others = [k for k in (1, 2, 3) if k != j]
        assert (change[:, j] != 0.0).all()
        np.testing.assert_array_equal(change[:, others], 0.0)


def test_where_one_test_is_impossible_the_others_still_say_what_they_are_worth():
    three = campaign(0.0)
    u = three.prior_draws(np.random.default_rng(9), 5)
    before = three.log_parts(u)
    u[:, three.own_coordinates[0]["stable_amplitude"]] = np.inf
    after = three.log_parts(u)
    assert (after[:, :2] == -np.inf).all()
    np.testing.assert_array_equal(after[:, 2:], before[:, 2:])


def test_the_curvature_of_what_is_apart_is_not_asked_for():
    three = campaign(0.0)
    rng = np.random.default_rng(3)
    u = three.prior_draws(rng, 2000)
    scale = np.array([prior.scale for prior in three.priors])
    u = climb_side_by_side(three, u[np.argmax(three.log_prob(u))][None], scale[None])[0]
    asked, found = [], []
    for whole in (True, False):
        posterior = Counted(three.tests, three.shared, three.n)
        posterior.__dict__["whole"], Counted.asked = whole, 0
        found.append(_laplace(posterior, u, scale))
        asked.append(Counted.asked)
    (centre, cholesky), (quick_centre, quick_cholesky) = found
    sd = np.sqrt(np.diag(cholesky @ cholesky.T))
    assert np.abs((quick_centre - centre) / sd).max() < 1e-3
    assert np.abs((quick_cholesky @ quick_cholesky.T - cholesky @ cholesky.T) / np.outer(sd, sd)).max() < 1e-2
    assert asked[1] < 0.3 * asked[0]
    # more tests ask for no more points
    many = CampaignPosterior(three.tests[:2] * 4, three.shared)
    assert len(_Directions(many)) == len(_Directions(CampaignPosterior(three.tests[:2], three.shared)))


def obvious(posterior, u):
    """Log density of one walker, read off the model's statement: scalars and scipy's densities only.

    Of the prior and of the likelihood; the first is -inf off the constraint.  The prior is stated of ln R_ref, and of
    ln G_j and ln xi_j given the curve; how the coordinates stretch them is differentiated numerically.
    """
    u = list(u)
    factors = [one.mass_damping_factor for one in posterior.tests]
    dampings = [one.wind.prior("damping_ratio").first for one in posterior.tests]
    sc_ref = stats.gmean([f * xi for f, xi in zip(factors, dampings, strict=True)])
    factor_ref = stats.gmean(factors)
    prior = 0.0
    shared = [u.pop(0) for _ in posterior.shared]
    n = posterior.n
    if posterior.exponent:
        n = u.pop(0)
        prior += normal(n, posterior.exponent.first, posterior.exponent.second)
    own_sd, common_sd = 0.3 * np.sqrt(0.14), 0.3 * np.sqrt(0.86)  # of the logarithms of set-point scatters, which share
    common = u.pop(0)
    prior += normal(common, np.log(0.008), common_sd)
    # Half of the variance of every column of a departure is shared.
    shares = SHARED_DEPARTURE in posterior.shared_coordinates
    bent = np.array([u.pop(0) for _ in range(5)]) if shares else np.zeros(5)
    own = 0.5 if shares else 1.0
    prior += normal(bent, 0, 1).sum() if shares else 0.0
    at_zero = max(n, 0.0)  # of the Scruton number: G is the relaxation at zero damping for n > 0, or that of the test
    for coordinate, one in zip(shared, posterior.shared, strict=True):
        prior += normal(coordinate, np.log(one.first), one.second)
    values = dict(zip(["a_ref", "ratio_ref", "tau", "kappa"], np.exp(shared), strict=True))
    r_ref = factor_ref * values["ratio_ref"]
    likelihood = 0.0
    for one in posterior.tests:
        mine = [u.pop(0) for _ in range(9)]
        a_star, second, scatter, noise, gust, gust_time, set_point, departure, xi = mine
        for coordinate, stated in zip(mine[2:], one.wind.priors[2:], strict=True):
            about = (common, own_sd) if stated.name == "set_point_scatter" else (np.log(stated.first), stated.second)
            prior += normal(coordinate, *about)
        factor = one.mass_damping_factor
        if one.factor_log_sd:
            z = u.pop(0)
            prior += normal(z, 0, 1)
            factor *= np.exp(one.factor_log_sd * z)
        sc = factor * np.exp(xi)
        g = r_ref - n * (sc - sc_ref) + at_zero * sc
        if not g > 0:
            return -np.inf, 0.0
        if one.wind.data.size:
            relaxation = factor * np.exp(second)
            g_j = relaxation + at_zero * sc
            if not g_j > 0:
                return -np.inf, 0.0
            # ln G_j is normal and the coordinate is ln(lambda): d ln G_j / d ln R_j = R_j/G_j at the same damping
            prior += normal(np.log(g_j), np.log(g), values["kappa"]) + np.log(relaxation / g_j)
        else:
            prior += normal(second, 0, 1)
            relaxation = g * np.exp(values["kappa"] * second) - at_zero * sc
            if not relaxation > 0:
                return -np.inf, 0.0
        x = (sc - sc_ref) / r_ref
        if not 1 - n * x > 0:
            return -np.inf, 0.0
        on_curve = values["a_ref"] * (np.exp(-x) if n == 0 else (1 - n * x) ** (1 / n))
        prior += normal(a_star, np.log(on_curve), values["tau"])
        a, lam = np.exp(a_star), OMEGA0 * relaxation / factor
        q = np.exp(scatter) * a * np.sqrt(2 * lam)
        # no tunnel is worse than this
        gust, set_point = min(np.exp(gust), 0.06), min(np.exp(set_point), 0.03)
        if one.wind.data.size:
            mean = np.sqrt(0.5) * np.exp(departure) * bent[None]
            wind = Wind(gust * a, lam / np.exp(gust_time), set_point * a, np.exp(departure), mean, own)
            walker = (np.array([v]) for v in (a, lam, q, np.exp(noise)))
            likelihood += pointwise_log_likelihood(*innovations(one.wind.data, *walker, wind, n=n)).sum()
        for level in one.wind.steady:
            # up to the constant of the normal density, which no parameter touches
            x = level.length * lam / np.exp(gust_time)
            unseen = gust * a * 2 * (x - 1 + np.exp(-x)) / x**2
            sd = np.sqrt(level.standard_error**2 + (set_point * a) ** 2 + unseen**2)
            likelihood += normal(level.mean, a, sd) + 0.5 * np.log(2 * np.pi)
    assert not u, "every coordinate has been read"
    return prior, likelihood


@pytest.mark.parametrize(("n", "shares"), [*((n, False) for n in LAWS), (-1.0, True), (2.0, True), (None, True)])
def test_density_is_that_of_the_models_statement(n, shares):
    posterior, rng = campaign(n, shares=shares), np.random.default_rng(5)
    inside = posterior.prior_draws(rng, 30)
    # and points that have nothing to do with the curve, many of them off the constraint
    away = posterior.prior_draws(rng, 30) + 0.5 * rng.standard_normal(inside.shape)
    far = away.copy()
    far[:, 1] -= 3.0
    u = np.concatenate([inside, away, far])
    prior, likelihood = np.array([obvious(posterior, one) for one in u]).T
    alive = np.isfinite(prior)
    assert alive[:30].all()
    if n in (None, 1.0, 2.0):
        assert not alive.all(), "some points must lie off the constraint"
    np.testing.assert_array_equal(posterior.inside(u), alive)
    np.testing.assert_allclose(posterior.log_prob(u)[alive], (prior + likelihood)[alive], rtol=1e-8)
    np.testing.assert_allclose(posterior.log_prior(u)[alive], prior[alive], rtol=1e-9, atol=1e-9)
    assert (posterior.log_prob(u)[~alive] == -np.inf).all()


@pytest.mark.parametrize("n", LAWS)
def test_prior_draws_have_the_prior_density(n):
    """E_p[q/p] over draws from p is the integral of q where p lives, for any q: normalisation and Jacobians at once."""
    posterior, rng = campaign(n), np.random.default_rng(2)
    u, good = posterior.prior_sample(rng, 60000)
    centre, covariance = u[good].mean(axis=0), 0.75**2 * np.cov(u[good].T)
    q = stats.multivariate_normal(centre, covariance)
    weight = np.zeros(len(u))
    weight[good] = np.exp(q.logpdf(u[good]) - posterior.log_prior(u[good]))
    within = posterior.inside(q.rvs(20000, random_state=rng)).mean()
    error = weight.std() / np.sqrt(len(weight))
    assert error < 0.04
    assert weight.mean() == pytest.approx(within, abs=4 * error + 0.01)


def test_a_search_far_out_overflows_nothing():
    posterior = campaign(-1.0)
    u = np.repeat(posterior.prior_draws(np.random.default_rng(6), 1), 2 * posterior.coordinates.size, axis=0)
    u[np.arange(len(u)), np.arange(len(u)) // 2] += np.tile([-600.0, 600.0], len(u) // 2)
    with np.errstate(over="raise", invalid="raise"):
        value = posterior.log_prior(u)
    assert not np.isnan(value).any()
    assert (value < -1e3).all()


def test_without_discrepancy_prior_draws_lie_on_one_curve():
    """tau and kappa of nothing: every test's amplitude and relaxation are the curve's."""
    posterior = campaign(-1.0)
    tiny = (*posterior.shared[:2], lognormal("", 1e-9, 0.01), lognormal("", 1e-9, 0.01))
    posterior = replace(posterior, shared=tiny)
    u = posterior.prior_draws(np.random.default_rng(0), 50)
    s, (a_ref, r_ref, _) = posterior.settings(u), posterior.curve(u)
    sc_ref = posterior.reference[0]
    x = (s["scruton_number"] - sc_ref) / r_ref[:, None]
    np.testing.assert_allclose(s["a_star"], a_ref[:, None] / (1 + x), rtol=1e-7)
    np.testing.assert_allclose(s["relaxation"], r_ref[:, None] + s["scruton_number"] - sc_ref, rtol=1e-6)
    np.testing.assert_allclose(s["strength"], s["on_curve"], rtol=1e-6)


@pytest.mark.parametrize("n", [-1.0, 2.0])
def test_scatter_about_the_curve_is_the_discrepancy(n):
    posterior, rng = campaign(n), np.random.default_rng(1)
    u, good = posterior.prior_sample(rng, 20000)
    # without the draws that the constraint takes the normal scores would not be whole
    assert good.mean() > 0.9
    u = u[good]
    s, (a_ref, r_ref, _) = posterior.settings(u), posterior.curve(u)
    x = (s["scruton_number"] - posterior.reference[0]) / r_ref[:, None]
    z = np.log(s["a_star"] / a_ref[:, None] / (1 - n * x) ** (1 / n)) / np.exp(u[:, 2:3])
    at_zero = max(n, 0.0)
    on_curve = r_ref[:, None] - n * (s["scruton_number"] - posterior.reference[0]) + at_zero * s["scruton_number"]
    w = np.log((s["relaxation"] + at_zero * s["scruton_number"]) / on_curve) / np.exp(u[:, 3:4])
    for scores in (z, w):
        np.testing.assert_allclose(scores.mean(axis=0), 0.0, atol=0.12)
        np.testing.assert_allclose(scores.std(axis=0), 1.0, atol=0.08)
        np.testing.assert_allclose(np.corrcoef(scores.T), np.eye(3), atol=0.06)


def test_coordinates_are_named_and_those_of_a_test_stand_together():
    posterior = campaign(None)
    assert posterior.names[:6] == (*SHARED, "law_exponent", "common_set_point_scatter")
    own = [
        "stable_amplitude", "relaxation_ratio", "amplitude_scatter", "noise_factor", "gust_scatter", "gust_time",
        "set_point_scatter", "departure_scale", "damping_ratio",
    ]  # fmt: skip
    assert [name.split(" of ")[0] for name in posterior.names[6:]] == [
        *own, "mass_factor", *own, own[0], "w", *own[2:], "mass_factor",
    ]  # fmt: skip
    assert [one.size for one in posterior.own_coordinates] == [10, 9, 10]
    assert posterior.own_coordinates[0].start == 6
    assert posterior.own_coordinates[-1].stop == posterior.coordinates.size == len(posterior.priors)


# ------------------------------------------------------------------------------------------------ a record left out


@pytest.mark.parametrize("n", [-1.0, 1.0, None])
def test_a_record_left_out_takes_its_own_likelihood_and_nothing_else(n):
    posterior = campaign(n)
    u = posterior.prior_draws(np.random.default_rng(4), 20)
    rest = posterior.without("a2")
    assert rest.names == posterior.names
    data = posterior.tests[0].wind.data
    s = posterior.settings(u) | {name: np.exp(posterior.of_tests(u, name)) for name in NOISE}
    own = {name: values[:, 0] for name, values in s.items()}
    a, lam = own["a_star"], OMEGA0 * own["relaxation_ratio"]
    q = own["amplitude_scatter"] * a * np.sqrt(2 * lam)
    wind = Wind(own["gust_scatter"] * a, lam / own["gust_time"], own["set_point_scatter"] * a, own["departure_scale"])
    own = pointwise_log_likelihood(*innovations(data, a, lam, q, own["noise_factor"], wind, n=posterior.exponents(u)))
    own = own[data.record == "a2"]
    np.testing.assert_allclose(posterior.log_prob(u) - rest.log_prob(u), own.sum(axis=0), rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(rest.log_prior(u), posterior.log_prior(u))


def test_a_test_without_its_only_transient_keeps_its_place_but_not_its_relaxation():
    posterior = campaign(-1.0)
    rest = posterior.without("b1")
    assert [one.relaxes for one in rest.tests] == [True, False, False]
    assert rest.names[slice(posterior.own_coordinates[1].start, posterior.own_coordinates[1].stop)] == (
        "stable_amplitude of B", "w of B", *(f"{name} of B" for name in NOISE), "damping_ratio of B"
    )  # fmt: skip
    assert rest.reference == posterior.reference, "the curve's parameters mean the same"
    u = rest.prior_draws(np.random.default_rng(4), 10)
    prior, likelihood = np.array([obvious(rest, one) for one in u]).T
    np.testing.assert_allclose(rest.log_prob(u), prior + likelihood, rtol=1e-8)
    # the scatter, the noise and the gusts of a test without records do nothing to the likelihood
    moved = u.copy()
    for name in NOISE:
        rest.named(moved)[f"{name} of B"] += 1.0
    np.testing.assert_allclose(rest.log_likelihood(moved), rest.log_likelihood(u))


@pytest.mark.parametrize("n", [-1.0, 0.0, None])
@pytest.mark.parametrize("relaxes", [True, False])
def test_what_is_told_of_blocks_that_no_record_is_read_for_is_what_the_records_say(n, relaxes):
    rng = np.random.default_rng(8)
    posterior = campaign(n)
    if not relaxes:
        for record in dict.fromkeys(posterior.tests[1].wind.data.record.tolist()):
            posterior = posterior.without(record)
    u = posterior.prior_draws(rng, 40)
    parts, told = posterior.assess(u)
    np.testing.assert_array_equal(parts, posterior.log_parts(u))
    np.testing.assert_allclose(told.sum(axis=1), posterior.log_likelihood(u), rtol=1e-9)
    unread = [block for block in posterior.blocks if block.unread]
    assert len(unread) == (2 if n is None else 3)
    for block in unread:
        moved = u.copy()
        moved[:, block.members] += 0.01 * rng.standard_normal((40, block.members.size))
        before = told.copy()
        again, still = posterior.assess(moved, told)
        np.testing.assert_allclose(again, posterior.log_parts(moved), rtol=1e-9)
        known = [j for j, test in enumerate(posterior.tests) if test.relaxes]
        np.testing.assert_array_equal(still[:, known], told[:, known])
        np.testing.assert_array_equal(told, before)


@pytest.mark.parametrize("n", [-1.0, 0.0, None])
def test_what_a_block_is_given_is_all_that_it_depends_on(n):
    """A move of its members gains as much whatever the coordinates that are neither among them nor given.

    A block that nothing is given is proposed as it is by itself.
    """
    posterior, rng = campaign(n), np.random.default_rng(12)
    u = posterior.prior_draws(rng, 50)
    for members, given, *_ in filter(lambda block: block.given.size, posterior.blocks):
        kept = np.r_[members, given]
        elsewhere = u + 0.02 * rng.standard_normal(u.shape)
        elsewhere[:, kept] = u[:, kept]
        gains = []
        for start in (u, elsewhere):
            moved = start.copy()
            moved[:, members] += 0.003
            gains.append(posterior.log_prob(moved) - posterior.log_prob(start))
        alive = np.isfinite(gains).all(axis=0)
        assert alive.sum() > 20
        np.testing.assert_allclose(gains[0][alive], gains[1][alive], rtol=1e-5, atol=1e-5)


def test_a_move_of_one_test_asks_the_records_of_no_other(monkeypatch):
    posterior, asked = campaign(-1.0), []
    plain = WindPosterior.log_likelihood

    def counted(self, u):
        if self.data.size:  # without records of the relaxation the curve tells the rate, and little has to be computed
            asked.append(len(u))
        return plain(self, u)

    monkeypatch.setattr(WindPosterior, "log_likelihood", counted)
    u = np.repeat(posterior.prior_draws(np.random.default_rng(8), 1), 5, axis=0)
    u[:3, posterior.blocks[-2].members] += 0.01 * np.arange(1.0, 4.0)[:, None]
    _, told = posterior.assess(u)
    assert asked == [1, 4]
    for block in posterior.blocks:
        if block.unread:
            u[:, block.members] += 0.01
            posterior.assess(u, told)
    assert asked == [1, 4]


def test_the_common_set_point_scatter_carries_those_of_the_tests_with_it():
    """Between what it lies near and what lies near it a walker would creep: they move together, and apart."""
    posterior = campaign(-1.0)
    common = posterior.coordinates["common_set_point_scatter"]
    carried = [block.carried.tolist() for block in posterior.blocks if block.members.tolist() == [common]]
    assert carried == [[], [layout["set_point_scatter"] for layout in posterior.own_coordinates]]
    alone = posterior.without_test("A").without_test("B")
    assert not any(block.carried.size or not block.members.size for block in alone.blocks)


def test_a_record_that_is_not_there_changes_nothing():
    posterior = campaign(-1.0)
    u = posterior.prior_draws(np.random.default_rng(4), 10)
    np.testing.assert_array_equal(posterior.without("z9").log_prob(u), posterior.log_prob(u))


# ------------------------------------------------------------------------------------------------ where to start


@pytest.mark.parametrize("n", [-1.0, 0.0, 2.0, None])
def test_the_search_starts_where_the_tests_see_themselves(n):
    """Guesses put each test on a draw of its own, and the curve among them; nearly all are within the support."""
    posterior, rng = campaign(n), np.random.default_rng(9)
    tests = []
    for one, level in zip(posterior.tests, (0.05, 0.035, 0.028), strict=True):
        centre = np.array([prior.location for prior in one.wind.priors])
        centre[:4] = np.log([level, 0.02, 0.01, 1.0])
        tests.append(replace(one, draws=centre + 0.02 * rng.standard_normal((200, centre.size))))
    posterior = replace(posterior, tests=tests)
    u = posterior.guesses(rng, 200)
    s = posterior.settings(u)
    np.testing.assert_allclose(np.nanmedian(s["a_star"], axis=0), [0.05, 0.035, 0.028], rtol=0.03)
    np.testing.assert_allclose(np.median(s["relaxation_ratio"][:, :2], axis=0), 0.02, rtol=0.03)
    assert np.isfinite(posterior.log_prob(u)).mean() > 0.5


class Told(WindPosterior):
    """Records that say the amplitude to 30 % and the rate to 8 %, 5 % above the damping: Y1 may be of either sign."""

    def log_likelihood(self, u):
        log = self.named(u)
        return normal(log["stable_amplitude"], np.log(0.05), 0.3) + normal(
            log["relaxation_ratio"], np.log(0.0063), 0.08
        )


@pytest.mark.thorough
def test_where_y1_is_next_to_nothing_ensembles_meet_in_the_posterior():
    """Against draws of the prior weighed by the likelihood, which know neither coordinates nor Jacobians."""
    rng = np.random.default_rng(7)
    plain = peak_test("one", -1.0, envelope(rng, ["a"]), 0.006, 3000.0, 0.01)
    priors = tuple(replace(p, second=0.1) if p.name == "damping_ratio" else p for p in plain.wind.priors)
    draws = np.array([p.location for p in priors]) + 0.1 * rng.standard_normal((500, len(priors)))
    draws[:, 0] += np.log(0.05) - draws[:, 0].mean()
    draws[:, 1] += np.log(0.0075) - draws[:, 1].mean()
    test = replace(plain, wind=Told(priors, plain.wind.data, (), OMEGA0, -1.0), draws=draws)
    shared = (lognormal("", 0.05, 0.7), lognormal("", 0.014, 0.5), lognormal("", 0.07, 0.8), lognormal("", 0.15, 0.8))
    posterior = CampaignPosterior([test], shared, -1.0)

    settings = SamplerSettings(walkers=64, draws=48, min_ess=600, max_rhat=1.01, max_steps=1000)
    samples = sample(posterior, settings, np.random.SeedSequence(4))
    assert samples.convergence.converged, samples.convergence.explain(posterior.names, settings)

    def quantities(u):
        s, (a_ref, r_ref, _) = posterior.settings(u), posterior.curve(u)
        over = s["relaxation"][:, 0] / s["scruton_number"][:, 0]
        return [
            over,
            np.log(s["strength"][:, 0]),
            np.log(s["on_curve"][:, 0]),
            np.log(s["damping_ratio"][:, 0]),
            np.log(a_ref),
            r_ref,
        ]

    u = posterior.prior_draws(rng, 120_000)
    weight = np.exp(posterior.log_likelihood(u))
    size = weight.sum() ** 2 / np.square(weight).sum()
    assert size > 1200
    found = samples.chain.reshape(-1, samples.chain.shape[-1])
    for here, values in zip(quantities(found), quantities(u), strict=True):
        order = np.argsort(values)
        share = np.cumsum(weight[order]) / weight.sum()
        for probability in (0.05, 0.25, 0.5, 0.75, 0.95):
            level = values[order][np.searchsorted(share, probability)]
            error = np.sqrt(probability * (1.0 - probability) * (1.0 / size + 1.0 / 600))
            assert (here < level).mean() == pytest.approx(probability, abs=4.0 * error)


def test_the_set_point_scatters_of_tests_have_the_priors_of_the_card_and_go_together():
    three = campaign(-1.0)
    u = three.prior_sample(np.random.default_rng(4), 20000)[0]  # what the constraint cuts has no say in them
    scatter = three.of_tests(u, "set_point_scatter")
    own = three.tests[0].wind.prior("set_point_scatter")
    np.testing.assert_allclose(scatter.mean(axis=0), own.location, atol=0.01)
    np.testing.assert_allclose(scatter.std(axis=0), own.scale, rtol=0.02)
    correlation = np.corrcoef(scatter.T)[np.triu_indices(3, 1)]
    np.testing.assert_allclose(correlation, SET_POINT_IN_COMMON, atol=0.02)
    alone = three.without_test("A").without_test("B")
    assert not any("common" in name for name in alone.names)
