"""What is scored: Y1, epsilon, lambda and stable amplitudes at half, once and three times the tested Scruton number.

Outside the family it is the stable amplitude and the relaxation rate of the tested settings, and what `predict` says of
new settings and of a rig left out.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.calibrate.regimes import Regime
from scruton.calibrate.truths import Drawn, omega0
from scruton.dynamics import amplitude_ratio

MULTIPLES = (0.5, 1.0, 3.0)
INTERVALS = (0.50, 0.90, 0.95)


@dataclass(frozen=True)
class Score:
    """How a posterior stands to the truth.

    Attributes
    ----------
    truth : float
    rank : float
        Share of draws below the truth, half of those equal to it: uniform where the posterior is calibrated.
    z : float
        Truth less posterior mean over posterior sd, of the logarithm of the magnitude.
    posterior_sd : float
        Of the same logarithm.
    """

    truth: float
    rank: float
    z: float
    posterior_sd: float


def quantities(drawn: Drawn, regime: Regime, z_new: FloatArray) -> dict[str, FloatArray]:
    """Every quantity of a regime, (S,) each.

    Parameters
    ----------
    drawn : Drawn
        Draws of a posterior, or the truth.
    regime : Regime
    z_new : (S,) array
        Standard normal deviation of a new setting from the curve.

    Returns
    -------
    dict
        "Y1", "epsilon", "lambda", "a*", "A(3 Sc)" by the test's own Griffin curve, "A_new(3 Sc)" for a new setting with
        its own discrepancy. With several tests, the first five are "... of test 2", and new settings are at multiples
        of the geometric mean of the tested Scruton numbers; regimes that weigh laws have new settings at multiples of
        every one, and nothing else.
    """
    tested = regime.scruton_numbers
    suffix = [f" of test {j + 1}" if len(tested) > 1 else "" for j in range(len(tested))]
    table: dict[str, FloatArray] = {}
    if regime.weighs_laws:
        for j, sc in enumerate(tested):
            table |= {f"A_new({k:g} Sc){suffix[j]}": new_setting(drawn, k * sc, z_new) for k in MULTIPLES}
        return table
    for j, sc in enumerate(tested):
        own = {"Y1": drawn.Y1, "epsilon": drawn.epsilon, "lambda": drawn.relaxation_rate, "a*": drawn.a_star}
        table |= {f"{name}{suffix[j]}": values[:, j] for name, values in own.items()}
        for k in MULTIPLES:
            table[f"A({k:g} Sc){suffix[j]}"] = own_curve(drawn, j, k * sc, omega0(regime.motion))
    mean = float(np.exp(np.log(tested).mean()))
    return table | {f"A_new({k:g} Sc)": new_setting(drawn, k * mean, z_new) for k in MULTIPLES}


def own_settings(truth: Drawn, posterior: Drawn, regime: Regime) -> dict[str, tuple[float, FloatArray]]:
    """Stable amplitude and relaxation rate of every tested setting, truth (1, J) and posterior (S, J), by name."""
    table = {}
    for j in range(len(regime.scruton_numbers)):
        table[f"a* of test {j + 1}"] = float(truth.a_star[0, j]), posterior.a_star[:, j]
        if not regime.remembers:
            table[f"lambda of test {j + 1}"] = float(truth.relaxation_rate[0, j]), posterior.relaxation_rate[:, j]
    return table


def new_settings(regime: Regime) -> dict[str, float]:
    """Scruton numbers that are predicted: those tested, between them, half the smallest and twice the largest."""
    tested = regime.scruton_numbers
    places = {f"A_new(tested) of test {j + 1}": sc for j, sc in enumerate(tested)}
    pairs = enumerate(pairwise(tested))
    places |= {f"A_new(between) of test {j + 1}": float(np.sqrt(one * other)) for j, (one, other) in pairs}
    return places | {"A_new(half)": 0.5 * min(tested), "A_new(twice)": 2.0 * max(tested)}


def own_curve(drawn: Drawn, test: int, scruton_number: float, natural: float) -> FloatArray:
    """Stable amplitude at another Scruton number on the Griffin curve of one test, (S,)."""
    factor = drawn.mass_damping_factor[:, test]
    relaxation = factor * drawn.relaxation_rate[:, test] / natural
    x = (scruton_number - factor * drawn.damping_ratio[:, test]) / relaxation
    return np.asarray(drawn.a_star[:, test] * amplitude_ratio(x, drawn.n))


def new_setting(drawn: Drawn, scruton_number: float, z_new: FloatArray) -> FloatArray:
    """Stable amplitude of a new setting on the shared curve, off it by its own discrepancy, (S,)."""
    x = (scruton_number - drawn.reference_scruton_number) / drawn.reference_relaxation
    curve = drawn.reference_amplitude * amplitude_ratio(x, drawn.n)
    return np.asarray(curve * np.exp(drawn.discrepancy_amplitude * z_new))


def kind_of(quantity: str) -> str:
    """Quantity without the test that it belongs to: what cells are pooled by."""
    return quantity.split(" of test ")[0]


def score(truth: float, draws: FloatArray) -> Score:
    """Score one quantity."""
    # Between 0 and 1, never at an end: the truth is one more draw of its own, at the middle of those equal to it.
    rank = float((np.sum(draws < truth) + 0.5 * (np.sum(draws == truth) + 1.0)) / (draws.size + 1.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        log, true = np.log(np.abs(draws)), np.log(abs(truth))
        log = log[np.isfinite(log)]
        mean, sd = (float(log.mean()), float(log.std())) if log.size else (np.nan, np.nan)
        return Score(float(truth), rank, float((true - mean) / sd), sd)


def held(truth: float, draws: FloatArray, scale: float) -> dict[str, Any]:
    """Whether the central intervals hold the truth, and how sharp they are.

    Returns
    -------
    dict
        `inside` by probability; of the 90 % interval (l, u) its `factor` u/l and its `interval_score` over `scale`,
        u - l + 20 (l - truth)+ + 20 (truth - u)+; and `dead`, the share of draws without vibration.
    """
    low, high = np.quantile(draws, [0.05, 0.95], method="inverted_cdf")
    missed = max(low - truth, truth - high, 0.0)
    return {
        "inside": {f"{p:g}": inside(truth, draws, p) for p in INTERVALS},
        "factor": float(high / low) if low > 0.0 else float("inf"),
        "interval_score": float((high - low + 20.0 * missed) / scale),
        "dead": float(np.mean(draws == 0.0)),
    }


def inside(truth: float, draws: FloatArray, probability: float) -> bool:
    """Whether the closed central interval holds the truth; zero amplitudes and infinite ones may be its ends."""
    tail = 0.5 * (1.0 - probability)
    low, high = np.quantile(draws, [tail, 1.0 - tail], method="inverted_cdf")
    return bool(low <= truth <= high)
