"""The amplitude equation, its laws and force models, Scruton numbers and Griffin curves; no data."""

from scruton.dynamics.force_model import (
    aerodynamic_damping,
    ehsan_scanlan_parameters,
    ehsan_scanlan_relaxation,
    force_parameters,
    is_stable,
    relaxation,
    stiffness_parameter,
    total_damping,
)
from scruton.dynamics.griffin_curve import ehsan_scanlan_amplitude, reciprocal_amplitude, stable_amplitude
from scruton.dynamics.identify import (
    Y1_epsilon_from_damping,
    Y1_epsilon_from_griffin,
    Y1_from_amplitude,
    epsilon_from_amplitude,
)
from scruton.dynamics.laws import (
    LAWS,
    amplitude_ratio,
    closed_form,
    extrapolation_index,
    flow_derivative,
    larsen,
    rate,
)
from scruton.dynamics.scruton_number import DEFINITIONS, convert, damping_ratio, scruton_number
from scruton.dynamics.setting import Setting

__all__ = [
    "DEFINITIONS",
    "LAWS",
    "Setting",
    "Y1_epsilon_from_damping",
    "Y1_epsilon_from_griffin",
    "Y1_from_amplitude",
    "aerodynamic_damping",
    "amplitude_ratio",
    "closed_form",
    "convert",
    "damping_ratio",
    "ehsan_scanlan_amplitude",
    "ehsan_scanlan_parameters",
    "ehsan_scanlan_relaxation",
    "epsilon_from_amplitude",
    "extrapolation_index",
    "flow_derivative",
    "force_parameters",
    "is_stable",
    "larsen",
    "rate",
    "reciprocal_amplitude",
    "relaxation",
    "scruton_number",
    "stable_amplitude",
    "stiffness_parameter",
    "total_damping",
]
