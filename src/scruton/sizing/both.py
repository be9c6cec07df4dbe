"""Heaving and torsion of one bridge: a fit of each motion, and the risk that any of all its modes is too large."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.campaign.schema import Motion
from scruton.errors import InputError
from scruton.progress import Progress
from scruton.said import said as sentence
from scruton.sizing.bridge import Bridge
from scruton.sizing.checks import ASKED
from scruton.sizing.existing import Offer, existing, hung
from scruton.sizing.limits import Limit
from scruton.sizing.model import ModeModel, Spread
from scruton.sizing.modes import BothMotions, damped_modes, exceedance, required_for_any, with_required
from scruton.sizing.results import ModeSizing, Sizing
from scruton.sizing.study import described, modes_sized, not_trusted, of_any_mode, part_of, sizing_of
from scruton.sizing.together import Placed, joint_draws, placed

if TYPE_CHECKING:
    import xarray as xr


def check_other(other: Path | None, bridge: Path | None, where: str, dashes: str = "") -> None:
    """Raise InputError for a fit of the other motion without a bridge; `where` they are asked for, with `dashes`."""
    if other is not None and bridge is None:
        wanted = f"{dashes}bridge: the bridge.toml with modes of both motions"
        raise InputError(where, f"{dashes}other", "no bridge", wanted)


def sized_both(
    folders: Sequence[Path],
    fits: "Sequence[tuple[xr.DataTree, Mapping[str, Any]]]",
    bridges: Sequence[Bridge],
    limits: Sequence[Limit],
    *,
    asked: Mapping[str, Any] | None = None,
    **options: Any,
) -> list[dict[str, Any]]:
    """The contents of both sizing.json, the same whichever verb writes them.

    Parameters
    ----------
    folders, fits, bridges
        Of each motion, as of `scruton.sizing.study.sized`.
    limits, **options
        As of `size_both`.
    asked : mapping, optional
        As of `scruton.sizing.study.sized`.
    """
    trees = [(tree, bridge) for (tree, _), bridge in zip(fits, bridges, strict=True)]
    sizings, seed = size_both(trees, limits, **options), int(options.get("seed", 0))
    return [
        described(folder, summary, bridge, sizing, asked, seed=seed)
        for folder, (_, summary), bridge, sizing in zip(folders, fits, bridges, sizings, strict=True)
    ]


def size_both(
    fits: "Sequence[tuple[xr.DataTree, Bridge]]",
    limits: Sequence[Limit] = (),
    *,
    rig: str | None = None,
    law_n: float | None = None,
    seed: int = 0,
    progress: Progress | None = None,
    offers: Sequence[Offer] = (),
) -> tuple[Sizing, Sizing]:
    """Size the modes of both motions of one bridge.

    Parameters
    ----------
    fits : two (DataTree, Bridge)
        A fit of each motion, and the bridge as `load_bridge` reads it for that motion.
    limits : sequence of Limit
        Beside those that the bridge names; each for the motions that it speaks of.
    rig, law_n, progress
        As of `scruton.sizing.study.size`.
    offers : sequence of Offer
        Dampers that are there or on offer, each acting on the modes of both motions.

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
    parts = [
        part_of(
            tree, bridge, [rule for rule in limits if bridge.motion in rule.rule.functions], rig=rig, law_n=law_n
        )
        for tree, bridge in fits
    ]  # fmt: skip
    models = [model for part in parts for model in part.models]
    offers = hung(models, offers)
    parts = modes_sized(parts, seed, progress)
    modes = [mode for part in parts for mode in part.modes]
    trusted = [not part.unconverged for part in parts for _ in part.models]
    dampers = placed([mode.damper for mode in modes], models) if all(trusted) else None
    together = replace(union(models, modes, dampers, offers, seed), trusted=tuple(trusted))
    said = of_any_mode(together, dampers, models)
    sizings = []
    for part, across in zip(parts, reversed(parts), strict=True):
        sizing = sizing_of(part, dampers, offers, seed)
        doubt = (
            [sentence(f"{across.bridge.motion.value}: ", not_trusted(across.unconverged))] if across.unconverged else []
        )
        sizings.append(replace(sizing, both=together, flags=(*doubt, *sizing.flags, *said)))
    one, other = sizings
    return one, other


def union(
    models: Sequence[ModeModel],
    modes: Sequence[ModeSizing],
    dampers: Sequence[Placed] | None,
    offers: Sequence[Offer],
    seed: int,
) -> BothMotions:
    """Risk of any mode, each in its own lock-in: as it is, with the damping required at 95 %, with all dampers."""
    limits, risks = [mode.governing_limit.limit for mode in modes], [mode.governing_limit for mode in modes]
    draws, damped = joint_draws(models, seed), damped_modes(models, limits, dampers, seed)
    arms = [1.0 if model.bridge.motion is Motion.HEAVING else 0.5 * model.bridge.width for model in models]
    return BothMotions(
        tuple(mode.name for mode in modes), tuple(model.bridge.motion.value for model in models),
        tuple(_at(mode.amplitude, arm) for mode, arm in zip(modes, arms, strict=True)),
        exceedance(draws, limits, [0.0] * len(modes)),
        with_required(draws, limits, risks), None if damped is None else damped.left,
        None if dampers is None else existing(models, limits, offers, seed) or None,
        required=tuple(risk.required[ASKED] for risk in risks),
        reach=tuple(risk.reach.get(ASKED) for risk in risks),
        dampers=tuple(
            tuple(placed([mode.damper], [model])) if mode.damper.achievable else ()
            for mode, model in zip(modes, models, strict=True)
        ),
        required_for_any=required_for_any(draws, limits, models[0].bridge.damper.risk),
    )  # fmt: skip


def _at(angle: Spread, arm: float) -> Spread:
    low, high = (None if end is None else arm * end for end in (angle.low, angle.high))
    return Spread(arm * angle.median, low, high)
