"""The results of a fit on disk: posterior.nc and fit.json."""

import gc
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.documents import read_document, replace_file, write_document
from scruton.errors import InputError
from scruton.workspace import digest

if TYPE_CHECKING:
    import xarray as xr

    from scruton.infer.results import Fit

POSTERIOR, SUMMARY, FORMAT = "posterior.nc", "fit.json", 1
# What every reader of fit.json may rely on.
FIELDS = (
    "format", "title", "converged", "flags", "laws", "campaign", "amplitude_unit", "tests", "rigs", "records",
    "provenance", "files",
)  # fmt: skip
_WRITING = threading.Lock()
WANTED = "the folder of a complete fit, as `scruton fit` or `scruton report` wrote it"


def write_fit(fit: "Fit", folder: Path) -> tuple[Path, Path]:
    """Write posterior.nc and fit.json, each in one atomic step.

    Returns
    -------
    paths : (Path, Path)
    """
    folder.mkdir(parents=True, exist_ok=True)
    posterior, summary = folder / POSTERIOR, folder / SUMMARY
    temporary = folder / f"{POSTERIOR}.tmp"
    with _no_collection():
        fit.tree.to_netcdf(temporary, engine="h5netcdf")
    replace_file(temporary, posterior)
    write_document(summary, {**fit.summary, "files": {POSTERIOR: digest(posterior)}})
    return posterior, summary


@contextmanager
def _no_collection() -> Iterator[None]:
    """Keep the cyclic collector still: HDF5 objects that it closes midway change where the next ones lie.

    One thread at a time: the collector is the process's, and the first that is through would let it loose on the rest.
    """
    with _WRITING:
        was = gc.isenabled()
        gc.collect()
        gc.disable()
        try:
            yield
        finally:
            if was:
                gc.enable()


def read_tree(folder: Path) -> tuple["xr.DataTree", dict[str, Any]]:
    """Read what `write_fit` wrote: the tree and the summary.

    Raises
    ------
    InputError
        If the folder holds no fit, one of another version, or files that are damaged or do not belong together.
    """
    import xarray as xr

    posterior, summary = folder / POSTERIOR, folder / SUMMARY
    for path in (posterior, summary):
        if not path.is_file():
            raise InputError(path, "", "no such file", "a folder that `scruton fit` or `scruton report` wrote")
    content = read_document(summary, WANTED, FIELDS, version=FORMAT)
    if content["files"].get(POSTERIOR) != digest(posterior):
        wanted = f"the file that {SUMMARY} was written with; `scruton fit` writes both anew"
        raise InputError(posterior, "", "a file that is damaged or of another fit", wanted)
    try:
        return xr.load_datatree(posterior, engine="h5netcdf"), content
    except (OSError, ValueError, KeyError) as error:
        raise InputError(posterior, "", f"a file that cannot be read ({error})", WANTED) from error


def provenance_of(folder: Path, summary: Mapping[str, Any]) -> dict[str, str]:
    """SHA-256 of the two files of a fit that was read, by name: what is computed from them carries these."""
    return {SUMMARY: digest(folder / SUMMARY), POSTERIOR: summary["files"][POSTERIOR]}
