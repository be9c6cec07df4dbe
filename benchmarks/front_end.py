"""The front end on a record of 1,000,000 samples: time, and peak memory beside the record's own.

It runs in a process of its own, so that the peak is the front end's and nobody else's.
"""

import contextlib
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from benchmarks import problem
from benchmarks.result import Figure
from scruton.arrays import FloatArray
from scruton.campaign.schema import Kind, Record

SAMPLES = 1_000_000
RATE = 1000.0  # Hz


def record(samples: int) -> tuple[FloatArray, FloatArray]:
    """Build a decay to resonance with sensor noise, in place so that building it leaves no peak of its own."""
    time = np.arange(samples) / RATE
    lam = problem.RATIO * 2.0 * np.pi * problem.FREQUENCY
    rng = np.random.default_rng(5)
    response = np.empty(samples)
    for part in np.array_split(np.arange(samples), max(1, samples // 50_000)):
        t = time[part]
        amplitude = problem.A_STAR + (problem.FIRST_AMPLITUDE - problem.A_STAR) * np.exp(-lam * t)
        response[part] = amplitude * np.cos(2.0 * np.pi * problem.FREQUENCY * t) + problem.NOISE * rng.standard_normal(
            len(t)
        )
    return time, response


def peak_memory() -> int:
    """Largest memory of this process so far [bytes]; Linux forgets the past where `forget_peak` was called."""
    status = Path("/proc/self/status")
    if status.is_file():
        line = next(one for one in status.read_text().splitlines() if one.startswith("VmHWM"))
        return 1024 * int(line.split()[1])
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def forget_peak() -> None:
    """Let the peak start from what is in use now, where the system can do that."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def measure() -> None:
    """Print seconds and peak bytes of demodulation and of Eqs. (2) to (8), after a short record has warmed both up."""
    from scruton.envelope import demodulate, front_end

    def paper(t: FloatArray, y: FloatArray) -> object:
        return front_end(
            Record("r", Path("r"), Kind.DECAY, t, y), frequency=problem.FREQUENCY,
            still_air_frequency=problem.FREQUENCY, damping_ratio=problem.DAMPING, mass_damping_factor=3338.0,
        )  # fmt: skip

    def both(t: FloatArray, y: FloatArray) -> object:
        return demodulate(t, y), paper(t, y)

    short = record(20_000)
    both(*short)
    t, y = record(SAMPLES)
    for do in (demodulate, paper, both):
        best, peak = np.inf, 0
        for _ in range(3):
            forget_peak()
            before = peak_memory()
            start = time.perf_counter()
            do(t, y)
            best = min(best, time.perf_counter() - start)
            peak = max(peak, peak_memory() - before)
        print(best, peak, t.nbytes + y.nbytes)


def run() -> list[Figure]:
    printed = subprocess.run(
        [sys.executable, "-m", "benchmarks.front_end"], check=True, capture_output=True, text=True
    ).stdout
    rows = [[float(one) for one in line.split()] for line in printed.splitlines()]
    figures = []
    names = ("demodulation by cycles", "Eqs. (2) to (8)", "both")
    for name, (seconds, extra, own) in zip(names, rows, strict=True):
        last = name == "both"
        figures.append(Figure(f"{name}: time", seconds, "s", 1.0 if last else None))
        figures.append(
            Figure(
                f"{name}: peak memory with the record, over the record's",
                1 + extra / own,
                "times",
                5.0 if last else None,
            )
        )
    return figures


if __name__ == "__main__":
    measure()
