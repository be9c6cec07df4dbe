"""What libraries take and no command has a use for: half a second of imports, a second thread for small matrices."""

import os
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from types import ModuleType

# Who asks for what; each takes an ImportError for an answer.
SPARED = {
    "emcee.moves.kde": ("scipy.stats",),  # a move that is never made
    "emcee.backends.hdf": ("h5py",),  # a file for chains that is never written
    "xarray.namedarray.pycompat": ("cupy", "pint", "sparse"),  # kinds of arrays that no result has
}
# Every library of linear algebra asks for its own.  What waits beside a matrix of 20 rows burns as much as works on it,
# sums in another order give other last digits, and `--jobs` is what uses more cores.
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
DASK = "dask"  # xarray asks for it in many places, of arrays that are none of its kind


class _Sparing:
    """A finder that finds nothing, and says so where one of `SPARED` asks: whoever else does is served as ever."""

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> ModuleSpec | None:
        frame = sys._getframe(1)
        while frame.f_back and frame.f_globals.get("__name__", "").startswith("importlib"):
            frame = frame.f_back
        if name in SPARED.get(frame.f_globals.get("__name__", ""), ()):
            raise ModuleNotFoundError(f"{name} is spared", name=name)
        return None


def spare() -> None:
    """Import nothing of `SPARED` from now on, nor Dask before somebody says `serve_dask`; linear algebra in one thread.

    For a process of the program's own: in somebody else's Python what is asked for first would decide what works.
    """
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    if _Sparing not in sys.meta_path:
        sys.meta_path.insert(0, _Sparing)
        sys.modules.setdefault(DASK, None)  # type: ignore[arg-type]  # what Python holds for a module that is not there


def serve_dask() -> None:
    """Let Dask be imported again."""
    if sys.modules.get(DASK, sys) is None:
        del sys.modules[DASK]
