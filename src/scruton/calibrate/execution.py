"""How a long computation is carried out: where its results go, over what lies there, by how many processes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scruton.errors import InputError
from scruton.progress import Progress
from scruton.workers import HERE, Workers
from scruton.workspace import Workspace


@dataclass(frozen=True)
class Execution:
    """Where the results of a long computation go, and how it is carried out.

    Attributes
    ----------
    folder : Path
        For the results; every part is kept as soon as it is done.
    workers : Workers
        Who does the work; results do not depend on it.
    force, resume : bool
        Replace the results that lie in the folder, or go on with them.
    progress : callable, optional
        Told a stage, and the fraction of it that is done.
    """

    folder: Path
    workers: Workers = HERE
    force: bool = False
    resume: bool = False
    progress: Progress | None = None

    def claim(
        self, name: str, *, inputs: Mapping[str, str], settings: Mapping[str, Any], results: Sequence[str]
    ) -> Workspace:
        """Claim the folder, to be entered; see `Workspace` for the parameters and the errors."""
        return Workspace(
            self.folder, name, inputs=inputs, settings=settings, results=results, force=self.force, resume=self.resume,
            grows=True,
        )  # fmt: skip

    def tell(self, stage: str, done: int, total: int) -> None:
        """Report progress to whoever listens."""
        if self.progress:
            self.progress(stage, done / total)


def at_least(low: int, about: str, **values: int) -> None:
    """Raise InputError for a number that is too small."""
    for name, value in values.items():
        if value < low:
            raise InputError(about, name, str(value), f"at least {low}")
