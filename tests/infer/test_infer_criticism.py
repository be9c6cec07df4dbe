"""Criticism: every check against a case where the answer is known, and against one that it must find out."""

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy import stats

from scruton.documents import as_json
from scruton.infer import replication, sensitivity
from scruton.infer.criticism import criticise_tree
from scruton.infer.models import NOISE
from scruton.stats import whiteness

N = 80


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(3)


def small(adjusted: list[whiteness.Check], name: str) -> bool:
    return any(one.adjusted < 0.01 for one in adjusted if one.name == name)


# --- whiteness -------------------------------------------------------------------------------------------------------


def test_holm_is_the_textbook_example_and_skips_what_is_missing() -> None:
    np.testing.assert_allclose(whiteness.holm([0.01, 0.04, 0.03, 0.005]), [0.03, 0.06, 0.06, 0.02])
    np.testing.assert_allclose(whiteness.holm([0.01, np.nan, 0.4]), [0.02, np.nan, 0.4])


def test_anderson_darling_agrees_with_scipy(rng: np.random.Generator) -> None:
    x = rng.standard_normal(60)
    with warnings.catch_warnings(action="ignore"):  # scipy is about to change what it returns beside the statistic
        reference = stats.anderson(x, "norm")
    scale = 1.0 + 0.75 / 60 + 2.25 / 60**2
    assert whiteness.anderson_darling(x)[0] == pytest.approx(reference.statistic * scale, rel=1e-6)
    # the 5 % point of the case of unknown mean and variance
    assert whiteness.anderson_darling(stats.norm.ppf((np.arange(60) + 0.5) / 60))[1] > 0.9


@pytest.mark.parametrize("name", ["ljung_box", "anderson_darling", "trend", "curvature"])
def test_p_values_are_uniform_where_the_model_is_right(name: str, rng: np.random.Generator) -> None:
    amplitude = 0.03 + 0.04 * np.exp(-np.arange(N) / 15.0)

    def p(x: np.ndarray) -> float:
        match name:
            case "ljung_box":
                return whiteness.ljung_box(x, 16)[1]
            case "anderson_darling":
                return whiteness.anderson_darling(x)[1]
            case "trend":
                return whiteness.trend(x, amplitude)[1]
            case _:
                return whiteness.curvature(x, amplitude)[1]

    found = np.array([p(rng.standard_normal(N)) for _ in range(600)])
    # Ljung-Box is approximate: it is asked for its tail alone
    assert 0.02 < np.mean(found < 0.05) < 0.09
    if name in ("trend", "curvature"):
        assert stats.kstest(found, "uniform").pvalue > 1e-3


def judged(x: np.ndarray, amplitude: np.ndarray) -> list[whiteness.Check]:
    return list(whiteness.judge(x, amplitude, ["t"] * x.size, ["r"] * x.size))


def test_white_innovations_pass_and_the_first_cycle_does_not_count(rng: np.random.Generator) -> None:
    x = rng.standard_normal(N)
    x[0] = 1e6
    assert all(one.adjusted > 0.01 for one in judged(x, np.linspace(1.0, 2.0, N)))


def test_every_fault_is_found_by_the_check_that_is_made_for_it(rng: np.random.Generator) -> None:
    x, amplitude = rng.standard_normal(N), np.linspace(1.0, 2.0, N)
    memory = x.copy()
    for k in range(1, N):
        memory[k] += 0.7 * memory[k - 1]
    assert small(judged(memory, rng.permutation(amplitude)), whiteness.MEMORY)
    bent = x + 12.0 * (amplitude - 1.5) ** 2
    assert small(judged(bent, amplitude), whiteness.TREND)
    assert small(judged(bent, amplitude), whiteness.LAW)
    assert small(judged(2.0 * x, amplitude), whiteness.VARIANCE)
    assert small(judged(x + 1.0, amplitude), whiteness.MEAN)
    assert small(judged(rng.standard_t(2, N), amplitude), whiteness.NORMALITY)


def test_records_of_the_same_name_in_two_tests_are_two_records(rng: np.random.Generator) -> None:
    test = np.repeat(["a", "b"], N)
    found = whiteness.judge(rng.standard_normal(2 * N), np.tile(np.linspace(1, 2, N), 2), test, ["r"] * (2 * N))
    assert [(one.test, one.record) for one in found if one.name == whiteness.MEAN] == [("a", "r"), ("b", "r")]


# The simulator's own section; under Van der Pol damping it starts slowly and falls fast, which n = -1 cannot.
VAN_DER_POL = {"Y1": 25.0, "epsilon": 1500.0, "force": "ehsan-scanlan"}
PAPER = {"Y1": -11.111, "epsilon": 0.03235}


def judged_simulation(truth: dict[str, Any], n: float, seed: int, *, departs: bool = True) -> list[str]:
    """Records of the full equation of motion, fitted at the optimum; names of the checks that find them not white."""
    from scruton.campaign.schema import Motion
    from scruton.dynamics.cycles import EnvelopeData
    from scruton.envelope import demodulate
    from scruton.infer.cards import load_card
    from scruton.infer.models import WIND, WindPosterior
    from scruton.simulate import Noise, Truth, simulate_record
    from scruton.stats.optimum import find_optimum
    from scruton.stats.priors import Prior

    section = Truth(Motion.HEAVING, 0.3, 0.075, 7.292, 7.87, 0.0065, 1.22, 5.036, **truth)
    stable, _ = section.balance()
    cycles = {}
    for name, start in (("decay", 2.5), ("growth", 0.1)):
        time, response = simulate_record(
            section, sample_rate=100.0, duration=9.0, initial_amplitude=start * stable,
            noise=Noise(0.01, sensor_noise=1e-4), seed=np.random.SeedSequence([seed, int(name == "growth")]),
        )  # fmt: skip
        cycles[name] = demodulate(time, response)
    data = EnvelopeData.join(cycles)
    card = load_card("default")
    priors = [card.prior(one, Motion.HEAVING) for one in WIND[:-1] if departs or one != "departure_scale"]
    damping = Prior("damping_ratio", "lognormal", 0.0065, 0.05)
    posterior = WindPosterior((*priors, damping), data, (), 2 * np.pi * 7.87, n)
    best = find_optimum(posterior, np.random.default_rng(0)).centre
    innovation, variance = posterior.innovations(best[None])
    checks = whiteness.judge((innovation / np.sqrt(variance))[:, 0], data.amplitude, ["test"] * data.size, data.record)
    return [one.name for one in checks if one.name in whiteness.PREDICTABLE and one.adjusted < 0.01]


def test_van_der_pol_records_fitted_with_the_paper_s_law_alone_are_found_out() -> None:
    """With a departure from the law the innovations are white, and its scale says that the law is not theirs."""
    for seed in range(5):
        assert whiteness.LAW in judged_simulation(VAN_DER_POL, -1.0, seed, departs=False)


def test_records_fitted_with_their_own_law_are_not() -> None:
    found = [judged_simulation(PAPER, -1.0, seed) for seed in range(8)]
    found += [judged_simulation(VAN_DER_POL, 2.0, seed) for seed in range(8)]
    assert sum(map(bool, found)) <= 2  # one in fifty is expected


# --- predictive ------------------------------------------------------------------------------------------------------


def test_time_to_half_of_an_exponential_is_its_half_life() -> None:
    time = np.linspace(0.0, 20.0, 801) + 5.0
    y = 1.0 + 2.0 * np.exp(-(time - 5.0) / 1.7)
    both = np.stack([y, 4.0 - y])  # decay and growth
    np.testing.assert_allclose(replication.time_to_half(time, both), 1.7 * np.log(2.0), rtol=2e-3)
    assert np.isfinite(replication.time_to_half(time, np.ones((1, time.size)))).all()


def free_runs(rng: np.random.Generator, runs: int, *, spread: float = 0.02) -> tuple[np.ndarray, np.ndarray]:
    time = np.arange(N) * 0.1
    rate = 1.0 + 0.05 * rng.standard_normal((runs, 1))
    mean = 1.0 + 1.5 * np.exp(-rate * time)
    return mean, mean + spread * rng.standard_normal(mean.shape)


def test_a_replicate_passes_for_the_record_and_a_stranger_does_not(rng: np.random.Generator) -> None:
    time = np.arange(N) * 0.1
    mean, replicate = free_runs(rng, 250)
    observed = free_runs(rng, 1)[1][0]
    checks, shares = replication.posterior_check("t", "r", time, observed, replicate, mean)
    assert min(one.p for one in checks) > 0.02
    assert [one.level for one in shares] == [0.5, 0.9]
    assert shares[1].low <= shares[1].share <= 1.0
    noisy, _ = replication.posterior_check("t", "r", time, free_runs(rng, 1, spread=0.1)[1][0], replicate, mean)
    assert {one.name for one in noisy if one.p < 1e-6} >= {replication.SCATTER, replication.EXCURSION}


def test_predictive_p_follows_the_rank_and_goes_beyond_the_last_draw(rng: np.random.Generator) -> None:
    draws = rng.standard_normal(250)
    inside = replication.discrepancy_p(np.full(250, np.sort(draws)[10]), draws, positive=False)
    assert inside == pytest.approx(2.0 * 12 / 251)
    far = replication.discrepancy_p(np.full(250, 6.0), draws, positive=False)
    assert far == pytest.approx(2.0 * stats.norm.sf((6.0 - draws.mean()) / draws.std(ddof=1)), rel=1e-6)


def test_prior_replicates_have_the_moments_that_the_equation_gives(rng: np.random.Generator) -> None:
    size = 4000
    prior = {
        "a_star": np.full(size, 0.05),
        "relaxation_rate": np.full(size, 0.8),
        "n": np.full(size, -1.0),
        "amplitude_scatter": np.full(size, 0.05),
        "noise_factor": np.full(size, 2.0),
        "gust_scatter": np.full(size, 0.12),  # no tunnel is worse than 6 %, and none is set worse than 3 %
        "gust_time": np.full(size, 2.0),
        "set_point_scatter": np.full(size, 0.08),
        "departure_scale": np.zeros(size),
    }
    assert {*NOISE} < {*prior}
    time = 3.0 + 0.1 * np.arange(60)
    error = np.full(60, 2.5e-4)
    found = replication.prior_replicates(time, error, 0.1, prior, rng)
    t = time - time[0]
    np.testing.assert_allclose(found.mean(axis=0), 0.05 + 0.05 * np.exp(-0.8 * t), atol=4 * 0.008 / np.sqrt(size))
    keep, push = np.exp(-0.8 * t), 0.8 * (np.exp(-0.4 * t) - np.exp(-0.8 * t)) / (0.8 - 0.4)
    gust = 0.8 / (0.8 + 0.4) * (1.0 - keep**2 - 2.0 * keep * push)  # of an amplitude that knows nothing of it at first
    variance = 0.0025**2 * (1.0 - keep**2) + 0.003**2 * gust + 0.0015**2 * (1.0 - keep) ** 2
    sd = np.sqrt(variance + 0.0005**2)
    np.testing.assert_allclose(found.std(axis=0), sd, rtol=0.06)
    # What a wake remembers pushes as a gust of its own, beside the departure, which the scale of 0.5 has.
    departed = prior | {"departure_scale": np.full(size, 0.5)}
    at_rest = replication.prior_replicates(time, error, 0.05, departed, rng)  # where the drift has nothing to depart
    remembered = variance + (0.25 * 0.05 * push) ** 2
    np.testing.assert_allclose(at_rest[:, :5].std(axis=0), np.sqrt(remembered[:5] + 0.0005**2), rtol=0.06)


def test_an_absurd_prior_is_called_so(rng: np.random.Generator) -> None:
    time, observed = 0.1 * np.arange(60), np.full(60, 0.01)
    check = replication.prior_check("t", "r", time, observed, np.full((100, 60), 5.0), np.full(100, 50.0), 0.02)
    assert (check.huge, check.instant, check.inside) == (1.0, 1.0, 0.0)
    assert check.p_final == pytest.approx(2.0 / 101)


# --- sensitivity -----------------------------------------------------------------------------------------------------


def normal_tree(prior_mean: float, prior_sd: float, data_mean: float, data_sd: float, seed: int = 1) -> xr.DataTree:
    """Exact posterior of one normal parameter, ln a*, with a flat prior on all else."""
    rng = np.random.default_rng(seed)
    precision = prior_sd**-2 + data_sd**-2
    mean = (prior_mean / prior_sd**2 + data_mean / data_sd**2) / precision
    x = mean + rng.standard_normal((40, 100)) / np.sqrt(precision)
    like = stats.norm.logpdf(data_mean, x, data_sd)
    own = stats.norm.logpdf(x, prior_mean, prior_sd)
    dims = ("chain", "draw", "test")
    flat = np.zeros((40, 100, 1))

    def group(arrays: dict[str, np.ndarray]) -> xr.Dataset:
        return xr.Dataset({k: (dims, v.reshape(40, 100, 1)) for k, v in arrays.items()}).assign_coords(test=["t"])

    return xr.DataTree.from_dict(
        {
            "/examined": group(
                {"a_star": np.exp(x), "lp_prior": own, "lp_noise": flat, "lp_still_air": flat, "lp_records": like}
            ),
            "/prior": group({"stable_amplitude": np.exp(prior_mean + prior_sd * rng.standard_normal((40, 100)))}),
        }
    )


@pytest.mark.parametrize(
    ("prior", "data", "diagnosis"),
    [((0.0, 10.0), (0.5, 0.1), "-"), ((5.0, 0.4), (0.0, 0.4), "prior-data conflict"),
     ((0.0, 0.1), (0.0, 3.0), "weak likelihood")],
)  # fmt: skip
def test_power_scaling_tells_a_conflict_from_a_weak_likelihood(
    prior: tuple[float, float], data: tuple[float, float], diagnosis: str
) -> None:
    (found,) = sensitivity.power_scaling(normal_tree(*prior, *data))
    assert found.diagnosis == diagnosis
    assert found.still_air == 0.0  # a flat factor has no tail to smooth, and no influence


def test_power_scaling_is_arviz_s_own() -> None:
    import arviz as az

    tree = normal_tree(1.0, 0.5, 0.0, 0.5)
    (found,) = sensitivity.power_scaling(tree)
    examined = tree["examined"].to_dataset()
    reference = az.psense_summary(
        xr.DataTree.from_dict(
            {
                "/posterior": examined[["a_star"]],
                "/log_prior": examined[["lp_prior"]],
                "/log_likelihood": examined[["lp_records"]],
            }
        ),
        round_to=8,
    )
    assert found.prior == pytest.approx(float(reference["prior"].iloc[0]), abs=1e-6)
    assert found.likelihood == pytest.approx(float(reference["likelihood"].iloc[0]), abs=1e-6)


def test_what_the_data_did_not_move_is_named() -> None:
    (idle,) = sensitivity.identifiability(normal_tree(0.0, 0.1, 0.0, 3.0))
    assert idle.verdict == "not moved by the data"
    assert idle.ratio == pytest.approx(1.0, abs=0.05)
    (half,) = sensitivity.identifiability(normal_tree(0.0, 1.0, 0.0, 0.8))
    assert half.verdict == "barely moved by the data"
    assert half.ratio == pytest.approx(0.8 / np.hypot(1.0, 0.8), abs=0.03)


def test_leaving_a_factor_out_gives_the_posterior_without_it(rng: np.random.Generator) -> None:
    # two factors of one normal parameter: N(0, 1) and N(1, 2); without the second N(0, 1)
    precision = 1.0 + 0.25
    x = 0.25 / precision + rng.standard_normal(4000) / np.sqrt(precision)
    (found,) = sensitivity.left_out("r", stats.norm.logpdf(x, 1.0, 2.0), {"a_star": x})
    sd = 1.0 / np.sqrt(precision)
    assert found.trusted
    assert found.shift == pytest.approx(-0.2 / sd, abs=0.05)
    assert found.widening == pytest.approx(1.0 / sd, rel=0.03)
    assert found.z == pytest.approx(-0.2 / np.sqrt(1.0 - sd**2), abs=0.15)


def test_weights_that_have_nothing_to_do_with_a_parameter_do_not_move_it(rng: np.random.Generator) -> None:
    """Few draws and a wild log density move anything a little; beyond chance it is nothing."""
    draws, log_density = rng.standard_normal(500), 3.0 * rng.standard_normal(500)
    weights = sensitivity.scaled_weights(log_density)
    assert sensitivity.sensitivity(draws, weights) > 0.03
    assert sensitivity.beyond_chance(draws, weights) < 0.05
    related = sensitivity.scaled_weights(3.0 * draws)
    raw = sensitivity.sensitivity(draws, related)
    assert sensitivity.beyond_chance(draws, related) == pytest.approx(raw, rel=0.05)


def test_how_far_draws_move_is_arvizs_number(rng: np.random.Generator) -> None:
    from arviz_stats.base import array_stats

    lower, upper = sensitivity.ALPHAS
    for _ in range(10):
        draws = rng.standard_normal(700) + 1.5
        weights = sensitivity.scaled_weights(rng.uniform(0.1, 3.0) * draws**2 + rng.standard_normal(700))
        assert weights is not None
        told = array_stats.power_scale_sense(
            draws[None],
            *(one[None] for one in weights),
            lower_alpha=lower,
            upper_alpha=upper,
            chain_axis=0,
            draw_axis=1,
        )
        assert sensitivity.sensitivity(draws, weights) == pytest.approx(float(told), rel=1e-9)


def test_a_record_that_says_nearly_everything_is_not_reweighted_away(rng: np.random.Generator) -> None:
    x = 0.1 * rng.standard_normal(1000)
    (found,) = sensitivity.left_out("r", stats.norm.logpdf(x, 0.0, 0.1), {"a_star": x})
    assert not found.trusted


def test_a_draw_that_stuck_where_a_record_hardly_fits_is_no_weight_to_trust(rng: np.random.Generator) -> None:
    x = np.concatenate([rng.standard_normal(800), np.full(200, 5.0)])
    (found,) = sensitivity.left_out("r", stats.norm.logpdf(x), {"a_star": x})
    assert not found.trusted


# --- a whole fit -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def fitted(small_results: Path) -> tuple[xr.DataTree, dict[str, Any]]:
    from scruton.infer.store import read_tree

    return read_tree(small_results)


def with_innovations(tree: xr.DataTree, values: np.ndarray | None = None) -> xr.DataTree:
    size = tree["observed_data"]["amplitude"].size
    values = np.random.default_rng(4).standard_normal(size) if values is None else values
    found = tree.copy()
    found["innovations"] = xr.DataTree(xr.Dataset({"amplitude": ("cycle", values)}))
    return found


def test_a_good_fit_gives_no_serious_flag_and_finite_numbers(fitted: tuple[xr.DataTree, dict[str, Any]]) -> None:
    tree, summary = fitted
    found = criticise_tree(tree if "innovations" in tree else with_innovations(tree), summary)
    assert found.ok
    assert all(np.isfinite([one.prior, one.likelihood, one.still_air]).all() for one in found.scaling)
    assert {one.parameter for one in found.scaling} == set(sensitivity.SCALED)
    ratios = {one.parameter: one.ratio for one in found.moved}
    assert ratios["a_star"] < 0.05
    assert ratios["damping_ratio"] == pytest.approx(1.0, abs=0.1)
    assert ratios["discrepancy_amplitude"] == pytest.approx(1.0, abs=0.1)  # one rig: the prior is all there is
    assert len(found.influence) == 4
    assert found.model.startswith("the law n=-1")
    # clean records: nothing to look at, and what reweighting cannot tell is no fault of theirs
    assert not [flag for flag in found.flags if flag.check in ("influence", "prior sensitivity", "identifiability")]
    untold = {one.record for one in found.influence if not one.trusted}
    assert all(any(name in text for text in found.missing) for name in untold)
    json.dumps(found.to_json(), allow_nan=False)


def test_bent_innovations_make_the_fit_one_not_to_be_trusted(fitted: tuple[xr.DataTree, dict[str, Any]]) -> None:
    tree, summary = fitted
    amplitude = tree["observed_data"]["amplitude"].to_numpy()
    bent = np.random.default_rng(4).standard_normal(amplitude.size)
    bent[1:] += 1.5 * ((amplitude[:-1] - amplitude.mean()) / amplitude.std()) ** 2
    found = criticise_tree(with_innovations(tree, bent), summary)
    assert not found.ok
    assert any("law of damping has another shape" in one.text for one in found.flags if one.serious)


def test_what_the_fit_says_of_its_laws_and_its_curve_is_said_again(fitted: tuple[xr.DataTree, dict[str, Any]]) -> None:
    tree, summary = fitted[0].copy(), fitted[1]
    before = {flag.text for flag in criticise_tree(tree, summary).flags}
    tree["laws"].attrs["doubted"] = "the drift leaves even n=0"
    tree["campaign_posterior"].attrs["off_curve"] = "rig 2 lies off the curve of the others"
    tree["effect"] = xr.DataTree(xr.Dataset(attrs={"effect": "fluid_memory"}))
    found = criticise_tree(tree, summary)
    said = [flag.text for flag in found.flags if flag.text not in before]
    assert said[0].startswith("no law of the card holds, since the drift leaves even n=0")
    assert said[1:] == ["rig 2 lies off the curve of the others"]
    assert found.ok
    assert any("the curve with fluid_memory" in text for text in found.missing)


def test_what_the_results_do_not_hold_is_explained(fitted: tuple[xr.DataTree, dict[str, Any]]) -> None:
    tree, summary = fitted
    kept = ("posterior", "constant_data", "observed_data")
    bare = xr.DataTree.from_dict({f"/{name}": tree[name].to_dataset() for name in kept})
    found = criticise_tree(bare, summary)
    assert found.ok
    text = "\n".join(found.missing)
    for part in ("innovations", "posterior predictive", "sensitivity", "influence", "fit again"):
        assert part in text


def test_the_same_seed_gives_the_same_numbers(fitted: tuple[xr.DataTree, dict[str, Any]]) -> None:
    one, two, other = (criticise_tree(*fitted, seed=seed).to_json() for seed in (1, 1, 2))
    assert one == two
    assert one["prior_predictive"] != other["prior_predictive"]


def test_missing_numbers_become_null() -> None:
    assert as_json({"a": [float("nan"), 1.0], "b": (np.inf, "x")}) == {"a": [None, 1.0], "b": [None, "x"]}
