"""A document as a PDF, typeset by Typst inside this process: no system TeX, no network.

The template reads the document as data, so that no text of it is ever read as markup.
"""

import base64
import json
import struct
import zlib
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any

from scruton.report.document import Document, Picture, Table
from scruton.report.maths import Maths
from scruton.report.pages import Mark, Step, arranged
from scruton.report.thresholds import DOTS_PER_INCH, LARGEST_SVG_IN_PDF
from scruton.report.typefaces import families, typefaces

TEMPLATE = Path(__file__).parent / "templates" / "report.typ"


def render_pdf(document: Document) -> bytes:
    """Typeset a numbered document: the same one gives the same bytes, whatever typefaces are installed.

    The PDF holds the letters that it needs.
    """
    content: bytes = typeset(document, format="pdf", timestamp=0)
    return content


def typeset(document: Document, **options: Any) -> Any:
    """What `typst.compile` makes of a document: bytes, or a list of them where several pages go into several images."""
    import typst

    # its own annotations leave out that files may come as a dictionary
    compiler: Any = typst.compile
    plan = arranged(document, marks_of(document))
    return compiler(_files(document, plan), ignore_system_fonts=True, font_paths=_fonts(), **options)


def marks_of(document: Document) -> list[Mark]:
    """Where each block of a document begins, as `scruton.report.pages.arranged` takes it."""
    import typst

    query: Any = typst.query
    files = _files(document, None)
    marks = query(files, "<mark>", field="value", ignore_system_fonts=True, font_paths=_fonts())
    found: list[Mark] = json.loads(marks)
    return found


def _files(document: Document, plan: list[list[Step]] | None) -> dict[str, bytes]:
    """What a document is typeset from; without a plan it is measured."""
    content = {"document.json": plain(document), "typefaces.json": families(), "plan.json": plan}
    files = {name: json.dumps(data, ensure_ascii=False).encode() for name, data in content.items()}
    files |= {name: data for name, data in map(picture_file, document.every(Picture)) if data}
    if document.logo:
        files[logo_file(document.logo)] = base64.b64decode(document.logo.partition(",")[2])
    return {"main.typ": TEMPLATE.read_bytes(), **files}


def rasterised(svg: bytes) -> bytes:
    """A drawing whose letters are outlines, as a PNG that says how large it is: faster than to draw it anew."""
    import typst

    compiler: Any = typst.compile
    page = b'#set page(width: auto, height: auto, margin: 0pt, fill: white)\n#image("drawing.svg")'
    files = {"main.typ": page, "drawing.svg": svg}
    png: bytes = compiler(files, format="png", ppi=float(DOTS_PER_INCH), ignore_system_fonts=True, font_paths=_fonts())
    size = b"pHYs" + struct.pack(">IIB", *[round(DOTS_PER_INCH / 0.0254)] * 2, 1)
    return png[:33] + struct.pack(">I", 9) + size + struct.pack(">I", zlib.crc32(size)) + png[33:]  # behind its header


@cache
def _fonts() -> Any:
    """The typesetter's own typefaces and ours, read once."""
    import typst

    return typst.Fonts(include_system_fonts=False, font_paths=[*dict.fromkeys(f.path.parent for f in typefaces())])


def picture_file(picture: Picture) -> tuple[str, bytes]:
    """Name and content of the file that a picture is drawn from; no content where there is none."""
    if picture.svg and (len(picture.svg) <= LARGEST_SVG_IN_PDF or not picture.png):
        return f"{picture.name}.svg", picture.svg
    return f"{picture.name}.png", picture.png


def logo_file(uri: str) -> str:
    """Name of the file that a logo, a data URI, becomes; empty where there is none."""
    kind = uri.partition(";")[0].removeprefix("data:image/").partition("+")[0]
    return uri and f"logo.{kind}"


def plain(value: Any) -> Any:
    """A document as JSON: each block with its kind, pictures as names of files, formulae in Typst's language."""
    match value:
        case str():  # control characters have no glyph; line breaks stay
            return "".join(char for char in value if char == "\n" or (ord(char) >= 32 and not 0x7F <= ord(char) < 0xA0))
        case Maths():
            return {"kind": "maths", "typst": value.typst}
        case tuple() | list():
            return [plain(item) for item in value]
        case bool() | int() | float() | None:
            return value
        case Picture():
            name, content = picture_file(value)
            entry = {key: plain(getattr(value, key)) for key in ("name", "caption", "alt", "number")}
            entry["file"] = name if content else ""
        case _ if is_dataclass(value):
            entry = {field.name: plain(getattr(value, field.name)) for field in fields(value)}
            if isinstance(value, Document):
                entry["logo"] = logo_file(value.logo)
        case _:
            raise TypeError(f"a document holds no {type(value).__name__}")
    if isinstance(value, Table):
        entry["numeric"] = [value.is_numeric(i) for i in range(len(value.header))]
    return entry | {"kind": type(value).__name__.lower()}
