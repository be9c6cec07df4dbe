"""The results of a fit on disk: posterior.nc and fit.json."""

import gc
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from scruton.infer.results import Fit


def write_fit(fit: "Fit", folder: Path) -> tuple[Path, Path]:
    """Write posterior.nc and fit.json, each in one atomic step.

    Returns
    -------
    paths : (Path, Path)
    """
    folder.mkdir(parents=True, exist_ok=True)
    posterior, summary = folder / "posterior.nc", folder / "fit.json"
    temporary = folder / "posterior.nc.tmp"
    with _no_collection():
        fit.tree.to_netcdf(temporary, engine="h5netcdf")
    os.replace(temporary, posterior)  # noqa: PTH105
    write_json(summary, fit.summary)
    return posterior, summary


@contextmanager
def _no_collection() -> Iterator[None]:
    """Keep the cyclic collector still: HDF5 objects that it closes midway change where the next ones lie."""
    was = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def write_json(path: Path, content: Any) -> None:
    """Write JSON in one atomic step."""
    temporary = path.with_name(path.name + ".tmp")
    temporary.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    os.replace(temporary, path)  # noqa: PTH105


def read_tree(folder: Path) -> tuple["xr.DataTree", dict[str, Any]]:
    """Read what `write_fit` wrote: the tree and the summary.

    Raises
    ------
    InputError
        If the folder holds no fit.
    """
    import xarray as xr

    posterior, summary = folder / "posterior.nc", folder / "fit.json"
    for path in (posterior, summary):
        if not path.is_file():
            raise InputError(path, "", "no such file", "a folder that `scruton fit` or `scruton report` wrote")
    try:
        tree = xr.load_datatree(posterior, engine="h5netcdf")
        content: dict[str, Any] = json.loads(summary.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(
            folder, "", f"results that cannot be read ({error})", "the folder of a complete fit"
        ) from error
    return tree, content
