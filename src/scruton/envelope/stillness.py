"""Samples that are no motion: padding, a model that is still held, a channel that drops out, single outliers."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from scruton.arrays import BoolArray, FloatArray
from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.schema import Campaign, Kind, Record, Rig
from scruton.envelope.sampling import quantum_of
from scruton.envelope.thresholds import FEWEST_HELD, HELD, LET_GO, MOST_OUTLIERS, MOVES, OUTLIES, OUTLIES_MOTION

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

    return without_samples(without_samples(campaign, still), _not_let_go)


def unspoiled(campaign: Campaign) -> Campaign:
    """The campaign without the cycles of its records in which single readings lie far off, which its remarks tell."""
    return without_samples(campaign, _outlying)


def _not_let_go(record: Record, frequency: float) -> LeftOut | None:
    gone = before_release(record, frequency)
    if not gone.any():
        return None
    why = "the model is held until then; that part is left out"
    told = f"nothing moves but the noise until {record.time[~gone][0]:.4g} s, and then at once at its largest: {why}."
    alike = f"nothing moves but the noise for the first {{}} % of the record, and then at once at its largest: {why},"
    share = 100.0 * float(np.mean(gone))
    return gone, Remark(Severity.DOUBT, "held model", "record", record.name, told, alike, share)


def _outlying(record: Record, frequency: float) -> LeftOut | None:
    out = outliers(record)
    if not out.any():
        return None
    at = record.time[out]
    count = int(np.count_nonzero(out))
    what, first = (f"{count} readings lie", "the first ") if count > 1 else ("a reading lies", "")
    told = (
        f"{what} far off those before and after, {first}at {at[0]:.4g} s; the cycles there are left out of what is "
        "fitted."
    )
    alike = "{} readings lie far off those before and after (the cycles there are left out of what is fitted)"
    near = about(record.time, at, frequency)
    return near, Remark(Severity.DOUBT, "outlier", "record", record.name, told, alike, count)


def about(time: FloatArray, at: FloatArray, frequency: float) -> BoolArray:
    """Which samples, (N,), lie within half a cycle of any of these times, which rise."""
    half = 0.5 / frequency
    return np.searchsorted(at, time - half) < np.searchsorted(at, time + half, side="right")


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
    cycle = _samples_of_a_cycle(record, frequency)
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


def _samples_of_a_cycle(record: Record, frequency: float) -> int:
    return max(3, round(float((record.time.size - 1) / (record.time[-1] - record.time[0])) / frequency))


def before_release(record: Record, frequency: float) -> BoolArray:
    """Which samples of a decay come before the model is let go, (N,): noise, and then at once the largest motion.

    A growth may well begin with noise, and a model that is pulled before it is let go moves: these stay as they are.
    """
    held = np.zeros(record.time.size, dtype=bool)
    if record.kind not in (Kind.DECAY, Kind.FREE_DECAY) or record.is_envelope or not np.isfinite(record.response).all():
        return held
    cycle = _samples_of_a_cycle(record, frequency)
    whole = record.response[: record.time.size // cycle * cycle].reshape(-1, cycle)
    if len(whole) < 2 * FEWEST_HELD:
        return held
    swept = np.ptp(whole, axis=1)
    first = int(np.argmax(swept > 0.5 * swept.max()))  # cycle
    if first < FEWEST_HELD or not swept[: first - 1].max() * LET_GO < swept.max():
        return held
    quiet = whole[: first - 1]  # the release may be in the cycle before
    moves = np.abs(record.response - quiet.mean()) > np.ptp(quiet)
    moves[: (first - 1) * cycle] = False
    held[: int(np.argmax(moves))] = True
    return held


def outliers(record: Record) -> BoolArray:
    """Which samples of a record lie far off the cubic through the two on either side, (N,); none where many seem to.

    So do single readings that a plug or a transmission spoils. Those beside one are not taken for another, nor is a
    step, on either side of which readings differ by as much.
    """
    y, out = record.response, np.zeros(record.response.size, dtype=bool)
    if record.is_envelope or y.size < 64 or not np.isfinite(y).all():
        return out
    off = np.abs(y[2:-2] - (4.0 * (y[1:-3] + y[3:-1]) - y[:-4] - y[4:]) / 6.0)
    usual, moved = float(np.quantile(off, 0.99)), float(np.ptp(np.quantile(y, [0.005, 0.995])))
    far = off > max(OUTLIES * usual, OUTLIES_MOTION * moved)
    # the cubic beside a spoiled reading is off by two thirds of it
    padded = np.pad(off, 2)
    largest = np.max([padded[k : k + off.size] for k in range(5)], axis=0)
    out[2:-2] = far & (off == largest) & (np.abs(y[3:-1] - y[1:-3]) < 0.5 * off)
    return out if np.count_nonzero(out) <= MOST_OUTLIERS else np.zeros_like(out)
