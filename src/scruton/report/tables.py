"""Tables of a report as pandas frames: the campaign, the posteriors, convergence, predictions."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.campaign.schema import Motion, Quantity, Record
from scruton.cells import safe_frame
from scruton.documents import write_text

if TYPE_CHECKING:
    import pandas as pd

    from scruton.griffin import Prediction
    from scruton.infer.results import Fit

INTERVALS = ("0.50", "0.90", "0.95")

_RATIO = "-"
_UNITS = {
    "relaxation_rate": "1/s",
    "residual_rate": "1/s",
    "b": "1/s",
    "d": "1/s",
}
_AMPLITUDES = ("a_star", "a", "c", "residual_sd")


def unit_of(parameter: str, amplitude_unit: str) -> str:
    """Unit of a parameter of any posterior; "-" where it has none."""
    return amplitude_unit if parameter in _AMPLITUDES else _UNITS.get(parameter, _RATIO)


def tables(fit: "Fit", predictions: Sequence["Prediction"] = ()) -> dict[str, "pd.DataFrame"]:
    """Build every table that has a row.

    Parameters
    ----------
    fit : Fit
    predictions : sequence of Prediction

    Returns
    -------
    dict of str to DataFrame
        By name: rigs, tests, records, posterior, laws, convergence, predictions, ring_downs. Units stand in the
        names of the columns, or in a column of their own where rows differ.
    """
    frames = {
        "rigs": rigs(fit),
        "tests": wind_tests(fit),
        "records": records(fit),
        "posterior": posterior(fit),
        "laws": laws(fit),
        "convergence": convergence(fit),
        "predictions": prediction_table(predictions),
        "ring_downs": ring_downs(fit),
    }
    return {name: frame for name, frame in frames.items() if len(frame)}


def rigs(fit: "Fit") -> "pd.DataFrame":
    """One row a rig: what the laboratory states, and the structural damping found."""
    mass_unit = "kg/m" if fit.campaign.section.motion is Motion.HEAVING else "kg m^2/m"
    found = {one["name"]: one["parameters"]["damping_ratio"] for one in fit.summary["rigs"]}
    rows = []
    for rig in fit.campaign.rigs:
        ring = fit.ringdowns.get(rig.name)
        rows.append(
            {
                "rig": rig.name,
                f"mass [{mass_unit}]": _mean(rig.mass),
                f"mass sd [{mass_unit}]": _sd(rig.mass),
                "f0 stated [Hz]": rig.frequency.mean,
                "f0 from ring-downs [Hz]": ring.frequency if ring else np.nan,
                "damping ratio stated [-]": _mean(rig.damping_ratio),
                "ring-downs": len(rig.records),
                **_spread(found.get(rig.name), "damping ratio", "-"),
            }
        )
    return _frame(rows)


def wind_tests(fit: "Fit") -> "pd.DataFrame":
    """One row a test in wind, with the stable amplitude measured and the one found."""
    section = fit.campaign.section
    unit = section.amplitude_unit
    found = {one["name"]: one for one in fit.summary["tests"]}
    rows = []
    for test in fit.campaign.tests:
        rig, entry = fit.campaign.rig(test.rig), found.get(test.name, {})
        parameters = entry.get("parameters", {})
        rows.append(
            {
                "test": test.name,
                "rig": test.rig,
                "air density [kg/m^3]": test.air_density.mean,
                "wind speed [m/s]": test.wind_speed.mean,
                "U/(f0 D) [-]": test.wind_speed.mean / (rig.frequency.mean * section.depth),
                "frequency in wind [Hz]": entry.get("wind_frequency", np.nan),
                "peak": bool(entry.get("peak", False)),
                "Sc [-]": parameters.get("scruton_number", {}).get("median", np.nan),
                f"stable amplitude measured [{unit}]": _mean(test.stable_amplitude),
                **_spread(parameters.get("a_star"), "stable amplitude", unit),
            }
        )
    return _frame(rows)


def records(fit: "Fit") -> "pd.DataFrame":
    """One row a record: its size, amplitude and frequency, and how far the trial function of Eq. (4) is off."""
    unit = fit.campaign.section.amplitude_unit
    owners = [("rig", rig.name, one) for rig in fit.campaign.rigs for one in rig.records]
    owners += [("test", test.name, one) for test in fit.campaign.tests for one in test.records]
    return _frame([_record(fit, kind, owner, one, unit) for kind, owner, one in owners])


def _record(fit: "Fit", owner_kind: str, owner: str, record: Record, unit: str) -> dict[str, Any]:
    cycles, front = fit.cycles.get(record.name), fit.front_ends.get(record.name)
    amplitude = cycles.amplitude if cycles is not None else np.array([np.nan])
    return {
        "record": record.name,
        "of": f"{owner_kind} {owner}",
        "kind": record.kind.value,
        "length [s]": float(record.time[-1] - record.time[0]),
        "samples": len(record.time),
        "cycles": len(amplitude) if cycles is not None else 0,
        "frequency [Hz]": cycles.reference_frequency if cycles is not None else np.nan,
        f"first amplitude [{unit}]": float(amplitude[0]),
        f"last amplitude [{unit}]": float(amplitude[-1]),
        f"smallest amplitude [{unit}]": float(amplitude.min()),
        f"largest amplitude [{unit}]": float(amplitude.max()),
        f"trial function residual sd [{unit}]": front.residual_sd if front is not None else np.nan,
    }


def posterior(fit: "Fit") -> "pd.DataFrame":
    """One row a parameter of every rig, test and trial function: median, mean, sd and intervals, with its unit."""
    unit = fit.campaign.section.amplitude_unit
    rows = []
    for kind, heading in (("rig", "rigs"), ("test", "tests"), ("trial function", "records")):
        for one in fit.summary[heading]:
            for name, entry in one["parameters"].items():
                rows.append(
                    {
                        "posterior": kind,
                        "of": one["name"],
                        "parameter": name,
                        "unit": unit_of(name, unit),
                        **{key: entry[key] for key in ("median", "mean", "sd")},
                        **_bounds(entry["interval"]),
                    }
                )
    return _frame(rows)


def convergence(fit: "Fit") -> "pd.DataFrame":
    """One row a sampled parameter, as the verdict on convergence left it."""
    return fit.convergence.reset_index()


def laws(fit: "Fit") -> "pd.DataFrame":
    """One row a law of the model card: its prior and posterior probability, evidence and stacking weight."""
    rows = [
        {
            "law": label,
            "prior probability": one["prior"],
            "posterior probability": one["weight"],
            "stacking weight": _finite(one["stacking"]),
            "log evidence": _finite(one["log_evidence"]),
            "log evidence error": _finite(one["log_evidence_error"]),
            "sampled": one["sampled"],
        }
        for label, one in fit.summary["laws"].get("weights", {}).items()
    ]
    return _frame(rows)


def prediction_table(predictions: Sequence["Prediction"]) -> "pd.DataFrame":
    """One row a prediction."""
    rows = []
    for one in predictions:
        entry = one.to_json()
        amplitude = entry["amplitude"]
        rows.append(
            {
                "Sc [-]": entry["sc"],
                "damping ratio [-]": entry["damping_ratio"],
                "rig": one.rig,
                "laws": ", ".join(f"{law} {weight:.3g}" for law, weight in one.laws.items() if weight > 5e-4),
                "unit": amplitude["unit"],
                **{key: _finite(amplitude[key]) for key in ("median", "mean", "sd")},
                **_bounds({p: [_finite(x) for x in pair] for p, pair in amplitude["interval"].items()}),
                "extrapolation index x": one.extrapolation_index,
                "probability of no vibration": one.dies,
                "fraction without stable amplitude": one.unbounded,
            }
        )
    return _frame(rows)


def ring_downs(fit: "Fit") -> "pd.DataFrame":
    """One row a band of amplitude of every rig: structural damping against amplitude."""
    unit = fit.campaign.section.amplitude_unit
    return _frame(
        [
            {
                "rig": name,
                f"from amplitude [{unit}]": band.lower,
                f"to amplitude [{unit}]": band.upper,
                "damping ratio [-]": band.damping_ratio,
                "damping ratio sd [-]": band.sd,
                "plucks": band.plucks,
            }
            for name, ring in fit.ringdowns.items()
            for band in ring.bands
        ]
    )


def write_csv(frames: Mapping[str, "pd.DataFrame"], folder: Path) -> list[Path]:
    """Write each frame as NAME.csv (UTF-8), each in one atomic step; no cell is a formula to a spreadsheet.

    Returns
    -------
    list of Path
        The files, in the order of the frames.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, frame in frames.items():
        path = folder / f"{name}.csv"
        write_text(path, safe_frame(frame).to_csv(index=False))
        paths.append(path)
    return paths


def _frame(rows: Sequence[Mapping[str, Any]]) -> "pd.DataFrame":
    import pandas as pd

    return pd.DataFrame(list(rows))


def _mean(quantity: Quantity | None) -> float:
    return np.nan if quantity is None else quantity.mean


def _sd(quantity: Quantity | None) -> float:
    return np.nan if quantity is None or quantity.sd is None else quantity.sd


def _finite(value: float | None) -> float:
    return np.nan if value is None else value


def _bounds(interval: Mapping[str, Sequence[float]]) -> dict[str, float]:
    """Columns of an interval: "q05" for the lower bound of 90 %, and so on."""
    below = {_quantile(0.5 - float(p) / 2): interval[p][0] for p in sorted(interval, reverse=True)}
    return below | {_quantile(0.5 + float(p) / 2): interval[p][1] for p in sorted(interval)}


def _quantile(q: float) -> str:
    return f"q{100 * q:04.1f}".removesuffix(".0")


def _spread(entry: Mapping[str, Any] | None, name: str, unit: str) -> dict[str, float]:
    """Median and 90 % interval of one parameter as three columns."""
    low, high = entry["interval"]["0.90"] if entry else (np.nan, np.nan)
    return {
        f"{name} median [{unit}]": entry["median"] if entry else np.nan,
        f"{name} q05 [{unit}]": low,
        f"{name} q95 [{unit}]": high,
    }
