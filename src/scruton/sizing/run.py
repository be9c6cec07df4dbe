"""`size`: everything that `scruton size` knows, as the content of sizing.json."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.plausibility import damping_flag
from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.errors import InputError
from scruton.griffin.curves import law_curves, what_if
from scruton.griffin.posterior import chosen_rig, motion_of, peak_names, rig_mass_damping_draws
from scruton.progress import Progress
from scruton.sizing import modes as together
from scruton.sizing.bridge import Bridge
from scruton.sizing.limits import Limit
from scruton.sizing.model import ModeModel, unit_cube
from scruton.sizing.money import cost_curve, information
from scruton.sizing.risk import CONFIDENCES, Risk, flags, risk
from scruton.sizing.shares import shares
from scruton.sizing.tmd import response
from scruton.sizing.tmd_design import Design, MassMap, design, mass_map
from scruton.sizing.tmd_tuning import CLOSE

if TYPE_CHECKING:
    import xarray as xr

DAMPER_DRAWS, CHECK_DRAWS = 1 << 12, 1 << 15
CORRECTIONS = 4
LONG_STROKE = 1.0  # m, beyond which a stroke without a stated limit is remarked upon
LEAST_EXPONENT = -2.0  # below it the force of the wind on strips near a node has no finite sum
NEAR_NODE = 0.2  # of the mode's largest movement
MAP_POINTS = 7
LOCK_IN_MARGIN = 0.1  # about the reduced velocity of the peak tests, where a mode states no range


def size(
    tree: "xr.DataTree",
    bridge: Bridge,
    limits: Sequence[Limit] = (),
    *,
    rig: str | None = None,
    law_n: float | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Size the damping of a bridge from the posterior of its section model.

    Parameters
    ----------
    tree : xarray.DataTree
        Of a fit with tests in wind.
    bridge : Bridge
    limits : sequence of Limit
        Beside those that the bridge names.
    rig : str, optional
        Whose mass ratio a mode without a mass has; the first in wind if left out.
    law_n : float, optional
        One law alone.
    seed : int
    progress : callable, optional
        Told what is being done and the fraction done.

    Returns
    -------
    dict
        The content of sizing.json; numbers that do not exist are None.

    Raises
    ------
    InputError
        Without a limit; where a limit says nothing of this motion; where the bridge's motion is not the section's.
    """
    if law_n is not None and not (np.isfinite(law_n) and law_n >= LEAST_EXPONENT):
        raise InputError("sizing", "law", f"{law_n:g}", f"a finite exponent from {LEAST_EXPONENT:g} on")
    rules = list({rule.text: rule for rule in (*bridge.limits, *limits)}.values())
    if not rules:
        raise InputError("sizing", "limits", "no limit", 'at least one, such as --limit jtg or limits = ["jtg"]')
    if bridge.motion is not motion_of(tree):
        raise InputError("bridge", "motion", bridge.motion.value, f"{motion_of(tree).value}, that of the section model")
    tell = progress or (lambda _what, _done: None)
    laws = law_curves(tree, law_n=law_n)
    factor = rig_mass_damping_draws(tree, chosen_rig(tree, rig))
    models = [ModeModel(laws, factor, bridge, mode) for mode in bridge.modes]
    for model in models:
        place = together.position(model)
        if not abs(model.mode.shape.at(place)) > 1e-6:
            raise InputError(
                "bridge.toml", "damper.position", f"{place:g}, a node of mode {model.mode.name}",
                "a place where every mode moves; left out, each mode's dampers stand where it is largest",
            )  # fmt: skip
    entries, governing = [], []
    for k, model in enumerate(models):
        entry, limit = _mode(model, rules, seed, _within(tell, k, len(models)))
        entries.append(entry)
        governing.append(limit)
    content: dict[str, Any] = {
        "format": 1,
        "bridge": {
            "title": bridge.title, "motion": bridge.motion.value, "width": bridge.width, "depth": bridge.depth,
            "air_density": bridge.air_density, "coherence": _uncertain(bridge.coherence),
        },
        "amplitude_unit": "m" if bridge.motion is Motion.HEAVING else "rad",
        "laws": dict(zip(laws.labels, laws.weights.tolist(), strict=True)),
        "modes": entries,
        "all_modes": _all_modes(tree, models, entries, governing, seed),
        "flags": [flag for entry in entries for flag in entry["flags"]],
    }  # fmt: skip
    content["flags"] += what_if(tree, law_n)
    if law_n is not None and "effect" in tree:
        content["flags"].append(f"the fit carries {tree['effect'].attrs['effect']}; under one law alone it is left out")
    content["flags"] += _lacking(bridge)
    tell("done", 1.0)
    found: dict[str, Any] = plain(content)
    return found


def _lacking(bridge: Bridge) -> list[str]:
    """Why there is no cost where costs are stated."""
    cost = bridge.cost
    if cost is None:
        return []
    if not cost.failure > 0.0:
        return ["cost.failure is not stated: there is no expected cost without it"]
    found = []
    if not cost.per_percent > 0.0:
        found.append("cost.per_percent is not stated: without it damping has no cost, and information no value")
    if cost.per_kg > 0.0 and any(mode.modal_mass is None for mode in bridge.modes):
        found.append("cost.per_kg has no meaning for a mode without a modal mass: state its mass and length")
    return found


def _within(tell: Progress, k: int, count: int) -> Progress:
    return lambda what, done: tell(what, (k + done) / count)


def _mode(model: ModeModel, rules: Sequence[Limit], seed: int, tell: Progress) -> tuple[dict[str, Any], float]:
    mode, bridge = model.mode, model.bridge
    values = [(rule, rule.amplitude(bridge.motion, mode.frequency.mean, bridge.width, bridge.depth)) for rule in rules]
    limits = []
    for i, (rule, value) in enumerate(values):
        tell(f"mode {mode.name}: risk against {rule.rule.name}", 0.3 * i / len(values))
        limits.append((rule, risk(model, value, seed=seed)))
    rule, chosen = min(limits, key=lambda pair: pair[1].limit)
    wanted = chosen.required[0.95]
    tell(f"mode {mode.name}: shares of variance", 0.3)
    parts = shares(model, chosen.limit, added=wanted or 0.0, seed=seed)
    draws = model.draws(unit_cube(DAMPER_DRAWS, seed + 4))
    entry: dict[str, Any] = {
        "name": mode.name,
        "frequency": _uncertain(mode.frequency),
        "damping_ratio": _uncertain(mode.damping_ratio),
        "mass": None if mode.mass is None else _uncertain(mode.mass),
        "modal_mass": mode.modal_mass,
        "shape": mode.shape.name,
        "mode_factor": {label: float(mode.shape.factor(float(np.median(model.laws.n[k]))))
                        for k, label in enumerate(model.laws.labels)},
        "scruton_number": _spread(draws.scruton_number(0.0)),
        "amplitude": _spread(draws.amplitude(0.0)),
        "limits": [_limit(one, found) for one, found in limits],
        "governing": rule.text,
        "shares": {name: [vars(share) for share in rows] for name, rows in parts.items()},
        "flags": flags(model, draws),
    }  # fmt: skip
    if flag := damping_flag(mode.damping_ratio.mean):
        entry["flags"].append(f"mode {mode.name}: {flag}")
    tell(f"mode {mode.name}: tuned mass damper", 0.4)
    entry["damper"] = damper = _damper(model, chosen, seed)
    if bridge.damper.largest_stroke is None and damper["dampers"] and damper["stroke"]["high"] > LONG_STROKE:
        entry["flags"].append(
            f"mode {mode.name}: the stroke of the lightest damper is {damper['stroke']['high']:.1f} m (95 %): "
            "state damper.largest_stroke for one that fits"
        )
    moves = abs(mode.shape.at(damper["position"]))
    if damper["dampers"] and moves < NEAR_NODE:
        entry["flags"].append(
            f"mode {mode.name}: where the damper stands the mode moves {moves:.1%} of its largest, and its mass grows "
            "with the inverse square of that"
        )
    if bridge.cost is not None and bridge.cost.failure > 0.0:
        tell(f"mode {mode.name}: costs and value of information", 0.85)
        entry["cost"] = _cost(model, chosen, entry["damper"], seed)
    return entry, chosen.limit


def _limit(rule: Limit, found: Risk) -> dict[str, Any]:
    return {
        "rule": rule.text, "title": rule.rule.title, "source": rule.rule.source, "confirm": rule.rule.confirm,
        "limit": found.limit,
        "probability": float(np.mean(found.needed > 0.0)),
        "expected_exceedance": float(found.exceedance[0]),
        "required": {f"{p:.2f}": found.required[p] for p in CONFIDENCES},
        "required_text": {f"{p:.2f}": found.text(p) for p in CONFIDENCES},
        "curve": {
            "added_damping": found.added, "scruton_number": found.scruton_number, "probability": found.probability,
            "probability_05": found.band[0], "probability_95": found.band[1], "by_law": dict(found.by_law),
            "amplitude_05": found.amplitude[0], "amplitude_50": found.amplitude[1], "amplitude_95": found.amplitude[2],
            "expected_exceedance": found.exceedance,
        },
    }  # fmt: skip


def _damper(model: ModeModel, chosen: Risk, seed: int) -> dict[str, Any]:
    """The lightest tuned mass damper, and mass against risk."""
    wish = model.bridge.damper
    mode = model.mode
    stated, modal_mass = mode.modal_mass is not None, mode.modal_mass or 1.0  # masses are ratios where none is stated
    draws, fresh = model.draws(unit_cube(DAMPER_DRAWS, seed + 4)), model.draws(unit_cube(CHECK_DRAWS, seed + 5))
    needed = fresh.needed(chosen.limit)
    place = together.position(model)
    shape = abs(mode.shape.at(place)) * together.lever_arm(model)
    common: dict[str, Any] = {
        "limit": chosen.limit, "detuning": draws.detuning, "number": wish.number, "shape": shape,
    }  # fmt: skip
    # A design is best for the draws that it was made with: on fresh ones it leaves more risk than was asked for.
    aim = wish.risk
    for _ in range(CORRECTIONS):
        found = design(
            draws.amplitude, risk=aim, modal_mass=modal_mass, frequency=mode.frequency.mean,
            largest_stroke=wish.largest_stroke, largest_mass_ratio=wish.largest_mass_ratio, **common,
        )  # fmt: skip
        left = float(
            np.mean(needed > (response(found.dampers, fresh.detuning).added_damping if found.dampers else 0.0))
        )
        if left <= 1.02 * wish.risk or not found.achievable:
            break
        aim *= wish.risk / left
    total = sum(one.mass_ratio for one in found.dampers)
    ratios = np.geomspace(max(0.1 * total, 2e-4), min(max(3.0 * total, 2e-3), 0.1), MAP_POINTS)
    if total > 0.0:
        ratios = np.unique(np.append(ratios, total))
    chart = mass_map(draws.amplitude, mass_ratios=ratios, largest_stroke=wish.largest_stroke, **common)
    remaining = [float(np.mean(needed > response(one, fresh.detuning).added_damping)) for one in chart.dampers]
    chart = replace(chart, probability=np.array(remaining))
    scale = modal_mass / shape**2
    return {
        "asked": {"risk": wish.risk, "number": wish.number, "largest_mass_ratio": wish.largest_mass_ratio,
                  "largest_stroke": wish.largest_stroke},
        "position": place,
        "achievable": found.achievable,
        "reason": found.reason,
        "dampers": _dampers(found, mode.frequency.mean, scale if stated else None),
        "mass_ratio": total,
        "mass": total * scale if stated else None,
        "probability": left,
        "added_damping": {"median": found.added_damping, "low": found.added_damping_low},
        "stroke": {"median": found.stroke, "high": found.stroke_high},
        "detuned": [vars(one) for one in found.detuned],
        "map": _map(chart, scale if stated else None),
    }  # fmt: skip


def _dampers(found: Design, frequency: float, scale: float | None) -> list[dict[str, Any]]:
    return [
        {
            "mass_ratio": one.mass_ratio, "frequency_ratio": one.frequency_ratio, "damping_ratio": one.damping_ratio,
            "frequency": one.frequency_ratio * frequency,
            "mass": None if scale is None else one.mass_ratio * scale,
            "spring": None if scale is None else found.springs[k],
            "dashpot": None if scale is None else found.dashpots[k],
        }
        for k, one in enumerate(found.dampers)
    ]  # fmt: skip


def _map(chart: MassMap, scale: float | None) -> dict[str, Any]:
    return {
        "mass_ratio": chart.mass_ratio, "mass": None if scale is None else chart.mass_ratio * scale,
        "probability": chart.probability, "stroke": chart.stroke, "stroke_high": chart.stroke_high,
        "added_damping": chart.added_damping,
    }  # fmt: skip


def _cost(model: ModeModel, chosen: Risk, damper: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """Expected cost of damping bought by the percentage point, or of mass; and what knowing more is worth."""
    cost = model.bridge.cost
    assert cost is not None
    entry: dict[str, Any] = {"currency": cost.currency, "failure": cost.failure}
    chart = damper["map"]
    if cost.per_kg > 0.0 and chart["mass"] is not None:
        bought = cost.fixed + cost.per_kg * np.asarray(chart["mass"])
        total = bought + cost.failure * chart["probability"]
        without = cost.failure * float(np.mean(chosen.needed > 0.0))
        asked = damper["asked"]
        allowed = chart["mass_ratio"] <= asked["largest_mass_ratio"]
        if asked["largest_stroke"] is not None:
            allowed &= chart["stroke_high"] <= (1.0 + CLOSE) * asked["largest_stroke"]
        best = int(np.argmin(np.where(allowed, total, np.inf)))
        bare = not allowed[best] or without <= total[best]
        entry["by_mass"] = {
            "mass": chart["mass"], "damper": bought, "failure": cost.failure * chart["probability"], "total": total,
            "allowed": allowed, "without": without,
            "best_mass": 0.0 if bare else chart["mass"][best], "best_total": without if bare else total[best],
            "at_the_end": not bare and best == total.size - 1,
        }  # fmt: skip
    if cost.per_percent > 0.0:
        curve = cost_curve(cost, chosen.added, chosen.probability)
        entry["by_damping"] = {
            "added_damping": curve.added, "damper": curve.damper, "failure": curve.failure, "total": curve.total,
            "best_added_damping": curve.added[curve.best], "best_total": curve.total[curve.best],
            "at_the_end": bool(curve.best == curve.added.size - 1),
        }  # fmt: skip
        known = information(model, chosen.limit, cost, chosen.added, seed=seed)
        entry["information"] = {"perfect": known.perfect, "worth": [vars(one) for one in known.worth]}
    return entry


def _all_modes(
    tree: "xr.DataTree",
    models: Sequence[ModeModel],
    entries: Sequence[Mapping[str, Any]],
    limits: Sequence[float],
    seed: int,
) -> dict[str, Any]:
    """Union over the modes, with and without dampers, and hours a year."""
    draws = together.joint_draws(models, seed)
    nothing = together.together(draws, limits, [0.0] * len(models))
    found: dict[str, Any] = {"names": [one.mode.name for one in models], "without": _joint(nothing)}
    demands = [next(one for one in entry["limits"] if one["rule"] == entry["governing"]) for entry in entries]
    needs = [one["required"]["0.95"] for one in demands]
    if all(one is not None for one in needs):
        found["with_required_damping"] = _joint(together.together(draws, limits, needs))
    if all(model.mode.modal_mass is not None for model in models):
        installed = [
            together.Installed(one["mass"], one["frequency"], one["damping_ratio"], entry["damper"]["position"])
            for entry in entries
            for one in entry["damper"]["dampers"]
        ]
        added = [
            together.added_by(installed, model.mode, one.detuning, together.lever_arm(model))
            for model, one in zip(models, draws, strict=True)
        ]
        found["with_dampers"] = _joint(together.together(draws, limits, added))
        found["added_by_dampers"] = [_spread(one) for one in added]
    if models[0].bridge.wind is not None:
        ranges = [model.mode.lock_in or _lock_in(tree) for model in models]
        hours = [together.lock_in_hours(model, span) for model, span in zip(models, ranges, strict=True)]
        found["hours"] = {
            "lock_in": [list(one) for one in ranges],
            "assumed": [model.mode.lock_in is None for model in models],
            "a_year": hours,
            "exceeding_a_year": [p * (h or 0.0) for p, h in zip(nothing.each, hours, strict=True)],
        }
    return found


def _lock_in(tree: "xr.DataTree") -> tuple[float, float]:
    """Reduced velocities of the peak tests, widened."""
    data = tree["constant_data"].sel(test=list(peak_names(tree)))
    depth = float(data["depth"]) if "depth" in data else np.nan
    found = (data["wind_speed"] / (data["frequency"] * depth)).to_numpy()
    return float(found.min() * (1.0 - LOCK_IN_MARGIN)), float(found.max() * (1.0 + LOCK_IN_MARGIN))


def _joint(found: together.Together) -> dict[str, Any]:
    return {"each": list(found.each), "any": found.union}


def _uncertain(value: Quantity) -> dict[str, Any]:
    return {"mean": value.mean, "sd": value.sd or 0.0, "distribution": "known" if value.certain else value.family}


def _spread(draws: FloatArray) -> dict[str, float]:
    low, median, high = np.quantile(draws, [0.05, 0.5, 0.95], method="inverted_cdf")
    return {"median": float(median), "low": float(low), "high": float(high)}


def plain(value: Any) -> Any:
    """Arrays to lists, numbers of numpy to Python's, those that are not finite to None."""
    if isinstance(value, Mapping):
        return {str(key): plain(one) for key, one in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
