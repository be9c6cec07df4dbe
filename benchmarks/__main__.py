"""Run the benchmarks named on the command line, or all; exit 1 if a limit is missed."""

import os
import platform
import sys
from importlib import import_module
from importlib.metadata import version

TITLES = {
    "startup": "Start",
    "commands": "Whole commands on the shipped example, processor seconds",
    "fit": "One test of 120 cycles: envelope to converged posterior, compiled beforehand",
    "campaign": "Three rigs, 18 records, about 2,000 cycles: the hierarchical posterior, laws weighed",
    "samplers": "Other samplers on the same posterior",
    "likelihood": "The compiled likelihood, exact for n = -1",
    "effects": "The filter with effects",
    "sizing": "A damper for one mode",
    "front_end": "Front end on 1,000,000 samples",
}


def main(names: list[str]) -> int:
    unknown = set(names) - set(TITLES)
    if unknown:
        print(f"no such benchmark: {', '.join(sorted(unknown))}; one of {', '.join(TITLES)}", file=sys.stderr)
        return 2
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    packages = " ".join(f"{name} {version(name)}" for name in ("scruton", "numpy", "numba", "emcee"))
    print(f"Python {platform.python_version()}, {packages}; load of the machine {load:.1f} (a quiet one measures best)")
    missed = []
    for name in names or TITLES:
        print(f"\n{TITLES[name]}", flush=True)
        for figure in import_module(f"benchmarks.{name}").run():
            print(figure, flush=True)
            if not figure.met:
                missed.append(figure)
    print(f"\n{len(missed)} limits missed" if missed else "\nall limits met")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
