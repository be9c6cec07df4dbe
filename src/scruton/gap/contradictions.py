"""What no model of a campaign does: frequencies that differ or creep, a phase that slips, a free decay that grows."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from scruton.envelope import Cycles
from scruton.envelope.backbone import backbone
from scruton.envelope.frequencies import odd_one_out
from scruton.envelope.slips import phase_slip
from scruton.gap.data import GapData
from scruton.gap.hypothesis import FittedHypothesis
from scruton.gap.thresholds import (
    CLOCK_CYCLES,
    CLOCK_LOWEST,
    CLOCK_SD,
    FEWEST_CYCLES_OF_SCATTER,
    LINE_NATS,
    REGROWS,
    REGROWS_SIGMAS,
    SHIFT_SD,
)


@dataclass(frozen=True)
class Contradiction:
    """Something in a record that its test, or its rig in still air, cannot do.

    Attributes
    ----------
    record : str
    nats : float
        Log likelihood that it takes from a record that does it by chance.
    quantity, kind : str
        As of a `Finding`.
    value, sd : float
        What is found there, in the quantity's unit, and by how much chance makes it differ.
    seen : str
        What is seen, for people.
    form, share : str, float
        What it is in short, and how large, in the unit that `of` says.
    of : str
    cause : str
        What makes such a thing.
    look : str
        Where to look for it.
    """

    record: str
    nats: float
    quantity: str
    kind: str
    value: float
    sd: float
    seen: str
    form: str
    share: float
    of: str
    cause: str
    look: str

    @property
    def words(self) -> str:
        """What is seen, and in which record."""
        return f"{self.record} {self.seen}"


def contradictions(data: GapData) -> list[Contradiction]:
    """Those of a campaign that show in its cycles, beyond chance."""
    return [*wrong_clocks(data), *rigs_out_of_step(data), *regrowths(data), *slips(data)]


def worst_first(found: Iterable[Contradiction]) -> tuple[Contradiction, ...]:
    """The same, by what they take from a record that does it by chance."""
    return tuple(sorted(found, key=lambda one: -one.nats))


def creeping(fit: FittedHypothesis) -> list[Contradiction]:
    """Records in wind whose frequency changes as they go on, at the same amplitudes, by more than warmth moves it."""
    hypothesis, layout = fit.hypothesis, fit.hypothesis.data.layout
    if (where := hypothesis.slices.get((None, "frequency_trend"))) is None:  # nothing is in wind
        return []
    location, scale = (of_all[where] for of_all in hypothesis.prior)
    values, sds = fit.value("frequency_trend")
    nats = 0.5 * ((values - location) / scale) ** 2  # that such a prior takes from it
    records = [name for name, wind in zip(layout.records, layout.wind.tolist(), strict=True) if wind]
    each = zip(records, *(x.tolist() for x in (nats, values, sds, scale)), strict=True)
    return [
        Contradiction(
            name, weight, "frequency", "creep", value, float(np.hypot(sd, width)),
            f"changes its frequency by {100.0 * value:+.2g} % or more as it goes on, at the same amplitudes",
            "a frequency that creeps", abs(value), "of the frequency",
            "springs that warm or settle, water that comes or goes, a wind that changes",
            f"{name} once more after an hour, with the temperature of the springs beside",
        )
        for name, weight, value, sd, width in each
        if weight > LINE_NATS
    ]  # fmt: skip


def regrowths(data: GapData) -> list[Contradiction]:
    """Free decays in still air that grow again: nothing there feeds a motion but another one, the floor, or a knock."""
    found = []
    for name, wind in zip(data.layout.records, data.layout.wind.tolist(), strict=True):
        track = data.cycles[name]
        if wind or track.amplitude.size < FEWEST_CYCLES_OF_SCATTER:
            continue
        level, time = track.smoothed(), track.time[2:-2]
        # of a mean of five cycles, and what nobody would call growth
        error = float(np.hypot(np.median(track.standard_error) / np.sqrt(5.0), REGROWS * level.max()))
        rise = level - np.minimum.accumulate(level)
        high = int(np.argmax(rise))
        low = int(np.argmin(level[: high + 1]))
        if rise[high] < REGROWS_SIGMAS * error:
            continue
        at = max(float(level[low]), error)
        span = 2.0 * np.pi * track.reference_frequency * float(time[high] - time[low])
        seen = f"grows again in still air, from {level[low]:.3g} to {level[high]:.3g} at {time[high]:.4g} s"
        found.append(
            Contradiction(
                name, 0.5 * float(rise[high] / error) ** 2, "damping", "regrowth",
                -float(np.log(level[high] / at)) / span, error / at / span, seen,
                "a free decay that grows again", float(rise[high] / level.max()), "of its largest amplitude",
                "another mode that takes and gives, a floor that moves it, or a knock",
                f"{name} with a second sensor elsewhere on the section and one on the floor",
            )
        )  # fmt: skip
    return found


def slips(data: GapData) -> list[Contradiction]:
    """Records whose phase slips from one cycle to the next, as no motion of one mode does."""
    found = ((name, phase_slip(data.cycles[name])) for name in data.layout.records)
    return [
        Contradiction(
            name, 0.5 * (slip.cycles / slip.sd) ** 2, "frequency", "slip", slip.cycles, slip.sd,
            f"slips by {slip.cycles:+.2g} of a cycle from one to the next, at {slip.time:.4g} s",
            "a phase that slips", abs(slip.cycles), "of a cycle",
            "samples that were lost, pieces that were joined, another motion, or a knock",
            f"{name} once more, with the logger's own time of every sample",
        )
        for name, slip in found
        if slip
    ]  # fmt: skip


def wrong_clocks(data: GapData) -> list[Contradiction]:
    """The record that is most out of step in every test, and in every rig in still air, beyond chance."""
    layout, found = data.layout, []
    for records in _together(layout.records, layout.rig, layout.test).values():
        pairs = list(_pairs(data, records))
        if not pairs:
            continue
        worst = max(pairs, key=lambda pair: pair.nats)
        away = {
            name: float(np.median([abs(pair.off) for pair in pairs if name in (pair.record, pair.other)]))
            for name in (worst.record, worst.other)
        }
        if away[worst.other] > away[worst.record]:
            worst = _OutOfStep(worst.other, worst.record, 1.0 / (1.0 + worst.off) - 1.0, worst.sd)
        if worst.nats > LINE_NATS:
            found.append(
                Contradiction(
                    worst.record, worst.nats, "frequency", "clock", worst.off, worst.sd,
                    f"swings {100.0 * worst.off:+.2g} % off {worst.other} at the same amplitudes",
                    "a clock", abs(worst.off), "of the frequency",
                    "a clock that is wrong, or samples that were lost",
                    f"the time of {worst.record} beside its logger's rate",
                )
            )  # fmt: skip
    return found


def rigs_out_of_step(data: GapData) -> list[Contradiction]:
    """The rig whose frequency in wind is furthest from that in still air, beside what the fluid does to the others'.

    In still air as recorded there, or else as stated.
    """
    layout = data.layout
    by_rig = _together(layout.records, layout.rig, layout.wind)

    def in_still_air(rig: int) -> float:
        records = by_rig.get((rig, False))
        return _median_frequency(data, records) if records else data.campaign.rigs[rig].frequency.mean

    shifts = {
        rig: _median_frequency(data, records) / in_still_air(rig) - 1.0
        for (rig, wind), records in sorted(by_rig.items())
        if wind
    }
    if len(shifts) < 2:
        return []
    rig, others = odd_one_out(shifts)
    off, sd = shifts[rig] - others, float(np.hypot(SHIFT_SD, others))
    beside, again = "in still air", "mass or a spring that was changed between"
    if (rig, False) not in by_rig:
        sd = float(np.hypot(sd, data.campaign.rigs[rig].frequency.log_sd))
        beside, again = "as it is stated", "frequency that is stated wrong"
    # A spring that bends moves a rig's frequency, too, but not at the same amplitudes, nor once it hardly moves.
    shift, shift_sd = _at_one_amplitude(data, by_rig, rig)
    if shift_sd <= sd and abs(shift - others) < abs(off):
        off = shift - others
    if (nats := 0.5 * (off / sd) ** 2) <= LINE_NATS:
        return []
    record = by_rig[rig, True][0]
    return [
        Contradiction(
            record, nats, "frequency", "clock", off, sd,
            f"swings {100.0 * shifts[rig]:+.2g} % off its rig {beside}, as the wind moves no other rig",
            "a clock", abs(off), "of the frequency",
            f"a clock that is wrong in the wind or in still air, or a {again}",
            f"the time of {record} beside its logger's rate, and a free decay of its rig once more",
        )
    ]  # fmt: skip


def _at_one_amplitude(data: GapData, by_rig: Mapping[tuple[int, int], list[str]], rig: int) -> tuple[float, float]:
    """Shift of a rig's frequency in wind at the same amplitudes as in still air, and its standard deviation.

    Without a record in still air: at vanishing amplitude, from what is stated.  Anything where cycles are too few.
    """
    wind, still = ([data.cycles[name] for name in by_rig.get((rig, blows), ())] for blows in (True, False))
    curve = backbone([*still, *wind])
    if curve is None:
        return 0.0, np.inf
    if still:
        in_wind = slice(len(still) - 1, None)
        return float(np.median(curve.apart[in_wind])), float(np.median(curve.apart_sd[in_wind]))
    stated = data.campaign.rigs[rig].frequency.mean
    return curve.at_rest / stated - 1.0, curve.at_rest_sd / stated


def _together(records: Sequence[str], rig: np.ndarray, of_it: np.ndarray) -> dict[tuple[int, int], list[str]]:
    """Records by rig and by what else they have in common."""
    found: dict[tuple[int, int], list[str]] = defaultdict(list)
    for record, of_rig, shared in zip(records, rig.tolist(), of_it.tolist(), strict=True):
        found[of_rig, shared].append(record)
    return found


def _median_frequency(data: GapData, records: list[str]) -> float:
    return float(np.median([data.cycles[record].reference_frequency for record in records]))


@dataclass(frozen=True)
class _OutOfStep:
    """A record beside another of its test, or of its rig in still air: its frequency over the other's, minus 1."""

    record: str
    other: str
    off: float
    sd: float  # by what springs and air change from run to run

    @property
    def nats(self) -> float:
        return 0.5 * (self.off / self.sd) ** 2


def _pairs(data: GapData, records: list[str]) -> Iterator[_OutOfStep]:
    for first, second in combinations(records, 2):
        tracks = data.cycles[first], data.cycles[second]
        high = min(float(track.amplitude.max()) for track in tracks)
        low = max(*(float(track.amplitude.min()) for track in tracks), CLOCK_LOWEST * high)
        inside = [
            (track.amplitude >= low) & (track.amplitude <= high) & np.isfinite(track.frequency_error)
            for track in tracks
        ]
        if min(map(np.count_nonzero, inside)) < CLOCK_CYCLES:
            continue
        (f, f_sd), (g, g_sd) = (_frequency(track, where) for track, where in zip(tracks, inside, strict=True))
        yield _OutOfStep(first, second, f / g - 1.0, float(np.sqrt(CLOCK_SD**2 + (f_sd / f) ** 2 + (g_sd / g) ** 2)))


def _frequency(track: Cycles, inside: np.ndarray) -> tuple[float, float]:
    weight = track.frequency_error[inside] ** -2.0
    return float(np.sum(weight * track.frequency[inside]) / weight.sum()), float(weight.sum() ** -0.5)
