"""How long a user waits for `import scruton` and for `scruton --help`."""

import subprocess
import sys
import time
from statistics import median

from benchmarks.result import Figure

REPEATS = 11


def seconds(*arguments: str) -> float:
    """Median time of a command by the clock on the wall; the first run, which reads from disk, is left out."""
    times = []
    for _ in range(REPEATS + 1):
        start = time.perf_counter()
        subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)
        times.append(time.perf_counter() - start)
    return median(times[1:])


def run() -> list[Figure]:
    bare = seconds("-c", "pass")
    return [
        Figure("Python itself", bare, "s"),
        Figure("import scruton, beyond that", seconds("-c", "import scruton") - bare, "s", 0.3),
        Figure("scruton --help, all of it", seconds("-m", "scruton", "--help"), "s", 0.5),
    ]
