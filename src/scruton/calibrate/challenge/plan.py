"""Which effects, at which severity, case k of a challenge has: a function of the seed, k, and what was asked for.

Cases come in blocks. A block has every effect at every severity once, eight cases without an effect and six with two
of the catalogue at once, in a random order; 25 blocks are 200 cases without, and 25 of each effect at each severity.
"""

from collections.abc import Sequence

import numpy as np

from scruton.calibrate.challenge.case import DESIGNS
from scruton.calibrate.challenge.outside import OPEN
from scruton.calibrate.challenge.scenarios import CATALOGUE
from scruton.calibrate.thresholds import SEVERE_ENOUGH_FOR_TWO, WITH_TWO, WITHOUT_EFFECT
from scruton.errors import InputError

NONE, TWO = "none", "two"
SEVERITIES = (0.1, 0.2, 0.4)
KINDS = (NONE, *CATALOGUE, TWO, *OPEN)
_BETWEEN_RIGS = "reduced_velocity_drift"

Planned = tuple[tuple[str, ...], float]


def checked(effects: Sequence[str] | None, severities: Sequence[float], design: str) -> tuple[str, ...]:
    """What a challenge is made of: `KINDS` by default, less what a single rig cannot have.

    Raises
    ------
    InputError
        For unknown names, a design that is none, or severities outside (0, 0.5].
    """
    if design not in DESIGNS:
        raise InputError("challenge", "design", repr(design), f"one of: {', '.join(DESIGNS)}")
    if not severities or not all(0.0 < s <= 0.5 for s in severities):
        raise InputError("challenge", "severities", repr(tuple(severities)), "numbers above 0, up to 0.5")
    wanted = KINDS if effects is None else tuple(effects)
    for name in wanted:
        if name not in KINDS:
            raise InputError("challenge", "effects", repr(name), f"some of: {', '.join(KINDS)}")
        if design == "one-rig" and name == _BETWEEN_RIGS and effects is not None:
            raise InputError("challenge", "effects", repr(name), "the design full: it shows between rigs alone")
    return tuple(name for name in wanted if design == "full" or name != _BETWEEN_RIGS)


def block(effects: Sequence[str], severities: Sequence[float]) -> list[tuple[str, float]]:
    """Names and severities of one block, in order."""
    rows: list[tuple[str, float]] = []
    for name in effects:
        if name == NONE:
            rows += [(NONE, 0.0)] * WITHOUT_EFFECT
        elif name == TWO:
            enough = [s for s in severities if s >= SEVERE_ENOUGH_FOR_TWO] or list(severities)
            rows += [(TWO, enough[i % len(enough)]) for i in range(WITH_TWO)]
        else:
            rows += [(name, s) for s in severities]
    return rows


def planned(seed: int, index: int, effects: Sequence[str], severities: Sequence[float], design: str) -> Planned:
    """Effects and severity of a case.

    Parameters
    ----------
    seed : int
    index : int
        From 1.
    effects, severities, design
        As `checked` returned or took them.
    """
    rows = block(effects, severities)
    number, place = divmod(index - 1, len(rows))
    order = np.random.default_rng([seed, number, 0xB10C]).permutation(len(rows))
    name, severity = rows[order[place]]
    if name == NONE:
        return (), 0.0
    if name != TWO:
        return (name,), severity
    single = [one for one in CATALOGUE if design == "full" or one != _BETWEEN_RIGS]
    pair = np.random.default_rng([seed, index, 0x2]).choice(len(single), size=2, replace=False)
    return tuple(single[int(i)] for i in sorted(pair)), severity
