"""Acceptance limits of the amplitude, rules (f, B, D, value) -> amplitude; a further one is an entry of `_RULES`."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from math import pi, radians, sqrt

from scruton.campaign.schema import Motion
from scruton.campaign.spelling import nearest
from scruton.campaign.units import ANGLE, LENGTH, Dimension, parse_quantity
from scruton.errors import InputError


@dataclass(frozen=True)
class Rule:
    """One acceptance rule.

    Attributes
    ----------
    name, source : str
        As a user writes it, and where the rule stands.
    confirm : str
        What should be confirmed against the code's own text; empty where nothing is open.
    value : float or None
        Default of the rule's parameter, in its SI unit; None where the user has to state it.
    dimension : Dimension
        Of the parameter.
    functions : mapping
        By motion, (frequency [Hz], width [m], depth [m], parameter) -> amplitude [m] or [rad]; a rule without a motion
        does not apply to it.
    """

    name: str
    title: str
    source: str
    confirm: str
    value: float | None
    dimension: Dimension
    functions: Mapping[Motion, Callable[[float, float, float, float], float]]


@dataclass(frozen=True)
class Limit:
    """A rule with its parameter."""

    rule: Rule
    value: float
    text: str

    def amplitude(self, motion: Motion, frequency: float, width: float, depth: float) -> float:
        """Limit of the amplitude: [m] for heaving, [rad] for torsion.

        Raises
        ------
        InputError
            Where the rule says nothing of this motion.
        """
        function = self.rule.functions.get(motion)
        if function is None:
            raise InputError(
                "limit", self.rule.name, f"a {motion.value} mode",
                f"a rule for it; this one is for {' and '.join(known.value for known in self.rule.functions)} modes",
            )  # fmt: skip
        return function(frequency, width, depth, self.value)


_ACCELERATION = Dimension("an acceleration", "m/s^2", 0.5)


def _heaving(f: float, _b: float, _d: float, peak: float) -> float:
    return peak / (2.0 * pi * f) ** 2


def _edge(f: float, b: float, _d: float, peak: float) -> float:
    """Rotation whose vertical acceleration at the edge of the deck, B/2 from the axis, is `peak`."""
    return peak / (2.0 * pi * f) ** 2 / (0.5 * b)


_RULES = (
    Rule(  # the Chinese wind-resistant design specification for highway bridges
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
    Rule(  # Design Rules for Aerodynamic Effects on Bridges: the dynamic sensitivity parameter
        "kd",
        "BD 49/01: K_D = f^2 y at most 30 mm/s^2",
        "BD 49/01 (Highways Agency, 2001): above 30 mm/s^2, at a critical speed below 20 m/s, it asks for analysis",
        "What is acceptable once analysed stands in the code's Table 1, to be read there.",
        30.0,
        Dimension("K_D = f^2 y, an acceleration over 4 pi^2", "mm/s^2", 30.0),
        {Motion.HEAVING: lambda f, _b, _d, kd: 1e-3 * kd / f**2},
    ),
    Rule(
        "peak-acceleration",
        "Peak acceleration of the deck (torsion: at its edge)",
        "Stated by the project; AASHTO and railway practice step from 0.05 g to 0.1 g with the wind speed",
        "No code is meant by default: state the project's own value.",
        None,
        _ACCELERATION,
        {Motion.HEAVING: _heaving, Motion.TORSIONAL: _edge},
    ),
    Rule(
        "rms-acceleration",
        "Root mean square of the acceleration, as in ISO 2631-1 (torsion: at the edge)",
        "ISO 2631-1:1997, annex C: below 0.315 m/s^2 (weighted) not uncomfortable",
        "Here unweighted: the standard's weighting, and its range (from 0.5 Hz), are to be confirmed in its text.",
        0.315,
        _ACCELERATION,
        {
            Motion.HEAVING: lambda f, b, d, rms: _heaving(f, b, d, sqrt(2.0) * rms),
            Motion.TORSIONAL: lambda f, b, d, rms: _edge(f, b, d, sqrt(2.0) * rms),
        },
    ),
    Rule(
        "amplitude", "A fixed amplitude", "Stated by the project", "", None, LENGTH,
        {Motion.HEAVING: lambda _f, _b, _d, value: value},
    ),
    Rule(
        "amplitude-over-depth", "A fixed amplitude A/D (torsion: in rad)", "Stated by the project", "", None,
        Dimension("an amplitude A/D, a bare number", "", 0.05),
        {Motion.HEAVING: lambda _f, _b, d, value: value * d, Motion.TORSIONAL: lambda _f, _b, _d, value: value},
    ),
    Rule(
        "angle", "A fixed rotation", "Stated by the project", "", None, ANGLE,
        {Motion.TORSIONAL: lambda _f, _b, _d, value: value},
    ),
)  # fmt: skip
RULES: dict[str, Rule] = {rule.name: rule for rule in _RULES}


def limit(text: str, file: str = "command line", field: str = "--limit") -> Limit:
    """Read a limit: "name", "name: value" or a bare amplitude ("0.13 m", "0.4 deg", "0.05" for A/D).

    Raises
    ------
    InputError
        A rule that is not known, a value that is no quantity of its dimension or not above zero.
    """
    text = text.strip()
    name, colon, rest = text.partition(":")
    name = name.strip().lower()
    if not colon and name not in RULES and text.startswith(tuple("0123456789+-.")):
        name, rest = ("angle" if any(unit in text for unit in ("deg", "rad", "°")) else "amplitude"), text
        with suppress(ValueError):
            float(text)
            name = "amplitude-over-depth"
    if name not in RULES:
        raise InputError(file, field, f'"{text}"', f'a rule, as "jtg", or a value, as "0.13 m"; {nearest(name, RULES)}')
    rule = RULES[name]
    rest = rest.strip()
    if not rest:
        if rule.value is None:
            raise InputError(
                file, field, f'"{text}"', f'its value, such as "{name}: {rule.dimension.spelling.strip(chr(34))}"'
            )
        return Limit(rule, rule.value, text)
    raw: object = rest
    if not rule.dimension.unit:
        try:
            raw = float(rest)
        except ValueError:
            raise InputError(file, field, f'"{rest}"', f"{rule.dimension.name}") from None
    value = parse_quantity(raw, rule.dimension, file, field)
    if value.sd is not None:
        raise InputError(file, field, f'"{text}"', "a limit without a standard deviation")
    return Limit(rule, value.mean, text)
