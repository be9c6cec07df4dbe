"""What a calibration writes: CSV tables, a text, one JSON with everything, and pictures; the same bytes each time."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.calibrate import store
from scruton.calibrate.coverage import EVERYTHING, LIMIT
from scruton.calibrate.identifiability import Identifiability
from scruton.calibrate.plain import aligned, csv_text, plain
from scruton.calibrate.quantities import INTERVALS, kind_of
from scruton.calibrate.regimes import Regime
from scruton.documents import write_text
from scruton.provenance import provenance

if TYPE_CHECKING:
    from scruton.calibrate.run import CalibrationResult


def write_tables(result: "CalibrationResult", folder: Path) -> None:
    """Write every table and picture of a calibration into a folder."""
    from scruton.calibrate.pictures import draw

    tables: dict[str, list[dict[str, Any]]] = {
        "regimes": [_regime(one) for one in result.regimes],
        "coverage": [asdict(one) | {"z": one.z, "beyond": one.beyond} for one in result.cells],
        "pooled": [asdict(one) | {"points": one.points} for one in result.pooled],
        "ranks": [asdict(one) | {"beyond": one.beyond} for one in result.uniformity],
        "identifiability": [
            asdict(one) | {"ratio": one.ratio, "measured_sd": _measured(result, one), "left_out": one.left_out}
            for one in result.identifiability
        ],
        "laws": [asdict(one) for one in result.laws],
    }
    everything: dict[str, Any] = dict(tables) | {
        "settings": result.settings,
        "provenance": provenance(
            "calibrate",
            seed=result.settings["seed"],
            sha256={},
            settings={"regimes": [one.name for one in result.regimes]},
            card={"name": result.settings["model"], "sha256": result.settings["model_sha256"]},
        ),
        "calibrated": result.calibrated,
        "failed": result.failed,
        "unconverged": result.unconverged,
        "scores": {
            regime: {name: {key: one.tolist() for key, one in fields.items()} for name, fields in table.items()}
            for regime, table in result.scores.items()
        },
    }
    text = json.dumps(plain(everything), indent=1, sort_keys=True, allow_nan=False)
    write_text(folder / "calibration.json", text + "\n")
    write_text(folder / "calibration.txt", calibration_text(result) + "\n")
    for name, rows in tables.items():
        write_text(folder / f"{name}.csv", csv_text(rows))
    draw(result, folder / store.FIGURES)


def calibration_text(result: "CalibrationResult") -> str:
    """Say what a calibration shows: coverage by regime, pooled coverage, ranks, laws, and what fails."""
    parts = []
    if result.cells:
        parts += [_coverage_text(result), _pooled_text(result), _left_out_text(result)]
    if result.laws:
        parts.append(_laws_text(result))
    parts.append(_verdict(result))
    return "\n\n".join(parts)


def _coverage_text(result: "CalibrationResult") -> str:
    """One row a regime, one column a kind of quantity: coverage of the three intervals in percent."""
    kinds = list(dict.fromkeys(kind_of(one.quantity) for one in result.cells))
    nominal = "/".join(f"{100 * p:.0f}" for p in INTERVALS)
    rows = [["regime", "campaigns", *kinds]]
    for regime in dict.fromkeys(one.regime for one in result.cells):
        mine = [one for one in result.cells if one.regime == regime]
        row = [regime, str(mine[0].campaigns)]
        for kind in kinds:
            here = [one for one in mine if kind_of(one.quantity) == kind]
            means = [np.mean([one.coverage for one in here if one.interval == p]) for p in INTERVALS]
            mark = "*" if any(one.beyond for one in here) else "o" if any(one.left_out for one in here) else ""
            row.append("/".join(f"{100 * one:.0f}" for one in means) + mark)
        rows.append(row)
    note = f"{nominal} % intervals; mean over tests; * beyond {LIMIT:g} standard errors; o left out by design"
    return f"Coverage in percent ({note})\n{aligned(rows)}"


def _pooled_text(result: "CalibrationResult") -> str:
    rows = [["pooled over regimes", *(f"{100 * p:.0f} %" for p in INTERVALS), "points off nominal"]]
    for name in dict.fromkeys(one.quantity for one in result.pooled):
        mine = [one for one in result.pooled if one.quantity == name]
        label = "all quantities" if name == EVERYTHING else name
        cells = [f"{100 * one.coverage:.1f} +/- {100 * one.standard_error:.1f}" for one in mine]
        rows.append([label, *cells, " ".join(f"{one.points:+.1f}" for one in mine)])
    return aligned(rows)


def _left_out_text(result: "CalibrationResult") -> str:
    left_out = [one for one in result.identifiability if one.left_out]
    if not left_out:
        return "No quantity is left out: the expected information halves every prior sd in every regime."
    rows = [["left out", "quantity", "prior sd", "expected sd"]]
    rows += [[one.regime, one.quantity, f"{one.prior_sd:.3f}", f"{one.expected_sd:.3f}"] for one in left_out]
    return "The expected information cannot halve these prior sds (of logarithms):\n" + aligned(rows)


def _laws_text(result: "CalibrationResult") -> str:
    parts = []
    for one in result.laws:
        flagged = "never says" if np.isnan(one.flagged) else f"{100 * one.flagged:.1f} %"
        weights = ", ".join(f"{weight:.2f}" for weight in one.weights)
        rows = [["90 % interval of", "holds the truth in"]]
        rows += [[name, f"{100 * value:.1f} %"] for name, value in one.coverage.items()]
        parts.append(
            f"{one.regime}: {one.campaigns} campaigns; law flag raised in {flagged}; mean weights {weights}\n"
            + aligned(rows)
        )
    return "\n\n".join(parts)


def _verdict(result: "CalibrationResult") -> str:
    lines = [
        f"{one.regime}: {100 * one.interval:.0f} % interval of {one.quantity} covers {100 * one.coverage:.1f} % "
        f"(z = {one.z:+.1f})"
        for one in result.cells
        if one.beyond
    ]
    lines += [
        f"{one.regime}: ranks of {one.quantity} are not uniform (p = {one.p_value:.1e})"
        for one in result.uniformity
        if one.beyond
    ]
    for name, reasons in result.failed.items():
        if reasons:
            lines.append(f"{name}: {len(reasons)} campaigns could not be fitted; the first: {reasons[0]}")
    lines += [
        f"{name}: {count} campaigns did not converge; they are counted"
        for name, count in result.unconverged.items()
        if count
    ]
    head = f"No cell and no ranks beyond {LIMIT:g} standard errors." if result.calibrated else "NOT CALIBRATED:"
    return "\n".join([head, *lines])


def _measured(result: "CalibrationResult", row: Identifiability) -> float:
    """Median posterior sd over the campaigns, beside what was expected."""
    fields = result.scores.get(row.regime, {}).get(row.quantity)
    return float("nan") if fields is None else float(np.median(fields["posterior_sd"]))


def _regime(one: Regime) -> dict[str, Any]:
    """What a regime is, for the tables; the truths of scatter and noise factor are its own, not the prior's."""
    return {
        "regime": one.name,
        "title": one.title,
        "motion": one.motion.value,
        "scruton_numbers": list(one.scruton_numbers),
        "records": [kind.value for kind in one.kinds],
        "ring_downs": one.ring_downs,
        "turbulence": one.turbulence,
        "sensor_noise": one.sensor_noise,
        "damping_sd": one.damping_sd,
        "mass_sd": one.mass_sd,
        "density_sd": one.density_sd,
        "true_law": one.n,
        "fitted_laws": list(one.laws),
        "card_overrides": {name: list(value) for name, value in one.overrides.items()},
    }
