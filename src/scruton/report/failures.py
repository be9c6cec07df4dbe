"""What failed in a report, kept beside what did not: one failure costs its own place, never the document."""

import traceback
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from scruton.errors import InputError
from scruton.report.document import ALARM, Callout

if TYPE_CHECKING:
    from scruton.processes import SecondProcess


@dataclass(frozen=True)
class Failure:
    """Work that gave no result."""

    kind: str  # type of the exception
    text: str  # what it said
    fault: bool  # of the program, and not of what it was given
    trace: str  # where it happened, for whoever mends it; empty where the input is at fault
    chapter: str = ""  # key of the one that lacks it
    what: str = ""  # its name in a sentence

    def callout(self) -> Callout:
        """The box that stands in its place: what is missing and whose fault it is, and the exception in words."""
        if self.fault:
            head = f"{self.what} failed. This is a fault of the program, not of the data"
            return Callout(ALARM, head, (f"{self.kind}: {self.text or 'no further word'}",))
        return Callout(ALARM, f"{self.what} could not be made", (self.text,))

    @property
    def sentence(self) -> str:
        """All of it in one line."""
        box = self.callout()
        return f"{box.head}: {box.lines[0]}"

    def to_json(self) -> dict[str, Any]:
        """Return the entry of `failures` in report.json."""
        return {
            "chapter": self.chapter, "what": self.what, "type": self.kind, "text": self.text, "fault": self.fault,
            "sentence": self.sentence, "traceback": self.trace,
        }  # fmt: skip


def guarded[T](
    work: Callable[..., T | Failure], *arguments: object, passing: tuple[type[Exception], ...] = ()
) -> T | Failure:
    """Do some work; where it fails, for whatever reason, say how.

    Whoever ends the program is obeyed: interrupts and exits pass, and so do exceptions of the types named.
    """
    try:
        return work(*arguments)
    except BaseException as error:  # a panic of compiled code is no Exception
        if isinstance(error, (KeyboardInterrupt, SystemExit, GeneratorExit, *passing)):
            raise
        fault = not isinstance(error, InputError)
        trace = "".join(traceback.format_exception(error)) if fault else ""
        return Failure(type(error).__name__, str(error), fault, trace)


def begun[T](second: "SecondProcess", work: Callable[..., T], *arguments: object) -> Callable[[], T | Failure]:
    """Begin guarded work beside."""
    return second.begin(guarded, work, *arguments)


@dataclass
class Failures:
    """The failures of one report, in the order in which they came up."""

    found: list[Failure] = field(default_factory=list)

    def keep[T, D](self, chapter: str, what: str, result: T | Failure, otherwise: D) -> T | D:
        """Give a result on, or note the failure under its chapter and give what stands in its place."""
        if not isinstance(result, Failure):
            return result
        self.found.append(replace(result, chapter=chapter, what=what))
        return otherwise

    def attempt[T, D](
        self, chapter: str, what: str, work: Callable[[], T | Failure], otherwise: D,
        passing: tuple[type[Exception], ...] = (),
    ) -> T | D:  # fmt: skip
        """Do some work, and keep its result or its failure."""
        return self.keep(chapter, what, guarded(work, passing=passing), otherwise)
