"""`size`: from the fits of a bridge's motions to everything that `scruton size` finds, and what sizing.json holds."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.campaign.schema import Motion
from scruton.errors import InputError
from scruton.infer.store import provenance_of
from scruton.progress import Progress
from scruton.provenance import provenance
from scruton.said import parts_of, said
from scruton.sizing.bridge import Bridge
from scruton.sizing.checks import ASKED
from scruton.sizing.existing import Offer, existing, hung
from scruton.sizing.limits import Limit
from scruton.sizing.model import ModeModel, Spread
from scruton.sizing.modes import BothMotions, damped_modes, exceedance, required_for_any, with_required
from scruton.sizing.remarks import unsized
from scruton.sizing.results import ModeSizing, Sizing
from scruton.sizing.study import modes_sized, not_trusted, of_any_mode, part_of, sizing_of
from scruton.sizing.together import Placed, joint_draws, placed

if TYPE_CHECKING:
    import xarray as xr

# What may be asked for beside a bridge, and what it is where it is not.
ASKED_FOR: Mapping[str, Any] = {
    "law": None, "effect": None, "rig": None, "damping": None, "limits": [], "dampers": [], "identified": [],
}  # fmt: skip


def check_other(other: Path | None, bridge: Path | None, where: str, dashes: str = "") -> None:
    """Raise InputError for a fit of the other motion without a bridge; `where` they are asked for, with `dashes`."""
    if other is not None and bridge is None:
        wanted = f"{dashes}bridge: the bridge.toml with modes of both motions"
        raise InputError(where, f"{dashes}other", "no bridge", wanted)


def sizing_origin(
    folder: Path, summary: Mapping[str, Any], bridge: Bridge, *, seed: int, settings: Mapping[str, Any]
) -> dict[str, Any]:
    """What a sizing was made from: the fit in a folder with all that it was made from, and the bridge."""
    fit, fitted = provenance_of(folder, summary), summary["provenance"]
    return {
        **provenance(
            "size", seed=seed, sha256={**fitted["sha256"], **fit, **bridge.sha256}, settings=settings,
            card={key: fitted["card"][key] for key in ("name", "sha256")},
        ),
        "fit_sha256": fit, "bridge_sha256": dict(bridge.sha256), "limits": list(settings["limits"]),
    }  # fmt: skip


def sized(
    folders: Sequence[Path],
    fits: "Sequence[tuple[xr.DataTree, Mapping[str, Any]]]",
    bridges: Sequence[Bridge],
    limits: Sequence[Limit],
    *,
    asked: Mapping[str, Any] | None = None,
    **options: Any,
) -> list[dict[str, Any]]:
    """The content of the sizing.json of every fit, the same whichever verb writes them.

    Parameters
    ----------
    folders : sequence of Path
        That the fits lie in.
    fits : sequence of (DataTree, mapping)
        As `scruton.infer.store.read_tree` gives them.
    bridges : sequence of Bridge
        As it is read for the motion of each fit.
    limits, **options
        As of `size`.
    asked : mapping, optional
        What else was asked for, by the names of `ASKED_FOR`.
    """
    trees = [(tree, bridge) for (tree, _), bridge in zip(fits, bridges, strict=True)]
    sizings = size(trees, limits, **options)
    settings, seed = {**ASKED_FOR, **(asked or {})}, int(options.get("seed", 0))
    contents = []
    for folder, (_, summary), bridge, sizing in zip(folders, fits, bridges, sizings, strict=True):
        content = sizing.to_json()
        if not bridge.documents:
            content["flags"].append("no bridge was given: the answer is for the section model itself, at its own size")
        if parts := parts_of(sizing.flags):
            content["flag_parts"] = parts
        if conventions := dict(summary.get("conventions", {})):
            if bridge.motion is Motion.HEAVING and "scruton_factor" in conventions:
                conventions["scruton_factor"] = bridge.width / bridge.depth
            content["conventions"] = conventions
        origin = sizing_origin(folder, summary, bridge, seed=seed, settings=settings)
        content["provenance"] = origin | {key: settings[key] for key in ("law", "effect")}
        contents.append(content)
    return contents


def size(
    fits: "Sequence[tuple[xr.DataTree, Bridge]]",
    limits: Sequence[Limit] = (),
    *,
    rig: str | None = None,
    law_n: float | None = None,
    seed: int = 0,
    progress: Progress | None = None,
    offers: Sequence[Offer] = (),
) -> tuple[Sizing, ...]:
    """Size the damping of a bridge from the posterior of its section model, or from those of both its motions.

    Parameters
    ----------
    fits : sequence of (DataTree, Bridge)
        A fit with tests in wind, or one of each motion, and the bridge as `load_bridge` reads it for that motion.
    limits : sequence of Limit
        Beside those that the bridge names; of both motions, each for those that it speaks of.
    rig : str, optional
        Whose mass ratio a mode without a mass has; the first in wind if left out.
    law_n : float, optional
        One law alone.
    progress : callable, optional
        Told what is being done and the fraction done.
    offers : sequence of Offer
        Dampers that are there or on offer: the risk with each, which acts on the modes of both motions.

    Returns
    -------
    sizings : tuple of Sizing
        In the order of the fits; of both motions, each carries the union, `Sizing.both`.

    Notes
    -----
    From one rig the discrepancy between settings is taken to be `ONE_RIG`: the card's prior, which is what such a fit
    has, breaks the promise of 95 % in 4 % of bridges where rigs miss the curve by 10 %, and in 17 % where they miss
    it by twice as much.

    The sections of two motions were tested apart, so their posteriors, laws and discrepancies are independent.  The
    site, and how coherent the force is along the span, are those of one bridge.  Dampers against heaving hang on the
    axis of the deck, where torsion does not move them; those against torsion stand off it and move with heaving, too.
    `risk_of = "any"` lowers the risk of every mode until that of any mode of either motion is kept.

    Raises
    ------
    InputError
        Without a limit; where a limit says nothing of this motion; where the bridge's motion is not the section's; for
        two fits of one motion.
    """
    several = len(fits) > 1
    if several:
        _check_motions(*(bridge for _, bridge in fits))
    parts = []
    for tree, bridge in fits:
        rules = [rule for rule in limits if not several or bridge.motion in rule.rule.functions]
        parts.append(part_of(tree, bridge, rules, rig=rig, law_n=law_n))
    models = [model for part in parts for model in part.models]
    offers = hung(models, offers)
    parts = modes_sized(parts, seed, progress)
    modes = [mode for part in parts for mode in part.modes]
    trusted = tuple(not part.unconverged for part in parts for _ in part.models)
    dampers = placed([mode.damper for mode in modes], models) if all(trusted) else None
    together = replace(union(models, modes, dampers, offers, seed), trusted=trusted) if several else None
    sizings = []
    for part in parts:
        sizing = sizing_of(part, dampers, offers, seed)
        across = [one for one in parts if one is not part and one.unconverged]
        doubt = [said(f"{one.bridge.motion.value}: ", not_trusted(one.unconverged)) for one in across]
        left_out = [] if several else unsized(part.bridge)
        of_any = of_any_mode(together or sizing.all_modes, dampers, models)
        sizings.append(replace(sizing, both=together, flags=(*doubt, *sizing.flags, *left_out, *of_any)))
    return tuple(sizings)


def _check_motions(first: Bridge, second: Bridge) -> None:
    """Raise InputError where two fits are of one motion, or the bridge does not say which modes are of which."""
    if first.motion is second.motion:
        wanted = "a heaving and a torsional fit"
        raise InputError("command line", "--other", f"another fit of a {first.motion.value} section", wanted)
    if {mode.name for mode in first.modes} & {mode.name for mode in second.modes}:
        wanted = 'motion = "heaving" or "torsional" in each, and modes of both'
        raise InputError("bridge.toml", "modes", "modes of no stated motion", wanted)


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
