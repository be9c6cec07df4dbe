"""Processes that work for this one: they leave interrupts to it, and none outlives it."""

import gc
import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from scruton.spared import spare


def pool(count: int) -> ProcessPoolExecutor:
    """A pool of `count` processes with nothing of this one's state; they end when it does, even if it is killed."""
    return ProcessPoolExecutor(count, mp_context=multiprocessing.get_context("spawn"), initializer=serve)


def aside[T](work: Callable[..., T], *arguments: object) -> T:
    """Work in a copy of this process, whose memory goes when it ends; here, where there can be none.

    A copy costs nothing but for the pages that it changes, and hands its result over pickled.  What it does not, since
    it failed or was ended, is done here.
    """
    if not _of_one_thread():
        return work(*arguments)
    context = multiprocessing.get_context("fork")
    here, there = context.Pipe(duplex=False)
    copy = context.Process(target=_hand_over, args=(there, work, arguments))
    copy.start()
    there.close()
    try:
        with here:
            result: T = here.recv()
            return result
    except EOFError:
        pass
    finally:
        copy.terminate()
        copy.join()
    return work(*arguments)


def _of_one_thread() -> bool:
    """Whether this process can be copied: a lock that another thread holds, be it a library's, no copy ever opens."""
    threads = Path("/proc/self/task")  # of Linux, where alone libraries bear it
    return threads.is_dir() and len([*threads.iterdir()]) == 1


def _hand_over(result: Connection, work: Callable[..., object], arguments: tuple[object, ...]) -> None:
    serve()
    gc.freeze()  # what it was copied with is not looked through for what can go, which would copy it
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # what this process was copied from had work to keep
    with suppress(BaseException):  # a panic of compiled code is no Exception; it is met again where it is told
        result.send(work(*arguments))
    result.close()


@dataclass(eq=False)
class Work[T]:
    """What a second process was asked for; called, it gives the result, or raises what the work raised."""

    do: Callable[[], T]
    of: "SecondProcess"
    begun: "Future[T] | None" = None

    def __call__(self) -> T:
        """Wait for the result; what is not begun yet is done here."""
        return self.do() if self.withdrawn() else self.begun.result()  # type: ignore[union-attr]

    def withdrawn(self) -> bool:
        """Whether it was not begun, and now never will be there."""
        with self.of.lock:
            if self in self.of.waiting:
                self.of.waiting.remove(self)
        return self.begun is None


class SecondProcess:
    """A second process for what can be done meanwhile; where its block fails, it is ended, whatever it was doing.

    It does one thing at a time, in the order in which they were asked for.  What it has not begun when its result is
    wanted is done here, as everything is where the process is dead, or where there is none (`beside` false).
    """

    def __init__(self, beside: bool = True) -> None:
        self.pool: ProcessPoolExecutor | None = None
        self.waiting: deque[Work[Any]] = deque()
        self.last: Future[Any] | None = None
        self.lock = threading.Lock()
        if beside:
            others = multiprocessing.active_children()
            self.pool = pool(1)
            self.process = self.pool.submit(os.getpid)
            self.workers = [process for process in multiprocessing.active_children() if process not in others]

    def __enter__(self) -> "SecondProcess":
        return self

    def __exit__(self, failure: object, *_: object) -> None:
        with self.lock:
            ended, self.pool = self.pool, None
        if ended is None:
            return
        for process in self.workers if failure is not None else ():
            process.terminate()
        ended.shutdown(cancel_futures=True)

    def begin[T](self, work: Callable[..., T], *arguments: object) -> Work[T]:
        """Begin, as soon as there is nothing else to do."""
        own = Work(partial(work, *arguments), self)
        self.waiting.append(own)
        self._next()
        return own

    def _next(self, _: object = None) -> None:
        """Begin what waits first, where there is a process that has nothing to do."""
        begun = None
        with self.lock, suppress(BrokenExecutor):
            if self.pool is not None and self.idle and self.waiting:
                self.last = begun = self.pool.submit(self.waiting[0].do)
                self.waiting.popleft().begun = begun
        if begun is not None:
            begun.add_done_callback(self._next)

    @property
    def idle(self) -> bool:
        """Whether there is a second process, and nothing that it does."""
        return self.pool is not None and (self.last is None or self.last.done())


def serve() -> None:
    """Leave interrupts to the parent, which keeps what is done; end with it."""
    spare()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_the_parent, daemon=True).start()


def _end_with_the_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)  # nobody is left to report to
