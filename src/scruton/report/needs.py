"""What every mode of a bridge needs, from the content of sizing.json: what the first page tells, the worst first."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from scruton.sizing.checks import ASKED

Content = Mapping[str, Any]


def governing(mode: Content) -> Content:
    """The limit that decides: the smallest."""
    decisive: Content = next(limit for limit in mode["limits"] if limit["rule"] == mode["governing"])
    return decisive


def worst(content: Content) -> Content:
    """The mode that needs most damping; among those that need as much, the one likeliest above its limit."""
    return next(need.mode for need in needs(content) if need.mode is not None)


def required_of(content: Content, mode: Content) -> float | None:
    """Damping ratio that has to be added to a mode."""
    return next(need.required for need in needs(content) if need.mode is not None and need.mode["name"] == mode["name"])


class Need(NamedTuple):
    """What a mode needs so that it stays below its limit, or where the bridge asks that, so that any mode does.

    Its name in words, the damping ratio to add (None: more than can be added), how far that lies from what was tested,
    mass [kg] and frequency [Hz] of each damper that gives it, and whether its fit converged; its mode, which those of
    the other motion do not have.
    """

    name: str
    required: float | None
    reach: Content | None
    dampers: Sequence[tuple[float, float]]
    trusted: bool = True
    mode: Content | None = None


def for_any(content: Content) -> Content | None:
    """The damping that keeps the risk of any mode, where the bridge asks for it and it is known."""
    every = content.get("both") or content["all_modes"]
    asked = any(mode["damper"]["asked"].get("risk_of") == "any" for mode in content["modes"])
    return every.get("required_for_any") if asked else None


def needs(content: Content) -> list[Need]:
    """What every mode needs, those of the other motion among them where both were sized; the worst first."""
    both, together, trusted = content.get("both"), for_any(content), not content.get("unconverged")
    own: dict[str, Need] = {}
    risks: dict[str, float] = {}
    for mode in content["modes"]:
        limit, damper = governing(mode), mode["damper"]
        weighed = damper["achievable"] and damper.get("mass")
        dampers = [(one["mass"], one["frequency"]) for one in damper["dampers"]] if weighed else []
        reach = limit.get("reach", {}).get(ASKED)
        own[mode["name"]] = Need(f"mode {mode['name']}", limit["required"][ASKED], reach, dampers, trusted, mode)
        risks[mode["name"]] = limit["probability"]
    found = dict(own)
    if both and "required" in both:  # an earlier sizing says no more of the other motion than its risk
        columns = (both[key] for key in ("names", "motions", "required", "reach", "dampers", "trusted"))
        for name, motion, required, reach, dampers, converged in zip(*columns, strict=True):
            hung = [(one["mass"], one["frequency"]) for one in dampers]
            found.setdefault(name, Need(f"mode {name} ({motion})", required, reach, hung, converged))
        risks |= dict(zip(both["names"], both["without"]["each"], strict=True)) | risks
    if together is not None:
        names = (both or content["all_modes"])["names"]
        for name, required, reach in zip(names, together["required"], together["reach"], strict=True):
            if name in found:
                found[name] = found[name]._replace(required=required, reach=reach)

    def first(name: str) -> tuple[float, float]:
        required = found[name].required
        return np.inf if required is None else required, risks[name]

    return [found[name] for name in sorted(found, key=first, reverse=True)]
