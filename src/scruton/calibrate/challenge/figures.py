"""The figures of a challenge: rates and medians over its cases, each with what is wanted of it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scruton.calibrate.challenge.outcomes import FAILED, NONE, UNKNOWN, Outcome
from scruton.calibrate.challenge.outside import OPEN
from scruton.calibrate.challenge.rates import Reliability, median_interval, reliability, wilson
from scruton.calibrate.challenge.scenarios import CATALOGUE
from scruton.calibrate.thresholds import CERTAIN, LEAST_PROBABILITY, MOVED, SEVERE, WANTED, WANTED_OF_ONE_RIG

SEVERE_LABEL, MILD_LABEL = "s >= 20 %", "s = 10 %"
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
    kinds = {kind: [one for one in outcomes if one.kind == kind] for kind in ("catalogue", NONE, "open", "two")}
    single, without, outside, both = kinds.values()
    table: list[Figure] = []
    for label, severe in ((SEVERE_LABEL, True), (MILD_LABEL, False)):
        mine = of_severity(single, severe)
        table += [
            _rate(f"top-1, {label}", mine, lambda one: one.right),
            _rate(f"truth in the group, {label}", mine, in_group),
            _mean(f"mean group size, {label}", [len(one.group) for one in mine if one.verdict != FAILED]),
        ]
    table.append(_rate("no effect, called something else", without, lambda one: not one.right, at_most=True))
    for label, severe in ((SEVERE_LABEL, True), (MILD_LABEL, False)):
        mine = of_severity(outside, severe)
        table.append(_rate(f"outside the catalogue, called unknown, {label}", mine, lambda one: one.right))
    sure = f"outside the catalogue, given to an effect with more than {CERTAIN:g}"
    friction = [one for one in single if one.truth == ("coulomb_friction",) and one.right]
    seconds = [one.seconds for one in outcomes if one.seconds is not None]
    table += [
        _rate(sure, outside, misled, at_most=True),
        _rate("catalogued, called unknown", single, lambda one: one.verdict == UNKNOWN, at_most=True),
        *_calibration(outcomes),
        *_amplitudes(single),
        _median("median held-out shrink, verdict right", _shrinks(single)),
        _median("median held-out shrink, called unknown and right", _shrinks(outside)),
        _rate(f"two at once, both named, {SEVERE_LABEL}", of_severity(both, True), lambda one: one.both_named),
        _rate("two at once, the first is one of them", both, lambda one: one.right),
        _rate("friction found: exactly its rigs named", friction, lambda one: set(one.rigs) == set(one.rigs_named)),
        _median("seconds a campaign, one process (median)", seconds, at_most=True),
        _rate("no diagnosis", outcomes, lambda one: one.verdict == FAILED),
    ]
    wanted = WANTED_OF_ONE_RIG if one_rig else WANTED
    return tuple(replace(figure, wanted=wanted.get(figure.name)) for figure in table)


def of_severity(outcomes: Cases, severe: bool) -> list[Outcome]:
    """Cases at 20 per cent and more, or those below."""
    return [one for one in outcomes if (one.severity > SEVERE) == severe]


def in_group(one: Outcome) -> bool:
    """Whether the truth is among the effects that cannot be told from the verdict."""
    return set(one.truth) <= set(one.group)


def misled(one: Outcome) -> bool:
    """Whether a case from outside the catalogue is given to an effect of it, and with certainty."""
    return any(p > CERTAIN for name, p in one.probability.items() if name in CATALOGUE and name not in one.accepted)


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
            right, shrinks = _rate("right", here, lambda one: one.right), _shrinks(here)
            wrong = [one.verdict for one in here if not one.right]
            rows.append({
                "truth": name, "severity": s, "cases": len(here),
                "right": right.reached, "low95": right.interval95[0], "high95": right.interval95[1],
                "in_group": _rate("", here, in_group).reached if here[0].kind == "catalogue" else None,
                "group_size": float(np.mean([len(one.group) for one in here])),
                "unknown": _rate("", here, lambda one: one.verdict == UNKNOWN).reached,
                "both_named": _rate("", here, lambda one: one.both_named).reached if name == "two" else None,
                "shrink": float(np.median(shrinks)) if shrinks else None,
                "most_often_wrong": max(set(wrong), key=lambda v: (wrong.count(v), v)) if wrong else "",
            })  # fmt: skip
    return rows


def _rate(name: str, cases: Cases, hit: Callable[[Outcome], bool], *, at_most: bool = False) -> Figure:
    hits = sum(map(hit, cases))
    return Figure(name, hits / len(cases) if cases else np.nan, wilson(hits, len(cases)), len(cases), at_most=at_most)


def _mean(name: str, values: Sequence[float]) -> Figure:
    mean = float(np.mean(values)) if values else np.nan
    half = 1.96 * float(np.std(values, ddof=1)) / np.sqrt(len(values)) if len(values) > 1 else np.nan
    return Figure(name, mean, (mean - half, mean + half), len(values), at_most=True, percent=False)


def _median(name: str, values: Sequence[float], *, at_most: bool = False) -> Figure:
    reached = float(np.median(values)) if values else np.nan
    return Figure(name, reached, median_interval(values), len(values), at_most=at_most, percent=False)


def _calibration(outcomes: Cases) -> list[Figure]:
    """Calibration error, what chance makes of it, and the mean log score of the truth (of two, of either)."""
    mine = [one for one in outcomes if one.probability]
    bins = calibration(mine)
    truths = [max(sum(one.probability.get(name, 0.0) for name in one.accepted), LEAST_PROBABILITY) for one in mine]
    score = float(np.mean(np.log(truths))) if mine else np.nan
    return [
        Figure(name, value, (np.nan, np.nan), len(mine), at_most=at_most, percent=False)
        for name, value, at_most in (
            ("calibration error of the verdict's probability", bins.error, True),
            ("... that finite bins alone would give", bins.chance, True),
            ("mean log score of the truth", score, False),
        )
    ]


def _amplitudes(single: Cases) -> list[Figure]:
    """Error of the stable amplitude at a Scruton number left out, before over after, against truth and measurement."""
    mine = [a for one in of_severity(single, True) if one.right for a in one.settled if a.moved > MOVED]
    name = "held-out stable amplitude, error before over after"
    return [
        _median(f"{name}, {label}", [abs(a.before - x) / max(abs(a.after - x), 1e-12) for a, x in pairs])
        for label, pairs in (
            (SEVERE_LABEL, [(a, a.truth) for a in mine]),
            ("against the measured one", [(a, a.measured) for a in mine]),
        )
    ]


def _shrinks(cases: Cases) -> list[float]:
    return [one.shrink for one in cases if one.right and one.shrink is not None]
