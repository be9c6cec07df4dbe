"""A command at a terminal: what it prints, and what somebody answers."""

import os
import pty
import select
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

PROMPT = ": "  # what a question ends in
PATIENCE = 60.0  # s without a letter


def at_a_terminal(
    words: Sequence[str], answers: Sequence[str], folder: Path, program: Sequence[str] = ("-m", "scruton")
) -> tuple[int, str]:
    """Run `scruton WORDS`, or another program of Python, at a terminal of 80 columns, and answer in turn.

    Returned are the exit code, and all that is seen.
    """
    ours, theirs = pty.openpty()
    command = [sys.executable, *program, *words]
    environment = os.environ | {"COLUMNS": "80", "TERM": "dumb"}
    running = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, cwd=folder, env=environment)
    os.close(theirs)
    seen, left = b"", list(answers)
    while select.select([ours], [], [], PATIENCE)[0]:
        try:
            piece = os.read(ours, 1 << 16)
        except OSError:  # its end was closed
            break
        if not piece:
            break
        seen += piece
        if left and seen.endswith(PROMPT.encode()):
            os.write(ours, f"{left.pop(0)}\n".encode())
    os.close(ours)  # who still waits for an answer is hung up on
    assert not left, f"not asked for: {left}; seen: {seen.decode()}"
    return running.wait(timeout=60), seen.decode().replace("\r\n", "\n")
