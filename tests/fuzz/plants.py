"""Faults that tests of the harness plant in its workers: each is one that the harness must see."""

import os
import signal
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

# What the reader of files does instead, and the beginning of the cause that must be found.
CAUSES = {
    "type_error": "traceback: TypeError",
    "escape": "control character",
    "warning": "warning: RuntimeWarning",
    "memory": "memory",
    "misread": "intact record misread",
    "mute": "refused without a word",
    "nameless": "message without the file's name",
    "exit_code": "exit code 3",
    "busy": "hang",
    "hang": "hang",
    "crash": "crash",
}
Read = Callable[[Any, Path], bytes]


def type_error(read: Read, files: Any, path: Path) -> bytes:
    """Raise what no message was made of."""
    return len(7)  # type: ignore[arg-type]


def escape(read: Read, files: Any, path: Path) -> bytes:
    """Colour the terminal, below Python."""
    os.write(1, b"\x1b[31m")
    return read(files, path)


def warning(read: Read, files: Any, path: Path) -> bytes:
    """Warn, as libraries do."""
    warnings.warn("overflow encountered", RuntimeWarning, stacklevel=2)
    return read(files, path)


def memory(read: Read, files: Any, path: Path) -> bytes:
    """Take 2 GB."""
    np.ones(250_000_000)
    return read(files, path)


def misread(read: Read, files: Any, path: Path) -> bytes:
    """Lose the last row of a record."""
    data = read(files, path)
    if path.suffix != ".csv":
        return data
    end = b"\n\0" if data.startswith(b"\xff\xfe") else b"\n"
    return data[: data.rindex(end, 0, len(data) - 8)]


def mute(read: Read, files: Any, path: Path) -> bytes:
    """Refuse, and say nothing."""
    raise SystemExit(2)


def nameless(read: Read, files: Any, path: Path) -> bytes:
    """Refuse, and do not say which file."""
    print("something is wrong", file=sys.stderr)
    raise SystemExit(2)


def exit_code(read: Read, files: Any, path: Path) -> bytes:
    """End with a code that means nothing."""
    raise SystemExit(3)


def busy(read: Read, files: Any, path: Path) -> bytes:
    """Take more processor time than allowed, and come back."""
    end = time.process_time() + 1.5
    while time.process_time() < end:
        pass
    return read(files, path)


def hang(read: Read, files: Any, path: Path) -> bytes:
    """Never come back."""
    time.sleep(1000)
    return read(files, path)


def crash(read: Read, files: Any, path: Path) -> bytes:
    """End the process as the system does."""
    os.kill(os.getpid(), signal.SIGSEGV)
    return read(files, path)


def plant(*names: str) -> None:
    """Let the reader of files misbehave in a way of its own in each command; as it should after the last."""
    from scruton import cli
    from scruton.campaign.files import Files

    whole, command, turns = Files.read, cli.main, iter(names)
    now: list[str] = []

    def main(argv: list[str]) -> int:
        now[:] = [one for one in [next(turns, "")] if one]
        try:
            return command(argv)
        finally:
            if now != ["misread"]:  # which the harness itself has to see when it compares
                now.clear()

    def read(files: Any, path: Path, *more: Any) -> bytes:
        def well(files: Any, path: Path) -> bytes:
            return whole(files, path, *more)

        return globals()[now[0]](well, files, path) if now else well(files, path)

    cli.main, Files.read = main, read


def all_but_the_last_two() -> None:
    """Plant what a worker survives."""
    plant(*list(CAUSES)[:-2])


def hang_first() -> None:
    """Plant a hang."""
    plant("hang")


def crash_first() -> None:
    """Plant a crash."""
    plant("crash")
