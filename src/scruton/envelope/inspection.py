"""A campaign with what its records show: what remarks rest on."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.schema import Campaign, Kind, Record, Rig, Test
from scruton.envelope.clipping import CLIPPED, unclipped
from scruton.envelope.cycles import demodulate
from scruton.envelope.extracted import cycles_from_envelope
from scruton.envelope.lasting_modes import remark_on_lasting, without_lasting_modes
from scruton.envelope.natural_frequency import retuned
from scruton.envelope.other_modes import Tracked, remark_on, without_other_modes, without_suspected_modes
from scruton.envelope.quality import RecordQuality, assess
from scruton.envelope.ringdown import RingDown, ring_down
from scruton.envelope.stillness import LeftOut, moving, unspoiled, without_samples
from scruton.envelope.thresholds import FALLS, NYQUIST, RISES, STATED_SD
from scruton.envelope.transient import front_end_cycles
from scruton.envelope.types import Cycles
from scruton.envelope.vibrates import check_vibrates
from scruton.errors import InputError
from scruton.shown import fields_in_brief, shown

SET_ASIDE = "set aside"  # kind of the remarks on records that are left out
REGRESSION, FRONT_END = "regression", "front-end"
# What makes one amplitude a cycle of a record.
SOURCES = {REGRESSION: demodulate, FRONT_END: front_end_cycles}


@shown(fields_in_brief)
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
        return (row for row in self.campaign.records() if row[0].name in self.qualities)


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
        found, wanted = error.found, error.wanted
        rate = (
            (record.time.size - 1) / max(float(record.time[-1] - record.time[0]), 1e-300) if record.time.size else 0.0
        )
        if 0.0 < rate < NYQUIST * still_air_frequency and not record.is_envelope:
            found = (
                f"{rate:.4g} samples a second, {rate / still_air_frequency:.2g} per cycle of the f0 = "
                f"{still_air_frequency:.4g} Hz stated (any line is an alias: {found})"
            )
            wanted = f"at least six samples per cycle of f0, {6.0 * still_air_frequency:.3g} a second"
        raise InputError(record.path, record.field, found, wanted) from error


def weigh(
    campaign: Campaign, cycles: Mapping[str, Cycles], ringdowns: Mapping[str, RingDown], stated_sd: float = STATED_SD
) -> Inspection:
    """Measure every record whose cycles are at hand."""
    qualities = {}
    for record, _, test in campaign.records():
        if record.name in cycles:
            stable = test.stable_amplitude.mean if test is not None and test.stable_amplitude else None
            qualities[record.name] = assess(record, cycles[record.name], stable_amplitude=stable)
    return Inspection(campaign, cycles, qualities, ringdowns, stated_sd)


def usable(
    campaign: Campaign,
    source: str = REGRESSION,
    *,
    strict: bool = False,
    plucks: bool = True,
    clipped: bool = False,
) -> tuple[Campaign, dict[str, Cycles]]:
    """Demodulate every record; one that shows no motion to measure is set aside, and the campaign's remarks say so.

    Parameters
    ----------
    campaign : Campaign
    source : str
        What makes one amplitude a cycle: a key of `SOURCES`.
    strict : bool
        Set nothing aside.
    plucks : bool
        Whether still-air records that oscillate but show no damping are set aside, too.
    clipped : bool
        Whether cycles that the sensor cut off are kept, and growths whole that fall first: a diagnosis needs them.

    Returns
    -------
    Campaign, dict of str to Cycles
        The campaign with the records that can be used, and their envelopes by name.

    Raises
    ------
    InputError
        For the first record that cannot be used, where it is `strict`, no other is left (in wind, where there are
        some), or only its records would tell the damping of a rig; for a rig whose free decays are of another frequency
        altogether than stated (`retuned`).
    """
    campaign = moving(campaign)
    campaign = unspoiled(campaign)
    campaign, cycles = _sifted(campaign if clipped else unclipped(campaign), source, strict, plucks)
    tuned = retuned(campaign, cycles, refuse=plucks)
    if tuned is not campaign:
        before = cycles
        campaign, cycles = _sifted(tuned, source, strict, plucks)
        cycles = {name: one.also_without(before[name].released, before[name].lasting) for name, one in cycles.items()}
    return _from_there(campaign, cycles, source, (_pushed,) if clipped else (_pushed, _fallen))


Envelopes = dict[str, Cycles]


def _fallen(cycles: Envelopes, record: Record) -> LeftOut | None:
    """What comes before the lowest cycle of a growth that falls far before it grows.

    A body that is released out of step with its wake works against it at first: no damping that depends on the
    amplitude alone lets it pass one amplitude in both directions.
    """
    if record.kind is not Kind.GROWTH:
        return None
    track = cycles[record.name]
    lowest = int(np.argmin(track.amplitude))
    if not 0 < lowest < track.amplitude.size // 2:
        return None
    low, first = max(float(track.amplitude[lowest]), 0.0), float(track.amplitude[0])  # less noise, they may be negative
    if not low < FALLS * first:
        return None
    part = low / first
    alike = "falls to {} of its first amplitude before it grows, and is used from there on"
    told = f"{alike.format(f'{part:.0%}')} (a body released out of step with its wake)."
    gone = record.time < track.part(slice(lowest, None)).begin
    return gone, Remark(Severity.DOUBT, "falls", "record", record.name, told, f"{alike},", part)


def _pushed(cycles: Envelopes, record: Record) -> LeftOut | None:
    """What a decay has up to its largest cycle, that included, where it rises far before it falls: a push by hand."""
    if record.kind not in (Kind.DECAY, Kind.FREE_DECAY):
        return None
    track = cycles[record.name]
    largest = int(np.argmax(track.amplitude))
    if not 0 < largest < track.amplitude.size // 2:
        return None
    part = float(track.amplitude[0] / track.amplitude[largest])
    if part >= RISES:
        return None
    alike = "starts at {} of its largest amplitude and rises before it decays (a push), and is used from there on"
    gone = record.time < track.part(slice(largest + 1, None)).begin
    told = f"{alike.format(f'{part:.0%}')}."
    return gone, Remark(Severity.DOUBT, "pushed", "record", record.name, told, f"{alike},", part)


def _from_there(
    campaign: Campaign,
    cycles: Envelopes,
    source: str,
    rules: Sequence[Callable[[Envelopes, Record], LeftOut | None]],
) -> tuple[Campaign, Envelopes]:
    """The records from the cycle on that one of the rules says, and the remarks that say so."""

    def left_out(record: Record, _: float) -> LeftOut | None:
        return next(filter(None, (rule(cycles, record) for rule in rules)), None)

    rest = without_samples(campaign, left_out)
    cut = {remark.name for remark in rest.remarks[len(campaign.remarks) :]}
    known = dict(cycles)
    for record, rig, _ in rest.records():
        if record.name in cut:
            before, now = cycles[record.name], record_cycles(record, rig.frequency.mean, source)
            known[record.name] = now.also_without(before.released, before.lasting)
    return rest, known


def _sifted(campaign: Campaign, source: str, strict: bool, plucks: bool) -> tuple[Campaign, dict[str, Cycles]]:
    """What `usable` gives of the records as they are."""
    told: dict[str, Tracked] = {}
    failures: dict[str, InputError] = {}
    modes: list[Remark] = []
    clipped = {remark.name for remark in campaign.remarks if remark.kind == CLIPPED}

    def again(rig: Rig) -> partial[Cycles]:
        return partial(record_cycles, still_air_frequency=rig.frequency.mean, source=source)

    for record, rig, test in campaign.records():
        try:
            track = record_cycles(record, rig.frequency.mean, source)
            if test is None and plucks:
                _check_ring_down(record, track)
            if test is not None:
                check_vibrates(record, track, campaign.section.amplitude_unit)
            cleared = without_other_modes(Tracked(record, track), again(rig))
            told[record.name] = without_lasting_modes(cleared, again(rig))
        except InputError as error:
            found = error.found + (" beside the cycles that are clipped" if record.name in clipped else "")
            failures[record.name] = InputError(error.file, error.field, found, error.wanted)
    suspected = [mode for one in told.values() for mode in one.cycles.released]
    for record, rig, _ in campaign.records():
        if record.name not in told:
            continue
        one = told[record.name] = without_suspected_modes(told[record.name], again(rig), suspected)
        if one.cycles.released:
            modes.append(remark_on(record, one.cycles.released))
        if one.cycles.lasting:
            modes.append(remark_on_lasting(record, one.cycles))
    cycles = {name: one.cycles for name, one in told.items()}
    if not failures and all(told[record.name].record is record for record, _, _ in campaign.records()):
        return campaign, cycles

    def kept(records: tuple[Record, ...]) -> tuple[Record, ...]:
        return tuple(told[record.name].record for record in records if record.name in told)

    rigs = tuple(replace(rig, records=kept(rig.records)) for rig in campaign.rigs)
    bare = [
        rig
        for rig, left in zip(campaign.rigs, rigs, strict=True)
        if rig.records and not left.records and not rig.damping_ratio
    ]
    needed = [record.name for rig in bare for record in rig.records]
    in_wind = [record.name for record, _, test in campaign.records() if test is not None]
    if cycles and not needed and not any(name in cycles for name in in_wind):
        needed = in_wind
    if failures and (strict or not cycles or needed):
        raise failures[needed[0] if needed else next(iter(failures))]
    remarks = (*campaign.remarks, *modes, *(_set_aside(name, error) for name, error in failures.items()))
    tests = tuple(replace(test, records=kept(test.records)) for test in campaign.tests)
    return replace(campaign, rigs=rigs, tests=tests, remarks=remarks), cycles


def _check_ring_down(record: Record, cycles: Cycles) -> None:
    """InputError for a pluck that shows no damping."""
    try:
        ring_down([cycles])
    except InputError as error:
        raise InputError(record.path, record.field, error.found, error.wanted) from error


def _set_aside(name: str, error: InputError) -> Remark:
    reason = f"set aside: {error.found}, where {error.wanted} is wanted"
    return Remark(Severity.SERIOUS, SET_ASIDE, "record", name, f"{reason}.", f"{reason},")


def gather(campaign: Campaign, problems: list[InputError] | None = None) -> Inspection:
    """Demodulate and measure every record; one that cannot be used is set aside as by `usable`.

    Where nothing can be used, or nothing can be left out, that is appended to `problems` (raised where there are none).
    """
    try:
        # a pluck that never decays is remarked on by its kind
        campaign, cycles = usable(campaign, plucks=False)
    except InputError as error:
        if problems is None:
            raise
        problems.append(error)
        return Inspection(campaign, {}, {}, {})
    ringdowns = {}
    for rig in campaign.rigs:
        plucks = [cycles[record.name] for record in rig.records if record.name in cycles]
        with suppress(InputError):
            if plucks:
                ringdowns[rig.name] = ring_down(plucks)
    return weigh(campaign, cycles, ringdowns)
