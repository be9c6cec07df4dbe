"""The files of one campaign: each is read and hashed once, however many records lie in it."""

from dataclasses import dataclass, field
from difflib import get_close_matches
from hashlib import sha256
from pathlib import Path

from scruton.campaign.bounded import read_bytes, relative_to
from scruton.campaign.readers import COMPANIONS, Container, CsvDialect, open_container
from scruton.campaign.thresholds import LARGEST_RECORD


@dataclass
class Files:
    """Files below (or beside) a campaign's folder, which relative paths start from."""

    folder: Path
    sha256: dict[str, str] = field(default_factory=dict)  # of every file that was read, by its relative path
    _bytes: dict[Path, bytes] = field(default_factory=dict)
    _open: dict[tuple[Path, CsvDialect], Container] = field(default_factory=dict)

    def read(self, path: Path, largest: int = LARGEST_RECORD) -> bytes:
        """Read a file of at most `largest` bytes and note its digest (InputError as `read_bytes`)."""
        if path not in self._bytes:
            self._bytes[path] = read_bytes(path, largest, _instead_of)
            self.sha256[self.key(path)] = sha256(self._bytes[path]).hexdigest()
        return self._bytes[path]

    def open(self, path: Path, dialect: CsvDialect) -> Container:
        """Open a file of records (InputError as `read`, or as its reader)."""
        if (path, dialect) not in self._open:
            if ending := COMPANIONS.get(path.suffix.lower()):
                self.read(path.with_suffix(ending))
            self._open[path, dialect] = open_container(self.read(path), path, dialect)
        return self._open[path, dialect]

    def key(self, path: Path) -> str:
        """Return a path relative to the campaign's folder, with forward slashes."""
        return relative_to(path, self.folder)


def _instead_of(path: Path) -> str:
    if not path.parent.is_dir():
        return f"a file; its folder {path.parent} is not there either"
    names = [file.name for file in path.parent.iterdir() if file.is_file()]
    close = get_close_matches(path.name, names, n=1)
    return f'a file that is there, "{close[0]}" perhaps' if close else "a file that is there"
