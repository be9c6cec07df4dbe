"""Samples that stand in a campaign twice: they would count as evidence twice."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from itertools import combinations
from pathlib import Path

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.schema import Campaign, Record
from scruton.campaign.thresholds import OVERLAP


def duplicates(campaign: Campaign) -> Iterator[Remark]:
    """Remark on records that share samples: the same file under two names, overlapping windows, or copied numbers."""
    owned = [(f"rig {rig.name}", record) for rig in campaign.rigs for record in rig.records]
    owned += [(f"test {test.name}", record) for test in campaign.tests for record in test.records]
    prints = {id(record): _Print.of(record, campaign) for _, record in owned}
    for one, other in combinations(owned, 2):
        found = _shared(prints[id(one[1])], prints[id(other[1])])
        if found:
            yield _remark(one, other, found)


@dataclass(frozen=True, eq=False)
class _Print:
    """A record, and digests of its file's bytes and of its own samples."""

    record: Record
    file: str
    samples: bytes

    @classmethod
    def of(cls, record: Record, campaign: Campaign) -> "_Print":
        return cls(record, _digest(campaign, record.path), sha256(record.response.tobytes()).digest())


def _shared(one: _Print, other: _Print) -> str:
    """What two records share, in words; empty where they share nothing."""
    first, second = one.record, other.record
    if one.file == other.file and first.path != second.path:
        return "the same bytes"
    if one.samples == other.samples:
        return "the same samples"
    if first.path != second.path:
        return ""
    begin, end = max(first.time[0], second.time[0]), min(first.time[-1], second.time[-1])
    here, there = _between(first, begin, end), _between(second, begin, end)
    if len(here) < OVERLAP or not np.array_equal(here, there):  # other columns of one file share its times alone
        return ""
    return f"{len(here)} samples of one file ({begin:.4g} s to {end:.4g} s)"


def _between(record: Record, begin: float, end: float) -> FloatArray:
    """Samples from `begin` to `end` [s], both included; none where they do not follow each other."""
    first, last = np.searchsorted(record.time, begin, "left"), np.searchsorted(record.time, end, "right")
    return record.response[first:last]


def _remark(one: tuple[str, Record], other: tuple[str, Record], shared: str) -> Remark:
    (owner, first), (other_owner, second) = one, other
    where = f"both in {owner}" if owner == other_owner else f"in {owner} and in {other_owner}"
    return Remark(
        Severity.SERIOUS, "duplicate", "record", f"{first.name} and {second.name}",
        f"{shared}, {where}; what is measured once counts twice.", "samples that another record holds",
    )  # fmt: skip


def _digest(campaign: Campaign, path: Path) -> str:
    """Digest of the bytes of a file, by its path where they are not known."""
    try:
        key = Path(os.path.relpath(path, campaign.path.parent)).as_posix()
    except ValueError:  # another drive
        key = path.as_posix()
    return (campaign.sha256 or {}).get(key, str(path))
