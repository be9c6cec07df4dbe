"""Heaving and torsion of one bridge: a fit of each motion, and the risk that any of all its modes is too large."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from scruton.campaign.schema import Motion
from scruton.errors import InputError
from scruton.sizing.bridge import Bridge
from scruton.sizing.damper_request import RiskOf
from scruton.sizing.limits import Limit
from scruton.sizing.model import ModeModel, Spread
from scruton.sizing.modes import BothMotions, damped_modes, exceedance, with_required
from scruton.sizing.results import ModeSizing, Sizing
from scruton.sizing.study import built_on, mode_models, size, unsized, untrusted, with_table
from scruton.sizing.together import Placed, any_mode_flag, joint_draws, placed, sized_for_any

if TYPE_CHECKING:
    import xarray as xr


def size_both(
    fits: "Sequence[tuple[xr.DataTree, Bridge]]", limits: Sequence[Limit] = (), **options: Any
) -> tuple[Sizing, Sizing]:
    """Size the modes of both motions of one bridge.

    Parameters
    ----------
    fits : two (DataTree, Bridge)
        A fit of each motion, and the bridge as `load_bridge` reads it for that motion.
    limits : sequence of Limit
        Beside those that the bridge names; each for the motions that it speaks of.
    **options
        As of `scruton.sizing.study.size`.

    Returns
    -------
    sizings : (Sizing, Sizing)
        In the order of the fits; both carry the union, `Sizing.both`.

    Notes
    -----
    The two sections were tested apart, so their posteriors, laws and discrepancies are independent.  The site, and how
    coherent the force is along the span, are those of one bridge.  Dampers against heaving hang on the axis of the
    deck, where torsion does not move them; those against torsion stand off it and move with heaving, too.
    `risk_of = "any"` lowers the risk of every mode until that of any mode of either motion is kept.

    Raises
    ------
    InputError
        As of `size`; for two fits of one motion.
    """
    (_, first), (_, second) = fits
    if first.motion is second.motion:
        wanted = "a heaving and a torsional fit"
        raise InputError("command line", "--other", f"another fit of a {first.motion.value} section", wanted)
    if {mode.name for mode in first.modes} & {mode.name for mode in second.modes}:
        wanted = 'motion = "heaving" or "torsional" in each, and modes of both'
        raise InputError("bridge.toml", "modes", "modes of no stated motion", wanted)
    sizings = [
        size(tree, bridge, [rule for rule in limits if bridge.motion in rule.rule.functions], **options)
        for tree, bridge in fits
    ]
    seed, given = options.get("seed", 0), {key: options.get(key) for key in ("rig", "law_n")}
    models = [mode_models(built_on(tree), bridge, **given) for tree, bridge in fits]
    every = [model for those in models for model in those]
    limits_met = [mode.governing_limit.limit for sizing in sizings for mode in sizing.modes]
    if first.damper.risk_of is RiskOf.ANY and not any(untrusted(tree) for tree, _ in fits):
        dampers = [mode.damper for sizing in sizings for mode in sizing.modes]
        found = iter(sized_for_any(every, limits_met, dampers, seed, options.get("progress") or (lambda *_: None)))
        sizings = [
            replace(
                sizing,
                modes=tuple(
                    with_table(model, replace(mode, damper=next(found)), seed)
                    for model, mode in zip(those, sizing.modes, strict=True)
                ),
            )
            for those, sizing in zip(models, sizings, strict=True)
        ]
    modes = [mode for sizing in sizings for mode in sizing.modes]
    hung = placed([mode.damper for mode in modes], every)
    together = union(every, modes, hung, seed)
    flag = any_mode_flag(together.with_dampers, first.damper)
    done = []
    for (_, bridge), sizing, those in zip(fits, sizings, models, strict=True):
        without = unsized(bridge)  # the other motion's modes are here
        said = (*(one for one in sizing.flags if one not in without), *([flag] if flag else []))
        done.append(replace(_with_all(sizing, those, hung, seed), both=together, flags=said))
    return done[0], done[1]


def union(
    models: Sequence[ModeModel], modes: Sequence[ModeSizing], dampers: Sequence[Placed], seed: int
) -> BothMotions:
    """Risk of any mode, each in its own lock-in: as it is, with the damping required at 95 %, with all dampers."""
    limits = [mode.governing_limit.limit for mode in modes]
    draws = joint_draws(models, seed)
    arms = [1.0 if model.bridge.motion is Motion.HEAVING else 0.5 * model.bridge.width for model in models]
    return BothMotions(
        tuple(mode.name for mode in modes), tuple(model.bridge.motion.value for model in models),
        tuple(_at(mode.amplitude, arm) for mode, arm in zip(modes, arms, strict=True)),
        exceedance(draws, limits, [0.0] * len(modes)),
        with_required(draws, limits, [mode.governing_limit for mode in modes]),
        damped_modes(models, limits, dampers, seed)[0],
    )  # fmt: skip


def _at(angle: Spread, arm: float) -> Spread:
    low, high = (None if end is None else arm * end for end in (angle.low, angle.high))
    return Spread(arm * angle.median, low, high)


def _with_all(sizing: Sizing, models: Sequence[ModeModel], dampers: Sequence[Placed], seed: int) -> Sizing:
    """The modes of one motion with the dampers of both."""
    left, added = damped_modes(models, [mode.governing_limit.limit for mode in sizing.modes], dampers, seed)
    return replace(sizing, all_modes=replace(sizing.all_modes, with_dampers=left, added_by_dampers=added))
