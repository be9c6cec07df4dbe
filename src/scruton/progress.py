"""How far the work is: every room tells the name of a stage and the fraction of it that is done; one line shows it."""

import shutil
import sys
from collections.abc import Callable
from threading import RLock
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from tqdm import tqdm

Progress = Callable[[str, float], None]


FIXED = 24 + len("  [] , 00:00:00 left")  # letters of the line beside the name of the stage


class Bar:
    """Progress on standard error: one line, with the time left of the stage; nothing where no terminal listens.

    Parameters
    ----------
    quiet : bool
        Show nothing at all.
    """

    def __init__(self, quiet: bool) -> None:
        self.shown = not quiet and sys.stderr.isatty()
        self._stage = ""
        self._line: tqdm | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def __call__(self, stage: str, fraction: float, note: str = "") -> None:
        """Show that `fraction` of a stage is done; a note may change while the stage lasts."""
        if not self.shown:
            return
        if self._line is None:
            from tqdm import tqdm

            tqdm.set_lock(RLock())  # the default one is a semaphore of the system, and for many processes
            tqdm.monitor_interval = 0  # no thread beside
            form = "  [{bar:24}] {desc}, {remaining} left"
            self._line = tqdm(total=1.0, smoothing=0, ascii=".#", bar_format=form, file=sys.stderr, leave=False)
        elif stage != self._stage:
            self._line.reset()
        self._stage, self._line.n = stage, fraction
        room = max(shutil.get_terminal_size().columns - FIXED, 10)
        said = f"{stage}{note}"
        self._line.set_description_str(said if len(said) <= room else f"{said[: room - 3]}...")

    def end(self) -> None:
        """Take the line away: what was found follows."""
        if self._line is not None:
            self._line.close()
            self._line = None
