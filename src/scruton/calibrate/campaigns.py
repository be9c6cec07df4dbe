"""One campaign from its truth to its scores: the unit of work, the same wherever it runs.

Its records come from the full equation of motion or from VIVyD, never from the amplitude equation.
"""

from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.calibrate.bodies import Body, InWind, Simulated, draw_campaign, plain_rigs, still_rig
from scruton.calibrate.quantities import held, new_settings, own_settings, quantities, score
from scruton.calibrate.regimes import FREQUENCY, REGIMES, Regime
from scruton.calibrate.truths import Drawn, omega0, stated
from scruton.campaign import tests_used
from scruton.campaign.schema import Campaign, Kind, Quantity, Record, Rig, Test
from scruton.dynamics import Setting
from scruton.griffin import predict
from scruton.infer.cards import ModelCard
from scruton.infer.fit import fit_campaign, known_of
from scruton.infer.results import Fit
from scruton.infer.sampling import Known
from scruton.simulate import Noise

Scored = tuple[float, FloatArray]  # a truth, and the draws (S,) that shall hold it

SAMPLES_PER_CYCLE = 28
# Times that a record lasts for, within CYCLES; of lock-in too few for its fluctuations to be used, the mean alone is.
RELAXATIONS = {Kind.GROWTH: 5.5, Kind.DECAY: 5.5, Kind.STEADY: 20.0, Kind.FREE_DECAY: 3.0}
CYCLES = (15.0, 250.0)
START = {Kind.GROWTH: (0.1, 0.2), Kind.DECAY: (2.2, 2.5), Kind.STEADY: (1.0, 1.0)}  # over the stable amplitude
RING_DOWN_START = 2.0


def run_campaign(regime_name: str, index: int, seed: int, base: ModelCard) -> dict[str, Any]:
    """Draw a truth, simulate and fit its campaign, and score every quantity.

    Returns
    -------
    dict
        What one line of the regime's file holds: `regime`, its `definition`, `index`; `failed` with the reason, or
        `converged`, `law_flag`, `weights` and `scores`, by quantity `truth`, `rank`, `z`, `posterior_sd`, and where
        laws are weighed what `scruton.calibrate.quantities.held` says.
    """
    regime = REGIMES[regime_name]
    card = regime.card(base)
    draw, simulate, chains, fresh, beside = campaign_seeds(regime_name, index, seed)
    record: dict[str, Any] = {"regime": regime_name, "definition": regime.digest, "index": index}
    drawn, setup, body = draw_campaign(regime, card, draw, beside)
    rng = np.random.default_rng(fresh)
    scored: dict[str, Scored]
    try:
        campaign = simulate_campaign(regime, drawn, setup, simulate, body.rigs)
        chain, choice = chains.spawn(2)
        known = Known()
        fit = _fit(campaign, base if regime.outside else card, chain, known)
        posterior, facts = _posterior(fit, choice, regime.weighs_laws)
        if regime.outside:
            scored = own_settings(drawn, posterior, regime) | _predicted(fit, regime, body, rng)
            others, converged = _left_out(campaign, index, drawn, base, chain, known)
            scored, facts["converged"] = scored | others, facts["converged"] and converged
        else:
            truths = quantities(drawn, regime, rng.standard_normal(1))
            draws = quantities(posterior, regime, rng.standard_normal(posterior.n.size))
            scored = {name: (float(truth[0]), draws[name]) for name, truth in truths.items()}
    except ValueError as error:  # a record that cannot be used is counted, not hidden
        return record | {"failed": str(error)}
    scores = {name: asdict(score(*pair)) for name, pair in scored.items()}
    if regime.weighs_laws:
        usual = float(np.exp(np.log(drawn.a_star).mean()))
        for name, (truth, values) in scored.items():
            scores[name] |= held(truth, values, abs(truth) or usual)
    return record | facts | {"scores": scores}


def campaign_seeds(regime_name: str, index: int, seed: int) -> list[np.random.SeedSequence]:
    """Of one campaign's truth, records, chains and new settings, and of what is drawn beside the prior.

    They depend on nothing but the run's seed, the regime's place and the campaign's number.
    """
    return np.random.SeedSequence(seed, spawn_key=(list(REGIMES).index(regime_name), index)).spawn(5)


def _predicted(fit: Fit, regime: Regime, body: Body, rng: np.random.Generator) -> dict[str, Scored]:
    """Stable amplitude of new settings of the body, the truth and the draws of `predict`, by name.

    A place with more than one stable amplitude has no truth.
    """
    off, seed = float(np.exp((regime.miss or 0.0) * rng.standard_normal())), int(rng.integers(2**31))
    truths = {name: (sc, body.curve(sc) * off) for name, sc in new_settings(regime).items()}
    return {
        name: (truth, predict(fit.tree, scruton_number=sc, seed=seed).draws)
        for name, (sc, truth) in truths.items()
        if not np.isnan(truth)
    }


def _left_out(
    campaign: Campaign, index: int, drawn: Drawn, card: ModelCard, seed: np.random.SeedSequence, known: Known
) -> tuple[dict[str, Scored], bool]:
    """One rig's stable amplitude predicted from the others at its damping as stated, and whether their fit converged.

    Each campaign leaves out the next rig; nothing is left of a campaign of one. The seed is that of the whole, whose
    draws of the other rigs and tests, each by itself, are `known`.
    """
    names = [test.name for test in campaign.tests]
    if len(names) < 2:
        return {}, True
    j = index % len(names)
    others = tests_used(campaign, tuple(name for name in names if name != names[j]))
    fit = _fit(others, card, seed, known_of(others, known))
    draws = predict(fit.tree, damping_ratio=campaign.rigs[j].damping_ratio, seed=index).draws
    return {"A_new(left out)": (float(drawn.a_star[0, j]), draws)}, fit.converged


def _fit(campaign: Campaign, card: ModelCard, seed: np.random.SeedSequence, known: Known) -> Fit:
    """Fit as `scruton fit` does, without what predictions do not need."""
    return fit_campaign(campaign, card, seed=int(seed.generate_state(1)[0]), thorough=False, known=known)


def _posterior(fit: Fit, choice: np.random.SeedSequence, averaged: bool) -> tuple[Drawn, dict[str, Any]]:
    """Draws of the laws in proportion to their weights, or under the card's first law.

    And whether the fit converged, whether it says that the data speak against the first law (perhaps None), and the
    weights of the laws.
    """
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


def cycles_recorded(rate: float, natural: float, kind: Kind) -> float:
    """Length in cycles of a record of something that relaxes at `rate` [1/s]."""
    return float(np.clip(RELAXATIONS[kind] * natural / (2.0 * np.pi * rate), *CYCLES))


def simulate_campaign(
    regime: Regime, drawn: Drawn, setup: Setting, seed: np.random.SeedSequence, in_wind: Sequence[InWind] | None = None
) -> Campaign:
    """Simulate all records of one campaign, of which `drawn` and `setup` hold one draw.

    Mass, density and damping of the campaign are as the laboratory states them; the rigs in their wind are those of
    the regime's law where none are given.
    """
    rigs, tests = [], []
    frequency, natural, kinds = FREQUENCY[regime.motion], omega0(regime.motion), regime.kinds
    moved = plain_rigs(regime, drawn, setup) if in_wind is None else in_wind
    for j, (wind, child) in enumerate(zip(moved, seed.spawn(len(moved)), strict=True)):
        xi, mass = float(drawn.damping_ratio[0, j]), float(np.asarray(setup.mass)[0, j])
        a_star, rate = wind.stable
        still = Simulated(still_rig(regime, mass, xi), (0.0, natural * xi))
        choices, *children = child.spawn(1 + len(kinds) + regime.ring_downs)
        rng = np.random.default_rng(choices)
        plans: list[tuple[InWind, Kind, float, float]] = [
            (wind, kind, rng.uniform(*START[kind]), wind.slowest) for kind in kinds
        ]
        noise = _noise(regime, wind, a_star, rate, rng)
        ring_down = (still, Kind.FREE_DECAY, RING_DOWN_START, natural * xi)
        records = []
        for number, (rig, kind, start, relaxes) in enumerate([*plans, *[ring_down] * regime.ring_downs], 1):
            time, response = rig.record(
                initial_amplitude=start * a_star,
                duration=cycles_recorded(relaxes, natural, kind) / frequency,
                sample_rate=SAMPLES_PER_CYCLE * frequency, seed=children[number - 1],
                noise=noise,
            )  # fmt: skip
            name = f"{kind.value}-{j + 1}-{number}"
            records.append(Record(name, Path(f"{name}.csv"), kind, time, response))
        errors = (regime.mass_sd, regime.density_sd, regime.damping_sd)
        means = (float(values[j]) for values in stated(regime))
        nominal = [Quantity(mean, sd * mean if sd else None) for mean, sd in zip(means, errors, strict=True)]
        rigs.append(Rig(f"rig {j + 1}", Quantity(frequency), nominal[0], nominal[2], tuple(records[len(kinds) :])))
        speed = Quantity(wind.wind_speed)
        tests.append(
            Test(f"test {j + 1}", f"rig {j + 1}", nominal[1], speed, peak=True, records=tuple(records[: len(kinds)]))
        )
    path = Path(f"{regime.name}.toml")
    source = "simulated by VIVyD" if regime.wake else "simulated from the full equation of motion"
    return Campaign(path, regime.title, source, regime.section, tuple(rigs), tuple(tests))


def _noise(regime: Regime, wind: InWind, a_star: float, rate: float, rng: np.random.Generator) -> Noise:
    """Turbulence, gusts, set-points and sensor noise of one test; gusts and set-points are of the wind's speed."""
    shortest, longest = np.log(regime.gust_time)
    return Noise(
        regime.turbulence, sensor_noise=regime.sensor_noise * a_star,
        gust_intensity=regime.gust_scatter / wind.wind_exponent,
        gust_time=float(np.exp(rng.uniform(shortest, longest))) / rate,
        set_point=regime.set_point_scatter / wind.wind_exponent,
    )  # fmt: skip
