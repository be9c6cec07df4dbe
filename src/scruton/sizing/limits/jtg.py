"""The Chinese wind-resistant design specification for highway bridges."""

from math import radians

from scruton.campaign.schema import Motion
from scruton.campaign.units import Dimension
from scruton.sizing.limits.rule import Rule

RULES = (
    Rule(
        "jtg",
        "JTG/T 3360-01-2018: gamma_v 0.04/f m (heaving), gamma_v 4.56/(B f) degrees (torsion)",
        "JTG/T 3360-01-2018, Wind-resistant Design Specification for Highway Bridges, vortex-induced vibration",
        "The formulas are those of common use: clause and gamma_v (1.0 unless stated) are to be confirmed in its text.",
        1.0,
        Dimension("the partial factor gamma_v, a bare number", "", 1.0),
        {
            Motion.HEAVING: lambda f, _b, _d, gamma: gamma * 0.04 / f,
            Motion.TORSIONAL: lambda f, b, _d, gamma: gamma * radians(4.56 / (b * f)),
        },
    ),
)
