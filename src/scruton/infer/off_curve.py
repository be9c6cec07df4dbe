"""Peak tests that no single Griffin curve joins: by what factor each lies off, in a sentence that names its rig.

Where no one rig does, two groups of them may, each of which has a curve of its own.

The discrepancy between settings grows until it takes any contradiction, and the band with it: what it took is said.
"""

import numpy as np
from scipy.special import ndtr, ndtri

from scruton.arrays import FloatArray
from scruton.dynamics.laws import amplitude_ratio
from scruton.infer.results import PeakResult, TestResult
from scruton.infer.thresholds import CHANCE, GROUPS_APART, OFF_CURVE
from scruton.stats.priors import Prior

_SURE = (0.05, 0.5, 0.95)
_NORMAL = ndtri(_SURE)
_TAU_GRID = np.linspace(-3.2, 3.2, 61)  # in standard deviations of the prior
_WHY = (
    "A unit, a mass or a damping ratio is wrong, or section, wind or law is another; the discrepancy between settings "
    "takes it, and with it the band of predictions"
)


def off_curve(joint: PeakResult, tests: list[TestResult]) -> str:
    """Name the rig farthest off what the others foretell, both of two, or two groups; empty where they agree."""
    names = joint.tests
    if len(names) < 2:
        return ""
    rigs = {result.test.name: result.rig.name for result in tests}
    law = next(law for law in joint.laws if law.label == joint.weights.labels[int(np.argmax(joint.weights.weight))])
    a, sc = (law.derived[key].reshape(-1, len(names)) for key in ("a_star", "scruton_number"))
    omega0 = np.array([test.wind.omega0 for test in law.posterior.tests])
    rate = (law.derived["mass_damping_factor"] * law.derived["relaxation_rate"]).reshape(a.shape) / omega0
    n = np.resize(law.derived["n"], len(a))
    told = [j for j, test in enumerate(law.posterior.tests) if test.relaxes]
    scale = {prior.name: prior for prior in law.posterior.shared}
    tau, kappa = (scale[f"discrepancy_{name}"] for name in ("amplitude", "relaxation"))
    ratios, errors = _ratios(told, (a, sc, rate, n), float(kappa.from_sampled(np.array(kappa.location))))
    found = (_nearest(k, ratios) for k in range(len(names)))
    off = [one for one in found if one[0] > np.log(OFF_CURVE) and _by_chance(*one[1:3], ratios, errors, tau) < CHANCE]
    if not off:
        a_ref, relaxation = (law.derived[f"reference_{key}"].reshape(-1, 1) for key in ("amplitude", "relaxation"))
        with np.errstate(all="ignore"):
            curve = a_ref * amplitude_ratio((sc - law.posterior.reference[0]) / relaxation, n[:, None])
        return _groups(np.log(a) - np.log(curve), [rigs[name] for name in names], law.label)
    _, k, j, (low, middle, high) = max(off, key=lambda one: one[0])
    by = f"{np.exp(middle):.3g} times (90 % {np.exp(low):.2g} to {np.exp(high):.2g})"
    if len(names) == 2:
        what = (
            f"rigs {rigs[names[k]]} and {rigs[names[j]]} lie on no one curve: the stable amplitude of test {names[k]} "
        )
        what += f"is {by} what test {names[j]} foretells for its Scruton number by {law.label}"
    else:
        what = (
            f"rig {rigs[names[k]]} lies off the curve of the others: the stable amplitude of test {names[k]} is {by} "
        )
        what += f"what the nearest of them, test {names[j]} of rig {rigs[names[j]]}, foretells by {law.label}"
    return f"{what}. {_WHY}"


def _groups(off: FloatArray, rigs: list[str], law: str) -> str:
    """Name two groups of at least two rigs that lie on two curves, by how far ln of each amplitude is off one (S, J).

    The gap between them is far larger than the discrepancy usual between rigs, and than the range of either.
    """
    off = off[np.isfinite(off).all(axis=1)]
    if not len(off):
        return ""
    # of each rig the median: between draws of rigs whose damping is hardly known the gap would close
    middle_of = np.median(off, axis=0)
    order = np.argsort(middle_of)
    for split in range(2, len(rigs) - 1):
        lower, upper = order[:split], order[split:]
        gap = float(middle_of[upper[0]] - middle_of[lower[-1]])
        apart = off[:, upper].mean(axis=1) - off[:, lower].mean(axis=1)
        low, middle, high = np.exp(np.quantile(apart, _SURE)).tolist()
        if min(np.exp(gap), low) > GROUPS_APART and gap > max(np.ptp(middle_of[lower]), np.ptp(middle_of[upper])):
            named = [", ".join(rigs[k] for k in sorted(group)) for group in (upper, lower)]
            return (
                f"rigs {named[0]} and rigs {named[1]} lie on two curves: by {law} the stable amplitudes of the former "
                f"are {middle:.3g} times (90 % {low:.2g} to {high:.2g}) those of the latter. {_WHY}"
            )
    return ""


def _ratios(told: list[int], of: tuple[FloatArray, ...], kappa: float) -> tuple[FloatArray, FloatArray]:
    """Quantiles of ln of each amplitude k over what test j foretells for it, (J, J, 3), and their error, (J, J).

    The error is that of the draws and of slopes of transients that are off by `kappa`.  NaN where j = k, and where
    test j tells no rate.
    """
    a, sc, rate, n = of
    found = np.full((a.shape[1], a.shape[1], len(_SURE)), np.nan)
    slope = np.full(found.shape[:2], np.nan)
    for j in told:
        x = (sc - sc[:, [j]]) / rate[:, [j]]
        with np.errstate(all="ignore"):
            middle, steep, flat = (
                np.nan_to_num(np.log(a / (a[:, [j]] * amplitude_ratio(x * f, n[:, None]))), posinf=99.0, neginf=-99.0)
                for f in (1.0, np.exp(kappa), np.exp(-kappa))
            )
        found[:, j] = np.quantile(middle, _SURE, axis=0).T
        slope[:, j] = 0.5 * np.abs(np.median(steep, axis=0) - np.median(flat, axis=0))
        found[j, j] = np.nan
    return found, np.hypot((found[..., 2] - found[..., 0]) / (_NORMAL[2] - _NORMAL[0]), slope)


def _nearest(k: int, ratios: FloatArray) -> tuple[float, int, int, tuple[float, float, float]]:
    """The test j that foretells test k best: ln of the ratio that is sure, k, j, and quantiles of ln of the ratio."""
    sure = np.maximum(ratios[k, :, 0], -ratios[k, :, 2])
    if np.isnan(sure).all():
        return 0.0, k, k, (0.0, 0.0, 0.0)
    j = int(np.nanargmin(sure))
    low, middle, high = ratios[k, j].tolist()
    return float(sure[j]), k, j, (low, middle, high)


def _by_chance(k: int, j: int, ratios: FloatArray, errors: FloatArray, prior: Prior) -> float:
    """Probability that the scatter between settings puts a rig as far off its nearest as test k is off test j.

    The scatter is normal of standard deviation tau, of which the prior and how the others lie about each other tell:
    were test k among them, a rig that is off would widen what it is judged by.
    """
    grid = prior.location + prior.scale * _TAU_GRID
    log_weight, variance = prior.log_density(grid), prior.from_sampled(grid) ** 2
    others = np.delete(np.arange(len(ratios)), k)
    pairs = np.ix_(others, others)
    apart, error = ratios[..., 1][pairs], errors[pairs]
    known = np.isfinite(apart)
    if known.any():
        of_pair = 2.0 * variance[:, None] + error[known] ** 2
        one = -0.5 * (np.log(of_pair) + apart[known] ** 2 / of_pair)
        log_weight = log_weight + (len(others) - 1) * one.mean(axis=1)
    weight = np.exp(log_weight - log_weight.max())
    of_one = variance * (1.0 + 1.0 / len(others)) + errors[k, j] ** 2
    tail = float(np.average(2.0 * ndtr(-abs(ratios[k, j, 1]) / np.sqrt(of_one)), weights=weight))
    # far from its nearest is the highest or the lowest; of two rigs both are, by the same
    return tail * (2 if len(others) > 1 else 1)
