"""Effects: the catalogue of what the bare amplitude equation leaves out, one file each."""

from scruton.dynamics.effects import (
    aerodynamic_damping_nonlinearity,
    coulomb_friction,
    fluid_memory,
    generic,
    reduced_velocity_drift,
    sensor_clipping,
    sensor_gain_error,
    spanwise_coherence_loss,
    stiffness_nonlinearity,
    structural_damping_error,
    structural_damping_nonlinearity,
    vortex_shedding_forcing,
    wind_speed_drift,
)
from scruton.dynamics.effects.effect import Effect, Parameter, Variant
from scruton.dynamics.effects.terms import Layout, Term

CATALOGUE: dict[str, Effect] = {
    module.EFFECT.name: module.EFFECT
    for module in (
        coulomb_friction,
        structural_damping_nonlinearity,
        structural_damping_error,
        aerodynamic_damping_nonlinearity,
        spanwise_coherence_loss,
        reduced_velocity_drift,
        fluid_memory,
        vortex_shedding_forcing,
        wind_speed_drift,
        stiffness_nonlinearity,
        sensor_gain_error,
        sensor_clipping,
    )
}
UNKNOWN = generic.EFFECT

__all__ = ["CATALOGUE", "UNKNOWN", "Effect", "Layout", "Parameter", "Term", "Variant"]
