"""What a calibration writes: CSV tables, a text, one JSON with everything, and pictures; the same bytes each time."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from scruton.calibrate.coverage import EVERYTHING, CalibrationResult, LawCheck
from scruton.calibrate.identifiability import Identifiability
from scruton.calibrate.pictures import draw
from scruton.calibrate.quantities import INTERVALS, kind_of
from scruton.calibrate.thresholds import LIMIT
from scruton.cells import aligned, csv_text, wrapped
from scruton.documents import as_json, write_text
from scruton.provenance import provenance

Headed = tuple[str, list[list[str]]]  # a line, and the rows of a table below it

_PLAIN = ("ring_downs", "turbulence", "gust_scatter", "set_point_scatter", "sensor_noise", "damping_sd", "mass_sd",
          "density_sd")  # fmt: skip


def write_tables(result: CalibrationResult, folder: Path) -> None:
    """Write every table and picture of a calibration into a folder."""

    def measured(row: Identifiability) -> float:
        """Median posterior sd over the campaigns, beside what was expected."""
        scores = result.scores.get(row.regime, {}).get(row.quantity)
        return float("nan") if scores is None else float(np.median(scores["posterior_sd"]))

    tables: dict[str, list[dict[str, Any]]] = {
        # The truths of scatter, gusts and noise factor are a regime's own, not the prior's.
        "regimes": [
            {
                "regime": regime.name,
                "title": regime.title,
                "motion": regime.motion.value,
                "scruton_numbers": list(regime.scruton_numbers),
                "records": [kind.value for kind in regime.kinds],
                **{name: getattr(regime, name) for name in _PLAIN},
                "gust_time": list(regime.gust_time),
                "true_law": regime.n,
                "wake": regime.wake,
                "disturbances": {name: list(span) for name, span in regime.disturbances.items()},
                "miss": regime.miss,
                "fitted_laws": list(regime.laws),
                "card_overrides": {name: list(value) for name, value in regime.overrides.items()},
                "outside": regime.outside,
            }
            for regime in result.regimes
        ],
        "coverage": [asdict(cell) | {"z": cell.z, "beyond": cell.beyond} for cell in result.cells],
        "pooled": [asdict(row) | {"points": row.points} for row in result.pooled],
        "ranks": [asdict(row) | {"beyond": row.beyond} for row in result.uniformity],
        "identifiability": [
            asdict(row) | {"ratio": row.ratio, "measured_sd": measured(row), "left_out": row.left_out}
            for row in result.identifiability
        ],
        "laws": [
            {
                "regime": check.regime,
                "campaigns": check.campaigns,
                "flagged": check.flagged,
                "weights": check.weights,
                "quantity": name,
                **asdict(one),
            }
            for check in result.laws
            for name, one in check.quantities.items()
        ],
    }
    more = {name: getattr(result, name) for name in ("settings", "calibrated", "failed", "unconverged", "scores")}
    settings = result.settings
    made_from = provenance(
        "calibrate", seed=settings["seed"], sha256={}, settings={"regimes": [regime.name for regime in result.regimes]},
        card={"name": settings["model"], "sha256": settings["model_sha256"]},
    )  # fmt: skip
    everything = as_json({**tables, **more, "provenance": made_from})
    write_text(folder / "calibration.json", json.dumps(everything, indent=1, sort_keys=True, allow_nan=False) + "\n")
    write_text(folder / "calibration.txt", calibration_text(result) + "\n")
    for name, rows in tables.items():
        write_text(folder / f"{name}.csv", csv_text(rows))
    draw(result, folder / "figures")


def calibration_text(result: CalibrationResult, width: int | None = None) -> str:
    """Say what a calibration shows, in lines of `width` letters: coverage by regime and pooled, ranks, laws, faults."""
    parts = [_coverage_text, _pooled_text, _left_out_text] if result.cells else []
    tables = [*(part(result) for part in parts), *map(_law_text, result.laws), (_verdict(result), [])]
    return "\n\n".join(
        "\n".join(filter(None, [wrapped(head, width), aligned(rows, width) if rows else ""])) for head, rows in tables
    )


def _coverage_text(result: CalibrationResult) -> Headed:
    """One row a regime, cell column a kind of quantity: coverage of the three intervals in percent."""
    kinds = list(dict.fromkeys(kind_of(cell.quantity) for cell in result.cells))
    nominal = "/".join(f"{100 * p:.0f}" for p in INTERVALS)
    rows = [["regime", "campaigns", *kinds]]
    for regime in dict.fromkeys(cell.regime for cell in result.cells):
        in_regime = [cell for cell in result.cells if cell.regime == regime]
        row = [regime, str(in_regime[0].campaigns)]
        for kind in kinds:
            alike = [cell for cell in in_regime if kind_of(cell.quantity) == kind]
            means = [np.mean([cell.coverage for cell in alike if cell.interval == p]) for p in INTERVALS]
            mark = "*" if any(cell.beyond for cell in alike) else "o" if any(cell.left_out for cell in alike) else ""
            row.append("/".join(f"{100 * mean:.0f}" for mean in means) + mark)
        rows.append(row)
    note = f"{nominal} % intervals; mean over tests; * beyond {LIMIT:g} standard errors; o left out by design"
    return f"Coverage in percent ({note})", rows


def _pooled_text(result: CalibrationResult) -> Headed:
    rows = [["pooled over regimes", *(f"{100 * p:.0f} %" for p in INTERVALS), "points off nominal"]]
    for name in dict.fromkeys(row.quantity for row in result.pooled):
        pooled = [row for row in result.pooled if row.quantity == name]
        label = "all quantities" if name == EVERYTHING else name
        cells = [f"{100 * row.coverage:.1f} +/- {100 * row.standard_error:.1f}" for row in pooled]
        rows.append([label, *cells, " ".join(f"{row.points:+.1f}" for row in pooled)])
    return "", rows


def _left_out_text(result: CalibrationResult) -> Headed:
    left_out = [row for row in result.identifiability if row.left_out]
    if not left_out:
        return "No quantity is left out: the expected information halves every prior sd in every regime.", []
    rows = [["left out", "quantity", "prior sd", "expected sd"]]
    rows += [[row.regime, row.quantity, f"{row.prior_sd:.3f}", f"{row.expected_sd:.3f}"] for row in left_out]
    return "The expected information cannot halve these prior sds (of logarithms):", rows


def _law_text(check: LawCheck) -> Headed:
    flagged = "never says" if np.isnan(check.flagged) else f"{100 * check.flagged:.1f} %"
    weights = ", ".join(f"{weight:.2f}" for weight in check.weights)
    rows = [["90 % interval of", "intervals", "hold the truth in", "factor", "interval score", "reach zero in"]]
    rows += [
        [name, str(one.intervals), f"{100 * one.coverage:.1f} %", f"{one.factor:.3g}", f"{one.interval_score:.3g}",
         f"{100 * one.reaches_zero:.1f} %"]
        for name, one in check.quantities.items()
    ]  # fmt: skip
    head = f"{check.regime}: {check.campaigns} campaigns; law flag raised in {flagged}; mean weights {weights}"
    return head, rows


def _verdict(result: CalibrationResult) -> str:
    calibrated = f"No cell and no ranks beyond {LIMIT:g} standard errors."
    lines = [calibrated if result.calibrated else "NOT CALIBRATED:"]
    lines += [
        f"{cell.regime}: {100 * cell.interval:.0f} % interval of {cell.quantity} covers {100 * cell.coverage:.1f} % "
        f"(z = {cell.z:+.1f})"
        for cell in result.cells
        if cell.beyond
    ]
    lines += [
        f"{row.regime}: ranks of {row.quantity} are not uniform (p = {row.p_value:.1e})"
        for row in result.uniformity
        if row.beyond
    ]
    lines += [
        f"{name}: {len(reasons)} campaigns could not be fitted; the first: {reasons[0]}"
        for name, reasons in result.failed.items()
        if reasons
    ]
    lines += [
        f"{name}: {count} campaigns did not converge; they are counted"
        for name, count in result.unconverged.items()
        if count
    ]
    return "\n".join(lines)
