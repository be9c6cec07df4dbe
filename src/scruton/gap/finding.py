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

        def pair(ends: Range | None) -> list[float] | None:
            return None if ends is None else [float(f"{x:.6g}") for x in ends]

        return {
            "quantity": self.quantity, "rig": self.rig, "test": self.test, "record": self.record,
            "amplitude": pair(self.amplitude), "time_s": pair(self.time), "excess": float(f"{self.excess:.6g}"),
            "interval90": pair(self.interval90), "significance": float(f"{self.significance:.4g}"),
            "detail": self.detail, "effect": self.effect,
        }  # fmt: skip


def interval(value: float, sd: float) -> Range:
    """90 % interval of a normal distribution."""
    return (float(value - Z90 * sd), float(value + Z90 * sd))


def of_record(
    data: GapData,
    record: int,
    quantity: str,
    value: float,
    sd: float,
    detail: str,
    *,
    kind: str = "",
    **other: Any,
) -> Finding:
    """A finding in one record, over all of its amplitudes and time unless `other` fields of it say more."""
    rig, test, name = names_of(data, record)
    alone = np.arange(len(data.layout.records)) == record
    fields: dict[str, Any] = {
        "amplitude": amplitudes_of(data, alone), "time": time_of(data, record), "significance": float(abs(value) / sd)
    }  # fmt: skip
    return Finding(
        quantity, rig, test, name, excess=float(value), interval90=interval(value, sd), detail=detail, kind=kind,
        **(fields | other),
    )  # fmt: skip


def names_of(data: GapData, record: int) -> tuple[str, str | None, str]:
    """Rig, test (None in still air) and name of a record."""
    layout = data.layout
    test = int(layout.test[record])
    return data.rigs[layout.rig[record]], data.tests[test] if test >= 0 else None, layout.records[record]


def amplitudes_of(data: GapData, records: np.ndarray) -> Range:
    """Range of the amplitudes that can be told from noise in some records, (R,) of bool."""
    channels = data.channels
    mine = records[channels.record]
    a, se = channels.amplitude[mine], channels.standard_error[mine]
    clear = a[a > 5.0 * se]
    clear = a if clear.size == 0 else clear
    return float(clear.min()), float(clear.max())


def time_of(data: GapData, record: int, amplitude: Range | None = None) -> Range:
    """First and last moment of a record, or those between which its amplitude lies in a range [s]."""
    one = data.cycles[data.layout.records[record]]
    time = one.time
    if amplitude is not None:
        inside = (one.amplitude >= amplitude[0]) & (one.amplitude <= amplitude[1])
        time = time[inside] if inside.any() else time
    return float(time[0]), float(time[-1])
