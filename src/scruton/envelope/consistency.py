"""Records held against what is stated, and against each other: the slips that only the envelopes tell.

`review` is the door: it collects every remark on a campaign, those of `scruton.campaign.plausibility` and of
`scruton.envelope.quality` among them.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.plausibility import AMPLITUDE, DAMPING, implausible, outside
from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.schema import Kind, Record, Test
from scruton.campaign.spelling import figure
from scruton.campaign.thresholds import FAR
from scruton.envelope import thresholds
from scruton.envelope.clipping import CLIPPED
from scruton.envelope.frequencies import apart_from_other_rigs, apart_in_one_test, off_stated, too_coarse
from scruton.envelope.inspection import Inspection
from scruton.envelope.ringdown import DampingBand, RingDown
from scruton.errors import InputError
from scruton.said import damping, said

# What a record of another kind, level or length than it is filed as would also be noted for.
CAUSES = ("kind", "stated level")
CONSEQUENCES = ("decay start", "growth start", "length")
LEFT_OUT = ("dead", "outlier", CLIPPED)  # what leaves gaps in a record
_TRANSIENTS = (Kind.GROWTH, Kind.DECAY)


def review(inspection: Inspection) -> list[Remark]:
    """Collect every remark on a campaign.

    Parameters
    ----------
    inspection : Inspection

    Returns
    -------
    list of Remark
        In no order; `scruton.campaign.remarks.sentences` ranks and folds.
    """
    slips = [*implausible(inspection.campaign), *(remark for check in CHECKS for remark in check(inspection))]
    slipped = {remark.name for remark in slips if remark.kind in CAUSES}
    of = {**dict.fromkeys(CONSEQUENCES, slipped), "gap": {one.name for one in slips if one.kind in LEFT_OUT}}
    notes = [remark for quality in inspection.qualities.values() for remark in quality.remarks]
    return slips + [note for note in notes if note.name not in of.get(note.kind, ())]


def _kind(inspection: Inspection) -> Iterator[Remark]:
    """A growth that was filed as a decay, or the reverse, by its ends and the exponential fitted to its envelope.

    An exponential that is led on from a part of a record may be anything at the other end, also below zero.
    """
    for record, _, _ in inspection.records():
        quality = inspection.qualities[record.name]
        fitted = quality.relaxation
        if fitted is None or quality.swing:
            continue
        duration = float(record.time[-1] - record.time[0])
        start = fitted.first_amplitude
        end = fitted.stable_amplitude + (start - fitted.stable_amplitude) * math.exp(-fitted.rate * duration)
        first, last = _measured_ends(inspection.cycles[record.name].amplitude)
        ratio = max(last, 1e-300) / max(first, 1e-300)
        ratios = ratio, max(end, 1e-300) / max(start, 1e-300)
        rises = record.kind is Kind.GROWTH
        if max(ratios) < 1.0 / thresholds.TREND if rises else min(ratios) > thresholds.TREND:
            word = "falls" if rises else "grows"
            beat = "; two motions of nearly one frequency do that, by beating" if record.kind is Kind.FREE_DECAY else ""
            # a release or an end within the record: its ends are none of the transient's
            if (largest := quality.amplitude_range[1]) > thresholds.BETWEEN * max(first, last):
                beat = f", with {largest:.3g} between them: start and stop choose the part that is one"
            yield Remark(
                Severity.SERIOUS, "kind", "record", record.name,
                f'filed as "{record.kind.value}", but the amplitude {word} from {first:.3g} to {last:.3g}{beat}.',
                f'filed as "{record.kind.value}", but the amplitude {word}', ratio, max(ratio, 1.0 / ratio),
            )  # fmt: skip


def _measured_ends(amplitude: FloatArray) -> tuple[float, float]:
    """Amplitude over the first and over the last five cycles; none below zero, as noise makes it."""
    return max(float(np.mean(amplitude[:5])), 0.0), max(float(np.mean(amplitude[-5:])), 0.0)


def check_units(inspection: Inspection) -> None:
    """InputError for the first of what `of_other_units` tells."""
    for fault in of_other_units(inspection):
        raise fault


def of_other_units(inspection: Inspection) -> Iterator[InputError]:
    """What can only have another unit, so that nothing fits it: a damping ratio, time or amplitude of a record in wind.

    The ring-downs show another damping altogether; the record's line is at another frequency altogether than the
    rig's, or the test's other records stand at another level.
    """
    for number, rig in enumerate(inspection.campaign.rigs):
        ringdown = inspection.ringdowns.get(rig.name)
        if ringdown is None or rig.damping_ratio is None:
            continue
        stated = rig.damping_ratio.mean
        _, nearest = _miss(stated, 0.0, ringdown)
        if nearest > 0.0 and not 1.0 / thresholds.ANOTHER_DAMPING < stated / nearest < thresholds.ANOTHER_DAMPING:
            yield InputError(
                inspection.campaign.path, f"rigs[{number}].damping_ratio",
                f"{stated:g}, {figure(stated / nearest)} times the {nearest:.3g} of its ring-downs",
                "a ratio, of which per cent are a hundred times as many, or ring-downs of this rig",
            )  # fmt: skip
    for record, rig, test in inspection.records():
        line, stated = inspection.cycles[record.name].reference_frequency, rig.frequency.mean
        if test is not None and not 1.0 / thresholds.ANOTHER_UNIT < line / stated < thresholds.ANOTHER_UNIT:
            slower = abs(1000.0 * line / stated - 1.0) < thresholds.A_THOUSAND
            faster = abs(line / (1000.0 * stated) - 1.0) < thresholds.A_THOUSAND
            likely = "its time is in ms, read as s" if slower else "its time is in s, read as ms" if faster else ""
            yield InputError(
                record.path, record.field, f"a line at {line:.4g} Hz, {figure(line / stated)} times the f0 of its rig",
                f"a motion near {stated:.4g} Hz: {likely or 'the unit of the time, the sample rate, or another record'}"
            )  # fmt: skip
    for test in inspection.campaign.tests:
        growth, decay, ratio = _farthest(test, inspection)
        pairs = [(growth, decay, ratio)] if growth and decay else []
        pairs += [(steady, end, max(factor, 1.0 / factor)) for steady, end, factor in _steady_apart(test, inspection)]
        for one, other, factor in pairs:
            if one.falls or other.falls:  # it has another state to go to, rest: no unit turns a growth round
                continue
            limit = thresholds.ANOTHER_UNIT * (1.0 if one.settled and other.settled else thresholds.EXTRAPOLATED)
            if factor > limit:
                record = next(record for record in test.records if record.name == one.name)
                yield InputError(
                    record.path, record.field,
                    f"an amplitude of {one.level:.3g}, a factor {figure(factor)} off the {other.level:.3g} of "
                    f"{other.name} in the same test {test.name}",
                    "two records in the units that are stated for them: mend the unit or scale of one, or leave out "
                    "one that was cut while its amplitude still swings",
                )  # fmt: skip


def _levels(inspection: Inspection) -> Iterator[Remark]:
    """Growths and decays of one test, which must end at one amplitude."""
    for test in inspection.campaign.tests:
        growth, decay, ratio = _farthest(test, inspection)
        if growth is None or decay is None or ratio <= 1.0:
            continue
        yield Remark(
            Severity.SERIOUS if ratio > FAR else Severity.DOUBT, "levels", "test", test.name,
            f"growth and decay settle at amplitudes that differ by a factor {ratio:.3g} ({growth.name} at "
            f"{growth.level:.3g}, {decay.name} at {decay.level:.3g}): a unit or gain of one of them, or two stable "
            "amplitudes.",
            "growth and decay settle at amplitudes that differ by a factor {}", ratio, ratio / thresholds.LEVELS,
        )  # fmt: skip


def _farthest(test: Test, inspection: Inspection) -> "tuple[_End | None, _End | None, float]":
    """The growth and the decay of a test whose levels contradict each other most, and by what factor."""
    ends = {kind: _ends(test, inspection, kind) for kind in _TRANSIENTS}
    beside = [
        (growth.beside(decay.tail), decay.beside(growth.tail, growth.rate))
        for growth in ends[Kind.GROWTH]
        for decay in ends[Kind.DECAY]
    ]
    pairs = [(growth, decay, _apart(growth, decay)) for growth, decay in beside]
    return max(pairs, key=lambda pair: pair[2], default=(None, None, 1.0))


@dataclass(frozen=True)
class _End:
    """Where a transient ends: its mean over the last quarter, and the level that it settles at or heads for.

    Neither is known, as `heads_for` says, of one that does not bend yet.
    `falls` says of a growth that its last quarter lies below its first cycles, by more than gusts explain.
    `rate` [1/s] is that of its exponential, where that has settled; `moves` is the change of ln A from the last eighth
    of the record but one to the last, `moved` that from the first cycles to the last quarter.
    """

    name: str
    tail: float
    level: float
    settled: bool
    heads_for: bool = True
    rate: float = 0.0
    duration: float = 0.0
    moves: float = 0.0
    moved: float = 0.0
    falls: bool = False

    @classmethod
    def of(cls, record: Record, inspection: Inspection) -> "_End":
        amplitude, fitted = inspection.cycles[record.name].amplitude, inspection.qualities[record.name].relaxation
        tail = float(np.mean(amplitude[-max(3, len(amplitude) // 4) :]))
        assert fitted is not None  # growths and decays have one
        duration = float(record.time[-1] - record.time[0])
        settled = fitted.rate * duration >= thresholds.SETTLED
        # a trend that is led on to nothing, or does not bend, says nothing of the level
        leads_on = fitted.bends and fitted.stable_amplitude > 0.0 and not settled
        level = fitted.stable_amplitude if leads_on else tail
        eighth = max(2, len(amplitude) // 8)
        means = (np.mean(part) for part in (amplitude[:5], amplitude[-2 * eighth : -eighth], amplitude[-eighth:]))
        first, before, last = (math.log(max(float(mean), 1e-300)) for mean in means)
        moves, change = abs(last - before), math.log(max(tail, 1e-300)) - first
        rate = fitted.rate if settled else 0.0
        falls = record.kind is Kind.GROWTH and change < -math.log(thresholds.TREND)
        return cls(record.name, tail, level, settled, leads_on or settled, rate, duration, moves, abs(change), falls)

    def beside(self, level: float, rate: float = 0.0) -> "_End":
        """What it says where another has this level: that it stands, however it came there, if it moves too little.

        Its own exponential does not tell that of a growth in proportion to the amplitude, which bends late, nor of a
        decay that is over after a few cycles, where it follows the gusts. A decay has settled, too, after the time in
        which a growth does, at the `rate` of that one: no law of one level has it relax more slowly.
        """
        to_go = abs(math.log(self.tail / level))
        stands = self.moves <= thresholds.STILL_MOVES * min(self.moved, to_go)
        if self.settled or not (stands or rate * self.duration >= thresholds.SETTLED):
            return self
        return replace(self, level=self.tail, settled=True, heads_for=True)


def _ends(test: Test, inspection: Inspection, *kinds: Kind) -> list[_End]:
    """Where the transients of a test end, kind by kind, those left out that end in nothing."""
    records = (record for kind in kinds for record in test.records if record.kind is kind)
    usable = (record for record in records if record.name in inspection.qualities)
    return [end for end in (_End.of(record, inspection) for record in usable) if end.tail > 0.0]


def _apart(growth: _End, decay: _End) -> float:
    """Factor between the levels of a growth and a decay where it contradicts; 1 where it does not.

    A growth that has not settled yet lies below, and a decay above: only the other order contradicts, unless what the
    growth heads for, too, lies far below that of the decay.
    """
    below = decay.level / growth.level
    if growth.settled and decay.settled:
        factor = max(below, 1.0 / below)
        return factor if factor > thresholds.LEVELS else 1.0
    if growth.heads_for and decay.heads_for and below > thresholds.EXTRAPOLATED:
        return below
    crossed = growth.tail / decay.tail
    return crossed if crossed > thresholds.LEVELS else 1.0


def _steady_apart(test: Test, inspection: Inspection) -> "Iterator[tuple[_End, _End, float]]":
    """Lock-in records of a test, each with the transient that settles farthest from it and the ratio to that."""
    ends = _ends(test, inspection, *_TRANSIENTS)
    for record in test.records:
        if record.kind is not Kind.STEADY or record.name not in inspection.qualities:
            continue
        level = float(np.median(inspection.cycles[record.name].amplitude))
        if settled := _settled(ends, level):
            yield _End(record.name, level, level, True), *_farthest_from(level, settled)


def _settled(ends: Iterable[_End], level: float) -> list[_End]:
    """Those that have settled, or stand off a level that is compared with them."""
    return [end for end in (one.beside(level) for one in ends) if end.settled]


def _farthest_from(level: float, ends: list[_End]) -> tuple[_End, float]:
    """The end that a level is farthest from, and the ratio to it."""
    pairs = ((end, max(level / end.level, 1e-9)) for end in ends)
    return max(pairs, key=lambda pair: abs(math.log(pair[1])))


def _off_level(kind: str, of: str, name: str, ratio: float, told: str, alike: str) -> Iterator[Remark]:
    """What is said where an amplitude is so many times the one where a transient settles; nothing where they agree."""
    factor = max(ratio, 1.0 / ratio)
    if factor > thresholds.LEVELS:
        severity = Severity.SERIOUS if factor > FAR else Severity.DOUBT
        yield Remark(severity, kind, of, name, told, alike, ratio, factor / thresholds.LEVELS)


def _steady_levels(inspection: Inspection) -> Iterator[Remark]:
    """Lock-in records, which must stand where the transients of their test settle."""
    for test in inspection.campaign.tests:
        for steady, end, ratio in _steady_apart(test, inspection):
            yield from _off_level(
                "steady level", "record", steady.name, ratio,
                f"stands at {steady.level:.3g}, {ratio:.3g} times the amplitude {end.level:.3g} where {end.name} "
                "of its test settles: a unit or gain of one of them, another wind speed, or two stable amplitudes.",
                "the record stands at {} times the amplitude where a transient of its test settles",
            )  # fmt: skip


def _sweep_levels(inspection: Inspection) -> Iterator[Remark]:
    """Sweeps, which must show what the transients of their rig settle at where both are of one wind speed."""
    for sweep in inspection.campaign.sweeps:
        for test in (test for test in inspection.campaign.tests if test.rig == sweep.rig):
            at = int(np.argmin(np.abs(sweep.wind_speed - test.wind_speed.mean)))
            there, speed = float(sweep.amplitude[at]), float(sweep.wind_speed[at])
            if abs(speed - test.wind_speed.mean) > thresholds.ONE_SPEED * speed or not there > 0.0:
                continue
            if not (ends := _settled(_ends(test, inspection, *_TRANSIENTS), there)):
                continue
            end, ratio = _farthest_from(there, ends)
            yield from _off_level(
                "sweep level", "test", test.name, ratio,
                f"the sweep {sweep.path.name} of its rig has {there:.3g} at {speed:.4g} m/s, {ratio:.3g} times the "
                f"amplitude {end.level:.3g} where {end.name} settles at the same wind speed: a unit or gain of one "
                "of them, another damping or wind speed, or two stable amplitudes.",
                "the sweep has {} times the amplitude where a transient settles at the same wind speed",
            )  # fmt: skip


def _stated_level(inspection: Inspection) -> Iterator[Remark]:
    """The stable amplitude that is stated, against what the test's records settle at."""
    for test in inspection.campaign.tests:
        if test.stable_amplitude is None:
            continue
        stated = test.stable_amplitude.mean
        for end in _settled(_ends(test, inspection, *_TRANSIENTS), stated):
            ratio = end.level / stated
            if max(ratio, 1.0 / ratio) > thresholds.LEVELS:
                yield Remark(
                    Severity.SERIOUS if max(ratio, 1.0 / ratio) > FAR else Severity.DOUBT, "stated level", "record",
                    end.name,
                    f"settles at {end.level:.3g}, {ratio:.3g} times the stable amplitude {stated:.3g} stated for test "
                    f"{test.name}.",
                    "the record settles at {} times the stable amplitude stated for its test", ratio,
                    max(ratio, 1.0 / ratio) / thresholds.LEVELS,
                )  # fmt: skip


def _damping(inspection: Inspection) -> Iterator[Remark]:
    """The damping of the ring-downs, against what is stated and against what can be."""
    for rig in inspection.campaign.rigs:
        ringdown = inspection.ringdowns.get(rig.name)
        if ringdown is None:
            continue
        xi = ringdown.damping_ratio
        stated = rig.damping_ratio
        if stated is None:
            yield from outside(xi, DAMPING, "damping measured", "rig", rig.name, "the damping of the ring-downs")
            continue
        sd = stated.or_relative_sd(inspection.stated_sd).sd or 0.0
        ratio = xi / stated.mean
        sigmas, nearest = _miss(stated.mean, sd, ringdown)
        factor = thresholds.DAMPING_FACTOR
        twice = not 1.0 / factor < nearest / stated.mean < factor
        far = f" and {figure(sigmas)} standard deviations from it" if sigmas > thresholds.SIGMAS else ""
        if sigmas > thresholds.SIGMAS or (twice and sigmas > 0.0):
            yield Remark(
                Severity.SERIOUS if twice else Severity.DOUBT, "damping", "rig", rig.name,
                said(
                    "the ring-downs show a damping of ", damping(xi), f", {ratio:.3g} times the ", damping(stated.mean),
                    f" stated{far}.",
                ),
                "the ring-downs show {} times the damping stated", ratio,
                max(sigmas / thresholds.SIGMAS, ratio / factor, 1.0 / max(factor * ratio, 1e-9)),
            )  # fmt: skip


def _miss(stated: float, sd: float, ringdown: RingDown) -> tuple[float, float]:
    """Joint standard deviations by which a stated damping ratio misses every amplitude's, and the nearest of these.

    Damping may vary with amplitude: what is stated at one of them, or between two, contradicts nobody.
    """
    bands = [band for band in ringdown.bands if _error(band) < thresholds.CLEAR_BAND * abs(band.damping_ratio)]
    if not bands:
        xi = ringdown.damping_ratio
        return abs(xi - stated) / math.hypot(sd, ringdown.damping_ratio_sd), xi
    misses = [(band.damping_ratio - stated) / math.hypot(sd, _error(band)) for band in bands]
    if min(misses) <= 0.0 <= max(misses):
        return 0.0, stated
    nearest = min(range(len(bands)), key=lambda k: abs(misses[k]))
    return abs(misses[nearest]), bands[nearest].damping_ratio


def _error(band: DampingBand) -> float:
    return math.hypot(band.sd / math.sqrt(band.plucks), thresholds.BAND_FLOOR * abs(band.damping_ratio))


def _amplitude(inspection: Inspection) -> Iterator[Remark]:
    """Amplitudes that no section reaches; in still air a hand may pull it anywhere."""
    wanted = AMPLITUDE[inspection.campaign.section.motion]
    for record, _, test in inspection.records():
        largest = inspection.qualities[record.name].amplitude_range[1]
        for remark in outside(largest, wanted, "amplitude", "record", record.name, "the largest amplitude"):
            yield remark if test is not None else replace(remark, severity=Severity.DOUBT)


CHECKS: tuple[Callable[[Inspection], Iterator[Remark]], ...] = (
    off_stated, apart_from_other_rigs, too_coarse, apart_in_one_test, _kind, _levels, _steady_levels, _sweep_levels,
    _stated_level, _damping, _amplitude,
)  # fmt: skip
