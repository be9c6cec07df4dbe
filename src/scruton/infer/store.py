"""The results of a fit on disk, posterior.nc and fit.json, and back."""

import json
import threading
from collections.abc import Mapping
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.bounded import relative_to
from scruton.documents import from_json, read_document, replace_file, write_document, written_to
from scruton.errors import InputError
from scruton.infer.result_schema import SCHEMA, faults
from scruton.workspace import digest

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from scruton.campaign.schema import Campaign
    from scruton.infer.cards import ModelCard
    from scruton.infer.results import Fit

POSTERIOR, SUMMARY, FORMAT = "posterior.nc", "fit.json", 1
# What every reader of fit.json may rely on.
FIELDS = (
    "format", "title", "converged", "flags", "laws", "campaign", "amplitude_unit", "tests", "rigs", "records",
    "provenance", "files",
)  # fmt: skip
_NETCDF = threading.Lock()  # the library in C knows no threads
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
    with written_to(posterior, temporary):
        with _NETCDF:
            try:
                _write_tree(fit.tree, temporary)
            except RuntimeError as error:  # the library's "HDF error": a disk that is full, mostly
                raise OSError(None, f"{error}; a full disk?", str(posterior)) from error
        replace_file(temporary, posterior)
    write_document(summary, {**fit.summary, "files": {POSTERIOR: digest(posterior)}})
    return posterior, summary


class _Writes:
    """What a tree's variables hold, kept until all of them are defined; as xarray takes a writer."""

    def __init__(self) -> None:
        self.waiting: list[tuple[Any, Any, Any]] = []

    def add(self, source: Any, target: Any, region: Any = None) -> None:
        self.waiting.append((source, target, ... if region is None else region))

    def write(self) -> None:
        for source, target, region in self.waiting:
            target[region] = source


def _write_tree(tree: "xr.DataTree", path: Path) -> None:
    """As `xarray.DataTree.to_netcdf`, in a third of the time.

    That defines a variable, writes it, and defines the next; and with every write that follows a definition the library
    in C writes down anew all that was defined.
    """
    from xarray.backends import NetCDF4DataStore

    # Without a lock of xarray's, which in a worker of Dask's is one of the scheduler's, by a client of its own.
    root = NetCDF4DataStore.open(path, mode="w", lock=False)  # type: ignore[no-untyped-call]
    writes = _Writes()
    try:
        for node in tree.subtree:
            group = root if node is tree else root.get_child_store(node.path)
            node.to_dataset(inherit=False).dump_to_store(group, writer=writes)
        writes.write()
    finally:
        root.close()


def read_tree(folder: Path) -> tuple["xr.DataTree", dict[str, Any]]:
    """Read what `write_fit` wrote: the tree and the summary.

    Raises
    ------
    InputError
        If the folder holds no fit, one of another version, or files that are damaged or do not belong together.
    """
    import xarray as xr

    posterior, content = _summary(folder)
    try:
        with _NETCDF:
            tree = xr.load_datatree(posterior, engine="netcdf4")
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        raise _unusable(posterior, f"a file that cannot be read ({error})") from error
    wrong = faults(tree)
    if wrong:
        raise _unusable(posterior, f"results of another layout: {wrong[0]}")
    return tree, content


def read_draws(folder: Path) -> tuple["xr.DataTree", dict[str, Any]]:
    """As `read_tree`, but groups and variables are read, and their layout is checked, when they are asked for.

    What stands for the tree has that part of its interface which `scruton.infer.stored` has, enough for a prediction;
    a fit of one rig, whose prediction changes draws, is read whole.
    """
    from scruton.infer.stored import Stored

    posterior, content = _summary(folder)
    draws = Stored(posterior, partial(_unusable, posterior))
    if "campaign_posterior" in draws and draws["campaign_posterior"].sizes.get("peak_test") == 1:
        return read_tree(folder)
    return cast("xr.DataTree", draws), content


def _summary(folder: Path) -> tuple[Path, dict[str, Any]]:
    """Path of posterior.nc and what fit.json holds, once it is clear that they belong together."""
    posterior, summary = folder / POSTERIOR, folder / SUMMARY
    for path in (posterior, summary):
        if not path.is_file():
            raise InputError(path, "", "no such file", "a folder that `scruton fit` or `scruton report` wrote")
    content = read_document(summary, WANTED, FIELDS, version=FORMAT)
    if content["files"].get(POSTERIOR) != digest(posterior):
        wanted = f"the file that {SUMMARY} was written with; `scruton fit` writes both anew"
        raise InputError(posterior, "", "a file that is damaged or of another fit", wanted)
    return posterior, content


def _unusable(posterior: Path, found: str) -> InputError:
    return InputError(posterior, "", found, WANTED)


def load_fit(folder: Path | str) -> "Fit":
    """Read back the fit that `write_fit` wrote: the same tree, tables and verdicts, campaign and model card.

    Envelopes, ring-downs and the deterministic results of Eqs. (2) to (8) are computed from the campaign that is
    stored with the draws, when they are asked for.  The laboratory's files are not read again.

    Parameters
    ----------
    folder : Path or str
        As `scruton fit` or `scruton report` wrote it.

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        If the folder holds no fit, one of another version, or files that are damaged or do not belong together.
    """
    from scruton.infer.front import cycles_of, front_ends_of, ringdowns_of
    from scruton.infer.results import Fit

    folder = Path(folder)
    tree, summary = read_tree(folder)
    campaign, card = stored_inputs(tree, folder / POSTERIOR)
    cycles = cycles_of(campaign, card.envelope_source)
    ringdowns = ringdowns_of(campaign, cycles)
    return Fit(
        campaign, card, tree, cycles, ringdowns, front_ends_of(campaign, tree, ringdowns), convergence_frame(tree),
        tuple(summary["flags"]), bool(summary["converged"]), summary,
    )  # fmt: skip


def pack(folder: Path, **values: Any) -> tuple[str, FloatArray]:
    """Turn dataclasses, by name, into a JSON text and the numbers of all their arrays, end to end, that it refers to.

    Paths are kept as they lie from `folder`: where that stood on some machine is nobody's business, and no result
    depends on it.
    """
    arrays = [np.empty(0)]

    def plain(value: Any) -> Any:
        if isinstance(value, Path):
            return relative_to(value, folder)
        if not isinstance(value, np.ndarray):
            return {field.name: getattr(value, field.name) for field in fields(value)}
        start = sum(map(len, arrays))
        arrays.append(np.asarray(value, dtype=np.float64).reshape(-1))
        return {"start": start, "shape": list(value.shape)}

    return json.dumps(values, ensure_ascii=False, default=plain), np.concatenate(arrays)


def unpack(document: str, numbers: FloatArray, **kinds: type) -> dict[str, Any]:
    """Read back what `pack` made, of the types given (KeyError, TypeError or ValueError if the document holds none)."""

    def read(entry: dict[str, Any]) -> Any:
        if entry.keys() == {"start", "shape"}:
            size = int(np.prod(entry["shape"]))
            return numbers[entry["start"] : entry["start"] + size].reshape(entry["shape"])
        return {key: value for key, value in entry.items() if value is not None}

    content = json.loads(document, object_hook=read)
    return {name: from_json(kind, content[name]) for name, kind in kinds.items()}


def stored_inputs(tree: "xr.DataTree", path: Path = Path(POSTERIOR)) -> "tuple[Campaign, ModelCard]":
    """The campaign and the resolved model card that a tree holds (InputError where an earlier version wrote it)."""
    from scruton.campaign.schema import Campaign
    from scruton.infer.cards import ModelCard

    try:
        group = tree["inputs"]
        document, numbers = str(group["document"].item()), group["numbers"].to_numpy()
        stored = unpack(document, numbers, campaign=Campaign, card=ModelCard)
    except (KeyError, TypeError, ValueError) as error:
        found = "results that do not hold the campaign and the card they were made of"
        raise InputError(path, "", found, WANTED) from error
    return stored["campaign"], stored["card"]


def convergence_frame(tree: "xr.DataTree") -> "pd.DataFrame":
    """One row per parameter of every posterior, indexed by (posterior, parameter)."""
    import pandas as pd

    columns = {column.name: tree["convergence"][column.name].to_numpy().tolist() for column in SCHEMA["convergence"]}
    return pd.DataFrame(columns).set_index(["posterior", "parameter"])


def sha256_in(folder: Path) -> dict[str, str]:
    """SHA-256 of the two files of a fit, by name, as `provenance_of` has them of one that was read; {} without one."""
    paths = [folder / SUMMARY, folder / POSTERIOR]
    return {path.name: digest(path) for path in paths} if all(path.is_file() for path in paths) else {}


def provenance_of(folder: Path, summary: Mapping[str, Any]) -> dict[str, str]:
    """SHA-256 of the two files of a fit that was read, by name: what is computed from them carries these."""
    return {SUMMARY: digest(folder / SUMMARY), POSTERIOR: summary["files"][POSTERIOR]}
