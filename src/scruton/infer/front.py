"""The deterministic front end of a campaign: what a fit computes before any sampling, and a loaded fit when asked."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.campaign.schema import Campaign, Record, Rig
from scruton.envelope import Cycles, FrontEnd, RingDown, front_end, record_cycles, ring_down
from scruton.envelope.damping import StructuralDamping
from scruton.infer.thresholds import BAND_FLOOR, DAMPING_CERTAINTY, DAMPING_VARIATION

if TYPE_CHECKING:
    import xarray as xr


class Computed[Value](Mapping[str, Value]):
    """A mapping whose values are computed when they are first asked for, by `make` from the arguments of their keys."""

    def __init__(self, make: Callable[..., Value], arguments: Mapping[str, tuple[Any, ...]]) -> None:
        self._make, self._arguments = make, dict(arguments)
        self._values: dict[str, Value] = {}

    def __getitem__(self, key: str) -> Value:
        if key not in self._values:
            self._values[key] = self._make(*self._arguments[key])
        return self._values[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._arguments)

    def __len__(self) -> int:
        return len(self._arguments)


def cycles_of(campaign: Campaign, source: str) -> Mapping[str, Cycles]:
    """The envelope of every record, by its name; `source` is that of the model card."""
    records = campaign.records()
    return Computed(record_cycles, {record.name: (record, rig.frequency.mean, source) for record, rig, _ in records})


def ringdowns_of(campaign: Campaign, cycles: Mapping[str, Cycles]) -> Mapping[str, RingDown]:
    """The damping in still air of every rig that has free-decay records, by its name."""

    def damping(rig: Rig) -> RingDown:
        return ring_down([cycles[record.name] for record in rig.records])

    return Computed(damping, {rig.name: (rig,) for rig in campaign.rigs if rig.records})


def damping_varies(ringdown: RingDown) -> tuple[int, int] | None:
    """Indices of the bands between which damping changes most, if it does; None where one constant will do.

    The means of two bands differ by what damping changes between their middles; how much it changes over all of both
    follows in proportion to ln A, and is what counts: twice as much for neighbours, 1.5 times with one between.
    """
    bands = ringdown.bands
    xi = np.array([band.damping_ratio for band in bands])
    error = np.array([np.hypot(band.sd / np.sqrt(band.plucks), BAND_FLOOR * abs(band.damping_ratio)) for band in bands])
    lower, upper = (np.log([getattr(band, end) for band in bands]) for end in ("lower", "upper"))
    middle = 0.5 * (lower + upper)
    worst, pair = 0.0, None
    for i in range(len(bands)):
        for j in range(i):
            gap = abs(xi[i] - xi[j])
            ratio = gap / np.hypot(error[i], error[j])
            change = gap * (upper[j] - lower[i]) / (middle[j] - middle[i])
            if ratio > max(worst, DAMPING_CERTAINTY) and change > DAMPING_VARIATION * 0.5 * abs(xi[i] + xi[j]):
                worst, pair = ratio, (j, i)
    return pair


def front_ends_of(campaign: Campaign, tree: "xr.DataTree", ringdowns: Mapping[str, RingDown]) -> Mapping[str, FrontEnd]:
    """Eqs. (2) to (8) on every record that has a trial function in the tree, by its name."""
    if "trial_function" not in tree:
        return {}
    records = {record.name: (record, test.name) for test in campaign.tests for record in test.records}
    names = tree["trial_function"]["record"].to_numpy().tolist()
    return Computed(partial(_front_end, campaign, tree, ringdowns), {name: records[name] for name in names})


def _front_end(
    campaign: Campaign, tree: "xr.DataTree", ringdowns: Mapping[str, RingDown], record: Record, test: str
) -> FrontEnd:
    """Eqs. (2) to (8), with xi_s(A) from the ring-downs in Eq. (6) where it varies, else the constant's median."""
    posterior = tree["posterior"].to_dataset().sel(test=test)
    rig = campaign.rig(campaign.test(test).rig)
    ringdown = ringdowns.get(rig.name)
    damping: StructuralDamping = float(np.median(posterior["damping_ratio"]))
    if ringdown is not None and damping_varies(ringdown) is not None:
        damping = ringdown.structural_damping
    return front_end(
        record,
        frequency=float(tree["constant_data"]["wind_frequency"].sel(test=test)),
        still_air_frequency=rig.frequency.mean,
        damping_ratio=damping,
        mass_damping_factor=float(np.median(posterior["mass_damping_factor"])),
    )
