"""Parts of a sizing: a fit, and what is found in its light of the modes of a bridge that are of its motion."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from scruton.campaign.plausibility import damping_flag
from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.errors import InputError
from scruton.griffin.curves import law_curves, what_if
from scruton.griffin.discrepancy import one_rig, with_discrepancy
from scruton.griffin.posterior import chosen_rig, motion_of, rig_mass_damping_draws
from scruton.griffin.remarks import prior_speaks, unsettled_laws
from scruton.infer.joint import curve_remark, doubted_remark, unconverged
from scruton.infer.results import TRIAL
from scruton.progress import Progress
from scruton.said import key, said
from scruton.sizing.bridge import Bridge
from scruton.sizing.checks import ASKED, Evidence, from_nearest_test
from scruton.sizing.damper_request import RiskOf
from scruton.sizing.damper_table import damper_table
from scruton.sizing.dampers import damper, struck_flag, withheld
from scruton.sizing.existing import Offer, existing
from scruton.sizing.governing import governing, outside
from scruton.sizing.hours import assumed_remarks, lock_in_shape
from scruton.sizing.inputs import inputs_of
from scruton.sizing.limits import Limit
from scruton.sizing.model import ModeModel, spread, unit_cube
from scruton.sizing.modes import AllModes, BothMotions, all_modes
from scruton.sizing.money import costs
from scruton.sizing.plausibility import odd_input
from scruton.sizing.remarks import (
    any_mode_remarks,
    coherence_remarks,
    cost_remarks,
    farther_limits,
    mode_factors,
    stroke_remark,
    worst_remark,
)
from scruton.sizing.results import ModeSizing, SizedBridge, Sizing, Stated, StatedTransfer
from scruton.sizing.risk import flags, remarks, risk, shares
from scruton.sizing.thresholds import AT_NODE, LEAST_EXPONENT, NEAR_NODE, ONE_RIG
from scruton.sizing.together import Placed, sized_for_any
from scruton.sizing.transfer import transfer_remarks

if TYPE_CHECKING:
    import xarray as xr

SPREAD_DRAWS = 1 << 12


@dataclass(frozen=True, eq=False)
class Part:
    """A fit, and the modes of a bridge that are of its motion.

    Attributes
    ----------
    fit : DataTree
        That the decision is built on, as of `built_on`.
    rules : tuple of Limit
        Of the bridge, and beside it.
    models, modes : tuple
        Of every mode: in the light of the fit, and as it was sized, once it was.
    unconverged, said : tuple of str
        Posteriors that did not converge, as of `untrusted`, and what has to be said of the fit.
    law_n : float or None
        The one law that it is sized under, if it is one alone.
    """

    fit: "xr.DataTree"
    bridge: Bridge
    rules: tuple[Limit, ...]
    models: tuple[ModeModel, ...]
    unconverged: tuple[str, ...]
    said: tuple[str, ...]
    modes: tuple[ModeSizing, ...] = ()
    law_n: float | None = None

    @property
    def limits_met(self) -> list[float]:
        """Of every mode the limit that governs it."""
        return [mode.governing_limit.limit for mode in self.modes]


def part_of(
    tree: "xr.DataTree", bridge: Bridge, limits: Sequence[Limit], *, rig: str | None = None, law_n: float | None = None
) -> Part:
    """Check what is to be sized, arguments and errors as of `scruton.sizing.size.size`."""
    if law_n is not None and not (np.isfinite(law_n) and law_n >= LEAST_EXPONENT):
        raise InputError("sizing", "law", f"{law_n:g}", f"a finite exponent from {LEAST_EXPONENT:g} on")
    rules = tuple({rule.text: rule for rule in (*bridge.limits, *limits)}.values())
    if not rules:
        raise InputError("sizing", "limits", "no limit", 'at least one, such as --limit jtg or limits = ["jtg"]')
    if bridge.motion is not motion_of(tree):
        raise InputError("bridge", "motion", bridge.motion.value, f"{motion_of(tree).value}, that of the section model")
    said = (*prior_speaks(tree), *curve_remark(tree), *doubted_remark(tree))
    tree = built_on(tree)
    laws = law_curves(tree, law_n=law_n)
    said += unsettled_laws(tree, dict(zip(laws.labels, laws.weights.tolist(), strict=True)))
    factor = rig_mass_damping_draws(tree, chosen_rig(tree, rig))
    models = tuple(ModeModel(laws, factor, bridge, mode) for mode in bridge.modes)
    for model in models:
        if nodes := [x for x in model.damper_positions if not abs(model.mode.shape.at(x)) > AT_NODE]:
            raise InputError(
                "bridge.toml", "damper.position", f"{nodes[0]:g}, a node of mode {model.mode.name}",
                "a place where every mode moves; left out, each mode's dampers stand where it is largest",
            )  # fmt: skip
    asked = what_if(tree, law_n)
    remarks = [*aside(tree), *asked, *said]
    if law_n is not None and asked:
        models = tuple(from_nearest_test(tree, law_n, model, rules) for model in models)
    if law_n is not None and "effect" in tree:
        remarks.append(f"the fit carries {tree['effect'].attrs['effect']}; under one law alone it is left out")
    return Part(tree, bridge, rules, models, tuple(untrusted(tree)), tuple(remarks), law_n=law_n)


def modes_sized(parts: Sequence[Part], seed: int, progress: Progress | None = None) -> list[Part]:
    """Size every mode of these parts of one bridge, and its dampers: for the mode alone, or for any of all modes."""
    modes: list[ModeSizing] = []
    models = [model for part in parts for model in part.models]

    def tell(what: str, done: float) -> None:
        if progress:
            progress(what, (len(modes) + done) / (len(models) + 1))

    for part in parts:
        evidence = Evidence.of(part.fit, part.law_n)
        for model in part.models:
            modes.append(_mode(model, part.rules, evidence, part.unconverged, seed, tell))
    if models[0].bridge.damper.risk_of is RiskOf.ANY and len(modes) > 1 and not any(one.unconverged for one in parts):
        limits = [mode.governing_limit.limit for mode in modes]
        together = sized_for_any(models, limits, [mode.damper for mode in modes], seed, tell)
        modes = [replace(mode, damper=one) for mode, one in zip(modes, together, strict=True)]
    told = iter([_with_damper_told(model, mode, seed) for model, mode in zip(models, modes, strict=True)])
    if progress:
        progress("done", 1.0)
    return [replace(part, modes=tuple(next(told) for _ in part.models)) for part in parts]


def sizing_of(part: Part, dampers: Sequence[Placed] | None, offers: Sequence[Offer], seed: int) -> Sizing:
    """What was found of one part, with all dampers of the bridge, and with each of the offers, as of `hung`.

    Without dampers, None, none may be specified: then none is judged either.
    """
    bridge, models, modes = part.bridge, part.models, part.modes
    doubt = [not_trusted(part.unconverged)] if part.unconverged else []
    remarks = [*doubt, *odd_input(bridge, part.rules), *(flag for mode in modes for flag in mode.flags), *part.said]
    remarks += transfer_remarks(bridge.transfer, bridge.width, bridge.depth, bridge.motion)
    remarks += cost_remarks(bridge)
    shapes = [
        lock_in_shape(part.fit, model.mode, mode.scruton_number.median, seed)
        for model, mode in zip(models if bridge.wind else (), modes, strict=False)
    ]
    remarks += assumed_remarks([mode.name for mode in modes], shapes)
    together = all_modes(models, [mode.governing_limit for mode in modes], dampers, shapes, seed)
    described = SizedBridge(
        bridge.title, bridge.motion.value, bridge.width, bridge.depth, bridge.air_density, _stated(bridge.coherence),
        None if bridge.coherence_amplitude is None else _stated(bridge.coherence_amplitude), _stated_transfer(bridge),
    )  # fmt: skip
    laws = models[0].laws
    return Sizing(
        1, described, "m" if bridge.motion is Motion.HEAVING else "rad",
        dict(zip(laws.labels, laws.weights.tolist(), strict=True)), modes, together, tuple(remarks),
        existing=None if dampers is None else existing(models, part.limits_met, offers, seed) or None,
        inputs=inputs_of(bridge, tuple(rule.text for rule in part.rules)), unconverged=part.unconverged,
    )  # fmt: skip


def _with_damper_told(model: ModeModel, mode: ModeSizing, seed: int) -> ModeSizing:
    """A mode with what its dampers leave about their design, and what has to be said of them."""
    said, dampers = [*struck_flag(mode.name, mode.damper), *worst_remark(mode.name, mode.damper)], mode.damper.dampers
    said += stroke_remark(mode.name, mode.damper)
    moves = min(abs(model.mode.shape.at(position)) for position in model.damper_positions)
    if dampers and moves < NEAR_NODE:
        said.append(
            f"mode {mode.name}: where the damper stands the mode moves {moves:.1%} of its largest, and its mass grows "
            "with the inverse square of that"
        )
    table = damper_table(model, mode.governing_limit.limit, dampers, seed)
    return replace(mode, damper_table=table, flags=(*mode.flags, *said))


def of_any_mode(
    every: AllModes | BothMotions, dampers: Sequence[Placed] | None, models: Sequence[ModeModel]
) -> list[str]:
    """What has to be said of the risk of any of several modes, with these dampers."""
    weighed = all(model.mode.modal_mass is not None for model in models)
    return [*any_mode_remarks(every, models[0].bridge.damper, damped=bool(dampers), weighed=weighed)]


def built_on(tree: "xr.DataTree") -> "xr.DataTree":
    """The fit that a decision is built on: from one rig, which says nothing of how far rigs miss, with `ONE_RIG`."""
    return with_discrepancy(tree, ONE_RIG) if one_rig(tree) else tree


def untrusted(tree: "xr.DataTree") -> list[str]:
    """Posteriors that a sizing rests on and that did not converge: nothing rests on trial functions."""
    return [name for name in unconverged(tree) if not name.startswith(TRIAL)]


def aside(tree: "xr.DataTree") -> list[str]:
    """What has to be said of posteriors that did not converge, and that no sizing rests on."""
    records = [name.removeprefix(TRIAL).strip() for name in unconverged(tree) if name.startswith(TRIAL)]
    if not records:
        return []
    return [f"{TRIAL} {', '.join(records)} did not converge; nothing of the sizing rests on that"]


def not_trusted(names: Sequence[str]) -> str:
    """Why nothing is to be decided where these posteriors did not converge, and what would mend it."""
    return said(
        f"the fit is not to be trusted, and nothing to be decided on these numbers: {', '.join(names)} did not "
        "converge. No damper is specified, none is judged and nothing is priced. Look at `scruton criticise`; mend or "
        "leave out the record that it names, or ", key("raise max_steps in the model card", "let it sample for longer"),
        ", and fit again",
    )  # fmt: skip


def _mode(
    model: ModeModel, rules: Sequence[Limit], evidence: Evidence, failed: Sequence[str], seed: int, tell: Progress
) -> ModeSizing:
    mode, bridge, risks = model.mode, model.bridge, []
    for i, rule in enumerate(rules):
        tell(f"mode {mode.name}: risk against {rule.rule.name}", 0.3 * i / len(rules))
        risks.append(risk(model, rule, seed=seed, evidence=evidence))
    deciding = governing(risks)
    tell(f"mode {mode.name}: shares of variance", 0.3)
    parts = shares(model, deciding.limit, added=deciding.required[ASKED] or 0.0, seed=seed)
    u = unit_cube(SPREAD_DRAWS, seed + 4)
    draws = model.draws(u)
    remarked = [*flags(model, draws), *outside(mode.name, risks)]
    remarked += remarks(mode.name, ASKED, deciding, coherent=bridge.coherence_amplitude is None)
    remarked += farther_limits(mode.name, deciding, risks)
    remarked += coherence_remarks(model, deciding, seed)
    if flag := damping_flag(mode.damping_ratio.mean):
        remarked.append(said(f"mode {mode.name}: ", flag))
    tell(f"mode {mode.name}: tuned mass damper", 0.4)
    if failed:
        dampers = withheld(model, f"none is specified, since {', '.join(failed)} did not converge")
    else:
        dampers = damper(model, deciding.limit, seed)
    cost = None
    if bridge.cost is not None and bridge.cost.failure > 0.0 and not failed:
        tell(f"mode {mode.name}: costs and value of information", 0.85)
        cost = costs(model, deciding, dampers, seed)
    return ModeSizing(
        mode.name, _stated(mode.frequency), _stated(mode.damping_ratio),
        None if mode.mass is None else _stated(mode.mass), mode.modal_mass, mode.shape.name,
        mode_factors(model, draws), spread(draws.scruton_number(0.0), u),
        spread(draws.amplitude(0.0), u), tuple(risks), deciding.rule, parts, tuple(remarked), dampers, cost,
        deciding.required_by_law, model.scruton_number_at_means,
    )  # fmt: skip


def _stated_transfer(bridge: Bridge) -> StatedTransfer | None:
    transfer = bridge.transfer
    if transfer is None:
        return None
    heaving = bridge.motion is Motion.HEAVING
    return StatedTransfer(
        _stated(transfer.turbulence), _stated(transfer.reynolds_number), _stated(transfer.details), transfer.assumed,
        transfer.turbulence_intensity,
        transfer.handbook(bridge.width, bridge.depth) if heaving else None,
    )  # fmt: skip


def _stated(value: Quantity) -> Stated:
    return Stated(value.mean, value.sd or 0.0, "known" if value.certain else value.family)
