"""Work in a copy of a process, which takes its memory with it."""

import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import psutil
import pytest

of_linux = pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="no process is copied here")
BEGIN = """
import os, signal, threading, time
from scruton.processes import aside
here, held = os.getpid(), [1]
def where():
    held.append(2)
    return os.getpid(), held
"""


def said(script: str) -> str:
    """What a process of one thread prints, which one that tests is not."""
    done = subprocess.run([sys.executable, "-c", BEGIN + script], capture_output=True, text=True, check=True)
    assert not done.stderr
    return done.stdout.strip()


@of_linux
def test_a_copy_knows_what_its_maker_does_and_leaves_it_alone() -> None:
    assert said("there, seen = aside(where); print(there != here, seen, held)") == "True [1, 2] [1]"


@of_linux
def test_what_fails_in_a_copy_fails_here() -> None:
    script = """
def fails():
    raise ValueError(f"here {os.getpid() == here}")
try: aside(fails)
except ValueError as error: print(error)
"""
    assert said(script) == "here True"


@of_linux
@pytest.mark.parametrize("end", ["os.kill(os.getpid(), signal.SIGKILL)", "os._exit(0)", "raise SystemExit"])
def test_what_a_copy_does_not_end_is_done_here(end: str) -> None:
    assert said(f"""
def work():
    if os.getpid() != here:
        {end}
    return "done here"
print(aside(work))
""") == "done here"  # fmt: skip


@of_linux
def test_what_cannot_be_handed_over_is_done_here() -> None:
    assert said("print(aside(lambda: (lambda: os.getpid() == here))())") == "True"


def test_a_process_of_several_threads_is_not_copied() -> None:
    script = """
thread = threading.Thread(target=time.sleep, args=(1,)); thread.start()
print(aside(where) == (here, held), held); thread.join()
"""
    assert said(script) == "True [1, 2]"


@of_linux
@pytest.mark.parametrize(("ended", "code"), [(signal.SIGINT, 7), (signal.SIGKILL, -signal.SIGKILL)])
def test_no_copy_outlives_its_maker(ended: int, code: int, tmp_path: Path) -> None:
    script = f"""
from pathlib import Path
def work():
    Path({str(tmp_path / "new")!r}).write_text(str(os.getpid()))
    os.rename({str(tmp_path / "new")!r}, {str(tmp_path / "there")!r})
    time.sleep(600)
try: aside(work)
except KeyboardInterrupt: raise SystemExit(7)
"""
    maker = subprocess.Popen([sys.executable, "-c", BEGIN + script])
    until(maker, (tmp_path / "there").exists)
    copy = int((tmp_path / "there").read_text())
    maker.send_signal(ended)
    assert maker.wait(60) == code
    until(maker, partial(gone, copy))


def until(maker: subprocess.Popen[bytes], holds) -> None:
    for _ in range(6000):
        if holds():
            return
        time.sleep(0.01)
    maker.kill()
    pytest.fail("not within a minute")


def gone(process: int) -> bool:
    return not psutil.pid_exists(process) or psutil.Process(process).status() == psutil.STATUS_ZOMBIE
