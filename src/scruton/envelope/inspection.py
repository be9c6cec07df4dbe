"""A campaign with what its records show: what remarks rest on."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass

from scruton.campaign.schema import Campaign, Record, Rig, Test
from scruton.envelope.cycles import cycles_from_envelope, demodulate
from scruton.envelope.quality import RecordQuality, assess
from scruton.envelope.ringdown import RingDown, ring_down
from scruton.envelope.thresholds import STATED_SD
from scruton.envelope.transient import front_end_cycles
from scruton.envelope.types import Cycles
from scruton.errors import InputError

REGRESSION, FRONT_END = "regression", "front-end"
# What makes one amplitude a cycle of a record.
SOURCES = {REGRESSION: demodulate, FRONT_END: front_end_cycles}


@dataclass(frozen=True, eq=False)
class Inspection:
    """A campaign with what its records show; records that cannot be used are in none of the mappings.

    Attributes
    ----------
    campaign : Campaign
    cycles, qualities : mapping
        By record name.
    ringdowns : mapping
        By rig name.
    stated_sd : float
        Relative standard deviation of a damping ratio that is stated without one.
    """

    campaign: Campaign
    cycles: Mapping[str, Cycles]
    qualities: Mapping[str, RecordQuality]
    ringdowns: Mapping[str, RingDown]
    stated_sd: float = STATED_SD

    def records(self) -> Iterator[tuple[Record, Rig, Test | None]]:
        """Every record that can be used, with its rig and, in wind, its test."""
        return (row for row in records_of(self.campaign) if row[0].name in self.qualities)


def records_of(campaign: Campaign) -> Iterator[tuple[Record, Rig, Test | None]]:
    """Every record with its rig and, in wind, its test; still air first."""
    for rig in campaign.rigs:
        yield from ((record, rig, None) for record in rig.records)
    for test in campaign.tests:
        yield from ((record, campaign.rig(test.rig), test) for record in test.records)


def record_cycles(record: Record, still_air_frequency: float, source: str = REGRESSION) -> Cycles:
    """Cycle-wise envelope of a record, unless the file holds an amplitude already, by one of `SOURCES`.

    Raises
    ------
    InputError
        If the record cannot be used; it names the file and the record.
    """
    try:
        if record.is_envelope:
            return cycles_from_envelope(record.time, record.response, still_air_frequency)
        return SOURCES[source](record.time, record.response, near=still_air_frequency, band=record.band)
    except InputError as error:
        raise InputError(record.path, record.field, error.found, error.wanted) from error


def weigh(
    campaign: Campaign, cycles: Mapping[str, Cycles], ringdowns: Mapping[str, RingDown], stated_sd: float = STATED_SD
) -> Inspection:
    """Measure every record whose cycles are at hand."""
    qualities = {}
    for record, _, test in records_of(campaign):
        if record.name in cycles:
            stable = test.stable_amplitude.mean if test is not None and test.stable_amplitude else None
            qualities[record.name] = assess(record, stable_amplitude=stable, cycles=cycles[record.name])
    return Inspection(campaign, cycles, qualities, ringdowns, stated_sd)


def gather(campaign: Campaign, problems: list[InputError]) -> Inspection:
    """Demodulate and measure every record; what is wrong with one is appended to `problems`, and it is left out."""
    cycles: dict[str, Cycles] = {}
    for record, rig, _ in records_of(campaign):
        try:
            cycles[record.name] = record_cycles(record, rig.frequency.mean)
        except InputError as error:
            problems.append(error)
    ringdowns = {}
    for rig in campaign.rigs:
        plucks = [cycles[record.name] for record in rig.records if record.name in cycles]
        # a pluck that never decays is remarked on by its kind
        with suppress(InputError):
            if plucks:
                ringdowns[rig.name] = ring_down(plucks)
    return weigh(campaign, cycles, ringdowns)
