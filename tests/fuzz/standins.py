"""Stand-ins for what would take minutes: a command ends where it gets there, as accepted."""

import contextlib
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from pkgutil import resolve_name
from unittest import mock


class NoPool:
    """Stands for a pool of processes that never gets to anything."""

    def __init__(self, *_: object, **__: object) -> None: ...

    def submit(self, *_: object) -> Future[None]:
        """Give what is never done."""
        return Future()

    def shutdown(self, **_: object) -> None:
        """Leave nothing behind."""


def _stop(*_: object, **__: object) -> None:
    raise SystemExit(0)


REPLACED: dict[str, Callable[..., object] | type] = {
    "stop": _stop,
    "skip": lambda *_, **__: None,
    "null": lambda *_, **__: contextlib.nullcontext(),
    "no-pool": NoPool,
}


@contextlib.contextmanager
def stopped(stops: tuple[str, ...]) -> Iterator[None]:
    """Replace functions: "package.module.function", or "...=skip" and the like for other stand-ins."""
    with contextlib.ExitStack() as stack:
        for one in stops:
            target, _, what = one.partition("=")
            parent, _, name = target.rpartition(".")
            stack.enter_context(mock.patch.object(resolve_name(parent), name, REPLACED[what or "stop"]))
        yield
