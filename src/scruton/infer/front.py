"""The deterministic front end of a campaign: what a fit computes before any sampling, and a loaded fit when asked."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from scruton.campaign.schema import Campaign, Record, Rig
from scruton.envelope import Cycles, FrontEnd, RingDown, front_end, record_cycles, ring_down
from scruton.infer.flags import damping_varies

if TYPE_CHECKING:
    import xarray as xr


class Computed[Value](Mapping[str, Value]):
    """A mapping whose values are computed when they are first asked for.

    Parameters
    ----------
    makers : mapping
        By key, what computes the value.
    """

    def __init__(self, makers: Mapping[str, Callable[[], Value]]) -> None:
        self._makers = dict(makers)
        self._values: dict[str, Value] = {}

    def __getitem__(self, key: str) -> Value:
        if key not in self._values:
            self._values[key] = self._makers[key]()
        return self._values[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._makers)

    def __len__(self) -> int:
        return len(self._makers)


def cycles_of(campaign: Campaign) -> Mapping[str, Cycles]:
    """The envelope of every record, by its name."""
    frequency = {rig.name: rig.frequency.mean for rig in campaign.rigs}
    still = [(record, frequency[rig.name]) for rig in campaign.rigs for record in rig.records]
    wind = [(record, frequency[test.rig]) for test in campaign.tests for record in test.records]
    return Computed({record.name: partial(record_cycles, record, f0) for record, f0 in (*still, *wind)})


def ringdowns_of(campaign: Campaign, cycles: Mapping[str, Cycles]) -> Mapping[str, RingDown]:
    """The damping in still air of every rig that has free-decay records, by its name."""
    return Computed({rig.name: partial(_ringdown, rig, cycles) for rig in campaign.rigs if rig.records})


def _ringdown(rig: Rig, cycles: Mapping[str, Cycles]) -> RingDown:
    return ring_down([cycles[record.name] for record in rig.records])


def front_ends_of(campaign: Campaign, tree: "xr.DataTree", ringdowns: Mapping[str, RingDown]) -> Mapping[str, FrontEnd]:
    """Eqs. (2) to (8) on every record that has a trial function in the tree, by its name."""
    if "trial_function" not in tree:
        return {}
    names: Iterable[str] = map(str, tree["trial_function"]["record"].to_numpy())
    records = {record.name: (record, test.name) for test in campaign.tests for record in test.records}
    return Computed({name: partial(_front_end, *records[name], campaign, tree, ringdowns) for name in names})


def _front_end(
    record: Record, test: str, campaign: Campaign, tree: "xr.DataTree", ringdowns: Mapping[str, RingDown]
) -> FrontEnd:
    posterior = tree["posterior"].to_dataset().sel(test=test)
    rig = campaign.rig(campaign.test(test).rig)
    return front_end_of_record(
        record,
        rig,
        ringdowns.get(rig.name),
        wind_frequency=float(tree["constant_data"]["wind_frequency"].sel(test=test)),
        damping_ratio=float(np.median(posterior["damping_ratio"])),
        mass_damping_factor=float(np.median(posterior["mass_damping_factor"])),
    )


def front_end_of_record(
    record: Record,
    rig: Rig,
    ringdown: RingDown | None,
    *,
    wind_frequency: float,
    damping_ratio: float,
    mass_damping_factor: float,
) -> FrontEnd:
    """Eqs. (2) to (8) on one transient record.

    The structural damping in Eq. (6) is xi_s(A) from the ring-downs where it varies with amplitude, else
    `damping_ratio`, the posterior median of the constant.
    """
    varies = ringdown is not None and damping_varies(ringdown) is not None
    return front_end(
        record,
        frequency=wind_frequency,
        still_air_frequency=rig.frequency.mean,
        damping_ratio=ringdown.structural_damping if ringdown is not None and varies else damping_ratio,
        mass_damping_factor=mass_damping_factor,
    )
