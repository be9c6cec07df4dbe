"""The figures of a fit as an earlier report left them: they are drawn anew only where what they are made of changed."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

from scruton.documents import read_json
from scruton.errors import InputError
from scruton.provenance import code_sha256, versions
from scruton.report.document import Picture
from scruton.report.failures import Failure

FILES = ("svg", "png")
Crossed = Callable[[], Mapping[str, Any] | Failure]
_DRAWN_BY = ("matplotlib", "typst", "noto-cjk-sans-otc", "manimgx-fonts")  # beside what gives the numbers


@dataclass(frozen=True, eq=False)
class Beside:
    """What a report need not make of its fit, since it is known.

    Attributes
    ----------
    crossed : callable, optional
        Gives the prediction of each peak test from the others as JSON has it, where there are two or more.
    fit_sha256 : mapping, optional
        SHA-256 of the files of the fit, where they lie elsewhere than the report: a later one takes its figures.
    pictures : sequence of Picture
        The figures of the fit, where an earlier report drew them from the same.
    """

    crossed: Crossed | None = None
    fit_sha256: Mapping[str, str] | None = None
    pictures: Sequence[Picture] = ()


def drawn_from(fit_sha256: Mapping[str, str]) -> str:
    """One hash of all that the figures of a fit depend on: its two files, the programs, the typefaces."""
    programs = versions() | {name: version(name) for name in _DRAWN_BY} | {"code": code_sha256()}
    return sha256(json.dumps([dict(fit_sha256), programs], sort_keys=True).encode()).hexdigest()


def noted(pictures: Sequence[Picture], from_sha256: str) -> dict[str, Any]:
    """What a report notes of the figures of its fit so that a later one can take them: as `drawn` of report.json."""
    entries = {
        picture.name: {"caption": picture.caption, "alt": picture.alt}
        | {f"{kind}_sha256": sha256(getattr(picture, kind)).hexdigest() for kind in FILES}
        for picture in pictures
    }
    return {"from_sha256": from_sha256, "figures": entries}


def kept(reports: Iterable[tuple[Path, Path]], from_sha256: str) -> list[Picture]:
    """The figures that an earlier report holds, if it was drawn from the same and every file is as it was written.

    Parameters
    ----------
    reports : iterable of (Path, Path)
        Of every report that may lie there, its report.json and the folder of its figures.
    from_sha256 : str
        As of `drawn_from`.

    Returns
    -------
    list of Picture
        Empty where there is no such report.
    """
    for numbers, figures in reports:
        try:
            note = read_json(numbers).get("drawn", {})
            if note.get("from_sha256") == from_sha256:
                return [_read(figures, name, entry) for name, entry in note["figures"].items()]
        except (InputError, OSError, KeyError, TypeError, ValueError, AttributeError):
            continue  # no report, or one that somebody changed: they can always be drawn
    return []


def _read(folder: Path, name: str, entry: Mapping[str, str]) -> Picture:
    """A figure from its files (ValueError where one is not as it was written)."""
    files = {kind: (folder / f"{name}.{kind}").read_bytes() for kind in FILES}
    for kind, content in files.items():
        if sha256(content).hexdigest() != entry[f"{kind}_sha256"]:
            raise ValueError(f"{name}.{kind}")
    return Picture(name, entry["caption"], entry["alt"], svg=files["svg"], png=files["png"])
