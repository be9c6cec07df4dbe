"""Stretches that do not move amid motion: padding, a model that is still held, a channel that drops out."""

from dataclasses import replace

import numpy as np

from scruton.arrays import BoolArray
from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.schema import Campaign, Record
from scruton.envelope.sampling import quantum_of
from scruton.envelope.thresholds import HELD, MOVES


def moving(campaign: Campaign) -> Campaign:
    """The campaign without the samples of its records that stand still amid motion, which its remarks then tell."""
    remarks: list[Remark] = []

    def cut(record: Record, frequency: float) -> Record:
        still = standing_still(record, frequency)
        if not still.any() or still.all():
            return record
        time = record.time[still]
        share = 100.0 * float(np.mean(still))
        alike = "{} % of the record stand still at one reading amid motion, and are left out,"
        told = (
            f"{share:.2g} % of the record stand still at one reading amid motion, first at {time[0]:.4g} s (padding, a "
            "model still held, or a channel that drops out); they are left out."
        )
        remarks.append(Remark(Severity.DOUBT, "dead", "record", record.name, told, alike, share))
        return replace(record, time=record.time[~still], response=record.response[~still])

    rigs = tuple(
        replace(rig, records=tuple(cut(record, rig.frequency.mean) for record in rig.records)) for rig in campaign.rigs
    )
    tests = tuple(
        replace(test, records=tuple(cut(record, campaign.rig(test.rig).frequency.mean) for record in test.records))
        for test in campaign.tests
    )
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
