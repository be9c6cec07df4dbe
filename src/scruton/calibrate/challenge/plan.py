"""Which effects, at which severity, case k of a challenge has: a function of the seed, k, and what was asked for.

Cases come in blocks. A block has every effect at every severity once, eight cases without an effect and six with two
of the catalogue at once, in a random order; 25 blocks are 200 cases without, and 25 of each effect at each severity.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scruton.calibrate.challenge.case import DESIGNS, NOISE, TURBULENCE
from scruton.calibrate.challenge.outside import OPEN
from scruton.calibrate.challenge.scenarios import CATALOGUE
from scruton.calibrate.thresholds import SEVERE_ENOUGH_FOR_TWO, WITH_TWO, WITHOUT_EFFECT
from scruton.errors import InputError

NONE, TWO = "none", "two"
SEVERITIES = (0.1, 0.2, 0.4)
KINDS = (NONE, *CATALOGUE, TWO, *OPEN)
_BETWEEN_RIGS = "reduced_velocity_drift"


@dataclass(frozen=True)
class Plan:
    """What a challenge is made of; with the number of a case it settles every byte of it.

    Attributes
    ----------
    seed : int
    effects : sequence of str, optional
        Effects, or "none" and "two"; `KINDS` by default, less what a single rig cannot have.
    severities : sequence of float
    design : {"full", "one-rig"}
    turbulence, noise : (float, float)
        Ranges: scatter of the amplitude over the stable amplitude, sensor noise over the smallest stable amplitude.

    Raises
    ------
    InputError
        For unknown names, a design that is none, severities outside (0, 0.5], or ranges outside 0 to 0.2.
    """

    seed: int
    effects: Sequence[str] | None = None
    severities: Sequence[float] = SEVERITIES
    design: str = "full"
    turbulence: tuple[float, float] = TURBULENCE
    noise: tuple[float, float] = NOISE

    def __post_init__(self) -> None:
        for field, (low, high) in (("turbulence", self.turbulence), ("noise", self.noise)):
            if not 0.0 <= low <= high <= 0.2:
                raise InputError("challenge", field, f"{low:g} to {high:g}", "a range between 0 and 0.2")
        if self.design not in DESIGNS:
            raise InputError("challenge", "design", repr(self.design), f"one of: {', '.join(DESIGNS)}")
        if not self.severities or not all(0.0 < s <= 0.5 for s in self.severities):
            raise InputError("challenge", "severities", repr(tuple(self.severities)), "numbers above 0, up to 0.5")
        for name in self.effects or ():
            if name not in KINDS:
                raise InputError("challenge", "effects", repr(name), f"some of: {', '.join(KINDS)}")
            if self.design == "one-rig" and name == _BETWEEN_RIGS:
                raise InputError("challenge", "effects", repr(name), "the design full: it shows between rigs alone")

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of cases: effects, "none" and "two"."""
        wanted = KINDS if self.effects is None else self.effects
        return tuple(name for name in wanted if self.design == "full" or name != _BETWEEN_RIGS)

    @property
    def settings(self) -> dict[str, Any]:
        """All that decides, as JSON can hold it."""
        return {
            "seed": self.seed, "design": self.design, "effects": list(self.kinds),
            "severities": [float(s) for s in self.severities], "turbulence": list(self.turbulence),
            "noise": list(self.noise),
        }  # fmt: skip

    def block(self) -> list[tuple[str, float]]:
        """Names and severities of one block, in order."""
        rows: list[tuple[str, float]] = []
        for name in self.kinds:
            if name == NONE:
                rows += [(NONE, 0.0)] * WITHOUT_EFFECT
            elif name == TWO:
                enough = [s for s in self.severities if s >= SEVERE_ENOUGH_FOR_TWO] or list(self.severities)
                rows += [(TWO, enough[i % len(enough)]) for i in range(WITH_TWO)]
            else:
                rows += [(name, s) for s in self.severities]
        return rows

    def case(self, index: int) -> tuple[tuple[str, ...], float]:
        """Effects and severity of a case, the first of which is number 1."""
        rows = self.block()
        number, place = divmod(index - 1, len(rows))
        order = np.random.default_rng([self.seed, number, 0xB10C]).permutation(len(rows))
        name, severity = rows[order[place]]
        if name == NONE:
            return (), 0.0
        if name != TWO:
            return (name,), severity
        single = [effect for effect in CATALOGUE if self.design == "full" or effect != _BETWEEN_RIGS]
        pair = np.random.default_rng([self.seed, index, 0x2]).choice(len(single), size=2, replace=False)
        return tuple(single[int(i)] for i in sorted(pair)), severity
