"""Acceptance limits of the amplitude: rules (f, B, D) -> limit. A further rule is a file and a line here."""

from scruton.sizing.limits import acceleration, bd_49_01, fixed, jtg_t_3360
from scruton.sizing.limits.rule import Limit, Rule, parse_limit

RULES: dict[str, Rule] = {
    rule.name: rule for module in (jtg_t_3360, bd_49_01, acceleration, fixed) for rule in module.RULES
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
