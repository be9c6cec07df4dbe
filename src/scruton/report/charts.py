"""What the interactive charts read: quantiles along a grid, as JSON."""

from collections.abc import Mapping, Sequence
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Motion
from scruton.griffin.bands import band, griffin_band
from scruton.griffin.posterior import peak_names, unit_of
from scruton.griffin.predict import predictive_draws
from scruton.report.figures.griffin_axes import front_ends, sc_range, test_points, thinned_curve
from scruton.report.thresholds import MOST_BANDS

if TYPE_CHECKING:
    from scruton.griffin import Prediction
    from scruton.infer.results import Fit

GRID = 241
_CURVES = 12  # deterministic curves, and points of each
_POINTS = 60


def griffin_chart(fit: "Fit", design: "Sequence[Prediction]" = ()) -> dict[str, Any]:
    """The Griffin plot to be read off: predictive quantiles along the Scruton number, the points, the curves.

    It is the `chart` of a `scruton.report.document.Picture`; None stands for a number that does not exist. The reader
    begins at the first prediction of the design.
    """
    tree, tests, unit = fit.tree, peak_names(fit.tree), unit_of(fit.tree)
    asked = [prediction.scruton_number for prediction in design]
    upper = max([sc_range(tree)[1], *(1.1 * number for number in asked)])
    grid = np.linspace(0.0, upper, GRID)
    draws = predictive_draws(tree, grid, seed=int(fit.summary["provenance"]["seed"]))
    predictive = band(grid, draws, unit, "predictive")
    low, high, half_low, half_high = map(_list, (*predictive.intervals[0.90], *predictive.intervals[0.50]))
    points: list[dict[str, Any]] = [
        {
            "label": point.name, "x": _round(point.scruton_number),
            "y": _round(point.median) if point.measured is None else point.measured.mean,
            "low": _round(point.low), "high": _round(point.high),
            "tone": "posterior" if point.measured is None else "measured",
        }
        for point in test_points(fit)
    ]  # fmt: skip
    lines: list[dict[str, Any]] = [
        {"label": f"from {name} alone", "x": _list(grid), "y": _list(griffin_band(tree, grid, name).median),
         "tone": "own"}
        for name in tests[:MOST_BANDS]
    ]  # fmt: skip
    for _, record, front in islice(front_ends(fit, tests), _CURVES):
        sc, amplitude = thinned_curve(front, _POINTS)
        good = (amplitude > 0.0) & (sc >= 0.0)
        line = {"label": f"Eqs. (2)-(8), {record.name}", "x": _list(sc[good]), "y": _list(amplitude[good])}
        lines.append({**line, "tone": "deterministic"})
    largest = max(max(point["high"], point["y"]) for point in points)
    median = predictive.median[np.isfinite(predictive.median)]
    top = 1.3 * max(largest, min(float(median.max(initial=0.0)), 1.6 * largest))
    start = asked[0] if asked else float(np.median([point["x"] for point in points]))
    factor, shown, where = 180.0 / np.pi, "°", ""
    if fit.campaign.section.motion is Motion.HEAVING:
        factor, shown, where = 1e3 * fit.campaign.section.depth, "mm", "at the model's scale"
    return {
        "name": "Griffin plot",
        "key": "Black line: predictive median of all peak tests, grey: its 50 and 90 % intervals. Coloured: each test "
        "alone; dotted: Eqs. (2) to (8). Points: measured amplitudes (open: posterior). Red: the number chosen.",
        "x": {
            "label": "Scruton number Sc", "min": 0.0, "max": _round(upper), "start": _round(start),
            "step": _step(upper), "slider": "Design Scruton number", "symbol": "Sc",
        },
        "y": {"label": f"Stable amplitude [{unit}]", "max": _round(top)},
        "grid": _list(grid),
        "areas": [
            {"label": "predictive, 90 %", "low": low, "high": high, "tone": "outer"},
            {"label": "predictive, 50 %", "low": half_low, "high": half_high, "tone": "inner"},
        ],
        "lines": lines,
        "points": points,
        "read": {
            "what": "stable amplitude", "unit": unit, "median": _list(predictive.median), "low": low, "high": high,
            "interval": "90 % interval", "scale": {"factor": factor, "unit": shown, "where": where},
        },
    }  # fmt: skip


def risk_chart(mode: Mapping[str, Any], curve: Mapping[str, Any], what: str) -> dict[str, Any]:
    """Probability of exceeding a limit along the damping that is added, to be read off; `what` says of what it is.

    The mode is an entry of "modes" of sizing.json, the curve that of one of its limits.
    """
    grid = [_round(100.0 * ratio) for ratio in curve["added_damping"]]
    low, high = curve["probability_05"], curve["probability_95"]
    return {
        "name": f"Risk of mode {mode['name']}",
        "key": "Black line: probability, grey: the 90 % band that the section's posterior and the law leave. Red: the "
        "damping chosen.",
        "x": {"label": "Added damping ratio [%]", "min": grid[0], "max": grid[-1], "start": grid[0],
              "step": _step(grid[-1] - grid[0]), "slider": "Added damping ratio [%]", "symbol": "Added damping [%]"},
        "y": {"label": "Probability of exceeding the limit", "max": 1.0},
        "grid": grid,
        "areas": [{"label": "90 % band of section and law", "low": low, "high": high, "tone": "outer"}],
        "lines": [],
        "points": [],
        "read": {
            "what": what, "unit": "", "percent": True, "median": curve["probability"], "low": low, "high": high,
            "interval": "90 % band of section and law", "also": {"symbol": "Sc", "values": curve["scruton_number"]},
        },
    }  # fmt: skip


def _step(span: float) -> float:
    """A step that divides the slider finely: 1, 2 or 5 in some decade, some 500 of them."""
    raw = span / 500.0
    power = 10.0 ** np.floor(np.log10(raw))
    return float(f"{next(m for m in (1.0, 2.0, 5.0, 10.0) if m * power >= raw) * power:.3g}")


def _round(value: float) -> float:
    return float(f"{value:.6g}")


def _list(values: FloatArray) -> list[float | None]:
    return [_round(float(value)) if np.isfinite(value) else None for value in values]


def plain(data: Mapping[str, Any]) -> dict[str, Any]:
    """What of a chart goes to report.json: its grid and quantiles."""
    return {"grid": data["grid"], **{key: data["read"].get(key) for key in ("median", "low", "high")}}
