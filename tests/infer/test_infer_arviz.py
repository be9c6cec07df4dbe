"""What users of ArviZ expect of posterior.nc: its summary, its checks, its names and its units."""

import arviz as az
import numpy as np
import pytest
import xarray as xr

from scruton.infer.result_schema import MODEL, SCHEMA, group_of, joined
from scruton.infer.store import read_tree


@pytest.fixture(scope="module")
def tree(small_results):
    return read_tree(small_results)[0]


@pytest.fixture
def rng():
    return np.random.default_rng(5)


@pytest.fixture(scope="module")
def model(tree):
    return tree[MODEL]


# --- chains -----------------------------------------------------------------------------------------------------------


def walkers(rho: float, count: int, draws: int, rng: np.random.Generator) -> np.ndarray:
    """Independent walkers whose draws have the autocorrelation rho^k, from stationarity on."""
    x = np.empty((count, draws))
    x[:, 0] = rng.standard_normal(count)
    for k in range(1, draws):
        x[:, k] = rho * x[:, k - 1] + np.sqrt(1.0 - rho**2) * rng.standard_normal(count)
    return x


def effective(x: np.ndarray) -> float:
    return float(az.ess(x, method="bulk"))


@pytest.mark.parametrize(("rho", "draws"), [(0.0, 8), (0.5, 8), (0.9, 8), (0.9, 32)])
def test_walkers_end_to_end_give_the_right_effective_number(rho, draws):
    """The truth is the variance of the mean of independent walkers, exactly, whose draws have this autocorrelation."""
    count, lags = 8192 // draws, np.arange(1, draws)
    tau = 1.0 + 2.0 * np.sum((1.0 - lags / draws) * rho**lags)
    found = []
    for seed in range(8):
        x = walkers(rho, count, draws, np.random.default_rng(seed))
        chains = joined(x, np.repeat(np.arange(4), count // 4))
        assert chains.shape == (4, 2048)
        np.testing.assert_array_equal(chains.reshape(-1), x.reshape(-1))
        found.append(effective(chains))
    assert found == pytest.approx([8192 / tau] * 8, rel=0.25)
    assert np.mean(found) == pytest.approx(8192 / tau, rel=0.06)


def test_walkers_as_chains_of_eight_draws_would_flatter(rng):
    """What arviz makes of a thousand short chains: several times the draws that there are."""
    assert effective(walkers(0.5, 1024, 8, rng)) > 2.0 * 8192


def test_draws_of_walkers_side_by_side_would_flatter(rng):
    """In the other order an autocorrelation would not be seen: this is why walkers stand end to end."""
    x = walkers(0.9, 1024, 8, rng)
    flattened = x.reshape(4, 256, 8).transpose(0, 2, 1).reshape(4, 2048)
    assert effective(flattened) > 3.0 * effective(joined(x, np.repeat(np.arange(4), 256)))


def test_an_ensemble_elsewhere_is_seen(rng):
    x = walkers(0.3, 1024, 8, rng)
    x[:256] += 1.0
    assert float(az.rhat(joined(x, np.repeat(np.arange(4), 256)))) > 1.05


def test_a_converged_fit_converges_by_its_summary(tree, model):
    for group in (tree["posterior"], tree["campaign_posterior"], tree["trial_function"], model["posterior"]):
        moving = [name for name, one in group.data_vars.items() if "draw" in one.dims and np.ptp(one.values) > 0.0]
        table = az.summary(group.to_dataset()[moving], round_to="none")
        assert table["r_hat"].max() < 1.01
        assert group.sizes["chain"] == 4
    # the campaign model has some of the draws of its law
    kept, law = model["posterior"]["draw"].to_numpy(), tree["campaign_posterior"].to_dataset().isel(law=0)
    for name in ("reference_amplitude", "reference_relaxation", "discrepancy_amplitude", "discrepancy_relaxation"):
        np.testing.assert_array_equal(model["posterior"][name], law[name].isel(draw=kept))


def test_the_sampler_speaks_of_itself(tree):
    stats = tree["sample_stats"].to_dataset().isel(test=0)
    assert 0.1 < float(stats["acceptance_rate"]) < 1.0
    assert float(stats["rhat_nested"].max()) < 1.01
    assert stats["converged"].item()
    assert (stats["autocorrelation_time"] > 0.9).all()
    row = tree["convergence"].to_dataset().to_dataframe().set_index(["posterior", "parameter"])
    assert float(stats["ess_bulk"].sel(parameter="gust_time")) == row.loc[("test Sc 21.7", "gust_time"), "ess_bulk"]


def test_tests_by_themselves_are_power_scaled(tree):
    """Of every test alone: its records move what they tell, its priors do not."""
    table = az.psense_summary(tree, var_names=["a_star", "relaxation_rate", "gust_time"])
    values = table[["prior", "likelihood"]].astype(float)
    assert np.isfinite(values.to_numpy()).all()
    told = values[~values.index.str.startswith("gust_time")]
    assert (told["likelihood"] > told["prior"]).all()
    likelihood = tree["log_likelihood"]["records"]
    prior = sum(one for one in tree["log_prior"].data_vars.values())
    np.testing.assert_allclose(likelihood + prior, tree["sample_stats"]["lp"])


# --- the campaign model, as ArviZ reads a model -----------------------------------------------------------------------


def test_the_groups_of_the_model_are_of_the_same_draws(model):
    for name in ("log_likelihood", "log_prior", "posterior_predictive", "sample_stats"):
        for dimension in ("chain", "draw"):
            xr.testing.assert_equal(model[name][dimension], model["posterior"][dimension])


def test_the_model_s_log_posterior_is_the_sum_of_its_parts(model):
    """From one test: the log likelihood and the log priors that are kept, and what joins the test to the curve."""
    likelihood = (
        model["log_likelihood"]["amplitude"].astype(float).sum("cycle") + model["log_likelihood"]["steady"][..., 0]
    )
    assert np.corrcoef(likelihood.values.ravel(), model["sample_stats"]["lp"].values.ravel())[0, 1] > 0.3
    prior = sum(one.sum([d for d in one.dims if d == "test"]) for one in model["log_prior"].data_vars.values())
    rest = model["sample_stats"]["lp"] - likelihood - prior
    tau, kappa = (model["posterior"][f"discrepancy_{of}"] for of in ("amplitude", "relaxation"))
    # two normal densities about the curve remain: never above their peak
    assert float((rest + np.log(tau) + np.log(kappa)).std()) < 3.0


def test_leave_one_out_and_power_scaling_run(model):
    loo = az.loo(model, var_name="amplitude", pointwise=True)
    assert np.isfinite(loo.elpd)
    assert float((loo.pareto_k > 0.7).mean()) == 0.0
    table = az.psense_summary(model, var_names=["a_star", "relaxation_rate"])
    assert np.isfinite(table[["prior", "likelihood"]].to_numpy(dtype=float)).all()
    assert (table["likelihood"] > table["prior"]).all(), "the records speak, not the prior"


def test_one_step_predictives_are_uniform_where_the_model_holds(model):
    """Cycles given those before them; of free runs the ranks would hang together."""
    pit = az.loo_pit(model)["amplitude"].values
    assert pit.mean() == pytest.approx(0.5, abs=0.06)
    assert pit.std() == pytest.approx(np.sqrt(1 / 12), abs=0.03)
    assert abs(np.corrcoef(pit[1:], pit[:-1])[0, 1]) < 0.2


def test_predictives_lie_along_the_cycles_alone(tree, model):
    """Another dimension in their group, even without a variable, and ArviZ's predictive plots refuse it."""
    for of in (tree, model):
        for group in ("posterior_predictive", "prior_predictive"):
            assert set(of[group].sizes) <= {"chain", "draw", "cycle"}


def test_records_can_be_told_apart(model):
    observed, replicate = (model[name]["amplitude"] for name in ("observed_data", "posterior_predictive"))
    assert set(observed["record"].values) == {"decay.csv", "growth.csv"}
    growth = replicate.isel(cycle=np.flatnonzero(replicate["record"] == "growth.csv"))
    assert growth.sizes["cycle"] < observed.sizes["cycle"]
    by_cycle = model["log_likelihood"]["amplitude"]
    by_record = by_cycle.groupby(observed["record"]).sum()
    np.testing.assert_allclose(by_record.sum("record"), by_cycle.sum("cycle"), rtol=1e-3)
    by_record = model["log_likelihood"]["amplitude"].groupby(observed["record"]).sum()
    assert by_record.sizes["record"] == 2


# --- names and units --------------------------------------------------------------------------------------------------


def test_the_prior_has_the_names_of_the_posterior(tree, model):
    assert set(tree["posterior"].data_vars) <= set(tree["prior"].data_vars)
    assert set(model["posterior"].data_vars) == set(model["prior"].data_vars)
    prior, posterior = tree["prior"].isel(test=0), tree["posterior"].isel(test=0)
    np.testing.assert_allclose(prior["a_star"], prior["stable_amplitude"])
    for name in ("a_star", "relaxation_rate", "Y1", "epsilon"):
        assert float(np.log(abs(prior[name])).std()) > float(np.log(abs(posterior[name])).std()), name


def test_what_the_prior_expects_holds_the_records(tree, model):
    for one in (tree, model):
        low, high = one["prior_predictive"]["amplitude"].quantile([0.01, 0.99], ("chain", "draw"))
        observed = one["observed_data"]["amplitude"]
        assert float(((observed > low) & (observed < high)).mean()) > 0.95


def test_every_variable_has_a_unit_and_a_long_name(tree):
    for node in tree.subtree:
        for name, column in node.variables.items():
            assert column.attrs["units"], (node.path, name)
            assert column.attrs["long_name"], (node.path, name)
    assert tree["posterior"]["a_star"].attrs["units"] == "A/D"
    assert tree["posterior"]["relaxation_rate"].attrs["units"] == "1/s"


def test_a_group_is_found_by_its_path(tree):
    assert all(group_of(tree, name) is not None for name in SCHEMA if name.startswith(MODEL))
    assert group_of(tree, f"{MODEL}/nothing") is None
