r"""Whether the filter's innovations are what they should be: standard normal, and predictable from nothing.

The filter says of every cycle what it expects, and how surely; the standardised difference is the innovation.  Where
the model is right, innovations are independent and standard normal.  Innovations with a memory mean that the state
has a dynamics that the model lacks; innovations that bend with the amplitude mean that the law of damping has another
shape.  The first cycle of a record has no forecast and is left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtr, chdtrc, chdtri, fdtrc, fdtri, ndtr, stdtr

from scruton.arrays import FloatArray
from scruton.stats.thresholds import FEWEST_INNOVATIONS, MOST_LAGS

# Names of the checks: those that say whether the innovations can be predicted come first.
MEMORY, TREND, LAW = "Ljung-Box", "trend with amplitude", "curvature with amplitude"
MEAN, VARIANCE, NORMALITY = "mean", "variance", "Anderson-Darling"
PREDICTABLE = (MEMORY, TREND, LAW)


@dataclass(frozen=True)
class Check:
    """One statistic, `name`, of one record beside what the model expects of it.

    Attributes
    ----------
    test, record : str
        `record` is empty for a statistic of all records of a test.
    value : float
        As observed; NaN where it cannot be computed.
    low, high : float
        Central 90 % interval that the model expects; 0 to the 95 % point of statistics that are bad when large.
    p : float
        Two-sided, or that of the large values; NaN where it cannot be computed.
    adjusted : float
        `p` after Holm's correction over its family.
    """

    test: str
    record: str
    name: str
    value: float
    low: float
    high: float
    p: float
    adjusted: float = float("nan")


def holm(p: Sequence[float] | FloatArray) -> FloatArray:
    """Holm's step-down adjustment of a family of p-values, same order; NaN stay NaN and do not count.

    References
    ----------
    Holm, "A simple sequentially rejective multiple test procedure", Scand. J. Statist. 6 (1979).
    """
    values = np.asarray(p, dtype=float)
    adjusted = np.full(values.shape, np.nan)
    known = np.flatnonzero(np.isfinite(values))
    order = known[np.argsort(values[known], kind="stable")]
    steps = np.arange(order.size, 0, -1) * values[order]
    adjusted[order] = np.minimum(np.maximum.accumulate(steps), 1.0)
    return adjusted


def autocorrelation(x: FloatArray, lags: int) -> FloatArray:
    """Sample autocorrelation at lags 1 to `lags`, (lags,)."""
    centred = x - x.mean()
    total = float(centred @ centred) or np.nan
    return np.array([float(centred[k:] @ centred[:-k]) / total for k in range(1, lags + 1)])


def lags_of(size: int) -> int:
    """Lags that a record of this many innovations is tested at: a fifth of them, at most 20."""
    return int(max(1, min(MOST_LAGS, size // 5)))


def ljung_box(x: FloatArray, lags: int, neighbours: float = 0.0) -> tuple[float, float]:
    """Ljung-Box statistic and its p-value (chi-square with `lags` degrees of freedom).

    The chi-square law is that of long records: of 70 cycles, one white record in forty has a p-value below 0.01.
    A correlation of neighbours from 0 to `neighbours` is expected, and counts by what it is beyond.
    """
    r, n = autocorrelation(x, lags), x.size
    r[0] -= np.clip(r[0], 0.0, neighbours)
    q = float(n * (n + 2) * np.sum(r**2 / (n - np.arange(1, lags + 1))))
    return q, float(chdtrc(lags, q))


def anderson_darling(x: FloatArray) -> tuple[float, float]:
    """Anderson-Darling statistic for normality with unknown mean and variance, and its p-value.

    References
    ----------
    D'Agostino and Stephens, "Goodness-of-fit techniques" (1986), Table 4.9.
    """
    from scipy.special import log_ndtr

    n = x.size
    z = np.sort((x - x.mean()) / x.std(ddof=1))
    weights = 2.0 * np.arange(1, n + 1) - 1.0
    a2 = float(-n - np.sum(weights * (log_ndtr(z) + log_ndtr(-z[::-1]))) / n)
    a2 *= 1.0 + 0.75 / n + 2.25 / n**2
    if a2 < 0.2:
        p = 1.0 - np.exp(-13.436 + 101.14 * a2 - 223.73 * a2**2)
    elif a2 < 0.34:
        p = 1.0 - np.exp(-8.318 + 42.796 * a2 - 59.938 * a2**2)
    elif a2 < 0.6:
        p = np.exp(0.9177 - 4.279 * a2 - 1.38 * a2**2)
    else:
        p = np.exp(1.2937 - 5.709 * a2 + 0.0186 * min(a2, 153.0) ** 2)
    return a2, float(np.clip(p, 0.0, 1.0))


def trend(x: FloatArray, before: FloatArray) -> tuple[float, float]:
    """F statistic and p-value of slope and curvature of innovations against the amplitude of the cycle before.

    Parameters
    ----------
    x, before : (N,) arrays
        Innovations, and what they are regressed on: known before the innovation is, so that the test is exact but
        for the estimated parameters.
    """
    _, _, rest, freedom = _regression(x, before)
    if np.isnan(rest):
        return rest, rest
    total = float(np.sum((x - x.mean()) ** 2))
    value = (total - rest) / 2.0 / (rest / freedom)
    return value, float(fdtrc(2, freedom, value))


def curvature(x: FloatArray, before: FloatArray) -> tuple[float, float]:
    """Student's t of the curvature of innovations against amplitude, and its two-sided p-value.

    Stable amplitude and relaxation rate are fitted, which leaves the laws of damping to differ in their curvature.
    """
    design, coefficients, rest, freedom = _regression(x, before)
    if np.isnan(rest):
        return rest, rest
    spread = rest / freedom * np.linalg.inv(design.T @ design)[2, 2]
    value = float(coefficients[2] / np.sqrt(spread))
    return value, float(2.0 * stdtr(freedom, -abs(value)))


def _regression(x: FloatArray, amplitude: FloatArray) -> tuple[FloatArray, FloatArray, float, int]:
    """Regress x on 1, s and s^2 of the amplitude scaled to unit spread.

    Gives the design, the coefficients, the rest's sum of squares, NaN where there is none, and its freedom.
    """
    s = (amplitude - amplitude.mean()) / (amplitude.std() or 1.0)
    design = np.stack([np.ones_like(s), s, s * s], axis=1)
    coefficients, rest, rank, _ = np.linalg.lstsq(design, x, rcond=None)
    freedom = x.size - design.shape[1]
    known = rank == design.shape[1] and freedom >= 1 and rest.size > 0
    return design, coefficients, float(rest[0]) if known else float("nan"), freedom


def judge(
    innovation: FloatArray, amplitude: FloatArray, test: Sequence[str] | np.ndarray, record: Sequence[str] | np.ndarray
) -> tuple[Check, ...]:
    """Every check of every record, and the curvature over all records of a test.

    Parameters
    ----------
    innovation : (N,) array
        Standardised, all records end to end.
    amplitude : (N,) array
        As observed, in any unit.
    test, record : (N,) arrays of str

    Returns
    -------
    tuple of Check
        Adjusted over the records: `PREDICTABLE` as one family, the others each as their own.
    """
    test, record = np.asarray(test), np.asarray(record)
    checks: list[Check] = []
    for name in dict.fromkeys(test.tolist()):
        pooled: list[tuple[FloatArray, FloatArray]] = []
        for label in dict.fromkeys(record[test == name].tolist()):
            cycles = (test == name) & (record == label)
            good = np.isfinite(innovation[cycles][1:])
            x, before = innovation[cycles][1:][good], amplitude[cycles][:-1][good]
            if x.size >= FEWEST_INNOVATIONS:
                checks += _record(str(name), str(label), x, before)
                pooled.append((x, before))
        if pooled:
            value, p = curvature(*(np.concatenate(part) for part in zip(*pooled, strict=True)))
            checks.append(Check(str(name), "", LAW, value, -1.645, 1.645, p))
    return adjust(checks, [PREDICTABLE, *((statistic,) for statistic in (MEAN, VARIANCE, NORMALITY))])


def adjust(checks: Sequence[Check], families: Sequence[Sequence[str]]) -> tuple[Check, ...]:
    """Holm's correction over each family of names; checks of no family keep a NaN."""
    adjusted = list(checks)
    for family in families:
        index = [i for i, check in enumerate(adjusted) if check.name in family]
        for i, p in zip(index, holm([adjusted[i].p for i in index]), strict=True):
            adjusted[i] = replace(adjusted[i], adjusted=float(p))
    return tuple(adjusted)


def _record(test: str, record: str, x: FloatArray, before: FloatArray) -> list[Check]:
    n, lags = x.size, lags_of(x.size)
    q, p_memory = ljung_box(x, lags)
    slope, p_trend = trend(x, before)
    a2, p_normal = anderson_darling(x)
    mean, total = float(x.mean()), float(np.sum((x - x.mean()) ** 2))
    p_mean = float(2.0 * ndtr(-abs(mean) * np.sqrt(n)))
    p_variance = float(2.0 * min(chdtr(n - 1, total), chdtrc(n - 1, total)))
    low, high = (float(chdtri(n - 1, 1.0 - q)) / (n - 1) for q in (0.05, 0.95))
    reach = 1.645 / float(np.sqrt(n))
    return [
        Check(test, record, MEMORY, q, 0.0, float(chdtri(lags, 0.05)), p_memory),
        Check(test, record, TREND, slope, 0.0, float(fdtri(2, n - 3, 0.95)), p_trend),
        Check(test, record, MEAN, mean, -reach, reach, p_mean),
        Check(test, record, VARIANCE, total / (n - 1), low, high, min(p_variance, 1.0)),
        Check(test, record, NORMALITY, a2, 0.0, 0.752, p_normal),
    ]
