"""Processes that work for this one: they leave interrupts to it, and none outlives it."""

import multiprocessing
import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.connection import wait


def pool(count: int) -> ProcessPoolExecutor:
    """A pool of `count` processes with nothing of this one's state; they end when it does, even if it is killed."""
    return ProcessPoolExecutor(count, mp_context=multiprocessing.get_context("spawn"), initializer=serve)


def serve() -> None:
    """Leave interrupts to the parent, which keeps what is done; end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_the_parent, daemon=True).start()


def _end_with_the_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)  # nobody is left to report to
