"""One campaign from its truth to its scores: the unit of work, the same wherever it runs.

Its records come from the full equation of motion, never from the amplitude equation.
"""

from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from scruton.calibrate.quantities import INTERVALS, inside, quantities, score
from scruton.calibrate.regimes import DEPTH, FREQUENCY, REGIMES, WIDTH, Regime
from scruton.calibrate.truths import Drawn, draw_normals, from_normals, omega0, stated, wind_speed
from scruton.campaign.schema import Campaign, Kind, Quantity, Record, Rig, Test
from scruton.dynamics import Setting
from scruton.infer.cards import ModelCard
from scruton.infer.fit import fit_campaign
from scruton.simulate import Noise, Truth, simulate_record

SAMPLES_PER_CYCLE = 28
RELAXATIONS = 5.5  # times that a transient is recorded for, within CYCLES
CYCLES = (15.0, 250.0)
START = {Kind.GROWTH: (0.1, 0.2), Kind.DECAY: (2.2, 2.5)}  # over the stable amplitude
RING_DOWN_START = 2.0
RING_DOWN_RELAXATIONS = 3.0


def run_campaign(regime_name: str, index: int, seed: int, base: ModelCard) -> dict[str, Any]:
    """Draw a truth, simulate and fit its campaign, and score every quantity.

    Returns
    -------
    dict
        What one line of the regime's file holds: `regime`, `index`; `failed` with the reason, or
        `converged`, `law_flag`, `weights` and `scores`, by quantity `truth`, `rank`, `z`, `posterior_sd`, and where
        laws are weighed `inside` by interval.
    """
    regime = REGIMES[regime_name]
    card = regime.card(base)
    # It depends on nothing but the run's seed, the regime's place and the campaign's number.
    root = np.random.SeedSequence(seed, spawn_key=(list(REGIMES).index(regime_name), index))
    draw, simulate, fit, fresh = root.spawn(4)
    record: dict[str, Any] = {"regime": regime_name, "index": index}
    drawn, setup, _ = from_normals(draw_normals(np.random.default_rng(draw), regime, card, 1), regime, card)
    try:
        posterior, facts = _fitted(simulate_campaign(regime, drawn, setup, simulate), card, fit, regime.weighs_laws)
    except ValueError as error:  # a record that cannot be used is counted, not hidden
        return record | {"failed": str(error)}
    rng = np.random.default_rng(fresh)
    truths = {name: float(value[0]) for name, value in quantities(drawn, regime, rng.standard_normal(1)).items()}
    draws = quantities(posterior, regime, rng.standard_normal(posterior.n.size))
    scores = {name: asdict(score(truth, draws[name])) for name, truth in truths.items()}
    if regime.weighs_laws:
        for name, truth in truths.items():
            scores[name]["inside"] = {f"{p:g}": inside(truth, draws[name], p) for p in INTERVALS}
    return record | facts | {"scores": scores}


def _fitted(
    campaign: Campaign, card: ModelCard, seed: np.random.SeedSequence, averaged: bool
) -> tuple[Drawn, dict[str, Any]]:
    """Fit with the shortest run that passes the verdict on convergence.

    Draws of the laws in proportion to their weights, or under the card's first law; and whether the fit converged,
    whether it says that the data speak against the first law (perhaps None), and the weights of the laws.
    """
    chain, choice = seed.spawn(2)
    sampler = replace(card.sampler, ensembles=2, walkers=max(card.sampler.walkers // 2, 64))
    fit = fit_campaign(campaign, replace(card, sampler=sampler), seed=int(chain.generate_state(1)[0]), thorough=False)
    group, weight = fit.tree["campaign_posterior"], fit.tree["laws"]["weight"]
    # (law, draw[, test]); laws of no weight need not have draws
    stacked = {field.name: group[field.name].to_numpy() for field in fields(Drawn) if field.name in group}
    values = {name: value.reshape(len(value), -1, *value.shape[3:]) for name, value in stacked.items()}
    size = values["n"].shape[1]
    share = np.nan_to_num(weight.sel(law=group["law"].to_numpy()).to_numpy().astype(np.float64))
    law = np.random.default_rng(choice).choice(share.size, size=size, p=share / share.sum())
    chosen: Any = (law, np.arange(size)) if averaged else 0
    reference = float(group.attrs["reference_scruton_number"])
    posterior = Drawn(reference_scruton_number=reference, **{name: value[chosen] for name, value in values.items()})
    weights = tuple(weight.to_numpy().astype(np.float64).tolist())
    flag = fit.summary.get("laws", {}).get("flag")
    return posterior, {"converged": fit.converged, "law_flag": flag, "weights": weights}


def cycles_recorded(rate: float, natural: float, relaxations: float = RELAXATIONS) -> float:
    """Length in cycles of a record of something that relaxes at `rate` [1/s]."""
    return float(np.clip(relaxations * natural / (2.0 * np.pi * rate), *CYCLES))


def simulate_campaign(regime: Regime, drawn: Drawn, setup: Setting, seed: np.random.SeedSequence) -> Campaign:
    """Simulate all records of one campaign, of which `drawn` and `setup` hold one draw.

    Mass, density and damping of the campaign are as the laboratory states them.
    """
    rigs, tests = [], []
    frequency, natural, kinds = FREQUENCY[regime.motion], omega0(regime.motion), regime.kinds
    for j, child in enumerate(seed.spawn(len(regime.scruton_numbers))):
        a_star, rate, xi = (float(draws[0, j]) for draws in (drawn.a_star, drawn.relaxation_rate, drawn.damping_ratio))
        mass, density = (float(np.asarray(draws)[0, j]) for draws in (setup.mass, setup.air_density))
        still = Truth(regime.motion, WIDTH, DEPTH, mass, frequency, xi)
        wind = replace(
            still, air_density=density, wind_speed=wind_speed(regime.motion), Y1=float(drawn.Y1[0, j]),
            epsilon=float(drawn.epsilon[0, j]), force="ehsan-scanlan" if regime.n == 2.0 else "paper",
        )  # fmt: skip
        choices, *children = child.spawn(1 + len(kinds) + regime.ring_downs)
        rng = np.random.default_rng(choices)
        plans = [(wind, kind, rng.uniform(*START[kind]), rate, RELAXATIONS) for kind in kinds]
        noise = _noise(regime, wind, a_star, rate, rng)
        ring_down = (still, Kind.FREE_DECAY, RING_DOWN_START, natural * xi, RING_DOWN_RELAXATIONS)
        records = []
        for number, (truth, kind, start, relaxes, times) in enumerate([*plans, *[ring_down] * regime.ring_downs], 1):
            time, response = simulate_record(
                truth, initial_amplitude=start * a_star,
                duration=cycles_recorded(relaxes, natural, times) / frequency,
                sample_rate=SAMPLES_PER_CYCLE * frequency, seed=children[number - 1],
                noise=noise,
            )  # fmt: skip
            name = f"{kind.value}-{j + 1}-{number}"
            records.append(Record(name, Path(f"{name}.csv"), kind, time, response))
        errors = (regime.mass_sd, regime.density_sd, regime.damping_sd)
        means = (float(values[j]) for values in stated(regime))
        nominal = [Quantity(mean, sd * mean if sd else None) for mean, sd in zip(means, errors, strict=True)]
        rigs.append(Rig(f"rig {j + 1}", Quantity(frequency), nominal[0], nominal[2], tuple(records[len(kinds) :])))
        speed = Quantity(wind_speed(regime.motion))
        tests.append(
            Test(f"test {j + 1}", f"rig {j + 1}", nominal[1], speed, peak=True, records=tuple(records[: len(kinds)]))
        )
    path, source = Path(f"{regime.name}.toml"), "simulated from the full equation of motion"
    return Campaign(path, regime.title, source, regime.section, tuple(rigs), tuple(tests))


def _noise(regime: Regime, wind: Truth, a_star: float, rate: float, rng: np.random.Generator) -> Noise:
    """Turbulence, gusts, set-points and sensor noise of one test; gusts and set-points are of the wind's speed."""
    shortest, longest = np.log(regime.gust_time)
    return Noise(
        regime.turbulence, sensor_noise=regime.sensor_noise * a_star,
        gust_intensity=regime.gust_scatter / wind.wind_exponent,
        gust_time=float(np.exp(rng.uniform(shortest, longest))) / rate,
        set_point=regime.set_point_scatter / wind.wind_exponent,
    )  # fmt: skip
