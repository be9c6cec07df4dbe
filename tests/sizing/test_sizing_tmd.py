"""Dampers: harmonic balance against a search by hand, eigenvalues and equations of motion; designs against a grid."""

import math
from dataclasses import astuple

import numpy as np
import pytest
from damped_mode import limit_cycle, minimum_modal_damping, response, simulate_damped
from scipy.optimize import brentq

from scruton.campaign.schema import Motion
from scruton.errors import InputError
from scruton.simulate import Truth
from scruton.sizing.tmd import TunedMass, check_detuning, den_hartog
from scruton.sizing.tmd_design import design
from scruton.sizing.tmd_tuning import TuningDraws

# A section model at its own damping: stable amplitude, relaxation rate over omega.
STABLE, RATE, DAMPING = 0.06551, 0.005139, 0.00058
CUBIC_DRIVE = 0.03  # negative damping of a cubic force at small amplitude


def coulomb_section() -> Truth:
    omega, depth = 2.0 * np.pi, 0.5
    Y1 = 2.0 * omega * (DAMPING - RATE) / depth
    epsilon = -STABLE * np.pi * omega * RATE * omega / (2.0 * Y1)
    return Truth(Motion.HEAVING, 2.0, depth, 1.0, 1.0, DAMPING, 1.0, 1.0, Y1, epsilon)


def cubic_section() -> Truth:
    Y1 = 2.0 * 2.0 * np.pi * CUBIC_DRIVE / 0.5
    return Truth(Motion.HEAVING, 2.0, 0.5, 1.0, 1.0, DAMPING, 1.0, 1.0, Y1, 1500.0, force="ehsan-scanlan")


def balance(dampers, detuning, g):
    """Real part of the balance and added damping, as the equations stand."""
    real, imaginary = 1.0 - g**2, 0.0
    for d in dampers:
        f = d.frequency_ratio / (1.0 + detuning)
        T = (f**2 + 2j * d.damping_ratio * f * g) / (f**2 - g**2 + 2j * d.damping_ratio * f * g)
        real, imaginary = real - d.mass_ratio * g**2 * T.real, imaginary + d.mass_ratio * T.imag
    return real, -0.5 * g * imaginary


def all_roots(dampers, detuning=0.0):
    """Every root by a fine scan: [(g, added damping)]."""
    g = np.linspace(0.5, 1.6, 40_000)
    real, _ = balance(dampers, detuning, g)
    found = []
    for k in np.flatnonzero(real[:-1] * real[1:] < 0.0):
        root = brentq(lambda x: balance(dampers, detuning, x)[0], g[k], g[k + 1], xtol=1e-14)
        found.append((root, balance(dampers, detuning, root)[1]))
    return found


def random_dampers(rng, count):
    return tuple(
        TunedMass(float(rng.uniform(0.001, 0.02)), float(rng.uniform(0.9, 1.1)), float(rng.uniform(0.005, 0.15)))
        for _ in range(count)
    )


@pytest.mark.parametrize("count", [1, 2, 3])
def test_response_against_a_search_by_hand(count):
    rng = np.random.default_rng(count)
    several = 0
    light = (TunedMass(0.01, 0.99, 0.02), TunedMass(0.004, 0.98, 0.01), TunedMass(0.001, 1.03, 0.01))[:count]
    for dampers in [light, *(random_dampers(rng, count) for _ in range(10))]:
        detuning = 0.0 if dampers is light else float(rng.uniform(-0.06, 0.06))
        roots = all_roots(dampers, detuning)
        several += len(roots) > 1
        g, added = min(roots, key=lambda root: root[1])
        found = response(dampers, detuning)
        assert found.frequency == pytest.approx(g, rel=1e-8)
        assert found.added_damping == pytest.approx(added, rel=1e-7)
        for d, stroke in zip(dampers, found.stroke, strict=True):
            f = d.frequency_ratio / (1.0 + detuning)
            assert stroke == pytest.approx(g**2 / abs(f**2 - g**2 + 2j * d.damping_ratio * f * g), rel=1e-7)
    assert several >= 1  # or the choice between roots was not tested


@pytest.mark.parametrize("count", [1, 2, 4, 16])
def test_added_damping_is_the_negative_damping_that_the_dampers_can_just_take(count):
    rng = np.random.default_rng(10 + count)
    for _ in range(12):
        dampers, detuning = random_dampers(rng, count), rng.uniform(-0.06, 0.06, 5)
        for error, added in zip(detuning, response(dampers, detuning).added_damping, strict=True):
            assert minimum_modal_damping(dampers, -added, error) == pytest.approx(0.0, abs=1e-9)
            assert minimum_modal_damping(dampers, -0.9 * added, error) > 0.0
            assert minimum_modal_damping(dampers, -1.1 * added, error) < 0.0


def test_shapes_and_draws_one_by_one():
    dampers, detuning = random_dampers(np.random.default_rng(3), 2), np.linspace(-0.05, 0.05, 12).reshape(3, 4)
    found = response(dampers, detuning)
    assert found.added_damping.shape == found.frequency.shape == (3, 4)
    assert found.stroke.shape == (2, 3, 4)
    for index in np.ndindex(3, 4):
        one = response(dampers, detuning[index])
        assert one.added_damping.shape == ()
        assert found.added_damping[index] == pytest.approx(float(one.added_damping), rel=1e-10)
        np.testing.assert_allclose(found.stroke[:, *index], one.stroke, rtol=1e-9)


def test_added_damping_does_not_jump_with_the_detuning():
    """Frequency and stroke do, where roots change places."""
    detuning = np.linspace(-0.1, 0.1, 4001)
    found = response([TunedMass(0.01, 0.99, 0.02)], detuning)
    assert np.abs(np.diff(np.log(found.added_damping))).max() < 0.01
    assert np.abs(np.diff(found.frequency)).max() > 0.05


@pytest.mark.parametrize("zeta", [0.05, 0.1])
def test_tuned_limit(zeta):
    assert response([TunedMass(1e-4, 1.0, zeta)]).added_damping == pytest.approx(1e-4 / (4 * zeta), rel=2e-3)


def test_mass_alone_adds_up():
    whole, halves = TunedMass(0.01, 0.98, 0.06), TunedMass(0.005, 0.98, 0.06)
    assert response([halves, halves], 0.01).added_damping == pytest.approx(
        float(response([whole], 0.01).added_damping), rel=1e-6
    )


@pytest.mark.parametrize(
    ("mu", "percent"),
    [
        (0.002, [1.51, 0.59, 0.97, 0.95, 0.58]),
        (0.005, [2.29, 1.07, 1.68, 1.65, 1.05]),
        (0.01, [3.16, 1.76, 2.52, 2.48, 1.72]),
        (0.02, [4.36, 2.84, 3.72, 3.66, 2.77]),
    ],
)
def test_minimum_modal_damping_of_den_hartog_s_damper(mu, percent):
    """On a structure of 0.3 %, its own frequency off by -5, -2, 2 and 5 %: published figures."""
    d = den_hartog(mu)
    for off, want in zip([0.0, -0.05, -0.02, 0.02, 0.05], percent, strict=True):
        moved = TunedMass(mu, d.frequency_ratio * (1.0 + off), d.damping_ratio)
        assert 100.0 * minimum_modal_damping([moved], 0.003) == pytest.approx(want, abs=0.0076)
        # The same ratio comes about when the mode's frequency is off the other way.
        assert minimum_modal_damping([d], 0.003, 1.0 / (1.0 + off) - 1.0) == pytest.approx(
            float(minimum_modal_damping([moved], 0.003)), rel=1e-9
        )


def simulated(truth, dampers, *, start=None, cycles=500):
    """The limit cycle that a release of the bridge, or another start, ends in."""
    state = np.zeros((2, len(dampers) + 1)) if start is None else start
    if start is None:
        state[0, 0] = STABLE
    mu, f, zeta = zip(*(astuple(d) for d in dampers), strict=True)
    _, y = simulate_damped(truth, mass_ratios=mu, frequency_ratios=f, damping_ratios=zeta, cycles=cycles, start=state)
    return limit_cycle(y)


def on_curve(added, g):
    """The Griffin curve of the Coulomb section at more damping, at the frequency of the response."""
    return STABLE * RATE / (RATE + added) / g


DH2 = den_hartog(0.002)
CASES = {
    "0.2 %, Den Hartog": [DH2],
    "0.2 %, 3 % high": [TunedMass(0.002, 1.03 * DH2.frequency_ratio, DH2.damping_ratio)],
    "0.2 %, 3 % low": [TunedMass(0.002, 0.97 * DH2.frequency_ratio, DH2.damping_ratio)],
    "0.5 %, tuned": [TunedMass(0.005, 1.0 / 1.005, 0.07)],
    "0.5 %, light, 3 % high": [TunedMass(0.005, 1.03 / 1.005, 0.02)],
    "0.5 %, heavy damping, 3 % low": [TunedMass(0.005, 0.97 / 1.005, 0.1)],
    "1 %, Den Hartog": [den_hartog(0.01)],
    "1 %, free-vibration optimum": [TunedMass(0.01, 1.0 / 1.01, math.sqrt(0.01 / 1.01))],
    "1 %, 3 % high": [TunedMass(0.01, 1.03 / 1.01, 0.05)],
    "1 %, 3 % low": [TunedMass(0.01, 0.97 / 1.01, 0.12)],
    "1 %, light: two frequencies": [TunedMass(0.01, 1.0 / 1.01, 0.02)],
    "two dampers": [TunedMass(0.0025, 0.97, 0.03), TunedMass(0.0025, 1.03, 0.03)],
}


@pytest.mark.parametrize("dampers", CASES.values(), ids=CASES)
def test_harmonic_balance_against_the_equations_of_motion(dampers):
    want, found = simulated(coulomb_section(), dampers), response(dampers)
    assert want.unsteadiness < 1e-3
    assert on_curve(found.added_damping, found.frequency) == pytest.approx(want.amplitude, rel=0.01)
    assert found.frequency == pytest.approx(want.frequency, abs=3e-3)
    np.testing.assert_allclose(found.stroke, want.strokes, rtol=0.02)


def test_published_figures():
    """Harmonic balance 0.01446 and 0.02997, integration 0.01442 and 0.03000, mass ratio 0.2 %, damping 2.7 %."""
    for off, balance_amplitude, integrated in [(0.0, 0.01446, 0.01442), (0.03, 0.02997, 0.03000)]:
        damper = [TunedMass(0.002, (1.0 + off) * DH2.frequency_ratio, DH2.damping_ratio)]
        found = response(damper)
        assert on_curve(found.added_damping, found.frequency) == pytest.approx(balance_amplitude, rel=3e-3)
        assert simulated(coulomb_section(), damper).amplitude == pytest.approx(integrated, rel=3e-3)


def test_neither_the_mode_s_own_frequency_nor_eigenvalues_would_do():
    """Or the test above could not fail."""
    dampers = CASES["0.2 %, 3 % high"]
    want = simulated(coulomb_section(), dampers).amplitude
    at_the_mode = on_curve(balance(dampers, 0.0, 1.0)[1], 1.0)
    by_eigenvalues = on_curve(float(minimum_modal_damping(dampers, DAMPING)) - DAMPING, 1.0)
    assert abs(at_the_mode / want - 1.0) > 0.15
    assert abs(by_eigenvalues / want - 1.0) > 0.05
    tuned = CASES["0.2 %, Den Hartog"]
    slow = on_curve(float(minimum_modal_damping(tuned, DAMPING)) - DAMPING, 1.0)
    assert slow > 1.15 * simulated(coulomb_section(), tuned).amplitude


@pytest.mark.parametrize("name", ["0.5 %, tuned", "0.2 %, 3 % high", "1 %, light: two frequencies"])
def test_another_law_has_the_same_added_damping(name):
    """A cubic force, whose amplitude does not depend on the frequency of the response."""
    truth, added = cubic_section(), response(CASES[name]).added_damping
    amplitude = math.sqrt(4.0 / truth.epsilon * (1.0 - (DAMPING + added) / CUBIC_DRIVE))
    assert amplitude > 0.015
    assert simulated(truth, CASES[name], cycles=800).amplitude == pytest.approx(amplitude, rel=0.015)


def at_root(dampers, g, added):
    """State on the limit cycle of one root."""
    amplitude = on_curve(added, g)
    strokes = [
        amplitude * g**2 / (d.frequency_ratio**2 - g**2 + 2j * d.damping_ratio * d.frequency_ratio * g) for d in dampers
    ]
    phasors = np.array([amplitude, *strokes])
    return np.stack([phasors.real, (1j * g * phasors).real])


@pytest.mark.parametrize("frequency_ratio", [0.97, 1.0 / 1.01, 1.0, 1.02])
def test_growth_and_release_from_above_end_at_the_root_of_least_damping(frequency_ratio):
    dampers = [TunedMass(0.01, frequency_ratio, 0.015)]
    roots = all_roots(dampers)
    assert len(roots) == 3
    assert max(roots, key=lambda root: root[1]) == roots[1]
    least = response(dampers).frequency
    rng = np.random.default_rng(0)
    for _ in range(4):
        rest = 1e-4 * rng.standard_normal((2, 2))
        assert simulated(coulomb_section(), dampers, start=rest).frequency == pytest.approx(least, abs=3e-3)
    outer = sorted(RATE + added for _, added in (roots[0], roots[2]))
    if outer[0] < 0.8 * outer[1]:
        above = np.array([[2.0 * STABLE, 0.0], [STABLE, 0.0]])
        assert simulated(coulomb_section(), dampers, start=above).frequency == pytest.approx(least, abs=3e-3)
    # The middle root is not stable, not even when the vibration starts on it.
    middle = simulated(coulomb_section(), dampers, start=at_root(dampers, *roots[1]))
    assert abs(middle.frequency - roots[1][0]) > 0.01


def test_a_start_on_the_other_limit_cycle_ends_lower():
    dampers = [TunedMass(0.01, 1.0 / 1.01, 0.02)]
    low, _, high = all_roots(dampers)
    other = max(low, high, key=lambda root: root[1])
    caught = simulated(coulomb_section(), dampers, start=at_root(dampers, *other), cycles=1500)
    assert caught.frequency == pytest.approx(other[0], abs=3e-3)
    assert caught.amplitude < simulated(coulomb_section(), dampers).amplitude


# Designs.

RNG = np.random.default_rng(7)
COUNT = 500
SECTION = 0.25 * np.exp(0.2 * RNG.standard_normal(COUNT))
RATES = 0.005 * np.exp(0.3 * RNG.standard_normal(COUNT))
DETUNING = 0.02 * RNG.standard_normal(COUNT)
BRIDGE = {"risk": 0.05, "modal_mass": 1e6, "frequency": 0.3}
LIMIT = 0.12


def bridge_amplitude(added):
    return SECTION * RATES / (RATES + 0.002 + added)


def tuning(amplitude=None, limit=LIMIT, detuning=DETUNING, **options):
    return TuningDraws(amplitude or bridge_amplitude, limit, detuning, **options)


def mass_of(found):
    return sum(damper.mass for damper in found.dampers)


def risk_of(dampers, detuning=DETUNING):
    return float(np.mean(bridge_amplitude(response(dampers, detuning).added_damping) > LIMIT))


@pytest.fixture(scope="module")
def single():
    return design(tuning(), **BRIDGE)


def test_design_keeps_the_risk_and_no_lighter_damper_on_a_grid_does(single):
    (damper,) = single.dampers
    assert single.achievable
    assert single.reason == "the risk decides on the mass"
    assert 0.9 * BRIDGE["risk"] <= single.outcome.probability <= BRIDGE["risk"]
    assert single.outcome.probability == risk_of(single.dampers)
    assert mass_of(single) == pytest.approx(1e6 * damper.mass_ratio)
    lighter = [
        risk_of([TunedMass(0.97 * damper.mass_ratio, f, zeta)])
        for f in np.linspace(0.965, 1.025, 21)
        for zeta in damper.damping_ratio * np.geomspace(0.5, 2.0, 15)
    ]
    assert min(lighter) > BRIDGE["risk"]


def test_design_is_told_in_si(single):
    (damper,) = single.dampers
    own = math.sqrt(damper.spring / mass_of(single))
    assert own == pytest.approx(2.0 * np.pi * 0.3 * damper.frequency_ratio)
    assert damper.dashpot == pytest.approx(2.0 * damper.damping_ratio * own * mass_of(single))
    found = response(single.dampers, DETUNING)
    stroke = found.stroke[0] * bridge_amplitude(found.added_damping)
    assert single.outcome.stroke == pytest.approx(np.median(stroke))
    assert single.outcome.stroke_high == pytest.approx(np.quantile(stroke, 0.95))
    assert single.outcome.added_damping_low == pytest.approx(np.quantile(found.added_damping, 0.05))
    assert [each.detuning for each in single.detuned] == [-0.05, -0.02, 0.02, 0.05]
    for each in single.detuned:
        assert each.probability == risk_of(single.dampers, np.full(COUNT, each.detuning))
    assert single.detuned[0].probability > 3.0 * single.outcome.probability


def test_the_table_is_the_formula(single):
    draws = tuning()
    for dampers in (single.dampers, (TunedMass(0.004, 0.99, 0.015),), (TunedMass(0.002, 0.97, 0.02),) * 2):
        ratio = np.sort(draws.needed / response(dampers, DETUNING).added_damping)
        assert draws._lacks(dampers, 0.05)[0] == pytest.approx(np.log(ratio[COUNT - 1 - 25]), abs=0.01)


def test_needed_damping_brings_every_draw_to_the_limit():
    draws = tuning()
    some = draws.needed > 0.0
    assert 0.05 < some.mean() <= 1.0
    np.testing.assert_allclose(bridge_amplitude(draws.needed)[some], LIMIT, rtol=1e-6)


def test_an_uncertain_frequency_costs_mass(single):
    sharp = design(tuning(detuning=np.zeros(COUNT)), **BRIDGE)
    assert mass_of(sharp) < 0.8 * mass_of(single)
    assert risk_of(sharp.dampers) > 2.0 * BRIDGE["risk"]


def test_draws_are_joint():
    """A bridge that is off frequency only where it needs no damper is a lighter case than the reverse."""
    order = np.argsort(bridge_amplitude(np.zeros(COUNT)))
    far = np.argsort(np.abs(DETUNING))
    together, apart = np.empty(COUNT), np.empty(COUNT)
    together[order], apart[order] = DETUNING[far], DETUNING[far[::-1]]
    masses = [mass_of(design(tuning(detuning=each), **BRIDGE)) for each in (apart, together)]
    assert masses[0] < 0.8 * masses[1]


def test_several_dampers_spread_over_an_uncertain_frequency(single):
    pair = design(tuning(number=2), **BRIDGE)
    low, high = pair.dampers
    assert mass_of(pair) < mass_of(single)
    assert low.mass_ratio == high.mass_ratio
    assert high.frequency_ratio - low.frequency_ratio > 0.01
    assert pair.outcome.probability <= BRIDGE["risk"]


def test_spare_mass_of_several_dampers_spreads_them_too(single):
    """One pair has mass to spare and a long stroke to go: it is no stiffly damped single one."""
    mass = 2.0 * single.dampers[0].mass_ratio
    draws = tuning(number=2, kept=0.02, largest_stroke=2.0 * single.outcome.stroke_high)
    pair = design(draws, **BRIDGE, mass_ratios=(mass, 0.05))
    low, high = pair.dampers
    assert pair.reason.startswith("the smallest mass ratio")
    assert high.frequency_ratio - low.frequency_ratio > 0.02
    assert low.damping_ratio < den_hartog(mass).damping_ratio
    alike = [TunedMass(0.5 * mass, 0.99, 0.1)] * 2
    ends = [-0.02, 0.02]
    assert response(pair.dampers, ends).added_damping.min() > 1.2 * response(alike, ends).added_damping.min()


def test_a_stroke_limit_costs_mass(single):
    largest = 0.4 * single.outcome.stroke_high
    held = design(tuning(largest_stroke=largest), **BRIDGE)
    assert held.outcome.stroke_high <= largest
    assert held.outcome.stroke_high > 0.97 * largest
    assert held.outcome.probability <= BRIDGE["risk"]
    assert mass_of(held) > mass_of(single)
    assert held.reason == "the stroke decides on the mass"


def test_mode_shape_scales_mass_and_stroke(single):
    half = design(tuning(shape=0.5), **BRIDGE)
    ratios = [(one.mass_ratio, one.frequency_ratio, one.damping_ratio) for one in (*half.dampers, *single.dampers)]
    assert ratios[0] == ratios[1]
    assert mass_of(half) == pytest.approx(4.0 * mass_of(single))
    assert half.outcome.stroke == pytest.approx(0.5 * single.outcome.stroke)


def test_nothing_to_do():
    easy = design(tuning(limit=10.0), **BRIDGE)
    assert easy.dampers == ()
    assert (easy.outcome.stroke, easy.outcome.probability) == (0.0, 0.0)
    assert easy.achievable
    assert easy.reason == "no damper is needed"


def test_what_cannot_be_had_is_said():
    short = design(tuning(limit=0.02), **BRIDGE, mass_ratios=(1e-6, 0.01))
    assert not short.achievable
    assert short.reason == "not achievable with a mass ratio up to 1 %: the risk is not kept"
    assert mass_of(short) == pytest.approx(1e4)
    assert short.outcome.probability > BRIDGE["risk"]
    cramped = design(tuning(largest_stroke=0.001), **BRIDGE)
    assert cramped.reason == "not achievable with a mass ratio up to 5 %: the stroke is not kept"
    hopeless = design(tuning(lambda added: np.where(DETUNING > 0.0, 1.0, 0.0) + 0.0 * added), **BRIDGE)
    assert not hopeless.achievable
    share = 100.0 * np.mean(DETUNING > 0.0)
    assert hopeless.reason.startswith(f"not achievable with any damper: {share:.3g} % of the draws")
    assert np.isfinite(mass_of(hopeless))


def test_same_draws_same_design(single):
    assert design(tuning(), **BRIDGE) == single


def test_risk_falls_with_mass_and_meets_the_design(single):
    mu, draws = single.dampers[0].mass_ratio, tuning()
    tuned = [draws.best(factor * mu, BRIDGE["risk"]) for factor in (0.5, 1.0, 1.5)]
    found = [draws.outcome(dampers) for dampers in tuned]
    assert found[0].probability > found[1].probability > found[2].probability
    assert found[0].stroke > found[1].stroke > found[2].stroke
    assert found[1].probability <= 1.1 * BRIDGE["risk"]
    assert [one.probability for one in found] == [risk_of(dampers) for dampers in tuned]
    least = min(
        risk_of([TunedMass(0.5 * mu, f, zeta)])
        for f in np.linspace(0.97, 1.03, 21)
        for zeta in np.geomspace(0.015, 0.08, 13)
    )
    assert found[0].probability <= least + 0.005


def test_a_given_mass_keeps_the_largest_stroke_where_it_can(single):
    mu, limit = single.dampers[0].mass_ratio, 0.7 * single.outcome.stroke_high
    free, held = tuning(), tuning(largest_stroke=limit)
    risk = BRIDGE["risk"]
    pairs = [tuple(each.outcome(each.best(k * mu, risk)) for each in (free, held)) for k in (1.0, 2.0, 4.0)]
    assert pairs[0][0].stroke_high > 1.1 * limit
    assert all(found.stroke_high <= 1.01 * limit for _, found in pairs)
    assert all(found.probability >= one.probability - 0.005 for one, found in pairs)
    assert pairs[0][1].probability > pairs[0][0].probability + 0.02
    # the lightest damper that keeps both is the best of its mass
    lightest = design(held, **BRIDGE).dampers[0].mass_ratio
    assert held.outcome(held.best(lightest, risk)).probability == pytest.approx(risk, abs=0.015)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: TunedMass(0.0, 1.0, 0.1), "damper: mass_ratio: found 0;"),
        (lambda: TunedMass(float("nan"), 1.0, 0.1), "damper: mass_ratio: found nan;"),
        (lambda: TunedMass(0.01, -1.0, 0.1), "damper: frequency_ratio: found -1;"),
        (lambda: TunedMass(0.01, 1.0, 0.0), "damper: damping_ratio: found 0;"),
        (lambda: TunedMass(0.01, 1.0, 1.0), "damper: damping_ratio: found 1;"),
        (lambda: den_hartog(-0.1), "damper: mass_ratio: found -0.1;"),
        (lambda: check_detuning([0.0, -1.0]), "damper: detuning: found -1;"),
        (lambda: check_detuning([0.0, float("inf")]), "damper: detuning: found inf;"),
        (lambda: design(tuning(), **BRIDGE | {"risk": 1.0}), "damper: risk: found 1;"),
        (lambda: tuning(limit=0.0), "damper: limit: found 0;"),
        (lambda: design(tuning(number=0), **BRIDGE), "damper: number: found 0;"),
        (
            lambda: design(tuning(largest_stroke=-1.0), **BRIDGE),
            "damper: largest_stroke: found -1;",
        ),
        (lambda: tuning(shape=[0.5, -1.0], number=2), "damper: shape: found -1;"),
        (lambda: tuning(lambda a: a[:3]), r"amplitude: found an array of shape \(3,\)"),
        (lambda: tuning(lambda a: a * np.nan), "damper: amplitude: found not a number;"),
        (lambda: tuning().best(0.0, 0.05), "mass_ratio: found 0;"),
    ],
)  # fmt: skip
def test_bad_input_is_named(call, message):
    with pytest.raises(InputError, match=message):
        call()
