"""Reader of VIVyD's data sets (.vxp): arrays of zarr in a zip, and a tree of names in JSON; through zarr, an extra."""

import io
import json
import re
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scruton.campaign.readers.columns import Clock, Column, Container, check_claim, element, optional, parse_path
from scruton.campaign.spelling import nearest
from scruton.campaign.thresholds import JITTER

_NAME = re.compile(r"(?P<path>.*?)(?P<time>\.time)?(?P<index>\[[^\[\]]*\])?")


@dataclass(frozen=True, eq=False)
class Vxp(Container):
    """Signals and values by "study/experiment/bundle/source/signal", or the end of it that no other has.

    The times of a signal go by its path with ".time" behind; where they are even, they are its clock.
    """

    leaves: Mapping[str, Mapping[str, Any]]
    archive: zipfile.ZipFile

    def column(self, name: str) -> Column:
        """Read a signal, its times, or a single value."""
        match = _NAME.fullmatch(name.strip())
        assert match is not None  # it may be empty
        leaf = self._leaf(name, match["path"])
        unit = str(leaf.get("units") or "").strip()
        unit = "" if unit == "dimensionless" else unit
        if leaf.get("type") == "Value":
            return Column(name, self.vector(name, np.asarray(leaf["data"])), unit)
        times = self.vector(name, self._array(leaf, "time_ref", name))
        if match["time"]:
            return Column(name, times, "s")
        data = self._array(leaf, "data_ref", name)
        if match["index"]:
            (_, (index,)) = parse_path(f"y{match['index']}", self.path)
            data = element(data, index, self.path, name)  # type: ignore[arg-type]
        steps = np.diff(times)
        usual = float(np.median(steps)) if steps.size else 0.0
        even = usual > 0.0 and float(np.max(np.abs(steps - usual))) <= JITTER * usual
        clock = Clock(float(times[0]), float(times[-1] - times[0]) / steps.size) if even else None
        return Column(name, self.vector(name, data), unit, clock=clock)

    def _leaf(self, name: str, path: str) -> Mapping[str, Any]:
        alike = [key for key in self.leaves if key == path or key.endswith(f"/{path}")]
        alike = [key for key in alike if key == path] or alike
        if len(alike) != 1:
            what = f"{len(alike)} signals whose path ends so" if alike else "no such signal or value"
            raise self.error(name, what, nearest(path, alike or self.leaves))
        return self.leaves[alike[0]]

    def _array(self, leaf: Mapping[str, Any], key: str, name: str) -> Any:
        """Read an array, once it is known to be no larger than its bytes can hold."""
        import zarr
        from zarr.core.buffer.cpu import Buffer
        from zarr.storage import MemoryStore

        place = f"{leaf[key]}/"
        entries = {entry.filename: entry for entry in self.archive.infolist() if entry.filename.startswith(place)}
        for entry in entries.values():
            check_claim(entry.file_size, entry.compress_size, self.path, name)
        stored = {file.removeprefix(place): self.archive.read(entry) for file, entry in entries.items()}
        array = zarr.open_array(MemoryStore({file: Buffer.from_bytes(data) for file, data in stored.items()}), mode="r")
        check_claim(array.nbytes, sum(map(len, stored.values())), self.path, name)
        return np.asarray(array[...])


def _leaves(node: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Signals and values below a node of the tree, with the names on the way to them."""
    for child in node.get("contents", ()):
        below = (*path, str(child["name"]))
        if child.get("type") in ("Signal", "Value"):
            yield "/".join(below), child
        else:
            yield from _leaves(child, below)


def open_vxp(data: bytes, path: Path) -> Vxp:
    """Open a data set (InputError where zarr is not installed)."""
    with optional("zarr", "vivyd", path, "a data set of VIVyD"):
        import zarr  # noqa: F401
    archive = zipfile.ZipFile(io.BytesIO(data))
    entry = archive.getinfo("zarr.json")
    check_claim(entry.file_size, entry.compress_size, path, "zarr.json")
    leaves = dict(_leaves(json.loads(json.loads(archive.read(entry))["attributes"]["_metadata"]), ()))
    return Vxp(path, tuple(leaves), leaves, archive)
