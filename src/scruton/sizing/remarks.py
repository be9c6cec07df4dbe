"""What the way from the section to the bridge rests on: remarks, and how much larger a mode's amplitude comes out."""

from dataclasses import replace

import numpy as np

from scruton.sizing.mode_shape import uniform
from scruton.sizing.model import Draws, ModeModel, unit_cube
from scruton.sizing.risk import Risk
from scruton.sizing.span import EffectOnSpan, effect_on_span
from scruton.sizing.thresholds import LARGEST_ADDED

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
    otherwise = f"{100.0 * need:.3f} %" if need <= LARGEST_ADDED else f"more than {100.0 * LARGEST_ADDED:g} %"
    below = model.bridge.motion.amplitude_text(lost_at.mean)
    remarks = [
        f"mode {model.mode.name}: the force loses its coherence along the span below A_c = {below}, so that "
        f"{risk.rule} needs {risk.required_text['0.95']} of added damping with 95 % confidence, and "
        f"{otherwise} were it coherent at every amplitude: the difference rests on A_c, which no section model tells"
    ]
    if model.laws.effect is not None:
        remarks.append(
            f"mode {model.mode.name}: the bridge's coherence_amplitude replaces what the fit found of the coherence"
        )
    return remarks
