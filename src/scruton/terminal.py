"""The terminal: what is printed cannot command it, and what the system refuses is said in a line, never a traceback."""

import argparse
import os
import re
import shutil
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from difflib import get_close_matches
from typing import Any, NoReturn, TextIO, cast

from scruton.errors import InputError

DONE, NOT_TRUSTED, BAD_INPUT, INTERRUPTED, TERMINATED = 0, 1, 2, 130, 143

NARROWEST = 40  # letters of a line: below it the terminal breaks what it cannot hold

# C0 but for tab and line feed, DEL, C1, and what turns the direction of writing.
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]")


def harmless(text: str) -> str:
    r"""Show control characters as escapes: a name of a file or a test may hold the commands of a terminal.

    >>> harmless("\x1b[31mred")
    '\\x1b[31mred'
    """
    return _CONTROL.sub(lambda match: match[0].encode("unicode_escape").decode(), text)


def line_width() -> int | None:
    """Letters of a line of the terminal, or what COLUMNS says; None where the output goes into a file or a pipe."""
    if not os.environ.get("COLUMNS", "").isdecimal() and not (sys.stdout is not None and sys.stdout.isatty()):
        return None
    return max(shutil.get_terminal_size().columns, NARROWEST)


class Harmless:
    """A text stream that escapes control characters; a carriage return in front moves the bar of progress.

    What it could not write is said again by `flush`: argparse, for one, does not listen the first time.
    """

    def __init__(self, stream: TextIO, name: str) -> None:
        self._stream, self._name = stream, name
        self._error: OSError | None = None

    def write(self, text: str) -> int:
        """Write a text."""
        front = "\r" if text.startswith("\r") else ""
        with self._named():
            return self._stream.write(front + harmless(text.removeprefix(front)))

    def flush(self) -> None:
        """Write what is kept back (OSError where that, or anything before, cannot be written)."""
        with self._named():
            self._stream.flush()
        if self._error is not None:
            raise self._error

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Errors of the system name the stream."""
        try:
            yield
        except OSError as error:
            error.filename, self._error = self._name, error
            raise

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def harmless_streams() -> Iterator[None]:
    """Print through `Harmless` streams, which show what the terminal's encoding lacks as escapes, too."""
    streams = sys.stdout, sys.stderr
    for stream in streams:
        with suppress(AttributeError, ValueError, OSError):
            cast(Any, stream).reconfigure(errors="backslashreplace")
    sys.stdout, sys.stderr = (
        stream if stream is None else cast(TextIO, Harmless(stream, name))  # None: closed by whoever called
        for stream, name in zip(streams, ("standard output", "standard error"), strict=True)
    )
    try:
        yield
    finally:
        sys.stdout, sys.stderr = streams


class Terminated(KeyboardInterrupt):
    """SIGTERM, which ends a run in the same good order as an interrupt from the keyboard."""


@contextmanager
def at_sigterm(do: Callable[..., None]) -> Iterator[None]:
    """Let SIGTERM call a function; in another thread than the main one, which alone may ask for it, nothing changes."""
    try:
        before = signal.signal(signal.SIGTERM, do)
    except ValueError:
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def terminating() -> Iterator[None]:
    """Let SIGTERM raise `Terminated`, so that processes beside are ended, too."""

    def end(*_: object) -> None:
        raise Terminated

    with at_sigterm(end):
        yield


def guarded(run: Callable[[], int]) -> int:
    """Run a command; its exit code, with one line on standard error where it failed through its input or the system.

    Errors of the program itself stay tracebacks.
    """
    try:
        try:
            with terminating():
                return run()
        finally:  # after --help, too
            if sys.stdout is not None:
                sys.stdout.flush()
    except InputError as error:
        _say(str(error))
    except KeyboardInterrupt as error:
        _say("interrupted. What was done is kept: the same command with --resume goes on.", "\n")
        return TERMINATED if isinstance(error, Terminated) else INTERRUPTED
    except BrokenPipeError:
        _silence()
        return DONE
    except OSError as error:
        place = error.filename if error.filename is not None else "the system"
        reason = error.strerror or str(error) or type(error).__name__
        _say(str(InputError(str(place), "", f"an error ({reason})", "a place that can be read and written")))
        _silence()
    except MemoryError:
        _say("found too little memory; wanted less data, or a larger machine.")
    except RecursionError:
        _say("found input that is nested too deeply; wanted fewer levels.")
    return BAD_INPUT


def _say(text: str, before: str = "") -> None:
    with suppress(OSError):
        print(f"{before}scruton: {text}", file=sys.stderr)


def _silence() -> None:
    """Let what is left in the buffer go nowhere: the interpreter would complain of it on its way out."""
    if sys.stdout is None:
        return
    try:
        sys.stdout.flush()
    except OSError:
        with suppress(OSError, ValueError), open(os.devnull, "w") as nowhere:  # noqa: PTH123
            os.dup2(nowhere.fileno(), sys.stdout.fileno())


class Parser(argparse.ArgumentParser):
    """A parser that knows what a misspelt word was meant to be."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Refuse what is left over here, where the options are known, and not above."""
        found, left = super().parse_known_args(args, namespace)
        if left:
            self.error(f"unrecognized arguments: {' '.join(left)}")
        return found, left

    def error(self, message: str) -> NoReturn:
        """Say what is wrong and end with exit code 2."""
        wrong = re.search(r"invalid choice: '([^']*)'|unrecognized arguments: ([^\s=]+)", message)
        word = (wrong[1] or wrong[2]) if wrong else ""
        bare = {one.lstrip("-"): one for one in self._words() if one.startswith("-") == word.startswith("-")}
        near = [bare[one] for one in get_close_matches(word.lstrip("-"), bare, n=1)]
        super().error(f'{message}; did you mean "{near[0]}"?' if near else message)

    def _words(self) -> set[str]:
        """Every verb, choice and option of this parser that its help shows."""
        shown = [action for action in self._actions if action.help != argparse.SUPPRESS]
        return {word for action in shown for word in (*action.option_strings, *map(str, action.choices or ()))}
