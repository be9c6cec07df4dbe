"""Runs one case in this process as a user would: its own folder, both streams caught down to their descriptors."""

import contextlib
import os
import resource
import shutil
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from tests.fuzz.case import Case, Fault, Outcome, Run, judge
from tests.fuzz.kinds import KINDS
from tests.fuzz.standins import stopped
from tests.fuzz.stock import Stock

ADDRESS_SPACE = 6 << 30  # bytes: a bomb ends in MemoryError, not in the machine's
# What Python does not show to users either.
QUIET = (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning)


def generator(seed: int, kind: str, number: int) -> np.random.Generator:
    """Case `number` of a kind depends on these three alone."""
    return np.random.default_rng([seed, int.from_bytes(kind.encode()), number])


def run_case(
    kind: str, number: int, *, seed: int, stock: Path, folder: Path, limit: float, announce: Callable[[object], None]
) -> Outcome:
    """Make a case in `folder`, which is made anew, announce what it is, run it, and judge it."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    here = Path.cwd()
    os.chdir(folder)
    try:
        case = KINDS[kind].make(generator(seed, kind, number), number, folder, Stock(stock))
        announce((case.about, case.argv, case.patience))
        run = command(case, folder)
        faults = judge(case, run, limit)
    except Exception:  # the harness itself; it must be heard
        shown = traceback.format_exc()
        return Outcome(kind, number, "harness", (), None, (Fault(f"harness: {shown.splitlines()[-1]}", shown),), 0.0)
    finally:
        os.chdir(here)
    return Outcome(kind, number, case.about, case.argv, run.code, faults, run.seconds, run.said[-1500:])


def command(case: Case, folder: Path) -> Run:
    """Run the command line of a case."""
    from scruton import cli

    before = _listing(folder)
    streams = folder.with_name(folder.name + ".out"), folder.with_name(folder.name + ".err")
    code, raised = None, ""
    memory, start = _memory_mark(), time.process_time()
    with _captured(*streams), stopped(case.stops), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for one in QUIET:
            warnings.simplefilter("ignore", one)
        try:
            code = cli.main(list(case.argv))
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 0 if end.code is None else 1
        except BaseException as error:
            raised = signature(error)
            traceback.print_exc(file=sys.stderr)
    seconds = time.process_time() - start
    out, err = (one.read_bytes().decode("utf-8", errors="replace") for one in streams)
    return Run(
        code, out, err, tuple(sorted(_listing(folder) - before)), folder, seconds, _memory_peak() - memory, raised,
        tuple(f"{one.category.__name__} {_place(one)}: {str(one.message)[:80]}" for one in caught),
    )  # fmt: skip


def signature(error: BaseException) -> str:
    """Type of an exception and the last function of the package that it went through."""
    places = [one for one in traceback.extract_tb(error.__traceback__) if f"{os.sep}scruton{os.sep}" in one.filename]
    last = f" in {places[-1].name} ({_short(places[-1].filename)})" if places else ""
    return f"{type(error).__name__}{last}"


def _short(filename: str) -> str:
    """A path below the package or below site-packages."""
    parts = Path(filename).parts
    for root in ("scruton", "site-packages"):
        if root in parts:
            return "/".join(parts[len(parts) - parts[::-1].index(root) :])
    return parts[-1]


def _place(warning: warnings.WarningMessage) -> str:
    return f"{_short(warning.filename)}:{warning.lineno}"


def _listing(folder: Path) -> set[str]:
    return {one.relative_to(folder).as_posix() for one in folder.rglob("*") if not one.is_dir()}


@contextlib.contextmanager
def _captured(out: Path, err: Path) -> Iterator[None]:
    """Point descriptors 1 and 2 and Python's streams at files: libraries in C write past Python."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept = [(number, os.dup(number)) for number in (1, 2)]
    streams = sys.stdout, sys.stderr
    try:
        for number, path in ((1, out), (2, err)):
            file = os.open(path, os.O_CREAT | os.O_TRUNC | os.O_WRONLY)
            os.dup2(file, number)
            os.close(file)
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - closed below
        sys.stderr = open(2, "w", encoding="utf-8", errors="backslashreplace", closefd=False)  # noqa: SIM115
        yield
    finally:
        for one in (sys.stdout, sys.stderr):
            if not one.closed:
                one.close()
        sys.stdout, sys.stderr = streams
        for number, copy in kept:
            os.dup2(copy, number)
            os.close(copy)


def bounded() -> None:
    """Bound what this process may take of the machine."""
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _memory_mark() -> float:
    """Bytes in use; the peak begins anew where the system lets it (Linux)."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    return _memory_peak()


def _memory_peak() -> float:
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
        return 1024.0 * int(next(one.split()[1] for one in lines if one.startswith("VmHWM")))
    except OSError:
        return 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
