"""What do new settings of bodies outside the family of laws ask of a prediction?

`python -m benchmarks.new_settings SEED REGIME:FIRST-LAST ...` draws, simulates and fits campaigns of `scruton
calibrate` outside the family (or off its curve), and scores the true stable amplitude of new settings: at, between, at
half and at twice the tested Scruton numbers.  One line a setting, then by place

* how fast the curve may leave its law: sums of the log score of the laws alone for a range of values of WALK
  (`scruton.griffin.thresholds`), less that of the value in use; the largest is the one that the truths ask for;
* by the laws alone, by the measured damping alone (`scruton.griffin.law_free`) and by both, each weighed by its
  precision, which is what predicts: root mean square error of the logarithm of the median, how many 90 %
  intervals hold the truth, and their interval score over the truth (geometric mean).
"""

import sys
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import logsumexp

from scruton.arrays import FloatArray
from scruton.calibrate.bodies import draw_campaign
from scruton.calibrate.campaigns import campaign_seeds, simulate_campaign
from scruton.calibrate.quantities import kind_of, new_settings
from scruton.calibrate.regimes import REGIMES
from scruton.griffin import predict
from scruton.griffin.curves import SharedCurve, shared_curve
from scruton.griffin.law_free import law_free
from scruton.griffin.thresholds import WALK
from scruton.infer.cards import ModelCard, load_card
from scruton.infer.fit import fit_campaign

if TYPE_CHECKING:
    import xarray as xr

# ln(median/truth), whether the truth is held, and the interval score, by the laws, the measured damping, and both
Errors = list[tuple[float, bool, float]] | None
WALKS = (0.0, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)


def log_score(curve: SharedCurve, scruton_number: float, truth: float) -> FloatArray:
    """Log predictive density of the logarithm of a true amplitude, by WALK, (len(WALKS),)."""
    sc = np.full((curve.n.size, 1), scruton_number)
    on_curve = curve.at(sc)
    vibrates = np.isfinite(on_curve[:, 0]) & (on_curve[:, 0] > 0.0)
    off, tau = np.log(truth / on_curve[vibrates, 0]), curve.discrepancy[vibrates]
    grown = replace(curve, measured=None).setting(sc, on_curve).spread[vibrates, 0] / tau
    sd = tau * np.sqrt(1.0 + np.array(WALKS)[:, None] * (grown**2 - 1.0) / WALK)
    density = -0.5 * (off / sd) ** 2 - np.log(sd * np.sqrt(2.0 * np.pi))
    return np.asarray(logsumexp(density, axis=1) - np.log(curve.n.size))


def by_measured_damping(tree: "xr.DataTree", scruton_number: float) -> FloatArray:
    """Draws of the amplitude at which the measured damping asks for this Scruton number; NaN where none does."""
    measured = law_free(tree)
    if measured is None:
        return np.full(1, np.nan)
    sample = np.arange(len(measured.scruton_number))
    levels = np.geomspace(*measured.reach, 80)
    numbers = np.array([measured.scruton_number_of(np.full(sample.size, level), sample) for level in levels])
    draws = np.full(sample.size, np.nan)
    for k, column in enumerate(numbers.T):
        crossed = np.flatnonzero((column[:-1] >= scruton_number) & (column[1:] < scruton_number))
        if crossed.size:  # the largest stable amplitude
            i = crossed[-1]
            part = (column[i] - scruton_number) / (column[i] - column[i + 1])
            draws[k] = levels[i] * (levels[i + 1] / levels[i]) ** part
    return draws


def error_of(draws: FloatArray, truth: float) -> tuple[float, bool, float]:
    """ln(median/truth), whether the 90 % interval holds the truth, and its interval score over the truth."""
    low, median, high = np.quantile(draws, [0.05, 0.5, 0.95], method="inverted_cdf")
    missed = max(low - truth, 0.0) + max(truth - high, 0.0)
    return float(np.log(median / truth)), bool(low <= truth <= high), float((high - low + 20.0 * missed) / truth)


def campaign_scores(name: str, index: int, seed: int, card: ModelCard) -> Iterator[tuple[str, FloatArray, Errors]]:
    """Of every new setting of one campaign its name, log scores, and errors; a dead truth has none."""
    regime = REGIMES[name]
    draw, simulate, chains, fresh, beside = campaign_seeds(name, index, seed)
    drawn, setup, body = draw_campaign(regime, regime.card(card), draw, beside)
    campaign = simulate_campaign(regime, drawn, setup, simulate, body.rigs)
    fit = fit_campaign(campaign, card, seed=int(chains.spawn(1)[0].generate_state(1)[0]), thorough=False)
    off = float(np.exp((regime.miss or 0.0) * np.random.default_rng(fresh).standard_normal()))
    curve = shared_curve(fit.tree)
    for place, sc in new_settings(regime).items():
        truth = body.curve(sc) * off
        if truth > 0.0:
            both, measured = predict(fit.tree, scruton_number=sc).draws, by_measured_damping(fit.tree, sc)
            z = np.random.default_rng(0).standard_normal(curve.n.size)
            laws = replace(curve, measured=None).predictive(np.array([sc]), z)[:, 0]
            errors = None
            if np.isfinite(measured).mean() > 0.5 and np.median(laws) > 0.0:
                errors = [error_of(one, truth) for one in (laws, measured[np.isfinite(measured)], both)]
            yield place, log_score(curve, sc, truth), errors


def main(seed: int, specs: list[str]) -> None:
    """Print every setting, and the sums by place."""
    sums: dict[str, FloatArray] = {}
    errors: dict[str, list[Errors]] = {}
    now = WALKS.index(WALK)
    for spec in specs:
        name, numbers = spec.split(":")
        for index in range(*map(int, numbers.split("-"))):
            for place, scores, error in campaign_scores(name, index, seed, load_card()):
                print(f"{name} {index} {place}: {np.round(scores - scores[now], 2).tolist()} {error}", flush=True)
                sums[kind_of(place)] = sums.get(kind_of(place), np.zeros(len(WALKS))) + scores - scores[now]
                errors.setdefault(kind_of(place), []).extend([error] if error else [])
    for place, total in {**sums, "all": np.sum(list(sums.values()), axis=0)}.items():
        print(f"{place}: log score by WALK {dict(zip(WALKS, np.round(total, 2).tolist(), strict=True))}")
    for place, rows in errors.items():
        table = np.array(rows, dtype=float)  # (settings, 3, 3)
        rms = np.sqrt(np.mean(table[:, :, 0] ** 2, axis=0)).round(3)
        score = np.exp(np.mean(np.log(table[:, :, 2]), axis=0)).round(3)
        held = table[:, :, 1].sum(axis=0).astype(int)
        print(f"{place}: {len(rows)}, laws, measured damping, both: error {rms}, held {held}, interval score {score}")


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2:])
