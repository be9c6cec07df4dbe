"""Tests at other wind speeds: from a fit's tests and sweeps to draws of the model in `scruton.infer.smooth`."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray, end_to_end, thin
from scruton.campaign.schema import Campaign, Motion, Sweep
from scruton.dynamics.scruton_number import factor
from scruton.infer.result_schema import dataset
from scruton.infer.sampling import Sampling
from scruton.infer.smooth import Observations, SpeedPoint, SpeedPosterior
from scruton.infer.thresholds import DISTINCT_SPEEDS, FEW_DRAWS, FEWEST_SPEEDS, OUTSIDE_LOCK_IN, STRONG, SWEEP_LOG_SD
from scruton.stats.optimum import find_optimum
from scruton.stats.priors import Prior
from scruton.stats.samples import Samples

if TYPE_CHECKING:
    import xarray as xr

SCALES = ("speed_scale_amplitude", "speed_scale_relaxation", "speed_length")
PRIORS = ("stable_amplitude", "relaxation_ratio", *SCALES, "speed_shift")
NAME = "speeds"  # of the posterior
SWEEP_POINTS = 40  # of one sweep at most
GRID, DRAWS = 61, 2000
WALKERS, ESS, STEPS = 64, 400.0, 1500


@dataclass(frozen=True, eq=False)
class Speeds:
    """Posterior draws of the smooth functions.

    Attributes
    ----------
    group : xarray.Dataset
        Group `speeds` of the tree: draws of ln A at the reference Scruton number (A/D or rad), of ln G, of the
        hyperparameters and of tau and kappa, and what they were conditioned on. Among its attributes are the outermost
        reduced velocities that were used, those worth drawing for a new rig (the grid reaches farther by the shifts),
        and the effective number of draws after the exact law has replaced its linearisation.
    points, left_out : tuple of SpeedPoint
        Used, and outside lock-in.
    samples : Samples
        Of the hyperparameters, for the verdict on convergence.
    """

    group: "xr.Dataset"
    points: tuple[SpeedPoint, ...]
    left_out: tuple[SpeedPoint, ...]
    samples: Samples


def fit_speeds(tree: "xr.DataTree", campaign: Campaign, sampling: Sampling) -> Speeds | None:
    """Fit the smooth model to every test and sweep of a campaign, under the reference law, or the median of a free one.

    Parameters
    ----------
    tree : xarray.DataTree
        With the groups posterior, rig_posterior, campaign_posterior, which gives tau, kappa and the reference Scruton
        number, and constant_data.
    campaign : Campaign
        For its sweeps, and the rigs that they were made with.
    sampling : Sampling
        Says which card, with priors by the names in `PRIORS`, and which seed; flags are appended to it.

    Returns
    -------
    Speeds or None
        None where fewer than three distinct reduced velocities lie within lock-in.
    """
    n = float(tree["constant_data"]["law_n"])
    n = float(np.median(tree["posterior"]["law_exponent"])) if np.isnan(n) else n
    # tau and kappa under the law nearest to n.
    joint = tree["campaign_posterior"].to_dataset()
    nearest = np.argmin(np.abs(np.median(joint["n"].to_numpy(), axis=(1, 2)) - n))
    tau, kappa = (joint[f"discrepancy_{of}"][nearest].to_numpy().reshape(-1) for of in ("amplitude", "relaxation"))
    return fit_points(
        speed_points(tree, campaign, n),
        n,
        {name: sampling.card.prior(name, campaign.section.motion) for name in PRIORS},
        (tau, kappa),
        sampling,
        mass_damping_factor=float(np.exp(np.log(tree["posterior"]["mass_damping_factor"].to_numpy()).mean())),
        reference=float(joint.attrs["reference_scruton_number"]),
    )


def speed_points(tree: "xr.DataTree", campaign: Campaign, n: float) -> tuple[SpeedPoint, ...]:
    """Normal summaries of every fitted test, then the points of the sweeps; parameters as of `fit_speeds`."""
    constant, posterior = tree["constant_data"], tree["posterior"]
    transient = set(map(str, constant["record_test"].to_numpy())) if "record_test" in constant else set()
    points = []
    for name in map(str, posterior["test"].to_numpy()):
        a_star, sc, relaxation = (
            np.asarray(posterior[key].sel(test=name).to_numpy(), dtype=float).reshape(-1)
            for key in ("a_star", "scruton_number", "relaxation_scruton_number")
        )
        rows = [np.log(a_star)]
        if name in transient:
            wind_strength = relaxation + n * sc
            if np.mean(wind_strength > 0.0) > STRONG:  # else it builds up by itself, and its amplitude has to do
                rows.append(np.log(np.where(wind_strength > 0.0, wind_strength, np.nan)))
        values = np.stack(rows)
        values = values[:, np.isfinite(values).all(axis=0)]
        at = {key: constant[key].sel(test=name).item() for key in ("wind_speed", "frequency", "rig")}
        points.append(
            SpeedPoint(
                name, str(at["rig"]), at["wind_speed"] / (at["frequency"] * campaign.section.depth),
                float(np.median(sc)), float(np.log(sc).std()), values.mean(axis=1), np.atleast_2d(np.cov(values)),
            )
        )  # fmt: skip
    return (*points, *(point for sweep in campaign.sweeps for point in _sweep_points(tree, campaign, sweep)))


def _sweep_points(tree: "xr.DataTree", campaign: Campaign, sweep: Sweep) -> Iterator[SpeedPoint]:
    rig, section = campaign.rig(sweep.rig), campaign.section
    if rig.mass is None or "rig_posterior" not in tree:
        return
    per_damping = factor(
        "paper", mass=rig.mass.mean, air_density=sweep.air_density.mean, width=section.width, depth=section.depth,
        torsional=section.motion is Motion.TORSIONAL,
    )  # fmt: skip
    sc = float(per_damping) * tree["rig_posterior"]["damping_ratio"].sel(rig=rig.name).to_numpy()
    good = np.flatnonzero((sweep.amplitude > 0.0) & (sweep.wind_speed > 0.0))
    for i in good[thin(good.size, SWEEP_POINTS)]:
        yield SpeedPoint(
            f"sweep of {rig.name}, point {i + 1}", rig.name, sweep.wind_speed[i] / (rig.frequency.mean * section.depth),
            float(np.median(sc)), float(np.hypot(np.log(sc).std(), rig.mass.log_sd)),
            np.log(sweep.amplitude[[i]]), np.array([[SWEEP_LOG_SD**2]]),
        )  # fmt: skip


def in_lock_in(points: Sequence[SpeedPoint]) -> tuple[tuple[SpeedPoint, ...], tuple[SpeedPoint, ...]]:
    """Split into the points within lock-in, and those below a tenth of their rig's largest amplitude."""
    largest = {
        rig: max(point.mean[0] for point in points if point.rig == rig) for rig in {point.rig for point in points}
    }
    inside = [bool(point.mean[0] >= largest[point.rig] + np.log(OUTSIDE_LOCK_IN)) for point in points]
    used, rest = (tuple(p for p, good in zip(points, inside, strict=True) if good is want) for want in (True, False))
    return used, rest


def fit_points(
    points: Sequence[SpeedPoint],
    n: float,
    priors: Mapping[str, Prior],
    discrepancy: tuple[FloatArray, FloatArray],
    sampling: Sampling,
    *,
    mass_damping_factor: float,
    reference: float | None = None,
) -> Speeds | None:
    """Fit the smooth model to summaries; see `fit_speeds`.

    Parameters
    ----------
    points : sequence of SpeedPoint
    n : float
        The law.
    priors : mapping
    discrepancy : pair of (T,) arrays
        Draws of tau and kappa.
    sampling : Sampling
    mass_damping_factor : float
        Scruton number per unit of damping ratio: turns the prior of lambda/omega0 into one of G.
    reference : float, optional
        Reference Scruton number; the geometric mean over the points if left out.
    """
    used, left_out = in_lock_in(points)
    v = np.array([point.velocity for point in used])
    if not used or 1 + np.count_nonzero(np.diff(np.log(np.sort(v))) > np.log(DISTINCT_SPEEDS)) < FEWEST_SPEEDS:
        return None
    at = float(np.exp(np.mean([np.log(point.scruton_number) for point in used]))) if reference is None else reference
    relaxation = priors["relaxation_ratio"]
    scales = tuple(priors[name] for name in SCALES)
    means = (
        (priors["stable_amplitude"].location, priors["stable_amplitude"].scale),
        (relaxation.location + float(np.log(mass_damping_factor)), relaxation.scale),
    )
    centre = np.array([prior.location for prior in scales] + [0.0] * len({point.rig for point in used}))
    data = Observations(used, n, at, (float(np.median(discrepancy[0])), float(np.median(discrepancy[1]))), means[1][0])
    posterior = _linearised(SpeedPosterior(scales, priors["speed_shift"], data, means), centre)
    # The optimum is found with the law linearised under the priors' medians, and the law is linearised again there.
    rng = sampling.generator(f"{NAME}: optimum")
    posterior = _linearised(posterior, find_optimum(posterior, rng).centre)
    # Fewer walkers: few coordinates, a likelihood that is dear, and 2,000 draws wanted of them.
    settings = sampling.card.sampler
    walkers = min(settings.walkers, WALKERS)
    few = replace(
        settings, walkers=walkers, draws=max(-(-2 * DRAWS // (settings.ensembles * walkers)), settings.draws),
        min_ess=min(settings.min_ess, ESS), max_steps=min(settings.max_steps, STEPS),
    )  # fmt: skip
    few_walkers = replace(sampling, card=replace(sampling.card, sampler=few))
    samples = few_walkers.run(NAME, posterior, *posterior.arrays)
    return Speeds(_draw(posterior, samples, discrepancy, left_out, sampling), used, left_out, samples)


def _draw(
    posterior: SpeedPosterior,
    samples: Samples,
    discrepancy: tuple[FloatArray, FloatArray],
    left_out: Sequence[SpeedPoint],
    sampling: Sampling,
) -> "xr.Dataset":
    """Group `speeds` of the tree: draws by (chain, draw, velocity), the points used, and what it was conditioned on."""
    data, used = posterior.data, posterior.data.points
    rng = sampling.generator(f"{NAME}: functions")
    u = end_to_end(samples.chain)
    u = u[rng.permutation(len(u))[: 2 * DRAWS]]
    s_v = posterior.scale_shift(u, rng)
    log_scales, shifts = posterior.named(u)["scales"], posterior.named(u)["shift"]
    _, _, log_length = np.median(log_scales, axis=0)
    drawn = _drawn(used, left_out, float(np.exp(log_length)))
    shift = np.median(s_v)
    grid = np.linspace(drawn[0, 0] * np.exp(-2.5 * shift), drawn[0, 1] * np.exp(2.5 * shift), GRID)
    pair = np.stack(discrepancy, axis=1)[rng.integers(0, len(discrepancy[0]), len(u))]
    values, log_weight = posterior.functions(u, pair, grid, rng)
    # Systematic resampling, and the effective number of draws behind it.
    weight = np.exp(log_weight - log_weight.max())
    # One draw of the tail would outweigh hundreds: truncated at sqrt(S) means, as Ionides (2008) has it.
    weight = np.minimum(weight, np.sqrt(weight.size) * weight.mean())
    weight /= weight.sum()
    keep = np.searchsorted(np.cumsum(weight), (np.arange(DRAWS) + rng.random()) / DRAWS).clip(0, weight.size - 1)
    effective = float(1.0 / np.square(weight).sum())
    if effective < FEW_DRAWS:
        sampling.flags.append(
            f"{NAME}: the amplitude against reduced velocity rests on {effective:.0f} effective draws (wanted "
            f"{FEW_DRAWS:g}): the tests say too little of the relaxation at their Scruton numbers"
        )
    s_a, s_g, length = np.exp(log_scales[keep]).T
    draws = {
        "ln_amplitude": values[keep, 0],
        "ln_relaxation": values[keep, 1],
        "scale_amplitude": s_a,
        "scale_relaxation": s_g,
        "length": length,
        "scale_shift": s_v[keep],
        "discrepancy_amplitude": pair[keep, 0],
        "discrepancy_relaxation": pair[keep, 1],
        "shift": shifts[keep],
    }
    known = {
        "rig_low": drawn[1:, 0],
        "rig_high": drawn[1:, 1],
        "point_velocity": data.velocity,
        "point_scruton_number": data.scruton_number,
        "point_rig": [point.rig for point in used],
    }
    group = dataset(
        "speeds", {name: value[None] for name, value in draws.items()} | known, velocity=grid, rig=list(data.rigs),
        point=[point.name for point in used],
    )  # fmt: skip
    return group.assign_attrs(
        reference_scruton_number=data.reference,
        law_n=data.n,
        tested_low=float(data.velocity.min()),
        tested_high=float(data.velocity.max()),
        drawn_low=float(drawn[0, 0]),
        drawn_high=float(drawn[0, 1]),
        effective_draws=effective,
    )


def _drawn(used: Sequence[SpeedPoint], left_out: Sequence[SpeedPoint], length: float) -> FloatArray:
    """Speeds worth drawing, (1 + R, 2): of a new rig, then of every rig.

    Half a length beyond the tests, but not past what lies outside lock-in: of any rig for a new one, its own for each.
    """
    v = [point.velocity for point in used]
    rigs = dict.fromkeys(point.rig for point in used)

    def cut(low: float, high: float, rig: str | None) -> tuple[float, float]:
        tested = [point.velocity for point in used if rig in (None, point.rig)]
        outside = [point.velocity for point in left_out if rig in (None, point.rig)]
        below, above = [x for x in outside if x < min(tested)], [x for x in outside if x > max(tested)]
        return max([low, *below]), min([high, *above])

    whole = cut(max(min(v) - 0.5 * length, 0.5 * min(v)), max(v) + 0.5 * length, None)
    return np.array([whole, *(cut(*whole, rig) for rig in rigs)])


def _linearised(posterior: SpeedPosterior, u: FloatArray) -> SpeedPosterior:
    """Linearise the law where the points put G under these hyperparameters (Gauss and Newton)."""
    for _ in range(20):
        data = posterior.data
        step = np.clip(posterior.smoothed_relaxation(u) - data.ln_relaxation, -1.0, 1.0)
        moved = Observations(data.points, data.n, data.reference, data.discrepancy, data.ln_relaxation + step)
        posterior = replace(posterior, data=moved)
        if np.abs(step).max() < 1e-3:
            break
    return posterior
