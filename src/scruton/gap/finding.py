"""One place where the bare model and the measurement part."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from scruton.gap.data import GapData

Range = tuple[float, float]
Z90 = 1.6448536269514722  # of a two-sided 90 % interval


@dataclass(frozen=True)
class Finding:
    """One place where the bare model and the measurement part.

    Attributes
    ----------
    quantity : {"damping", "frequency", "scatter", "spectrum", "branch", "test", "signal"}
    rig, test, record : str or None
        None where the finding belongs to no single one; `test` is None in still air, too.
    amplitude : (float, float) or None
        A/D or rad.
    time : (float, float) or None
        On the record's own clock [s].
    excess : float
        Measured minus bare model: of the damping ratio (`damping`, `branch`: growth minus decay, `test`), relative
        (`frequency`, `scatter`, `signal`), or an amplitude in A/D or rad (`spectrum`).
    interval90 : (float, float)
    significance : float
        Standard errors from nothing.
    detail : str
        What it is, for people.
    effect : str or None
        Effect of the verdict whose scope this tells; None for what was found without a look at the verdict.
    kind : str
        What was looked for: of findings of one kind in several records of a test, one stands for all.
    """

    quantity: str
    rig: str | None
    test: str | None
    record: str | None
    amplitude: Range | None
    time: Range | None
    excess: float
    interval90: Range
    significance: float
    detail: str
    effect: str | None = None
    kind: str = ""

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
    test = int(layout.test[number])
    usual = {
        "rig": data.rigs[layout.rig[number]],
        "test": data.tests[test] if test >= 0 else None,
        "record": layout.records[number],
        "amplitude": amplitudes_of(data, np.arange(len(layout.records)) == number),
        "time": time_of(data, number),
        "excess": float(value),
        "interval90": (float(value - Z90 * sd), float(value + Z90 * sd)),
        "significance": float(abs(value) / sd),
    }
    return Finding(quantity, detail=detail, **(usual | fields))


def amplitudes_of(data: GapData, records: np.ndarray) -> Range:
    """Range of the amplitudes that can be told from noise in some records, (R,) of bool."""
    mine = data.channels.keep(records[data.channels.record])
    clear = mine.amplitude[mine.amplitude > 5.0 * mine.standard_error]
    clear = mine.amplitude if clear.size == 0 else clear
    return float(clear.min()), float(clear.max())


def time_of(data: GapData, record: int, amplitude: Range | None = None) -> Range:
    """First and last moment of a record, or those between which its amplitude lies in a range [s]."""
    one = data.cycles[data.layout.records[record]]
    time = one.time
    if amplitude is not None:
        inside = (one.amplitude >= amplitude[0]) & (one.amplitude <= amplitude[1])
        time = time[inside] if inside.any() else time
    return float(time[0]), float(time[-1])
