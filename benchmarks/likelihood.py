"""What one evaluation of the compiled likelihood costs, and how that grows with the record."""

import time
import timeit

import numpy as np

from benchmarks import problem
from benchmarks.result import Figure
from scruton.dynamics.likelihood import log_likelihood

CYCLES = (120, 1200, 12000)
WALKERS = (1, 16, 64)


def cost(cycles: int, walkers: int) -> float:
    """CPU seconds of one evaluation of one walker, with so many side by side."""
    data = problem.data(cycles)
    lam = problem.RATIO * 2.0 * np.pi * problem.FREQUENCY
    q = problem.SCATTER * problem.A_STAR * np.sqrt(2.0 * lam)
    spread = np.exp(0.01 * np.random.default_rng(0).standard_normal((4, walkers)))
    theta = np.array([problem.A_STAR, lam, q, 1.0])[:, None] * spread
    log_likelihood(data, *theta)  # compiles, or reads what was compiled
    number = max(1, 1_000_000 // (cycles * walkers))
    timer = timeit.Timer(lambda: log_likelihood(data, *theta), timer=time.process_time)
    return min(timer.repeat(9, number)) / number / walkers


def run() -> list[Figure]:
    print(f"  {'walkers':>8} {'cycles':>8} {'µs an evaluation':>18} {'ns a cycle':>12}   (of one walker)")
    figures = []
    for walkers in WALKERS:
        costs = [cost(cycles, walkers) for cycles in CYCLES]
        for cycles, each in zip(CYCLES, costs, strict=True):
            print(f"  {walkers:>8} {cycles:>8} {1e6 * each:>18.3f} {1e9 * each / cycles:>12.2f}")
        growth = float(np.log(costs[-1] / costs[-2]) / np.log(CYCLES[-1] / CYCLES[-2]))
        name = f"{walkers} walkers: exponent of growth from {CYCLES[-2]} to {CYCLES[-1]} cycles (1: linear)"
        figures.append(Figure(name, growth, "", 1.15))
    return figures
