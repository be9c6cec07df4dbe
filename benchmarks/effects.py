"""What a cycle costs in the filter with effects, which a diagnosis climbs, by the terms that act."""

import time
import timeit

import numpy as np

from benchmarks import problem
from benchmarks.result import Figure
from scruton.dynamics.cycles import Channels
from scruton.dynamics.effects.terms import COLUMNS, HATS, Term
from scruton.dynamics.extended import channel_innovations

CYCLES, WALKERS = 1200, (1, 5, 64)
_A, _LAM = problem.A_STAR, problem.RATIO * 2.0 * np.pi * problem.FREQUENCY
_SCATTER = problem.SCATTER * _A * np.sqrt(2.0 * _LAM)
_LAW: dict[int, float] = {
    Term.AERO: _LAM, Term.DRIVE: _LAM * _A, Term.SCATTER: _SCATTER, Term.PHASE_SCATTER: _SCATTER, Term.NOISE: 1.0,
    Term.THIRD_NOISE: 1.0,
}  # fmt: skip
_GUSTS: dict[int, float] = {Term.GUST: 0.02 * _LAM * _A, Term.GUST_RATE: 0.2 * _LAM, Term.SET_POINT: 0.02 * _LAM * _A}
_FRICTION: dict[int, float] = {Term.FRICTION: 0.1 * _LAM * _A, Term.FRICTION_WIDTH: 0.05 * _A}
_RISE: dict[int, float] = {Term.STRUCTURAL_RISE: 0.2 * _LAM, Term.STRUCTURAL_KNEE: 0.6 * _A}
TERMS: dict[str, dict[int, float]] = {
    "the law alone": {},
    "gusts and set-points beside": _GUSTS,
    "shedding beside the response": {Term.FORCE_COS: 0.1 * _LAM * _A, Term.FORCE_RATE: 45.0},
    "a sensor that clips: hard": {Term.CLIP: 0.8 * _A},
    "the same, softly": {Term.CLIP: 0.8 * _A, Term.CLIP_SOFT: 1.0},
    "friction: sudden": _FRICTION,
    "that builds up": _FRICTION | {Term.FRICTION_SPRING: 1e-3},
    "damping that levels off: as the amplitude": _RISE | {Term.STRUCTURAL_POWER: 1.0},
    "as any power": _RISE | {Term.STRUCTURAL_POWER: 0.7},
    "coherence lost: as an exponential": {Term.COHERENCE: 0.5 * _A},
    "as a root": {Term.COHERENCE: 0.5 * _A, Term.COHERENCE_POWER: 2.0},
    "eight hats": {int(Term.HAT) + i: 0.02 * _LAM * (i + 1) for i in range(HATS)},
    "a wake that remembers": {Term.LAG: 0.3 / _LAM, Term.LAG_START: 1.0},
}


def channels(cycles: int) -> Channels:
    """The envelope of the problem, with a phase and a third harmonic that say nothing."""
    data, nothing = problem.data(cycles), np.zeros(cycles)
    return Channels(
        amplitude=np.abs(data.amplitude), standard_error=data.standard_error, gap=data.gap, period=data.period,
        time=data.time, place=data.time / data.time[-1] - 0.5, record=np.zeros(cycles, dtype=np.intp),
        phase=nothing, omega=2.0 * np.pi / data.period, has_phase=np.ones(cycles, dtype=bool), third=nothing,
        third_error=data.standard_error, knots=np.log(_A) + np.linspace(-2.0, 1.0, HATS),
    )  # fmt: skip


def cost(terms: dict[int, float], walkers: int, cycles: int = CYCLES) -> float:
    """CPU seconds a cycle and walker, with so many side by side that differ in the law."""
    table = np.zeros((walkers, 1, COLUMNS))
    for term, value in (_LAW | terms).items():
        table[:, 0, term] = value
    table[:, 0, Term.AERO] *= 1.0 + 1e-3 * np.arange(walkers)
    data = channels(cycles)
    channel_innovations(data, table)  # compiles, or reads what was compiled
    timer = timeit.Timer(lambda: channel_innovations(data, table), timer=time.process_time)
    return min(timer.repeat(15, 1)) / cycles / walkers


def run() -> list[Figure]:
    print(f"  {'ns a cycle and walker, of so many side by side':<46}" + "".join(f"{n:>8}" for n in WALKERS))
    for name, terms in TERMS.items():
        print(f"  {name:<46}" + "".join(f"{1e9 * cost(terms, walkers):>8.0f}" for walkers in WALKERS), flush=True)
    return []
