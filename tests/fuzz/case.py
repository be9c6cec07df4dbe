"""A case of the fuzz, what running it gave, and what is a fault."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

MEMORY = 1.5e9  # bytes by which one case may let the process grow
# Of terminals: C0 but for tab and line feed, DEL, and C1.
CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")
LEFT_BEHIND = re.compile(r"(^|/)(\.simulating-|\.case-)|\.tmp$")
ANY = frozenset((0, 1, 2))
REFUSED = frozenset((2,))
ACCEPTED = frozenset((0, 1))


@dataclass(frozen=True)
class Run:
    """What a command left: exit code (None: it raised), text, files that are new, seconds of processor, bytes."""

    code: int | None
    out: str
    err: str
    new: tuple[str, ...]
    folder: Path
    seconds: float = 0.0
    growth: float = 0.0
    raised: str = ""
    warned: tuple[str, ...] = ()

    @property
    def said(self) -> str:
        """Both streams: `check` prints what is wrong with records among its findings."""
        return self.out + self.err


@dataclass(frozen=True)
class Case:
    """One command on files that a kind has written.

    Attributes
    ----------
    about : str
        What was done to which intact thing.
    argv : tuple of str
        Run in the case's folder.
    allowed : frozenset of int
        Exit codes.
    blames : tuple of str
        One of these stands in the message where it is refused.
    stops : tuple of str
        Functions at which the command ends as accepted: what comes after would take minutes, and is not looked at.
    demand : callable, optional
        From the run to what else is wrong with it, empty if nothing is.
    may_write : bool
        Whether a refused command may leave new files.
    patience : float
        Times the limit that it may take: a whole sizing is work, not a hang.
    """

    about: str
    argv: tuple[str, ...]
    allowed: frozenset[int] = ANY
    blames: tuple[str, ...] = ()
    stops: tuple[str, ...] = ()
    demand: Callable[[Run], str] | None = None
    may_write: bool = False
    patience: float = 1.0


@dataclass(frozen=True)
class Fault:
    """What is wrong: a short cause, alike for alike faults, and the particulars."""

    cause: str
    detail: str = ""


@dataclass(frozen=True)
class Outcome:
    """What became of a case, as the parent is told it."""

    kind: str
    number: int
    about: str
    argv: tuple[str, ...]
    code: int | None
    faults: tuple[Fault, ...]
    seconds: float
    said: str = ""

    @property
    def state(self) -> str:
        """Return "fault", "accepted" or "refused"."""
        return "fault" if self.faults else "refused" if self.code == 2 else "accepted"


def judge(case: Case, run: Run, limit: float) -> tuple[Fault, ...]:
    """Find everything that is wrong with a run; `limit` is in seconds of processor time."""
    found = []
    if run.raised:
        found.append(Fault(f"traceback: {run.raised}", run.err[-2000:]))
    elif run.code not in ANY:
        found.append(Fault(f"exit code {run.code}"))
    elif run.code not in case.allowed:
        found.append(
            Fault(f"{'refused' if run.code == 2 else 'accepted'}: {case.about.split(',')[0]}", run.said[-800:])
        )
    if run.code == 2 and not run.raised:
        found += _message(case, run)
    if match := CONTROL.search(run.said):
        found.append(Fault("control character on the terminal", repr(run.said[max(0, match.start() - 60) :][:120])))
    found += [Fault(f"warning: {one}") for one in dict.fromkeys(run.warned)]
    if run.seconds > limit * case.patience:
        found.append(Fault("hang", f"{run.seconds:.0f} s of processor time"))
    if run.growth > MEMORY:
        found.append(Fault("memory", f"{run.growth / 1e9:.1f} GB"))
    if left := [one for one in run.new if LEFT_BEHIND.search(one)]:
        found.append(Fault("temporary files left behind", ", ".join(left[:4])))
    if case.demand is not None and not run.raised and (wrong := case.demand(run)):
        found.append(Fault(wrong.split("\n")[0], wrong))
    return tuple(found)


def _message(case: Case, run: Run) -> list[Fault]:
    """What is wrong with how a command refused."""
    found = []
    if not run.said.strip():
        found.append(Fault("refused without a word"))
    elif case.blames and not any(one in run.said for one in case.blames):
        found.append(Fault(f"message without the file's name ({case.argv[0]})", run.said[-600:]))
    if run.new and not case.may_write:
        found.append(Fault(f"refused after writing ({case.argv[0]})", ", ".join(run.new[:5])))
    return found
