"""Frequencies of records, and how finely they were sampled, against what is stated and against each other."""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.thresholds import FAR
from scruton.envelope import thresholds
from scruton.envelope.backbone import bends_from
from scruton.envelope.inspection import Inspection
from scruton.envelope.types import Cycles


def off_stated(inspection: Inspection) -> Iterator[Remark]:
    """The line that was followed, against the frequency stated for the rig."""
    for record, rig, test in inspection.records():
        if record.is_envelope:
            continue
        line, stated = inspection.cycles[record.name].reference_frequency, rig.frequency.mean
        limit = thresholds.STILL_FREQUENCY if test is None else thresholds.WIND_FREQUENCY
        departure = abs(line / stated - 1.0)
        if departure > limit and not bends_from(inspection.cycles[record.name], stated, limit):
            where = "still air" if test is None else "wind"
            yield Remark(
                Severity.SERIOUS if departure > FAR * limit else Severity.DOUBT, "frequency", "record", record.name,
                f"the line followed is at {line:.4g} Hz, {line / stated:.3g} times the f0 = {stated:.4g} Hz stated for "
                f"rig {rig.name}, more than {100 * limit:.0f} % off in {where}: f0, the record's time, or another "
                "motion than the section's.",
                "the line followed is at {} times the f0 stated for its rig",
                line / stated, max(departure / limit, abs(math.log(line / stated)) / limit),
            )  # fmt: skip


def odd_one_out[Name: (int, str)](shifts: Mapping[Name, float]) -> tuple[Name, float]:
    """Of two or more relative shifts the one furthest from the median of the others, and that median.

    Of two, the one that is shifted more.
    """
    others = {name: float(np.median([shift for one, shift in shifts.items() if one != name])) for name in shifts}
    odd = max(shifts, key=lambda name: (round(abs(shifts[name] - others[name]), 9), abs(shifts[name])))
    return odd, others[odd]


def apart_from_other_rigs(inspection: Inspection) -> Iterator[Remark]:
    """The rig whose records in wind are off its f0 by what the wind makes of no other's.

    What is far from the rig's own by itself is told by `off_stated`.
    """
    followed: dict[str, list[Cycles]] = {}
    for record, rig, test in inspection.records():
        if test is not None and not record.is_envelope:
            followed.setdefault(rig.name, []).append(inspection.cycles[record.name])
    shifts = {
        name: float(np.median([track.reference_frequency for track in tracks]))
        / inspection.campaign.rig(name).frequency.mean
        - 1.0
        for name, tracks in followed.items()
    }
    if len(shifts) < 2:
        return
    odd, others = odd_one_out(shifts)
    rig = inspection.campaign.rig(odd)
    # a fluid that moves the others much may move a light rig by as much again
    limit = max(thresholds.OTHER_RIGS, abs(others), thresholds.SIGMAS * rig.frequency.relative_sd)
    ratio, departure = 1.0 + shifts[odd], abs(shifts[odd] - others)
    if not (departure > limit and abs(shifts[odd]) <= thresholds.WIND_FREQUENCY):
        return
    if not all(bends_from(track, rig.frequency.mean, limit) for track in followed[odd]):
        yield Remark(
            Severity.DOUBT, "other rigs", "rig", odd,
            f"in wind its lines are at {ratio:.3f} times the f0 = {rig.frequency.mean:.4g} Hz stated, those "
            f"of other rigs at {1.0 + others:.3f} times theirs: f0, the time of its records, or another mass or "
            "spring.",
            "in wind the lines are at {} times the f0 stated, as those of no other rig", ratio, departure / limit,
        )  # fmt: skip


def too_coarse(inspection: Inspection) -> Iterator[Remark]:
    """Records that are sampled too coarsely for the frequency stated."""
    for record, rig, _ in inspection.records():
        if record.is_envelope:
            continue
        rate, f0 = inspection.qualities[record.name].sample_rate, rig.frequency.mean
        if rate >= thresholds.FINE * f0:
            continue
        alias = rate < thresholds.NYQUIST * f0
        line = inspection.cycles[record.name].reference_frequency
        follows = (
            f"a motion at f0 is seen as an alias, and the line followed at {line:.4g} Hz ({line / f0:.3g} times f0) "
            "may be one"
            if alias
            else "a thinned record hides harmonics and clipping"
        )
        yield Remark(
            Severity.SERIOUS if alias else Severity.DOUBT, "alias" if alias else "thinned", "record", record.name,
            f"{rate:.4g} samples a second are {rate / f0:.2g} per cycle of the f0 = {f0:.4g} Hz stated for rig "
            f"{rig.name}; below {thresholds.NYQUIST if alias else thresholds.FINE:g} {follows}.",
            f"{{}} samples per cycle of f0 (below {thresholds.NYQUIST if alias else thresholds.FINE:g}: "
            f"{'what is followed may be an alias' if alias else 'thinned'})",
            rate / f0, (thresholds.NYQUIST if alias else thresholds.FINE) * f0 / rate,
        )  # fmt: skip


def apart_in_one_test(inspection: Inspection) -> Iterator[Remark]:
    """The record of a test whose line is far from those of the others, which one wind and one rig make alike.

    What is far from the rig's own, too, is told by `off_stated`.
    """
    for test in inspection.campaign.tests:
        followed = {
            one.name: inspection.cycles[one.name].reference_frequency
            for one in test.records
            if one.name in inspection.cycles and not one.is_envelope
        }
        stated = inspection.campaign.rig(test.rig).frequency.mean
        names = [name for name, line in followed.items() if abs(line / stated - 1.0) <= thresholds.WIND_FREQUENCY]
        if len(names) < 2:
            continue
        lines = np.array([followed[name] for name in names])
        # of two nobody knows which is the odd one
        usual = float(np.median(lines))
        odd = int(np.argmax(np.abs(lines - usual)))
        departure = float(np.ptp(lines)) / usual
        if departure > thresholds.ONE_TEST:
            yield Remark(
                Severity.DOUBT, "one test", "record", names[odd],
                f"the line followed is at {lines[odd]:.4g} Hz, where records of its test {test.name} have {usual:.4g} "
                "Hz: the time of one of them, another wind speed or rig, or a stiffness that depends on the amplitude.",
                "the line followed is up to {} % off that of other records of its test", 100.0 * departure,
                departure / thresholds.ONE_TEST,
            )  # fmt: skip
