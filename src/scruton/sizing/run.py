"""`size`: everything that `scruton size` finds."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from scruton.campaign.plausibility import damping_flag
from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.errors import InputError
from scruton.griffin.curves import law_curves, what_if
from scruton.griffin.posterior import chosen_rig, motion_of, peak_names, rig_mass_damping_draws
from scruton.progress import Progress
from scruton.sizing.bridge import Bridge
from scruton.sizing.damper import DAMPER_DRAWS, damper
from scruton.sizing.limits import Limit
from scruton.sizing.model import ModeModel, spread, unit_cube
from scruton.sizing.modes import all_modes
from scruton.sizing.money import costs
from scruton.sizing.results import ModeSizing, SizedBridge, Sizing, Stated
from scruton.sizing.risk import flags, risk
from scruton.sizing.shares import shares
from scruton.sizing.thresholds import AT_NODE, LEAST_EXPONENT, LOCK_IN_MARGIN, LONG_STROKE, NEAR_NODE

if TYPE_CHECKING:
    import xarray as xr


def size(
    tree: "xr.DataTree",
    bridge: Bridge,
    limits: Sequence[Limit] = (),
    *,
    rig: str | None = None,
    law_n: float | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> Sizing:
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
    Sizing

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
        if not abs(model.mode.shape.at(model.damper_position)) > AT_NODE:
            raise InputError(
                "bridge.toml", "damper.position", f"{model.damper_position:g}, a node of mode {model.mode.name}",
                "a place where every mode moves; left out, each mode's dampers stand where it is largest",
            )  # fmt: skip
    modes = tuple(_mode(model, rules, seed, _within(tell, k, len(models))) for k, model in enumerate(models))
    remarks = [flag for mode in modes for flag in mode.flags]
    remarks += what_if(tree, law_n)
    if law_n is not None and "effect" in tree:
        remarks.append(f"the fit carries {tree['effect'].attrs['effect']}; under one law alone it is left out")
    sizing = Sizing(
        1,
        SizedBridge(bridge.title, bridge.motion.value, bridge.width, bridge.depth, bridge.air_density,
                    _stated(bridge.coherence)),
        "m" if bridge.motion is Motion.HEAVING else "rad",
        dict(zip(laws.labels, laws.weights.tolist(), strict=True)),
        modes,
        all_modes(
            models,
            [mode.governing_limit for mode in modes],
            [(each, mode.damper.position) for mode in modes for each in mode.damper.dampers],
            _peak_range(tree),
            seed,
        ),
        (*remarks, *_missing_costs(bridge)),
    )  # fmt: skip
    tell("done", 1.0)
    return sizing


def _missing_costs(bridge: Bridge) -> list[str]:
    """Why there is no cost where costs are stated."""
    cost = bridge.cost
    if cost is None:
        return []
    if not cost.failure > 0.0:
        return ["cost.failure is not stated: there is no expected cost without it"]
    missing = []
    if not cost.per_percent > 0.0:
        missing.append("cost.per_percent is not stated: without it damping has no cost, and information no value")
    if cost.per_kg > 0.0 and any(mode.modal_mass is None for mode in bridge.modes):
        missing.append("cost.per_kg has no meaning for a mode without a modal mass: state its mass and length")
    return missing


def _within(tell: Progress, k: int, count: int) -> Progress:
    return lambda what, done: tell(what, (k + done) / count)


def _mode(model: ModeModel, rules: Sequence[Limit], seed: int, tell: Progress) -> ModeSizing:
    mode, bridge, risks = model.mode, model.bridge, []
    for i, rule in enumerate(rules):
        tell(f"mode {mode.name}: risk against {rule.rule.name}", 0.3 * i / len(rules))
        risks.append(risk(model, rule, seed=seed))
    governing = min(risks, key=lambda against: against.limit)
    tell(f"mode {mode.name}: shares of variance", 0.3)
    parts = shares(model, governing.limit, added=governing.required["0.95"] or 0.0, seed=seed)
    draws = model.draws(unit_cube(DAMPER_DRAWS, seed + 4))
    remarks = flags(model, draws)
    if flag := damping_flag(mode.damping_ratio.mean):
        remarks.append(f"mode {mode.name}: {flag}")
    tell(f"mode {mode.name}: tuned mass damper", 0.4)
    dampers = damper(model, governing.limit, seed)
    stroke = dampers.stroke.high
    if bridge.damper.largest_stroke is None and dampers.dampers and stroke is not None and stroke > LONG_STROKE:
        remarks.append(
            f"mode {mode.name}: the stroke of the lightest damper is {stroke:.1f} m (95 %): "
            "state damper.largest_stroke for one that fits"
        )
    moves = abs(mode.shape.at(dampers.position))
    if dampers.dampers and moves < NEAR_NODE:
        remarks.append(
            f"mode {mode.name}: where the damper stands the mode moves {moves:.1%} of its largest, and its mass grows "
            "with the inverse square of that"
        )
    sized = ModeSizing(
        mode.name,
        _stated(mode.frequency),
        _stated(mode.damping_ratio),
        None if mode.mass is None else _stated(mode.mass),
        mode.modal_mass,
        mode.shape.name,
        {
            label: float(mode.shape.factor(float(np.median(model.laws.n[k]))))
            for k, label in enumerate(model.laws.labels)
        },
        spread(draws.scruton_number(0.0)),
        spread(draws.amplitude(0.0)),
        tuple(risks),
        governing.rule,
        parts,
        tuple(remarks),
        dampers,
    )
    if bridge.cost is None or not bridge.cost.failure > 0.0:
        return sized
    tell(f"mode {mode.name}: costs and value of information", 0.85)
    return replace(sized, cost=costs(model, governing, dampers, seed))


def _peak_range(tree: "xr.DataTree") -> tuple[float, float]:
    """Reduced velocities of the peak tests, widened."""
    data = tree["constant_data"].sel(test=list(peak_names(tree)))
    depth = float(data["depth"]) if "depth" in data else np.nan
    velocity = (data["wind_speed"] / (data["frequency"] * depth)).to_numpy()
    return float(velocity.min() * (1.0 - LOCK_IN_MARGIN)), float(velocity.max() * (1.0 + LOCK_IN_MARGIN))


def _stated(value: Quantity) -> Stated:
    return Stated(value.mean, value.sd or 0.0, "known" if value.certain else value.family)
