"""Required damping, probabilities and shares against closed forms and brute force."""

from dataclasses import replace

import numpy as np
import pytest
from sizing_room import LIMIT, at_most, mode_model

from scruton.campaign.quantity import Quantity
from scruton.griffin.coverage import Coverage
from scruton.griffin.law_free import LawFree
from scruton.sizing.mode_shape import sine, uniform
from scruton.sizing.model import DAMPING, DISCREPANCY, SOURCES, unit_cube
from scruton.sizing.risk import POINTS, probability, risk, shares, sobol_shares


@pytest.mark.parametrize(
    ("discrepancy", "cov", "percent"), [(0.0, 0.0, 0.25), (0.1, 0.0, 0.39), (0.2, 0.0, 0.59), (0.2, 0.45, 0.63)]
)
def test_the_worked_case_comes_out(discrepancy, cov, percent):
    found = risk(mode_model(discrepancy, cov), at_most(LIMIT))
    assert 100.0 * found.required["0.95"] == pytest.approx(percent, abs=0.01)


def test_the_median_alone_is_a_third_of_what_is_needed():
    assert 100.0 * risk(mode_model(0.2), at_most(LIMIT)).required["0.50"] == pytest.approx(0.21, abs=0.01)


def brute_force(draws, added, *, discrepancy, cov, coherence=(1.0, 0.0), n=-1.0, seed=3):
    """The amplitude written out, with ordinary random numbers."""
    rng = np.random.default_rng(seed)
    a = 0.06551 * np.exp(0.02 * rng.standard_normal(draws))
    rate = 0.005139 * np.exp(0.03 * rng.standard_normal(draws))
    s = np.sqrt(np.log1p(cov**2))
    xi = 0.003 * np.exp(s * rng.standard_normal(draws) - 0.5 * s**2)
    x = (xi + added - 0.00058) / rate
    gamma = {-1.0: 4.0 / np.pi, 2.0: np.sqrt(4.0 / 3.0)}[n]
    ratio = 1.0 / (1.0 + x) if n == -1.0 else np.sqrt(np.maximum(1.0 - 2.0 * x, 0.0))
    c = 1.0
    if coherence[1]:
        size = coherence[0] * (1 - coherence[0]) / coherence[1] ** 2 - 1
        c = rng.beta(coherence[0] * size, (1 - coherence[0]) * size, draws)
    return 3.0 * gamma * c * a * ratio * np.exp(discrepancy * rng.standard_normal(draws))


@pytest.mark.parametrize("n", [-1.0, 2.0])
@pytest.mark.parametrize("added", [0.0, 0.001, 0.004])
def test_probabilities_agree_with_a_million_draws(n, added):
    model = mode_model(0.15, 0.3, Quantity(0.9, 0.05, "beta"), exponents=(n,))
    found = risk(model, at_most(LIMIT)).curve
    amplitude = brute_force(1_000_000, added, discrepancy=0.15, cov=0.3, coherence=(0.9, 0.05), n=n)
    p = float(np.mean(amplitude > LIMIT))
    error = np.sqrt(p * (1 - p) / 1e6) + np.sqrt(p * (1 - p) / 32768)
    assert np.interp(added, found.added_damping, found.probability) == pytest.approx(p, abs=4.0 * error + 1e-4)
    if np.isclose(found.added_damping, added).any():
        excess = np.maximum(amplitude - LIMIT, 0.0)
        k = int(np.argmin(np.abs(found.added_damping - added)))
        assert found.expected_exceedance[k] == pytest.approx(excess.mean(), rel=0.03, abs=2e-5)


def test_the_scruton_number_of_the_means_is_that_of_a_pocket_calculator():
    model = mode_model(cov=0.45)
    heavy = replace(model, mode=replace(model.mode, mass=Quantity(8000.0, 400.0)))
    assert heavy.scruton_number_at_means == pytest.approx(4 * np.pi * 8000.0 * 0.003 / (1.225 * 12.0 * 3.0))
    assert model.scruton_number_at_means == pytest.approx(0.003), "the section's own factor, which is one"


def test_what_is_needed_is_the_inverse_of_the_amplitude():
    model = mode_model(0.2, 0.45, exponents=(-1.0, 0.0, 1.0, 2.0), weights=(0.4, 0.2, 0.2, 0.2))
    draws = model.draws(unit_cube(1 << 10, 1))
    needed = draws.needed(LIMIT)
    assert len(set(draws.curve.n)) == 4
    np.testing.assert_allclose(draws.amplitude(needed), LIMIT, rtol=1e-9)
    # more damping, less amplitude: what is needed decides on exceeding
    for added in (0.0, 0.002, 0.006):
        assert ((needed > added) == (draws.amplitude(added) > LIMIT)).all()


def test_laws_share_the_draws_by_their_weights():
    model = mode_model(exponents=(-1.0, 2.0), weights=(0.7, 0.3))
    n = model.draws(unit_cube(1 << 12, 0)).curve.n
    assert np.mean(n == 2.0) == pytest.approx(0.3, abs=0.005)
    found = risk(model, at_most(LIMIT)).curve
    mixed = 0.7 * found.by_law["n=-1"] + 0.3 * found.by_law["n=2"]
    np.testing.assert_allclose(found.probability, mixed, atol=0.01)


def test_the_band_holds_the_probability_and_closes_without_section_uncertainty():
    wide = risk(mode_model(0.2, 0.3), at_most(LIMIT)).curve
    low, high = wide.probability_05, wide.probability_95
    assert ((low - 0.02 <= wide.probability) & (wide.probability <= high + 0.02)).all()
    assert (high - low).max() > 0.02
    assert (np.diff(wide.probability) <= 0.0).all()


def test_the_curve_reaches_as_far_as_damping_can_be_added_where_a_confidence_cannot_be_had():
    found = risk(mode_model(0.5, 0.3), at_most(0.03))
    assert found.required["0.50"] is not None
    assert found.required["0.99"] is None
    assert found.curve.added_damping[-1] == pytest.approx(0.05)


def test_no_crossing_within_reach_is_said_and_is_no_infinity():
    found = risk(mode_model(), at_most(0.005))
    assert found.required["0.95"] is None
    assert found.required_text["0.95"] == "not achievable with added damping up to 5 %"


def test_shares_of_a_product_are_those_of_the_logarithms_variance():
    model = mode_model(0.2, 0.45)
    rows = sobol_shares(
        model, lambda u: 0.2 * model.draws(u).discrepancy + np.log(model.draws(u).damping_ratio), 0, 1 << 12
    )
    by_name = {row.source: row for row in rows}
    s2 = np.log1p(0.45**2)
    total = 0.2**2 + s2
    assert by_name[SOURCES[DISCREPANCY]].first == pytest.approx(0.2**2 / total, abs=0.01)
    assert by_name[SOURCES[DAMPING]].first == pytest.approx(s2 / total, abs=0.01)
    assert sum(row.first for row in rows) == pytest.approx(1.0, abs=0.01)


def test_shares_sum_as_they_must():
    model = mode_model(0.2, 0.45, Quantity(0.9, 0.05, "beta"), exponents=(-1.0, 1.0), weights=(0.5, 0.5))
    for rows in shares(model, LIMIT, added=0.005).values():
        assert len(rows) == 5
        assert sum(row.first for row in rows) <= 1.02
        assert sum(row.total for row in rows) >= 0.98
        assert all(row.total >= row.first - 0.03 for row in rows)


def test_nothing_is_shared_where_nothing_varies():
    rows = sobol_shares(mode_model(0.2, 0.45), lambda u: np.ones(len(u)), 0, 1 << 8)
    assert {(row.first, row.total) for row in rows} == {(0.0, 0.0)}


def test_shares_where_a_limit_is_out_of_reach():
    """What is needed is beyond what can be added in all draws but a few; the amplitude is what it is."""
    model = mode_model(0.2, 0.45)
    far, near = (shares(model, k * LIMIT) for k in (0.002, 0.2))
    assert {(row.first, row.total) for row in far["needed"]} == {(0.0, 0.0)}
    assert sum(row.first for row in far["amplitude"]) > 0.9
    for row, other in zip(far["amplitude"], near["amplitude"], strict=True):
        assert (row.source, row.first) == (other.source, pytest.approx(other.first, abs=0.02))
    assert max(row.total for row in near["needed"]) > 0.1


def test_one_source_alone_has_all_of_the_variance():
    assert [(row.first, row.total) for row in shares(mode_model(), LIMIT)["needed"]] == [(1.0, 1.0)]


def test_same_seed_same_numbers_another_seed_others():
    model = mode_model(0.2, 0.45)
    first, again, other = (risk(model, at_most(LIMIT), seed=seed) for seed in (5, 5, 6))
    assert (first.curve.probability == again.curve.probability).all()
    assert (first.curve.probability != other.curve.probability).any()
    assert first.required["0.95"] == pytest.approx(other.required["0.95"], abs=1e-4)


@pytest.mark.parametrize(
    ("n", "value"), [(-1.0, 4.0 / np.pi), (0.0, 1.21306), (1.0, 1.1781), (2.0, np.sqrt(4.0 / 3.0)), (4.0, 1.12468)]
)
def test_the_mode_factor_of_a_sine(n, value):
    assert float(sine().factor(n)) == pytest.approx(value, abs=2e-5)
    assert float(uniform().factor(n)) == pytest.approx(1.0)


@pytest.mark.parametrize("waves", [3, 7, 99, 100])
def test_the_mode_factor_of_many_half_waves_is_that_of_one(waves):
    for n in (-1.0, 0.0, 2.0):
        assert float(sine(waves).factor(n)) == pytest.approx(float(sine().factor(n)), rel=1e-4)


def test_the_mode_factor_is_continuous_at_n_zero_and_by_interpolation():
    assert float(sine(2).factor(1e-5)) == pytest.approx(float(sine(2).factor(0.0)), abs=1e-4)
    exponents = np.linspace(-1.5, 3.0, 200)
    np.testing.assert_allclose(sine().factor(exponents), [float(sine().factor(one)) for one in exponents], atol=2e-4)


def test_the_mode_factor_is_what_strips_with_their_own_amplitude_balance_to():
    """Work per cycle of the law's force, strip by strip: integral of phi^2 a^2 [1 - (phi A/a*)^n] vanishes."""
    x = np.linspace(0.0, 1.0, 20001)
    phi = np.sin(np.pi * x)
    for n in (-0.5, 1.0, 2.0):
        gamma = float(sine().factor(n))
        work = phi**2 * (1.0 - (phi * gamma) ** n) if n > 0 else phi**2 - phi ** (2.0 + n) * gamma**n
        assert np.trapezoid(work, x) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("family", ["lognormal", "normal", "beta"])
def test_quantile_functions_have_the_moments_they_state(family):
    one = Quantity(0.5, 0.1, family)
    draws = one.quantile((np.arange(200_000) + 0.5) / 200_000)
    assert draws.mean() == pytest.approx(0.5, rel=2e-3)
    assert draws.std() == pytest.approx(0.1, rel=1e-2)


def test_a_beta_that_is_all_but_certain_has_its_quantiles():
    u = np.array([0.05, 0.5, 0.95])
    wide, narrow = (Quantity(0.9, sd, "beta").quantile(u) for sd in (1e-4, 1e-12))
    np.testing.assert_allclose((wide - 0.9) / 1e-4, [-1.645, 0.0, 1.645], atol=2e-3)
    np.testing.assert_allclose(narrow, 0.9, rtol=1e-11)


def test_a_minimum_cuts_off_a_beta_too():
    draws = Quantity(0.9, 0.05, "beta", minimum=0.85).quantile(np.linspace(1e-6, 1.0 - 1e-6, 1000))
    assert draws.min() == pytest.approx(0.85, abs=1e-4)
    assert (np.diff(draws) > 0.0).all()


def test_a_minimum_cuts_off_and_keeps_the_order():
    one = Quantity(0.003, 0.00135, minimum=0.001)
    u = np.linspace(0.001, 0.999, 50)
    draws = one.quantile(u)
    assert draws.min() >= 0.001
    assert (np.diff(draws) > 0.0).all()
    assert one.quantile(np.array(0.5)) > Quantity(0.003, 0.00135).quantile(np.array(0.5))


@pytest.mark.thorough
def test_monte_carlo_errors_are_the_scatter_over_posteriors_of_as_many_draws():
    """A posterior of 256 independent draws: what is required scatters from one such posterior to the next."""
    rng = np.random.default_rng(1)
    required, told, probability, said = [], [], [], []
    for _ in range(30):
        z = rng.standard_normal((2, 256))
        model = mode_model(discrepancy=0.05)
        curve = replace(
            model.laws, amplitude=0.06551 * np.exp(0.15 * z[:1]), relaxation=0.005139 * np.exp(0.03 * z[1:]),
            n=-np.ones((1, 256)), discrepancy=np.full((1, 256), 0.05),
        )  # fmt: skip
        found = risk(replace(model, laws=curve), at_most(LIMIT))
        required.append(found.required["0.95"])
        told.append(found.required_mcse["0.95"])
        probability.append(found.probability)
        said.append(found.probability_mcse)
    assert np.median(told) == pytest.approx(np.std(required), rel=0.35)
    assert np.median(said) == pytest.approx(np.std(probability), rel=0.35)


def test_nothing_required_has_no_error_and_what_cannot_be_had_none():
    found = risk(mode_model(discrepancy=0.1), at_most(10.0))
    assert found.required["0.95"] == found.required_mcse["0.95"] == 0.0
    found = risk(mode_model(discrepancy=0.1), at_most(1e-6))
    assert found.required["0.95"] is found.required_mcse["0.95"] is None


@pytest.mark.parametrize("n", [-1.0, 0.0, 2.0])
def test_what_is_needed_brings_the_amplitude_to_the_limit_where_the_discrepancy_grows_with_the_distance(n):
    model = mode_model(0.15, exponents=(n,))
    coverage = Coverage(*np.array([[0.00058], [0.02], [0.12]]))
    model = replace(model, laws=replace(model.laws, coverage=coverage))
    draws = model.draws(unit_cube(1 << 10, 3))
    limit = 0.5 * LIMIT
    needed = draws.needed(limit)
    np.testing.assert_allclose(draws.amplitude(needed), limit, rtol=1e-5)
    plain = replace(model, laws=replace(model.laws, coverage=None)).draws(unit_cube(1 << 10, 3)).needed(limit)
    assert np.quantile(needed, 0.95) > np.quantile(plain, 0.95)


def with_measured(model, off=0.3):
    """Transients that ask for exp(off) as much damping as the paper's law, from its one test."""
    amplitude = np.geomspace(0.1, 2.5, 60) * 0.06551
    numbers = 0.00058 + 0.005139 * (0.06551 / amplitude - 1.0) * np.exp(off)
    measured = LawFree(amplitude[None], np.tile(numbers, (50, 1))[:, None], np.array([0.00058]), np.array([0.005139]))
    coverage = Coverage(np.array([0.00058]), amplitude[:1], amplitude[-1:])
    return replace(model, laws=replace(model.laws, coverage=coverage, measured=measured))


@pytest.mark.parametrize("off", [-0.4, 0.4])
def test_what_is_needed_brings_the_amplitude_to_the_limit_where_the_measured_damping_has_a_say(off):
    model = with_measured(mode_model(0.15, 0.3, exponents=(-1.0, 0.0), weights=(0.8, 0.2)), off)
    u, limit = unit_cube(1 << 12, 3), 0.4 * LIMIT
    draws = model.draws(u)
    needed = draws.needed(limit)
    np.testing.assert_allclose(draws.amplitude(needed), limit, rtol=1e-3)
    laws = replace(model, laws=replace(model.laws, measured=None)).draws(u).needed(limit)
    more = np.quantile(needed, 0.5) - np.quantile(laws, 0.5)  # what the wind feeds has to be taken away
    assert np.sign(more) == np.sign(off)


def test_each_law_stands_by_itself_beside_what_is_required_with_the_measured_damping():
    model = with_measured(mode_model(0.15, 0.3), 0.6)
    alone = replace(model, laws=replace(model.laws, measured=None))
    both, laws = (risk(one, at_most(0.4 * LIMIT)) for one in (model, alone))
    assert both.required["0.95"] != laws.required["0.95"]
    needed = alone.draws(unit_cube(POINTS, 0)).needed(0.4 * LIMIT)
    np.testing.assert_array_equal(both.curve.by_law["n=-1"], probability(needed, both.curve.added_damping))


def test_draws_that_have_settled_are_left_alone_and_come_to_the_same():
    """Against all repetitions for every draw, where the discrepancy grows with the distance."""
    of = mode_model(0.2, 0.45)
    covered = Coverage(np.array([0.00058]), np.array([0.05]), np.array([0.08]))
    draws = replace(of, laws=replace(of.laws, coverage=covered)).draws(unit_cube(1 << 12, 0))
    target = LIMIT / draws.scale
    sc, on_curve = draws.scruton_number(0.0), target
    for _ in range(25):
        spread = draws.curve.setting(sc[:, None], on_curve[:, None]).spread[:, 0]
        on_curve = target * np.exp(-spread * draws.discrepancy)
        sc = draws._inverse(on_curve)
    assert np.std(draws.curve.setting(sc[:, None], on_curve[:, None]).spread) > 0.0
    np.testing.assert_allclose(draws.needed(LIMIT), sc / draws.factor - draws.damping_ratio, rtol=1e-7, atol=1e-12)


def test_points_of_the_unit_cube_are_made_once_and_nobody_changes_them():
    """Every limit and mode of a sizing asks for the same ones."""
    u = unit_cube(1 << 8, 7)
    assert unit_cube(1 << 8, 7) is u
    with pytest.raises(ValueError, match="read-only"):
        u[0, 0] = 0.5
