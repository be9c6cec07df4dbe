"""Effects: the catalogue of what the amplitude equation leaves out, by what it does."""

from scruton.dynamics.effects import aerodynamic, generic, recording, structural, wake
from scruton.dynamics.effects.effect import Effect, Parameter, Variant
from scruton.dynamics.effects.terms import Layout, Term

CATALOGUE: dict[str, Effect] = {
    effect.name: effect for effect in (*structural.EFFECTS, *aerodynamic.EFFECTS, *wake.EFFECTS, *recording.EFFECTS)
}
UNKNOWN = generic.EFFECT

__all__ = ["CATALOGUE", "UNKNOWN", "Effect", "Layout", "Parameter", "Term", "Variant"]
