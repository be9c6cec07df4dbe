"""Leave a test out: scores against closed forms, who predicts whom, and that no prediction saw what it predicts."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats
from test_griffin_bands import TABLE_5
from test_griffin_predict import campaign_tree

from scruton.campaign import load_campaign, tests_used
from scruton.errors import InputError
from scruton.griffin import Prediction, predict
from scruton.griffin.validate import Validation, Whole, fits_needed, predict_left_out, validate
from scruton.infer.cards import load_card
from scruton.infer.fit import fit_campaign
from scruton.infer.sampling import Known
from scruton.stats.convergence import SamplerSettings
from scruton.stats.sampler import sample


def validation(draws, amplitude: float) -> Validation:
    prediction = Prediction(20.0, 0.006, "A/D", np.asarray(draws, float), {"n=-1": 1.0}, "R", {"B": 0.1}, 0.1, ())
    return Validation("A", ("B",), prediction, amplitude, True, True)


def lognormal_draws(median: float, sd: float, size: int = 20001) -> np.ndarray:
    """Quantiles rather than random numbers: closed forms hold to the width of a step."""
    return median * np.exp(sd * stats.norm.ppf((np.arange(size) + 0.5) / size))


# ------------------------------------------------------------------------------------------------ one validation


@pytest.mark.parametrize("z", [-2.5, -1.0, 0.0, 0.3, 1.7])
def test_scores_of_a_lognormal_prediction(z: float) -> None:
    one = validation(lognormal_draws(0.03, 0.2), 0.03 * np.exp(0.2 * z))
    assert one.error == pytest.approx(np.exp(-0.2 * z) - 1.0)
    assert one.factor == pytest.approx(np.exp(0.2 * 1.644854), rel=1e-3)
    assert one.z == pytest.approx(z, abs=1e-3)
    # the kernel widens the density a little: n^(-1/5) of its sd
    assert one.log_score == pytest.approx(stats.norm.logpdf(0.2 * z, 0.0, 0.2), abs=0.05)
    assert one.inside(0.90) == (abs(z) < 1.645)
    assert one.inside(0.50) == (abs(z) < 0.674)


def test_the_factor_is_that_of_the_wider_side() -> None:
    draws = lognormal_draws(0.03, 0.1)
    skewed = np.where(draws > 0.03, 0.03 * (draws / 0.03) ** 3, draws)
    assert validation(skewed, 0.03).factor == pytest.approx(np.exp(0.3 * 1.644854), rel=2e-3)
    assert validation(0.03**2 / skewed, 0.03).factor == pytest.approx(np.exp(0.3 * 1.644854), rel=2e-3)


def test_a_vibration_that_may_die_or_run_away_has_scores_still() -> None:
    draws = lognormal_draws(0.03, 0.2, 8000)
    alive = validation(draws, 0.033)
    some_die = validation(np.r_[np.zeros(2000), draws], 0.033)
    assert some_die.factor == np.inf, "the interval reaches zero"
    assert some_die.inside()
    assert some_die.log_score == pytest.approx(alive.log_score + np.log(0.8), abs=1e-9)
    # rank: the dead lie below
    rank = 0.2 + 0.8 * stats.norm.cdf(np.log(0.033 / 0.03) / 0.2)
    assert some_die.z == pytest.approx(stats.norm.ppf(rank), abs=2e-3)
    run_away = validation(np.r_[draws, np.full(2000, np.inf)], 0.033)
    assert run_away.factor == np.inf
    assert run_away.log_score == pytest.approx(some_die.log_score, abs=1e-9)
    all_die = validation(np.zeros(100), 0.033)
    assert (all_die.log_score, all_die.error) == (-np.inf, -1.0)
    assert not all_die.inside()


def test_the_normal_score_stays_within_what_the_draws_can_tell() -> None:
    draws = lognormal_draws(0.03, 0.2, 1000)
    assert validation(draws, 10.0).z == pytest.approx(stats.norm.ppf(1 - 0.5 / 1000))
    assert validation(draws, 1e-6).z == pytest.approx(stats.norm.ppf(0.5 / 1000))
    assert validation(draws, 10.0).log_score < -1000.0


# ------------------------------------------------------------------------------------------------ who predicts whom


@dataclass
class Fits:
    """Stands in for `fit_campaign`: remembers what it was given; the curve is the first test's row of Table 5."""

    calls: list
    unconverged: tuple = ()

    def __call__(self, campaign, card, *, seed, thorough, known, checkpoints=None):
        names = tuple(test.name for test in campaign.tests if test.records)
        self.calls.append((names, seed, thorough))
        rows = [TABLE_5[int(name.removeprefix("T"))] for name in names]
        fitted = [
            {"name": name, "parameters": {"a_star": {"median": row[1]}, "scruton_number": {"median": row[0]}}}
            for name, row in zip(names, rows, strict=True)
        ]
        tree = campaign_tree(rows, curve=rows[0])
        return SimpleNamespace(tree=tree, converged=names not in self.unconverged, summary={"tests": fitted})


@pytest.fixture
def three_rigs(small_campaign):
    """Three rigs with one test each, of which the second states no amplitude; and a test without records."""
    campaign = load_campaign(small_campaign)
    rig, test = campaign.rigs[0], campaign.tests[0]
    tests = [replace(test, name=f"T{i}", rig=f"R{i}", peak=None) for i in range(3)]
    tests[1] = replace(tests[1], stable_amplitude=None)
    empty = replace(test, name="T9", rig="R2", peak=None, records=())
    rigs = tuple(replace(rig, name=f"R{i}") for i in range(3))
    return replace(campaign, rigs=rigs, tests=(*tests, empty))


@pytest.fixture
def fits(monkeypatch: pytest.MonkeyPatch) -> Fits:
    made = Fits([])
    monkeypatch.setattr("scruton.infer.fit.fit_campaign", made)
    return made


def test_each_test_is_predicted_from_the_others_and_from_each_of_them(three_rigs, fits: Fits) -> None:
    told: list[tuple[str, float]] = []
    found = validate(three_rigs, load_card(), seed=4, progress=lambda *one: told.append(one))
    assert [(one.test, one.source) for one in found] == [
        ("T0", ("T1", "T2")), ("T1", ("T0", "T2")), ("T2", ("T0", "T1")),
        ("T1", ("T0",)), ("T2", ("T0",)), ("T0", ("T1",)), ("T2", ("T1",)), ("T0", ("T2",)), ("T1", ("T2",)),
    ]  # fmt: skip
    # one fit of all, one for each source, never two for the same
    assert [names for names, _, _ in fits.calls] == [
        ("T0", "T1", "T2"), ("T1", "T2"), ("T0", "T2"), ("T0", "T1"), ("T0",), ("T1",), ("T2",)
    ]  # fmt: skip
    assert {(seed, thorough) for _, seed, thorough in fits.calls} == {(4, False)}
    assert [fraction for _, fraction in told] == sorted(fraction for _, fraction in told)
    assert (told[0], told[-1], len(told)) == (("fits", 0.0), ("fits", 1.0), 8)


@pytest.mark.parametrize("singles", [True, False])
@pytest.mark.parametrize("names", [(), ("T1",), ("T0", "T2")])
def test_only_the_tests_named_are_predicted_with_as_many_fits_as_were_said(
    three_rigs, fits: Fits, names: tuple[str, ...], singles: bool
) -> None:
    found = validate(three_rigs, load_card(), tests=names, singles=singles)
    assert {one.test for one in found} == set(names or ("T0", "T1", "T2"))
    assert {len(one.source) for one in found} == ({1, 2} if singles else {2})
    assert len(fits.calls) == fits_needed(three_rigs, names, singles=singles)
    expected = {(): 7, ("T1",): 4, ("T0", "T2"): 6} if singles else {(): 4, ("T1",): 2, ("T0", "T2"): 3}
    assert len(fits.calls) == expected[names]


@pytest.mark.usefixtures("fits")
def test_a_test_at_another_wind_speed_is_not_predicted(three_rigs) -> None:
    marked = [replace(test, peak=test.name != "T9") for test in three_rigs.tests]
    with pytest.raises(InputError, match='tests: found "T9" at another wind speed; wanted the peak test of a rig'):
        validate(replace(three_rigs, tests=tuple(marked)), load_card(), tests=("T9",))


@pytest.mark.usefixtures("fits")
def test_what_is_predicted_and_what_was_found(three_rigs) -> None:
    found = validate(three_rigs, load_card())
    stated = three_rigs.tests[0].stable_amplitude.mean
    for one in found:
        row = TABLE_5[int(one.test[1])]
        assert one.prediction.scruton_number == pytest.approx(row[0])
        assert (one.amplitude, one.measured) == ((row[1], False) if one.test == "T1" else (stated, True))
        sc, a, slope = TABLE_5[int(one.source[0][1])]
        assert one.prediction.median == pytest.approx(1.0 / (1.0 / a + slope * (row[0] - sc)))


@pytest.mark.usefixtures("fits")
def test_single_tests_may_be_left_out_and_two_rigs_have_none_beside(three_rigs) -> None:
    assert len(validate(three_rigs, load_card(), singles=False)) == 3
    two = replace(three_rigs, tests=three_rigs.tests[:2])
    assert [(one.test, one.source) for one in validate(two, load_card())] == [("T0", ("T1",)), ("T1", ("T0",))]


@pytest.mark.parametrize(
    ("unconverged", "trusted"),
    [
        ((), [True, True, True]),
        ((("T0", "T2"),), [True, False, True]),
        ((("T0", "T1", "T2"),), [False, False, False]),
    ],
)
def test_a_fit_that_has_not_converged_is_not_trusted(three_rigs, fits: Fits, unconverged, trusted) -> None:
    fits.unconverged = unconverged
    assert [one.trusted for one in validate(three_rigs, load_card(), singles=False)] == trusted


def test_one_rig_predicts_nobody(small_campaign, monkeypatch) -> None:
    """It is refused before anything is fitted."""
    monkeypatch.setattr("scruton.infer.fit.fit_campaign", None)
    campaign = load_campaign(small_campaign)
    campaign = replace(campaign, tests=(replace(campaign.tests[0], name="T0"),))
    with pytest.raises(InputError, match="tests: found 1 rig with records in wind; wanted two or more"):
        validate(campaign, load_card())


# ------------------------------------------------------------------------------------------------ with real fits


@pytest.fixture(scope="module")
def quick():
    card = load_card("paper")
    sampler = SamplerSettings(ensembles=2, walkers=64, draws=8, min_ess=200, max_rhat=1.05)
    return replace(card, sampler=sampler)


@pytest.fixture(scope="module")
def crossed(two_rigs, quick):
    return validate(load_campaign(two_rigs("paper")), quick, seed=1)


def test_records_of_one_law_predict_each_other(crossed) -> None:
    assert [(one.test, one.source) for one in crossed] == [
        ("heavy in wind", ("light in wind",)), ("light in wind", ("heavy in wind",))
    ]  # fmt: skip
    for one in crossed:
        assert one.measured
        assert one.trusted
        assert abs(one.error) < 0.05
        assert one.inside(0.90)
        # one setting misses another by sqrt(2) times the median discrepancy of the card, 0.09, and by more in the tails
        assert np.exp(1.645 * 0.09) < one.factor < np.exp(1.645 * 0.25)
        assert one.log_score > stats.norm.logpdf(0.0, 0.0, 0.25)


def test_what_a_part_shares_with_the_whole_is_drawn_once(two_rigs, quick, crossed, monkeypatch) -> None:
    """Rigs and tests of the whole are not sampled again, and nothing changes by that."""
    drawn = []

    def spy(*asked):
        drawn.append(sample(*asked))
        return drawn[-1]

    monkeypatch.setattr("scruton.infer.sampling.sample", spy)
    known = Known()
    campaign = load_campaign(two_rigs("paper"))
    fit = fit_campaign(campaign, quick, seed=1, thorough=False, known=known)
    first = len(drawn)
    assert first == len(known) == 3
    again = predict_left_out(Whole(campaign, quick, 1, fit.summary["tests"], fit.converged, known))
    assert len(drawn) == first + 2, "the campaign model of each part alone"
    for one, other in zip(again, crossed, strict=True):
        np.testing.assert_array_equal(one.prediction.draws, other.prediction.draws)
    # another seed draws anew: given what the first drew, which takes no time
    before, asked = iter(drawn[:first]), []
    monkeypatch.setattr("scruton.infer.sampling.sample", lambda *what: asked.append(what) or next(before))
    fit_campaign(campaign, quick, seed=2, thorough=False, known=known)
    assert len(asked) == first


def test_no_prediction_sees_the_records_that_it_predicts(two_rigs, quick, crossed) -> None:
    campaign = load_campaign(two_rigs("paper"))
    light = next(test for test in campaign.tests if test.name == "light in wind")
    alone = fit_campaign(tests_used(campaign, ("heavy in wind",)), quick, seed=1, thorough=False)
    one = crossed[1]
    # only the Scruton number of the setting comes from the test itself
    again = predict(alone.tree, scruton_number=one.prediction.scruton_number, seed=1)
    np.testing.assert_array_equal(one.prediction.draws, again.draws)
    assert one.test == light.name
    assert one.amplitude == light.stable_amplitude.mean
