"""What large input costs: one record of 20 million samples, 40 rigs with 100 records, 300 small campaigns.

`python -m benchmarks.large [record] [rigs] [batch]` runs the commands as a user would, each at a part of its size and
at the whole, and prints wall time, processor time, peak memory and the exponent of growth of the processor time.
`growth`, run where it is named, doubles one size at a time from a small campaign: records, cycles, rigs, speeds.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HEAD = """format = 1
title = "large"
source = "made for the benchmark"
[section]
motion = "heaving"
width = "0.3 m"
depth = "0.075 m"
"""
RIG = """
[[rigs]]
name = "rig {i}"
mass = "7.292 kg/m"
frequency = "7.87 Hz"
damping_ratio = {{ mean = {xi:.6f}, sd = {sd:.6f} }}
{still}{tests}"""
TEST = """
[[tests]]
name = "test {i} at {wind_speed:.3f} m/s"
rig = "rig {i}"
air_density = "1.22 kg/m^3"
wind_speed = "{wind_speed:.3f} m/s"
{wind}"""
RECORD = '[[{owner}.records]]\nfile = "{file}"\nkind = "{kind}"\n'
OMEGA, PEAK, RATE_AT_ZERO = 2 * np.pi * 7.87, 0.0292, 0.65  # of the shipped example at Sc 21.7


@dataclass(frozen=True)
class Cost:
    """What a command took: wall and processor time [s], peak memory of its largest process [MB]."""

    wall: float
    processor: float
    memory: float
    code: int


def run(*arguments: object) -> Cost:
    """Run a command of scruton, and measure it and all its processes."""
    started = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", "scruton", *map(str, arguments)], stdout=subprocess.DEVNULL, start_new_session=True
    )
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    scale = 1e3 if sys.platform != "darwin" else 1e6
    return Cost(
        time.perf_counter() - started, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / scale, process.returncode
    )


def transient(rng, start: float, end: float, rate: float, seconds: float, samples: int):
    """Time [s] and displacement [mm]: an exponential approach, scatter that relaxes as fast, white sensor noise."""
    from scipy.signal import lfilter

    time_ = np.arange(samples) * (seconds / samples)
    keep = np.exp(-rate * seconds / samples)
    scatter = lfilter([1.0], [1.0, -keep], 0.005 * np.sqrt(1.0 - keep**2) * rng.standard_normal(samples))
    amplitude = 75.0 * (end + (start - end) * np.exp(-rate * time_) + end * scatter)
    return time_, amplitude * np.cos(OMEGA * time_) + 0.01 * rng.standard_normal(samples)


def write(path: Path, time_: np.ndarray, y: np.ndarray) -> None:
    import pandas as pd

    frame = pd.DataFrame({"time [s]": time_, "displacement [mm]": y})
    frame.to_csv(path, index=False, float_format="%.10g")


def campaign(
    folder: Path, rigs: int, records: int, seed: int, *, samples: int = 900, seconds: float = 9.0, speeds: int = 1
) -> Path:  # fmt: skip
    """Rigs of different damping on one curve; records go round the tests: growth, decay, growth, ...

    Each rig has its records at every one of the wind speeds, at the last of which it moves most.
    """
    folder.mkdir(parents=True)
    rng = np.random.default_rng(seed)
    text = HEAD
    counts = [records // rigs + (i < records % rigs) for i in range(rigs)]
    for i, count in enumerate(counts):
        xi = 0.0065 * (0.6 + 0.8 * i / max(rigs - 1, 1))
        rate = OMEGA * xi * 2.0
        end = PEAK * 0.0065 / xi
        tests = ""
        for s in range(speeds):
            level, wind = end * (s + 1) / speeds, ""
            for k in range(count):
                kind = ("growth", "decay")[k % 2]
                start = level * (0.1 if kind == "growth" else 2.5)
                file = f"r{i}_{s}_{k}.csv"
                write(folder / file, *transient(rng, start, level, rate, seconds, samples))
                wind += RECORD.format(owner="tests", file=file, kind=kind)
            tests += TEST.format(i=i, wind_speed=5.036 - 0.1 * (speeds - 1 - s), wind=wind)
        text += RIG.format(i=i, xi=xi, sd=0.05 * xi, still="", tests=tests)
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    return folder


def record(room: Path) -> dict[str, dict[int, Cost]]:
    """`check` and `fit` of one record of 2 and of 20 million samples of 1,000 s."""
    found: dict[str, dict[int, Cost]] = {"check": {}, "fit": {}}
    for samples in (2_000_000, 20_000_000):
        made = campaign(room / f"record-{samples}", 1, 1, 1, samples=samples, seconds=1000.0)
        found["check"][samples] = run("check", made)
        found["fit"][samples] = run("fit", made, "-o", room / f"out-{samples}", "--quiet")
    return found


def rigs(room: Path) -> dict[str, dict[int, Cost]]:
    """`check`, `fit` and `diagnose` of 10, 20 and 40 rigs with two and a half records each."""
    found: dict[str, dict[int, Cost]] = {"check": {}, "fit": {}}
    for count in (25, 50, 100):
        made = campaign(room / f"rigs-{count}", count * 2 // 5, count, 2)
        found["check"][count] = run("check", made)
        found["fit"][count] = run("fit", made, "-o", room / f"out-rigs-{count}", "--quiet")
    return found


def batch(room: Path) -> dict[str, dict[int, Cost]]:
    """`batch` of 30 and of 300 campaigns of one rig and two records, in two processes, with a quick card."""
    card = room / "quick.toml"
    card.write_text('extends = "paper"\nname = "quick"\n[sampler]\nwalkers = 64\ndraws = 16\nmin_ess = 100\n')
    made = [campaign(room / "batch" / f"c{i:03d}", 1, 2, i) for i in range(300)]
    found: dict[int, Cost] = {}
    for count in (30, 300):
        out = room / f"out-batch-{count}"
        found[count] = run("batch", *made[:count], "-o", out, "--model", card, "--jobs", 2, "--quiet")
    return {"batch": found}


def growth(room: Path) -> dict[str, dict[int, Cost]]:
    """`fit` of a campaign with one size doubled at a time, from one rig with two records of 71 cycles."""
    sizes = {
        "records": {count: {"records": count} for count in (2, 4, 8)},
        "cycles": {71 * k: {"seconds": 9.0 * k, "samples": 900 * k} for k in (1, 2, 4)},
        "rigs": {count: {"rigs": count, "records": 2 * count} for count in (1, 2, 4)},
        "speeds": {count: {"speeds": count} for count in (1, 2, 4)},
    }
    smallest = {"rigs": 1, "records": 2}
    done: dict[str, Cost] = {}
    found: dict[str, dict[int, Cost]] = {}
    for name, steps in sizes.items():
        for size, asked in steps.items():
            options = smallest | asked
            key = "first" if size == min(steps) else f"{name}-{size}"
            if key not in done:
                made = campaign(room / key, options.pop("rigs"), options.pop("records"), 2, **options)
                done[key] = run("fit", made, "-o", room / f"out-{key}", "--quiet")
                print(f"# {name} {size}: {done[key]}", file=sys.stderr, flush=True)
            found.setdefault(name, {})[size] = done[key]
    return found


CASES: dict[str, Callable[[Path], dict[str, dict[int, Cost]]]] = {
    "record": record,
    "rigs": rigs,
    "batch": batch,
    "growth": growth,
}
USUAL = ("record", "rigs", "batch")


def main(names: Sequence[str]) -> int:
    """Run the cases that are named, all but for growth by default."""
    print(f"{'command':10} {'size':>10} {'wall [s]':>9} {'CPU [s]':>9} {'peak [MB]':>9} {'growth':>7} exit")
    worst = 0
    for name in names or USUAL:
        room = Path(tempfile.mkdtemp(prefix="scruton-large-"))
        try:
            for command, costs in CASES[name](room).items():
                before: tuple[int, Cost] | None = None
                for size, cost in costs.items():
                    growth = ""
                    if before is not None:
                        ratio = np.log(cost.processor / before[1].processor) / np.log(size / before[0])
                        growth = f"{ratio:.2f}"
                    print(f"{command:10} {size:10} {cost.wall:9.1f} {cost.processor:9.1f} {cost.memory:9.0f} "
                          f"{growth:>7} {cost.code}", flush=True)  # fmt: skip
                    before, worst = (size, cost), max(worst, cost.code)
        finally:
            shutil.rmtree(room)
    return int(worst > 1)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
