"""`scruton init` against campaigns written by hand: which of their records it finds, of which kind, unit and window.

    python -m benchmarks.first_look FOLDER...   # folders with a campaign.toml; without any, the examples
    python -m benchmarks.first_look --foreign   # the folders of `benchmarks.foreign`

A record counts as right where `init`, which sees a copy of the folder without its campaign.toml, names the same channel
of the same file with the same kind and unit, and puts both edges of the window within 10 % of the length of the one
made by hand.  A sample rate that stands in the campaign but in none of its files is handed over, as a user is asked.
"""

import shutil
import sys
import tempfile
import tomllib
from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.foreign import make
from scruton.app.init import run
from scruton.campaign.files import Files
from scruton.campaign.readers import CsvDialect, is_delimited

ACCELERATIONS = ("acceleration", "angular_acceleration")
FOREIGN = "--foreign"
WITHIN = 0.1  # of the window's length
EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


class Score(NamedTuple):
    """Records made by hand, those that were found right, what was wrong with the others, and how many are beside."""

    records: int
    right: int
    wrong: tuple[str, ...]
    beside: int


class Mark(NamedTuple):
    file: str
    channel: str
    kind: str
    unit: str
    start: float
    stop: float


def marks(folder: Path, campaign: dict[str, Any]) -> Iterator[Mark]:
    """Every record of a campaign.toml, its defaults spelt out, read through the readers themselves."""
    quantity = "rotation" if campaign["section"]["motion"] == "torsional" else "displacement"
    usual = campaign.get("defaults", {}).get("records", {})
    files = Files(folder)
    for owner in [*campaign["rigs"], *campaign.get("tests", [])]:
        for own in owner.get("records", []):
            table = {**usual, **own}
            dialect = {key: table[key] for key in ("skip_rows", "delimiter", "decimal", "encoding") if key in table}
            path = folder / table["file"]
            container = files.open(path, CsvDialect(**dialect))
            named = table.get("columns" if is_delimited(path) else "variables", {})
            there = {name.lower(): name for name in container.names}
            what = next((one for one in (quantity, *ACCELERATIONS) if one in {**named, **there}), quantity)
            channel = named.get(what, there.get(what))
            (column,) = container.read([channel])
            time = named.get("time", there.get("time"))
            if time is not None:
                (clock,) = container.read([time])
                first, last = float(clock.values[0]), float(clock.values[-1])
            else:
                step = 1.0 / float(table.get("sample_rate", "1 Hz").split()[0])
                first, last = 0.0, step * (len(column.values) - 1)
            unit = table.get("units", {}).get(what, column.unit)
            edges = (_seconds(table.get("start"), first), _seconds(table.get("stop"), last))
            yield Mark(table["file"], str(channel), table["kind"], str(unit), *edges)


def _seconds(value: str | None, usual: float) -> float:
    return usual if value is None else float(value.split()[0])


def score(folder: Path) -> Score:
    """Score one folder; InputError where `init` finds nothing in it."""
    by_hand = tomllib.loads((folder / "campaign.toml").read_text(encoding="utf-8"))
    rates = {one.get("sample_rate") for owner in [*by_hand["rigs"], *by_hand.get("tests", [])]
             for one in owner.get("records", [])} - {None}  # fmt: skip
    wanted = list(marks(folder, by_hand))
    with tempfile.TemporaryDirectory() as place:
        copy = Path(place) / folder.name
        ignored = shutil.ignore_patterns("campaign.toml", "bridge.toml", "simulation.toml", "*.md", "*.py")
        shutil.copytree(folder, copy, ignore=ignored, copy_function=shutil.copyfile)
        copy.chmod(0o755)
        rate = rates.pop() if len(rates) == 1 else None
        run(Namespace(folder=copy, force=False, quiet=True, sample_rate=rate))
        found = list(marks(copy, tomllib.loads((copy / "campaign.toml").read_text(encoding="utf-8"))))
    left, wrong = list(found), []
    for mark in wanted:
        alike = [one for one in left if one[:2] == mark[:2]]
        near = min(alike, key=lambda one: abs(one.start - mark.start) + abs(one.stop - mark.stop), default=None)
        if near is None:
            wrong.append(f"{mark}: not found")
            continue
        left.remove(near)
        slack = WITHIN * (mark.stop - mark.start)
        good = near[:4] == mark[:4] and abs(near.start - mark.start) <= slack and abs(near.stop - mark.stop) <= slack
        if not good:
            wrong.append(f"{mark}: found {near}")
    return Score(len(wanted), len(wanted) - len(wrong), tuple(wrong), len(left))


def main(names: list[str]) -> None:
    """Print the score of every folder and of all."""
    total = right = 0
    place = tempfile.TemporaryDirectory()
    folders = sorted(path.parent for path in EXAMPLES.glob("*/campaign.toml")) if not names else list(map(Path, names))
    for folder in make(Path(place.name)) if names == [FOREIGN] else folders:
        result = score(folder)
        total, right = total + result.records, right + result.right
        print(f"{folder.name}: {result.right} of {result.records} right, {result.beside} beside")
        for text in result.wrong:
            print(f"    {text}")
    place.cleanup()
    print(f"all: {right} of {total} right, {right / total:.0%}")


if __name__ == "__main__":
    main(sys.argv[1:])
