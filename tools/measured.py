"""Measured records whose damping is known from elsewhere: what was measured by hand, and what the diagnosis predicts.

Nothing measured here goes through the program's own demodulation: turning points are read off the record, and the
damping is the logarithmic decrement between them.  The program's part begins at `examine`.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import nnls
from scipy.signal import find_peaks, savgol_filter

from scruton.campaign import Campaign, load_campaign
from scruton.campaign.schema import Record, Rig
from scruton.dynamics.effects import Term
from scruton.dynamics.limit_cycle import amplitude_rates
from scruton.dynamics.reading import inverse_reading, readings
from scruton.gap.diagnose import examine
from scruton.gap.diagnosis import Diagnosis
from scruton.gap.hypothesis import FittedHypothesis
from scruton.infer.cards import load_card

FRICTION, DRAG, STIFFNESS = "coulomb_friction", "structural_damping_nonlinearity", "stiffness_nonlinearity"
FORCE = "vortex_shedding_forcing"
_DROP = 0.2  # of the amplitude, over which a decrement is read
_EVERY = 0.05  # of the amplitude, by which the next one begins lower
_NUDGE = 1e-5
TERMS: Mapping[str, Callable[[np.ndarray], np.ndarray]] = {
    "1": np.ones_like, "1/A": np.reciprocal, "A": np.positive, "A^2": np.square,
}  # fmt: skip
NAMES = {"1/A": FRICTION, "A": DRAG, "A^2": DRAG}  # of the effect that a term of the damping shows


@dataclass(frozen=True)
class Known:
    """What is known of a set without this program.

    Attributes
    ----------
    folder, title : str
    truth : tuple of str
        Effects all of which act.
    besides : tuple of str
        Effects that act, too, but are small or do not touch the damping.
    source : str
        Where it is known from.
    """

    folder: str
    title: str
    truth: tuple[str, ...]
    besides: tuple[str, ...]
    source: str


SETS = (
    Known(
        "pendulum-dry-friction", "cart pendulum", (FRICTION, DRAG), (STIFFNESS,),
        "Decrements of $b/A + cA$: dry friction, and drag of the air. The period depends on the "
        "amplitude as that of any pendulum does.",
    ),
    Known(
        "pendulum-air-drag", "string pendulum", (DRAG,), (STIFFNESS, "sensor_clipping"),
        "Decrements that grow with the amplitude: drag of the air. What was filmed is the bob's way "
        "sideways, the sine of the swing, which bends the reading at large swings as a rounded saturation would.",
    ),
    Known(
        "ship-roll-decay", "ship model at rest", (DRAG,), (STIFFNESS,),
        "Linear and quadratic roll damping, by its owners' fit to the same record ($R^2$ = 0.99994).",
    ),
    Known(
        "ship-roll-speeds", "ship model, at rest and under way", (DRAG,), (STIFFNESS,),
        "A repeat of the record at rest, with linear and quadratic roll damping; forward speed adds linear damping.",
    ),
    Known(
        "bristol-heave", "flutter rig in heave", (FRICTION,), (STIFFNESS,),
        "Damping that grows about as $1/A$ at small amplitude, from below 3 % to above 10 %: dry friction.",
    ),
    Known(
        "cylinder-in-wind", "circular cylinder in wind", ("unknown",), (FORCE,),
        "Turbulence that makes lock-in come and go, by more than the gusts of the null model may, and a second line in "
        "the spectra: neither is in the catalogue. That line, near 23.1 to 23.4 Hz by the note on the set, is 1 to 2 % "
        "off the rig's frequency: a force off the response leaves the same. In still air the decrements hardly depend "
        "on the amplitude.",
    ),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Decrements:
    """Damping read off turning points, (M,) each: amplitude in A/D or rad, decay rate over 2 pi f0 of the rig."""

    amplitude: np.ndarray
    damping: np.ndarray

    @staticmethod
    def joined(parts: "list[Decrements]") -> "Decrements":
        """All of them as one."""
        return Decrements(*(np.concatenate([getattr(p, k) for p in parts]) for k in ("amplitude", "damping")))


def turning_points(record: Record, frequency: float) -> tuple[np.ndarray, np.ndarray]:
    """Times of the turning points of a record and amplitudes there, half the swing between neighbours, (K,) each."""
    period = 1.0 / frequency / float(np.median(np.diff(record.time)))  # in samples
    smooth = savgol_filter(record.response, max(5, round(0.15 * period) | 1), 2)
    high, low = (find_peaks(side, distance=max(1, round(0.7 * period)))[0] for side in (smooth, -smooth))
    at = np.sort(np.concatenate([high, low]))
    at = at[(at > 0.1 * period) & (at < len(smooth) - 0.1 * period)]
    at = at[np.r_[True, np.diff(np.isin(at, high).astype(int)) != 0]]  # a maximum after every minimum
    turn, count = smooth[at], np.arange(len(at))
    # the time of one is known to a sample or so: the frequency does not jump from swing to swing
    time = np.polyval(np.polyfit(count, record.time[at], min(3, len(at) - 1)), count)
    return time[1:-1], np.abs(turn[:-2] - 2.0 * turn[1:-1] + turn[2:]) / 4.0


def decrements(record: Record, frequency: float) -> Decrements:
    """Logarithmic decrements of a record that dies out, each over a fall of the amplitude by a fifth.

    The amplitude that one belongs to is the logarithmic mean of its two ends: exact where friction alone acts.
    """
    time, a = turning_points(record, frequency)
    found, last = [], np.inf
    for i in range(len(a) - 2):
        ends = np.arange(i + 2, len(a), 2)
        fallen = ends[a[ends] < (1.0 - _DROP) * a[i]]
        if not fallen.size or a[i] > (1.0 - _EVERY) * last:
            continue
        j, last = fallen[0], a[i]
        decrement = np.log(a[i] / a[j])
        found.append(((a[i] - a[j]) / decrement, decrement / (time[j] - time[i]) / (2.0 * np.pi * frequency)))
    return Decrements(*np.array(found).reshape(-1, 2).T)


def of_rig(rig: Rig) -> Decrements:
    """The decrements of all records of a rig in still air."""
    return Decrements.joined([decrements(record, rig.frequency.mean) for record in rig.records])


@dataclass(frozen=True, eq=False)
class Law:
    """A damping law fitted to decrements; residuals are root mean squares of the relative misfit.

    `without` is the residual of the law without the terms of an effect, by its name: what the effect is known by.
    """

    coefficients: Mapping[str, float]
    residual: float
    without: Mapping[str, float]
    constant: float


def hand_law(read: Decrements) -> Law:
    """Fit x0 + b/A + cA + dA^2, no coefficient negative, by least relative squares."""

    def fit(names: Iterable[str]) -> tuple[dict[str, float], float]:
        columns = np.stack([TERMS[name](read.amplitude) for name in names], axis=1) / read.damping[:, None]
        scale = np.linalg.norm(columns, axis=0)
        solution, norm = nnls(columns / scale, np.ones(len(columns)))
        values = map(float, solution / scale)
        return dict(zip(names, values, strict=True)), float(norm / np.sqrt(len(columns)))

    without = {effect: fit([name for name in TERMS if NAMES.get(name) != effect])[1] for effect in (FRICTION, DRAG)}
    return Law(*fit(list(TERMS)), without, fit(["1"])[1])


def scatter_in_wind(campaign: Campaign) -> dict[str, float]:
    """Standard deviation of the amplitude over its mean, of every test's first record."""
    found = {}
    for test in campaign.tests:
        _, a = turning_points(test.records[0], campaign.rig(test.rig).frequency.mean)
        found[test.name] = float(a.std() / a.mean())
    return found


def predicted(fit: FittedHypothesis, record: int, amplitude: np.ndarray) -> np.ndarray:
    """Damping of a record, as it is read, by a hypothesis at its optimum: decay rate over 2 pi f0."""
    data = fit.hypothesis.data
    table = fit.table[record : record + 1].copy()
    table[:, [int(Term.TREND), int(Term.TREND_SINE), int(Term.TREND_DRIVE)]] = 0.0  # at the middle of the record
    row = table[0]
    shown = amplitude / (1.0 + row[Term.GAIN])
    true = np.array([inverse_reading(a, row[Term.CLIP], row[Term.CLIP_SOFT]) for a in shown])
    rate = amplitude_rates(table, true, data.channels.knots)[0]
    rows = np.repeat(table, len(true), axis=0)
    up, down = (readings(rows, true * (1.0 + step)) for step in (_NUDGE, -_NUDGE))
    slope = (up - down) / (2.0 * _NUDGE) / (0.5 * (up + down))  # of ln(reading) in ln(amplitude)
    return np.asarray(-slope * rate / true / data.layout.omega[record])


@dataclass(frozen=True, eq=False)
class Part:
    """Decrements of a rig left out, and what both models say of them."""

    rig: str
    read: Decrements
    before: np.ndarray
    after: np.ndarray

    def errors(self) -> np.ndarray:
        """Relative errors of the null model and of the verdict's, (2, M)."""
        return np.abs(np.stack([self.before, self.after]) / self.read.damping - 1.0)


@dataclass(frozen=True, eq=False)
class Withheld:
    """What was left out, what the rest was diagnosed as, and how well it foretells the damping left out."""

    what: str
    verdict: tuple[str, ...]
    parts: list[Part]
    diagnosis: Diagnosis

    @property
    def error(self) -> tuple[float, float]:
        """Median relative error of the damping by the null model and by the verdict's."""
        return median_error([self])


def median_error(withheld: "list[Withheld]") -> tuple[float, float]:
    """Median relative error of the damping over all decrements left out, before and after."""
    errors = np.concatenate([part.errors() for one in withheld for part in one.parts], axis=1)
    before, after = np.median(errors, axis=1)
    return float(before), float(after)


def foretold(diagnosis: Diagnosis, rig: str, read: Decrements, *, like: str = "", levelled: bool = False) -> Part:
    """What both models say of decrements of a rig, or of one like it.

    `levelled` gives each the damping at the middle one, as a laboratory would state it: of a rig that was left out
    nothing else says how large its constant damping is.
    """
    data = diagnosis.data
    record = int(np.flatnonzero((data.layout.rig == data.rigs.index(like or rig)) & ~data.layout.wind)[0])
    curves = [predicted(fit, record, read.amplitude) for fit in (diagnosis.null, diagnosis.final)]
    if levelled:
        middle = np.argsort(read.amplitude)[len(read.amplitude) // 2]
        curves = [curve + read.damping[middle] - curve[middle] for curve in curves]
    return Part(rig, read, *curves)


def _with_records(campaign: Campaign, change: Callable[[Rig], tuple[Record, ...]]) -> Campaign:
    return replace(campaign, rigs=tuple(replace(rig, records=change(rig)) for rig in campaign.rigs))


def _half(record: Record, rig: Rig, upper: bool) -> Record:
    """What a record holds above, or below, the middle of its amplitudes, even in their logarithm."""
    time, a = turning_points(record, rig.frequency.mean)
    cut = time[np.argmax(a < np.sqrt(a[0] * a[-1]))]
    keep = record.time <= cut if upper else record.time > cut
    return replace(record, time=record.time[keep], response=record.response[keep])


def withheld(campaign: Campaign, diagnose: Callable[[Campaign], Diagnosis]) -> Iterator[Withheld]:
    """Leave amplitudes, records and rigs out in turn, diagnose the rest, and foretell the damping left out."""
    rigs = [rig for rig in campaign.rigs if rig.records]
    for what, upper in (("small amplitudes", True), ("large amplitudes", False)):
        found = diagnose(_with_records(campaign, lambda rig: tuple(_half(r, rig, upper) for r in rig.records)))  # noqa: B023
        out = {rig.name: replace(rig, records=tuple(_half(r, rig, not upper) for r in rig.records)) for rig in rigs}
        yield Withheld(what, found.found, [foretold(found, name, of_rig(rig)) for name, rig in out.items()], found)
    if len(rigs) > 1:
        for rig in rigs:
            rest = replace(campaign, rigs=tuple(r for r in campaign.rigs if r is not rig),
                           tests=tuple(t for t in campaign.tests if t.rig != rig.name))  # fmt: skip
            found = diagnose(rest)
            like = next(r.name for r in rest.rigs if r.records)
            part = foretold(found, rig.name, of_rig(rig), like=like, levelled=True)
            yield Withheld(f"rig {rig.name}", found.found, [part], found)
    elif len(rigs[0].records) > 1:
        for i, record in enumerate(rigs[0].records):
            found = diagnose(_with_records(campaign, lambda rig: rig.records[:i] + rig.records[i + 1 :]))  # noqa: B023
            out_rig = replace(rigs[0], records=(record,))
            yield Withheld(f"record {i + 1}", found.found, [foretold(found, rigs[0].name, of_rig(out_rig))], found)


@dataclass(frozen=True, eq=False)
class Examined:
    """A set with all that was found in it."""

    known: Known
    campaign: Campaign
    read: Mapping[str, Decrements]  # by rig
    diagnosis: Diagnosis
    content: Mapping[str, Any]  # of gap.json
    on_used: tuple[float, float]  # median relative error of the damping, both models fitted to everything

    @cached_property
    def withheld(self) -> list[Withheld]:
        """What was left out in turn; every part is diagnosed anew."""
        return list(withheld(self.campaign, lambda part: examine(part, load_card())[0]))

    @property
    def named(self) -> frozenset[str]:
        """What verdict, `also` and the verdict's group name."""
        group = self.content["indistinguishable"]
        return frozenset([self.content["verdict"], *self.content["also"], *(group[0] if group else ())])

    @property
    def missed(self) -> list[str]:
        """True effects that are not named."""
        return [name for name in self.known.truth if name not in self.named]

    @property
    def wrong(self) -> dict[str, float]:
        """Probability of everything that is not true."""
        every = {**self.content["probability"], **self.content.get("probability_also", {})}
        return {name: p for name, p in every.items() if name not in (*self.known.truth, *self.known.besides)}

    @property
    def laws(self) -> dict[str, Law]:
        """The damping law of every rig, fitted by hand."""
        return {name: hand_law(read) for name, read in self.read.items()}


def examined(known: Known, folder: Path) -> Examined:
    """Read a set off by hand, and diagnose it."""
    campaign = load_campaign(folder)
    read = {rig.name: of_rig(rig) for rig in campaign.rigs if rig.records}
    diagnosis, content, _, _ = examine(campaign, load_card())
    on_used = median_error([Withheld("", (), [foretold(diagnosis, *each) for each in read.items()], diagnosis)])
    return Examined(known, campaign, read, diagnosis, content, on_used)
