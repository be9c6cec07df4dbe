"""`size`: everything that `scruton size` finds, `Sizing`, to sizing.json and back."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.campaign.plausibility import damping_flag
from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.documents import as_json, from_json, read_document
from scruton.errors import InputError
from scruton.griffin.curves import law_curves, what_if
from scruton.griffin.posterior import chosen_rig, motion_of, peak_names, rig_mass_damping_draws
from scruton.griffin.predict import prior_speaks
from scruton.infer.store import provenance_of
from scruton.progress import Progress
from scruton.provenance import provenance
from scruton.sizing.bridge import Bridge
from scruton.sizing.damper_request import RiskOf
from scruton.sizing.dampers import Damper, damper
from scruton.sizing.existing import Existing, Offer, existing, hung
from scruton.sizing.limits import Limit
from scruton.sizing.model import ModeModel, Spread, spread, unit_cube
from scruton.sizing.modes import AllModes, all_modes
from scruton.sizing.money import Costs, costs
from scruton.sizing.risk import Risk, Share, flags, risk, shares
from scruton.sizing.thresholds import AT_NODE, LEAST_EXPONENT, LOCK_IN_MARGIN, NEAR_NODE
from scruton.sizing.together import any_mode_flag, placed, sized_for_any

if TYPE_CHECKING:
    import xarray as xr

RESULT = "sizing.json"
SPREAD_DRAWS = 1 << 12


@dataclass(frozen=True)
class Stated:
    """A number of the bridge as it was stated; its distribution is "known" where it is certain."""

    mean: float
    sd: float
    distribution: str


@dataclass(frozen=True)
class SizedBridge:
    """The bridge that the answer is for: title, motion, width and depth [m], air density [kg/m^3], coherence."""

    title: str
    motion: str
    width: float
    depth: float
    air_density: float
    coherence: Stated


@dataclass(frozen=True, eq=False)
class ModeSizing:
    """One mode of the bridge.

    Attributes
    ----------
    frequency, damping_ratio : Stated
        [Hz], and the structural damping ratio.
    mass : Stated or None
        [kg/m] or [kg m^2/m]; None: the mass ratio of the section model.
    modal_mass : float or None
        [kg] or [kg m^2].
    shape : str
        "sine", "uniform" or the file it was read from.
    mode_factor : mapping
        Amplitude of the mode over that of the section, by law.
    scruton_number, amplitude : Spread
        Without added damping; [m] or [rad].
    governing : str
        The rule of the smallest limit.
    shares : mapping
        Shares of variance by quantity ("needed", "amplitude"), the largest first.
    cost : Costs or None
        Where the bridge states what its failure costs.
    """

    name: str
    frequency: Stated
    damping_ratio: Stated
    mass: Stated | None
    modal_mass: float | None
    shape: str
    mode_factor: Mapping[str, float]
    scruton_number: Spread
    amplitude: Spread
    limits: tuple[Risk, ...]
    governing: str
    shares: Mapping[str, tuple[Share, ...]]
    flags: tuple[str, ...]
    damper: Damper
    cost: Costs | None = None

    @property
    def governing_limit(self) -> Risk:
        """The limit that decides: the smallest."""
        return next(risk for risk in self.limits if risk.rule == self.governing)


@dataclass(frozen=True, eq=False)
class Sizing:
    """The damping that a bridge needs, the dampers that give it, and the risk that they leave.

    Attributes
    ----------
    format : int
        Of sizing.json.
    amplitude_unit : {"m", "rad"}
    laws : mapping
        Weight of each law.
    flags : tuple of str
        What the reader must know before trusting the numbers.
    provenance : mapping or None
        Versions, seed and SHA-256 of what it rests on, where it was written.
    existing : tuple of Existing or None
        Dampers that were asked about.
    """

    format: int
    bridge: SizedBridge
    amplitude_unit: str
    laws: Mapping[str, float]
    modes: tuple[ModeSizing, ...]
    all_modes: AllModes
    flags: tuple[str, ...]
    provenance: Mapping[str, Any] | None = None
    existing: tuple[Existing, ...] | None = None

    def to_json(self) -> dict[str, Any]:
        """The content of sizing.json; numbers that do not exist are None."""
        content: dict[str, Any] = as_json(self)
        return content


def load_sizing(folder: Path | str) -> Sizing:
    """Read back what `scruton size` found from the folder that holds its sizing.json.

    Numbers that do not exist (an amplitude where none is stable) are NaN.

    Raises
    ------
    InputError
        If there is none, or it is not as it was written.
    """
    path, wanted = Path(folder) / RESULT, "a sizing that this version wrote"
    content = read_document(path, wanted, version=1)
    try:
        sizing: Sizing = from_json(Sizing, content)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(path, "", f"other content ({error})", wanted) from error
    return sizing


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


def size(
    tree: "xr.DataTree",
    bridge: Bridge,
    limits: Sequence[Limit] = (),
    *,
    rig: str | None = None,
    law_n: float | None = None,
    seed: int = 0,
    progress: Progress | None = None,
    offers: Sequence[Offer] = (),
) -> Sizing:
    """Size the damping of a bridge from the posterior of its section model.

    Parameters
    ----------
    tree : xarray.DataTree
        Of a fit with tests in wind.
    limits : sequence of Limit
        Beside those that the bridge names.
    rig : str, optional
        Whose mass ratio a mode without a mass has; the first in wind if left out.
    law_n : float, optional
        One law alone.
    progress : callable, optional
        Told what is being done and the fraction done.
    offers : sequence of Offer
        Dampers that are there or on offer: the risk with each.

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
    laws = law_curves(tree, law_n=law_n)
    factor = rig_mass_damping_draws(tree, chosen_rig(tree, rig))
    models = [ModeModel(laws, factor, bridge, mode) for mode in bridge.modes]
    for model in models:
        if nodes := [x for x in model.damper_positions if not abs(model.mode.shape.at(x)) > AT_NODE]:
            raise InputError(
                "bridge.toml", "damper.position", f"{nodes[0]:g}, a node of mode {model.mode.name}",
                "a place where every mode moves; left out, each mode's dampers stand where it is largest",
            )  # fmt: skip
    offers = hung(models, offers)
    modes: list[ModeSizing] = []

    def tell(what: str, done: float) -> None:
        if progress:
            progress(what, (len(modes) + done) / len(models))

    for model in models:
        modes.append(_mode(model, rules, seed, tell))
    limits_met = [mode.governing_limit.limit for mode in modes]
    if bridge.damper.risk_of is RiskOf.ANY and len(modes) > 1:
        sized = sized_for_any(models, limits_met, [mode.damper for mode in modes], seed, tell)
        modes = [replace(mode, damper=one) for mode, one in zip(modes, sized, strict=True)]
    remarks = [flag for mode in modes for flag in mode.flags]
    remarks += [*what_if(tree, law_n), *prior_speaks(tree)]
    if law_n is not None and "effect" in tree:
        remarks.append(f"the fit carries {tree['effect'].attrs['effect']}; under one law alone it is left out")
    if (cost := bridge.cost) is not None and not cost.failure > 0.0:
        remarks.append("cost.failure is not stated: there is no expected cost without it")
    elif cost is not None:
        if not cost.per_percent > 0.0:
            remarks.append("cost.per_percent is not stated: without it damping has no cost, and information no value")
        if cost.per_kg > 0.0 and any(mode.modal_mass is None for mode in bridge.modes):
            remarks.append("cost.per_kg has no meaning for a mode without a modal mass: state its mass and length")
    data = tree["constant_data"].sel(test=list(peak_names(tree)))
    depth = float(data["depth"]) if "depth" in data else np.nan
    tested = (data["wind_speed"] / (data["frequency"] * depth)).to_numpy()
    together = all_modes(
        models,
        [mode.governing_limit for mode in modes],
        placed([mode.damper for mode in modes]),
        (float(tested.min()) * (1.0 - LOCK_IN_MARGIN), float(tested.max()) * (1.0 + LOCK_IN_MARGIN)),
        seed,
    )
    if flag := any_mode_flag(together.with_dampers, bridge.damper):
        remarks.append(flag)
    if progress:
        progress("done", 1.0)
    described = SizedBridge(
        bridge.title, bridge.motion.value, bridge.width, bridge.depth, bridge.air_density, _stated(bridge.coherence)
    )
    return Sizing(
        1, described, "m" if bridge.motion is Motion.HEAVING else "rad",
        dict(zip(laws.labels, laws.weights.tolist(), strict=True)), tuple(modes), together, tuple(remarks),
        existing=existing(models, limits_met, offers, seed) or None,
    )  # fmt: skip


def _mode(model: ModeModel, rules: Sequence[Limit], seed: int, tell: Progress) -> ModeSizing:
    mode, bridge, risks = model.mode, model.bridge, []
    for i, rule in enumerate(rules):
        tell(f"mode {mode.name}: risk against {rule.rule.name}", 0.3 * i / len(rules))
        risks.append(risk(model, rule, seed=seed))
    governing = min(risks, key=lambda against: against.limit)
    tell(f"mode {mode.name}: shares of variance", 0.3)
    parts = shares(model, governing.limit, added=governing.required["0.95"] or 0.0, seed=seed)
    u = unit_cube(SPREAD_DRAWS, seed + 4)
    draws = model.draws(u)
    remarks = flags(model, draws)
    if flag := damping_flag(mode.damping_ratio.mean):
        remarks.append(f"mode {mode.name}: {flag}")
    tell(f"mode {mode.name}: tuned mass damper", 0.4)
    dampers = damper(model, governing.limit, seed)
    moves = min(abs(mode.shape.at(position)) for position in model.damper_positions)
    if dampers.dampers and moves < NEAR_NODE:
        remarks.append(
            f"mode {mode.name}: where the damper stands the mode moves {moves:.1%} of its largest, and its mass grows "
            "with the inverse square of that"
        )
    cost = None
    if bridge.cost is not None and bridge.cost.failure > 0.0:
        tell(f"mode {mode.name}: costs and value of information", 0.85)
        cost = costs(model, governing, dampers, seed)
    factors = [float(mode.shape.factor(float(np.median(n)))) for n in model.laws.n]
    return ModeSizing(
        mode.name, _stated(mode.frequency), _stated(mode.damping_ratio),
        None if mode.mass is None else _stated(mode.mass), mode.modal_mass, mode.shape.name,
        dict(zip(model.laws.labels, factors, strict=True)), spread(draws.scruton_number(0.0), u),
        spread(draws.amplitude(0.0), u), tuple(risks), governing.rule, parts, tuple(remarks), dampers, cost,
    )  # fmt: skip


def _stated(value: Quantity) -> Stated:
    return Stated(value.mean, value.sd or 0.0, "known" if value.certain else value.family)
