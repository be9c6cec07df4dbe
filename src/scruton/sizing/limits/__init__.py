"""Acceptance limits of the amplitude, one file a code; a further rule is an entry of `RULES`."""

from contextlib import suppress

from scruton.campaign.spelling import nearest
from scruton.campaign.units import parse_quantity
from scruton.errors import InputError
from scruton.sizing.limits import bd49, iso2631, jtg, stated
from scruton.sizing.limits.rule import Limit, Rule

__all__ = ["RULES", "Limit", "Rule", "limit"]

RULES: dict[str, Rule] = {rule.name: rule for rule in (*jtg.RULES, *bd49.RULES, *iso2631.RULES, *stated.RULES)}


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
    if rest.lower() in rule.classes:
        return Limit(rule, rule.classes[rest.lower()], text)
    if rule.classes and not rest.startswith(tuple("0123456789+-.")):
        wanted = f"{rule.dimension.spelling} or {nearest(rest.lower(), rule.classes)}"
        raise InputError(file, field, f'"{text}"', wanted)
    raw: object = rest
    if not rule.dimension.unit:
        try:
            raw = float(rest)
        except ValueError:
            raise InputError(file, field, f'"{rest}"', f"{rule.dimension.name}") from None
    value = parse_quantity(raw, rule.dimension, file, field)
    if value.sd is not None:
        raise InputError(file, field, f'"{text}"', "a limit without a standard deviation")
    if value.mean > rule.largest:
        raise InputError(file, field, f'"{text}"', f"{rule.dimension.name}, up to {rule.largest:g}")
    return Limit(rule, value.mean, text)
