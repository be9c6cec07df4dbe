"""One place where the null model and the measurement part."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from scruton.gap.data import GapData
from scruton.gap.stated import clear

Range = tuple[float, float]
Z90 = 1.6448536269514722  # of a two-sided 90 % interval


@dataclass(frozen=True)
class Finding:
    """One place where the null model and the measurement part: an entry of `where` in gap.json.

    The excess is measured minus null model: of the damping ratio (`damping`, `branch`: growth minus decay, `test`),
    relative (`frequency`, `scatter`, `signal`), or an amplitude in A/D or rad (`spectrum`).
    """

    quantity: str  # damping, frequency, scatter, spectrum, branch, test or signal
    rig: str | None  # as `test` and `record`, None where the finding belongs to no single one
    test: str | None  # None in still air, too
    record: str | None
    amplitude: Range | None  # A/D or rad
    time: Range | None  # on the record's own clock [s]
    excess: float
    interval90: Range
    significance: float  # standard errors from nothing
    detail: str  # for people
    effect: str | None = None  # of the verdict, whose scope this tells; None: found without a look at the verdict
    kind: str = ""  # what was looked for: of one kind in several records of a test, one stands for all

    def to_json(self) -> dict[str, Any]:
        """Return the entry of `where` in gap.json."""

        def rounded(value: Any) -> Any:
            if isinstance(value, tuple):
                return [rounded(end) for end in value]
            return float(f"{value:.6g}") if isinstance(value, float) else value

        shown = {"time_s" if name == "time" else name: rounded(value) for name, value in vars(self).items()}
        del shown["kind"]
        return shown | {"significance": float(f"{self.significance:.4g}")}


def place(data: GapData, number: int, quantity: str, value: float, sd: float, detail: str, **fields: Any) -> Finding:
    """A finding in the record of a number, over all of its amplitudes and time, unless `fields` say otherwise."""
    layout = data.layout
    name = layout.records[number]
    usual = {
        "rig": data.rigs[layout.rig[number]],
        "test": next((of.name for one, _, of in data.campaign.records() if of is not None and one.name == name), None),
        "record": name,
        "amplitude": amplitudes_of(data, np.arange(len(layout.records)) == number),
        "time": time_of(data, number),
        "excess": float(value),
        "interval90": (float(value - Z90 * sd), float(value + Z90 * sd)),
        "significance": float(abs(value) / sd),
    }
    return Finding(quantity, detail=detail, **(usual | fields))


def alike(findings: Iterable[Finding], key: Callable[[Finding], object]) -> Iterable[list[Finding]]:
    """Findings that share a key, in the order of the first of each."""
    kinds: dict[object, list[Finding]] = {}
    for finding in findings:
        kinds.setdefault(key(finding), []).append(finding)
    return kinds.values()


def amplitudes_of(data: GapData, records: np.ndarray) -> Range:
    """Range of the amplitudes that can be told from noise in some records, (R,) of bool."""
    return amplitudes_in(data, records[data.channels.record])


def amplitudes_in(data: GapData, cycles: np.ndarray) -> Range:
    """The same in some cycles, (N,) of bool."""
    channels = data.channels.keep(cycles)
    seen = clear(channels)
    amplitude = channels.amplitude[seen] if seen.any() else channels.amplitude
    return float(amplitude.min()), float(amplitude.max())


def time_of(data: GapData, record: int, amplitude: Range | None = None) -> Range:
    """First and last moment of a record, or those between which its amplitude lies in a range [s]."""
    cycles = data.cycles[data.layout.records[record]]
    time = cycles.time
    if amplitude is not None:
        inside = (cycles.amplitude >= amplitude[0]) & (cycles.amplitude <= amplitude[1])
        time = time[inside] if inside.any() else time
    return float(time[0]), float(time[-1])
