"""The report as a Word file and as an Excel file: what stands in them, read back by the packages that write them."""

import io
import zipfile

import docx
import numpy as np
import openpyxl
import pandas as pd
import pytest

from scruton.cli import main
from scruton.errors import InputError
from scruton.report import maths
from scruton.report.build import ReportPaths
from scruton.report.document import (
    ALARM,
    Callout,
    Chapter,
    Code,
    Definitions,
    Document,
    Equation,
    Heading,
    KeyFigures,
    Listing,
    Picture,
    Table,
    numbered,
    paragraph,
)
from scruton.report.office import check_office
from scruton.report.render_docx import render_docx
from scruton.report.render_xlsx import read, render_xlsx

PNG = bytes.fromhex(
    "89504e470d0a1a0a0000000d4948445200000001000000010806000000"
    "1f15c4890000000d49444154789c6360606060000000050001a5f645400000000049454e44ae426082"
)
ROWS = [("1#", "0.0654", "0.0649 to 0.066", "133 mm", "41.7 %"), ("=1+1", "−3 × 10⁻⁷", "–", "95.2 mm", "none")]
FORMULA = maths.frac("lambda", maths.sub("omega", "0"))


@pytest.fixture(scope="module")
def document() -> Document:
    table = Table("shown", "A caption", ("rig", "a", "90 %", "limit", "P"), ROWS, "A note")
    blocks = [
        paragraph("The answer ", FORMULA, " and ", Code("scruton fit"), role="answer"),
        Heading("Within"), Listing(["one", "two"]), Equation(FORMULA), table,
        Table("framed", "With all digits", ("x",), [("1.2",)], data="frame"),
        Picture("p", "What is drawn", "What a reader who cannot see it is told", png=PNG),
        Callout(ALARM, "Not to be trusted", ["because"]), KeyFigures([("Sc", "21.7", "of the bridge")]),
        Definitions([("term", "text \x07 with a bell")]), Code("a block"),
    ]  # fmt: skip
    chapter = Chapter("one", "First", blocks)
    return numbered(Document("Title <&> 漢字", "about", "source", [chapter], "scruton", [("Project", "P7")]))


def test_every_block_is_in_the_word_file(document: Document) -> None:
    content = render_docx(document)
    read_back = docx.Document(io.BytesIO(content))
    texts = "\n".join(one.text for one in read_back.paragraphs)
    for words in ("Title <&> 漢字", "1  First", "The answer ", "scruton fit", "Within", "two", "Table 1  A caption",
                  "A note", "Figure 1  What is drawn", "term: text  with a bell", "a block"):  # fmt: skip
        assert words in texts, words
    tables = [[[cell.text for cell in row.cells] for row in one.rows] for one in read_back.tables]
    assert tables[0] == [["Project", "P7"]]
    assert tables[1] == [["rig", "a", "90 %", "limit", "P"], *map(list, ROWS)]
    assert ["Sc"] in [one[0] for one in tables]
    assert any("Not to be trusted" in row[0] for one in tables for row in one)
    (described,) = read_back.element.xpath("//wp:docPr/@descr")
    assert described == "What a reader who cannot see it is told"
    assert [one.style.name for one in read_back.paragraphs if one.text == "1  First"] == ["Heading 1"]


def test_formulae_of_the_word_file_are_words_own(document: Document) -> None:
    body = zipfile.ZipFile(io.BytesIO(render_docx(document))).read("word/document.xml").decode()
    assert body.count("<m:oMath") == 2
    assert "<m:num><m:r><m:t>λ</m:t></m:r></m:num>" in body
    assert "<m:sub>" in body


def test_the_excel_file_holds_numbers(document: Document) -> None:
    frame = pd.DataFrame({"x [m]": [1.23456789012345, np.nan], "what": ["=2+2", "b"]})
    book = openpyxl.load_workbook(io.BytesIO(render_xlsx(document, {"frame": frame, "further": frame})))
    assert book.sheetnames == ["Contents", "shown", "framed", "further"]
    shown = list(book["shown"].iter_rows(values_only=True))
    assert shown[0] == ("rig", "a", "90 %, lower", "90 %, upper", "limit [mm]", "P")
    assert shown[1] == ("1#", 0.0654, 0.0649, 0.066, 133, 0.417)
    assert shown[2] == ("=1+1", pytest.approx(-3e-7), None, None, 95.2, "none")
    assert book["shown"]["A3"].data_type == "s", "no cell is a formula"
    assert book["shown"]["F2"].number_format.endswith("%")
    framed = list(book["framed"].iter_rows(values_only=True))
    assert framed == [
        ("x [m]", "what"),
        (1.23456789012345, "=2+2"),
        (None, "b"),
    ]
    entries = [row[:3] for row in book["Contents"].iter_rows(values_only=True)]
    assert ("shown", 1, "A caption") in entries


@pytest.mark.parametrize("render", [render_docx, lambda one: render_xlsx(one, {})])
def test_the_same_report_gives_the_same_bytes(document: Document, render, monkeypatch: pytest.MonkeyPatch) -> None:
    first = render(document)
    monkeypatch.setattr("time.time", lambda: 2e9)
    monkeypatch.setattr("time.localtime", lambda *_: (2033, 5, 18, 3, 33, 20, 2, 138, 0))
    assert render(document) == first


@pytest.mark.parametrize(
    ("text", "value"),
    [("0.05", 0.05), ("−0.05", -0.05), ("12", 12), ("1,234", 1234), ("3.1 × 10⁻⁷", 3.1e-7), ("50 %", 0.5), ("–", None),
     ("n = −1", "n = −1"), ("0.1 to 0.2", "0.1 to 0.2"), ("∞", "∞")],
)  # fmt: skip
def test_cells_are_read_as_they_are_meant(text: str, value: object) -> None:
    assert read(text) == (pytest.approx(value) if isinstance(value, float) else value)


def test_a_missing_package_names_the_extra(monkeypatch: pytest.MonkeyPatch, tmp_path, capsys) -> None:
    monkeypatch.setattr("scruton.report.office.find_spec", lambda _: None)
    with pytest.raises(InputError, match=r"python-docx: pip install 'scruton\[office\]'"):
        check_office("docx", "--docx")
    assert main(["report", str(tmp_path), "--xlsx"]) == 2
    assert "openpyxl" in capsys.readouterr().err


@pytest.mark.slow
def test_a_report_writes_both(small_results, tmp_path, capsys) -> None:
    out = tmp_path / "out"
    assert main(["report", str(small_results), "-o", str(out), "--no-gap", "--docx", "--xlsx", "--quiet"]) == 0
    assert {str(out / "report.docx"), str(out / "report.xlsx")} <= set(capsys.readouterr().out.splitlines())
    assert len(docx.Document(str(out / "report.docx")).inline_shapes) == len(list((out / "figures").glob("*.png")))
    assert len(openpyxl.load_workbook(out / "report.xlsx").sheetnames) > 5


def test_where_a_report_lies_once_it_is_moved(tmp_path) -> None:
    new = tmp_path / "new"
    paths = ReportPaths(new / "report.html", None, None, new / "report.json", (new / "figures/a.svg",), (), (),
                        (new / "report.docx",))  # fmt: skip
    moved = paths.moved(tmp_path / "out")
    assert (moved.report, moved.pdf) == (tmp_path / "out/report.html", None)
    assert moved.figures == (tmp_path / "out/figures/a.svg",)
    assert moved.office == (tmp_path / "out/report.docx",)
