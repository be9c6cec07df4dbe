"""A document as a PDF, typeset by Typst inside this process: no system TeX, no network.

The template reads the document as data, so that no text of it is ever read as markup.
"""

import json
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any

from scruton.report.document import Chart, Code, Document, Picture, Table
from scruton.report.maths import Maths
from scruton.report.thresholds import LARGEST_SVG_IN_PDF
from scruton.report.typefaces import families, folders

TEMPLATE = Path(__file__).parent / "templates" / "report.typ"
MAIN, DATA, TYPEFACES = "main.typ", "document.json", "typefaces.json"


def render_pdf(document: Document) -> bytes:
    """Typeset a document.

    Parameters
    ----------
    document : Document
        As `numbered` gave it.

    Returns
    -------
    bytes
        A PDF; the same document gives the same bytes, whatever typefaces are installed. It holds the letters that
        it needs.
    """
    content: bytes = _typst(document, format="pdf", timestamp=0)
    return content


def render_pages(document: Document, *, ppi: float = 80.0) -> list[bytes]:
    """The pages as PNG, to be looked at."""
    found = _typst(document, format="png", ppi=ppi)
    return found if isinstance(found, list) else [found]


def _typst(document: Document, **options: Any) -> Any:
    import typst

    # its own annotations leave out that files may come as a dictionary
    compiler: Any = typst.compile
    return compiler(sources(document), ignore_system_fonts=True, font_paths=_fonts(), **options)


@cache
def _fonts() -> Any:
    """The typesetter's own typefaces and ours, read once."""
    import typst

    return typst.Fonts(include_system_fonts=False, font_paths=list(folders()))


def sources(document: Document) -> dict[str, bytes]:
    """Everything that the typesetter reads, by name."""
    files = {
        MAIN: TEMPLATE.read_bytes(),
        DATA: json.dumps(plain(document), ensure_ascii=False).encode(),
        TYPEFACES: json.dumps(families()).encode(),
    }
    for one in document.pictures():
        name, content = picture_file(one)
        if content:
            files[name] = content
    return files


def picture_file(one: Picture) -> tuple[str, bytes]:
    """Name and content of the file that a picture is drawn from; no content where there is none."""
    if one.svg and (len(one.svg) <= LARGEST_SVG_IN_PDF or not one.png):
        return f"{one.name}.svg", one.svg
    return f"{one.name}.png", one.png


def plain(value: Any) -> Any:
    """A document as JSON: each block with its kind, pictures as names of files, formulae in Typst's language."""
    match value:
        case str():
            return readable(value)
        case Maths():
            return {"kind": "maths", "typst": value.typst}
        case Code():
            return {"kind": "code", "text": readable(value.text)}
        case Picture():
            name, content = picture_file(value)
            texts = {key: readable(getattr(value, key)) for key in ("caption", "alt", "number")}
            return {"kind": "picture", "file": name if content else "", "name": value.name, **texts}
        case Chart():
            return plain(value.picture)
        case tuple() | list():
            return [plain(one) for one in value]
        case bool() | int() | float() | None:
            return value
    if not is_dataclass(value):
        raise TypeError(f"a document holds no {type(value).__name__}")
    entry = {one.name: plain(getattr(value, one.name)) for one in fields(value)}
    kind = type(value).__name__.lower()
    if isinstance(value, Table):
        entry["numeric"] = [value.is_numeric(i) for i in range(len(value.header))]
    return entry | {"kind": kind}


def readable(text: str) -> str:
    """A text without control characters, which have no glyph; line breaks stay."""
    return "".join(
        letter for letter in text if letter == "\n" or (ord(letter) >= 32 and not 0x7F <= ord(letter) < 0xA0)
    )
