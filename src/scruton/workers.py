"""Work spread by Dask over processes of this machine, or over the workers of a scheduler that runs already."""

import logging
import os
import queue
import signal
import sys
import tempfile
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing import resource_tracker
from operator import itemgetter
from pathlib import Path
from typing import Any

from scruton.campaign.bounded import read_bytes
from scruton.errors import InputError
from scruton.spared import serve_dask
from scruton.terminal import at_sigterm

# Set by judgement.
LARGEST_CERTIFICATE = 10**6  # bytes of a PEM file: those in use have some thousands
REACH = 5  # s, to reach a scheduler and to see its first worker
PATIENCE = 60  # s without any worker before what is left is given up
POLL = 1  # s between looks at how many workers there are
ALLOWED_DEATHS = 1  # of the worker that does a task: it may have died of something else: one more chance

# The arrays are small: threads of the linear algebra library would only get in each other's way.
ONE_THREAD = {
    f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA", "VECLIB_MAXIMUM", "NUMEXPR")
}  # fmt: skip
SETTINGS = {
    "distributed.comm.timeouts.connect": f"{REACH}s",
    "distributed.scheduler.allowed-failures": ALLOWED_DEATHS,
    "distributed.worker.memory.terminate": False,
    "distributed.worker.memory.pause": False,
}

TlsFiles = tuple[Path | None, Path | None, Path | None]  # of the authority, own certificate, own key
NO_TLS: TlsFiles = (None, None, None)


@dataclass(frozen=True)
class Outcome:
    """What came of one task: its value, or why there is none."""

    value: Any = None
    fault: str = ""
    error: BaseException | None = None  # that the work raised


@dataclass(frozen=True)
class Workers:
    """Who does the work: this process, several of this machine, or those of a Dask scheduler.

    Attributes
    ----------
    jobs : int
        Processes of this machine; with one, all is done in this one.
    scheduler : str, optional
        Address of a running scheduler, "tls://host:port" or "tcp://host:port", in their place.
    tls : tuple of Path
        Certificate of the authority, own certificate and own key, for a scheduler under TLS.
    """

    jobs: int = 1
    scheduler: str | None = None
    tls: TlsFiles = NO_TLS

    def reached(self) -> "Workers":
        """These workers; InputError, before any work is done, for a scheduler that cannot be reached or used."""
        _security(self.scheduler, self.tls)
        if self.scheduler is not None:
            with connected(self.scheduler, self.jobs, tls=self.tls):
                pass
        return self

    def outcomes(self, work: Callable[[Any], Any], tasks: Sequence[Any]) -> Iterator[tuple[int, Outcome]]:
        """Do every task by a function that the workers can import; index and outcome come as soon as it is done.

        In this process an error of the work itself is raised at once.  InputError as of `connected`.
        """
        jobs = min(self.jobs, len(tasks))
        if self.scheduler is None and jobs < 2:
            for index, task in enumerate(tasks):
                yield index, Outcome(work(task))
        elif tasks:
            from scruton import __version__

            with connected(self.scheduler, jobs, tls=self.tls, quiet=True) as client:
                yield from finished(client, partial(_alike, __version__, work), tasks)

    def values(self, work: Callable[[Any], Any], tasks: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        """Do every task, as `outcomes`; index and value come as soon as there is one.

        Once all others are done, the first error of the work is raised; InputError where a worker was lost with it.
        """
        missing = []
        for index, outcome in self.outcomes(work, tasks):
            if outcome.fault:
                missing.append(outcome)
            else:
                yield index, outcome.value
        for outcome in missing:
            if outcome.error is not None:
                raise outcome.error
            wanted = "workers that last: what is done is kept, the same command with --resume goes on"
            raise InputError("workers", "", f"{len(missing)} tasks without a result ({outcome.fault})", wanted)


HERE = Workers()  # in this process


def _alike(version: str, work: Callable[[Any], Any], task: Any) -> Any:
    """Do a task, if this is the version that asks: results do not depend on who computes them."""
    from scruton import __version__

    if version != __version__:
        raise InputError("worker", "version of scruton", __version__, f"{version}, which asks for the results")
    return work(task)


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def connected(scheduler: str | None, jobs: int, *, tls: TlsFiles = NO_TLS, quiet: bool = False) -> Iterator[Any]:
    """Open a Dask client: of a scheduler ("tls://host:port"), or of `jobs` processes that end with the block.

    The processes have one thread each and talk over the loopback interface alone; there is no dashboard, and Dask's
    own files lie in a temporary folder.  Without TLS, whoever reaches the scheduler's port runs what he likes on its
    workers, and here.  InputError if the scheduler cannot be reached or has no worker; TLS that cannot be.
    """
    serve_dask()
    security = _security(scheduler, tls)
    import dask
    from distributed import Client, LocalCluster

    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="scruton-", ignore_cleanup_errors=True))
        stack.enter_context(dask.config.set({**SETTINGS, "temporary-directory": folder}))
        stack.enter_context(_silent())
        if scheduler is not None:
            yield stack.enter_context(_reach(scheduler, security))
            return
        with _interrupts_wait():
            cluster = stack.enter_context(
                LocalCluster(
                    n_workers=jobs, threads_per_worker=1, processes=True, host="127.0.0.1",
                    dashboard_address="127.0.0.1:0", scheduler_kwargs={"dashboard": False},
                    local_directory=folder, memory_limit=0, silence_logs=logging.CRITICAL,
                    env=ONE_THREAD | ({"PYTHONWARNINGS": "ignore"} if quiet else {}),
                )
            )  # fmt: skip
            client = stack.enter_context(Client(cluster))
        yield client


@contextmanager
def _interrupts_wait() -> Iterator[None]:
    """Hold Ctrl-C and SIGTERM back until the block ends: Dask does not start in good order once it is disturbed.

    Processes and threads that the block starts inherit the mask of Ctrl-C, and leave that to the parent, which ends
    them by SIGTERM: that one is held back by a handler, which no process inherits.
    """
    resource_tracker.ensure_running()  # whoever starts it lets interrupts in again
    heard: list[bool] = []
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        with at_sigterm(lambda *_: heard.append(True)):
            yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if heard:
            signal.raise_signal(signal.SIGTERM)


@contextmanager
def _silent() -> Iterator[None]:
    """Keep Dask's log off the terminal: what matters of it comes back as the fault of a task."""
    loggers = [logging.getLogger(name) for name in logging.root.manager.loggerDict if name.startswith("distributed")]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def _security(scheduler: str | None, tls: TlsFiles) -> dict[str, Any]:
    """Build what a client needs for TLS; empty for a scheduler without, or with TLS from Dask's own configuration."""
    options = dict(zip(("--tls-ca", "--tls-cert", "--tls-key"), tls, strict=True))
    given = [name for name, path in options.items() if path is not None]
    if not given:
        return {}
    if scheduler is None or not scheduler.startswith("tls://"):
        wanted = 'a scheduler under TLS, such as --scheduler "tls://192.168.0.7:8786"'
        raise InputError("command line", given[0], scheduler or "no --scheduler", wanted)
    for name, path in options.items():
        if path is None:
            raise InputError("command line", name, "nothing", f"all three of: {', '.join(options)}")
        read_bytes(path, LARGEST_CERTIFICATE)
    from distributed import Security

    authority, certificate, key = map(str, tls)
    security = Security(require_encryption=True, tls_ca_file=authority, tls_client_cert=certificate, tls_client_key=key)
    try:
        security.get_connection_args("client")
    except (OSError, ValueError) as error:  # ssl.SSLError is an OSError
        reason = f"certificates that cannot be used ({error})"
        raise InputError("command line", "--tls-ca", reason, "certificates and a key in PEM files") from None
    return {"security": security}


@contextmanager
def _reach(scheduler: str, security: dict[str, Any]) -> Iterator[Any]:
    """Open a client of a running scheduler."""
    from distributed import Client

    wanted = 'the address of a running Dask scheduler, such as "tls://192.168.0.7:8786" or "tcp://127.0.0.1:8786"'
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of versions that differ: what that breaks is reported
            # as no default, which one that reaches nothing stays: whoever writes a file later would ask it for a lock
            client = Client(scheduler, timeout=REACH, set_as_default=False, **security)
    except (OSError, ValueError, RuntimeError, ImportError, TypeError) as error:  # TypeError: TLS without certificates
        reason = f"{scheduler}, where none answers ({type(error).__name__})"
        raise InputError("command line", "--scheduler", reason, wanted) from error
    with client:
        try:
            client.wait_for_workers(1, timeout=REACH)
        except TimeoutError:
            found = f"{scheduler}, a scheduler without workers"
            wanted = f'at least one, started beforehand: "dask worker {scheduler} --nthreads 1"'
            raise InputError("command line", "--scheduler", found, wanted) from None
        yield client


def finished(client: Any, work: Callable[[Any], Any], tasks: Sequence[Any]) -> Iterator[tuple[int, Outcome]]:
    """Do every task by a function that the workers can import; index and outcome come as soon as it is done.

    A worker holds one task at a time, so that one that dies takes nothing else with it. Dask gives the task to another
    worker then, and gives it up when that one dies, too.
    """
    waiting = deque(enumerate(tasks))
    running: dict[str, tuple[int, Any]] = {}
    ended: queue.SimpleQueue[Any] = queue.SimpleQueue()
    seen = time.monotonic()
    try:
        while waiting or running:
            count = _workers(client)
            if count:
                seen = time.monotonic()
            elif count is None or time.monotonic() - seen > PATIENCE:
                break
            while waiting and len(running) < max(count, 1):
                index, task = waiting.popleft()
                future = client.submit(work, task, pure=False)
                running[future.key] = (index, future)
                future.add_done_callback(ended.put)
            try:
                future = ended.get(timeout=POLL)
            except queue.Empty:
                continue
            yield running.pop(future.key)[0], _outcome(future)
    finally:
        if running and _workers(client) is not None:
            client.cancel([future for _, future in running.values()])
    for index, _ in sorted([*running.values(), *waiting], key=itemgetter(0)):
        yield index, Outcome(fault="no worker is left: the scheduler or all of its workers are gone")


def tell(topic: str, what: Any) -> None:
    """Tell whoever asked for the work, from within it; nobody listens outside a worker."""
    dask = sys.modules.get("distributed")  # a worker has it, and elsewhere it takes its time to come
    if dask is None:
        return
    try:
        dask.get_worker().log_event(topic, what)
    except ValueError:
        return


@contextmanager
def told(client: Any, topic: str, listen: Callable[[Any], None]) -> Iterator[None]:
    """Hear what workers `tell` of a topic, while the block lasts, in another thread."""
    client.subscribe_topic(topic, lambda event: listen(event[1]))
    try:
        yield
    finally:
        if _workers(client) is not None:
            client.unsubscribe_topic(topic)


def _workers(client: Any) -> int | None:
    """How many workers there are; None where the scheduler is gone."""
    if client.status != "running":
        return None
    try:
        return len(client.nthreads())
    except (OSError, RuntimeError, TimeoutError):
        return None


def _outcome(future: Any) -> Outcome:
    from distributed import KilledWorker

    if future.status == "finished":
        return Outcome(future.result())
    if future.status != "error":
        return Outcome(fault="the scheduler was lost while it ran")
    error = future.exception()
    if isinstance(error, KilledWorker):
        return Outcome(fault="the process that ran it died each time that it was tried; is there memory enough?")
    return Outcome(fault=f"unexpected {type(error).__name__}: {error}", error=error)
