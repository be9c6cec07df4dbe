"""How far the work is: every room tells the name of a stage and the fraction of it that is done; one bar shows it."""

import sys
from collections.abc import Callable
from threading import RLock
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from tqdm import tqdm

Progress = Callable[[str, float], None]


class Bar:
    """Progress on standard error: a line for each stage, with the time left; nothing where no terminal listens.

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
        if self._line is None or stage != self._stage:
            self.end()
            from tqdm import tqdm

            tqdm.set_lock(RLock())  # the default one is a semaphore of the system, and for many processes
            tqdm.monitor_interval = 0  # no thread beside
            form = "  [{bar:24}] {desc}, {remaining} left"
            self._stage = stage
            self._line = tqdm(total=1.0, smoothing=0, ascii=".#", bar_format=form, file=sys.stderr)
        self._line.n = fraction
        self._line.set_description_str(f"{stage}{note}")

    def end(self) -> None:
        """Leave the line as it stands."""
        if self._line is not None:
            self._line.close()
            self._line = None
