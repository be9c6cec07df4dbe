r"""Prior and posterior predictive checks: whether replicates of the records look like the records.

A replicate is a record that the fitted model would produce under one draw, from the first observed amplitude on.
Statistics of the residual are taken about the mean curve of the same draw, for the observed record and for its
replicate (realised discrepancies; Gelman, Meng and Stern, Statistica Sinica 6, 1996), so that what is uncertain of the
curve is not mistaken for scatter.  Posterior predictive p-values see the data twice and err towards 1/2: a small one
means what it says.
"""

from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.departure import COLUMNS, ROUGH, relative_drift
from scruton.dynamics.laws import closed_form
from scruton.infer.thresholds import MOST_GUSTS, MOST_SET_POINT
from scruton.stats.whiteness import Check

HALF, FINAL, SCATTER = "time to half [s]", "final level", "scatter of increments"
EXCURSION, MEMORY = "largest excursion", "lag-one autocorrelation"
STATISTICS = (HALF, FINAL, SCATTER, EXCURSION, MEMORY)


@dataclass(frozen=True)
class BandShare:
    """Share of a record's cycles inside the central band of its replicates, beside the shares of replicates.

    Attributes
    ----------
    test, record : str
    level : float
        0.5 or 0.9.
    share, low, high : float
        Observed; central 90 % interval of the replicates, each against the band of all.
    """

    test: str
    record: str
    level: float
    share: float
    low: float
    high: float


@dataclass(frozen=True)
class PriorCheck:
    """What the prior alone expects of a record.

    Attributes
    ----------
    test, record : str
    inside : float
        Share of the record's cycles inside the 90 % prior predictive band.
    p_half, p_final : float
        Two-sided prior predictive p-values of time to half and final level.
    huge, instant : float
        Shares of prior draws that exceed ten times the campaign's largest amplitude, and that relax within one cycle.
    """

    test: str
    record: str
    inside: float
    p_half: float
    p_final: float
    huge: float
    instant: float


def time_to_half(time: FloatArray, y: FloatArray) -> FloatArray:
    """Time from the first cycle until the amplitude has first come half way to its final level, (R,) [s].

    Parameters
    ----------
    time : (N,) array
    y : (R, N) array
    """
    first, last = y[:, :1], final_level(y)[:, None]
    passed = (y - 0.5 * (first + last)) * (last - first) >= 0.0
    k = np.maximum(passed.argmax(axis=1), 1)
    rows = np.arange(len(y))
    before, after = y[rows, k - 1], y[rows, k]
    half = 0.5 * (first + last)[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        part = np.clip((half - before) / (after - before), 0.0, 1.0)
    part = np.where(np.isfinite(part), part, 1.0)
    return np.asarray(time[k - 1] + part * (time[k] - time[k - 1]) - time[0])


def final_level(y: FloatArray) -> FloatArray:
    """Mean of the last tenth of the cycles, five at least, (R,)."""
    tail = max(5, y.shape[1] // 10)
    return np.asarray(y[:, -tail:].mean(axis=1))


def statistics(time: FloatArray, y: FloatArray, mean: FloatArray) -> dict[str, FloatArray]:
    """Every statistic of R amplitude records about R mean curves, (R,) each.

    Parameters
    ----------
    time : (N,) array
        Of the cycles [s].
    y, mean : (R, N) arrays
        A/D or rad.
    """
    residual = y - mean
    centred = residual - residual.mean(axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        memory = np.sum(centred[:, 1:] * centred[:, :-1], axis=1) / np.sum(centred**2, axis=1)
    return {
        HALF: time_to_half(time, y),
        FINAL: final_level(y),
        SCATTER: np.diff(residual, axis=1).std(axis=1),
        EXCURSION: np.abs(residual).max(axis=1),
        MEMORY: memory,
    }


def posterior_check(
    test: str, record: str, time: FloatArray, observed: FloatArray, replicate: FloatArray, mean: FloatArray
) -> tuple[list[Check], list[BandShare]]:
    """Statistics of one record against its replicates.

    Parameters
    ----------
    test, record : str
    time, observed : (N,) arrays
    replicate, mean : (R, N) arrays
        Row i is a free run under draw i, and the curve of that draw without noise.

    Returns
    -------
    checks, shares
        `value` is the median over draws of the observed statistic.
    """
    ours = statistics(time, np.broadcast_to(observed, replicate.shape), mean)
    theirs = statistics(time, replicate, mean)
    checks = []
    for name in STATISTICS:
        low, high = np.quantile(theirs[name], [0.05, 0.95])
        p = discrepancy_p(ours[name], theirs[name], positive=name in (SCATTER, EXCURSION))
        checks.append(Check(test, record, name, float(np.median(ours[name])), float(low), float(high), p))
    shares = []
    for level in (0.5, 0.9):
        lower, upper = np.quantile(replicate, [0.5 - level / 2, 0.5 + level / 2], axis=0)
        others = np.mean((replicate >= lower) & (replicate <= upper), axis=1)
        share = float(np.mean((observed >= lower) & (observed <= upper)))
        shares.append(BandShare(test, record, level, share, *(float(q) for q in np.quantile(others, [0.05, 0.95]))))
    return checks, shares


def discrepancy_p(observed: FloatArray, replicate: FloatArray, *, positive: bool) -> float:
    """Two-sided posterior predictive p-value of a realised discrepancy.

    Parameters
    ----------
    observed, replicate : (R,) arrays
        The statistic of the data and of the replicate, draw by draw.
    positive : bool
        Whether the statistic is a scale, to be compared by its logarithm.

    Notes
    -----
    The rank decides.  R draws cannot tell p-values below 2/(R + 1) apart; where every draw falls on one side, the
    normal distribution with the differences' mean and standard deviation is carried on into the tail.
    """
    from scipy.special import ndtr

    if positive:
        tiny = np.finfo(float).tiny
        observed, replicate = np.log(np.maximum(observed, tiny)), np.log(np.maximum(replicate, tiny))
    difference = observed - replicate
    difference = difference[np.isfinite(difference)]
    if difference.size < 2:
        return float("nan")
    above, below = int(np.sum(difference >= 0.0)), int(np.sum(difference <= 0.0))
    p = min(1.0, 2.0 * (1 + min(above, below)) / (difference.size + 1))
    if min(above, below) == 0:
        spread = float(difference.std(ddof=1))
        tail = float(2.0 * ndtr(-abs(float(difference.mean())) / spread)) if spread > 0.0 else 0.0
        return min(p, tail)
    return p


def prior_replicates(
    time: FloatArray,
    standard_error: FloatArray,
    first: float,
    prior: dict[str, FloatArray],
    rng: np.random.Generator,
) -> FloatArray:
    """Records that the prior alone expects, (R, N): the amplitude equation from the first observed amplitude on.

    Parameters
    ----------
    time, standard_error : (N,) arrays
        Of the record's cycles.
    first : float
        First observed amplitude.
    prior : dict of (R,) arrays
        `a_star`, `relaxation_rate` [1/s], `n`, and the noise of `scruton.infer.models`.
    rng : Generator

    Notes
    -----
    The closed form from cycle to cycle, with a departure from the law and what a wake remembers of the start, plus
    scatter that relaxes at the same rate and is stationary in the end, plus sensor noise: what the filters have.
    """
    a_star, rate = prior["a_star"][:, None], prior["relaxation_rate"][:, None]
    start = np.full_like(a_star, max(first, 1e-12))
    scale = prior["departure_scale"]
    gust_scatter = np.minimum(prior["gust_scatter"], MOST_GUSTS)
    set_point = np.minimum(prior["set_point_scatter"], MOST_SET_POINT)
    theta = scale[:, None] * rng.standard_normal((len(rate), COLUMNS))
    curve = np.repeat(start, time.size, axis=1)
    for k, step in enumerate(np.diff(time)):
        a, here = curve[:, k], rate[:, 0] * relative_drift(curve[:, k] / a_star[:, 0], theta)
        curve[:, k + 1] = closed_form(step, a, a_star[:, 0], here, prior["n"])
    forget = np.exp(-rate * np.diff(time))
    kick = np.sqrt(1.0 - forget**2) * rng.standard_normal(forget.shape)
    hold = np.exp(-rate * np.diff(time) / prior["gust_time"][:, None])
    turn = np.sqrt(1.0 - hold**2) * rng.standard_normal(forget.shape)
    gust = np.hypot(gust_scatter, scale**2) * rng.standard_normal(len(rate))
    rough = ROUGH * scale[:, None] * np.diff(curve) / a_star * rng.standard_normal(forget.shape)
    scatter = np.zeros_like(curve)
    for k in range(forget.shape[1]):
        scatter[:, k + 1] = forget[:, k] * scatter[:, k] + kick[:, k] * prior["amplitude_scatter"]
        scatter[:, k + 1] += (1.0 - forget[:, k]) * gust + rough[:, k]
        gust = hold[:, k] * gust + turn[:, k] * gust_scatter
    scatter += set_point[:, None] * rng.standard_normal(len(rate))[:, None] * (1.0 - np.exp(-rate * (time - time[0])))
    scatter *= a_star
    noise = prior["noise_factor"][:, None] * standard_error * rng.standard_normal(curve.shape)
    return np.asarray(curve + scatter + noise)


def prior_check(
    test: str,
    record: str,
    time: FloatArray,
    observed: FloatArray,
    replicate: FloatArray,
    rate: FloatArray,
    largest: float,
) -> PriorCheck:
    """What of a record lies within the prior predictive, and what of the prior predictive is absurd.

    Parameters
    ----------
    test, record : str
    time, observed : (N,) arrays
    replicate : (R, N) array
    rate : (R,) array
        Relaxation rate of every draw [1/s].
    largest : float
        Largest amplitude that the campaign observed.
    """
    lower, upper = np.quantile(replicate, [0.05, 0.95], axis=0)
    row = observed[None]
    cycle = float(np.median(np.diff(time)))
    return PriorCheck(
        test,
        record,
        float(np.mean((observed >= lower) & (observed <= upper))),
        _rank_p(float(time_to_half(time, row)[0]), time_to_half(time, replicate)),
        _rank_p(float(final_level(row)[0]), final_level(replicate)),
        float(np.mean(replicate.max(axis=1) > 10.0 * largest)),
        float(np.mean(rate * cycle > 1.0)),
    )


def _rank_p(value: float, draws: FloatArray) -> float:
    draws = draws[np.isfinite(draws)]
    above, below = int(np.sum(draws >= value)), int(np.sum(draws <= value))
    return min(1.0, 2.0 * (1 + min(above, below)) / (draws.size + 1))
