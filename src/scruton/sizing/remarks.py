"""What has to be said of a sizing beside its numbers, and how much larger than the section's a mode's amplitude is."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from scruton.said import damping, key, listed, said
from scruton.sizing.bridge import Bridge
from scruton.sizing.checks import ASKED
from scruton.sizing.damper_request import DamperRequest, RiskOf
from scruton.sizing.dampers import Damper
from scruton.sizing.governing import named
from scruton.sizing.mode_shape import uniform
from scruton.sizing.model import Draws, ModeModel, unit_cube
from scruton.sizing.modes import AllModes, BothMotions
from scruton.sizing.risk import Risk, lies, percent
from scruton.sizing.span import EffectOnSpan, effect_on_span
from scruton.sizing.thresholds import LARGEST_ADDED, RISK_MARGIN, STROKE_TOLERANCE
from scruton.sizing.together import FOR_ANY, POINTS, any_mode_flag

_POINTS = 1 << 12


def mode_factors(model: ModeModel, draws: Draws) -> dict[str, float]:
    """Amplitude of the mode over that of the section, by law, with full coherence along the span.

    With an effect in the curve, which has no one factor: the median over the draws at the bridge's own damping.
    """
    laws, shape = model.laws, model.mode.shape
    if laws.effect is None:
        factors = [float(shape.factor(float(np.median(n)))) for n in laws.n]
        return dict(zip(laws.labels, factors, strict=True))
    sc, mode, section = (
        draws.scruton_number(np.zeros((1, 1))),
        EffectOnSpan(effect_on_span(laws.effect, shape, driven=True), draws.row),
        EffectOnSpan(effect_on_span(laws.effect, uniform(), driven=True), draws.row),
    )
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = mode.amplitude(sc) / section.amplitude(sc)
    known = ratio[np.isfinite(ratio)]
    return {laws.labels[0]: float(shape.factor(-1.0) * np.median(known)) if known.size else float("nan")}


def coherence_remarks(model: ModeModel, risk: Risk, seed: int) -> list[str]:
    """What coherence that is lost at small amplitude does to the damping that a limit needs."""
    lost_at = model.bridge.coherence_amplitude
    if lost_at is None:
        return []
    coherent = replace(model, bridge=replace(model.bridge, coherence_amplitude=None))
    needs = coherent.draws(unit_cube(_POINTS, seed)).needed(risk.limit)
    need = max(float(np.quantile(needs, 0.95, method="inverted_cdf")), 0.0)
    otherwise = [damping(need, ".3f")] if need <= LARGEST_ADDED else percent(None)
    required = risk.required[ASKED]
    asked = [*([damping(required, ".3f")] if required else percent(None)), " of added damping"]
    if required == 0.0:
        asked = ["no added damping"]
    below = model.bridge.motion.amplitude_text(lost_at.mean)
    remarks: list[str] = [
        said(
            f"mode {model.mode.name}: the force loses its coherence along the span below A_c = {below}, so that "
            f"{risk.rule} needs ",
            asked,
            f" with {100.0 * float(ASKED):.0f} % confidence, and ",
            otherwise,
            " were it coherent at every amplitude, as what is asked for without a law and by hand takes it to be: the "
            "difference rests on A_c, which no section model tells",
        )
    ]
    if model.laws.effect is not None:
        remarks.append(
            said(
                f"mode {model.mode.name}: the bridge's ",
                key("coherence_amplitude", "amplitude at which coherence is lost"),
                " replaces what the fit found of the coherence",
            )
        )
    return remarks


def farther_limits(name: str, deciding: Risk, risks: Sequence[Risk]) -> Iterator[str]:
    """A remark on every limit that does not govern, and whose damping lies far from what was tested."""
    for found in risks:
        reach, added = found.reach.get(ASKED), found.required[ASKED]
        far = reach is not None and not reach.trusted
        if found is not deciding and found.outside is None and added != 0.0 and reach is not None and far:
            yield said(
                f"mode {name}: what ", named(found),
                f", which does not govern, requires at {100.0 * float(ASKED):.0f} % (",
                percent(added), *lies(")", reach, added, f"; transients of {reach.covered_by} of {reach.tests} tests "
                                       "went through its amplitude"),
            )  # fmt: skip


def stroke_remark(name: str, found: Damper) -> list[str]:
    """What has to be said where a detuning at which the risk is kept takes the stroke beyond what is asked for."""
    largest, kept = found.asked.largest_stroke, found.asked.kept_detuning or 0.0
    reached = max((each.stroke_high for each in found.detuned if abs(each.detuning) <= kept), default=0.0)
    if largest is None or not found.dampers or not found.achievable or reached <= (1.0 + STROKE_TOLERANCE) * largest:
        return []
    return [
        f"mode {name}: the stroke of the dampers is below {largest:.3g} m with 95 % confidence at the stated "
        f"frequency, and reaches {reached:.3g} m where that is off by {100.0 * kept:g} %, at which only the risk is "
        f"kept: either leave room for that, or ask for a largest stroke of {0.99 * largest**2 / reached:.2g} m, which "
        "takes heavier dampers"
    ]


def worst_remark(name: str, found: Damper) -> list[str]:
    """What has to be said where vibrations that only a start from above leads to break the risk that is asked for."""
    worst, asked = found.probability_worst, found.asked.risk
    if worst is None or not worst > max(asked, found.probability):
        return []
    return [
        f"mode {name}: the risk with the dampers is {found.probability:.1%} for a vibration that grows, but "
        f"{worst:.1%} where those count that only a start from above leads to, and {asked:.1%} is asked: where "
        "something else than lock-in may start one, ask for less risk"
    ]


def any_mode_remarks(
    every: AllModes | BothMotions, request: DamperRequest, *, damped: bool, weighed: bool
) -> Iterator[str]:
    """What has to be said of the risk of any of several modes.

    Parameters
    ----------
    damped : bool
        Whether there are dampers to judge.
    weighed : bool
        Whether the modal mass of every mode is stated.
    """
    needed, confidence = every.required_for_any, float(ASKED)
    if needed is None:
        return
    left, most = every.with_required_damping, 1.0 - confidence
    keeping = listed([*percent(added), f" ({name})"] for name, added in zip(every.names, needed.required, strict=True))
    if request.risk_of is RiskOf.ANY:
        for name, added, reach in zip(every.names, needed.required, needed.reach, strict=True):
            if added != 0.0 and reach is not None and not reach.trusted:
                yield said(
                    f"mode {name}: the damping that keeps the risk of any mode (", percent(added),
                    *lies(")", reach, added, f"; transients of {reach.covered_by} of {reach.tests} tests went through "
                                             "the amplitude of the limit"),
                )  # fmt: skip
    elif left is not None and left.any > most + RISK_MARGIN * float(np.sqrt(most * confidence / POINTS)):
        yield said(
            f"with the damping that each mode requires at {100.0 * confidence:.0f} % the risk of any mode is "
            f"{left.any:.1%}; one of {needed.risk:.1%} takes ", keeping, ": ", FOR_ANY, " asks for that",
        )  # fmt: skip
    if every.with_dampers is not None and damped and (flag := any_mode_flag(every.names, every.with_dampers, request)):
        yield flag
    if damped and not weighed:
        yield said(
            "what the dampers of one mode do to another, and the risk of any mode with them, is not known: a modal "
            "mass is not stated", key(" (modal_mass, or mass and length)", ""),
        )  # fmt: skip


def cost_remarks(bridge: Bridge) -> list[str]:
    """What is missing from the costs that were stated, or has no meaning among them."""
    if (cost := bridge.cost) is None:
        return []
    if not cost.failure > 0.0:
        failure = key("cost.failure", "what exceeding the limit costs")
        return [said(failure, " is not stated: there is no expected cost without it")]
    remarks: list[str] = []
    if not cost.per_percent > 0.0:
        per_percent = key("cost.per_percent", "what a percentage point of damping costs")
        remarks.append(said(per_percent, " is not stated: without it damping has no cost, and information no value"))
    if cost.per_kg > 0.0 and any(mode.modal_mass is None for mode in bridge.modes):
        per_kg = key("cost.per_kg", "what a kilogram of damper costs")
        remarks.append(said(per_kg, " has no meaning for a mode without a modal mass: state its mass and length"))
    return remarks


def unsized(bridge: Bridge) -> list[str]:
    """What has to be said of modes of the other motion."""
    if not bridge.others:
        return []
    names = ", ".join(bridge.others)
    return [
        said(
            f"modes of the other motion are not among these: {names}. ",
            key("`scruton size` takes their fit as --other, and a", "A sizing of both fits together, and the"),
            " report of its results has the modes of both",
        )
    ]
