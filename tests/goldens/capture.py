"""Commands in a room of their own, and what they print and write there."""

import contextlib
import csv
import io
import json
import os
import re
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np

from tests.goldens.leaves import rounded, summary
from tests.goldens.masks import KEYS, PLACEHOLDER, ROWS, mask, masked

ROOT = Path(__file__).resolve().parents[2]
INPUTS = Path(__file__).with_name("inputs")
SEED = "1"
CAMPAIGNS = (
    "rectangle-4to1",
    "closed-box-heaving",
    "closed-box-torsional",
    "double-girder-torsional",
    "pylon",
    "pylon-torsional",
)


@dataclass(frozen=True)
class Room:
    """A folder with copies of what the commands read, which is the working folder while they run."""

    folder: Path

    def bring(self, *names: str) -> None:
        """Copy campaigns of the examples, or inputs of the goldens."""
        for name in names:
            source = ROOT / "examples" / name if name in CAMPAIGNS else INPUTS / name
            if source.is_dir():
                shutil.copytree(source, self.folder / name, dirs_exist_ok=True)
            else:
                shutil.copyfile(source, self.folder / name)

    def run(self, *argv: str) -> dict[str, Any]:
        """Run a command; its exit code, what it prints, and its last words on standard error."""
        from scruton.cli import main

        out, err = io.StringIO(), io.StringIO()
        with working(self.folder), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                code = main(list(argv))
            except SystemExit as end:  # of argparse
                code = end.code if isinstance(end.code, int) else 2
        found = {"command": " ".join(argv), "code": code, "stdout": mask(out.getvalue(), str(self.folder))}
        # Bars of progress are no part of what is promised; they end in a carriage return or an escape.
        said = [
            one for one in re.split(r"[\r\n]+", err.getvalue()) if one.strip() and "it/s" not in one and "|" not in one
        ]
        return found | {"stderr": mask("\n".join(said), str(self.folder))}

    def fitted(self, name: str, *options: str, out: str = "fit") -> dict[str, Any]:
        """Fit a campaign of the room."""
        return self.run("fit", name, "--seed", SEED, "-o", out, *options)

    def files(self, folder: str) -> dict[str, Any]:
        """Return the content of everything readable in a folder of results, and the names of the rest."""
        base = self.folder / folder
        paths = sorted(p for p in base.rglob("*") if p.is_file() and ".scruton" not in p.relative_to(base).parts)
        return {p.relative_to(base).as_posix(): content(p, str(self.folder)) for p in paths}


@contextlib.contextmanager
def working(folder: Path) -> Iterator[None]:
    """Work in a folder, in a terminal of 80 columns."""
    before, columns = Path.cwd(), os.environ.get("COLUMNS")
    os.environ["COLUMNS"] = "80"
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)
        if columns is None:
            del os.environ["COLUMNS"]
        else:
            os.environ["COLUMNS"] = columns


def content(path: Path, room: str) -> Any:
    """What is kept of a file."""
    if path.suffix == ".json":
        return masked(json.loads(path.read_text(encoding="utf-8")), room)
    if path.suffix == ".csv":
        return table(path)
    if path.suffix in (".txt", ".md", ".toml"):
        return mask(path.read_text(encoding="utf-8"), room)
    if path.suffix == ".html":
        return mask(visible(path.read_text(encoding="utf-8")), room)
    return schema(path) if path.suffix == ".nc" else "a file"


def table(path: Path) -> dict[str, Any]:
    """Header of a CSV, and a summary of each column: as numbers, or else its cells."""
    with path.open(encoding="utf-8", newline="") as file:
        header, *rows = list(csv.reader(file)) or [[]]
    rows = [row for row in rows if not ROWS.match(row[0])]
    found: dict[str, Any] = {"rows": len(rows)}
    for name, *cells in zip(header, *rows, strict=True):
        try:
            found[name] = (
                PLACEHOLDER
                if KEYS.match(name)
                else summary(np.array([float(one or "nan") for one in cells]), (len(cells),))
            )
        except ValueError:
            found[name] = sorted(set(cells))
    return found


def schema(path: Path) -> dict[str, Any]:
    """Groups, variables, dimensions, types and names of attributes of a DataTree, and the mean of each variable."""
    import xarray as xr

    found: dict[str, Any] = {}
    with xr.open_datatree(path, engine="netcdf4") as tree:
        for group in tree.subtree:
            data = group.to_dataset(inherit=False)
            found[group.path] = {"attributes": sorted(data.attrs)} | {
                str(name): variable(one) for name, one in sorted(data.variables.items())
            }
    return found


def variable(one: Any) -> dict[str, Any]:
    """What is kept of a variable."""
    kept = {"dims": list(one.dims), "dtype": str(one.dtype), "shape": list(one.shape), "attributes": sorted(one.attrs)}
    if one.dtype.kind in "fiu" and one.size:
        values = np.asarray(one.values, dtype=float)
        finite = values[np.isfinite(values)]
        if finite.size:
            kept["mean"] = rounded(float(finite.mean()))
    return kept


class _Visible(HTMLParser):
    """Text of a page that a reader sees."""

    HIDDEN = ("script", "style", "svg", "template", "title")

    def __init__(self) -> None:
        super().__init__()
        self.depth, self.parts = 0, [""]

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.depth += tag in self.HIDDEN

    def handle_endtag(self, tag: str) -> None:
        self.depth -= tag in self.HIDDEN

    def handle_data(self, data: str) -> None:
        if not self.depth and data.strip():
            self.parts.append(" ".join(data.split()))


def visible(page: str) -> str:
    """Strip the tags of a page."""
    reader = _Visible()
    reader.feed(page)
    return "\n".join(reader.parts[1:])
