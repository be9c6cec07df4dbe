"""Time per 1,000 effective draws: this package beside nutpie and dynesty, on one posterior, in one run.

CPU seconds of one thread, so that other programs on the machine do not count.  Effective draws are the bulk ESS of
the worst parameter (arviz), over four chains or ensembles; for nested samples, which are independent but weighted,
the effective number of weights, which flatters them.  Compiling is left out everywhere.  "All" holds the search for
the optimum and the warm-up, the verdict on convergence, nutpie's tuning; "draws" only what follows them.

"Asked" is how often the likelihood is, per effective draw: by nutpie with its gradient; by us for many walkers at
once.  With one for every draw, which is what independent draws from the posterior itself would take, we would cost what
`bound` says: no sampler that evaluates our likelihood can beat another by more than that.
"""

import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from benchmarks import peers, problem
from benchmarks.fit import emcee_calls
from benchmarks.result import Figure
from scruton.arrays import FloatArray, end_to_end
from scruton.infer.cards import load_card
from scruton.infer.models import WindPosterior
from scruton.stats.sampler import Ensembles, sample

SEEDS = range(1, 6)
TUNE, DRAWS = 1000, 500  # with 400 one run in five leaves a chain behind


@dataclass(frozen=True)
class Cost:
    """CPU seconds per 1,000 effective draws and likelihoods per draw (medians over seeds), and means to compare."""

    name: str
    everything: float
    draws: float
    effective: float
    likelihoods: float
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
        with emcee_calls() as calls, _warm_up_forgotten(calls):
            samples = sample(posterior, settings, np.random.SeedSequence(seed))
        everything = time.process_time() - start
        asked, drawing = map(sum, zip(*calls, strict=True))
        effective = float(samples.convergence.ess_bulk.min())
        rows.append((everything / effective, drawing / effective, effective, asked / effective))
        chains.append(end_to_end(samples.chain))
    everything, drawing, effective, asked = np.median(rows[1:], axis=0)
    chain = np.concatenate(chains)
    return Cost("scruton", 1e3 * everything, 1e3 * drawing, effective, asked, chain.mean(axis=0), chain.std(axis=0))


@contextmanager
def _warm_up_forgotten(calls: list[tuple[int, float]]) -> Iterator[None]:
    """Keep of the calls of emcee those since the proposals were fitted last, while it lasts."""
    original = Ensembles.adapt

    def adapt(self, **options):  # type: ignore[no-untyped-def]
        calls.clear()
        original(self, **options)

    Ensembles.adapt = adapt  # type: ignore[method-assign]
    try:
        yield
    finally:
        Ensembles.adapt = original  # type: ignore[method-assign]


def seconds_of_a_likelihood(posterior: WindPosterior, cost: Cost, walkers: int = 256, repeats: int = 200) -> float:
    """CPU seconds of one likelihood of our own, asked for so many walkers at once."""
    rng = np.random.default_rng(0)
    points = cost.mean + cost.sd * rng.standard_normal((walkers, cost.mean.size))
    posterior.log_likelihood(points)
    start = time.process_time()
    for _ in range(repeats):
        posterior.log_likelihood(points)
    return (time.process_time() - start) / (repeats * walkers)


def with_nutpie(posterior: WindPosterior, gradient: str) -> Cost:
    run = peers.nutpie_sampler(posterior, gradient)
    run(TUNE, DRAWS, 0)
    rows, chains = [], []
    for seed in SEEDS:
        start = time.process_time()
        run(TUNE, 1, seed)
        middle = time.process_time()
        chain, asked = run(TUNE, DRAWS, seed)
        everything, tuning = time.process_time() - middle, middle - start
        effective = effective_draws(chain)
        rows.append((everything / effective, (everything - tuning) / effective, effective, asked / effective))
        chains.append(end_to_end(chain))
    everything, drawing, effective, likelihoods = np.median(rows, axis=0)
    chain = np.concatenate(chains)
    name = f"nutpie, gradient {gradient}"
    return Cost(name, 1e3 * everything, 1e3 * drawing, effective, likelihoods, chain.mean(axis=0), chain.std(axis=0))


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
        "dynesty",
        1e3 * cost,
        1e3 * cost,
        effective,
        float("nan"),
        np.mean(means, axis=0),
        np.sqrt(np.mean(variances, axis=0)),
    )


def run() -> list[Figure]:
    warnings.filterwarnings("ignore", message="Found chain dimension to be longer")
    posterior = problem.posterior()
    mine = ours(posterior)
    others = [with_nutpie(posterior, "by hand"), with_nutpie(posterior, "by PyTensor"), with_dynesty(posterior)]
    print(f"  {'CPU seconds per 1,000 effective draws':<38} {'all':>9} {'draws':>9} {'ESS of a run':>14} {'asked':>9}")
    for one in (mine, *others):
        print(
            f"  {one.name:<38} {one.everything:>9.4f} {one.draws:>9.4f} {one.effective:>14.0f} {one.likelihoods:>9.1f}"
        )
        away = np.abs(one.mean - mine.mean) / mine.sd
        assert away.max() < 0.2, f"{one.name} samples another posterior: means {one.mean}, ours {mine.mean}"
    figures = []
    for one in others:
        figures.append(Figure(f"{one.name}: its cost over ours, all", one.everything / mine.everything, "times"))
        figures.append(Figure(f"{one.name}: its cost over ours, draws", one.draws / mine.draws, "times"))
    best = min(one.draws for one in others)
    bound = best / (1e3 * seconds_of_a_likelihood(posterior, mine))
    return [
        *figures,
        Figure("the best of them over ours, draws", best / mine.draws, "times", 10.0, at_least=True),
        Figure("bound: the same if one likelihood gave one effective draw", bound, "times"),
    ]
