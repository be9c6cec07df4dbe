"""Bridges and sizings in brief, whose room knows nothing of notebooks."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from scruton.shown import shown

if TYPE_CHECKING:
    from scruton.sizing.bridge import Bridge
    from scruton.sizing.results import Sizing


def sizing_in_brief() -> None:
    """From here on `repr` and notebooks show them by a few facts."""
    from scruton.sizing.bridge import Bridge
    from scruton.sizing.results import Sizing

    shown(_bridge_facts)(Bridge)
    shown(_sizing_facts)(Sizing)


def _bridge_facts(one: "Bridge") -> Mapping[str, object]:
    return {
        "title": one.title, "motion": one.motion.value, "modes": ", ".join(mode.name for mode in one.modes),
        "limits": ", ".join(limit.text for limit in one.limits),
    }  # fmt: skip


def _sizing_facts(one: "Sizing") -> Mapping[str, object]:
    facts: dict[str, object] = {"bridge": one.bridge.title}
    for mode in one.modes:
        against = mode.governing_limit
        facts[mode.name] = f"{against.required_text['0.95']} at 95 %, against {against.rule}"
    return facts | {"flags": len(one.flags)}
