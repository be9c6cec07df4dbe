"""A fit made up from the paper's Tables 1 and 5, in the layout that inference writes, without sampling anything.

Layout and summary are inference's own (`result_schema`, `summary`); every number is drawn about the truth that the
tables imply, so that figures and tables can be tested in a moment.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from scruton.arrays import FloatArray
from scruton.campaign.schema import Campaign, Kind, Motion, Quantity, Record, Rig, Section, Sweep, Test
from scruton.dynamics.laws import amplitude_ratio
from scruton.envelope import Cycles, RingDown, front_end, ring_down
from scruton.infer.cards import ModelCard, load_card
from scruton.infer.result_schema import SCHEMA, dataset, faults
from scruton.infer.results import Fit
from scruton.infer.store import convergence_frame
from scruton.infer.tree import inputs_group, parameters

CHAINS, DRAWS, RUNS, ENSEMBLES = 8, 60, 100, 4


@dataclass(frozen=True)
class Case:
    """A row: rig, Scruton number's ingredients, stable amplitude and the slope d(1/A)/dSc."""

    rig: str
    frequency: float
    mass: float
    damping_ratio: float
    air_density: float
    wind_speed: float
    a_star: float
    slope: float


# Tables 1 and 5 (heaving, B/D = 4); the wind speed follows from K = omega D/U.
HEAVING = (
    Case("1#", 7.97, 7.089, 0.00058, 1.19, 2 * np.pi * 7.97 * 0.075 / 0.6549, 0.06551, 0.8927),
    Case("6#", 7.87, 7.292, 0.0065, 1.22, 2 * np.pi * 7.87 * 0.075 / 0.7364, 0.0292, 0.7543),
    Case("9#", 7.88, 7.292, 0.0234, 1.22, 2 * np.pi * 7.88 * 0.075 / 0.7733, 0.01106, 0.9583),
)
# Table 3 (torsional); the amplitudes [rad] are made up, the paper gives none.
TORSIONAL = (
    Case("1#", 7.257, 0.183, 0.00421, 1.213, 4.5, 0.0300, 25.0),
    Case("2#", 7.257, 0.183, 0.00443, 1.213, 4.5, 0.0292, 25.0),
    Case("3#", 7.520, 0.183, 0.00624, 1.213, 4.7, 0.0235, 25.0),
)


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

    Parameters
    ----------
    tests : int
        How many tests: the three rows first, then the same at other wind speeds, which are no peak tests.
    growth : bool
        A growth record beside the decay record in every test.
    measured, sweeps, ringdowns : bool
        Whether stable amplitudes, sweeps and free-decay records are there.
    steady : bool
        Lock-in records without release instead of transients: no trial function, no amplitude per cycle.
    names : sequence of str
        Names of the tests in place of "Sc 1.9" and so on.
    cycles_per_record : int
        Length of the records; by default six relaxation times.
    law_n : float
        The reference law.
    laws : bool
        Under the paper's law: whether the card's other laws are weighed too, of which n = 0 was sampled.
    """
    rng = np.random.default_rng(seed)
    heaving = motion is Motion.HEAVING
    section = Section(motion, 0.300, 0.075) if heaving else Section(motion, 0.5933, 0.0502)
    rows = [_row(HEAVING if heaving else TORSIONAL, i) for i in range(tests)]
    scruton = [_scruton_number(section, row) for row in rows]
    labels = list(names) or [
        (f"Sc {sc:.1f}" if heaving else f"Sc {sc:.3f}") + (f", speed {i // 3 + 1}" if i > 2 else "")
        for i, sc in enumerate(scruton)
    ]
    cycles: dict[str, Cycles] = {}
    rigs, wind_tests, truths = [], [], []
    for row, sc, label in zip(rows, scruton, labels, strict=True):
        truth = _Truth(row, section, sc)
        truths.append(truth)
        stem = f"test{len(truths)}"
        kinds = [(Kind.DECAY, 2.2)] + ([(Kind.GROWTH, 0.2)] if growth else [])
        kinds = [(Kind.STEADY, 1.0)] if steady else kinds
        records = tuple(
            _record(f"{stem}_{kind.value}.csv", kind, row, truth, start, cycles_per_record, rng)
            for kind, start in kinds
        )
        still = tuple(
            _ring_down_record(f"{stem}_pluck{i}.csv", row, 0.03 / i, rng)
            for i in (1, 2)
            if ringdowns and len(truths) <= 3
        )
        for record in (*records, *still):
            cycles[record.name] = _cycles(record, row.frequency, rng)
        if len(truths) <= 3:
            rigs.append(
                Rig(row.rig, Quantity(row.frequency, 0.01), Quantity(row.mass), Quantity(row.damping_ratio), still)
            )
        wind_tests.append(
            Test(
                label, row.rig, Quantity(row.air_density), Quantity(row.wind_speed), len(truths) <= 3,
                Quantity(row.a_star, 0.02 * row.a_star if heaving else None) if measured else None, records,
            )
        )  # fmt: skip
    campaign = Campaign(
        Path("campaign.toml"), "Rectangular cylinder B/D = 4, made up", "Tables 1 and 5", section,
        tuple(rigs), tuple(wind_tests), _sweeps(rows[:3]) if sweeps else (), {"campaign.toml": "0" * 64},
    )  # fmt: skip
    fronts = {
        record.name: front_end(
            record, frequency=row.frequency, still_air_frequency=row.frequency, damping_ratio=row.damping_ratio,
            mass_damping_factor=sc / row.damping_ratio,
        )
        for test, row, sc in zip(wind_tests, rows, scruton, strict=True)
        for record in test.records
        if not steady
    }  # fmt: skip
    plucks: dict[str, RingDown] = {
        rig.name: ring_down([cycles[record.name] for record in rig.records]) for rig in rigs if rig.records
    }
    card = load_card("default")
    if law_n != -1.0 or not laws:
        card = replace(card, laws=(law_n,), law_weights=(1.0,))
    tree = _tree(campaign, truths, cycles, law_n, rng)
    tree = _with_campaign(tree, card, np.random.default_rng([seed, 1]))
    summary, convergence = _summary(campaign, tree, law_n)
    tree["convergence"] = xr.DataTree(convergence)
    tree["inputs"] = xr.DataTree(inputs_group(campaign, card))
    assert not faults(tree), "what is made up is laid out as what is written"
    return Fit(campaign, card, tree, cycles, plucks, fronts, convergence_frame(tree), (), True, summary)


def _row(rows: Sequence[Case], index: int) -> Case:
    """A row of the table, or one of its rigs in other wind, with a smaller amplitude."""
    step, row = index // len(rows), rows[index % len(rows)]
    return replace(row, wind_speed=row.wind_speed * (1 - 0.05 * step), a_star=row.a_star * 0.8**step)


def _mass_damping_factor(section: Section, row: Case) -> float:
    if section.motion is Motion.HEAVING:
        return float(4 * np.pi * row.mass / (row.air_density * section.width * section.depth))
    return float(4 * np.pi * row.mass / (row.air_density * section.width**3 * section.depth))


def _scruton_number(section: Section, row: Case) -> float:
    return _mass_damping_factor(section, row) * row.damping_ratio


class _Truth:
    """What the row implies: Sc_lambda = 1/(a* slope), lambda = omega0 xi_s Sc_lambda/Sc."""

    def __init__(self, row: Case, section: Section, sc: float) -> None:
        self.row, self.section, self.sc = row, section, sc
        self.relaxation_sc = 1 / (row.a_star * row.slope)
        self.rate = 2 * np.pi * row.frequency * row.damping_ratio * self.relaxation_sc / sc

    def amplitude(self, time: FloatArray, start: float) -> FloatArray:
        """Closed form of Eq. (10)."""
        return self.row.a_star * (1 + (start - 1) * np.exp(-self.rate * time))


def _record(
    name: str, kind: Kind, row: Case, truth: _Truth, start: float, count: int | None, rng: np.random.Generator
) -> Record:
    length = 6 / truth.rate if count is None else count / row.frequency
    time = np.arange(0, length, 1 / (25 * row.frequency))
    a = truth.amplitude(time, start) * (1 + 0.01 * _slow_noise(time.size, 100, rng))
    response = a * np.cos(2 * np.pi * row.frequency * time + 0.4) + 2e-4 * a[0] * rng.standard_normal(time.size)
    return Record(name, Path(name), kind, time, response)


def _ring_down_record(name: str, row: Case, start: float, rng: np.random.Generator) -> Record:
    omega = 2 * np.pi * row.frequency
    time = np.arange(0, 2.5 / (omega * row.damping_ratio), 1 / (25 * row.frequency))[:20000]
    response = start * np.exp(-row.damping_ratio * omega * time) * np.cos(omega * time)
    return Record(name, Path(name), Kind.FREE_DECAY, time, response + 2e-4 * start * rng.standard_normal(time.size))


def _slow_noise(size: int, correlation: int, rng: np.random.Generator) -> FloatArray:
    knots = rng.standard_normal(size // correlation + 3)
    return np.interp(np.arange(size), np.arange(knots.size) * correlation, knots)


def _cycles(record: Record, frequency: float, rng: np.random.Generator) -> Cycles:
    step = 1 / frequency
    time = np.arange(record.time[0] + step / 2, record.time[-1] - step / 2, step)
    complex_envelope = record.response * np.exp(-2j * np.pi * frequency * record.time)
    samples = round(step / (record.time[1] - record.time[0]))
    amplitude = np.abs(2 * complex_envelope[: time.size * samples].reshape(time.size, samples).mean(axis=1))
    error = np.full(time.size, 1e-3 * amplitude.max())
    drift = frequency + 1e-3 * frequency * rng.standard_normal(time.size)
    return Cycles(
        time, amplitude, error, np.cumsum(2 * np.pi * (drift - frequency) * step), drift, np.full(time.size, 0.01),
        frequency, 1e-3 * float(amplitude.max()),
    )  # fmt: skip


def _sweeps(rows: Sequence[Case]) -> tuple[Sweep, ...]:
    found = []
    for i, row in enumerate(rows):
        ratio = np.linspace(0.7, 1.3, 13)
        rise = np.clip((ratio - 0.75) / 0.25, 0, 1) ** 1.5
        amplitude = row.a_star * np.where(ratio <= 1.0, rise, np.maximum(1 - (ratio - 1) / 0.08, 0.02))
        found.append(
            Sweep(row.rig, Quantity(row.air_density), row.wind_speed * ratio, amplitude, Path(f"sweep{i + 1}.csv"))
        )
    return tuple(found)


def _tree(
    campaign: Campaign, truths: Sequence[_Truth], cycles: dict[str, Cycles], law_n: float, rng: np.random.Generator
) -> xr.DataTree:
    shape = (CHAINS, DRAWS)
    ensemble = np.repeat(np.arange(ENSEMBLES), CHAINS // ENSEMBLES)
    section = campaign.section
    names = [test.name for test in campaign.tests]

    def draws_of(group: str, arrays: dict[str, list[FloatArray]], **labels: list[str]) -> xr.Dataset:
        stacked = {key: np.stack(value, axis=-1) for key, value in arrays.items()}
        return dataset(group, stacked, ensemble=ensemble, **labels)

    columns: dict[str, list[FloatArray]] = {}
    damping = []
    predictive, means, observed, at, errors, of_record, of_test = [], [], [], [], [], [], []
    trial: dict[str, list[FloatArray]] = {key: [] for key in ("a", "b", "c", "d", "residual_sd", "residual_rate")}
    ends, record_names, trial_tests = [], [], []
    for truth, test in zip(truths, campaign.tests, strict=True):
        row = truth.row
        z = rng.standard_normal((2, *shape))
        a_star = row.a_star * np.exp(0.008 * z[0] - 0.01)
        rate = truth.rate * np.exp(0.06 * (0.7 * z[0] + np.sqrt(1 - 0.49) * z[1]))
        xi = row.damping_ratio * np.exp(0.03 * rng.standard_normal(shape))
        if len(damping) < len(campaign.rigs):
            damping.append(xi)
        factor = _mass_damping_factor(section, row)
        omega0 = 2 * np.pi * row.frequency
        one = {
            "a_star": a_star,
            "relaxation_rate": rate,
            "amplitude_scatter": 0.01 * np.exp(0.2 * rng.standard_normal(shape)),
            "noise_factor": np.exp(0.1 * rng.standard_normal(shape)),
            "damping_ratio": xi,
            "scruton_number": factor * xi,
            "relaxation_scruton_number": factor * rate / omega0,
            "mass_damping_factor": np.full(shape, factor),
        }
        if law_n == -1.0:
            one |= _force_parameters(section, row, a_star, rate, xi)
        for key, value in one.items():
            columns.setdefault(key, []).append(value)
        for record in (one for one in test.records if one.kind is not Kind.STEADY):
            cycle = cycles[record.name]
            t, start = cycle.time - cycle.time[0], cycle.amplitude[0] / row.a_star
            pick = rng.integers(0, a_star.size, RUNS)
            a, lam = a_star.ravel()[pick, None], rate.ravel()[pick, None]
            mean = a + (start * row.a_star - a) * np.exp(-lam * t)
            means.append(mean)
            predictive.append(mean + 0.012 * a * rng.standard_normal(mean.shape))
            observed.append(cycle.amplitude)
            at.append(cycle.time)
            errors.append(cycle.standard_error)
            of_record += [record.name] * cycle.time.size
            of_test += [test.name] * cycle.time.size
            trial["a"].append(a_star * np.exp(0.004 * rng.standard_normal(shape)))
            trial["b"].append(-1e-3 * rate * np.abs(rng.standard_normal(shape)))
            trial["c"].append((start - 1) * a_star)
            trial["d"].append(-rate * np.exp(0.03 * rng.standard_normal(shape)))
            trial["residual_sd"].append(0.01 * a_star)
            trial["residual_rate"].append(0.5 * omega0 * np.exp(0.2 * rng.standard_normal(shape)))
            ends.append((float(cycle.time[0]), float(cycle.time[-1])))
            record_names.append(record.name)
            trial_tests.append(test.name)
    measured = [test.stable_amplitude for test in campaign.tests]
    constants: dict[str, Any] = {
        "width": section.width,
        "depth": section.depth,
        "law_n": law_n,
        "motion": section.motion.value,
        "amplitude_unit": section.amplitude_unit,
        "mass": [t.row.mass for t in truths],
        "air_density": [t.row.air_density for t in truths],
        "wind_speed": [t.row.wind_speed for t in truths],
        "frequency": [t.row.frequency for t in truths],
        "wind_frequency": [t.row.frequency for t in truths],
        "rig": [t.row.rig for t in truths],
        "peak": [int(bool(t.peak)) for t in campaign.tests],
        "stable_amplitude": [one.mean if one else np.nan for one in measured],
        "stable_amplitude_sd": [(one.sd or np.nan) if one else np.nan for one in measured],
    }
    lp = -0.5 * rng.chisquare(5, (CHAINS, DRAWS, len(names)))
    groups = {
        "/posterior": draws_of("posterior", columns, test=names),
        "/sample_stats": draws_of("sample_stats", {"lp": list(np.moveaxis(lp, -1, 0))}, test=names),
        "/rig_posterior": draws_of(
            "rig_posterior", {"damping_ratio": damping}, rig=[rig.name for rig in campaign.rigs]
        ),
    }
    if observed:
        origin, end = zip(*ends, strict=True)
        groups["/trial_function"] = dataset(
            "trial_function",
            {key: np.stack(value, axis=-1) for key, value in trial.items()}
            | {"origin": list(origin), "end": list(end), "record_test": trial_tests},
            record=record_names,
            ensemble=ensemble,
        )
        runs = {"amplitude": predictive, "mean_amplitude": means}
        groups["/posterior_predictive"] = dataset(
            "posterior_predictive", {key: np.concatenate(value, axis=-1)[None] for key, value in runs.items()}
        )
        groups["/observed_data"] = dataset("observed_data", {"amplitude": np.concatenate(observed)})
        constants |= {
            "time": np.concatenate(at),
            "standard_error": np.concatenate(errors),
            "record": of_record,
            "record_test": of_test,
        }
    groups["/constant_data"] = dataset("constant_data", constants, test=names)
    tree = xr.DataTree.from_dict(groups)
    tree.attrs["provenance"] = json.dumps(_provenance(campaign), sort_keys=True)
    return tree


# What the records are made to say of the card's laws: log evidence, its error (NaN: by Laplace's approximation).
EVIDENCE = {-1.0: (812.4, 0.04), 0.0: (810.9, 0.05), 1.0: (795.1, np.nan), 2.0: (741.0, np.nan)}


def _with_campaign(tree: xr.DataTree, card: ModelCard, rng: np.random.Generator) -> xr.DataTree:
    """Add the campaign model: each draw of the peak tests has a curve that passes between them."""
    posterior = tree["posterior"].to_dataset()
    posterior = posterior.isel(test=np.flatnonzero(tree["constant_data"]["peak"].to_numpy()))
    labels = [f"n={n:g}" for n in card.laws]
    evidence, error = np.array([EVIDENCE[n] for n in card.laws]).T
    sampled = np.isfinite(error)
    if len(card.laws) == 1:
        evidence, error, sampled = np.full(1, np.nan), np.full(1, np.nan), np.ones(1, dtype=bool)
    prior = np.array(card.law_weights)
    weight = np.where(sampled, prior * np.exp(evidence - evidence[0]), 0.0) if len(card.laws) > 1 else prior
    reference = float(np.exp(np.log(posterior["scruton_number"].median(("chain", "draw"))).mean()))
    fitted = [_shared_curve(posterior, n, reference, rng) for n, kept in zip(card.laws, sampled, strict=True) if kept]
    group = xr.concat(fitted, dim="law", coords="minimal", compat="override")
    group = group.assign_coords(law=[one for one, kept in zip(labels, sampled, strict=True) if kept])
    group.attrs["reference_scruton_number"] = reference
    group.attrs["reference_mass_damping_factor"] = float(np.exp(np.log(posterior["mass_damping_factor"]).mean()))
    rows = {
        "prior_weight": prior,
        "weight": weight / weight.sum(),
        "stacking_weight": np.where(sampled, 1.0 / sampled.sum(), 0.0),
        "log_evidence": evidence,
        "log_evidence_error": error,
        "sampled": sampled,
    }
    groups = {f"/{name}": node.to_dataset() for name, node in tree.children.items()}
    groups["/campaign_posterior"] = group.transpose("law", "chain", "draw", "peak_test")
    groups["/laws"] = dataset("laws", {key: np.asarray(one, dtype=float) for key, one in rows.items()}, law=labels)
    found = xr.DataTree.from_dict(groups)
    found.attrs.update(tree.attrs)
    return found


def _shared_curve(tests: xr.Dataset, n: float, reference: float, rng: np.random.Generator) -> xr.Dataset:
    """The campaign's variables under one law: geometric means over the tests of what each says of the curve."""
    sc = tests["scruton_number"]
    # The tests' own strengths of the wind, but enough of it for a vibration at every one.
    strength = np.exp(np.log(np.maximum(tests["relaxation_scruton_number"] + n * sc, 1.0)).mean("test"))
    relaxation = np.maximum(strength - n * reference, 1.05 * n * (sc.max("test") - reference))
    ratio = xr.apply_ufunc(amplitude_ratio, (sc - reference) / relaxation, n)
    amplitude = np.exp(np.log(tests["a_star"] / ratio).mean("test"))

    def scale(median: float) -> xr.DataArray:
        return amplitude.copy(data=median * np.exp(0.3 * rng.standard_normal(amplitude.shape)))

    own = [one.name for one in SCHEMA["campaign_posterior"] if one.dims[-1] == "peak_test"]
    unknown = xr.full_like(tests["a_star"], np.nan)
    forces = () if n == -1.0 else ("Y1", "epsilon")
    found = xr.Dataset({key: unknown if key in forces else tests[key] for key in own})
    return found.rename(test="peak_test").assign(
        n=xr.full_like(amplitude, n),
        reference_amplitude=amplitude,
        reference_relaxation=relaxation,
        discrepancy_amplitude=scale(0.09),
        discrepancy_relaxation=scale(0.2),
    )


def _force_parameters(
    section: Section, row: Case, a_star: FloatArray, rate: FloatArray, xi: FloatArray
) -> dict[str, FloatArray]:
    """Y1 and epsilon of Eq. (9), or of Eq. (12), from (a*, lambda)."""
    k = 2 * np.pi * row.frequency * section.depth / row.wind_speed
    rate_s = rate * section.depth / row.wind_speed
    if section.motion is Motion.HEAVING:
        ratio, beta = row.air_density * section.depth**2 / row.mass, 1.0
    else:
        ratio, beta = row.air_density * (section.width * section.depth) ** 2 / row.mass, section.width / section.depth
    y1 = 2 / (ratio * beta) * (k * xi - rate_s)
    return {"Y1": y1, "epsilon": -np.pi * k * rate_s * a_star / (2 * ratio) / y1}


def _provenance(campaign: Campaign) -> dict[str, Any]:
    return {
        "command": "fit --seed 1 --model default",
        "seed": 1,
        "tests": [],
        "versions": {"python": "3.13.0", "scruton": "0.1.0", "numpy": "2.5.0"},
        "sha256": dict(campaign.sha256 or {}),
        "card": {"name": "default", "sha256": "0" * 64, "text": "format = 1\n"},
        "campaign": {
            "title": campaign.title,
            "source": campaign.source,
            "motion": campaign.section.motion.value,
            "width": campaign.section.width,
            "depth": campaign.section.depth,
        },
    }


def _laws(tree: xr.DataTree) -> dict[str, Any]:
    """Weights of the laws as fit.json has them."""
    keys = ("prior_weight", "weight", "stacking_weight", "log_evidence", "log_evidence_error")
    names = ("prior", "weight", "stacking", "log_evidence", "log_evidence_error")
    weights = {}
    for label in tree["laws"]["law"].to_numpy():
        row = tree["laws"].to_dataset().sel(law=label)
        values = [float(row[key]) for key in keys]
        weights[str(label)] = {k: v if np.isfinite(v) else None for k, v in zip(names, values, strict=True)}
        weights[str(label)]["sampled"] = bool(row["sampled"])
    return {"flag": False, "weights": weights}


def entries(group: xr.Dataset) -> dict[str, Any]:
    """Every parameter of a group as fit.json has it."""
    return parameters({str(k): one.to_numpy() for k, one in group.data_vars.items() if "draw" in one.dims})


def _summary(campaign: Campaign, tree: xr.DataTree, law_n: float) -> tuple[dict[str, Any], xr.Dataset]:
    rows: list[dict[str, Any]] = []
    quality = {"rhat_nested": 1.001, "ess_bulk": 1500.0, "ess_tail": 1300.0}

    def sampled(group: xr.Dataset, posterior: str) -> dict[str, Any]:
        found = {name: one | quality for name, one in entries(group).items()}
        rest = {"tau": 12.0, "steps": 500, "acceptance": 0.6, "stuck": 0, "converged": True}
        rows.extend({"posterior": posterior, "parameter": name} | quality | rest for name in found)
        return found

    posterior, rig = (tree[key].to_dataset() for key in ("posterior", "rig_posterior"))
    joint = tree["campaign_posterior"].to_dataset()
    under = joint.isel(law=0)[[name for name in joint.data_vars if np.isfinite(joint[name].isel(law=0)).all()]]
    shared = under[[name for name in under.data_vars if "peak_test" not in under[name].dims]]
    own = under[[name for name in under.data_vars if "peak_test" in under[name].dims]]
    trial = tree["trial_function"].to_dataset() if "trial_function" in tree else None
    summary = {
        "format": 1,
        "title": campaign.title,
        "converged": True,
        "flags": [],
        "law_n": law_n,
        "laws": _laws(tree),
        "campaign": {
            "reference_scruton_number": joint.attrs["reference_scruton_number"],
            "parameters": entries(shared),
            "tests": [
                {"name": str(name), "parameters": entries(own.sel(peak_test=name))}
                for name in joint["peak_test"].to_numpy()
            ],
        },
        "amplitude_unit": campaign.section.amplitude_unit,
        "tests": [
            {
                "name": test.name,
                "rig": test.rig,
                "peak": bool(test.peak),
                "wind_frequency": campaign.rig(test.rig).frequency.mean,
                "lock_in": [],
                "parameters": sampled(posterior.sel(test=test.name), f"test {test.name}"),
            }
            for test in campaign.tests
        ],
        "rigs": [
            {"name": one.name, "parameters": sampled(rig.sel(rig=one.name), f"rig {one.name}"), "bands": []}
            for one in campaign.rigs
        ],
        "records": [
            {
                "name": record.name,
                "test": test.name,
                "parameters": sampled(trial.sel(record=record.name), f"trial function of {record.name}"),
            }
            for test in campaign.tests
            for record in test.records
            if trial is not None
        ],
        "provenance": json.loads(tree.attrs["provenance"]),
    }
    columns = {one.name: [row[one.name] for row in rows] for one in SCHEMA["convergence"]}
    return summary, dataset("convergence", columns)
