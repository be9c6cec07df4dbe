"""What the interactive charts read: quantiles along a grid, and tables, as JSON, in the numbers that are shown."""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Motion
from scruton.griffin import shared_curve
from scruton.griffin.bands import band_along, griffin_band
from scruton.griffin.coverage import coverage_of
from scruton.griffin.posterior import peak_names, unit_of
from scruton.griffin.predict import predictive_draws
from scruton.report.conventions import (
    DAMPING,
    SCRUTON,
    conventions,
    damping,
    damping_label,
    damping_words,
    shown_in,
    with_unit,
)
from scruton.report.figures.griffin_axes import as_shown, factors, front_ends, sc_range, test_points, thinned_curve
from scruton.report.needs import Content, governing, required_of, worst
from scruton.report.summaries import law_of_tests
from scruton.report.thresholds import MOST_BANDS
from scruton.report.wording import limit_text, listed, number, unit_text

if TYPE_CHECKING:
    from scruton.griffin import Prediction
    from scruton.infer.results import Fit

GRID = 241
_BRIDGE_GRID = 161
_CURVES = 12  # deterministic curves, and points of each
_POINTS = 60
_POINTS_OF = {"measured": "Full points: measured amplitudes.", "posterior": "Open points: posteriors of tests."}
_BEYOND = "It was not computed there: `scruton predict RESULTS --sc` answers."


def griffin_chart(fit: "Fit", design: "Sequence[Prediction]" = ()) -> dict[str, Any]:
    """The Griffin plot to be read off: predictive quantiles along the Scruton number, the points, the curves.

    It is the `chart` of a `scruton.report.document.Picture`; None stands for a number that does not exist. The reader
    begins at the first prediction of the design.
    """
    with conventions(fit):
        return _griffin_chart(fit, design)


def _griffin_chart(fit: "Fit", design: "Sequence[Prediction]") -> dict[str, Any]:
    tree, tests, unit = fit.tree, peak_names(fit.tree), unit_of(fit.tree)
    times, scale = factors(unit)
    asked = [prediction.scruton_number for prediction in design]
    upper = max([sc_range(tree)[1], *(1.1 * number for number in asked)])
    grid = np.linspace(0.0, upper, GRID)
    along = band_along(grid, partial(predictive_draws, tree, seed=fit.seed), unit, "predictive")
    predictive = as_shown(along)
    low, high, half_low, half_high = map(listed, (*predictive.intervals[0.90], *predictive.intervals[0.50]))
    points: list[dict[str, Any]] = [
        {
            "label": point.name, "x": _round(times * point.scruton_number),
            "y": _round(scale * (point.median if point.measured is None else point.measured.mean)),
            "low": _round(scale * point.low), "high": _round(scale * point.high),
            "tone": "posterior" if point.measured is None else "measured",
        }
        for point in test_points(fit)
    ]  # fmt: skip
    lines: list[dict[str, Any]] = [
        {"label": f"from {name} alone", "x": listed(times * grid),
         "y": listed(as_shown(griffin_band(tree, grid, name)).median), "tone": "own"}
        for name in tests[:MOST_BANDS]
    ]  # fmt: skip
    for _, record, front in islice(front_ends(fit, tests), _CURVES):
        sc, amplitude = thinned_curve(front, _POINTS)
        good = (amplitude > 0.0) & (sc >= 0.0)
        line = {"x": listed(times * sc[good]), "y": listed(scale * amplitude[good]), "tone": "deterministic"}
        lines.append({"label": f"Eqs. (2)-(8), {record.name}", **line})
    largest = max(max(point["high"], point["y"]) for point in points)
    median = predictive.median[np.isfinite(predictive.median)]
    top = 1.3 * max(largest, min(float(median.max(initial=0.0)), 1.6 * largest))
    start = times * asked[0] if asked else float(np.median([point["x"] for point in points]))
    shown, model = unit_text(shown_in(unit)[1]), None
    if fit.campaign.section.motion is Motion.HEAVING:
        factor, length = shown_in("m")
        model = {"factor": factor * fit.campaign.section.depth, "unit": length, "where": "at the model's scale"}
    return {
        "name": "Griffin plot",
        "per": [times, scale],
        "key": "The Griffin plot to be read off. Black line: predictive median of all peak tests; grey: its 50 and "
        f"90 % intervals; coloured: each test alone, by {law_of_tests(fit.summary)}; dotted: Eqs. (2) to (8); "
        "red: the number chosen. "
        + " ".join(words for tone, words in _POINTS_OF.items() if tone in {point["tone"] for point in points}),
        "x": {
            "label": "Scruton number Sc", "min": 0.0, "max": _round(times * upper), "start": _round(start),
            "step": _step(times * upper), "slider": "Design Scruton number", "symbol": "Sc", "beyond": _BEYOND,
        },
        "y": {"label": f"Stable amplitude [{shown}]", "max": _round(top)},
        "grid": listed(times * grid),
        "areas": [
            {"label": "predictive, 90 %", "low": low, "high": high, "tone": "outer"},
            {"label": "predictive, 50 %", "low": half_low, "high": half_high, "tone": "inner"},
        ],
        "lines": lines,
        "points": points,
        "read": {
            "what": "stable amplitude", "unit": shown, "median": listed(predictive.median), "low": low, "high": high,
            "interval": "90 % interval", "scale": model, "also": _reach(fit, grid, along.median),
        },
    }  # fmt: skip


def _reach(fit: "Fit", grid: FloatArray, amplitude: FloatArray) -> list[dict[str, Any]]:
    """How far from the tests every point of a grid of Scruton numbers lies: x of the nearest, and tests that saw it."""
    tree = fit.tree
    coverage, names = coverage_of(tree), peak_names(tree)
    curve = shared_curve(tree, seed=fit.seed)
    nearest = np.array([curve.index_of_nearest(float(sc)) for sc in grid])
    seen = [coverage.tests_at(float(one)) if np.isfinite(one) and one > 0.0 else None for one in amplitude]
    return [
        {"symbol": "extrapolation index x", "values": listed(nearest), "digits": 2},
        {"symbol": "peak tests whose transients saw this amplitude", "values": seen, "of": len(names)},
    ]


def decision_chart(fit: "Fit", content: Content) -> dict[str, Any] | None:
    """The Griffin plot of the bridge to be read off: its amplitude along its own Scruton number, and the limit.

    None where the sizing holds no amplitudes, or none that are bounded.
    """
    mode = worst(content)
    rule = governing(mode)
    if "amplitude_50" not in rule["curve"]:
        return None
    with conventions(content):
        return _decision_chart(fit, content, mode, rule)


def _decision_chart(fit: "Fit", content: Content, mode: Content, rule: Content) -> dict[str, Any] | None:
    curve = {key: np.array(values, dtype=float) for key, values in rule["curve"].items() if key != "by_law"}
    files, sc = content["amplitude_unit"], curve["scruton_number"]
    (factor, unit), times, (per, sign) = shown_in(files), shown_in(SCRUTON)[0], shown_in(DAMPING)
    grid = np.linspace(sc[0], sc[-1], _BRIDGE_GRID)
    low, middle, high, added = (
        np.interp(grid, sc, values)
        for values in (*(factor * curve[f"amplitude_{q}"] for q in ("05", "50", "95")), per * curve["added_damping"])
    )
    if not np.isfinite(middle).any():
        return None
    limit, required = factor * rule["limit"], required_of(content, mode)
    on_section = np.median(predictive_draws(fit.tree, grid, seed=fit.seed), axis=0)
    places = [("without added damping", 0.0), *([(f"with {damping(required)} added", required)] if required else [])]
    points = [
        {
            "label": label, "tone": "measured" if not at else "posterior",
            "x": _round(times * float(np.interp(at, curve["added_damping"], sc))),
            **{key: _round(float(np.interp(at, curve["added_damping"], factor * curve[f"amplitude_{q}"])))
               for key, q in (("y", "50"), ("low", "05"), ("high", "95"))},
        }
        for label, at in places
    ]  # fmt: skip
    points = [point for point in points if np.isfinite([point[key] for key in ("y", "low", "high")]).all()]
    shown = unit_text(unit)
    top = max(1.3 * limit, min(1.05 * float(np.nanmax(high)), max(4.0 * limit, 1.5 * float(np.nanmax(middle)))))
    return {
        "name": "Griffin plot of the bridge",
        "per": [times, factor],
        "key": f"The Griffin plot of the bridge to be read off. Black line: median amplitude of mode {mode['name']}; "
        "grey: its 90 % interval with all uncertainties; dashed: the limit; red: the number chosen. Full point: as it "
        "is; open: with the damping that is named there.",
        "x": {
            "label": "Scruton number Sc of the bridge", "min": _round(times * grid[0]), "max": _round(times * grid[-1]),
            "start": points[-1]["x"] if points else _round(times * grid[0]), "step": _step(times * float(np.ptp(grid))),
            "slider": "Scruton number of the bridge", "symbol": "Sc",
            "beyond": "The sizing did not go there: its own damping is the least, what can be added the most.",
        },
        "y": {"label": f"Stable amplitude [{shown}]", "max": _round(top)},
        "grid": listed(times * grid),
        "areas": [{"label": "bridge, 90 %", "low": listed(low), "high": listed(high), "tone": "outer"}],
        "lines": [],
        "limits": [{"label": f"limit, {limit_text(rule)}: {with_unit(number(limit, 3), unit)}", "y": _round(limit)}],
        "points": points,
        "read": {
            "what": f"amplitude of mode {mode['name']}", "unit": shown, "median": listed(middle), "low": listed(low),
            "high": listed(high), "interval": "90 % interval",
            "limit": _round(limit),
            "also": [
                {"symbol": f"added {damping_words()}", "values": listed(added), "unit": sign},
                *_reach(fit, grid, on_section),
            ],
        },
    }  # fmt: skip


def risk_chart(mode: Mapping[str, Any], curve: Mapping[str, Any], what: str) -> dict[str, Any]:
    """Probability of exceeding a limit along the damping that is added, to be read off; `what` says of what it is.

    The mode is an entry of "modes" of sizing.json, the curve that of one of its limits.
    """
    grid = [_round(shown_in(DAMPING)[0] * ratio) for ratio in curve["added_damping"]]
    low, high = curve["probability_05"], curve["probability_95"]
    label = damping_label("Added damping ratio")
    return {
        "name": f"Risk of mode {mode['name']}",
        "per": [shown_in(DAMPING)[0] / 100.0, 1.0],
        "key": f"The {what} along the added damping, to be read off. Black line: probability; grey: the 90 % band that "
        "the section's posterior and the law leave; red: the damping chosen.",
        "x": {"label": label, "min": grid[0], "max": grid[-1], "start": grid[0],
              "step": _step(grid[-1] - grid[0]), "slider": label,
              "symbol": damping_label("Added damping").removesuffix(" [-]"),
              "beyond": "More than can be added was not computed."},
        "y": {"label": "Probability of exceeding the limit", "max": 1.0},
        "grid": grid,
        "areas": [{"label": "90 % band of section and law", "low": low, "high": high, "tone": "outer"}],
        "lines": [],
        "points": [],
        "read": {
            "what": what, "unit": "", "percent": True, "median": curve["probability"], "low": low, "high": high,
            "interval": "90 % band of section and law",
            "also": [{"symbol": "Sc", "values": [_round(shown_in(SCRUTON)[0] * sc) for sc in curve["scruton_number"]]}],
        },
    }  # fmt: skip


def damper_chart(mode: Mapping[str, Any]) -> dict[str, Any] | None:
    """What sliders of a mode's dampers move, and the table that their risk and stroke are read off; None without it."""
    table, damper = mode.get("damper_table"), mode["damper"]
    if not table:
        return None
    first, (per, sign) = damper["dampers"][0], shown_in(DAMPING)
    mass = damper["mass"] / 1e3 if damper.get("mass") else 100.0 * damper["mass_ratio"]
    several = "" if len(damper["dampers"]) == 1 else " of the first"
    return {
        "name": f"Dampers of mode {mode['name']}",
        "table": {key: table[key] for key in ("mass", "tuning", "damping", "probability", "stroke_high")},
        "sliders": [
            {"key": "mass", "label": "Mass of all dampers", "value": _round(mass),
             "unit": "t" if damper.get("mass") else "%"},
            {"key": "tuning", "label": f"Frequency{several}", "value": _round(first["frequency"]), "unit": "Hz",
             "low": 0.95, "high": 1.05},
            {"key": "damping", "label": f"{damping_words().capitalize()}{several}",
             "value": _round(per * first["damping_ratio"]), "unit": sign},
            {"key": "detuning", "label": "Bridge off frequency by", "low": 0.95, "high": 1.05, "relative": True},
        ],
        "asked": {"risk": damper["asked"]["risk"], "stroke": damper["asked"].get("largest_stroke")},
        "note": "Read off a table computed beforehand: at "
        f"{table['checked']} places between its nodes the risk was off by {100.0 * table['error_probability']:.2g} % "
        f"(of one) and the stroke by {100.0 * table['error_stroke']:.2g} % at the most. The mean frequency of the "
        "bridge is off by what is chosen, with the uncertainty as stated about it.",
    }  # fmt: skip


def _step(span: float) -> float:
    """A step that divides the slider finely: 1, 2 or 5 in some decade, some 500 of them."""
    raw = span / 500.0
    power = 10.0 ** np.floor(np.log10(raw))
    return float(f"{next(m for m in (1.0, 2.0, 5.0, 10.0) if m * power >= raw) * power:.3g}")


def _round(value: float) -> float:
    return float(f"{value:.6g}")


def plain(data: Mapping[str, Any]) -> dict[str, Any]:
    """What of a chart goes to report.json, in the units of files: its grid and quantiles."""
    across, up = data.get("per", (1.0, 1.0))

    def in_files(values: Sequence[float | None] | None, factor: float) -> list[float | None] | None:
        return None if values is None else [None if one is None else _round(one / factor) for one in values]

    quantiles = {key: in_files(data["read"].get(key), up) for key in ("median", "low", "high")}
    return {"grid": in_files(data["grid"], across), **quantiles}
