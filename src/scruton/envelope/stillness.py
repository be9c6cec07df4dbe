"""Samples that are no motion: padding, a model that is still held, a channel that drops out, single outliers."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from scruton.arrays import BoolArray, FloatArray
from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.schema import Campaign, Kind, Record, Rig
from scruton.envelope.sampling import quantum_of, sines, sines_through
from scruton.envelope.thresholds import (
    AT_ONCE,
    AT_REST,
    AT_REST_OF_A_DECAY,
    FEWEST_AT_REST,
    FEWEST_IN_A_CYCLE,
    HELD,
    LACKS,
    LACKS_GROWING,
    LET_GO,
    LET_GO_IN_IT,
    LET_GO_OVER,
    MOST_OUTLIERS,
    MOVED,
    MOVES,
    OUTLIES,
    OUTLIES_MOTION,
)

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
    share = 100.0 * float(np.mean(gone))
    if np.count_nonzero(gone) <= _samples_of_a_cycle(record, frequency):
        alike = "the model is let go within the first cycle, {} % of the record, which is left out"
        told = f"{alike.format(f'{share:.2g}')}."
        return gone, Remark(Severity.DOUBT, "let go", "record", record.name, told, f"{alike},", share)
    at_once = "and then at once as if it had been moving"
    told = f"nothing moves but the noise until {record.time[~gone][0]:.4g} s, {at_once}: {why}."
    alike = f"nothing moves but the noise for the first {{}} % of the record, {at_once}: {why},"
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
    """Which samples of a transient come before the model is let go, (N,): cycles at rest, and then at once motion.

    At once is what no air does that moves a body: the line through the cycles that follow has not come down to where
    the cycles at rest are, or to the first one, in which the release may lie.  A model that is pulled before it is let
    go moves; a growth out of the noise is gradual.
    """
    held, cycle = np.zeros(record.time.size, dtype=bool), _samples_of_a_cycle(record, frequency)
    count = record.time.size // cycle
    transient = record.kind in (Kind.DECAY, Kind.FREE_DECAY, Kind.GROWTH) and not record.is_envelope
    if not transient or cycle < FEWEST_IN_A_CYCLE or count < 2 * LET_GO_OVER or not np.isfinite(record.response).all():
        return held
    whole = record.response[: count * cycle].reshape(count, cycle)
    amplitude, error = _amplitudes(whole, frequency * (record.time[-1] - record.time[0]) / (record.time.size - 1))
    error = max(error, _at_rest(amplitude))
    rest = AT_REST * error if record.kind is Kind.GROWTH else max(AT_REST * error, AT_REST_OF_A_DECAY * amplitude.max())
    # the last cycle at rest before it clearly moves: hum and drifts show in single ones before
    first = int(np.argmax(amplitude > AT_ONCE / AT_REST * rest))
    while first > 0 and amplitude[first - 1] > rest:
        first -= 1
    after = amplitude[first + 1 : first + 1 + LET_GO_OVER]
    if after.size < LET_GO_OVER:
        return held
    last = max(first - 1, 0)  # at rest, or the cycle in which it is let go
    slope, level = np.polyfit(np.arange(first + 1, first + 1 + LET_GO_OVER) - last, after, 1)
    lacks = level - amplitude[last]
    if first == 0:
        held[:cycle] = lacks > max(LET_GO_IN_IT * error, LACKS * level, LACKS_GROWING * slope)
        return held
    if record.kind is Kind.GROWTH:
        # from where it was put, or from zero: not along a line from the start on
        at_once = after[0] > AT_ONCE * error and (lacks > LET_GO * error or level < slope * last)
    else:
        at_once = lacks > 0.5 * amplitude.max()
    if at_once:
        quiet, begin = whole[:first][amplitude[:first] <= rest], first * cycle
        if len(quiet) > 1:  # the release may lie in the last cycle that seems to rest
            quiet, begin = quiet[:-1], last * cycle
        moved = np.abs(record.response[begin:] - quiet.mean()) > max(np.ptp(quiet), MOVED * after[0])
        held[: begin + int(np.argmax(moved))] = True
    return held


def _at_rest(amplitude: FloatArray) -> float:
    """What hum and the floor leave of an amplitude, (K,), in the cycles before it jumps far above them all; 0 of none.

    The scatter of the samples within a cycle does not tell it.
    """
    highest = np.maximum.accumulate(amplitude)
    jumps = np.flatnonzero(amplitude[FEWEST_AT_REST + 1 :] > AT_ONCE * highest[FEWEST_AT_REST - 1 : -2])
    return float(np.median(amplitude[: jumps[0] + FEWEST_AT_REST])) if jumps.size else 0.0


def _amplitudes(cycles: FloatArray, frequency: float) -> tuple[FloatArray, float]:
    """Amplitudes of cycles of samples, (K, n), at a frequency in cycles a sample, and the error of the first ones."""
    count = cycles.shape[1]
    fitted = sines_through(cycles, frequency)
    left = cycles - fitted @ sines(count, frequency).T
    scatter = np.sqrt(np.sum(left**2, axis=1) / (count - 3))
    error = float(np.median(scatter[: 2 * LET_GO_OVER]) * np.sqrt(2.0 / count))
    return np.hypot(fitted[:, 1], fitted[:, 2]), error


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
