"""python -m tests.goldens write|compare [--only NAME ...] [--jobs N]: freeze the behaviour, or look for changes."""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

from tests.goldens.leaves import arithmetic, differences, form, load, store
from tests.goldens.parts import PARTS, arithmetic_of_goldens, compute, golden

SHOWN = 40  # differing leaves of a part
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def chosen(patterns: list[str]) -> list[str]:
    """Names of parts; patterns of the shell are understood ("fit-*")."""
    found = [name for name in PARTS if not patterns or any(fnmatch(name, one) for one in patterns)]
    strange = [one for one in patterns if not any(fnmatch(name, one) for name in PARTS)]
    if strange:
        raise SystemExit(f"no part is called {', '.join(strange)}; there are: {', '.join(PARTS)}")
    return found


def recompute(name: str, folder: Path) -> tuple[str, Any, str]:
    """Compute a part in a process of its own, so that none can disturb another."""
    out = folder / f"{name}.json"
    command = [sys.executable, "-m", "tests.goldens", "one", "--only", name, "--out", str(out)]
    ran = subprocess.run(command, capture_output=True, text=True, env=os.environ | ONE_THREAD, check=False)
    if ran.returncode:
        return name, None, ran.stderr
    return name, load(out), ran.stdout.strip()


def one(name: str, out: Path) -> int:
    """Compute a part, write it, and print what it cost."""
    store(out, compute(name))
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    print(f"{sum(x.ru_utime + x.ru_stime for x in used):.0f} s CPU")
    return 0


def write(name: str, found: Any, said: str) -> int:
    """Make what was found the golden."""
    store(golden(name), found)
    print(f"{name}: {golden(name).stat().st_size / 1024:.0f} kB, {said}", flush=True)
    return 0


def as_written() -> bool:
    """Whether the arithmetic is that of the goldens, to the last digit."""
    return arithmetic() == arithmetic_of_goldens().read_text(encoding="utf-8").strip()


def compare(name: str, found: Any, said: str) -> int:
    """List what differs from the golden; return how much does."""
    if not golden(name).exists():
        print(f"{name}: no golden; `write --only {name}` makes it", flush=True)
        return 1
    part, wanted, by = PARTS[name], load(golden(name)), ""
    if part.drawn and not as_written():
        wanted, found, by = form(wanted), form(found), " in form (the goldens are of another arithmetic)"
    apart = differences(wanted, found, part.rtol, part.atol)
    print(f"{name}: {f'{len(apart)} leaves differ' if apart else 'the same'}{by}, {said}", flush=True)
    for line in apart[:SHOWN]:
        print(f"  {line}")
    if len(apart) > SHOWN:
        print(f"  and {len(apart) - SHOWN} more", flush=True)
    return len(apart)


def main(argv: list[str] | None = None) -> int:
    """Run a command; 0 where nothing differs."""
    parser = argparse.ArgumentParser(prog="python -m tests.goldens", description=__doc__)
    parser.add_argument("what", choices=("write", "compare", "list", "one"))
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help='parts, "fit-*" being understood')
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="parts at a time (default 2)")
    parser.add_argument("--out", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args(argv)
    names = chosen(arguments.only)
    if arguments.what == "list":
        print("\n".join(names))
        return 0
    if arguments.what == "one":
        return one(names[0], arguments.out)
    if arguments.what == "write":
        if arguments.only and not as_written():
            raise SystemExit("the goldens are of another arithmetic (of BLAS, of the processor): write all of them")
        arithmetic_of_goldens().write_text(f"{arithmetic()}\n", encoding="utf-8")
    apart = 0
    deed = write if arguments.what == "write" else compare
    with tempfile.TemporaryDirectory(prefix="goldens-") as folder, ThreadPoolExecutor(arguments.jobs) as pool:
        for name, found, said in pool.map(lambda name: recompute(name, Path(folder)), names):
            if found is None:
                print(f"{name}: failed\n{said}", flush=True)
                apart += 1
            else:
                apart += deed(name, found, said)
    return 1 if apart else 0


if __name__ == "__main__":
    raise SystemExit(main())
