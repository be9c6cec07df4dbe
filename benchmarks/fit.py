"""One test of 120 cycles, from its envelope to a converged posterior in a DataTree."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import emcee
import numpy as np

from benchmarks import problem
from benchmarks.result import Figure
from scruton.envelope import record_cycles
from scruton.infer.cards import load_card
from scruton.infer.fit import assemble, fit_campaign, fit_rig, fit_test
from scruton.infer.models import WindPosterior
from scruton.infer.results import Sampled
from scruton.infer.sampling import Sampling

REPEATS = 9


@contextmanager
def emcee_calls() -> Iterator[list[tuple[int, float]]]:
    """List the likelihoods and the CPU seconds of every call of emcee while it lasts."""
    calls: list[tuple[int, float]] = []
    original, likelihood = emcee.EnsembleSampler.run_mcmc, WindPosterior.log_likelihood
    asked = 0

    def counted(self, u):  # type: ignore[no-untyped-def]
        nonlocal asked
        asked += len(u)
        return likelihood(self, u)

    def timed(self, state, steps, **options):  # type: ignore[no-untyped-def]
        start, before = time.process_time(), asked
        last = original(self, state, steps, **options)
        calls.append((asked - before, time.process_time() - start))
        return last

    emcee.EnsembleSampler.run_mcmc, WindPosterior.log_likelihood = timed, counted  # type: ignore[method-assign]
    try:
        yield calls
    finally:
        emcee.EnsembleSampler.run_mcmc, WindPosterior.log_likelihood = original, likelihood  # type: ignore[method-assign]


def run() -> list[Figure]:
    campaign, card = problem.campaign(), load_card()
    record = campaign.tests[0].records[0]
    rows = []
    for seed in range(REPEATS + 1):
        sampling = Sampling(card, seed)
        wall, start = time.perf_counter(), time.process_time()
        with emcee_calls() as calls:
            cycles = {record.name: record_cycles(record, problem.FREQUENCY)}
            rig = fit_rig(campaign, campaign.rigs[0], cycles, None, sampling)
            test = fit_test(campaign, campaign.tests[0], rig, cycles, sampling)
        assemble(Sampled(campaign, card, cycles, {}, (rig,), (test,), None, ()), sampling, {})
        verdict = test.samples.convergence
        assert verdict.converged, verdict.explain(test.samples.names, card.sampler)
        rows.append(
            (
                sum(seconds for _, seconds in calls), time.process_time() - start, time.perf_counter() - wall,
                verdict.rhat_nested.max(), verdict.ess_bulk.min(), verdict.ess_tail.min(),
            )
        )  # fmt: skip
    sampling_cpu, whole_cpu, whole_wall, rhat, bulk, tail = np.median(rows[1:], axis=0)  # the first one compiles
    start = time.perf_counter()
    fit_campaign(campaign, card, seed=1)
    every = time.perf_counter() - start
    return [
        Figure("sampling (emcee, warm-up included), CPU", sampling_cpu, "s", 0.1),
        Figure("optimum, sampling, verdict, DataTree, CPU", whole_cpu, "s", 1.0),
        Figure("the same by the clock on the wall", whole_wall, "s"),
        Figure("nested R-hat, the worst parameter", rhat, "", card.sampler.max_rhat),
        Figure("bulk ESS, the worst parameter", bulk, "", card.sampler.min_ess, at_least=True),
        Figure("tail ESS, the worst parameter", tail, "", card.sampler.min_ess, at_least=True),
        Figure("fit_campaign: with the posterior of a, b, c, d and the front end", every, "s"),
    ]
