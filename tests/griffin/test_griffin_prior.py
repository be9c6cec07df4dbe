"""Griffin curves from the priors of a card, against draws made one by one and against known distributions."""

from dataclasses import replace

import numpy as np
import pytest

from scruton.campaign.schema import Motion
from scruton.dynamics.cycles import EnvelopeData
from scruton.dynamics.laws import amplitude_ratio
from scruton.griffin.prior import REFERENCES, prior_curves
from scruton.infer.cards import load_card, shipped_cards
from scruton.infer.hierarchy import CampaignPosterior
from scruton.infer.models import WIND, WindPosterior
from scruton.infer.peak_test import PeakTest
from scruton.stats.priors import Prior

HEAVING, TORSIONAL = REFERENCES[Motion.HEAVING], REFERENCES[Motion.TORSIONAL]


def at(curves, sc):
    """Amplitudes at one Scruton number of the grid, (S,)."""
    return curves.amplitude[:, int(np.argmin(np.abs(curves.scruton_number - sc)))]


@pytest.mark.parametrize("reference", [HEAVING, TORSIONAL], ids=["heaving", "torsional"])
def test_at_the_reference_the_amplitude_has_its_prior(reference):
    card = load_card()
    prior = card.prior("stable_amplitude", reference.motion)
    curves = prior_curves(card, reference, seed=1, draws=20000)
    found = np.log(at(curves, reference.scruton_number))
    assert found.mean() == pytest.approx(np.log(prior.first), abs=0.04)
    assert found.std() == pytest.approx(prior.second, rel=0.03)
    assert curves.band.unit == prior.unit


def test_the_laws_come_by_their_prior_weights():
    card = load_card()
    curves = prior_curves(card, HEAVING, seed=2, draws=20000)
    share = [np.mean(curves.exponent == n) for n in card.laws]
    assert share == pytest.approx(card.law_weights, abs=0.012)


@pytest.mark.parametrize("name", sorted(shipped_cards()))
def test_every_curve_is_the_law_point_by_point(name):
    curves = prior_curves(load_card(name), HEAVING, seed=3, draws=200)
    where = int(np.argmin(np.abs(curves.scruton_number - HEAVING.scruton_number)))
    sc_lambda = HEAVING.scruton_number * curves.relaxation_ratio / HEAVING.damping_ratio
    for i in range(0, 200, 17):
        for j in (0, 10, 60):
            n = curves.exponent[i]
            level, x = (
                curves.amplitude[i, where],
                (curves.scruton_number[j] - curves.scruton_number[where]) / sc_lambda[i],
            )
            assert curves.amplitude[i, j] == pytest.approx(level * amplitude_ratio(x, n), rel=1e-9)
    # a section that builds up by itself has no stable amplitude where its damping is less than that takes
    unbounded = ~np.isfinite(curves.amplitude)
    assert (curves.exponent[unbounded.any(axis=1)] < 0.0).all()
    assert not unbounded[:, where:].any()
    assert (curves.amplitude[:, 1:] <= curves.amplitude[:, :-1]).all()


def test_a_section_may_build_up_by_itself():
    """Under the paper's law with Y1 > 0, where it relaxes more slowly than by its structural damping alone."""
    curves = prior_curves(load_card("paper"), HEAVING, seed=4)
    by_itself = curves.relaxation_ratio < HEAVING.damping_ratio
    np.testing.assert_array_equal(np.isinf(curves.amplitude[:, 0]), by_itself)
    assert 0.2 < by_itself.mean() < 0.5


@pytest.mark.parametrize("name", ["paper", "ehsan-scanlan", "free-exponent"])
def test_the_draws_are_those_of_the_campaign_model(name):
    """At a known damping ratio, one test and no record: the priors of the hierarchical model, drawn by itself."""
    card = load_card(name)
    known = Prior("damping_ratio", "lognormal", HEAVING.damping_ratio, 1e-9, "-", "known")
    own = tuple(card.prior(one, Motion.HEAVING) for one in WIND[:-1])
    wind = WindPosterior((*own, known), EnvelopeData.join({}), (), 50.0, card.law_n)
    test = PeakTest("one", wind, HEAVING.mass_damping_factor, np.zeros((1, len(WIND))))
    none = Prior("discrepancy", "lognormal", 1e-6, 0.1, "-", "the curve is the shared one")
    model = CampaignPosterior(tests=[test], shared=(*own[:2], none, none), n=card.law_n or -1.0, exponent=card.exponent)
    u = model.prior_draws(np.random.default_rng(5), 20000)
    a_ref, relaxation, n = model.curve(u)
    for sc in (0.0, 43.4, 86.8):
        with np.errstate(all="ignore"):
            slow = a_ref * amplitude_ratio((sc - HEAVING.scruton_number) / relaxation, n)
        fast = at(prior_curves(card, HEAVING, seed=6, draws=20000), sc)
        for level in (0.001, 0.01, 0.05, 0.2):
            assert np.mean(fast < level) == pytest.approx(np.mean(slow < level), abs=0.015)


def test_a_narrow_prior_makes_a_narrow_band():
    card = load_card("paper")
    narrow = dict(card.priors)
    narrow["stable_amplitude.heaving"] = Prior("stable_amplitude", "lognormal", 0.05, 0.1, "A/D", "known")
    narrow["relaxation_ratio"] = Prior("relaxation_ratio", "lognormal", 0.02, 0.05, "-", "known")
    band = prior_curves(replace(card, priors=narrow), HEAVING, seed=7).band
    low, high = band.intervals[0.90]
    assert (high / low < 1.7).all()
    low, high = prior_curves(card, HEAVING, seed=7).band.intervals[0.90]
    assert (high / low > 50.0).all()


def test_the_same_seed_gives_the_same_curves():
    card = load_card("free-exponent")
    one, two, other = (prior_curves(card, TORSIONAL, seed=seed, draws=50).amplitude for seed in (1, 1, 2))
    assert np.array_equal(one, two)
    assert not np.array_equal(one, other)
