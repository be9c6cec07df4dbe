"""The absolute check: whether a hypothesis leaves what noise would leave, or is the best of a bad lot."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, ndtr

from scruton.arrays import FloatArray
from scruton.dynamics.effects import Term
from scruton.gap.hypothesis import FittedHypothesis
from scruton.gap.thresholds import (
    BLOCKS,
    EXCESS_SIGMAS,
    EXTRACTED,
    FEWEST_CYCLES,
    KNOCK_SIZE,
    KNOCKS,
    KURTOSIS_SHARE,
    LAGS,
    OF_MEANS,
)
from scruton.stats.whiteness import ljung_box


@dataclass(frozen=True, eq=False)
class Check:
    """p-values of tests on the innovations of one hypothesis; NaN where no record is long enough for one.

    Attributes
    ----------
    colour, level, spread, tails : float
        Ljung-Box (six lags, without what turbulence shares between neighbours), means of the quarters of every record,
        variances of the quarters, kurtosis: of amplitude.
    phase : float
        Ljung-Box of the phase.
    excess : float
        What colour and level leave beyond noise, in nats.
    knocks : float
        Log likelihood of sudden, rare jumps of the amplitude over none, in nats: of innovations of which one in a
        hundred is ten times as large as the others.
    """

    colour: float
    level: float
    spread: float
    tails: float
    phase: float
    excess: float
    knocks: float


def check(fit: FittedHypothesis) -> Check:
    """Test the innovations of a hypothesis at its optimum, in wind where there are such records."""
    data = fit.hypothesis.data.channels
    v, s = (x[0] for x in fit.hypothesis.innovations(fit.mode[None]))
    z = v / np.sqrt(s)
    amplitude, phase = z[: data.size], z[data.size : 2 * data.size]
    shared = shared_by_neighbours(fit, s[: data.size])
    # sums of squares that noise would make, and their degrees of freedom
    sums = {name: np.zeros(2) for name in ("colour", "level", "spread", "phase")}
    fourth, count = 0.0, 0
    for cycles in _checked(fit):
        x, y = amplitude[cycles][1:], phase[cycles]
        y = y[y != 0.0]
        if y.size:
            sums["colour"] += _ljung_box(x, float(shared[cycles].mean()))
        else:  # an envelope from elsewhere: what it was extracted by is shared by some cycles
            sums["colour"] += _ljung_box(x[::EXTRACTED])
        for block in np.array_split(x, BLOCKS):
            n = block.size
            sums["level"] += block.mean() ** 2 * n, 1
            # Wilson-Hilferty: a standard normal from a sum of squares
            cube = (float(np.sum(block**2)) / n) ** (1.0 / 3.0)
            sums["spread"] += ((cube - (1.0 - 2.0 / (9.0 * n))) / np.sqrt(2.0 / (9.0 * n))) ** 2, 1
        fourth += float(np.sum(np.minimum(x, 20.0) ** 4))
        count += x.size
        if y.size >= FEWEST_CYCLES:
            sums["phase"] += _ljung_box(y)
    kurtosis = (fourth / count - 3.0) / np.sqrt(24.0 / count) if count else np.nan
    p = {name: float(chdtrc(freedom, value)) if freedom else np.nan for name, (value, freedom) in sums.items()}
    # nats beyond noise: half of what a sum exceeds its mean by, less some of its standard deviations
    excess = [
        max(0.0, 0.5 * (value - freedom) - EXCESS_SIGMAS * float(np.sqrt(0.5 * max(freedom, 1))))
        for value, freedom in (sums["colour"].tolist(), sums["level"].tolist())
    ]
    tails, knocks = float(ndtr(-KURTOSIS_SHARE * kurtosis)), sum(knocked(fit).values())
    return Check(**p, tails=tails, excess=excess[0] + excess[1], knocks=knocks)


def shared_by_neighbours(fit: FittedHypothesis, variance: FloatArray) -> FloatArray:
    """Correlation of neighbouring innovations of the amplitude that turbulence makes, at most, (N,).

    An amplitude is a mean over its cycle: the steps of a random walk that is read so share a quarter with their
    neighbours; the noise of the sensor, which is the rest of the variances (N,), shares nothing.
    """
    data = fit.hypothesis.data.channels
    noise = fit.table[data.record, Term.NOISE] * data.standard_error
    return np.asarray(OF_MEANS * np.maximum(1.0 - noise**2 / variance, 0.0))


def _checked(fit: FittedHypothesis) -> Iterator[np.ndarray]:
    """Cycles of every record that is checked, (N,) of bool: of those in wind, where there are some.

    Not of one whose wave is cut off in the model, where that is seen in records of the rig: harmonics that the samples
    are too few for beat with them, and are no amplitude.
    """
    data, layout = fit.hypothesis.data.channels, fit.hypothesis.data.layout
    seen = np.isin(layout.rig, layout.rig[list(layout.cut_off)])
    cut_off = np.flatnonzero(seen & (fit.table[:, Term.CLIP] > 0.0))
    for r in range(len(layout.records)):
        # In still air what is left is the demodulation's own: it counts only where there is nothing else.
        cycles = data.record == r
        in_question = (layout.wind[r] or not layout.wind.any()) and r not in cut_off
        if in_question and np.count_nonzero(cycles) > FEWEST_CYCLES:
            yield cycles


def knocked(fit: FittedHypothesis) -> dict[str, float]:
    """Log likelihood of sudden, rare jumps of the amplitude over none, by record [nats]."""
    data, layout = fit.hypothesis.data.channels, fit.hypothesis.data.layout
    v, s = fit.hypothesis.innovations(fit.mode[None])
    x = (v / np.sqrt(s))[0, : data.size]
    rare = np.log(KNOCKS / KNOCK_SIZE) + 0.5 * x * x * (1.0 - KNOCK_SIZE**-2.0)
    ratio = np.logaddexp(np.log1p(-KNOCKS), rare)
    return {layout.records[data.record[cycles][0]]: float(ratio[cycles][1:].sum()) for cycles in _checked(fit)}


def _ljung_box(x: FloatArray, neighbours: float = 0.0) -> tuple[float, int]:
    lags = min(LAGS, x.size // 4)
    return (ljung_box(x, lags, neighbours)[0], lags) if lags else (0.0, 0)
