"""How far the work is: every room tells the name of a stage and the fraction of it that is done; one line shows it."""

import shutil
import sys
from collections.abc import Callable, Mapping
from threading import RLock
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from tqdm import tqdm

Progress = Callable[[str, float], None]


FIXED = 24 + len("  [] , 00:00:00 left")  # letters of the line beside the name of the stage


class Bar:
    """Progress on standard error: one line, with the time left of all of it; nothing where no terminal listens.

    Parameters
    ----------
    quiet : bool
        Show nothing at all.
    """

    def __init__(self, quiet: bool) -> None:
        self.quiet = quiet
        self.shown = not quiet and sys.stderr.isatty()
        self._line: tqdm | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def __call__(self, stage: str, fraction: float, note: str = "") -> None:
        """Show that `fraction` of the work is done, and what it is at; a note may change while the stage lasts."""
        if not self.shown:
            return
        if self._line is None:
            from tqdm import tqdm

            tqdm.set_lock(RLock())  # the default one is a semaphore of the system, and for many processes
            tqdm.monitor_interval = 0  # no thread beside
            size = shutil.get_terminal_size()  # 80 x 24 of a terminal that says 0 x 0, on which tqdm would show nothing
            form = "  [{bar:24}] {desc}, {remaining} left"
            self._line = tqdm(
                total=1.0, smoothing=0, ascii=".#", bar_format=form, file=sys.stderr, leave=False,
                ncols=size.columns, nrows=size.lines,
            )  # fmt: skip
        elif fraction < self._line.n:  # a count of its own begins
            self._line.reset()
        self._line.n = fraction
        room = max(shutil.get_terminal_size().columns - FIXED, 10)
        said = f"{stage}{note}"
        self._line.set_description_str(said if len(said) <= room else f"{said[: room - 3]}...")

    def say(self, text: str) -> None:
        """A line of its own on standard error, whoever listens, which stays."""
        if not self.quiet:
            print(f"scruton: {text}", file=sys.stderr, flush=True)

    def end(self) -> None:
        """Take the line away: what was found follows."""
        if self._line is not None:
            self._line.close()
            self._line = None


class Stages:
    """One total over stages that each tell their own fraction; it never goes back.

    Parameters
    ----------
    tell : Progress
        Told the stage and the fraction of all that is done.
    costs : mapping of str to float
        What each stage is expected to cost, in their order; those that are passed over count as done.
    unforeseen : callable
        From the name of a stage that was not expected to its cost.
    """

    def __init__(self, tell: Progress, costs: Mapping[str, float], unforeseen: Callable[[str], float]) -> None:
        self._tell, self._unforeseen = tell, unforeseen
        self._names, self._costs = list(costs), dict(costs)
        self._at, self._shown = -1, 0.0

    def __call__(self, stage: str, fraction: float) -> None:
        """Take note that `fraction` of a stage is done."""
        self.within(stage)(stage, fraction)

    def within(self, name: str) -> Progress:
        """Progress of a stage that has stages of its own, told by the fraction of all of them."""

        def told(stage: str, fraction: float) -> None:
            if name not in self._costs:
                self._costs[name] = self._unforeseen(name)
                self._names.insert(self._at + 1, name)
            self._at = self._names.index(name)
            done = sum(self._costs[one] for one in self._names[: self._at]) + self._costs[name] * fraction
            self._shown = max(self._shown, done / sum(self._costs.values()))
            self._tell(stage, self._shown)

        return told
