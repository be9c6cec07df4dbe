"""Records of one rig at one wind that swing at different frequencies: a clock that is wrong, samples that were lost."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from scruton.envelope import Cycles
from scruton.gap.data import GapData
from scruton.gap.thresholds import CLOCK_CYCLES, CLOCK_LOWEST, CLOCK_SD, LINE_NATS


@dataclass(frozen=True)
class WrongClock:
    """A record out of step with another of its test, or of its rig in still air.

    Attributes
    ----------
    record, other : str
        The one that is further off all others, and that which it is compared with.
    off : float
        Its frequency over that of the other at the same amplitudes, minus 1.
    sd : float
        Of that, by what springs and air change from run to run.
    """

    record: str
    other: str
    off: float
    sd: float

    @property
    def nats(self) -> float:
        """Log likelihood that it takes from records of one clock [nats]."""
        return 0.5 * (self.off / self.sd) ** 2

    @property
    def words(self) -> str:
        """What is seen, for people."""
        return f"{self.record} swings {100.0 * self.off:+.2g} % off {self.other} at the same amplitudes"


def wrong_clocks(data: GapData) -> tuple[WrongClock, ...]:
    """The record that is most out of step in every test, and in every rig in still air, beyond chance; worst first."""
    layout, found = data.layout, []
    together = defaultdict(list)
    for record, rig, test in zip(layout.records, layout.rig.tolist(), layout.test.tolist(), strict=True):
        together[rig, test].append(record)
    for records in together.values():
        pairs = list(_pairs(data, records))
        if not pairs:
            continue
        worst = max(pairs, key=lambda pair: pair.nats)
        away = {
            name: float(np.median([abs(pair.off) for pair in pairs if name in (pair.record, pair.other)]))
            for name in (worst.record, worst.other)
        }
        if away[worst.other] > away[worst.record]:
            worst = WrongClock(worst.other, worst.record, 1.0 / (1.0 + worst.off) - 1.0, worst.sd)
        if worst.nats > LINE_NATS:
            found.append(worst)
    return tuple(sorted(found, key=lambda one: -one.nats))


def _pairs(data: GapData, records: list[str]) -> Iterator[WrongClock]:
    for first, second in combinations(records, 2):
        tracks = data.cycles[first], data.cycles[second]
        high = min(float(track.amplitude.max()) for track in tracks)
        low = max(*(float(track.amplitude.min()) for track in tracks), CLOCK_LOWEST * high)
        inside = [
            (track.amplitude >= low) & (track.amplitude <= high) & np.isfinite(track.frequency / track.frequency_error)
            for track in tracks
        ]
        if min(map(np.count_nonzero, inside)) < CLOCK_CYCLES:
            continue
        (f, f_sd), (g, g_sd) = (_frequency(track, where) for track, where in zip(tracks, inside, strict=True))
        yield WrongClock(first, second, f / g - 1.0, float(np.sqrt(CLOCK_SD**2 + (f_sd / f) ** 2 + (g_sd / g) ** 2)))


def _frequency(track: Cycles, inside: np.ndarray) -> tuple[float, float]:
    weight = track.frequency_error[inside] ** -2.0
    return float(np.sum(weight * track.frequency[inside]) / weight.sum()), float(weight.sum() ** -0.5)
