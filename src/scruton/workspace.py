"""A folder that a command writes its results into: claimed, locked, written beside, swapped, known by a manifest.

Old results survive whatever happens until the new ones are whole.  Only files that the program wrote, and that nobody
changed since, are ever replaced or removed; any other file that lies in the way is kept under a name of its own.

    FOLDER/.scruton/lock             held while a command works in the folder
    FOLDER/.scruton/manifest.json    what the program wrote there, by run: inputs, settings, SHA-256 of every file
    FOLDER/.scruton/NAME/run.json    a run that is not finished: its inputs and settings, compared on every resume
    FOLDER/.scruton/NAME/checkpoints
    FOLDER/.scruton/NAME/new         results that are not whole yet
    FOLDER/.scruton/NAME/swap.json   they are whole: what is left to do is to put them in their places
"""

import contextlib
import errno
import json
import os
import shutil
import socket
from collections.abc import Mapping, Sequence
from hashlib import file_digest
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

from scruton.documents import read_document, replace_file, write_document
from scruton.errors import InputError

STATE, MANIFEST, LOCK, RUN, SWAP = ".scruton", "manifest.json", "lock", "run.json", "swap.json"
_NO_LOCKS = (errno.ENOLCK, errno.ENOTSUP, errno.ENOSYS)  # of a file system that has none
_SHOWN = 4  # results that an error names
_OWN = "the file as scruton wrote it; where it is lost, --force writes the results anew"


class Workspace:
    """One command's claim on a folder, from opening to publication.

    Parameters
    ----------
    folder : Path
        For the results; need not exist.
    name : str
        Of the run: runs of one name replace each other's results in the folder.
    inputs : mapping of str to str
        SHA-256 of every file that the results depend on, by the name that an error shows.
    settings : mapping
        What else they depend on (seed, options), as JSON can hold it.
    results : sequence of str
        Files or folders that say that results lie there, for folders without a manifest.
    force : bool
        Replace the results that lie there.
    resume : bool
        Go on with an interrupted run of the same inputs and settings.  With `force`, too: or else begin anew.
    grows : bool
        Results come one by one: a resumed run keeps those that are there, and may go on to more than it began with.

    Raises
    ------
    InputError
        On entering: the folder holds results or an interrupted run and nothing was said of them, the run to resume
        began with other inputs or settings, another command works in it, or nothing can be written there.
    """

    def __init__(
        self,
        folder: Path,
        name: str,
        *,
        inputs: Mapping[str, str],
        settings: Mapping[str, Any],
        results: Sequence[str] = (),
        force: bool = False,
        resume: bool = False,
        grows: bool = False,
    ) -> None:
        self.folder, self.name, self.results = folder, name, tuple(results)
        self.run: dict[str, Any] = {"inputs": dict(inputs), "settings": json.loads(json.dumps(dict(settings)))}
        self.force, self.resume, self.grows = force, resume, grows
        self.state = folder / STATE / name
        self.new, self.checkpoints = self.state / "new", self.state / "checkpoints"
        # State of an interrupted run that --force drops, kept until it is certain that the new run can do better.
        self._earlier = self.state.with_name(f"{name}.old")
        self.replacing = False  # old results lie there, which count for nothing
        self._made: list[Path] = []  # folders that were not there before
        self._begun = self._kept = False
        self._manifest: dict[str, Any] = {"runs": {}}  # as it lies in the folder: nobody else writes it meanwhile
        self._lock: IO[str] | None = None

    def __enter__(self) -> Self:
        try:
            self._open()
        except BaseException:
            self._close(undo=True)
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        # Bad input leaves everything as it was; whatever else ends a run leaves what --resume goes on with.
        self._close(undo=isinstance(error, InputError))

    def find(self, name: str) -> Path | None:
        """Where a result of this run lies by now: among the new ones, or in its place if that counts; else None."""
        paths = (self.new / name,) if self.replacing else (self.new / name, self.folder / name)
        return next((path for path in paths if path.exists()), None)

    def done(self, wanted: Sequence[str]) -> bool:
        """Whether the folder holds the whole results of this very run (InputError: of another), with what is wanted."""
        earlier = read_manifest(self.folder)["runs"].get(self.name)
        if earlier is None or self.state.exists():
            return False
        self._check_same(earlier)
        there = all((self.folder / name).is_file() for name in (*earlier["files"], *wanted))
        return there and set(wanted) <= set(earlier["files"])

    def keep(self, *names: str) -> None:
        """Put whole files or folders of `new` into their places, unless old results are to be replaced all at once."""
        if not self.replacing:
            self._kept = True
            _swap(self.folder, self.new, self._record(names))

    def publish(self) -> None:
        """Put the new results into their places, remove those of this run that they replace, forget the run's state."""
        swap = self._record()
        write_document(self.state / SWAP, swap)
        _swap(self.folder, self.new, swap)
        shutil.rmtree(self.state)
        self._begun = False
        shutil.rmtree(self._earlier, ignore_errors=True)

    def _open(self) -> None:
        _make(self.folder / STATE, self._made)
        self._lock = _locked(self.folder)
        for path in sorted((self.folder / STATE).glob(f"*/{SWAP}")):  # of a run that was killed in the midst of it
            _swap(self.folder, path.parent / "new", read_document(path, _OWN, ("files", "stale", "known", "manifest")))
            shutil.rmtree(path.parent)
        self._manifest = read_manifest(self.folder)
        finished = self._manifest["runs"].get(self.name)
        unfinished = read_document(self.state / RUN, _OWN) if (self.state / RUN).is_file() else None
        present = results_in(self.folder, self.name, self.results)
        begun = unfinished is not None and any(self.state.glob("*/*"))
        if (present or begun) and not self.force and not self.resume:  # nobody said what to do with it
            shown = ", ".join([*present[:_SHOWN], *(["..."] if len(present) > _SHOWN else [])])
            found = f"results of an earlier run ({shown})" if present else "what an interrupted run left"
            hint = "--resume to go on with that run, " if begun or self.grows else ""
            raise InputError(self.folder, "-o", found, f"an empty folder, {hint}or --force to replace it")
        if self.resume and unfinished is not None and not self._differing(unfinished):
            self.replacing = bool(unfinished["replacing"])
        else:
            if self.resume and not self.force and (unfinished is not None or present):
                self._check_same(unfinished or finished)
            else:
                self.replacing = bool(present)
            if self.state.exists():  # what an interrupted run left is kept aside until this one is whole
                shutil.rmtree(self._earlier, ignore_errors=True)
                os.replace(self.state, self._earlier)  # noqa: PTH105
            self.state.mkdir()
            self._begun = True
        if not self.grows:
            shutil.rmtree(self.new, ignore_errors=True)
        for path in self.new.rglob("*.tmp"):  # what a killed run left half-written
            path.unlink()
        self.new.mkdir(parents=True, exist_ok=True)
        self.checkpoints.mkdir(exist_ok=True)
        write_document(self.state / RUN, self.run | {"replacing": self.replacing})

    def _check_same(self, earlier: Mapping[str, Any] | None) -> None:
        """Refuse to resume another run."""
        wanted = "the same command and files as before, another folder, or --force to begin anew"
        if earlier is None:
            raise InputError(self.folder, "--resume", "results whose inputs are not on record", wanted)
        if differing := self._differing(earlier):
            raise InputError(self.folder, "--resume", f"a run with other {', '.join(differing)}", wanted)

    def _differing(self, earlier: Mapping[str, Any]) -> list[str]:
        """Names of the inputs and settings that this run and an earlier one both have, and that differ."""
        current, theirs = self.run["settings"], earlier["settings"]
        settings = [name for name in current if name in theirs and theirs[name] != current[name]]
        inputs = [name for name, value in self.run["inputs"].items() if earlier["inputs"].get(name, value) != value]
        return [*(f"{name} ({theirs[name]!r}, now {current[name]!r})" for name in settings), *inputs]

    def _record(self, part: Sequence[str] = ()) -> dict[str, Any]:
        """What a swap of all or of a part has to do: files with their digests, files to remove, and the manifest."""
        tops = [self.new / name for name in part or ("",)]
        paths = [path for top in tops for path in ([top] if top.is_file() else sorted(top.rglob("*")))]
        files = {path.relative_to(self.new).as_posix(): digest(path) for path in paths if path.is_file()}
        runs: dict[str, Any] = self._manifest["runs"]
        known = {name: value for run in runs.values() for name, value in run["files"].items()}
        before = runs.get(self.name, {"files": {}})["files"]
        stale = {} if part or not self.replacing else {k: v for k, v in before.items() if k not in files}
        kept = {name: value for name, value in before.items() if name not in stale}
        for other in runs.values():  # a file belongs to the run that wrote it last
            other["files"] = {name: value for name, value in other["files"].items() if name not in files}
        # What a resumed run is compared with stands in its state until it is whole.
        run = {"inputs": {}, "settings": {}} if part else self.run
        runs[self.name] = run | {"files": dict(sorted((kept | files).items()))}
        return {"files": files, "stale": stale, "known": known, "manifest": self._manifest}

    def _close(self, *, undo: bool) -> None:
        """Let go of the folder; with `undo`, or where there is nothing to go on with, leave it as it was found."""
        if self._lock is not None:
            undo = self._settle(undo=undo)
            self._lock.truncate(0)
            self._lock.close()
            self._lock = None
        if undo and self._made:
            with contextlib.suppress(OSError, ValueError):
                (self.folder / STATE / LOCK).unlink()
            for folder in reversed(self._made):
                with contextlib.suppress(OSError):
                    folder.rmdir()

    def _settle(self, *, undo: bool) -> bool:
        """Leave the state as a later run may find it; return whether nothing of this one is left."""
        if (self.state / SWAP).exists():  # the results are whole: whatever opens the folder next completes the swap
            return False
        undo = undo and not self._kept  # what lies in its place goes with the inputs that it was made from
        if not self.grows:
            shutil.rmtree(self.new, ignore_errors=True)
            undo = undo or (self._begun and not any(self.state.glob("*/*")))
        if undo and self._begun:
            shutil.rmtree(self.state, ignore_errors=True)
            if self._earlier.exists():
                os.replace(self._earlier, self.state)  # noqa: PTH105
        return undo


def digest(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as stream:
        return file_digest(stream, "sha256").hexdigest()


def read_manifest(folder: Path) -> dict[str, Any]:
    """What the program wrote into a folder: "runs", by name, each with its inputs, settings and files.

    Raises
    ------
    InputError
        If the manifest is damaged.
    """
    path = folder / STATE / MANIFEST
    return read_document(path, _OWN, ("runs",)) if path.is_file() else {"runs": {}}


def results_in(folder: Path, name: str, results: Sequence[str]) -> list[str]:
    """What says that results of a run lie in a folder: those of `results` that exist, and what its manifest names."""
    present = [file for file in results if (folder / file).exists()]
    files = read_manifest(folder)["runs"].get(name, {"files": {}})["files"]
    return [*present, *(file for file in files if file not in present and (folder / file).exists())]


def _make(folder: Path, made: list[Path]) -> None:
    """Make a folder and those above it, and note which were not there."""
    for path in reversed([folder, *folder.parents]):
        try:
            if path.is_dir():
                continue
            if path.exists():
                raise InputError(path, "-o", "a file", "the path of a folder for the results")
            path.mkdir()
            made.append(path)
        except InputError:
            raise
        except (OSError, ValueError) as error:  # ValueError: a path with a null character
            reason = getattr(error, "strerror", None) or error
            raise InputError(path, "-o", f"that it cannot be made ({reason})", "a folder that can be") from None


def _locked(folder: Path) -> IO[str]:
    """Lock a folder for as long as the file is open, however the process ends (InputError: another one holds it)."""
    path = folder / STATE / LOCK
    try:
        stream = path.open("a+", encoding="utf-8")
    except OSError as error:
        wanted = "a folder in which files can be made"
        raise InputError(folder, "-o", f"that nothing can be written there ({error.strerror})", wanted) from None
    try:
        _lock(stream)
    except OSError as error:
        if error.errno in _NO_LOCKS:
            return stream
        stream.seek(0)
        holder = stream.read(200).strip() or "another command"
        stream.close()
        wanted = "another folder, or to wait until that one has ended"
        raise InputError(folder, "-o", f"that {holder} is at work in it", wanted) from None
    stream.truncate(0)
    stream.write(f"process {os.getpid()} on {socket.gethostname()}")
    stream.flush()
    return stream


def _lock(stream: IO[str]) -> None:
    """Take the lock of an open file, or raise OSError at once."""
    try:
        import fcntl
    except ImportError:  # Windows
        import msvcrt

        stream.seek(0)
        msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
        return
    fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _swap(folder: Path, new: Path, swap: Mapping[str, Any]) -> None:
    """Move new files to their places and remove stale ones; may be done again from any point where it was stopped."""
    for name, checksum in swap["files"].items():
        source, place = new / name, folder / name
        if not source.exists():
            continue  # moved before it was stopped
        if place.exists() and digest(place) not in (swap["known"].get(name), checksum):
            # it is not the program's: kept under a free name
            spare = next(free for i in count(1) if not (free := place.with_name(f"{place.name}.~{i}~")).exists())
            os.replace(place, spare)  # noqa: PTH105
        place.parent.mkdir(parents=True, exist_ok=True)
        replace_file(source, place)
    for name, theirs in swap["stale"].items():
        place = folder / name
        if place.is_file() and digest(place) == theirs:
            place.unlink()
    for emptied in {(folder / name).parent for name in swap["stale"]}:
        with contextlib.suppress(OSError):  # it is not left empty
            emptied.rmdir()
    write_document(folder / STATE / MANIFEST, swap["manifest"])
