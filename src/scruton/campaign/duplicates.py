"""Samples that stand in a campaign twice: they would count as evidence twice."""

from collections.abc import Iterator
from hashlib import sha256
from itertools import combinations
from pathlib import Path

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.bounded import relative_to
from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.schema import Campaign, Record
from scruton.campaign.thresholds import OVERLAP


def duplicates(campaign: Campaign) -> Iterator[Remark]:
    """Remark on records that share samples: the same file under two names, overlapping windows, or copied numbers."""
    owned = [(f"rig {rig.name}", record) for rig in campaign.rigs for record in rig.records]
    owned += [(f"test {test.name}", record) for test in campaign.tests for record in test.records]
    digests = {id(record): (_digest(campaign, record.path), _samples(record)) for _, record in owned}
    for (owner, first), (other_owner, second) in combinations(owned, 2):
        shared = _shared(first, second, digests[id(first)], digests[id(second)])
        if shared:
            where = f"both in {owner}" if owner == other_owner else f"in {owner} and in {other_owner}"
            yield Remark(
                Severity.SERIOUS, "duplicate", "record", f"{first.name} and {second.name}",
                f"{shared}, {where}; what is measured once counts twice.", "samples that another record holds",
            )  # fmt: skip


def _shared(first: Record, second: Record, digests: tuple[str, str], others: tuple[str, str]) -> str:
    """What two records share, in words; empty where they share nothing.  Digests are of the file and of the samples."""
    if digests[0] == others[0] and first.path != second.path:
        return "the same bytes"
    if digests[1] == others[1]:
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


def _samples(record: Record) -> str:
    return sha256(record.response.tobytes()).hexdigest()


def _digest(campaign: Campaign, path: Path) -> str:
    """Digest of the bytes of a file, by its path where they are not known."""
    return (campaign.sha256 or {}).get(relative_to(path, campaign.path.parent), str(path))
