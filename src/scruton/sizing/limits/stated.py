"""Limits that a project states for itself."""

from scruton.campaign.schema import Motion
from scruton.campaign.units import ANGLE, LENGTH, Dimension
from scruton.envelope.thresholds import NO_VORTEX
from scruton.sizing.limits.rule import ACCELERATION, Rule, displacement, of_edge

RULES = (
    Rule(
        "peak-acceleration",
        "Peak acceleration of the deck (torsion: at its edge)",
        "Stated by the project; AASHTO and railway practice step from 0.05 g to 0.1 g with the wind speed",
        "No code is meant by default: state the project's own value.",
        None,
        ACCELERATION,
        of_edge(displacement),
    ),
    Rule(
        "amplitude", "A fixed amplitude", "Stated by the project", "", None, LENGTH,
        {Motion.HEAVING: lambda _f, _b, _d, value: value},
    ),
    Rule(
        "amplitude-over-depth", "A fixed amplitude A/D (torsion: in rad)", "Stated by the project", "", None,
        Dimension("an amplitude A/D, a bare number (a length has its unit)", "", 0.05),
        {Motion.HEAVING: lambda _f, _b, d, value: value * d, Motion.TORSIONAL: lambda _f, _b, _d, value: value},
        largest=NO_VORTEX,
    ),
    Rule(
        "angle", "A fixed rotation", "Stated by the project", "", None, ANGLE,
        {Motion.TORSIONAL: lambda _f, _b, _d, value: value},
    ),
)  # fmt: skip
