"""Credible bands of the Griffin curve against closed forms and against one curve drawn by hand."""

import numpy as np
import pytest
import xarray as xr

from scruton.errors import InputError
from scruton.griffin import band, griffin_band, griffin_draws, trial_griffin_draws

# Table 5 of the paper: Sc, A/D, d(D/A)/dSc
TABLE_5 = ((1.93, 0.06551, 0.8927), (21.7, 0.0292, 0.7543), (78.1, 0.01106, 0.9583))
SHAPE = (4, 250)


def make_tree(
    rows=TABLE_5, *, spread=0.0, n=-1.0, motion="heaving", seed=1, peak=None, trial=None, shape=SHAPE
) -> xr.DataTree:
    """A posterior with known draws: lognormal about each row of (Sc, a_star, slope of 1/A)."""
    rng = np.random.default_rng(seed)
    tests = [f"T{i}" for i in range(len(rows))]

    def draws(values, sd):
        return np.array(values) * np.exp(sd * rng.standard_normal((*shape, len(rows))))

    sc, a_star, slope = (np.array(one) for one in zip(*rows, strict=True))
    xi = sc / 3000.0
    own = draws(np.abs(sc), 0.0) * np.sign(sc)
    posterior = {
        "a_star": draws(a_star, spread),
        "scruton_number": own,
        "damping_ratio": draws(xi, 0.0),
        "relaxation_scruton_number": draws(1.0 / (a_star * slope), 2 * spread),
    }
    dims = ("chain", "draw", "test")
    groups = {
        "posterior": xr.Dataset({k: (dims, v) for k, v in posterior.items()}, coords={"test": tests}),
        "rig_posterior": xr.Dataset(
            {"damping_ratio": (("chain", "draw", "rig"), draws(xi, 0.0))}, coords={"rig": [f"R{t}" for t in tests]}
        ),
        "constant_data": xr.Dataset(
            {
                "peak": ("test", [1] * len(rows) if peak is None else peak),
                "rig": ("test", [f"R{t}" for t in tests]),
                "frequency": ("test", [8.0] * len(rows)),
                "wind_frequency": ("test", [8.1] * len(rows)),
                "law_n": n,
                "motion": motion,
            },
            coords={"test": tests},
        ),
    }
    if trial is not None:
        time, constants = trial
        a, b, c, d = constants
        mean = a * np.exp(b * (time - time[0])) + c * np.exp(d * (time - time[0]))
        groups["trial_function"] = xr.Dataset(
            {k: (("chain", "draw", "record"), np.full((*shape, 1), v)) for k, v in zip("abcd", constants, strict=True)},
            coords={"record": ["r.csv"]},
        )
        groups["observed_data"] = xr.Dataset({"amplitude": ("cycle", mean)})
        groups["constant_data"] = groups["constant_data"].assign(
            time=("cycle", time), record=("cycle", ["r.csv"] * len(time)), record_test=("cycle", ["T0"] * len(time))
        )
    return xr.DataTree.from_dict({f"/{k}": v for k, v in groups.items()})


def test_where_n_is_free_every_draw_has_a_law_of_its_own() -> None:
    tree = make_tree(n=float("nan"))
    exponents = np.random.default_rng(2).uniform(-1.5, 3.0, (*SHAPE, len(TABLE_5)))
    free = tree["posterior"].to_dataset().assign(law_exponent=(("chain", "draw", "test"), exponents))
    tree["posterior"] = xr.DataTree(free)
    sc, a_star, slope = TABLE_5[1]
    x = np.array([-0.2, 0.15])
    draws = griffin_draws(tree, sc + x / (a_star * slope), "T1")
    n = exponents[..., 1].reshape(-1, 1)
    np.testing.assert_allclose(draws, a_star * (1.0 - n * x) ** (1.0 / n), rtol=1e-9)
    np.testing.assert_allclose(
        griffin_draws(tree, [sc + 1.0], "T1", law_n=-1.0), griffin_draws(make_tree(), [sc + 1.0], "T1")
    )


def test_the_papers_law_is_a_straight_line_in_one_over_a() -> None:
    grid = np.array([-3.0, 1.93, 20.0, 80.0])
    draws = griffin_draws(make_tree(), grid, "T0")
    assert draws.shape == (1000, 4)
    sc, a_star, slope = TABLE_5[0]
    np.testing.assert_allclose(1.0 / draws[0], 1.0 / a_star + slope * (grid - sc), rtol=1e-12)


@pytest.mark.parametrize("n", [-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0])
def test_stable_amplitude_solves_the_balance_of_damping(n: float) -> None:
    """At the new setting growth vanishes: (1/n)[1 - (A/a_star)^n] = x = (Sc' - Sc)/Sc_lambda."""
    sc, a_star, slope = TABLE_5[0]
    x = np.array([-0.2, 0.0, 0.1, 0.24])
    draws = griffin_draws(make_tree(n=n), sc + x / (a_star * slope), "T0")
    ratio = draws[0] / a_star
    growth = -np.log(ratio) if n == 0 else (1.0 - ratio**n) / n
    np.testing.assert_allclose(growth, x, atol=1e-12)


def test_vibration_dies_for_positive_n_and_runs_away_for_negative() -> None:
    sc, a_star, slope = TABLE_5[0]
    reach = 1.0 / (a_star * slope)
    dies = griffin_draws(make_tree(n=2.0), [sc + 0.49 * reach, sc + 0.51 * reach, sc + 2 * reach], "T0")
    assert (dies[:, 0] > 0).all()
    assert (dies[:, 1:] == 0).all()
    runs = griffin_draws(make_tree(n=-1.0), [sc - 1.01 * reach, sc - 0.99 * reach], "T0")
    assert np.isposinf(runs[:, 0]).all()
    assert np.isfinite(runs[:, 1]).all()


def test_quantiles_of_a_lognormal_band() -> None:
    tree = make_tree(spread=0.1, shape=(8, 5000))
    found = griffin_band(tree, [1.93], "T0")
    a = TABLE_5[0][1]
    assert found.median[0] == pytest.approx(a, rel=0.005)
    for p, z in ((0.50, 0.674490), (0.90, 1.644854), (0.95, 1.959964)):
        np.testing.assert_allclose(found.intervals[p][:, 0], a * np.exp([-0.1 * z, 0.1 * z]), rtol=0.006)


def test_reciprocal_turns_the_interval_over() -> None:
    tree = make_tree(spread=0.1)
    grid = np.array([-2.0, 5.0, 40.0])
    draws = griffin_draws(tree, grid, "T0")
    found = band(grid, draws, "A/D", "T0").reciprocal()
    direct = np.quantile(1.0 / draws, [0.05, 0.95], axis=0)
    assert found.unit == "D/A"
    np.testing.assert_allclose(found.intervals[0.90], direct, rtol=1e-3)
    assert (found.intervals[0.90][0] < found.median).all()
    assert (found.median < found.intervals[0.90][1]).all()
    assert found.reciprocal().unit == "A/D"


def test_negative_scruton_numbers_are_kept() -> None:
    found = griffin_band(make_tree(spread=0.05), [-5.0, -0.1, 0.0, 3.0], "T0")
    assert (np.diff(found.median) < 0).all()
    assert np.isfinite(found.median).all()


def test_extrapolation_is_marked() -> None:
    sc, a, slope = TABLE_5[0]
    x = np.array([-0.31, -0.29, 0.0, 0.29, 0.31])
    found = griffin_band(make_tree(), sc + x / (a * slope), "T0")
    assert found.extrapolated.tolist() == [True, False, False, False, True]


def test_a_band_that_reaches_infinity_says_inf_not_nan() -> None:
    found = griffin_band(make_tree(spread=0.3), [-15.0], "T0")
    assert not np.isnan(found.median).any()
    assert np.isinf(found.intervals[0.95][1, 0])


def test_unknown_test_is_named() -> None:
    with pytest.raises(InputError, match="found 'T9'; wanted one of: T0, T1, T2"):
        griffin_draws(make_tree(), [1.0], "T9")


def test_the_first_peak_test_is_the_default() -> None:
    tree = make_tree(peak=[0, 1, 0])
    np.testing.assert_array_equal(griffin_draws(tree, [10.0]), griffin_draws(tree, [10.0], "T1"))


def trial_tree(spread: float = 0.0):
    """A decay under the paper's law, which is Eq. (4) with b = 0."""
    rate, a_star, start = 0.4, 0.06551, 0.12
    time = np.arange(0.0, 8.0, 1 / 8.1) + 3.0
    tree = make_tree(trial=(time, (a_star, 0.0, start - a_star, -rate)), spread=spread)
    return tree, rate, a_star, start


def test_trial_function_gives_the_straight_line_of_the_paper() -> None:
    """With b = 0, dA/dt/A = -d' (1 - a_star/A), so Sc' = Sc - factor (rate/omega0)(1 - a_star/A)."""
    tree, rate, a_star, start = trial_tree()
    amplitude = np.linspace(0.07, start, 7)
    sc = 1.93 - 3000.0 * rate / (2 * np.pi * 8.0) * (1.0 - a_star / amplitude)
    draws = trial_griffin_draws(tree, sc, "r.csv")
    np.testing.assert_allclose(draws[0], amplitude, rtol=2e-4)
    assert (sc < 0).any()  # the sign is kept


def test_a_decay_says_nothing_below_its_stable_amplitude() -> None:
    tree, rate, a_star, start = trial_tree()
    amplitude = np.array([start * 1.3, start * 0.95, 0.08, a_star * 0.9])
    sc = 1.93 - 3000.0 * rate / (2 * np.pi * 8.0) * (1.0 - a_star / amplitude)
    assert np.isnan(trial_griffin_draws(tree, sc, "r.csv")).any(axis=0).tolist() == [False, False, False, True]


def test_a_record_without_trial_function_is_named() -> None:
    with pytest.raises(InputError, match=r"found 'x.csv'; wanted one of: r.csv"):
        trial_griffin_draws(trial_tree()[0], [1.0], "x.csv")
    with pytest.raises(InputError, match="none was fitted"):
        trial_griffin_draws(make_tree(), [1.0], "x.csv")


def test_trial_band_of_a_steep_growth_is_the_papers_law(small_results):
    """A growth from a tenth of a* is a exp(0 t) + c exp(-lambda t): exactly A' = a*/(1 + x), without chord errors."""
    from scruton.infer.store import read_tree

    tree, _ = read_tree(small_results)
    name = "growth.csv"
    exact = {"a": 0.03, "b": 0.0, "c": -0.027, "d": -6.0}
    group = tree["trial_function"].to_dataset()
    for key, value in exact.items():
        group[key] = group[key] * 0 + value
    tree["trial_function"] = group
    constants = tree["constant_data"]
    omega0 = 2 * np.pi * float(constants["frequency"].item())
    factor = float((tree["posterior"]["scruton_number"] / tree["posterior"]["damping_ratio"]).median())
    xi = float(tree["posterior"]["damping_ratio"].median())
    sc = factor * (xi + np.array([0.5, 2.0, 5.0]) * 6.0 / omega0)
    draws = trial_griffin_draws(tree, sc, name)
    np.testing.assert_allclose(np.nanmedian(draws, axis=0), 0.03 / (1 + np.array([0.5, 2.0, 5.0])), rtol=5e-3)


@pytest.mark.parametrize("call", [griffin_band, griffin_draws])
def test_no_scruton_number_is_refused(call) -> None:
    """It gave a band from nan to nan."""
    with pytest.raises(InputError, match="scruton_numbers: found no number; wanted one or more"):
        call(make_tree(), [])
