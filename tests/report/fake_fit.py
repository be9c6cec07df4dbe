"""A fit made up from the paper's Tables 1 and 5, in the layout of `result_schema`, without sampling anything.

Every number is drawn about the truth that the tables imply, so that figures and tables can be tested in a moment.
"""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from scruton.arrays import FloatArray
from scruton.campaign.schema import Campaign, Kind, Motion, Quantity, Record, Rig, Section, Sweep, Test
from scruton.dynamics.laws import amplitude_ratio
from scruton.envelope import Cycles, front_end, ring_down
from scruton.infer.cards import ModelCard, load_card
from scruton.infer.joint import joint_draws
from scruton.infer.models import NOISE
from scruton.infer.result_schema import SCHEMA, dataset, faults
from scruton.infer.results import Fit
from scruton.infer.store import convergence_frame
from scruton.infer.tree import inputs_group, parameters

CHAINS, DRAWS, RUNS, ENSEMBLES = 8, 60, 100, 4
# What the records are made to say of the card's laws: log evidence, its error (NaN: by Laplace's approximation).
EVIDENCE = {-1.0: (812.4, 0.04), 0.0: (810.9, 0.05), 1.0: (795.1, np.nan), 2.0: (741.0, np.nan)}
QUALITY = {"rhat_nested": 1.001, "ess_bulk": 1500.0, "ess_tail": 1300.0}


class Case(NamedTuple):
    """A test: its rig, the ingredients of its Scruton number, stable amplitude and the slope d(1/A)/dSc."""

    rig: str
    frequency: float
    mass: float
    damping_ratio: float
    air_density: float
    wind_speed: float
    a_star: float
    slope: float

    def factor(self, section: Section) -> float:
        """Scruton number per unit of damping ratio."""
        area = section.width * section.depth * (1.0 if section.motion is Motion.HEAVING else section.width**2)
        return 4 * np.pi * self.mass / (self.air_density * area)

    def rate(self, section: Section) -> float:
        """Relaxation rate: lambda = omega0 xi_s Sc_lambda/Sc with Sc_lambda = 1/(a* slope)."""
        return 2 * np.pi * self.frequency / (self.a_star * self.slope * self.factor(section))


CASES = {
    # Tables 1 and 5 (B/D = 4); the wind speed follows from K = omega D/U.
    Motion.HEAVING: (
        Case("1#", 7.97, 7.089, 0.00058, 1.19, 2 * np.pi * 7.97 * 0.075 / 0.6549, 0.06551, 0.8927),
        Case("6#", 7.87, 7.292, 0.0065, 1.22, 2 * np.pi * 7.87 * 0.075 / 0.7364, 0.0292, 0.7543),
        Case("9#", 7.88, 7.292, 0.0234, 1.22, 2 * np.pi * 7.88 * 0.075 / 0.7733, 0.01106, 0.9583),
    ),
    # Table 3; the amplitudes [rad] are made up, the paper gives none.
    Motion.TORSIONAL: (
        Case("1#", 7.257, 0.183, 0.00421, 1.213, 4.5, 0.0300, 25.0),
        Case("2#", 7.257, 0.183, 0.00443, 1.213, 4.5, 0.0292, 25.0),
        Case("3#", 7.520, 0.183, 0.00624, 1.213, 4.7, 0.0235, 25.0),
    ),
}
SECTIONS = {
    Motion.HEAVING: Section(Motion.HEAVING, 0.300, 0.075),
    Motion.TORSIONAL: Section(Motion.TORSIONAL, 0.5933, 0.0502),
}


def fake_fit(
    *,
    tests: int = 3,
    motion: Motion = Motion.HEAVING,
    growth: bool = True,
    measured: bool = True,
    sweeps: bool = True,
    ringdowns: bool = True,
    steady: bool = False,
    names: Sequence[str] = (),
    cycles_per_record: int | None = None,
    law_n: float = -1.0,
    laws: bool = True,
    seed: int = 1,
) -> Fit:
    """Make the fit up.

    There are `tests`: the three rows of the table first, then the same at other wind speeds, which are no peak tests.
    They have names of their own in place of "Sc 1.9" and so on, where `names` are given; stable amplitudes where they
    are `measured`; a decay record, beside it one of `growth`, or one of `steady` lock-in alone, which gives no trial
    function and no amplitude per cycle. Records last for six relaxation times, or for so many cycles. Under the paper's
    law the card's other laws are weighed, too, unless `laws` is false; of those n = 0 was sampled.
    """
    rng, section = np.random.default_rng(seed), SECTIONS[motion]
    table = CASES[motion]
    rows = [
        row._replace(wind_speed=row.wind_speed * (1 - 0.05 * step), a_star=row.a_star * 0.8**step)
        for step, row in ((i // 3, table[i % 3]) for i in range(tests))
    ]
    cycles: dict[str, Cycles] = {}
    rigs, wind_tests = [], []
    for i, row in enumerate(rows):
        stem, sc = f"test{i + 1}", row.factor(section) * row.damping_ratio
        label = f"Sc {sc:.1f}" if motion is Motion.HEAVING else f"Sc {sc:.3f}"
        kinds = {Kind.STEADY: 1.0} if steady else {Kind.DECAY: 2.2} | ({Kind.GROWTH: 0.2} if growth else {})
        length = 6 / row.rate(section) if cycles_per_record is None else cycles_per_record / row.frequency
        records = []
        for kind, start in kinds.items():
            time = np.arange(0, length, 1 / (25 * row.frequency))
            a = row.a_star * (1 + (start - 1) * np.exp(-row.rate(section) * time)) * (1 + 0.01 * slow(time.size, rng))
            response = a * np.cos(2 * np.pi * row.frequency * time + 0.4) + 2e-4 * a[0] * rng.standard_normal(time.size)
            records.append(record(f"{stem}_{kind.value}.csv", kind, time, response))
        still = []
        for start in (0.03, 0.015) if ringdowns and i < 3 else ():
            omega = 2 * np.pi * row.frequency
            time = np.arange(0, 2.5 / (omega * row.damping_ratio), 1 / (25 * row.frequency))[:20000]
            response = start * np.exp(-row.damping_ratio * omega * time) * np.cos(omega * time)
            noise = 2e-4 * start * rng.standard_normal(time.size)
            still.append(record(f"{stem}_pluck{len(still) + 1}.csv", Kind.FREE_DECAY, time, response + noise))
        cycles |= {one.name: cycles_of(one, row.frequency, rng) for one in (*records, *still)}
        stable = Quantity(row.a_star, 0.02 * row.a_star if motion is Motion.HEAVING else None) if measured else None
        air, speed = Quantity(row.air_density), Quantity(row.wind_speed)
        name = names[i] if names else label + (f", speed {i // 3 + 1}" if i > 2 else "")
        wind_tests.append(Test(name, row.rig, air, speed, i < 3, stable, tuple(records)))
        if i < 3:
            frequency, mass, damping = Quantity(row.frequency, 0.01), Quantity(row.mass), Quantity(row.damping_ratio)
            rigs.append(Rig(row.rig, frequency, mass, damping, tuple(still)))
    campaign = Campaign(
        Path("campaign.toml"), "Rectangular cylinder B/D = 4, made up", "Tables 1 and 5", section,
        tuple(rigs), tuple(wind_tests), sweeps_of(rows[:3]) if sweeps else (), {"campaign.toml": "0" * 64},
    )  # fmt: skip
    fronts = {
        one.name: front_end(
            one, frequency=row.frequency, still_air_frequency=row.frequency, damping_ratio=row.damping_ratio,
            mass_damping_factor=row.factor(section),
        )
        for test, row in zip(wind_tests, rows, strict=True)
        for one in test.records
        if not steady
    }  # fmt: skip
    plucks = {rig.name: ring_down([cycles[one.name] for one in rig.records]) for rig in rigs if rig.records}
    card = load_card("default")
    if law_n != -1.0 or not laws:
        card = replace(card, laws=(law_n,), law_weights=(1.0,))
    groups = groups_of(campaign, rows, cycles, law_n, rng)
    groups |= campaign_groups(groups, card, np.random.default_rng([seed, 1]))
    summary, groups["convergence"] = summary_of(campaign, groups, law_n)
    groups["inputs"] = inputs_group(campaign, card)
    tree = xr.DataTree.from_dict({f"/{name}": group for name, group in groups.items()})
    tree.attrs["provenance"] = json.dumps(summary["provenance"], sort_keys=True)
    assert not faults(tree), "what is made up is laid out as what is written"
    return Fit(campaign, card, tree, cycles, plucks, fronts, convergence_frame(tree), (), True, summary)


def record(name: str, kind: Kind, time: FloatArray, response: FloatArray) -> Record:
    return Record(name, Path(name), kind, time, response)


def slow(size: int, rng: np.random.Generator) -> FloatArray:
    """Noise that takes a hundred samples to change."""
    knots = rng.standard_normal(size // 100 + 3)
    return np.interp(np.arange(size), np.arange(knots.size) * 100, knots)


def cycles_of(one: Record, frequency: float, rng: np.random.Generator) -> Cycles:
    step = 1 / frequency
    time = np.arange(one.time[0] + step / 2, one.time[-1] - step / 2, step)
    complex_envelope = one.response * np.exp(-2j * np.pi * frequency * one.time)
    samples = round(step / (one.time[1] - one.time[0]))
    amplitude = np.abs(2 * complex_envelope[: time.size * samples].reshape(time.size, samples).mean(axis=1))
    error, drift = 1e-3 * float(amplitude.max()), frequency + 1e-3 * frequency * rng.standard_normal(time.size)
    phase = np.cumsum(2 * np.pi * (drift - frequency) * step)
    errors, mismatch = np.full(time.size, error), np.full(time.size, 0.01)
    return Cycles(time, amplitude, errors, phase, drift, mismatch, frequency, error)


def sweeps_of(rows: Sequence[Case]) -> tuple[Sweep, ...]:
    ratio = np.linspace(0.7, 1.3, 13)
    rise = np.clip((ratio - 0.75) / 0.25, 0, 1) ** 1.5
    shape = np.where(ratio <= 1.0, rise, np.maximum(1 - (ratio - 1) / 0.08, 0.02))
    return tuple(
        Sweep(row.rig, Quantity(row.air_density), row.wind_speed * ratio, row.a_star * shape, Path(f"sweep{i}.csv"))
        for i, row in enumerate(rows, 1)
    )


def groups_of(
    campaign: Campaign, rows: Sequence[Case], cycles: dict[str, Cycles], law_n: float, rng: np.random.Generator
) -> dict[str, xr.Dataset]:
    """Posteriors about the truth, and what they are conditioned on."""
    section, names = campaign.section, [test.name for test in campaign.tests]
    shape, ensemble = (CHAINS, DRAWS), np.repeat(np.arange(ENSEMBLES), CHAINS // ENSEMBLES)
    posterior, trials, by_cycle = [], [], []
    noise = load_card().priors
    for row, test in zip(rows, campaign.tests, strict=True):
        z = rng.standard_normal((2, *shape))
        a_star = row.a_star * np.exp(0.008 * z[0] - 0.01)
        rate = row.rate(section) * np.exp(0.06 * (0.7 * z[0] + np.sqrt(1 - 0.49) * z[1]))
        xi = row.damping_ratio * np.exp(0.03 * rng.standard_normal(shape))
        factor, omega = row.factor(section), 2 * np.pi * row.frequency
        own = {
            "a_star": a_star,
            "relaxation_rate": rate,
            **{name: np.exp(noise[name].location + 0.2 * rng.standard_normal(shape)) for name in NOISE},
            "damping_ratio": xi,
            "scruton_number": factor * xi,
            "relaxation_scruton_number": factor * rate / omega,
            "mass_damping_factor": np.full(shape, factor),
        }
        posterior.append(own | (force_parameters(section, row, a_star, rate, xi) if law_n == -1.0 else {}))
        for one in test.records:
            if one.kind is Kind.STEADY:
                continue
            cycle = cycles[one.name]
            pick = rng.integers(0, a_star.size, RUNS)
            a, relaxed = a_star.ravel()[pick, None], np.exp(-rate.ravel()[pick, None] * (cycle.time - cycle.time[0]))
            mean = a + (cycle.amplitude[0] - a) * relaxed
            by_cycle.append((test.name, one.name, cycle, mean, mean + 0.012 * a * rng.standard_normal(mean.shape)))
            trials.append(
                {
                    "a": a_star * np.exp(0.004 * rng.standard_normal(shape)),
                    "b": -1e-3 * rate * np.abs(rng.standard_normal(shape)),
                    "c": (cycle.amplitude[0] / row.a_star - 1) * a_star,
                    "d": -rate * np.exp(0.03 * rng.standard_normal(shape)),
                    "residual_sd": 0.01 * a_star,
                    "residual_rate": 0.5 * omega * np.exp(0.2 * rng.standard_normal(shape)),
                }
            )
    measured = [test.stable_amplitude for test in campaign.tests]
    constants: dict[str, Any] = {
        "width": section.width, "depth": section.depth, "law_n": law_n, "motion": section.motion.value,
        "amplitude_unit": section.amplitude_unit, "wind_frequency": [row.frequency for row in rows],
        **{key: [getattr(row, key) for row in rows]
           for key in ("mass", "air_density", "wind_speed", "frequency", "rig")},
        "peak": [int(bool(test.peak)) for test in campaign.tests],
        "stable_amplitude": [one.mean if one else np.nan for one in measured],
        "stable_amplitude_sd": [(one.sd or np.nan) if one else np.nan for one in measured],
    }  # fmt: skip

    def stacked(columns: Sequence[dict[str, FloatArray]]) -> dict[str, FloatArray]:
        return {key: np.stack([one[key] for one in columns], axis=-1) for key in columns[0]}

    lp = -0.5 * rng.chisquare(5, (*shape, len(names)))
    damping = stacked([{"damping_ratio": one["damping_ratio"]} for one in posterior[: len(campaign.rigs)]])
    rigs = [rig.name for rig in campaign.rigs]
    groups = {
        "posterior": dataset("posterior", stacked(posterior), ensemble=ensemble, test=names),
        "sample_stats": dataset("sample_stats", {"lp": lp}, ensemble=ensemble, test=names),
        "rig_posterior": dataset("rig_posterior", damping, ensemble=ensemble, rig=rigs),
    }
    if by_cycle:
        of_test, of_record, kept, means, runs = zip(*by_cycle, strict=True)
        ends = {"origin": [one.time[0] for one in kept], "end": [one.time[-1] for one in kept]}
        groups["trial_function"] = dataset(
            "trial_function", stacked(trials) | ends | {"record_test": list(of_test)}, record=list(of_record),
            ensemble=ensemble,
        )  # fmt: skip
        free = {
            key: np.concatenate(one, axis=-1)[None] for key, one in (("amplitude", runs), ("mean_amplitude", means))
        }
        groups["posterior_predictive"] = dataset("posterior_predictive", free)
        observed = np.concatenate([one.amplitude for one in kept])
        groups["observed_data"] = dataset("observed_data", {"amplitude": observed})
        sizes = [one.time.size for one in kept]
        constants |= {key: np.concatenate([getattr(one, key) for one in kept]) for key in ("time", "standard_error")}
        constants |= {"record": np.repeat(of_record, sizes), "record_test": np.repeat(of_test, sizes)}
        seen = [[one.amplitude for of, one in zip(of_test, kept, strict=True) if of == name] for name in names]
        for end, pick in (("transient_low", np.min), ("transient_high", np.max)):
            constants[end] = [float(pick(np.concatenate(own))) if own else np.nan for own in seen]
    return groups | {"constant_data": dataset("constant_data", constants, test=names)}


def force_parameters(
    section: Section, row: Case, a_star: FloatArray, rate: FloatArray, xi: FloatArray
) -> dict[str, FloatArray]:
    """Y1 and epsilon of Eq. (9), or of Eq. (12), from (a*, lambda)."""
    k, rate_s = 2 * np.pi * row.frequency * section.depth / row.wind_speed, rate * section.depth / row.wind_speed
    beta = 1.0 if section.motion is Motion.HEAVING else section.width / section.depth
    ratio = row.air_density * section.depth**2 / row.mass * (1.0 if beta == 1.0 else section.width**2)
    y1 = 2 / (ratio * beta) * (k * xi - rate_s)
    return {"Y1": y1, "epsilon": -np.pi * k * rate_s * a_star / (2 * ratio) / y1}


def campaign_groups(groups: dict[str, xr.Dataset], card: ModelCard, rng: np.random.Generator) -> dict[str, xr.Dataset]:
    """The campaign model: each draw of the peak tests has a curve that passes between them."""
    peaks = groups["posterior"].isel(test=np.flatnonzero(groups["constant_data"]["peak"]))
    labels, prior = np.array([f"n={n:g}" for n in card.laws]), np.array(card.law_weights)
    evidence, error = np.array([EVIDENCE[n] if len(card.laws) > 1 else (np.nan, np.nan) for n in card.laws]).T
    sampled = np.isfinite(error) | (len(card.laws) == 1)
    weight = np.where(sampled, prior * np.exp(evidence - evidence[0]), 0.0) if len(card.laws) > 1 else prior
    reference = float(np.exp(np.log(peaks["scruton_number"].median(("chain", "draw"))).mean()))
    fitted = [shared_curve(peaks, n, reference, rng) for n, kept in zip(card.laws, sampled, strict=True) if kept]
    group = xr.concat(fitted, dim="law", coords="minimal", compat="override").assign_coords(law=labels[sampled])
    group.attrs["reference_scruton_number"] = reference
    group.attrs["reference_mass_damping_factor"] = float(np.exp(np.log(peaks["mass_damping_factor"]).mean()))
    rows = {
        "prior_weight": prior, "weight": weight / weight.sum(),
        "stacking_weight": np.where(sampled, 1.0 / sampled.sum(), 0.0), "log_evidence": evidence,
        "log_evidence_error": error, "sampled": sampled.astype(float),
    }  # fmt: skip
    laws = dataset("laws", rows, law=labels)
    return {"campaign_posterior": group.transpose("law", "chain", "draw", "peak_test"), "laws": laws}


def shared_curve(tests: xr.Dataset, n: float, reference: float, rng: np.random.Generator) -> xr.Dataset:
    """The campaign's variables under one law: geometric means over the tests of what each says of the curve."""
    sc = tests["scruton_number"]
    # The tests' own strengths of the wind, but enough of it for a vibration at every one.
    strength = np.exp(np.log(np.maximum(tests["relaxation_scruton_number"] + n * sc, 1.0)).mean("test"))
    relaxation = np.maximum(strength - n * reference, 1.05 * n * (sc.max("test") - reference))
    ratio = xr.apply_ufunc(amplitude_ratio, (sc - reference) / relaxation, n)
    amplitude = np.exp(np.log(tests["a_star"] / ratio).mean("test"))
    scales = {
        f"discrepancy_{of}": amplitude.copy(data=median * np.exp(0.3 * rng.standard_normal(amplitude.shape)))
        for of, median in (("amplitude", 0.09), ("relaxation", 0.2))
    }
    unknown = {} if n == -1.0 else dict.fromkeys(("Y1", "epsilon"), xr.full_like(tests["a_star"], np.nan))
    own = [one.name for one in SCHEMA["campaign_posterior"] if one.dims[-1] == "peak_test"]
    return (
        tests.assign(unknown)[own]
        .rename(test="peak_test")
        .assign(**scales, n=xr.full_like(amplitude, n), reference_amplitude=amplitude, reference_relaxation=relaxation)
    )


def entries(group: xr.Dataset) -> dict[str, Any]:
    """Every parameter of a group as fit.json has it."""
    return parameters({str(k): one.to_numpy() for k, one in group.data_vars.items() if "draw" in one.dims})


def summary_of(campaign: Campaign, groups: dict[str, xr.Dataset], law_n: float) -> tuple[dict[str, Any], xr.Dataset]:
    """The content of fit.json, and the convergence of every posterior in it."""
    rows: list[dict[str, Any]] = []
    rest = {"tau": 12.0, "steps": 500, "acceptance": 0.6, "stuck": 0, "converged": True}

    def sampled(group: str, name: str, posterior: str, **of: str) -> dict[str, Any]:
        found = {key: one | QUALITY for key, one in entries(groups[group].sel(of)).items()}
        rows.extend({"posterior": posterior, "parameter": key} | QUALITY | rest for key in found)
        return {"name": name, "parameters": found}

    joint = joint_draws(xr.DataTree.from_dict({f"/{name}": group for name, group in groups.items()}))
    peaks = {name: parameters(draws) for name, draws in joint.tests.items()}

    def of_test(test: Test) -> dict[str, Any]:
        own = sampled("posterior", test.name, f"test {test.name}", test=test.name)
        if test.name not in peaks:
            return own
        return own | {"parameters": peaks[test.name], "alone": own["parameters"]}

    keys = {"prior_weight": "prior", "weight": "weight", "stacking_weight": "stacking", "log_evidence": "log_evidence",
            "log_evidence_error": "log_evidence_error"}  # fmt: skip
    weights = {
        str(law): {name: float(row[key]) if np.isfinite(row[key]) else None for key, name in keys.items()}
        | {"sampled": bool(row["sampled"])}
        for law, row in groups["laws"].to_dataframe().iterrows()
    }
    section = campaign.section
    summary = {
        "format": 1, "title": campaign.title, "converged": True, "flags": [], "law_n": law_n,
        "amplitude_unit": section.amplitude_unit,
        "laws": {"flag": False, "forces_hold": law_n == -1.0, "weights": weights},
        "campaign": {
            "reference_scruton_number": groups["campaign_posterior"].attrs["reference_scruton_number"],
            "parameters": parameters(joint.shared),
            "left_at_prior": [],
            "tests": [{"name": name, "parameters": found} for name, found in peaks.items()],
        },
        "tests": [
            of_test(test)
            | {"rig": test.rig, "peak": bool(test.peak), "lock_in": [],
               "wind_frequency": campaign.rig(test.rig).frequency.mean}
            for test in campaign.tests
        ],
        "rigs": [
            sampled("rig_posterior", rig.name, f"rig {rig.name}", rig=rig.name) | {"bands": []} for rig in campaign.rigs
        ],
        "records": [
            sampled("trial_function", one.name, f"trial function of {one.name}", record=one.name) | {"test": test.name}
            for test in campaign.tests
            for one in test.records
            if "trial_function" in groups
        ],
        "provenance": {
            "command": "fit --seed 1 --model default", "seed": 1, "tests": [], "sha256": dict(campaign.sha256 or {}),
            "versions": {"python": "3.13.0", "scruton": "0.1.0", "numpy": "2.5.0"},
            "card": {"name": "default", "sha256": "0" * 64, "text": "format = 1\n"},
            "campaign": {"title": campaign.title, "source": campaign.source, "motion": section.motion.value,
                         "width": section.width, "depth": section.depth},
        },
    }  # fmt: skip
    columns = {one.name: [row[one.name] for row in rows] for one in SCHEMA["convergence"]}
    return summary, dataset("convergence", columns)


def led_by(fit: Fit, **weights: float) -> Fit:
    """The fit with the weights of laws that were sampled as stated, `paper` for n = -1 and `gompertz` for n = 0."""
    of = {"n=-1": weights.get("paper", 0.0), "n=0": weights.get("gompertz", 0.0)}
    laws = fit.tree["laws"].to_dataset()
    tree = fit.tree.copy()
    tree["laws"] = xr.DataTree(laws.assign(weight=("law", [of.get(str(law), 0.0) for law in laws["law"].to_numpy()])))
    joint, summary = joint_draws(tree), json.loads(json.dumps(fit.summary))
    for test in summary["tests"]:
        test["parameters"] = parameters(joint.tests[test["name"]])
    summary["laws"]["forces_hold"] = of["n=-1"] > 0.0
    for law, entry in summary["laws"]["weights"].items():
        entry["weight"] = of.get(law, 0.0)
    return replace(fit, tree=tree, summary=summary)
