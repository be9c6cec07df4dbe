"""Limits of the acceleration: a peak, and a root mean square after the manner of ISO 2631-1."""

from math import pi, sqrt

from scruton.campaign.schema import Motion
from scruton.campaign.units import Dimension
from scruton.sizing.limits.rule import Rule

ACCELERATION = Dimension("an acceleration", "m/s^2", 0.5)


def _heaving(f: float, _b: float, _d: float, peak: float) -> float:
    return peak / (2.0 * pi * f) ** 2


def _edge(f: float, b: float, _d: float, peak: float) -> float:
    """Rotation whose vertical acceleration at the edge of the deck, B/2 from the axis, is `peak`."""
    return peak / (2.0 * pi * f) ** 2 / (0.5 * b)


RULES = (
    Rule(
        "peak-acceleration",
        "Peak acceleration of the deck (torsion: at its edge)",
        "Stated by the project; AASHTO and railway practice step from 0.05 g to 0.1 g with the wind speed",
        "No code is meant by default: state the project's own value.",
        None,
        ACCELERATION,
        {Motion.HEAVING: _heaving, Motion.TORSIONAL: _edge},
    ),
    Rule(
        "rms-acceleration",
        "Root mean square of the acceleration, as in ISO 2631-1 (torsion: at the edge)",
        "ISO 2631-1:1997, annex C: below 0.315 m/s^2 (weighted) not uncomfortable",
        "Here unweighted: the standard's weighting, and its range (from 0.5 Hz), are to be confirmed in its text.",
        0.315,
        ACCELERATION,
        {
            Motion.HEAVING: lambda f, b, d, rms: _heaving(f, b, d, sqrt(2.0) * rms),
            Motion.TORSIONAL: lambda f, b, d, rms: _edge(f, b, d, sqrt(2.0) * rms),
        },
    ),
)
