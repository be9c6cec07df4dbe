"""Processes that work for this one: they leave interrupts to it, and none outlives it."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing.connection import wait
from typing import Any


def pool(count: int) -> ProcessPoolExecutor:
    """A pool of `count` processes with nothing of this one's state; they end when it does, even if it is killed."""
    return ProcessPoolExecutor(count, mp_context=multiprocessing.get_context("spawn"), initializer=serve)


class SecondProcess:
    """A second process for what can be done meanwhile; where its block fails, it is ended, whatever it was doing.

    With `beside` false there is none, and everything is done here when its result is asked for.
    """

    def __init__(self, beside: bool = True) -> None:
        self.pool: ProcessPoolExecutor | None = None
        self.last: Future[Any] | None = None
        if beside:
            others = multiprocessing.active_children()
            self.pool = pool(1)
            self.process = self.pool.submit(os.getpid)
            self.workers = [process for process in multiprocessing.active_children() if process not in others]

    def __enter__(self) -> "SecondProcess":
        return self

    def __exit__(self, failure: object, *_: object) -> None:
        if self.pool is None:
            return
        for process in self.workers if failure is not None else ():
            process.terminate()
        self.pool.shutdown(cancel_futures=True)

    def begin[T](self, work: Callable[..., T], *arguments: object) -> Callable[[], T]:
        """Begin, and return what waits for the result (and raises what the work raised)."""
        if self.pool is None:
            return lambda: work(*arguments)
        begun: Future[T] = self.pool.submit(work, *arguments)
        self.last = begun
        return begun.result

    @property
    def idle(self) -> bool:
        """Whether there is a second process, and nothing left for it to do."""
        return self.pool is not None and (self.last is None or self.last.done())


def serve() -> None:
    """Leave interrupts to the parent, which keeps what is done; end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_the_parent, daemon=True).start()


def _end_with_the_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)  # nobody is left to report to
