"""The report on paper: text as text, tables and figures whole, the same bytes."""

import re
import shutil
import subprocess
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from fake_fit import fake_fit
from fake_parts import GAP, sizing
from matplotlib.figure import Figure
from matplotlib.image import imread

from scruton.report.chapters import Material, compose
from scruton.report.document import (
    ALARM,
    Abreast,
    Callout,
    Chapter,
    Code,
    Definitions,
    Document,
    Equation,
    Heading,
    KeyFigures,
    Listing,
    Paragraph,
    Picture,
    Table,
    numbered,
)
from scruton.report.equations import GRIFFIN, INDEX
from scruton.report.figures import FigureWithCaption
from scruton.report.figures.registry import contents
from scruton.report.pages import HEADING, arranged
from scruton.report.parts import drawn
from scruton.report.render_typst import marks_of, plain, render_pdf, typeset
from scruton.report.tables import tables

EVIL = """<script>alert('1')</script> "B/D" & #x $y$ *z* _u_ `v` \\ @w = [4:1] // 矩形断面 ξ_s → λ 🌉"""


def picture(name: str = "one", height: float = 1.0) -> Picture:
    figure = Figure(figsize=(6, height))
    figure.subplots().plot([0, 1])
    return drawn(FigureWithCaption(figure, name, f"caption of {name}", "an alternative"))


def document(*blocks, title: str = "A title") -> Document:
    return numbered(Document(title, "about", "a source", (Chapter("one", "One", blocks),), "scruton 0"))


@pytest.fixture
def text(tmp_path: Path):
    """Text of a PDF, by a reader of PDF files."""
    if shutil.which("pdftotext") is None:
        pytest.skip("no pdftotext here")

    def read(pdf: bytes, *options: str) -> str:
        path = tmp_path / "a.pdf"
        path.write_bytes(pdf)
        done = subprocess.run(["pdftotext", *options, str(path), "-"], check=True, capture_output=True)
        return done.stdout.decode()

    return read


def squeezed(text: str) -> str:
    return re.sub(r"\s+", "", text)


def test_every_kind_of_block_is_set(text) -> None:
    found = text(
        render_pdf(
            document(
                Paragraph(("words ", GRIFFIN, " more ", Code("a_b"))), Paragraph(("small",), role="note"),
                Paragraph(("answered",), role="answer"), Heading("below"), Listing(("point",)), Equation(INDEX),
                Abreast((("left", ("one side",)), ("right", ("other side",)))),
                Table("t", "a caption", ("a", "b"), (("x", "1\n2"),), "a note"), picture(),
                replace(picture("two"), chart={}),
                Callout(ALARM, "red", ("line",)), KeyFigures((("label", "value", "detail"),) * 4),
                Definitions((("term", "meaning"),)), Code("[a]\nb = 1 # c"),
            )
        )
    )  # fmt: skip
    wanted = (
        "words", "a_b", "small", "answered", "below", "point", "left", "one side",
        "right", "other side", "Table 1", "a caption", "a note", "Figure 2",
        "caption of two", "red", "line", "label", "value", "detail", "term", "meaning", "b = 1 # c",
    )  # fmt: skip
    for words in wanted:
        assert words in found, words


def test_text_is_text_whatever_it_holds(text) -> None:
    one = document(
        Paragraph((EVIL,)), Table("t", EVIL, (EVIL, "b"), ((EVIL, EVIL),), EVIL), Callout(ALARM, EVIL, (EVIL,)),
        Heading(EVIL), Code(EVIL), Definitions(((EVIL, EVIL),)), title=EVIL,
    )  # fmt: skip
    found = squeezed(text(render_pdf(one), "-raw"))
    parts = ("<script>alert('1')</script>", '"B/D"&#x$y$*z*_u_`v`', "=[4:1]//", "ξ_s→λ")
    for part in parts:
        assert found.count(part) >= 4, part
    assert found.count("矩形断面") >= 4
    assert found.count("🌉") >= 4


def test_control_characters_are_left_out() -> None:
    assert plain("a\x00b\x07\nc\x9f") == "ab\nc"
    assert plain(Paragraph(("\x00x",)))["runs"] == ["x"]


def test_the_same_document_gives_the_same_bytes() -> None:
    one = document(Paragraph(("words",)), picture(), Equation(GRIFFIN))
    assert render_pdf(one) == render_pdf(one)


def test_long_tables_repeat_their_header_and_short_ones_and_figures_stay_whole(text) -> None:
    rows = tuple((f"row {i}", str(i)) for i in range(120))
    filler = tuple(Paragraph(("filler",)) for _ in range(25))
    short = Table("short", "short one", ("first", "second"), tuple((f"s{i}", "1") for i in range(12)))
    one = document(Table("long", "long one", ("headword", "b"), rows), *filler, short, *filler, picture("f", 6.0))
    pages = text(render_pdf(one), "-layout").split("\f")
    with_rows = [page for page in pages if "row " in page]
    assert len(with_rows) > 2
    assert all("headword" in page for page in with_rows)
    assert sum("s0 " in page or "s11 " in page for page in pages) == 1
    assert sum("Figure 1" in page for page in pages) == 1
    for i, page in enumerate(pages[:-1]):
        assert f"{i + 1}/{len(pages) - 1}" in squeezed(page), "its number"


def emptiest(png: bytes) -> float:
    """The longest empty stretch of a page, over the height of its text."""
    ink = (imread(BytesIO(png), format="png")[..., :3] < 0.97).any(axis=(1, 2))
    first, last = (round(share * len(ink)) for share in (24.0 / 297.0, 277.0 / 297.0))
    rows = np.flatnonzero(ink[first:last])
    return float(np.diff([-1, *rows, last - first]).max()) / (last - first)


def drawing(name: str, height_mm: float) -> Picture:
    svg = f"""<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 160 {height_mm}"><rect width="160"
    height="{height_mm}" fill="#888"/></svg>"""
    return Picture(name, f"What {name} shows, in words that take more than a line of the page. " * 2, "", svg.encode())


def test_no_page_is_left_more_than_a_quarter_empty_but_the_last() -> None:
    fit = fake_fit(growth=False, sweeps=False)
    heights = {
        "griffin": 98, "griffin_by_test": 124, "laws": 86, "gap": 160, "decision": 74, "risk": 78, "shares": 78,
        "damper": 66, "required_damping": 65, "ring_downs": 185, "records": 140, "trial_functions": 76,
        "aerodynamic_damping": 95, "aerodynamic_damping_by_test": 102, "stability": 102, "griffin_reciprocal": 88,
        "reciprocal_against_damping": 80, **{f"{of}_{k}": 118 for of in ("corner", "trace") for k in (1, 2, 3)},
    }  # fmt: skip
    pictures = [drawing(name, height) for name, height in heights.items()]
    whole = compose(Material(fit, tables(fit), pictures, gap=GAP, sizing=sizing()))
    pages = typeset(whole, format="png", ppi=30.0)
    assert [i for i, page in enumerate(pages[:-1]) if emptiest(page) > 0.25] == []
    for chapter, steps in zip(whole.chapters, arranged(whole, marks_of(whole)), strict=True):
        assert [HEADING, *range(len(chapter.blocks))] == sorted(block for block, _, _ in steps), "all of it, in it"


def test_pictures_wait_or_shrink_in_their_section_and_parts_begin_a_page() -> None:
    text, tall, last = Paragraph(("words",)), drawing("tall", 180.0), drawing("last", 60.0)
    blocks = (text, tall, text, text, Heading("h"), last)
    chapters = (Chapter("a", "A", (text,), part="One"), Chapter("b", "B", blocks, part="Two"))
    one = numbered(Document("t", "k", "s", chapters))
    # the text of page 2 ends where the tall picture no longer fits
    later = ((1, -1, 360.0), (1, 0, 400.0), (1, 1, 700.0), 510.0, (1, 2, 1270.0), (1, 3, 1470.0), (1, 4, 1770.0),
             (1, 5, 1790.0), 170.0, (1, -2, 2000.0))  # fmt: skip

    def marks(down: float) -> list:
        moved = [mark if isinstance(mark, float) else (*mark[:2], mark[2] + down) for mark in later]
        return [(0, -1, 200.0), (0, 0, 230.0), (0, -2, 260.0 + down), *moved]

    assert arranged(one, marks(0.0))[1][0] == (HEADING, 1.0, False), "more than half of the page before were empty"
    first, second = arranged(one, marks(300.0))
    assert first == [(HEADING, 1.0, False), (0, 1.0, False)]
    assert second[0] == (HEADING, 1.0, True), "a part begins a page"
    places = [block for block, _, _ in second]
    assert places.index(0) < places.index(2) < places.index(1) < places.index(4), (
        "it waits, no farther than its section"
    )
    assert places.index(4) < places.index(5)
    assert all(0.8 <= scale <= 1.0 for _, scale, _ in second)


def test_the_first_page_holds_the_whole_decision(text) -> None:
    fit = fake_fit(growth=False, sweeps=False)
    flags = tuple(f"flag {i}: what has to be read before a number is used. " * 4 for i in range(3))
    one = compose(Material(fit, tables(fit), [drawing("decision", 52)], gap=GAP, sizing=sizing(flags=flags)))
    for block in (KeyFigures, Picture, Callout, Abreast):
        assert any(isinstance(each, block) for each in one.chapters[0].blocks), block
    first, second = text(render_pdf(one), "-layout").split("\f")[:2]
    for words in ("What it rests on", "What could overturn it", "Read this before using a number"):
        assert words in first, words
    assert "Contents" in first + second


def test_no_line_ends_within_a_number(text) -> None:
    lines = [Paragraph((f"{'i' * k} and the 90 % interval of 12.5 % or n = −1, " * 3,)) for k in range(1, 40)]
    found = text(render_pdf(document(*lines)), "-layout")
    assert found.count("90 %") == found.count("12.5 %") == 3 * len(lines)
    assert found.count("n = −1") == 3 * len(lines)


def test_a_figure_that_is_too_tall_is_made_smaller() -> None:
    tall = picture("tall", 14.0)
    pages = typeset(document(tall), format="png", ppi=20.0)
    assert isinstance(pages, bytes) or len(pages) <= 2


def test_a_whole_report_is_set_with_its_contents(text) -> None:
    fit = fake_fit(growth=False, sweeps=False)
    found = text(render_pdf(compose(Material(fit, tables(fit), [picture("griffin")]))), "-layout")
    contents_page = found.split("Contents")[1][:2500]
    for heading in ("Summary", "Limits of validity", "Provenance", "Methods in short"):
        assert re.search(heading + r"\s+\d+", contents_page), heading


def test_large_drawings_go_in_as_pixels() -> None:
    heavy = Picture("heavy", "c", "a", b"x" * 700_000, b"y")
    assert plain(heavy)["file"] == "heavy.png"
    assert plain(Picture("light", "c", "a", b"x", b"y"))["file"] == "light.svg"
    assert plain(Picture("none", "c", "a"))["file"] == ""
    with pytest.raises(TypeError, match="no set"):
        plain({1})


def test_contents_of_a_figure_do_not_depend_on_the_process() -> None:
    def figure() -> Figure:
        one = Figure(figsize=(2, 1))
        one.subplots().fill_between([0, 1], [1, 2])
        return one

    assert contents(figure(), ("svg", "png")) == contents(figure(), ("svg", "png"))
