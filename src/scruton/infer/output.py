"""Folders of results: refused where something lies in them already, unless the user says what to do with it."""

import shutil
from pathlib import Path

from scruton.errors import InputError

CHECKPOINTS = ".checkpoints"
RESULTS = (
    "posterior.nc",
    "fit.json",
    "report.html",
    "report.pdf",
    "report.json",
    "gap.json",
    "sizing.json",
    "figures",
    "tables",
    CHECKPOINTS,
)


def claim_folder(folder: Path, *, force: bool = False, resume: bool = False) -> None:
    """Make sure that results may be written into a folder.

    Parameters
    ----------
    folder : Path
        Need not exist.
    force : bool
        Remove the results that lie there; other files stay.
    resume : bool
        Keep what lies there: an interrupted run goes on from its checkpoints.

    Raises
    ------
    InputError
        If results lie there and neither was asked for, or the folder is a file.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(folder, "-o", "a file", "the path of a folder for the results")
    found = [name for name in RESULTS if (folder / name).exists()]
    if not found or resume:
        return
    if not force:
        hint = "--resume to go on with the interrupted run, " if CHECKPOINTS in found else ""
        raise InputError(
            folder, "-o", f"results of an earlier run ({', '.join(found)})",
            f"an empty folder, {hint}or --force to replace them",
        )  # fmt: skip
    for name in found:
        path = folder / name
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()
