"""Stretches that do not move amid motion: padding, a model that is still held, a channel that drops out."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from scruton.arrays import BoolArray
from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.schema import Campaign, Record, Rig
from scruton.envelope.sampling import quantum_of
from scruton.envelope.thresholds import HELD, MOVES

LeftOut = tuple[BoolArray, Remark]  # which samples, (N,), and what is said of them


def moving(campaign: Campaign) -> Campaign:
    """The campaign without the samples of its records that stand still amid motion, which its remarks then tell."""

    def still(record: Record, frequency: float) -> LeftOut | None:
        still = standing_still(record, frequency)
        if not still.any() or still.all():
            return None
        share = 100.0 * float(np.mean(still))
        alike = "{} % of the record stand still at one reading amid motion, and are left out,"
        told = (
            f"{share:.2g} % of the record stand still at one reading amid motion, first at {record.time[still][0]:.4g} "
            "s (padding, a model still held, or a channel that drops out); they are left out."
        )
        return still, Remark(Severity.DOUBT, "dead", "record", record.name, told, alike, share)

    return without_samples(campaign, still)


def without_samples(campaign: Campaign, rule: Callable[[Record, float], LeftOut | None]) -> Campaign:
    """The campaign without the samples that a rule, told each record and its rig's frequency [Hz], leaves out."""
    remarks: list[Remark] = []

    def cut(records: tuple[Record, ...], rig: Rig) -> tuple[Record, ...]:
        kept = []
        for record in records:
            found = rule(record, rig.frequency.mean)
            if found is not None:
                gone, remark = found
                remarks.append(remark)
                record = replace(record, time=record.time[~gone], response=record.response[~gone])
            kept.append(record)
        return tuple(kept)

    rigs = tuple(replace(rig, records=cut(rig.records, rig)) for rig in campaign.rigs)
    tests = tuple(replace(test, records=cut(test.records, campaign.rig(test.rig))) for test in campaign.tests)
    if not remarks:
        return campaign
    return replace(campaign, rigs=rigs, tests=tests, remarks=(*campaign.remarks, *remarks))


def standing_still(record: Record, frequency: float) -> BoolArray:
    """Which samples of a record stand at one reading for a cycle or longer beside a cycle that moves, (N,).

    A decay that sinks below what its rounding shows comes to stand, too, but out of a motion of a quantum or two: it is
    left as it is. An envelope stands still where it is zero.
    """
    y, still = record.response, np.zeros(record.response.size, dtype=bool)
    same = np.diff(y) == 0.0
    if record.is_envelope:
        same &= y[1:] == 0.0
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]])))
    cycle = max(3, round(float((record.time.size - 1) / (record.time[-1] - record.time[0])) / frequency))
    quantum = quantum_of(y)
    for begin, end in zip(edges[::2], edges[1::2] + 1, strict=True):
        if end - begin <= HELD * cycle:
            continue
        beside = [part for part in (y[max(0, begin - cycle) : begin], y[end : end + cycle]) if part.size > 1]
        if any(
            np.max(np.abs(part - y[begin]) if record.is_envelope else np.ptp(part)) > MOVES * quantum for part in beside
        ):
            still[begin:end] = True
    return still
