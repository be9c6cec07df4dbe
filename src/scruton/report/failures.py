"""What failed in a report, kept beside what did not: one failure costs its own place, never the document."""

import traceback
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from scruton.errors import InputError
from scruton.report.document import ALARM, Callout

if TYPE_CHECKING:
    from scruton.processes import SecondProcess


@dataclass(frozen=True)
class Failure:
    """Work that gave no result.

    Attributes
    ----------
    kind, text : str
        Type of the exception and what it said.
    fault : bool
        Whether it is the program that is at fault, and not what it was given.
    trace : str
        Where it happened, for whoever mends it; empty where the input is at fault.
    chapter, what : str
        Key of the chapter that lacks it, and its name in a sentence; given by `Failures.keep`.
    """

    kind: str
    text: str
    fault: bool
    trace: str
    chapter: str = ""
    what: str = ""

    @property
    def head(self) -> str:
        """What is missing, and whose fault it is."""
        if self.fault:
            return f"{self.what} failed. This is a fault of the program, not of the data"
        return f"{self.what} could not be made"

    @property
    def reason(self) -> str:
        """The exception in words."""
        return f"{self.kind}: {self.text or 'no further word'}" if self.fault else self.text

    @property
    def sentence(self) -> str:
        """All of it in one line."""
        return f"{self.head}: {self.reason}"

    def callout(self) -> Callout:
        """The box that stands in its place."""
        return Callout(ALARM, self.head, (self.reason,))

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
    except (KeyboardInterrupt, SystemExit, GeneratorExit):
        raise
    except passing:
        raise
    except InputError as error:
        return Failure(type(error).__name__, str(error), fault=False, trace="")
    except BaseException as error:  # a panic of compiled code is no Exception
        return Failure(type(error).__name__, str(error), fault=True, trace="".join(traceback.format_exception(error)))


def begun[T](second: "SecondProcess", work: Callable[..., T], *arguments: object) -> Callable[[], T | Failure]:
    """Begin guarded work beside; where the second process is dead, it is done here when it is asked for."""
    from concurrent.futures import BrokenExecutor

    try:
        return second.begin(guarded, work, *arguments)
    except BrokenExecutor:
        return partial(guarded, work, *arguments)


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
        self,
        chapter: str,
        what: str,
        work: Callable[[], T | Failure],
        otherwise: D,
        passing: tuple[type[Exception], ...] = (),
    ) -> T | D:
        """Do some work, and keep its result or its failure."""
        return self.keep(chapter, what, guarded(work, passing=passing), otherwise)

    def of(self, chapter: str) -> tuple[Callout, ...]:
        """Boxes for a chapter."""
        return tuple(one.callout() for one in self.found if one.chapter == chapter)
