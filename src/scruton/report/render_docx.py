"""A document as a Word file: headings, tables, captions, equations that can be edited, pictures with their texts."""

import base64
import io
from collections.abc import Iterator, Sequence
from typing import Any
from xml.etree import ElementTree

from scruton.report.document import (
    ALARM,
    Abreast,
    Block,
    Callout,
    Code,
    Definitions,
    Document,
    Equation,
    Heading,
    KeyFigures,
    Listing,
    Paragraph,
    Picture,
    Run,
    Table,
    set_in_type,
)
from scruton.report.maths import Maths
from scruton.report.office import plain, same_bytes

_WIDTH = 16.0  # cm, of the text
_SHADES = {ALARM: "FBE3E0"}
_CAUTION, _HEAD = "FFF4D6", "E9EEF2"
_MATHS = "http://schemas.openxmlformats.org/officeDocument/2006/math"
# MathML's elements with parts, and Word's, with the names of the parts.
_PARTS = {
    "mfrac": ("f", ("num", "den")), "msub": ("sSub", ("e", "sub")), "msup": ("sSup", ("e", "sup")),
    "msubsup": ("sSubSup", ("e", "sub", "sup")),
}  # fmt: skip


def render_docx(document: Document) -> bytes:
    """Render a numbered document: the same one gives the same bytes.

    ImportError where python-docx is not installed; `scruton.report.office.check_office` says so beforehand.
    """
    return _Writer(document).content()


class _Writer:
    """One Word file, from its title to its last chapter."""

    def __init__(self, document: Document) -> None:
        import docx
        from docx.shared import Cm, Pt

        self.document, self.file, self.cm = document, docx.Document(), Cm
        page = self.file.sections[0]
        page.page_width, page.page_height = Cm(21.0), Cm(29.7)
        page.left_margin = page.right_margin = Cm((21.0 - _WIDTH) / 2.0)
        styles = self.file.styles
        styles["Normal"].font.size = Pt(10.5)
        styles["Caption"].font.size = Pt(9.0)
        about = self.file.core_properties
        about.title, about.author, about.comments = plain(document.title)[:255], plain(document.generator)[:255], ""
        about.subject, about.language = plain(document.about)[:255], "en-GB"

    def content(self) -> bytes:
        """Write it all."""
        document = self.document
        if document.logo.startswith(("data:image/png", "data:image/jpeg")):  # Word takes no drawing alone
            self._image(base64.b64decode(document.logo.partition(",")[2]), "Logo", 4.0)
        self.file.add_heading(plain(document.title), 0)
        for text in filter(None, (document.about, document.source)):
            self.file.add_paragraph(plain(text))
        if document.title_block:
            self._grid([[label, text] for label, text in document.title_block])
        for chapter in document.chapters:
            self.file.add_heading(plain(f"{chapter.number}  {chapter.title}"), 1)
            for block in chapter.blocks:
                self._block(block)
        stream = io.BytesIO()
        self.file.save(stream)
        return same_bytes(stream.getvalue())

    def _block(self, block: Block) -> None:
        match block:
            case Paragraph(runs, role):
                self._runs(self.file.add_paragraph(), runs, bold=role == "answer", small=role == "note")
            case Heading(text):
                self.file.add_heading(plain(text), 2)
            case Listing(items):
                for item in items:
                    self._runs(self.file.add_paragraph(style="List Bullet"), set_in_type(item))
            case Abreast(lists):
                for head, lines in lists:
                    self._block(Heading(head))
                    self._block(Listing(lines))
            case Equation(maths, number):
                place = self.file.add_paragraph()
                place._p.append(_omml(maths))
                place.add_run(f"\t({number})")
            case Code(text):
                self._monospaced(self.file.add_paragraph(), text)
            case Table():
                self._table(block)
            case Picture():
                self._picture(block)
            case Callout(role, head, lines):
                cell = self._grid([[head]], shade=_SHADES.get(role, _CAUTION)).cell(0, 0)
                cell.paragraphs[0].runs[0].bold = True
                for line in lines:
                    self._runs(cell.add_paragraph(style="List Bullet"), set_in_type(line))
                self.file.add_paragraph()
            case KeyFigures(items):
                grid = self._grid([[label for label, _, _ in items], [value for _, value, _ in items],
                                   [detail for _, _, detail in items]])  # fmt: skip
                for cell in grid.rows[1].cells:
                    cell.paragraphs[0].runs[0].bold = True
                self.file.add_paragraph()
            case Definitions(pairs):
                for term, text in pairs:
                    place = self.file.add_paragraph()
                    place.add_run(f"{plain(term)}: ").bold = True
                    place.add_run(plain(text))

    def _runs(self, place: Any, runs: Sequence[Run], *, bold: bool = False, small: bool = False) -> None:
        from docx.shared import Pt

        for run in runs:
            if isinstance(run, Maths):
                place._p.append(_omml(run))
            elif isinstance(run, Code):
                self._monospaced(place, run.text)
            else:
                written = place.add_run(plain(run))
                written.bold = bold or None
                if small:
                    written.font.size = Pt(9.0)

    def _monospaced(self, place: Any, text: str) -> None:
        place.add_run(plain(text)).font.name = "Consolas"

    def _table(self, table: Table) -> None:
        from docx.enum.text import WD_ALIGN_PARAGRAPH

        self._caption(f"Table {table.number}", table.caption, before=True)
        grid = self._grid([list(table.header), *map(list, table.rows)], size=8.0 if len(table.header) > 6 else 9.0)
        head = grid.rows[0]
        mark = head._tr.get_or_add_trPr()
        mark.append(_element("w:tblHeader"))  # again on every page
        for cell in head.cells:
            _shaded(cell, _HEAD)
            for run in cell.paragraphs[0].runs:
                run.bold = True
        for i, column in enumerate(grid.columns):
            if table.is_numeric(i):
                for cell in column.cells:
                    cell.paragraphs[0].alignment = WD_ALIGN_PARAGRAPH.RIGHT
        self._runs(self.file.add_paragraph(), (table.note,), small=True)

    def _grid(self, rows: Sequence[Sequence[str]], *, shade: str = "", size: float = 9.5) -> Any:
        from docx.shared import Pt

        grid = self.file.add_table(rows=len(rows), cols=len(rows[0]), style="Table Grid")
        for line, texts in zip(grid.rows, rows, strict=True):
            for cell, text in zip(line.cells, texts, strict=True):
                cell.paragraphs[0].add_run(plain(text)).font.size = Pt(size)
                if shade:
                    _shaded(cell, shade)
        return grid

    def _picture(self, picture: Picture) -> None:
        if not picture.png:
            return
        self._image(picture.png, picture.alt or picture.caption, _WIDTH)
        self._caption(f"Figure {picture.number}", picture.caption)

    def _image(self, content: bytes, alt: str, most: float) -> None:
        shape = self.file.add_picture(io.BytesIO(content))
        if shape.width > self.cm(most):
            shape.height, shape.width = round(shape.height * self.cm(most) / shape.width), self.cm(most)
        shape._inline.docPr.set("descr", plain(alt))
        self.file.paragraphs[-1].paragraph_format.keep_with_next = True

    def _caption(self, label: str, text: str, *, before: bool = False) -> None:
        place = self.file.add_paragraph(style="Caption")
        place.paragraph_format.keep_with_next = before
        place.add_run(f"{label}  ").bold = True
        place.add_run(plain(text))


def _element(name: str, **attributes: str) -> Any:
    from docx.oxml import OxmlElement
    from docx.oxml.ns import qn

    made = OxmlElement(name)
    for key, value in attributes.items():
        made.set(qn(f"w:{key}"), value)
    return made


def _shaded(cell: Any, colour: str) -> None:
    cell._tc.get_or_add_tcPr().append(_element("w:shd", val="clear", color="auto", fill=colour))


def _omml(maths: Maths) -> Any:
    """A formula as Word's own, from its MathML."""
    from lxml import etree

    root = etree.Element(f"{{{_MATHS}}}oMath", nsmap={"m": _MATHS})
    root.extend(_formula(ElementTree.fromstring(f"<mrow>{maths.mathml}</mrow>")))
    return root


def _formula(node: ElementTree.Element) -> Iterator[Any]:
    from lxml import etree

    def made(name: str, *inside: Any) -> Any:
        one = etree.Element(f"{{{_MATHS}}}{name}")
        one.extend(inside)
        return one

    if node.tag in _PARTS:
        name, parts = _PARTS[node.tag]
        yield made(name, *(made(part, *_formula(child)) for part, child in zip(parts, node, strict=True)))
    elif node.tag == "mover":  # an accent
        base, accent = node
        sign = made("chr")
        sign.set(f"{{{_MATHS}}}val", {"˙": "\u0307"}.get(accent.text or "", accent.text or ""))
        yield made("acc", made("accPr", sign), made("e", *_formula(base)))
    elif len(node):
        for child in node:
            yield from _formula(child)
    elif node.text:
        text = made("t")
        text.text = plain(node.text)
        upright = made("sty")
        upright.set(f"{{{_MATHS}}}val", "p")
        roman = node.get("mathvariant") == "normal" or node.tag in ("mn", "mo")
        yield made("r", *([made("rPr", upright)] if roman else []), text)
