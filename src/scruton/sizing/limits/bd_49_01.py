"""BD 49/01, Design Rules for Aerodynamic Effects on Bridges: the dynamic sensitivity parameter K_D."""

from scruton.campaign.schema import Motion
from scruton.campaign.units import Dimension
from scruton.sizing.limits.rule import Rule

K_D = Dimension("K_D = f^2 y, an acceleration over 4 pi^2", "mm/s^2", 30.0)

RULES = (
    Rule(
        "kd",
        "BD 49/01: K_D = f^2 y at most 30 mm/s^2",
        "BD 49/01 (Highways Agency, 2001): above 30 mm/s^2, at a critical speed below 20 m/s, it asks for analysis",
        "What is acceptable once analysed stands in the code's Table 1, to be read there.",
        30.0,
        K_D,
        {Motion.HEAVING: lambda f, _b, _d, kd: 1e-3 * kd / f**2},
    ),
)
