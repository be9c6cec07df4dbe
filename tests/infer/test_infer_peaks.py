"""The campaign model under several laws: what two small campaigns, one of each kind of force, make of them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

from scruton.campaign import load_campaign
from scruton.dynamics.departure import COLUMNS
from scruton.dynamics.laws import amplitude_ratio
from scruton.envelope import record_cycles
from scruton.infer.cards import load_card
from scruton.infer.drift import departure_group
from scruton.infer.fit import fit_rig, fit_test
from scruton.infer.models import WIND, SteadyAmplitude
from scruton.infer.off_curve import off_curve
from scruton.infer.peaks import (
    campaign_posterior,
    data_of,
    displaced_damping,
    fit_peaks,
    foretold,
    leading_departure,
    settle,
    stack,
    weighed_peaks,
)
from scruton.infer.results import LawWeights, Weighing
from scruton.infer.sampling import ExcludedByPriorsError, Known, Sampling, fewer_walkers
from scruton.infer.thresholds import (
    CARRIES,
    COARSENED,
    DEPARTS,
    DEPARTURE_IN_COMMON,
    FAVOURED,
    HOPELESS,
    LAWS_SHARE_ALONE,
    LAWS_SHARE_DOUBTED,
    ROUGH_PART,
)
from scruton.stats.convergence import SamplerSettings
from scruton.stats.evidence import Evidence
from scruton.stats.optimum import laplace_log_evidence
from scruton.stats.stacking import posterior_weights, stacking_weights

LAWS = (-1.0, 0.0, 2.0)
PRIOR = (0.5, 0.3, 0.2)


@pytest.fixture(scope="module")
def card():
    small = SamplerSettings(ensembles=2, walkers=64, draws=16, min_ess=200, max_rhat=1.05)
    return replace(load_card("paper"), laws=LAWS, law_weights=PRIOR, sampler=small)


@pytest.fixture(scope="module")
def tests_of(two_rigs, card):
    """Each test on its own: what `fit_peaks` starts from."""
    made = {}

    def fit(force):
        if force not in made:
            campaign, sampling = load_campaign(two_rigs(force)), Sampling(card, 0)
            rigs = {one.name: fit_rig(campaign, one, {}, None, sampling) for one in campaign.rigs}
            cycles = {r.name: record_cycles(r, 7.87) for one in campaign.tests for r in one.records}
            made[force] = campaign, [fit_test(campaign, t, rigs[t.rig], cycles, sampling) for t in campaign.tests]
        return made[force]

    return fit


@pytest.fixture(scope="module")
def peaks_of(tests_of, sampling):
    made = {}

    def fit(force):
        if force not in made:
            made[force] = fit_peaks(*tests_of(force), sampling(force))
        return made[force]

    return fit


@pytest.fixture(scope="module")
def sampling(card):
    """One run's sampling, which takes draws of a campaign model that another test has sampled already."""
    known = {}

    def make(force="paper", card=card):
        return Sampling(card, 0, known=known.setdefault(force, Known()))

    return make


@pytest.mark.parametrize("force", ["paper", "ehsan-scanlan"])
def test_weights_are_prior_times_coarsened_evidence(peaks_of, force):
    result = peaks_of(force)
    weights = result.weights
    assert weights.labels == ("n=-1", "n=0", "n=2")
    np.testing.assert_array_equal(weights.prior, PRIOR)
    assert weights.weight.sum() == pytest.approx(1.0)
    told = (weights.log_evidence - weights.log_evidence.max()) / COARSENED
    relative = np.where(weights.sampled, PRIOR * np.exp(told), 0.0)
    np.testing.assert_allclose(weights.weight, relative / relative.sum(), rtol=1e-9)
    np.testing.assert_allclose(
        weights.weight[weights.sampled],
        posterior_weights(told[weights.sampled], np.array(PRIOR)[weights.sampled]),
    )
    assert [one.label for one in result.laws] == [weights.labels[k] for k in np.flatnonzero(weights.sampled)]
    assert np.isfinite(weights.error[weights.sampled]).all()
    assert np.isnan(weights.error[~weights.sampled]).all()
    assert (weights.error[weights.sampled] < 0.3).all()
    assert np.isnan(weights.stacking).all(), "nobody asked for it"


def test_records_of_the_papers_law_favour_it(peaks_of):
    weights = peaks_of("paper").weights
    assert weights.weight[0] > 0.99
    assert weights.flag == ""


def test_records_of_van_der_pol_damping_favour_it_and_say_so(peaks_of):
    weights = peaks_of("ehsan-scanlan").weights
    assert weights.weight[2] > 0.99
    assert "the records favour the law n=2 over n=-1" in weights.flag
    assert weights.sampled[0], "the reference law is always sampled"


def test_a_law_beyond_doubt_is_not_sampled_and_a_near_one_is(peaks_of, card):
    for force in ("paper", "ehsan-scanlan"):
        weights = peaks_of(force).weights
        behind = weights.log_evidence.max() - weights.log_evidence
        assert (behind[1:][~weights.sampled[1:]] > HOPELESS - 3.0).all()
        assert (weights.weight[~weights.sampled] == 0.0).all()


def test_laplace_is_near_the_evidence(peaks_of, tests_of, card):
    """The screening, by 15 and 28, may err by two: the mass of the constraint, which it leaves out, is of order one.

    So is what scatters that two records hardly tell make of it: 1.7 by those of each test, 2.1 with one in common.
    """
    weights = peaks_of("paper").weights
    campaign, tests = tests_of("paper")
    posterior = campaign_posterior(campaign, tests, Sampling(card, 0), -1.0)
    found = laplace_log_evidence(posterior, np.random.default_rng(3))
    assert found.log_evidence == pytest.approx(weights.log_evidence[0], abs=2.5)


def test_a_law_that_reaches_no_data_has_no_weight_and_ends_no_run(tests_of, sampling, monkeypatch):
    run = Sampling.run

    def out_of_reach(self, name, *more, **options):
        if name.endswith("n=2"):
            raise ExcludedByPriorsError(name, "", "nothing", "a record and priors that agree")
        return run(self, name, *more, **options)

    monkeypatch.setattr(Sampling, "run", out_of_reach)
    sampling = sampling()
    result = fit_peaks(*tests_of("paper"), sampling)
    assert not result.weights.sampled[2]
    assert result.weights.weight[2] == 0.0
    assert "n=2" not in [law.label for law in result.laws]
    for white in (True, False):
        settled = settle(stack(result, sampling), sampling, white=white).weights.weight
        assert settled[2] == 0.0
        assert settled.sum() == pytest.approx(1.0)


def test_one_setting_leaves_every_law_an_equal_share(every_law, card):
    result = every_law
    kept = settle(result, Sampling(card, 0), white=True).weights
    np.testing.assert_array_equal(kept.weight, result.weights.weight)
    assert kept.rule.name == "evidence"
    alone = settle(replace(result, tests=result.tests[:1]), Sampling(card, 0), white=True).weights
    np.testing.assert_allclose(
        alone.weight, (1 - LAWS_SHARE_ALONE) * result.weights.weight + LAWS_SHARE_ALONE / 3, rtol=1e-12
    )
    np.testing.assert_allclose(alone.told, (1 - LAWS_SHARE_ALONE) * result.weights.weight, atol=1e-12)
    assert alone.rule.name == "evidence, equal shares"
    assert f"{LAWS_SHARE_ALONE:.0%} in equal shares, since one setting does not tell" in alone.rule.sentence


def test_tests_share_a_part_of_their_departures_and_say_which(tests_of, peaks_of, sampling):
    """One number a ramp for all of them, of the draws that are printed; where the law holds little is told of it."""
    tests, result = tests_of("paper")[1], peaks_of("paper")
    assert all(one.wind.shares for law in result.laws for one in law.posterior.tests)
    sampled = SimpleNamespace(tests=tests, peaks=result.tests, joint=result)
    group = departure_group(sampled, sampling())
    shared = group["shared_column"].to_numpy()
    assert shared.shape == (group.sizes["sample"], group.sizes["ramp"])
    np.testing.assert_allclose(shared.std(axis=0), np.sqrt(DEPARTURE_IN_COMMON), rtol=0.25)
    np.testing.assert_allclose(shared.mean(axis=0), 0.0, atol=0.4)


@pytest.fixture(scope="module")
def every_law(tests_of, sampling):
    return fit_peaks(*tests_of("paper"), sampling(), every=True)


def leaving(result, scale):
    """The same, but that the drift of the second test leaves every law by so much."""
    laws = []
    for law in result.laws:
        departure = law.derived["departure_scale"].copy()
        departure[..., 1] = scale
        laws.append(replace(law, derived={**law.derived, "departure_scale": departure}))
    return replace(result, laws=tuple(laws))


def displaced(result, sds):
    """The same, but that every law wants the second test's damping so many of its prior's sds off."""
    laws = []
    for law in result.laws:
        prior, damping = law.posterior.tests[1].wind.prior("damping_ratio"), law.derived["damping_ratio"].copy()
        damping[..., 1] = np.exp(prior.location + sds * prior.scale)
        laws.append(replace(law, derived={**law.derived, "damping_ratio": damping}))
    return replace(result, laws=tuple(laws))


def test_a_law_that_contradicts_what_is_known_of_the_damping_does_not_hold(every_law, card):
    """Only by more than chance would, and then the fit says so, though no other law is favoured."""
    assert not displaced_damping(every_law)
    assert not displaced_damping(displaced(every_law, 1.5))
    result = displaced(every_law, -6.0)
    found = settle(result, Sampling(card, 0), white=True).weights
    assert found.rule.doubted
    assert found.rule.by_rigs
    assert "6.0 standard deviations from what is known of it" in found.rule.sentence
    assert found.flag.startswith("no law of the card holds, since n=")
    assert not settle(every_law, Sampling(card, 0), white=True).weights.flag


def test_where_no_law_holds_rigs_that_are_left_out_have_a_say(every_law, card):
    """And the fit says so."""
    assert not leading_departure(every_law)
    assert not leading_departure(leaving(every_law, 0.9 * DEPARTS))
    for result, white in ((leaving(every_law, 0.3), True), (every_law, False)):
        found = settle(result, Sampling(card, 0), white=white).weights
        assert found.weight.sum() == pytest.approx(1.0)
        score = np.array([foretold(law) for law in result.laws])
        share = LAWS_SHARE_DOUBTED * np.exp(score - score.max()) / np.exp(score - score.max()).sum()
        np.testing.assert_allclose(found.common, share, rtol=1e-9)
        assert found.weight[0] < 1.0 - CARRIES, "no law is certain"
        assert found.rule.name == "evidence, rigs left out"
    assert (
        "the drift leaves even n=-1, by 30% one e-fold"
        in settle(leaving(every_law, 0.3), Sampling(card, 0), white=True).weights.rule.sentence
    )
    alone = settle(replace(leaving(every_law, 0.3), tests=every_law.tests[:1]), Sampling(card, 0), white=True)
    np.testing.assert_allclose(alone.weights.common, LAWS_SHARE_DOUBTED / 3)


def test_the_law_of_the_rigs_foretells_their_amplitudes_best(every_law):
    """By densities about the curve at the rigs' own Scruton numbers, each draw in inverse proportion to its density."""
    score = [foretold(law) for law in every_law.laws]
    assert score[0] > max(score[1:])
    law = every_law.laws[0]
    s, by_hand = law.derived, 0.0
    for j in range(2):
        x = (s["scruton_number"][..., j] - law.posterior.reference[0]) / s["reference_relaxation"]
        curve = s["reference_amplitude"] * amplitude_ratio(x, -1.0)
        density = norm.pdf(np.log(s["a_star"][..., j] / curve), scale=s["discrepancy_amplitude"])
        by_hand -= np.log(np.mean(1.0 / density))
    assert score[0] == pytest.approx(by_hand, abs=0.1)


def test_all_laws_are_sampled_where_the_one_that_leads_does_not_hold(tests_of, sampling, monkeypatch):
    """And none of them in full, nor stacked: evidence decides little there, and stacking a dozen evidences for each."""
    asked, stacked, fit = [], [], fit_peaks

    def spy(*arguments, every=False, in_full=()):
        asked.append((every, set(in_full)))
        return leaving(fit(*arguments, every=every, in_full=in_full), 0.3)

    monkeypatch.setattr("scruton.infer.peaks.fit_peaks", spy)
    monkeypatch.setattr("scruton.infer.peaks.stack", lambda result, _: stacked.append(1) or result)
    found = weighed_peaks(*tests_of("paper"), sampling(), white=True, thorough=True)
    assert asked == [(False, set()), (True, set())]
    weighed_peaks(*tests_of("paper"), sampling(), white=False, thorough=True)
    assert asked[2:] == [(True, set())]
    assert not stacked
    assert found.weights.sampled.all()
    assert found.weights.rule.doubted


def test_quantities_of_the_tests_are_near_the_truth(peaks_of):
    result = peaks_of("paper")
    assert result.tests == ("heavy in wind", "light in wind")
    derived = result.laws[0].derived
    for j, (y1, amplitude, damping) in enumerate([(-11.111, 0.0292, 0.0065), (-11.111, 0.0358, 0.004)]):
        for name, truth, within in (("Y1", y1, 0.1), ("a_star", amplitude, 0.03), ("damping_ratio", damping, 0.05)):
            assert np.median(derived[name][..., j]) == pytest.approx(truth, rel=within), (name, j)
    np.testing.assert_allclose(derived["scruton_number"], derived["mass_damping_factor"] * derived["damping_ratio"])
    # one section in one wind: Eq. (11) through both tests
    sc, a = (np.median(derived[key], axis=(0, 1)) for key in ("scruton_number", "a_star"))
    reference = result.laws[0].posterior.reference[0]
    between = np.interp(reference, sc[::-1], 1.0 / a[::-1])
    assert 1.0 / np.median(derived["reference_amplitude"]) == pytest.approx(between, rel=0.05)


def test_a_law_without_y1_has_none(peaks_of):
    law = next(one for one in peaks_of("ehsan-scanlan").laws if one.label == "n=2")
    for name in ("Y1", "epsilon"):
        assert law.derived[name].shape == law.derived["a_star"].shape
        assert np.isnan(law.derived[name]).all()
    assert (law.derived["n"] == 2.0).all()


def test_a_free_exponent_is_one_law(tests_of, card):
    campaign, tests = tests_of("paper")
    free = load_card("free-exponent")
    posterior = campaign_posterior(campaign, tests, Sampling(replace(free, sampler=card.sampler), 0), None)
    assert posterior.names[4] == "law_exponent"
    assert all(one.wind.n is None for one in posterior.tests)
    u = posterior.guesses(np.random.default_rng(0), 50)
    at_two = u.copy()
    at_two[:, 4] = 2.0
    fixed = campaign_posterior(campaign, tests, Sampling(card, 0), 2.0)
    np.testing.assert_allclose(
        posterior.log_likelihood(at_two), fixed.log_likelihood(np.delete(at_two, 4, axis=1)), rtol=1e-8
    )


# ------------------------------------------------------------------------------------------------ stacking


@pytest.mark.slow  # quicker: what no evidence scores, below, and a fit by stacking in test_infer_fit.py
def test_stacking_scores_whole_records_and_leaves_the_unsampled_out(tests_of, card, sampling, monkeypatch):
    """One column of scores a record and a rig, not a cycle, and the law of the records foretells them better."""
    seen = []

    def spy(scores):
        seen.append(scores)
        return stacking_weights(scores)

    monkeypatch.setattr("scruton.infer.peaks.stacking_weights", spy)
    two = replace(card, laws=(-1.0, 0.0), law_weights=(0.5, 0.5))
    sampling = sampling(card=two)
    result = fit_peaks(*tests_of("paper"), sampling, every=True)
    assert all(result.weights.sampled), "evidence decides nothing where no law explains the records"
    stacked = stack(result, sampling)
    assert [one.shape for one in seen] == [(2, 6 - len(stacked.weights.unscored))]
    assert len(stacked.weights.unscored) <= 2
    assert np.isfinite(seen[0]).all()
    assert seen[0][0].sum() > seen[0][1].sum() + FAVOURED, "the true law foretells the records left out"
    assert stacked.weights.stacking.sum() == pytest.approx(1.0)
    assert stacked.weights.stacking[0] > 0.9
    np.testing.assert_array_equal(stacked.weights.weight, result.weights.weight)
    by_stacking = settle(stacked, Sampling(replace(two, averaging="stacking"), 0), white=True)
    np.testing.assert_array_equal(by_stacking.weights.weight, stacked.weights.stacking)


@pytest.mark.parametrize("carries", [False, pytest.param(True, marks=pytest.mark.thorough)])
def test_a_law_far_behind_is_sampled_roughly_until_it_carries_weight(tests_of, card, sampling, carries, monkeypatch):
    of, asked, run = tests_of("paper"), [], Sampling.run  # the tests before the spy looks

    def spy(self, name, *more, roughly=False):
        asked.append((name.split()[-1], roughly))
        samples = run(self, name, *more, roughly=roughly)
        if roughly:
            self.faults[name] = "not converged"
        return samples

    def stacked(result, sampling):
        share = np.array([0.5, 0.5] if carries else [1.0, 0.0])
        return replace(result, weights=replace(result.weights, stacking=share))

    monkeypatch.setattr(Sampling, "run", spy)
    monkeypatch.setattr("scruton.infer.peaks.stack", stacked)
    sampling = sampling(card=replace(card, laws=(-1.0, 2.0), law_weights=(0.8, 0.2)))
    found = weighed_peaks(*of, sampling, white=False, thorough=True)
    first = [("n=2", True), ("n=-1", False)]
    assert asked == ([*first, ("n=2", False), ("n=-1", False)] if carries else first)
    least = [min(one.samples.convergence.ess_bulk.min(), one.samples.convergence.ess_tail.min()) for one in found.laws]
    assert least[0] >= card.sampler.min_ess
    assert least[1] >= card.sampler.min_ess * (1.0 if carries else ROUGH_PART)
    assert sampling.faults == ({} if carries else {"campaign, n=2": "not converged"})


def test_an_evidence_that_is_not_reliable_scores_no_law(tests_of, card, sampling, monkeypatch):
    """Nor one that was not found; where none is left, all records together decide, and it is said."""
    bad = {}

    def evidence(posterior, seed, start=None):
        tests, records = len(posterior.tests), sum(len(set(one.wind.data.record)) for one in posterior.tests)
        kind = bad.get("rig" if tests == 1 else "record" if records < 4 else "")
        if kind == "none":
            raise ValueError("no draw of the proposal lies in the posterior's support")
        good = 0.0 if kind == "poor" else 1000.0
        return Evidence(1.0, 0.01, 0.0, good, 0.9)

    monkeypatch.setattr("scruton.infer.peaks.evidence_by_importance", evidence)
    two = replace(card, laws=(-1.0, 0.0), law_weights=(0.5, 0.5), averaging="stacking")
    result = fit_peaks(*tests_of("paper"), sampling(card=two), every=True)
    for of, unscored, by in (
        ({}, (), "stacking"),
        ({"rig": "poor"}, result.tests, "stacking"),
        ({"rig": "none", "record": "poor"}, None, "evidence"),
    ):
        bad.clear()
        bad.update(of)
        sampling = Sampling(two, 0)
        found = settle(stack(result, sampling), sampling, white=True).weights
        assert unscored is None or found.unscored == unscored
        assert found.rule.name == by
        assert np.isfinite(found.stacking).all() == (by == "stacking")
        assert len(sampling.flags) == bool(of)
        assert all("no reliable evidence without" in flag for flag in sampling.flags)
    np.testing.assert_allclose(found.weight, result.weights.weight)
    assert "all records together" in sampling.flags[0]


def test_laws_that_were_not_sampled_get_nothing_from_stacking(peaks_of, card, monkeypatch):
    told = Evidence(1.0, 0.01, 0.0, 1000.0, 0.9)  # whatever it is
    monkeypatch.setattr("scruton.infer.peaks.evidence_by_importance", lambda *_, **__: told)
    weights = stack(peaks_of("ehsan-scanlan"), Sampling(card, 0)).weights
    assert weights.sampled.tolist() == [True, False, True]
    assert weights.stacking.sum() == pytest.approx(1.0)
    assert (weights.stacking[~weights.sampled] == 0.0).all()
    alone = stack(peaks_of("paper"), Sampling(card, 0)).weights
    assert alone.sampled.tolist() == [True, False, False]
    assert np.isnan(alone.stacking).all(), "one law is compared with none"


def test_without_a_record_and_another_rig_nothing_is_stacked(peaks_of, card):
    result = peaks_of("paper")
    posterior = result.laws[0].posterior
    (test, *_) = posterior.tests
    nothing = test.wind.data
    for record in dict.fromkeys(nothing.record.tolist()):
        nothing = nothing.without(record)
    no_cycles = replace(test, wind=replace(test.wind, data=nothing))
    laws = tuple(replace(law, posterior=SimpleNamespace(tests=[no_cycles])) for law in result.laws)
    sampling = Sampling(replace(card, averaging="stacking"), 0)
    found = settle(stack(replace(result, laws=laws), sampling), sampling, white=True)
    assert np.isnan(found.weights.stacking).all()
    np.testing.assert_allclose(found.weights.weight.sum(), 1.0)
    assert found.weights.rule.name.startswith("evidence")


# ------------------------------------------------------------------------------------------------ flags, walkers, data


def weights_of(log_evidence, error, sampled=(True, True, True)):
    third = np.full(3, 1 / 3)
    return LawWeights(
        ("n=-1", "n=0", "n=2"), third, third, np.array(log_evidence), np.array(error), np.array(sampled), third
    )


@pytest.mark.parametrize(
    ("log_evidence", "error", "flag"),
    [
        ((0.0, -3.0, -9.0), (0.1, 0.1, 0.1), ""),
        ((0.0, 2.9, -9.0), (0.01, 0.01, 0.01), ""),
        ((0.0, 3.3, -9.0), (0.05, 0.05, 0.05), "n=0 over n=-1: log evidence 3.3 higher"),
        ((0.0, 3.3, -9.0), (0.1, 0.1, 0.1), ""),
        ((0.0, 3.3, 8.0), (0.1, 0.1, np.nan), "n=2 over n=-1: log evidence 8.0 higher"),
        ((-np.inf, 3.3, 0.0), (np.nan, 0.1, 0.1), "n=0 over n=-1: log evidence far higher"),
    ],
)
def test_the_flag_wants_twenty_to_one_beyond_what_the_errors_allow(log_evidence, error, flag):
    found = weights_of(log_evidence, error).flag
    assert flag in found if flag else found == ""


def test_where_no_law_holds_none_is_favoured():
    weights = weights_of((0.0, 9.0, -9.0), (0.1, 0.1, 0.1))
    found = replace(
        weights, rule=Weighing(shared=0.4, by_rigs=True, why="the drift leaves even n=0", doubted=True)
    ).flag
    assert "favour" not in found
    assert "no law of the card holds, since the drift leaves even n=0" in found


def test_one_law_raises_no_flag():
    one = np.ones(1)
    assert LawWeights(("n=-1",), one, one, one * np.nan, one * np.nan, one.astype(bool), one).flag == ""


def test_walkers_become_draws_as_far_as_the_dimensions_allow(tests_of, card):
    campaign, tests = tests_of("paper")
    posterior = campaign_posterior(campaign, tests, Sampling(card, 0), -1.0)
    assert len(posterior.priors) == 5 + COLUMNS + 2 * len(WIND), "the curve, and what both tests have in common"
    size = max(block.members.size for block in posterior.blocks)
    assert size == len(WIND) - 1, "no record is read for the damping ratio, which the curve moves"
    least = 4 * size  # walkers that the largest block needs
    for walkers, fewer in ((16 * least, 4), (4 * least, 4), (4 * least - 4, 2), (2 * least, 2), (2 * least - 2, 1)):
        found = fewer_walkers(SamplerSettings(walkers=walkers, draws=8), size)
        assert (found.walkers, found.draws) == (walkers // fewer, 8 * fewer)
    odd = SamplerSettings(walkers=8 * least + 1, draws=8)
    assert fewer_walkers(odd, size) == odd
    assert fewer_walkers(SamplerSettings(walkers=4 * 20, draws=8), 5).walkers == 20


def test_a_checkpoint_knows_all_that_the_likelihood_reads(tests_of, card):
    campaign, tests = tests_of("paper")
    posterior = campaign_posterior(campaign, tests, Sampling(card, 0), -1.0)
    one = posterior.tests[0]
    *others, damping = one.wind.priors
    changes = [
        replace(one, mass_damping_factor=1.01 * one.mass_damping_factor),
        replace(one, factor_log_sd=0.3),
        replace(one, wind=replace(one.wind, steady=[SteadyAmplitude(0.03, 0.001, 20.0)])),
        replace(one, wind=replace(one.wind, data=one.wind.data.without("heavy-growth.csv"))),
        replace(one, wind=replace(one.wind, priors=(*others, replace(damping, first=0.0066)))),
    ]
    plain = [array.tobytes() for array in data_of(posterior)]
    for changed in changes:
        other = data_of(replace(posterior, tests=[changed, posterior.tests[1]]))
        assert [array.tobytes() for array in other] != plain


@pytest.mark.parametrize(("factor", "said"), [(1.0, False), (1.15, False), (1.8, True), (0.55, True)])
def test_rigs_that_no_curve_joins_are_named_with_the_factor(peaks_of, tests_of, factor, said):
    """The discrepancy between settings takes any contradiction, and the bands with it."""
    peaks, (_, tests) = peaks_of("paper"), tests_of("paper")
    laws = []
    for law in peaks.laws:
        amplitude = law.derived["a_star"].copy()
        amplitude[..., 1] *= factor
        laws.append(replace(law, derived={**law.derived, "a_star": amplitude}))
    sentence = off_curve(replace(peaks, laws=tuple(laws)), tests)
    assert bool(sentence) == said
    if said:
        assert all(f" {one.rig.name} " in sentence and one.test.name in sentence for one in tests)
        assert "lie on no one curve" in sentence
        told = float(sentence.split(" is ")[1].split(" times")[0])
        assert told == pytest.approx(factor, rel=0.15) or told == pytest.approx(1.0 / factor, rel=0.15)
