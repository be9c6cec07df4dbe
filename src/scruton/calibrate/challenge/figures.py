"""The figures of a challenge: rates and medians over its cases, each with what is wanted of it."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scruton.calibrate.challenge.outcomes import FAILED, NONE, UNKNOWN, Outcome
from scruton.calibrate.challenge.outside import OPEN
from scruton.calibrate.challenge.rates import Reliability, median_interval, reliability, wilson
from scruton.calibrate.challenge.scenarios import CATALOGUE

SEVERE, MILD = "s >= 20 %", "s = 10 %"
_ENOUGH = 0.15  # of severity, to be counted among the severe
_SURE, _MOVED = 0.9, 0.03
_LEAST = 1e-6  # a probability of zero counts as this in the log score
Cases = Sequence[Outcome]


@dataclass(frozen=True)
class Figure:
    """One figure.

    Attributes
    ----------
    name : str
    reached : float
        NaN without cases.
    interval95 : (float, float)
        Wilson's of a rate, by order statistics of a median; NaN where none is given.
    cases : int
    wanted : float or None
    at_most : bool
        Whether smaller is better.
    percent : bool
        Whether it is a rate.
    """

    name: str
    reached: float
    interval95: tuple[float, float]
    cases: int
    wanted: float | None = None
    at_most: bool = False
    percent: bool = True

    @property
    def met(self) -> bool | None:
        """Whether it is as wanted; None where nothing is, or there are no cases."""
        if self.wanted is None or not np.isfinite(self.reached):
            return None
        return self.reached <= self.wanted if self.at_most else self.reached >= self.wanted


def figures(outcomes: Cases, *, one_rig: bool = False) -> tuple[Figure, ...]:
    """Every figure of a challenge; a case that could not be diagnosed counts as wrong.

    Parameters
    ----------
    outcomes : sequence of Outcome
    one_rig : bool
        Of one rig without still-air records less is wanted: that the truth is in a group of at most six.
    """
    single = [one for one in outcomes if one.kind == "catalogue"]
    without = [one for one in outcomes if one.kind == NONE]
    opened = [one for one in outcomes if one.kind == "open"]
    both = [one for one in outcomes if one.kind == "two"]
    found: list[Figure] = []
    for label, severe, group in ((SEVERE, True, 0.99), (MILD, False, 0.94)):
        mine = of_severity(single, severe)
        top = {True: 0.96, False: 0.88}[severe]
        found.append(_rate(f"top-1, {label}", mine, lambda one: one.right, None if one_rig else top))
        found.append(_rate(f"truth in the group, {label}", mine, in_group, 0.95 if one_rig else group))
        sizes = [float(len(one.group)) for one in mine if one.verdict != FAILED]
        found.append(_mean(f"mean group size, {label}", sizes, 6.0 if one_rig else 1.3))
    want = _Wanted(one_rig)
    found.append(_rate("no effect, called something else", without, lambda one: not one.right, want(0.02), True))
    for label, severe, least in ((SEVERE, True, 0.95), (MILD, False, 0.80)):
        mine = of_severity(opened, severe)
        found.append(_rate(f"outside the catalogue, called unknown, {label}", mine, lambda o: o.right, want(least)))
    found += [
        _rate("outside the catalogue, given to an effect with more than 0.9", opened, misled, want(0.03), True),
        _rate("catalogued, called unknown", single, lambda one: one.verdict == UNKNOWN, want(0.03), True),
        *_calibration(outcomes, want),
        *_amplitudes(single, want),
        _median("median held-out shrink, verdict right", _shrinks(single), want(0.85)),
        _median("median held-out shrink, called unknown and right", _shrinks(opened), None),
        _rate("two at once, both named, s >= 20 %", of_severity(both, True), lambda one: one.both_named, want(0.70)),
        _rate("two at once, the first is one of them", both, lambda one: one.right, None),
        _rate("friction found: exactly its rigs named", _friction(single), lambda o: set(o.rigs) == set(o.rigs_named)),
    ]
    seconds = [one.seconds for one in outcomes if one.seconds is not None]
    found.append(_median("seconds a campaign, one process (median)", seconds, 20.0, at_most=True))
    found.append(_rate("no diagnosis", outcomes, lambda one: one.verdict == FAILED))
    return tuple(found)


@dataclass(frozen=True)
class _Wanted:
    """Of one rig nothing is wanted but the group."""

    one_rig: bool

    def __call__(self, value: float) -> float | None:
        return None if self.one_rig else value


def of_severity(outcomes: Cases, severe: bool) -> list[Outcome]:
    """Cases at 20 per cent and more, or those below."""
    return [one for one in outcomes if (one.severity > _ENOUGH) == severe]


def in_group(one: Outcome) -> bool:
    """Whether the truth is among the effects that cannot be told from the verdict."""
    return set(one.truth) <= set(one.group)


def misled(one: Outcome) -> bool:
    """Whether a case from outside the catalogue is given to an effect of it, and with certainty."""
    return any(p > _SURE for name, p in one.probability.items() if name in CATALOGUE and name not in one.accepted)


def calibration(outcomes: Cases) -> Reliability:
    """Reliability of the verdicts' probabilities, over all cases that have them."""
    mine = [one for one in outcomes if one.probability]
    return reliability([one.probability.get(one.verdict, 0.0) for one in mine], [one.right for one in mine])


def confusion(outcomes: Cases) -> tuple[tuple[str, ...], tuple[str, ...], np.ndarray]:
    """Truths, verdicts, and the number of cases of each pair."""
    rows = tuple(name for name in (NONE, *CATALOGUE, "two", *OPEN) if any(one.name == name for one in outcomes))
    extra = {one.verdict for one in outcomes} - {NONE, *CATALOGUE, UNKNOWN}
    columns = (NONE, *CATALOGUE, UNKNOWN, *sorted(extra))
    counts = np.zeros((len(rows), len(columns)), dtype=int)
    for one in outcomes:
        counts[rows.index(one.name), columns.index(one.verdict)] += 1
    return rows, columns, counts


def by_effect(outcomes: Cases) -> list[dict[str, object]]:
    """One row an effect and severity, and one for all severities (severity None)."""
    rows: list[dict[str, object]] = []
    for name in confusion(outcomes)[0]:
        mine = [one for one in outcomes if one.name == name]
        severities = sorted({one.severity for one in mine})
        for s in [*severities, None] if len(severities) > 1 else severities:
            here = [one for one in mine if s is None or one.severity == s]
            wrong = [one.verdict for one in here if not one.right]
            low, high = wilson(sum(one.right for one in here), len(here))
            rows.append({
                "truth": name, "severity": s, "cases": len(here),
                "right": float(np.mean([one.right for one in here])), "low95": low, "high95": high,
                "in_group": float(np.mean([in_group(one) for one in here])) if here[0].kind == "catalogue" else None,
                "group_size": float(np.mean([len(one.group) for one in here])),
                "unknown": float(np.mean([one.verdict == UNKNOWN for one in here])),
                "both_named": float(np.mean([one.both_named for one in here])) if name == "two" else None,
                "shrink": _middle([one.shrink for one in here if one.right and one.shrink is not None]),
                "most_often_wrong": max(set(wrong), key=lambda v: (wrong.count(v), v)) if wrong else "",
            })  # fmt: skip
    return rows


def _rate(
    name: str, cases: Iterable[Outcome], hit: Callable[[Outcome], bool], wanted: float | None = None,
    at_most: bool = False,
) -> Figure:  # fmt: skip
    hits = [hit(one) for one in cases]
    reached = sum(hits) / len(hits) if hits else np.nan
    return Figure(name, reached, wilson(sum(hits), len(hits)), len(hits), wanted, at_most)


def _mean(name: str, values: Sequence[float], wanted: float) -> Figure:
    if not values:
        return Figure(name, np.nan, (np.nan, np.nan), 0, wanted, True, False)
    mean = float(np.mean(values))
    half = 1.96 * float(np.std(values, ddof=1)) / np.sqrt(len(values)) if len(values) > 1 else np.nan
    return Figure(name, mean, (mean - half, mean + half), len(values), wanted, True, False)


def _median(name: str, values: Sequence[float], wanted: float | None, *, at_most: bool = False) -> Figure:
    reached = float(np.median(values)) if values else np.nan
    return Figure(name, reached, median_interval(values), len(values), wanted, at_most, False)


def _middle(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None


def _calibration(outcomes: Cases, want: _Wanted) -> list[Figure]:
    """Calibration error, what chance makes of it, and the mean log score of the truth (of two, of either)."""
    mine = [one for one in outcomes if one.probability]
    found, nothing = calibration(mine), (np.nan, np.nan)
    scores = [np.log(max(sum(one.probability.get(name, 0.0) for name in one.accepted), _LEAST)) for one in mine]
    score = float(np.mean(scores)) if scores else np.nan
    error = "calibration error of the verdict's probability"
    return [
        Figure(error, found.error, nothing, len(mine), want(0.04), True, False),
        Figure("... that finite bins alone would give", found.chance, nothing, len(mine), None, True, False),
        Figure("mean log score of the truth", score, nothing, len(mine), None, False, False),
    ]


def _amplitudes(single: Cases, want: _Wanted) -> list[Figure]:
    """Error of the stable amplitude at a Scruton number left out, before over after, against truth and measurement."""
    mine = [t for one in of_severity(single, True) if one.right for t in one.settled if t.moved > _MOVED]
    ratios: Mapping[str, list[float]] = {
        key: [abs(t.before - getattr(t, key)) / max(abs(t.after - getattr(t, key)), 1e-12) for t in mine]
        for key in ("truth", "measured")
    }
    name = "held-out stable amplitude, error before over after"
    return [
        _median(f"{name}, s >= 20 %", ratios["truth"], want(5.0)),
        _median(f"{name}, against the measured one", ratios["measured"], None),
    ]


def _shrinks(cases: Cases) -> list[float]:
    return [one.shrink for one in cases if one.right and one.shrink is not None]


def _friction(single: Cases) -> list[Outcome]:
    return [one for one in single if one.truth == ("coulomb_friction",) and one.right]
