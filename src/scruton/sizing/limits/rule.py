"""What an acceptance rule is: a function (f, B, D, value) -> amplitude, with where it holds and what it says."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import inf, isfinite, pi, sqrt

from scruton.campaign.schema import Motion
from scruton.campaign.units import Dimension
from scruton.errors import InputError
from scruton.shown import fields_in_brief, shown

ACCELERATION = Dimension("an acceleration", "m/s^2", 0.5)
_ASIDE = re.compile(r"\s*\([^)]*:[^)]*\)")  # of a title: "(torsion: at the edge)"
RMS = 1.0 / sqrt(2.0)  # root mean square of a harmonic, over its amplitude


@shown(fields_in_brief)
@dataclass(frozen=True)
class Rule:
    """One acceptance rule.

    Attributes
    ----------
    name, source : str
        As a user writes it, and where the rule stands, with its clause.
    confirm : str
        What should be confirmed against the code's own text; empty where nothing is open.
    value : float or None
        Default of the rule's parameter, in its SI unit; None where the user has to state it.
    dimension : Dimension
        Of the parameter.
    largest : float
        That the parameter can have.
    functions : mapping
        By motion, (frequency [Hz], width [m], depth [m], parameter) -> amplitude [m] or [rad]; a rule without a motion
        does not apply to it.
    outside : callable
        (frequency [Hz], width [m], depth [m]) -> why the rule does not hold there; empty where it does.
    classes : mapping
        Values of the parameter that the code names; a user may write the name in the place of the number.
    reading : callable
        Value of the parameter that an amplitude comes to -> what the code says of it; empty where it says nothing.
    """

    name: str
    title: str
    source: str
    confirm: str
    value: float | None
    dimension: Dimension
    functions: Mapping[Motion, Callable[[float, float, float, float], float]]
    outside: Callable[[float, float, float], str] = lambda _f, _b, _d: ""
    classes: Mapping[str, float] = field(default_factory=dict)
    reading: Callable[[float], str] = lambda _value: ""
    largest: float = inf


@shown(fields_in_brief)
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
        self.check(motion)
        return self.rule.functions[motion](frequency, width, depth, self.value)

    def check(self, motion: Motion, file: str = "command line", field: str = "--limit") -> None:
        """Raise InputError, of this field of this file, where the rule says nothing of this motion."""
        if motion not in self.rule.functions:
            known = " and ".join(motion.value for motion in self.rule.functions)
            raise InputError(
                file, field, f'"{self.text}", a limit for {known} modes', f"a rule for it: the modes are {motion.value}"
            )

    def reading(self, motion: Motion, frequency: float, width: float, depth: float, amplitude: float) -> str:
        """What the code says of an amplitude [m] or [rad] of this mode; the limit is proportional to its parameter."""
        if not isfinite(amplitude):
            return ""
        return self.rule.reading(self.value * amplitude / self.amplitude(motion, frequency, width, depth))


def limit_words(rule: str, title: str) -> str:
    """A limit as a reader meets it: by its code, with what is asked of it; or as it was stated.

    >>> limit_words("kd: acceptable", "BD 49/01: K_D = f^2 y")
    'BD 49/01, acceptable'
    >>> limit_words("0.03", "A fixed amplitude A/D (torsion: in rad)")
    'a fixed amplitude A/D, 0.03'
    """
    name, _, asked = (part.strip() for part in rule.partition(":"))
    plain = _ASIDE.sub("", title)
    code, clause, _ = plain.partition(":")
    if clause:
        words = code
    elif name[:1].isdigit():
        words, asked = plain[0].lower() + plain[1:], name
    else:
        words = name.replace("-", " ")
    return f"{words}, {asked}" if asked else words


def of_edge(heaving: Callable[[float, float], float]) -> dict[Motion, Callable[[float, float, float, float], float]]:
    """Functions of both motions from that of heaving, (frequency, value) -> amplitude [m].

    Torsion moves the edge of the deck, B/2 from the axis.
    """
    return {
        Motion.HEAVING: lambda f, _b, _d, value: heaving(f, value),
        Motion.TORSIONAL: lambda f, b, _d, value: heaving(f, value) / (0.5 * b),
    }


def displacement(frequency: float, acceleration: float) -> float:
    """Amplitude [m] of a harmonic of so much peak acceleration [m/s^2]."""
    return acceleration / (2.0 * pi * frequency) ** 2


def holds_between(low: float, high: float, instead: str = "") -> Callable[[float, float, float], str]:
    """Why a rule for frequencies [Hz] of this range does not hold; `instead` names what does, below it."""

    def outside(frequency: float, _width: float, _depth: float) -> str:
        if low <= frequency <= high:
            return ""
        hint = f"; {instead}" if instead and frequency < low else ""
        return f"it is for {low:g} to {high:g} Hz, and the mode has {frequency:.3g} Hz{hint}"

    return outside
