"""Time per 1,000 effective draws: this package beside nutpie and dynesty, on one posterior, in one run.

CPU seconds of one thread, so that other programs on the machine do not count.  Effective draws are the bulk ESS of
the worst parameter (arviz), over four chains or ensembles; for nested samples, which are independent but weighted,
the effective number of weights, which flatters them.  Compiling is left out everywhere.  "All" holds the search for
the optimum and the warm-up, the verdict on convergence, nutpie's tuning; "draws" only what follows them.
"""

import time
import warnings
from dataclasses import dataclass

import numpy as np

from benchmarks import peers, problem
from benchmarks.fit import emcee_calls
from benchmarks.result import Figure
from scruton.arrays import FloatArray, end_to_end
from scruton.infer.cards import load_card
from scruton.infer.models import WindPosterior
from scruton.stats.sampler import sample

SEEDS = range(1, 6)
TUNE, DRAWS = 1000, 500  # with 400 one run in five leaves a chain behind


@dataclass(frozen=True)
class Cost:
    """CPU seconds per 1,000 effective draws (medians over seeds), and the posterior means to compare."""

    name: str
    everything: float
    draws: float
    effective: float
    mean: FloatArray
    sd: FloatArray


def effective_draws(chain: FloatArray) -> float:
    """Bulk ESS of the worst parameter of (chains, draws, d)."""
    from arviz_stats.base import array_stats

    return float(np.min(array_stats.ess(chain, method="bulk", chain_axis=0, draw_axis=1)))


def ours(posterior: WindPosterior) -> Cost:
    settings, rows, chains = load_card().sampler, [], []
    for seed in (0, *SEEDS):
        start = time.process_time()
        total = [0]
        with emcee_calls() as calls:
            samples = sample(
                posterior, settings, np.random.SeedSequence(seed),
                progress=lambda steps, _, total=total: total.__setitem__(0, steps),
            )  # fmt: skip
        everything = time.process_time() - start
        drawing, steps = 0.0, total[0] * settings.ensembles
        for count, seconds in reversed(calls):  # the calls before these are the warm-up
            if steps <= 0:
                break
            drawing, steps = drawing + seconds, steps - count
        effective = float(samples.convergence.ess_bulk.min())
        rows.append((everything / effective, drawing / effective, effective))
        chains.append(end_to_end(samples.chain))
    everything, drawing, effective = np.median(rows[1:], axis=0)
    chain = np.concatenate(chains)
    return Cost("scruton", 1e3 * everything, 1e3 * drawing, effective, chain.mean(axis=0), chain.std(axis=0))


def with_nutpie(posterior: WindPosterior, gradient: str) -> Cost:
    run = peers.nutpie_sampler(posterior, gradient)
    run(TUNE, DRAWS, 0)
    rows, chains = [], []
    for seed in SEEDS:
        start = time.process_time()
        run(TUNE, 1, seed)
        middle = time.process_time()
        chain = run(TUNE, DRAWS, seed)
        everything, tuning = time.process_time() - middle, middle - start
        effective = effective_draws(chain)
        rows.append((everything / effective, (everything - tuning) / effective, effective))
        chains.append(end_to_end(chain))
    everything, drawing, effective = np.median(rows, axis=0)
    chain = np.concatenate(chains)
    name = f"nutpie, gradient {gradient}"
    return Cost(name, 1e3 * everything, 1e3 * drawing, effective, chain.mean(axis=0), chain.std(axis=0))


def with_dynesty(posterior: WindPosterior) -> Cost:
    run = peers.dynesty_sampler(posterior)
    rows, means, variances = [], [], []
    for seed in list(SEEDS)[:3]:
        start = time.process_time()
        points, weights = run(seed)
        seconds = time.process_time() - start
        weights = weights / weights.sum()
        effective = 1.0 / float(np.square(weights).sum())
        rows.append((seconds / effective, effective))
        means.append(weights @ points)
        variances.append(weights @ np.square(points - means[-1]))
    cost, effective = np.median(rows, axis=0)
    return Cost(
        "dynesty", 1e3 * cost, 1e3 * cost, effective, np.mean(means, axis=0), np.sqrt(np.mean(variances, axis=0))
    )


def run() -> list[Figure]:
    warnings.filterwarnings("ignore", message="Found chain dimension to be longer")
    posterior = problem.posterior()
    mine = ours(posterior)
    others = [with_nutpie(posterior, "by hand"), with_nutpie(posterior, "by PyTensor"), with_dynesty(posterior)]
    print(f"  {'CPU seconds per 1,000 effective draws':<38} {'all':>9} {'draws':>9} {'ESS of a run':>14}")
    for one in (mine, *others):
        print(f"  {one.name:<38} {one.everything:>9.4f} {one.draws:>9.4f} {one.effective:>14.0f}")
        away = np.abs(one.mean - mine.mean) / mine.sd
        assert away.max() < 0.2, f"{one.name} samples another posterior: means {one.mean}, ours {mine.mean}"
    figures = []
    for one in others:
        figures.append(Figure(f"{one.name}: its cost over ours, all", one.everything / mine.everything, "times"))
        figures.append(Figure(f"{one.name}: its cost over ours, draws", one.draws / mine.draws, "times"))
    best = min(one.draws for one in others) / mine.draws
    return [*figures, Figure("the best of them over ours, draws", best, "times", 10.0, at_least=True)]
