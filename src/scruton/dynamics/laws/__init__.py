"""Laws of aerodynamic damping: the n-family, and what a law outside it must state (`scruton.dynamics.laws.law`)."""

from scruton.dynamics.laws.family import (
    LAWS,
    amplitude_ratio,
    closed_form,
    extrapolation_index,
    flow_derivative,
    index_of,
    larsen,
    rate,
)

__all__ = [
    "LAWS",
    "amplitude_ratio",
    "closed_form",
    "extrapolation_index",
    "flow_derivative",
    "index_of",
    "larsen",
    "rate",
]
