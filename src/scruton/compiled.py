"""Compiled kernels, kept on disk until a source changes that they are made of."""

from collections.abc import Callable
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numba

_SHARED = Path(__file__).parent / "dynamics"  # what kernels of all folders are made of
_STAMP = "kernels.sha256"


def njit(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """`numba.njit`, whose cache is emptied where another version of the kernels has filled it.

    Numba compiles a function anew when its own file has changed.  It does not look at what the function takes from
    other files, kernels and constants, so that after an update a filter could go on with the moments of before.

    What a kernel calls that is more than a few lines is compiled into it by `forceinline`.  Left as a function it is,
    in the process that compiles both, the one that was compiled by itself, and in all that load them from disk the
    caller's own copy: numbers that differ in their last digit, and after a search posteriors that do.
    """
    if function is None:
        return lambda function: njit(function, **options)
    kernel = numba.njit(**options)(function)
    if options.get("cache") and kernel is not function:  # as it is with NUMBA_DISABLE_JIT
        _drop_stale(Path(kernel.stats.cache_path), Path(function.__code__.co_filename).parent)
    return kernel


@cache
def _drop_stale(kept: Path, sources: Path) -> None:
    """Empty the folder where what is compiled of a folder's sources is kept, if it is of others."""
    stamp, digest = kept / _STAMP, _digest(sources)
    if stamp.is_file() and stamp.read_text() == digest:
        return
    for compiled in (*kept.glob("*.nbi"), *kept.glob("*.nbc")):
        compiled.unlink(missing_ok=True)
    stamp.write_text(digest)


def _digest(folder: Path) -> str:
    """One number of all that kernels of a folder are made of."""
    digest = sha256()
    for source in sorted({*_SHARED.rglob("*.py"), *folder.glob("*.py")}):
        digest.update(source.read_bytes())
    return digest.hexdigest()
