"""Which rigs and records a scenario touches, and how strong a force has to be."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from scruton.calibrate.challenge.sections import Body
from scruton.simulate import Disturbances
from scruton.simulate.equation import mean_rate

Parameters = dict[str, Any]

IN_WIND, STILL = 4, 2  # records of a rig: two growths and two decays, two free decays


def set_rigs(body: Body, rigs: Iterable[int], **fields: Any) -> Body:
    """Put fields of `Disturbances` into some rigs; a sequence has one value a rig of the body."""

    def own(j: int) -> Disturbances:
        mine = {key: value[j] if isinstance(value, list) else value for key, value in fields.items()}
        return replace(body.rigs[j].disturbances, **mine)

    return _change(body, {j: {"disturbances": own(j)} for j in rigs})


def set_records(body: Body, fields: Mapping[tuple[int, int], Parameters]) -> Body:
    """Put fields of `Disturbances` into single records, by rig and number."""
    own = {j: dict(rig.own) for j, rig in enumerate(body.rigs)}
    for (j, i), mine in fields.items():
        own[j][i] = {**own[j].get(i, {}), **mine}
    return _change(body, {j: {"own": records} for j, records in own.items()})


def set_winds(body: Body, fields: Mapping[int, Parameters]) -> Body:
    """Put fields of `Truth` into some rigs."""
    return _change(body, {j: {"wind": replace(body.rigs[j].wind, **mine)} for j, mine in fields.items()})


def _change(body: Body, rigs: Mapping[int, Mapping[str, Any]]) -> Body:
    return replace(body, rigs=tuple(replace(rig, **rigs.get(j, {})) for j, rig in enumerate(body.rigs)))


def every(body: Body) -> list[int]:
    """Numbers of all rigs."""
    return list(range(len(body.rigs)))


def some(body: Body, rng: np.random.Generator) -> list[int]:
    """Some but not all of the rigs."""
    count = len(body.rigs)
    if count == 1:
        return [0]
    return sorted(int(j) for j in rng.choice(count, size=int(rng.integers(1, count)), replace=False))


def coefficient(body: Body, severity: float, field: str, **fixed: Any) -> float:
    """Coefficient of a force that is linear in it, so that it damps the middle rig at a* by s lambda/omega."""
    rig = body.middle
    amplitude, rate = rig.undisturbed
    without, unit = (
        float(mean_rate(rig.wind, Disturbances(**{**fixed, field: value}), np.array([amplitude]))[0])
        for value in (0.0, 1.0)
    )
    return severity * rate * amplitude / (without - unit)


def records(body: Body, rng: np.random.Generator) -> list[tuple[int, int]]:
    """Records in wind as (rig, number): all, those of some rigs, or a third."""
    all_records = [(j, i) for j in every(body) for i in range(IN_WIND)]
    choice = rng.random()
    if choice < 0.4:
        return all_records
    if choice < 0.7 and len(body.rigs) > 1:
        rigs = some(body, rng)
        return [(j, i) for j, i in all_records if j in rigs]
    picked = rng.choice(len(all_records), size=max(1, len(all_records) // 3), replace=False)
    return [all_records[int(i)] for i in sorted(picked)]
