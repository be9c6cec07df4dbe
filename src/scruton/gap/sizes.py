"""How large the effects found are: every parameter, and whose it is."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.special import log_ndtr, ndtri, ndtri_exp

from scruton.dynamics.effects import Parameter
from scruton.dynamics.effects.effect import AMPLITUDE, TENTHS
from scruton.gap.data import GapData
from scruton.gap.diagnosis import Diagnosis

_NAMED = 3  # rigs, tests or records that are named


def found_parameters(diagnosis: Diagnosis, name: str) -> dict[str, Any]:
    """Median and 90 % interval of every parameter of an effect that was found, in its own unit, and whose it is."""
    fit, data = diagnosis.final, diagnosis.data
    at_largest = f", at {data.campaign.section.motion.amplitude_text(float(data.layout.largest.max()))}, the largest"
    table: dict[str, Any] = {}
    for i, variant in enumerate(fit.hypothesis.variants):
        for p in variant.parameters if variant.effect == name else ():
            unit = data.campaign.section.amplitude_unit if p.unit == AMPLITUDE else p.unit
            for j, (centre, sd) in enumerate(zip(*fit.value(p.name, i), strict=True)):
                low, middle, high = _quantiles(p, float(centre), float(sd))
                inside = p.members == j
                members = [record for record, member in zip(data.layout.records, inside, strict=True) if member]
                table[p.name if p.size == 1 else f"{p.name}[{_whose(data, inside)}]"] = {
                    "median": middle, "interval90": [low, high], "unit": unit,
                    "form": variant.label + at_largest * (p.unit == TENTHS), "of": whose(data, inside),
                    "records": members if len(members) < inside.size else "all",
                }  # fmt: skip
    return table


def largest_size(diagnosis: Diagnosis, name: str) -> tuple[dict[str, Any], int] | None:
    """Of an effect found the largest of its sizes, as of `found_parameters`, and how many it has."""
    every = list(found_parameters(diagnosis, name).values())
    own = [size for size in every if size["unit"] == every[0]["unit"]]
    return (max(own, key=lambda size: abs(size["median"])), len(own)) if own else None


def whose(data: GapData, inside: np.ndarray) -> str:
    """What some records, (R,) of bool, are, for people: all, those in wind, whole rigs, tests, or records by name."""
    layout = data.layout
    if inside.all():
        return "every record" if inside.size > 1 else f"record {layout.records[0]}"
    tests, rigs = np.where(layout.wind, layout.test, -1), layout.rig
    for numbers, names, word in ((tests, data.tests, "test"), (rigs, data.rigs, "rig")):
        own = np.unique(numbers[inside])
        if (own >= 0).all() and np.array_equal(np.isin(numbers, own), inside):
            if word == "test" and own.size > 1 and np.array_equal(inside, layout.wind):
                return "every test"
            return _listed(word, [names[i] for i in own])
    return _listed("record", [layout.records[i] for i in np.flatnonzero(inside)])


def _listed(word: str, names: Sequence[str]) -> str:
    if len(names) > _NAMED:
        return f"{len(names)} {word}s"
    return f"{word}{'s' if len(names) > 1 else ''} {', '.join(map(str, names))}"


def _whose(data: GapData, inside: np.ndarray) -> str:
    """The test, rig or record that one of several values belongs to."""
    first = int(np.argmax(inside))
    test, rig = data.layout.test == data.layout.test[first], data.layout.rig == data.layout.rig[first]
    if data.layout.wind[first] and np.array_equal(inside, test):
        return str(data.tests[data.layout.test[first]])
    if inside.sum() > 1 and not np.any(inside & ~rig):
        return str(data.rigs[data.layout.rig[first]])
    return str(data.layout.records[first])


def _quantiles(parameter: Parameter, centre: float, sd: float) -> tuple[float, float, float]:
    """5, 50 and 95 % points of a parameter in its own unit; one that cannot be negative is cut off at zero."""
    points = np.array([0.05, 0.5, 0.95])
    if parameter.positive and not parameter.log:  # by the logarithm of what lies above: of the far tail, too
        low, middle, high = centre - sd * ndtri_exp(log_ndtr(centre / sd) + np.log1p(-points))
        return float(low), float(middle), float(high)
    low, middle, high = centre + sd * ndtri(points)
    return (
        (float(np.exp(low)), float(np.exp(middle)), float(np.exp(high)))
        if parameter.log
        else (float(low), float(middle), float(high))
    )
