"""Work that a second process does meanwhile."""

import os
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing import active_children
from typing import Any

from scruton.processes import pool


class SecondProcess:
    """A second process for what can be done beside.

    Where the block that it is opened for fails, it is ended, whatever it was doing.

    Parameters
    ----------
    beside : bool
        False: there is none, and everything is done here when its result is asked for.
    """

    def __init__(self, beside: bool = True) -> None:
        self.pool: ProcessPoolExecutor | None = None
        self.last: Future[Any] | None = None
        if beside:
            others = active_children()
            self.pool = pool(1)
            self.process = self.pool.submit(os.getpid)
            self.workers = [one for one in active_children() if one not in others]

    def __enter__(self) -> "SecondProcess":
        return self

    def __exit__(self, failure: object, *_: object) -> None:
        if self.pool is None:
            return
        for one in self.workers if failure is not None else ():
            one.terminate()
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
