"""What a rule is: a named limit of the amplitude as a function of frequency, width and depth."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from scruton.campaign.schema import Motion
from scruton.campaign.spelling import nearest
from scruton.campaign.units import Dimension, parse_quantity
from scruton.errors import InputError

# (frequency [Hz], width [m], depth [m], value in the SI unit of the rule) -> amplitude [m] or [rad]
Function = Callable[[float, float, float, float], float]


@dataclass(frozen=True)
class Rule:
    """One acceptance rule.

    Attributes
    ----------
    name : str
        As a user writes it.
    title : str
    source : str
        Where the rule stands.
    confirm : str
        What should be confirmed against the code's own text; empty where nothing is open.
    value : float or None
        Default of the rule's parameter, in its SI unit; None where the user has to state it.
    dimension : Dimension
        Of the parameter.
    functions : mapping
        By motion; a rule without a motion does not apply to it.
    """

    name: str
    title: str
    source: str
    confirm: str
    value: float | None
    dimension: Dimension
    functions: Mapping[Motion, Function]


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
                f"a rule for it; this one is for {' and '.join(one.value for one in self.rule.functions)} modes",
            )  # fmt: skip
        return function(frequency, width, depth, self.value)


def parse_limit(text: str, rules: Mapping[str, Rule], file: Path | str, field: str) -> Limit:
    """Read "name", "name: value" or a bare amplitude ("0.13 m", "0.4 deg", "0.05" for A/D)."""
    text = text.strip()
    name, colon, rest = text.partition(":")
    name = name.strip().lower()
    if not colon and name not in rules and text.startswith(tuple("0123456789+-.")):
        name, rest = ("angle" if any(unit in text for unit in ("deg", "rad", "°")) else "amplitude"), text
        if _is_number(text):
            name = "amplitude-over-depth"
    if name not in rules:
        raise InputError(file, field, f'"{text}"', f'a rule, as "jtg", or a value, as "0.13 m"; {nearest(name, rules)}')
    rule = rules[name]
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


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
