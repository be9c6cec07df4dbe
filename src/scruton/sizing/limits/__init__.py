"""Acceptance limits of the amplitude: rules (f, B, D) -> limit. A further rule is a file, and its name below."""

from importlib import import_module

from scruton.sizing.limits.rule import Limit, Rule, parse_limit

_FILES = ("jtg_t_3360", "bd_49_01", "acceleration", "fixed")

RULES: dict[str, Rule] = {
    rule.name: rule for file in _FILES for rule in import_module(f"scruton.sizing.limits.{file}").RULES
}


def limit(text: str, file: str = "command line", field: str = "--limit") -> Limit:
    """Read a limit: the name of a rule, or "name: value", or a bare amplitude.

    Raises
    ------
    InputError
        A rule that is not known, a value that is no quantity of its dimension or not above zero.
    """
    return parse_limit(text, RULES, file, field)


__all__ = ["RULES", "Limit", "Rule", "limit"]
