"""Tables of a report as pandas frames: the campaign, the posteriors, convergence, predictions."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.campaign.schema import Motion, Quantity
from scruton.cells import safe_frame
from scruton.documents import write_text
from scruton.infer.result_schema import SCHEMA

if TYPE_CHECKING:
    import pandas as pd

    from scruton.griffin import Prediction
    from scruton.infer.results import Fit

_GROUPS = ("campaign_posterior", "posterior", "trial_function")
_UNITS = {parameter.name: parameter.unit for group in _GROUPS for parameter in SCHEMA[group]}
_UNKNOWN: Mapping[str, Any] = {"median": np.nan, "interval": {"0.90": (np.nan, np.nan)}}
Row = dict[str, Any]


def unit_of(parameter: str, amplitude_unit: str) -> str:
    """Unit of a parameter of any posterior; "-" where it has none."""
    unit = _UNITS.get(parameter, "-")
    return amplitude_unit if unit == _UNITS["a_star"] else unit


def tables(fit: "Fit", predictions: Sequence["Prediction"] = ()) -> dict[str, "pd.DataFrame"]:
    """Every table that has a row, by name: rigs, tests, records, posterior, laws, convergence, predictions, ring_downs.

    Units stand in the names of the columns, or in a column of their own where rows differ.
    """
    import pandas as pd

    unit = fit.campaign.section.amplitude_unit
    rows: dict[str, Any] = {
        "rigs": _rigs(fit),
        "tests": _tests(fit, unit),
        "records": _records(fit, unit),
        "posterior": _posterior(fit, unit),
        "laws": _laws(fit),
        "convergence": fit.convergence.reset_index(),
        "predictions": map(_prediction, predictions),
        "ring_downs": _ring_downs(fit, unit),
    }
    frames = {name: pd.DataFrame(table) for name, table in rows.items()}
    return {name: frame for name, frame in frames.items() if len(frame)}


def _rigs(fit: "Fit") -> Iterator[Row]:
    """One row a rig: what the laboratory states, and the structural damping found."""
    mass_unit = "kg/m" if fit.campaign.section.motion is Motion.HEAVING else "kg m^2/m"
    damping = {summary["name"]: summary["parameters"]["damping_ratio"] for summary in fit.summary["rigs"]}
    for rig in fit.campaign.rigs:
        ring = fit.ringdowns.get(rig.name)
        yield {
            "rig": rig.name,
            f"mass [{mass_unit}]": _mean(rig.mass),
            f"mass sd [{mass_unit}]": np.nan if rig.mass is None or rig.mass.sd is None else rig.mass.sd,
            "f0 stated [Hz]": rig.frequency.mean,
            "f0 from ring-downs [Hz]": ring.frequency if ring else np.nan,
            "damping ratio stated [-]": _mean(rig.damping_ratio),
            "ring-downs": len(rig.records),
            **_spread(damping.get(rig.name), "damping ratio", "-"),
        }


def _tests(fit: "Fit", unit: str) -> Iterator[Row]:
    """One row a test in wind, with the stable amplitude measured and the one found."""
    summaries = {summary["name"]: summary for summary in fit.summary["tests"]}
    for test in fit.campaign.tests:
        entry = summaries.get(test.name, {})
        parameters = entry.get("parameters", {})
        yield {
            "test": test.name,
            "rig": test.rig,
            "air density [kg/m^3]": test.air_density.mean,
            "wind speed [m/s]": test.wind_speed.mean,
            "U/(f0 D) [-]": fit.campaign.reduced_velocity(test),
            "frequency in wind [Hz]": entry.get("wind_frequency", np.nan),
            "peak": bool(entry.get("peak", False)),
            "Sc [-]": parameters.get("scruton_number", _UNKNOWN)["median"],
            f"stable amplitude measured [{unit}]": _mean(test.stable_amplitude),
            **_spread(parameters.get("a_star"), "stable amplitude", unit),
        }


def _records(fit: "Fit", unit: str) -> Iterator[Row]:
    """One row a record: its size, amplitude and frequency, and how far the trial function of Eq. (4) is off."""
    for record, rig, test in fit.campaign.records():
        cycles, front = fit.cycles.get(record.name), fit.front_ends.get(record.name)
        amplitude = cycles.amplitude if cycles is not None else np.array([np.nan])
        smallest, largest = cycles.amplitude_range if cycles is not None else (np.nan, np.nan)
        yield {
            "record": record.name,
            "of": f"test {test.name}" if test else f"rig {rig.name}",
            "kind": record.kind.value,
            "length [s]": float(record.time[-1] - record.time[0]),
            "samples": len(record.time),
            "cycles": len(amplitude) if cycles is not None else 0,
            "frequency [Hz]": cycles.reference_frequency if cycles is not None else np.nan,
            f"first amplitude [{unit}]": float(amplitude[0]),
            f"last amplitude [{unit}]": float(amplitude[-1]),
            f"smallest amplitude [{unit}]": smallest,
            f"largest amplitude [{unit}]": largest,
            f"trial function residual sd [{unit}]": front.residual_sd if front is not None else np.nan,
        }


def _posterior(fit: "Fit", unit: str) -> Iterator[Row]:
    """One row a parameter of every rig, test and trial function: median, mean, sd and intervals, with its unit.

    A peak test has two sets: that of the model that predicts, and what it says alone under the reference law.
    """
    parts = [("rig", "rigs", "parameters"), ("test", "tests", "parameters"), ("test alone", "tests", "alone")]
    for name, entry in fit.summary["campaign"].get("parameters", {}).items():
        whose = {"posterior": "campaign", "of": "shared curve", "parameter": name}
        yield whose | {"unit": unit_of(name, unit)} | _summarised(entry)
    for kind, heading, key in (*parts, ("trial function", "records", "parameters")):
        for summary in fit.summary[heading]:
            for name, entry in summary.get(key, {}).items():
                whose = {"posterior": kind, "of": summary["name"], "parameter": name}
                yield whose | {"unit": unit_of(name, unit)} | _summarised(entry)


def _laws(fit: "Fit") -> Iterator[Row]:
    """One row a law of the model card: its prior and posterior probability, evidence and stacking weight."""
    for label, entry in fit.summary["laws"].get("weights", {}).items():
        yield {
            "law": label,
            "prior probability": entry["prior"],
            "posterior probability": entry["weight"],
            "stacking weight": _finite(entry["stacking"]),
            "log evidence": _finite(entry["log_evidence"]),
            "log evidence error": _finite(entry["log_evidence_error"]),
            "sampled": entry["sampled"],
        }


def _prediction(prediction: "Prediction") -> Row:
    entry = prediction.to_json()
    return {
        "Sc [-]": entry["sc"],
        "damping ratio [-]": entry["damping_ratio"],
        "rig": prediction.rig,
        "laws": ", ".join(f"{law} {weight:.3g}" for law, weight in prediction.laws.items() if weight > 5e-4),
        "unit": prediction.unit,
        **_summarised(entry["amplitude"]),
        "median MC error": _finite(entry["amplitude"]["mcse"]["median"]),
        **{
            f"{end} MC error": _finite(error)
            for end, error in zip(("q05", "q95"), entry["amplitude"]["mcse"]["interval"]["0.90"], strict=True)
        },
        "extrapolation index x": prediction.extrapolation_index,
        "peak tests that cover the amplitude": prediction.covered_by,
        "probability of no vibration": prediction.dies,
        "probability of no vibration MC error": _finite(prediction.dies_error),
        "fraction without stable amplitude": prediction.unbounded,
    }


def _ring_downs(fit: "Fit", unit: str) -> Iterator[Row]:
    """One row a band of amplitude of every rig: structural damping against amplitude."""
    for name, ring in fit.ringdowns.items():
        for band in ring.bands:
            yield {
                "rig": name,
                f"from amplitude [{unit}]": band.lower,
                f"to amplitude [{unit}]": band.upper,
                "damping ratio [-]": band.damping_ratio,
                "damping ratio sd [-]": band.sd,
                "plucks": band.plucks,
            }


def write_csv(frames: Mapping[str, "pd.DataFrame"], folder: Path) -> list[Path]:
    """Write each frame as NAME.csv (UTF-8), each in one atomic step; no cell is a formula to a spreadsheet."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{name}.csv" for name in frames]
    for path, frame in zip(paths, frames.values(), strict=True):
        write_text(path, safe_frame(frame).to_csv(index=False))
    return paths


def _mean(quantity: Quantity | None) -> float:
    return np.nan if quantity is None else quantity.mean


def _finite(value: float | None) -> float:
    return np.nan if value is None else value


def _summarised(entry: Mapping[str, Any]) -> Row:
    """Columns of a summary entry: median, mean, sd, and by quantile ("q05" the lower bound of 90 %) its intervals."""
    columns = {key: _finite(entry[key]) for key in ("median", "mean", "sd")}
    for side, order in ((0, -1), (1, 1)):
        for p in sorted(entry["interval"])[::order]:
            q = f"q{100 * (0.5 + (side - 0.5) * float(p)):04.1f}".removesuffix(".0")
            columns[q] = _finite(entry["interval"][p][side])
    return columns


def _spread(entry: Mapping[str, Any] | None, name: str, unit: str) -> dict[str, float]:
    """Median and 90 % interval of one parameter as three columns."""
    entry = entry or _UNKNOWN
    low, high = entry["interval"]["0.90"]
    return {
        f"{name} median [{unit}]": entry["median"],
        f"{name} q05 [{unit}]": low,
        f"{name} q95 [{unit}]": high,
    }
