"""Runs of a command that are ended at some moment, taken up again, and compared with a run that nobody touched."""

import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import psutil

ORPHANS = 10.0  # s that processes of a run may outlive it
LONGEST = 600.0  # s for any run
RESULTS = "results"
EXIT = {"SIGINT": 130, "SIGTERM": 143}
# Documented differences: how long a case of a challenge took, and what follows from it in the manifest.
TIMINGS = re.compile(rb'"seconds": [0-9.e+-]+')
TIMED = re.compile(rb'("[^"]*case\.json"|"checksum"): "[0-9a-f]{64}"')


@dataclass(frozen=True)
class Ended:
    """How a run ended: its exit code (negative: by that signal), what it said, whether it was still running then."""

    code: int
    err: str
    seconds: float
    in_time: bool
    orphans: tuple[str, ...] = ()


def run(argv: tuple[str, ...], folder: Path, moment: float | None = None, how: str = "SIGKILL") -> Ended:
    """Run a command in a folder; end it `moment` seconds later, if it still runs.

    SIGKILL and SIGTERM go to the first process alone, SIGINT to all of them, as from a terminal.
    """
    folder.mkdir(parents=True, exist_ok=True)
    log = folder / "stderr.txt"  # of all runs in this folder
    before = log.stat().st_size if log.exists() else 0
    with log.open("ab") as err:
        process = subprocess.Popen(
            [sys.executable, "-m", "scruton", *argv], cwd=folder, stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=err, start_new_session=True,
        )  # fmt: skip
        start, in_time = time.monotonic(), False
        try:
            process.wait(LONGEST if moment is None else moment)
        except subprocess.TimeoutExpired:
            in_time = moment is not None
            _end(process, how if in_time else "SIGKILL")
    code = process.wait(LONGEST)
    seconds = time.monotonic() - start
    orphans = tuple(_outlived(process.pid))
    said = log.read_bytes()[before:].decode("utf-8", errors="replace")
    return Ended(code, said, seconds, in_time, orphans)


def _end(process: subprocess.Popen[bytes], how: str) -> None:
    with contextlib.suppress(ProcessLookupError):
        if how == "SIGINT":
            os.killpg(process.pid, signal.SIGINT)
        else:
            process.send_signal(getattr(signal, how))


def _outlived(session: int) -> Iterator[str]:
    """Wait for the processes of a session to end; name and end those that do not."""
    limit = time.monotonic() + ORPHANS
    while (left := _members(session)) and time.monotonic() < limit:
        time.sleep(0.2)
    for one in left:
        with contextlib.suppress(psutil.Error):
            yield f"{one.pid}: {' '.join(one.cmdline())[-120:]}"
            one.kill()


def _members(session: int) -> list[psutil.Process]:
    found = []
    for one in psutil.process_iter():
        with contextlib.suppress(psutil.Error, OSError):
            if os.getsid(one.pid) == session and one.status() != psutil.STATUS_ZOMBIE:
                found.append(one)
    return found


def faults_of_end(ended: Ended, how: str) -> Iterator[str]:
    """What is wrong with how an interrupted run ended."""
    if ended.orphans:
        yield f"orphans after {ORPHANS:g} s"
    if not ended.in_time or how == "SIGKILL":
        return
    if "Traceback" in ended.err:
        yield f"traceback after {how}"
    if ended.code not in (EXIT[how], 0, 1):  # 0 and 1: it was done before it heard
        yield f"exit code {ended.code} after {how}"
    elif ended.code == EXIT[how] and not ended.err.strip():
        yield f"no word after {how}"


def torn(folder: Path) -> Iterator[str]:
    """JSON that was cut off, under a name that readers trust."""
    for path in sorted((folder / RESULTS).rglob("*.json")):
        inside = path.relative_to(folder / RESULTS).as_posix()
        if not any(part.startswith(".") for part in path.parts[len(folder.parts) :]):
            try:
                json.loads(path.read_text(encoding="utf-8"))
            except ValueError:
                yield f"cut off: {inside}"


def contents(folder: Path) -> dict[str, bytes]:
    """Bytes of every file of the results, without timings."""
    return {path.relative_to(folder).as_posix(): _untimed(path) for path in sorted(folder.rglob("*")) if path.is_file()}


def _untimed(path: Path) -> bytes:
    content = TIMINGS.sub(b'"seconds": 0', path.read_bytes())
    return TIMED.sub(rb"\1", content) if path.name == "manifest.json" else content


def differences(found: dict[str, bytes], wanted: dict[str, bytes], known: frozenset[str]) -> Iterator[str]:
    """Files that are missing, too many, or other, together where they lie in one folder."""
    unlike: dict[tuple[str, str], list[str]] = {}
    for name in sorted((set(found) | set(wanted)) - known):
        what = "missing" if name not in found else "too many" if name not in wanted else "other"
        if found.get(name) != wanted.get(name):
            unlike.setdefault((what, name.split("/")[0]), []).append(name)
    for (what, folder), names in unlike.items():
        yield f"{what}: {names[0]}" if len(names) == 1 else f"{what}: {len(names)} files in {folder}"


def keep(folder: Path, to: Path) -> None:
    """Keep what a moment left, for whoever looks for the cause."""
    shutil.rmtree(to, ignore_errors=True)
    shutil.copytree(folder, to)
