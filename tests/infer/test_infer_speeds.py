"""The smooth model of tests at other wind speeds: slow forms, known lock-in curves, coverage."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from scruton.campaign import load_campaign
from scruton.dynamics.laws import amplitude_ratio
from scruton.envelope import demodulate
from scruton.griffin.lock_in import lock_in_band, lock_in_draws
from scruton.infer import speeds as module
from scruton.infer.cards import load_card
from scruton.infer.sampling import Sampling
from scruton.infer.smooth import Observations, SpeedPoint, SpeedPosterior, log_ratio, matern
from scruton.infer.speeds import SCALES as SCALE_NAMES
from scruton.infer.speeds import fit_points, in_lock_in, speed_points
from scruton.infer.thresholds import COMMON
from scruton.stats.convergence import SamplerSettings
from scruton.stats.priors import Prior

FACTOR = 1000.0
PRIOR = {
    "stable_amplitude": Prior("stable_amplitude", "lognormal", 0.05, 1.5, "A/D"),
    "relaxation_ratio": Prior("relaxation_ratio", "lognormal", 0.02, 1.2, "-"),
    "speed_scale_amplitude": Prior("speed_scale_amplitude", "lognormal", 0.8, 0.5, "-"),
    "speed_scale_relaxation": Prior("speed_scale_relaxation", "lognormal", 0.5, 0.5, "-"),
    "speed_length": Prior("speed_length", "lognormal", 1.0, 0.6, "U/(f0 D)"),
    "speed_shift": Prior("speed_shift", "lognormal", 0.02, 0.5, "-"),
}
SCALES = tuple(PRIOR[name] for name in SCALE_NAMES)
QUICK = SamplerSettings(ensembles=2, walkers=64, draws=16, min_ess=300.0)
TAU, KAPPA = 0.05, 0.1


FAST = SamplerSettings(ensembles=2, walkers=48, draws=12, min_ess=100.0)


def sampling(seed: int = 1, settings: SamplerSettings = QUICK) -> Sampling:
    return Sampling(replace(load_card("default"), sampler=settings), seed)


def point(name, rig, v, sc, ln_a, ln_g=None, sd=0.02, sd_g=0.1) -> SpeedPoint:
    mean = np.array([ln_a] if ln_g is None else [ln_a, ln_g])
    covariance = np.diag([sd**2, sd_g**2][: mean.size])
    return SpeedPoint(name, rig, float(v), float(sc), 0.0, mean, covariance)


def amplitude(v):
    """Stable amplitude at Sc = 20: a hump with its peak at v = 9."""
    return 0.04 * np.exp(-(((v - 9.0) / 1.2) ** 2))


def relaxation(v):
    """Relaxation Scruton number at zero damping."""
    return 30.0 * np.exp(-(((v - 9.0) / 2.5) ** 2))


def truth(v, sc, n=-1.0, reference=20.0):
    g = relaxation(v)
    return amplitude(v) * amplitude_ratio((sc - reference) / (g - n * reference), n)


def campaign_points(rng, steady=(), n=-1.0, speeds=7):
    found = []
    for rig, sc in (("light", 10.0), ("heavy", 30.0)):
        for i, v in enumerate(np.linspace(7.6, 10.4, speeds)):
            z = rng.standard_normal(4)
            ln_a = np.log(truth(v, sc, n)) + TAU * z[0] + 0.02 * z[1]
            ln_g = np.log(relaxation(v)) + KAPPA * z[2] + 0.1 * z[3]
            found.append(point(f"{rig} {i}", rig, v, sc, ln_a, None if rig in steady else ln_g))
    return tuple(found)


def predicted(speeds, v, sc):
    """Draws at one speed of the grid, without the new setting's discrepancy: (S, n)."""
    f, h = (
        np.array([np.interp(v, speeds.group["velocity"], one) for one in drawn(speeds, name)])
        for name in ("ln_amplitude", "ln_relaxation")
    )
    return np.exp(f + log_ratio(h, np.asarray(sc), speeds.group.reference_scruton_number, speeds.group.law_n))


def drawn(speeds, name) -> np.ndarray:
    """Draws of one variable, (S, ...)."""
    return speeds.group[name].to_numpy()[0]


def fit(points, n=-1.0, **kwargs):
    tau = np.full(50, kwargs.pop("tau", TAU))
    kappa = np.full(50, kwargs.pop("kappa", KAPPA))
    return fit_points(
        points, n, PRIOR, (tau, kappa), kwargs.pop("sampling", sampling()), mass_damping_factor=FACTOR, **kwargs
    )


# ------------------------------------------------------------------------------------------------ pieces


@pytest.mark.parametrize("n", [-1.0, 0.0, 1.0, 2.0])
def test_linearisation_is_the_laws_own_slope(n: float) -> None:
    points = campaign_points(np.random.default_rng(1), speeds=3)
    centre = np.log(90.0)
    data = Observations(points, n, 20.0, (TAU, KAPPA), centre)
    step = 1e-5
    wanted = (
        log_ratio(np.asarray(centre + step), data.scruton_number, 20.0, n)
        - log_ratio(np.asarray(centre - step), data.scruton_number, 20.0, n)
    ) / (2 * step)
    np.testing.assert_allclose(data.on_relaxation[: len(points)], wanted, rtol=1e-6)
    # at the centre itself the linearised law is the exact one
    f = np.zeros((1, len(points)))
    h = np.full((1, len(points)), centre)
    np.testing.assert_allclose(data.y - data.linear(f, h), data.raw - data.exact(f, h), atol=1e-12)


def test_likelihood_is_the_normal_density_of_the_linear_model() -> None:
    from scipy.stats import multivariate_normal

    points = campaign_points(np.random.default_rng(2), steady=("heavy",), speeds=4)
    data = Observations(points, -1.0, 20.0, (0.2, 0.3), np.log(20.0))
    means = ((np.log(0.05), 1.5), (np.log(10.0), 1.2))
    posterior = SpeedPosterior(SCALES, PRIOR["speed_shift"], data, means)
    u = np.log(np.array([[0.8, 0.5, 1.0], [0.3, 0.9, 0.4]]))
    u = np.concatenate([u, [[0.02, -0.03], [0.2, 0.1]]], axis=1)
    for one, found in zip(u, posterior.log_likelihood(u), strict=True):
        s_a, s_g, length = np.exp(one[:3])
        shift = {"light": one[3], "heavy": one[4]}
        v = [p.velocity * np.exp(shift[p.rig]) for p in points]
        size = len(points)
        # one entry at a time
        rows = [(i, "a") for i in range(size)] + [(i, "g") for i in range(size) if points[i].mean.size == 2]
        mean, covariance = np.zeros(len(rows)), np.zeros((len(rows), len(rows)))
        slope = data.on_relaxation
        for p, (i, kind) in enumerate(rows):
            mean[p] = (means[0][0] if kind == "a" else 0.0) + slope[p] * means[1][0]
            for q, (j, other) in enumerate(rows):
                k = float(matern(np.asarray(abs(v[i] - v[j])), np.asarray(length)))
                if kind == other == "a":
                    covariance[p, q] += s_a**2 * k + 1.5**2
                covariance[p, q] += slope[p] * slope[q] * (s_g**2 * k + 1.2**2)
                if kind == other:
                    scale = 0.2 if kind == "a" else 0.3
                    share = (COMMON if points[i].rig == points[j].rig else 0.0) + (1.0 - COMMON if i == j else 0.0)
                    covariance[p, q] += scale**2 * share
                    covariance[p, q] += (points[i].covariance[0, 0] if kind == "a" else 0.01) if i == j else 0.0
        wanted = multivariate_normal(mean, covariance).logpdf(data.y) + 0.5 * len(rows) * np.log(2 * np.pi)
        assert found == pytest.approx(wanted, abs=1e-6)


def test_the_shifts_scale_is_integrated_out() -> None:
    from scipy.integrate import quad
    from scipy.stats import norm

    data = Observations(campaign_points(np.random.default_rng(2), speeds=3), -1.0, 20.0, (0.2, 0.3), np.log(20.0))
    posterior = SpeedPosterior(SCALES, PRIOR["speed_shift"], data, ((0.0, 1.0), (0.0, 1.0)))
    u = np.array([[0.0, 0.0, 0.0, 0.01, -0.02], [0.0, 0.0, 0.0, 0.1, 0.05]])
    shift = PRIOR["speed_shift"]
    for one, found in zip(u, posterior.log_prior(u), strict=True):

        def joint(ln_s: float, one=one) -> float:
            return float(np.exp(shift.log_density(np.asarray(ln_s))) * norm.pdf(one[3:], scale=np.exp(ln_s)).prod())

        wanted = np.log(quad(joint, shift.location - 4.0, shift.location + 4.0, limit=200)[0])
        assert found == pytest.approx(wanted + sum(p.log_density(np.zeros(1))[0] for p in SCALES), abs=0.02)
    wide = posterior.scale_shift(np.repeat(u[1:], 4000, axis=0), np.random.default_rng(1))
    expected = quad(lambda x: x * joint(x), shift.location - 4.0, shift.location + 4.0)[0] / np.exp(wanted)
    assert np.log(wide).mean() == pytest.approx(expected, abs=0.03)


def test_draws_have_the_closed_forms_mean_and_covariance() -> None:
    """Matheron's rule against conditioning by hand, at two speeds of the grid."""
    points = campaign_points(np.random.default_rng(3), steady=("light",), speeds=3)
    data = Observations(points, -1.0, 20.0, (0.2, 0.3), np.log(20.0))
    means = ((np.log(0.05), 1.5), (np.log(10.0), 1.2))
    posterior = SpeedPosterior(SCALES, PRIOR["speed_shift"], data, means)
    u = np.array([*np.log([0.8, 0.5, 1.0]), 0.0, 0.05])
    grid, size = np.array([8.3, 9.7]), 20000
    values, _ = posterior.functions(
        np.tile(u, (size, 1)), np.tile([0.2, 0.3], (size, 1)), grid, np.random.default_rng(4)
    )
    values = values.reshape(size, 4)
    met = data.velocity * np.exp(0.05 * (data.rig_of == 1))
    k = {
        "gd": matern(np.abs(grid[:, None] - met[data.of_point]), np.asarray(1.0)),
        "gg": matern(np.abs(grid[:, None] - grid), np.asarray(1.0)),
    }
    cross = np.concatenate(
        [(0.64 * k["gd"] + 1.5**2) * data.on_amplitude, (0.25 * k["gd"] + 1.2**2) * data.on_relaxation]
    )
    prior = np.zeros((4, 4))
    prior[:2, :2], prior[2:, 2:] = 0.64 * k["gg"] + 1.5**2, 0.25 * k["gg"] + 1.2**2
    total = posterior.covariance(u[None], data.noise)[0]
    departure = data.y - means[0][0] * data.on_amplitude - means[1][0] * data.on_relaxation
    mean = np.repeat([means[0][0], means[1][0]], 2) + cross @ np.linalg.solve(total, departure)
    covariance = prior - cross @ np.linalg.solve(total, cross.T)
    error = np.sqrt(np.diag(covariance) / size)
    assert np.abs((values.mean(axis=0) - mean) / error).max() < 4.5
    sd = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(np.cov(values.T) / np.outer(sd, sd), covariance / np.outer(sd, sd), atol=0.04)


def test_points_outside_lock_in_are_left_out_rig_by_rig() -> None:
    points = [
        point("a", "light", 8.0, 10, np.log(0.06)), point("b", "light", 9.0, 10, np.log(0.0029)),
        point("c", "heavy", 9.0, 300, np.log(0.0029)), point("d", "heavy", 9.5, 300, np.log(0.001)),
    ]  # fmt: skip
    used, rest = in_lock_in(points)
    assert [one.name for one in used] == ["a", "c", "d"]
    assert [one.name for one in rest] == ["b"]


def test_nothing_to_do_with_fewer_than_three_speeds() -> None:
    points = campaign_points(np.random.default_rng(1), speeds=7)
    assert fit([]) is None
    assert fit(points[:2]) is None
    # the third differs by less than half a per cent
    near = [points[2], points[3], replace(points[2], velocity=points[3].velocity * 1.004)]
    assert fit(near) is None
    # the third is outside lock-in
    assert fit([*points[2:4], replace(points[6], mean=points[6].mean - 6.0)]) is None
    assert fit(points[2:5]) is not None


# ------------------------------------------------------------------------------------------------ known curves


@pytest.mark.parametrize("steady", [(), ("light",), ("light", "heavy")])
def test_a_known_lock_in_curve_is_predicted_at_an_untested_scruton_number(steady: tuple[str, ...]) -> None:
    speeds = fit(campaign_points(np.random.default_rng(5), steady), sampling=Sampling(load_card("default"), 3))
    assert speeds is not None
    assert speeds.samples.convergence.converged
    assert speeds.group.effective_draws > 500
    v = np.linspace(7.8, 10.2, 9)
    for sc in (5.0, 20.0, 60.0):
        draws = predicted(speeds, v, sc)
        low, high = np.quantile(draws, [0.005, 0.995], axis=0)
        wanted = truth(v, sc)
        assert np.all((low < wanted) & (wanted < high)), sc
    inner = np.quantile(predicted(speeds, v, 20.0), [0.05, 0.95], axis=0)
    assert inner[1, 4] / inner[0, 4] < 1.3  # at the peak, and is worth having
    assert np.all(inner[1] / inner[0] < 2.1)
    again = fit(campaign_points(np.random.default_rng(5), steady), sampling=Sampling(load_card("default"), 3))
    np.testing.assert_array_equal(again.group["ln_amplitude"], speeds.group["ln_amplitude"])


def test_rigs_whose_lock_in_sits_elsewhere_are_laid_over_each_other() -> None:
    """Evenly spaced sweeps match in several ways; only the one that joins the peaks is right."""
    points = []
    for rig, sc, at in (("light", 2.0, 9.6), ("middle", 20.0, 8.5), ("heavy", 80.0, 8.1)):
        for i, ratio in enumerate((0.85, 0.9, 0.95, 1.0, 1.05)):
            ln_a = np.log([0.25, 0.46, 0.72, 1.0, 0.37][i] * amplitude_ratio((sc - 20.0) / 38.0, -1.0) * 0.029)
            points.append(point(f"{rig} {i}", rig, at * ratio, sc, ln_a))
    one = sampling(8)
    speeds = fit(points, tau=0.09, reference=20.0, sampling=one)
    assert speeds is not None
    assert not one.flags
    middle = np.log([9.6, 8.5, 8.1])
    np.testing.assert_allclose(np.median(drawn(speeds, "shift"), axis=0), middle.mean() - middle, atol=0.02)


def test_steady_tests_of_one_scruton_number_say_nothing_of_the_relaxation() -> None:
    points = [
        replace(one, scruton_number=20.0) for one in campaign_points(np.random.default_rng(6), ("light", "heavy"))
    ]
    speeds = fit(points)
    assert speeds is not None
    middle = drawn(speeds, "ln_relaxation")[:, 30]
    sd = np.hypot(1.2, 0.5)
    assert np.median(middle) == pytest.approx(np.log(20.0), abs=0.2)
    assert middle.std() == pytest.approx(sd, rel=0.15)


def test_the_van_der_pol_law_dies_where_it_should() -> None:
    """n = 2: two rigs at Sc 10 and 30 under G of 120 at the peak."""
    rng = np.random.default_rng(7)
    found = []
    for rig, sc in (("light", 10.0), ("heavy", 30.0)):
        for i, v in enumerate(np.linspace(8.0, 10.0, 6)):
            g = 4.0 * relaxation(v)
            ln_a = np.log(amplitude(v) * amplitude_ratio((sc - 20.0) / (g - 40.0), 2.0))
            found.append(point(f"{rig} {i}", rig, v, sc, ln_a + TAU * rng.standard_normal(), np.log(g)))
    speeds = fit(found, n=2.0, reference=20.0)
    assert speeds is not None
    peak = predicted(speeds, np.array([9.0]), np.array([50.0, 80.0]))
    wanted = 0.04 * amplitude_ratio(30.0 / 80.0, 2.0)
    low, high = np.quantile(peak[:, 0], [0.005, 0.995])
    assert low < wanted < high
    assert np.mean(peak[:, 1] == 0.0) > 0.95


def test_the_grid_reaches_half_a_length_beyond_the_tests() -> None:
    points = campaign_points(np.random.default_rng(5))
    speeds = fit(points)
    margin = 0.5 * np.exp(np.median(speeds.samples.chain[..., 2]))
    group = speeds.group
    assert (group.tested_low, group.tested_high) == pytest.approx((7.6, 10.4))
    whole = [group.drawn_low, group.drawn_high]
    np.testing.assert_allclose(whole, [7.6 - margin, 10.4 + margin], rtol=0.02)
    np.testing.assert_array_equal([group["rig_low"], group["rig_high"]], np.tile(whole, (2, 1)).T)
    assert group["velocity"][0] < whole[0] < whole[1] < group["velocity"][-1]
    # but not past a test outside lock-in: a rig's own for the rig, any for a new rig
    outside = [point("a", "light", 10.5, 10.0, -9.0), point("b", "heavy", 10.2, 30.0, -9.0)]
    cut = fit([one for one in points if one.name != "heavy 6"] + outside)
    assert [cut.group.drawn_high, *cut.group["rig_high"]] == [10.5, 10.5, 10.2]
    assert group["ln_amplitude"].dims == group["ln_relaxation"].dims == ("chain", "draw", "velocity")
    assert group.attrs["reference_scruton_number"] == pytest.approx(np.sqrt(300.0))
    assert group.attrs["law_n"] == -1.0
    assert set(group["point_rig"].to_numpy()) == {"light", "heavy"}


# ------------------------------------------------------------------------------------------------ coverage


@pytest.mark.thorough
@pytest.mark.parametrize("sets", [30, pytest.param(400, marks=pytest.mark.slow)])
def test_bands_cover_what_they_promise(sets: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Truths from the model's own prior: the bands of a new setting at held-out speeds and another Sc."""
    monkeypatch.setattr(module, "DRAWS", 500)
    monkeypatch.setattr(module, "GRID", 31)
    for p, (found, narrow, error) in cover(sets).items():
        assert abs(found - p) < 4 * error, (p, found)
        assert p - narrow > 4 * error or p == 0.5, (p, narrow)  # bands of half the width do not pass


def cover(sets: int) -> dict[float, tuple[float, float, float]]:
    """By probability: coverage, that of bands of half the width, and the standard error."""
    rng = np.random.default_rng(11)
    hits, total = np.zeros((2, 2)), 0
    v = np.linspace(8.0, 10.0, 6)
    held = np.array([8.5, 9.3])
    tau, kappa, reference = 0.15, 0.25, 20.0
    for number in range(sets):
        s_a, s_g, length, s_v = (one.from_sampled(one.draw(rng, 1))[0] for one in (*SCALES, PRIOR["speed_shift"]))
        shift = s_v * rng.standard_normal(3)
        at = np.concatenate([np.outer(np.exp(shift[:2]), v).ravel(), held * np.exp(shift[2])])
        root = np.linalg.cholesky(matern(np.abs(at[:, None] - at), length) + 1e-10 * np.eye(at.size))
        f = np.log(0.05) + 1.5 * rng.standard_normal() + s_a * root @ rng.standard_normal(at.size)
        h = np.log(20.0) + 1.2 * rng.standard_normal() + s_g * root @ rng.standard_normal(at.size)
        points = []
        for r, (rig, sc) in enumerate((("light", 10.0), ("heavy", 30.0))):
            z, w = (np.sqrt(COMMON) * rng.standard_normal() for _ in range(2))
            for i in range(r * v.size, (r + 1) * v.size):
                own = np.sqrt(1 - COMMON) * rng.standard_normal(2)
                ln_a = f[i] + log_ratio(h[i], np.asarray(sc), reference, -1.0) + tau * (z + own[0])
                ln_g = h[i] + kappa * (w + own[1])
                noise = rng.standard_normal(2) * [0.02, 0.1]
                points.append(
                    point(f"{i}", rig, v[i % v.size], sc, ln_a + noise[0], ln_g + noise[1] if i % 2 else None)
                )
        if in_lock_in(points)[1]:
            continue  # the model's prior does not know of the edge of lock-in
        speeds = fit(points, tau=tau, kappa=kappa, reference=reference, sampling=sampling(number, FAST))
        tree = xr.DataTree.from_dict({"/speeds": speeds.group})
        new = np.log(lock_in_draws(tree, 60.0, held, seed=number))
        wanted = f[-2:] + log_ratio(h[-2:], np.asarray(60.0), reference, -1.0) + tau * rng.standard_normal()
        for k, p in enumerate((0.5, 0.9)):
            low, top = np.quantile(new, [0.5 - p / 2, 0.5 + p / 2], axis=0)
            middle = np.median(new, axis=0)
            for j, width in enumerate((1.0, 0.5)):
                inside = (middle + width * (low - middle) < wanted) & (wanted < middle + width * (top - middle))
                hits[k, j] += np.sum(inside)
        total += held.size
    assert total >= sets
    # two speeds of one set are not independent: the error is that of half as many
    return {
        p: (float(count / total), float(narrow / total), float(np.sqrt(p * (1 - p) / (total / 2))))
        for p, (count, narrow) in zip((0.5, 0.9), hits, strict=True)
    }


# ------------------------------------------------------------------------------------------------ measured records


@pytest.mark.real
def test_the_cylinder_in_wind_gives_a_hump(shared_data) -> None:
    campaign = load_campaign(shared_data("cylinder-in-wind"))
    card = load_card("default")
    tree = real_tree(campaign)
    own = ("stable_amplitude", "relaxation_ratio")
    priors = PRIOR | {name: card.prior(name, campaign.section.motion) for name in own}
    one = sampling(3)
    tau, kappa = (np.exp(np.log(x) + 0.4 * np.random.default_rng(0).standard_normal(2000)) for x in (0.09, 0.2))
    factor = float(np.exp(np.log(tree["posterior"]["mass_damping_factor"].to_numpy()).mean()))
    points = speed_points(tree, campaign, -1.0)
    speeds = fit_points(points, -1.0, priors, (tau, kappa), one, mass_damping_factor=factor)
    assert speeds is not None
    assert not one.flags
    assert {point.name for point in speeds.left_out} == {"g1 U 16.9", "e2 U 14", "e2 U 16.6"}
    tree["speeds"] = xr.DataTree(speeds.group)
    band = lock_in_band(tree, 9.5, rig="g2")
    peak = int(np.argmax(band.median))
    assert 5.35 < band.velocity[peak] < 5.6
    assert band.median[peak] == pytest.approx(0.085, rel=0.15)
    # the elastomer damps, and lock-in ends earlier
    damped = lock_in_band(tree, 12.5, rig="e2")
    assert damped.velocity[int(np.argmax(damped.median))] < band.velocity[peak]
    # what g2 itself showed lies in the 90 % band of its own curve
    for point in (p for p in speeds.points if p.rig == "g2"):
        low, high = lock_in_band(tree, point.scruton_number, [point.velocity], rig="g2").intervals[0.90][:, 0]
        assert low < np.exp(point.mean[0]) < high


def real_tree(campaign) -> xr.DataTree:
    """Summaries of the steady records as a posterior: what a full fit finds, in a second."""
    rng, shape = np.random.default_rng(1), (4, 250)
    damping = {"g1": 0.00988, "g2": 0.00898, "e2": 0.01242}
    section = campaign.section
    columns: dict[str, list[np.ndarray]] = {}
    for test in campaign.tests:
        record, rig = test.records[0], campaign.rig(test.rig)
        steady = demodulate(record.time, record.response).amplitude
        assert rig.mass is not None
        factor = 4 * np.pi * rig.mass.mean / (test.air_density.mean * section.width * section.depth)
        # some twenty correlation times in every record
        a_star = steady.mean() * np.exp(steady.std() / steady.mean() / np.sqrt(20) * rng.standard_normal(shape))
        one = {
            "a_star": a_star,
            "scruton_number": factor * damping[test.rig] * np.exp(0.04 * rng.standard_normal(shape)),
        }
        one |= {"relaxation_scruton_number": np.full(shape, 20.0), "mass_damping_factor": np.full(shape, factor)}
        for key, value in one.items():
            columns.setdefault(key, []).append(value)
    names = [test.name for test in campaign.tests]
    posterior = {key: (("chain", "draw", "test"), np.stack(value, axis=-1)) for key, value in columns.items()}
    constant = {
        "wind_speed": ("test", [test.wind_speed.mean for test in campaign.tests]),
        "frequency": ("test", [campaign.rig(test.rig).frequency.mean for test in campaign.tests]),
        "rig": ("test", [test.rig for test in campaign.tests]),
        "law_n": -1.0,
        "motion": "heaving",
    }
    groups = {"/posterior": xr.Dataset(posterior), "/constant_data": xr.Dataset(constant)}
    return xr.DataTree.from_dict({key: one.assign_coords(test=names) for key, one in groups.items()})
