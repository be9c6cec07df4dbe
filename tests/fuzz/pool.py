"""Workers with a watchdog: a case that takes too long, or that ends its process, is a fault of that case alone."""

import contextlib
import multiprocessing
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

import psutil

from tests.fuzz.case import Fault, Outcome

LIMIT = 20.0  # s of processor time that a case may take
PATIENCE = 15.0  # times the limit, on the wall clock: the machine may be busy
BEYOND = 20.0  # s of processor time over the limit, before a process is ended that may yet come back by itself
STARTING = 300.0  # s for a worker to import what it needs
Planned = tuple[str, int]


@dataclass
class Worker:
    """A process, the line to it, and what it is at."""

    process: Any
    line: Connection
    folder: Path
    case: Planned | None = None
    about: tuple[str, tuple[str, ...], float] = "?", (), 1.0  # what it is, its command, times the limit it may take
    before: float = 0.0  # s of processor time when the case began
    since: float = field(default_factory=time.monotonic)
    ready: bool = False

    def give(self, case: Planned) -> None:
        """Start a case."""
        self.case, self.about, self.since, self.before = case, ("?", (), 1.0), time.monotonic(), self.busy()
        self.line.send(case)

    def busy(self) -> float:
        """Seconds of processor time so far."""
        try:
            return sum(psutil.Process(self.process.pid).cpu_times()[:2])
        except psutil.Error:
            return self.before

    def end(self) -> None:
        """End the process, whatever it does."""
        self.line.close()
        if self.process.is_alive():
            self.process.kill()
        self.process.join()


def _serve(
    line: Connection, seed: int, stock: Path, folder: Path, limit: float, prepare: Callable[[], None] | None
) -> None:
    """Run cases as they come, until the line closes."""
    from tests.fuzz.worker import bounded, run_case

    bounded()
    if prepare is not None:
        prepare()
    line.send(None)
    while True:
        try:
            kind, number = line.recv()
        except EOFError:
            return
        line.send(run_case(kind, number, seed=seed, stock=stock, folder=folder, limit=limit, announce=line.send))


def run_cases(
    planned: Sequence[Planned],
    *,
    seed: int,
    stock: Path,
    work: Path,
    jobs: int = 1,
    limit: float = LIMIT,
    patience: float = PATIENCE,
    prepare: Callable[[], None] | None = None,
    keep: Path | None = None,
) -> Iterator[Outcome]:
    """Run cases side by side; outcomes come as they are done.

    Parameters
    ----------
    planned : sequence of (kind, number)
    seed : int
    stock, work : Path
        What cases start from, and where they write.
    jobs : int
        Processes.
    limit : float
        Seconds of processor time for a case.
    patience : float
        Times the limit on the wall clock, before a process is ended: the machine may be busy.
    prepare : callable, optional
        Called in every worker first: tests of the harness plant faults with it.
    keep : Path, optional
        Gets the files of cases with faults.
    """
    spawn = multiprocessing.get_context("spawn")
    todo = list(reversed(planned))

    def start(place: int) -> Worker:
        here, there = spawn.Pipe()
        folder = work / f"worker-{place}"
        process = spawn.Process(target=_serve, args=(there, seed, stock, folder, limit, prepare))
        process.start()
        there.close()
        return Worker(process, here, folder)

    workers = [start(place) for place in range(min(jobs, len(todo)))]
    try:
        while todo or any(one.case for one in workers):
            wait([one.line for one in workers], timeout=0.2)
            for place, worker in enumerate(workers):
                for outcome in _look(worker, limit, patience):
                    if outcome.faults and keep is not None:
                        keep_case(outcome, worker.folder, keep)
                    yield outcome
                if not worker.process.is_alive() and not worker.line.closed and not worker.line.poll():
                    worker.end()
                if worker.line.closed:
                    workers[place] = start(place)
                elif worker.ready and worker.case is None and todo:
                    worker.give(todo.pop())
    finally:
        for worker in workers:
            worker.end()


def _look(worker: Worker, limit: float, patience: float) -> Iterator[Outcome]:
    """See what a worker has to say; end it where it is over time, or dead."""
    fault = None
    try:
        while worker.line.poll():
            said = worker.line.recv()
            if isinstance(said, tuple):
                worker.about = said
                continue
            worker.case, worker.ready = None, True
            if said is not None:
                yield said
            return
    except (EOFError, OSError):
        worker.process.join(5)
        fault = Fault("crash", f"the process ended with {worker.process.exitcode}")
    about, argv, more = worker.about
    longest, most = more * patience * limit, more * limit + BEYOND
    waited, busy = time.monotonic() - worker.since, worker.busy() - worker.before
    if fault is None and (waited > longest or busy > most if worker.ready else waited > STARTING):
        fault = Fault("hang", f"more than {waited:.0f} s, {busy:.0f} s of them busy")
    if fault is not None:
        case = worker.case
        worker.end()
        if case is None:
            raise RuntimeError(f"a worker of the harness does not start: {fault.detail}")
        yield Outcome(*case, about, argv, None, (fault,), busy)


def keep_case(outcome: Outcome, folder: Path, keep: Path) -> None:
    """Copy the files of a case, with its command and what is wrong with it; no file above 5 MB."""
    place = keep / f"{outcome.kind}-{outcome.number}"
    shutil.rmtree(place, ignore_errors=True)

    def large(at: str, names: list[str]) -> list[str]:
        return [one for one in names if (Path(at) / one).is_file() and (Path(at) / one).stat().st_size > 5e6]

    with contextlib.suppress(RecursionError, OSError):  # folders in folders without end are a case, too
        shutil.copytree(folder, place / "files", ignore=large, symlinks=True, ignore_dangling_symlinks=True)
    faults = "\n\n".join(f"{one.cause}\n{one.detail}" for one in outcome.faults)
    command = " ".join(repr(one if len(one) < 200 else one[:200] + "...") for one in outcome.argv)
    text = f"{outcome.about}\nscruton {command}\nexit code {outcome.code}\n\n{faults}\n\n{outcome.said}\n"
    (place / "fault.txt").write_text(text, encoding="utf-8", errors="backslashreplace")
