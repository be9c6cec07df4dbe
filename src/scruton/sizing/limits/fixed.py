"""A fixed amplitude: a length, an angle, or a part of the depth."""

from scruton.campaign.schema import Motion
from scruton.campaign.units import ANGLE, LENGTH, Dimension
from scruton.sizing.limits.rule import Rule

SHARE = Dimension("an amplitude A/D, a bare number", "", 0.05)
_STATED = "Stated by the project"

RULES = (
    Rule(
        "amplitude", "A fixed amplitude", _STATED, "", None, LENGTH, {Motion.HEAVING: lambda _f, _b, _d, value: value}
    ),
    Rule(
        "amplitude-over-depth", "A fixed amplitude A/D (torsion: in rad)", _STATED, "", None, SHARE,
        {Motion.HEAVING: lambda _f, _b, d, value: value * d, Motion.TORSIONAL: lambda _f, _b, _d, value: value},
    ),
    Rule("angle", "A fixed rotation", _STATED, "", None, ANGLE, {Motion.TORSIONAL: lambda _f, _b, _d, value: value}),
)  # fmt: skip
