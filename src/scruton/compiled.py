"""Compiled kernels, kept on disk until a source changes that they are made of."""

from collections.abc import Callable
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numba

_SOURCES = Path(__file__).parent / "dynamics"
_STAMP = "kernels.sha256"


def njit(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """`numba.njit`, whose cache is emptied where another version of the kernels has filled it.

    Numba compiles a function anew when its own file has changed.  It does not look at what the function takes from
    other files, kernels and constants, so that after an update a filter could go on with the moments of before.
    """
    if function is None:
        return lambda function: njit(function, **options)
    kernel = numba.njit(**options)(function)
    if options.get("cache") and kernel is not function:  # as it is with NUMBA_DISABLE_JIT
        _drop_stale(Path(kernel.stats.cache_path))
    return kernel


@cache
def _drop_stale(folder: Path) -> None:
    stamp = folder / _STAMP
    if stamp.is_file() and stamp.read_text() == _digest():
        return
    for compiled in (*folder.glob("*.nbi"), *folder.glob("*.nbc")):
        compiled.unlink(missing_ok=True)
    stamp.write_text(_digest())


@cache
def _digest() -> str:
    """One number of all that kernels are made of."""
    digest = sha256()
    for source in sorted(_SOURCES.rglob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()
