"""The folder of a calibration: one line a campaign as it is done, so that an interrupted run loses none."""

import json
import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from scruton.errors import InputError

SETTINGS, LINES = "settings.json", "campaigns"
TABLES = ("calibration.json", "calibration.txt", "coverage.csv", "pooled.csv", "ranks.csv", "identifiability.csv",
          "laws.csv", "regimes.csv")  # fmt: skip
FIGURES = "figures"
RESULTS = (SETTINGS, LINES, *TABLES, FIGURES)


def claim(folder: Path, settings: Mapping[str, Any], *, force: bool, resume: bool) -> None:
    """Make sure that this run may write into a folder.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    settings : mapping
        What every campaign's numbers depend on.
    force : bool
        Remove the calibration that lies there; other files stay.
    resume : bool
        Keep the campaigns that lie there.

    Raises
    ------
    InputError
        If a calibration lies there and neither was asked for, or one of other settings is to be resumed.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(folder, "-o", "a file", "the path of a folder for the results")
    found = [name for name in RESULTS if (folder / name).exists()]
    if found and not (force or resume):
        raise InputError(
            folder, "-o", f"results of an earlier run ({', '.join(found)})",
            "an empty folder, --resume to go on with that run, or --force to replace it",
        )  # fmt: skip
    if found and force and not resume:
        for name in found:
            path = folder / name
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink()
    wanted = json.loads(json.dumps(settings))
    path = folder / SETTINGS
    if path.exists():
        earlier = _read_settings(path)
        differ = [key for key in wanted if earlier.get(key) != wanted[key]]
        if differ:
            raise InputError(
                path, differ[0], repr(earlier.get(differ[0])),
                f"{wanted[differ[0]]!r} as asked for now: a run is resumed with its own settings",
            )  # fmt: skip
    (folder / LINES).mkdir(parents=True, exist_ok=True)
    write(path, json.dumps(settings, indent=2, sort_keys=True) + "\n")


def load(folder: Path, regime: str) -> dict[int, dict[str, Any]]:
    """Campaigns of a regime that are done, by index; a last line that was cut off while writing is removed."""
    path = folder / LINES / f"{regime}.jsonl"
    if not path.exists():
        return {}
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines(keepends=True)
    if lines and not lines[-1].endswith("\n"):
        write(path, "".join(lines[:-1]))
        lines = lines[:-1]
    try:
        return {one["index"]: one for one in map(json.loads, lines)}
    except (json.JSONDecodeError, KeyError, TypeError) as error:
        raise InputError(path, "", f"a line that cannot be read ({error})", "one JSON object a line") from error


def append(folder: Path, record: Mapping[str, Any]) -> None:
    """Add a campaign to its regime's file."""
    with (folder / LINES / f"{record['regime']}.jsonl").open("a", encoding="utf-8", newline="\n") as file:
        file.write(json.dumps(record) + "\n")


def write(path: Path, text: str) -> None:
    """Write a file in one step."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + ".tmp")
    temporary.write_text(text, encoding="utf-8", newline="\n")
    os.replace(temporary, path)  # noqa: PTH105


def _read_settings(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except json.JSONDecodeError as error:
        raise InputError(path, "", f"no valid JSON ({error})", "the settings of the run to resume") from error
    return found if isinstance(found, dict) else {}
