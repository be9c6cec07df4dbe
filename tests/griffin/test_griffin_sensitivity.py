"""How predictions follow the card: against what a card with other priors would give, and one rig at a stated tau."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from test_griffin_predict import ROW, campaign_tree

from scruton.dynamics.laws import amplitude_ratio
from scruton.griffin import predict, predictive_draws
from scruton.griffin.discrepancy import STATED, one_rig, with_discrepancy
from scruton.griffin.sensitivity import points_of, prediction_sensitivity, weighted_band
from scruton.stats.convergence import monte_carlo_error
from scruton.stats.priors import Prior

PRIOR = Prior("discrepancy_amplitude", "lognormal", 0.1, 0.8)
SHAPE = (40, 500)


def of_card(monkeypatch: pytest.MonkeyPatch) -> None:
    card = SimpleNamespace(prior=lambda name, _motion: replace(PRIOR, name=name))
    monkeypatch.setattr("scruton.griffin.sensitivity.stored_inputs", lambda _tree: (None, card))


def with_scales(tree: xr.DataTree, median: float, seed: int = 0, **weights: list[float]) -> xr.DataTree:
    """Draws of tau and kappa of their priors, the one's median as given: records say nothing of them."""
    rng, changed = np.random.default_rng(seed), tree.copy()
    group = tree["campaign_posterior"].to_dataset()
    dims, size = group["n"].dims, group["n"].shape
    tau, kappa = (m * np.exp(0.8 * rng.standard_normal(size)) for m in (median, 0.1))
    changed["campaign_posterior"] = xr.DataTree(
        group.assign(discrepancy_amplitude=(dims, tau), discrepancy_relaxation=(dims, kappa))
    )
    laws = tree["laws"].to_dataset()
    prior = weights.get("prior", [1.0 / laws.sizes["law"]] * laws.sizes["law"])
    changed["laws"] = xr.DataTree(laws.assign(prior_weight=("law", prior)))
    return changed


def test_halved_and_doubled_is_what_another_card_would_give(monkeypatch: pytest.MonkeyPatch) -> None:
    of_card(monkeypatch)
    tree = campaign_tree(shape=SHAPE)
    rows = prediction_sensitivity(with_scales(tree, 0.1), [("design", 10.0)])
    tau, kappa = rows
    assert [row.source for row in rows] == ["tau", "kappa"]
    for errors in (tau.errors, tau.halved_errors, tau.doubled_errors):
        assert 0.0 < min(errors) < max(errors) < 0.2 * (tau.high - tau.low)
    for factor, found in ((0.5, tau.halved), (2.0, tau.doubled)):
        draws = predictive_draws(with_scales(tree, 0.1 * factor, seed=1), [10.0], seed=1)[:, 0]
        np.testing.assert_allclose(np.log(found), np.log(np.quantile(draws, [0.5, 0.05, 0.95])), atol=0.03 * 2 * factor)
    assert tau.distance > 0.05
    # kappa is of the settings tested, and predictions of a given curve do not know it
    assert kappa.distance < 0.03
    np.testing.assert_allclose(np.log(kappa.doubled), np.log((kappa.median, kappa.low, kappa.high)), atol=0.06)


def test_errors_of_reweighted_quantiles_are_their_scatter_from_run_to_run() -> None:
    """Also where draws of one chain hang together, and where the upper end lies at infinity."""
    rng, bands, errors = np.random.default_rng(3), [], []
    for _ in range(200):
        noise = rng.standard_normal((8, 250))
        draws = noise.copy()
        for k in range(1, 250):
            draws[:, k] = 0.6 * draws[:, k - 1] + 0.8 * noise[:, k]
        own, log_weights = draws.reshape(-1), 0.4 * draws.reshape(-1)
        band, error = weighted_band(own, log_weights, 8)
        bands.append(band)
        errors.append(error)
    np.testing.assert_allclose(np.mean(errors, axis=0), np.std(bands, axis=0), rtol=0.2)
    _, flat = weighted_band(own, np.zeros(own.size), 8)
    np.testing.assert_allclose(flat, [monte_carlo_error(draws, p) for p in (0.5, 0.05, 0.95)], rtol=0.15)
    own[own > 1.0] = np.inf
    assert np.isfinite(weighted_band(own, log_weights, 8)[1]).tolist() == [True, True, False]
    assert weighted_band(np.zeros(80), np.zeros(80), 8)[1] == (0.0, 0.0, 0.0), "dead for certain"
    assert np.isnan(weighted_band(own[:16], log_weights[:16], 8)[1]).all(), (
        "two draws a chain tell nothing of each other"
    )


def test_law_weights_are_halved_and_doubled_by_their_odds(monkeypatch: pytest.MonkeyPatch) -> None:
    of_card(monkeypatch)
    tree = campaign_tree(shape=SHAPE, laws={"n=-1": (-1.0, 0.8), "n=2": (2.0, 0.2)})
    small = with_scales(tree, 1e-6, prior=[0.5, 0.5])  # of laws alike in the card: the weights count, not the prior
    laws = prediction_sensitivity(small, [("design", 25.0)])[-1]
    assert laws.source == "law weights"
    low, high = (float(predict(tree, scruton_number=25.0, law_n=n).median) for n in (2.0, -1.0))
    assert low < high
    # odds 4: the lesser law has a fifth of the draws, and a third or a ninth once they are halved or doubled
    assert (laws.median, laws.low) == pytest.approx((high, low), rel=1e-3)
    assert laws.halved == pytest.approx((high, low, high), rel=1e-3)
    assert laws.distance > 0.05


def test_without_a_design_the_widest_gap_and_twice_the_largest_are_examined() -> None:
    rows = [(2.0, 0.06, 0.8), (4.0, 0.055, 0.8), (80.0, 0.011, 0.9)]
    assert points_of(campaign_tree(rows)) == [
        ("between tests", pytest.approx(np.sqrt(320.0))), ("twice the largest tested", pytest.approx(160.0))
    ]  # fmt: skip
    assert points_of(campaign_tree(rows[:1])) == [("twice the largest tested", pytest.approx(4.0))]
    assert points_of(campaign_tree(rows), [30.0]) == [("design", 30.0)]


def test_a_weighted_band_is_that_of_draws_repeated() -> None:
    draws = np.array([3.0, 1.0, np.inf, 0.0, 2.0])
    counts = np.array([20, 30, 3, 10, 37])
    expected = np.quantile(np.repeat(draws, counts), [0.5, 0.05, 0.95], method="inverted_cdf")
    np.testing.assert_array_equal(weighted_band(draws, np.log(counts), 1)[0], expected)


# ------------------------------------------------------------------------------------------------ one rig


def one_rig_tree(tau_median: float, n: float = -1.0) -> xr.DataTree:
    """The exact posterior of one rig: its amplitude known to 1 %, the curve off it by tau z, tau of its prior."""
    rng = np.random.default_rng(3)
    size = (1, *SHAPE)
    sc, a_star, slope = ROW
    tree = campaign_tree([ROW], curve=(1.3 * sc, a_star, slope), laws={f"n={n:g}": (n, 1.0)}, shape=SHAPE)
    tau = tau_median * np.exp(0.8 * rng.standard_normal(size))
    own = a_star * np.exp(0.01 * rng.standard_normal(size))
    group = tree["campaign_posterior"].to_dataset()
    x = (sc - 1.3 * sc) / group["reference_relaxation"].to_numpy()
    level = own * np.exp(-tau * rng.standard_normal(size)) / amplitude_ratio(x, n)
    dims = group["n"].dims
    group = group.assign(
        discrepancy_amplitude=(dims, tau), reference_amplitude=(dims, level),
        a_star=((*dims, "peak_test"), own[..., None]),
        scruton_number=((*dims, "peak_test"), np.full((*size, 1), sc)),
    )  # fmt: skip
    tree["campaign_posterior"] = xr.DataTree(group.assign_coords(peak_test=["T0"]))
    return tree


@pytest.mark.parametrize("n", [-1.0, 2.0])
@pytest.mark.parametrize("tau", STATED)
def test_from_one_rig_a_setting_of_the_same_damping_is_off_by_tau_twice(n: float, tau: float) -> None:
    """The rig lies off the curve by tau, and the new setting again; whatever the card's prior of tau was."""
    for median in (0.03, 0.3):
        draws = predictive_draws(with_discrepancy(one_rig_tree(median, n), tau), [ROW[0]])[:, 0]
        assert np.median(draws) == pytest.approx(ROW[1], rel=0.01)
        assert np.log(draws).std() == pytest.approx(np.hypot(0.01, np.sqrt(2.0) * tau), rel=0.02)


def test_one_rig_states_both_in_the_json_and_says_that_the_prior_speaks() -> None:
    tree = one_rig_tree(0.07)
    assert one_rig(tree)
    tree["campaign_posterior"].attrs["left_at_prior"] = "discrepancy_amplitude"
    one = predict(tree, scruton_number=3.0)
    content = json.loads(json.dumps(one.to_json(), allow_nan=False))
    stated = content["at_discrepancy"]
    for tau, entry in stated.items():
        known = replace(one, draws=one.at_discrepancy[float(tau)])
        assert entry["mcse"]["median"] == known.error(0.5)
        assert entry["mcse"]["interval"]["0.90"] == [known.error(0.05), known.error(0.95)]
    assert list(stated) == ["0.10", "0.20"]
    factors = [np.divide(*one["interval"]["0.90"][::-1]) for one in stated.values()]
    np.testing.assert_allclose(np.log(factors), 2 * 1.645 * np.sqrt(2.0) * np.array(STATED), rtol=0.05)
    assert any("card's prior" in flag and "one rig" in flag for flag in one.flags)


def test_several_rigs_state_none() -> None:
    tree = campaign_tree()
    one = predict(tree, scruton_number=3.0)
    assert not one_rig(tree)
    assert "at_discrepancy" not in one.to_json()
    assert not any("prior" in flag for flag in one.flags)


# ------------------------------------------------------------------------------------------------ Monte Carlo errors


def test_the_error_of_a_prediction_is_the_scatter_of_predictions() -> None:
    medians, lows, errors = [], [], []
    for seed in range(60):
        one = predict(campaign_tree(tau=0.2, shape=(20, 50)), scruton_number=10.0, seed=seed)
        medians.append(one.median)
        lows.append(one.interval(0.90)[0])
        errors.append((one.error(0.5), one.error(0.05)))
    told = np.median(errors, axis=0)
    assert told[0] == pytest.approx(np.std(medians), rel=0.3)
    assert told[1] == pytest.approx(np.std(lows), rel=0.3)
