"""What is drawn comes from the typefaces that are installed with it: never tofu, never another machine's letters."""

import io
import json
import logging
import os
import re
import subprocess
import sys
import warnings
from base64 import b64decode
from itertools import combinations
from pathlib import Path

import pytest
from fontTools.ttLib import TTFont
from matplotlib.figure import Figure

from scruton.report.document import Chapter, Code, Document, Paragraph, numbered
from scruton.report.figures.registry import contents
from scruton.report.figures.style import house_style, literal
from scruton.report.render_html import render_html
from scruton.report.render_typst import render_pdf, typeset
from scruton.report.typefaces import CJK, LAST_RESORT, PLAIN, families, subsets, typefaces

NAMES = {
    "Chinese": "虎门大桥", "Japanese": "東京ゲートブリッジ", "Korean": "서울대교", "Greek": "Γέφυρα",
    "Cyrillic": "Мост", "Latin": "Ærøsund ŷ", "Arabic": "جسر", "Hebrew": "גשר", "Devanagari": "हावड़ा",
    "Thai": "สะพาน", "emoji": "🌉",
}  # fmt: skip
UNHELD = "\U00012000"  # a cuneiform sign
EVERYTHING = " ".join((*NAMES.values(), UNHELD))


def document(*texts: str) -> Document:
    blocks = tuple(Paragraph((text,)) for text in texts)
    return numbered(Document(texts[0], "about", "a source", (Chapter("one", "One", blocks),), "scruton 0"))


def labelled(text: str) -> Figure:
    with house_style():
        figure = Figure(figsize=(4, 1))
        figure.text(0.02, 0.5, text)
        figure.text(0.02, 0.1, r"$\xi_s$ and $a^*$")
    return figure


def picture(text: str) -> bytes:
    return contents(labelled(text), ("png",))[0]


# ------------------------------------------------------------------------------------------------ the files


def test_every_typeface_is_there_and_is_what_it_is_called() -> None:
    for one in typefaces():
        with TTFont(one.path, fontNumber=one.index, lazy=True) as font:
            names = {font["name"].getDebugName(i) for i in (1, 16)}
            assert one.family in names, one.path.name
            assert font["OS/2"].usWeightClass == one.weight or one.family == LAST_RESORT, one.path.name
    assert families()[:2] == (PLAIN, CJK)
    assert families()[-1] == LAST_RESORT


def test_their_licences_allow_it() -> None:
    from importlib.metadata import metadata

    for package in ("noto-cjk-sans-otc", "manimgx-fonts"):
        assert metadata(package)["License-Expression"] == "OFL-1.1"


# ------------------------------------------------------------------------------------------------ figures


def test_each_script_is_drawn_and_not_as_an_empty_box(caplog: pytest.LogCaptureFixture) -> None:
    with warnings.catch_warnings(), caplog.at_level(logging.WARNING):
        warnings.simplefilter("error")
        for script, name in NAMES.items():
            svg = contents(labelled(name), ("svg",))[0].decode()
            assert "LastResort" not in svg, script
            letters = re.findall(r'<path id="([^"]+)"', svg)
            assert len(set(letters)) >= len(set(name.replace(" ", ""))) - 3, script  # some join
        assert len({picture(name) for name in NAMES.values()}) == len(NAMES)
        contents(labelled(EVERYTHING))
    assert not caplog.records


def test_a_letter_that_no_typeface_holds_shows_its_script_and_warns_nobody() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        svg = contents(labelled(UNHELD), ("svg",))[0]
    assert b"LastResort" in svg
    assert picture(UNHELD) != picture("\U00010380")  # another script


def test_what_follows_an_arabic_name_stays_behind_it() -> None:
    assert picture(f"{literal('جسر')}, 2 plucks") != picture("جسر, 2 plucks")
    assert picture(f"{literal('جسر')}, 2 plucks") == picture("\u2067جسر\u2069, 2 plucks")  # isolated, as Unicode has it
    assert literal("虎门 6#") == "虎门 6#"


def test_a_users_matplotlibrc_is_for_the_users_figures() -> None:
    import matplotlib as mpl

    plain = picture("虎门")
    with mpl.rc_context({"font.size": 30, "mathtext.fontset": "cm", "text.color": "red", "text.hinting": "none"}):
        assert picture("虎门") == plain


# ------------------------------------------------------------------------------------------------ pages


def test_the_pdf_shows_each_script_and_carries_the_letters_that_it_needs() -> None:
    names = (*NAMES.values(), "桥虎门大", UNHELD, "\U00010380")
    pages = {name: typeset(document(name), format="png", ppi=80.0) for name in names}
    for one, other in combinations(pages, 2):
        assert pages[one] != pages[other], (one, other)
    bare, full = len(render_pdf(document("words"))), len(render_pdf(document(EVERYTHING)))
    assert full - bare < 60_000


def test_the_pdf_embeds_no_other_typeface() -> None:
    one = numbered(Document("t", "a", "s", (Chapter("one", "One", (Code(EVERYTHING),)),), "scruton 0"))
    with TTFont(next(face.path for face in typefaces() if face.family == CJK), fontNumber=2, lazy=True) as font:
        postscript = font["name"].getDebugName(6)
    found = {name.decode() for name in re.findall(rb"/BaseFont\s*/[A-Z]{6}\+([\w-]+)", render_pdf(one))}
    assert any(name.startswith(postscript) for name in found), found
    ours = ("DejaVuSans", "Noto", "LastResort", "Libertinus", "NewCM")
    assert all(name.startswith(ours) for name in found), found


def test_the_page_carries_the_letters_that_its_reader_may_lack() -> None:
    page = render_html(document(EVERYTHING))
    rules = re.findall(
        r'@font-face\{font-family:scruton;src:url\("data:font/otf;base64,([^"]+)"\);unicode-range:(.+)\}', page
    )
    carried = set()
    for data, reach in rules:
        letters = {chr(int(one[2:], 16)) for one in reach.split(",")}
        with TTFont(io.BytesIO(b64decode(data))) as font:
            assert letters <= set(map(chr, font.getBestCmap()))
            assert "fvar" not in font
        assert not letters & carried
        carried |= letters
    for script in ("Chinese", "Japanese", "Korean", "Devanagari", "Thai", "emoji"):
        assert set(NAMES[script]) - {" "} <= carried, script
    assert "a" not in carried
    assert "font-src data:" in page
    assert sum(len(data) for data, _ in rules) < 40_000
    assert render_html(document(EVERYTHING)) == page


def test_a_page_in_latin_and_greek_carries_none() -> None:
    assert "@font-face" not in render_html(document("ξ is a damping ratio, α₀ an angle"))
    assert list(subsets("Griffin ξ\n")) == []


def test_no_title_can_pass_for_the_place_of_the_rules() -> None:
    page = render_html(document("<style>\n虎"))
    assert page.index("@font-face") > page.index("</title>")


# ------------------------------------------------------------------------------------------------ other machines

DRAW = f"""
import hashlib, json, sys
from matplotlib.figure import Figure
from matplotlib.font_manager import findSystemFonts, fontManager
from scruton.report.document import Chapter, Document, Paragraph, numbered
from scruton.report.figures.registry import contents
from scruton.report.figures.style import house_style
from scruton.report.render_html import render_html
from scruton.report.render_typst import render_pdf
with house_style():
    figure = Figure(figsize=(4, 1))
    figure.text(0.02, 0.5, {EVERYTHING!r})
    figure.text(0.02, 0.1, r"$\\xi_s$ and $a^*$", weight="bold", style="italic")
page = numbered(Document({EVERYTHING!r}, "a", "s", (Chapter("one", "One", (Paragraph(("words",)),)),), "scruton 0"))
drawn = [*contents(figure), render_pdf(page), render_html(page).encode()]
print(json.dumps({{
    "drawn": [hashlib.sha256(one).hexdigest() for one in drawn],
    "elsewhere": sorted(one.fname for one in fontManager.ttflist if one.fname.startswith(sys.argv[1])),
}}))
"""


def drawn_in(home: Path) -> tuple[dict[str, list[str]], str]:
    """Draw where the home folder is another: digests of the files, the typefaces found there, and what was said."""
    kept = {key: value for key, value in os.environ.items() if not key.startswith(("MPL", "XDG", "FONTCONFIG"))}
    ran = subprocess.run(
        [sys.executable, "-W", "always", "-c", DRAW, str(home)],
        capture_output=True, text=True, check=True, env=kept | {"HOME": str(home)},
    )  # fmt: skip
    return json.loads(ran.stdout), ran.stderr


def renamed(source: Path, family: str, target: Path, index: int = 0) -> None:
    """A copy of a typeface under another name."""
    with TTFont(source, fontNumber=index) as font:
        for i in (1, 4, 16):
            font["name"].setName(family, i, 3, 1, 0x409)
            font["name"].setName(family, i, 1, 0, 0)
        font.save(target)


@pytest.mark.skipif(sys.platform != "linux", reason="folders of typefaces as on Linux")
def test_the_same_bytes_whatever_typefaces_are_installed(tmp_path: Path) -> None:
    bare, rich = tmp_path / "bare", tmp_path / "rich"
    bare.mkdir()
    (rich / ".fonts").mkdir(parents=True)
    other = next(one.path for one in typefaces() if one.family == "Noto Sans Tamil")
    for family in ("DejaVu Sans", "Noto Sans CJK SC", "Noto Emoji", "Libertinus Serif", "cmex10"):
        renamed(other, family, rich / ".fonts" / f"{family}.ttf")
    cjk = next(one for one in typefaces() if one.family == CJK)
    (rich / ".fonts" / "NotoSerifCJK.ttc").symlink_to(cjk.path)
    first, said = drawn_in(bare)
    second, _ = drawn_in(rich)
    assert first["elsewhere"] == []
    assert len(set(second["elsewhere"])) >= 6  # the others are in the way
    assert first["drawn"] == second["drawn"]
    assert said == ""


def test_no_folder_to_write_to_is_no_reason_to_speak(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    code = "from scruton.report.figures.style import house_style\nwith house_style(): pass"
    kept = {key: value for key, value in os.environ.items() if not key.startswith(("MPL", "XDG"))}
    ran = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True,
        env=kept | {"HOME": str(tmp_path / "file" / "home")},
    )  # fmt: skip
    assert ran.stderr == ""
