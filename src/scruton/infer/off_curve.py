"""Peak tests that no single Griffin curve joins: by what factor each lies off, in a sentence that names its rig.

Where no one rig does, two groups of them may, each of which has a curve of its own.

The discrepancy between settings grows until it takes any contradiction, and the band with it: what it took is said.
"""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.laws import amplitude_ratio
from scruton.infer.results import PeakResult, TestResult
from scruton.infer.thresholds import GROUPS_APART, OFF_CURVE

_SURE = (0.05, 0.5, 0.95)
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
    worst = max((_nearest(k, told, (a, sc, rate, n)) for k in range(len(names))), key=lambda one: one[0])
    excess, k, j, (low, middle, high) = worst
    if excess <= np.log(OFF_CURVE):
        a_ref, relaxation = (law.derived[f"reference_{key}"].reshape(-1, 1) for key in ("amplitude", "relaxation"))
        with np.errstate(all="ignore"):
            curve = a_ref * amplitude_ratio((sc - law.posterior.reference[0]) / relaxation, n[:, None])
        return _groups(np.log(a) - np.log(curve), [rigs[name] for name in names], law.label)
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


def _nearest(k: int, told: list[int], of: tuple[FloatArray, ...]) -> tuple[float, int, int, tuple[float, float, float]]:
    """The test j that foretells test k best: ln of the ratio that is sure, k, j, and quantiles of ln of the ratio."""
    a, sc, rate, n = of
    found = []
    for j in told:
        if j == k:
            continue
        with np.errstate(all="ignore"):
            foretold = a[:, j] * amplitude_ratio((sc[:, k] - sc[:, j]) / rate[:, j], n)
            ratio = np.log(a[:, k]) - np.log(foretold)
        low, middle, high = np.quantile(np.nan_to_num(ratio, nan=0.0, posinf=99.0, neginf=-99.0), _SURE).tolist()
        found.append((max(low, -high), k, j, (low, middle, high)))
    return min(found, key=lambda one: one[0], default=(0.0, k, k, (0.0, 0.0, 0.0)))
