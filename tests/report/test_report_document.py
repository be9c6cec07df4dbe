"""The document: chapters in order, numbers, exports, and formulae in three languages."""

import base64
import csv
import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray as xr
from fake_fit import ENSEMBLES, fake_fit
from fake_parts import GAP, sizing

from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion, TitleBlock
from scruton.griffin import predict
from scruton.infer.joint import joint_draws
from scruton.report import equations
from scruton.report.chapters import Material, compose
from scruton.report.chapters.decision import decision_sentence
from scruton.report.chapters.gap import gap_chapter
from scruton.report.chapters.required import required_tables
from scruton.report.chapters.sizing import sizing_chapter, sizing_summary
from scruton.report.chapters.together import exceedances, for_any_note, in_percent
from scruton.report.charts import griffin_chart, risk_chart
from scruton.report.conventions import shown_in
from scruton.report.document import (
    Callout,
    Chapter,
    Code,
    Document,
    Equation,
    KeyFigures,
    Listing,
    Paragraph,
    Picture,
    Table,
    numbered,
    paragraph,
    set_in_type,
)
from scruton.report.exports import latex_chapter, latex_table, latex_text, numbers, write_tables
from scruton.report.maths import Maths, display
from scruton.report.render_html import embedded, render_html
from scruton.report.render_text import render_text
from scruton.report.render_typst import render_pdf
from scruton.report.tables import tables
from scruton.report.wording import PAGE, TERMINAL, counted, plain_number
from scruton.sizing.bridge import Bridge, Cost, Mode
from scruton.sizing.checks import CONFIDENCES
from scruton.sizing.existing import offers
from scruton.sizing.limits import limit
from scruton.sizing.size import size
from scruton.stats.convergence import monte_carlo_error

EVIL = """<script>alert('1')</script> "B/D" & 50 % #1 $x_1$ \\ ~^ {y} 矩形断面 ξₛ → λ 🌉"""


@pytest.fixture(scope="module")
def three():
    return fake_fit(growth=False, sweeps=False)


def material(fit, **kwargs) -> Material:
    return Material(fit, tables(fit), **kwargs)


def table(name: str = "one", **kwargs) -> Table:
    return Table(name, "a caption", ("a", "b"), (("x", "1"),), **kwargs)


def text_of(blocks) -> str:
    """Every text of some blocks."""
    return json.dumps([str(one) for one in blocks], ensure_ascii=False)


def test_chapters_stand_in_the_order_of_a_design_report(three) -> None:
    names = (
        "griffin", "griffin_reciprocal", "records", "ring_downs", "aerodynamic_damping", "gap", "risk", "corner_1",
        "trace_1", "something_new",
    )  # fmt: skip
    pictures = [Picture(name, "c", "a", b"<svg/>", b"P") for name in names]
    document = compose(material(three, pictures=pictures, gap=GAP, sizing=sizing()))
    assert [(one.number, one.key) for one in document.chapters] == [
        ("1", "summary"), ("2", "sizing"), ("3", "griffin-plot"), ("4", "predictions"), ("5", "gap"),
        ("6", "validity"), ("7", "campaign"), ("8", "structural"), ("9", "records"), ("10", "aerodynamic"),
        ("11", "reciprocal"), ("A", "posterior"), ("B", "convergence"), ("C", "provenance"), ("D", "methods"),
    ]  # fmt: skip
    assert {one.name for one in document.every(Picture)} == {one.name for one in pictures}, (
        "every picture finds a place"
    )


def test_numbers_are_given_in_order_and_empty_things_are_left_out() -> None:
    empty = Table("none", "c", ("a",), ())
    chapters = (
        Chapter("a", "A", (table("t1"), empty, Picture("p1", "c", "a"))),
        Chapter("b", "B", (empty,)),
        Chapter("c", "C", (Picture("p2", "c", "a", chart={}), table("t2"), Equation(equations.GRIFFIN))),
        Chapter("d", "D", (Equation(equations.INDEX),), appendix=True),
    )
    document = numbered(Document("t", "k", "s", chapters))
    assert [(one.key, one.number) for one in document.chapters] == [("a", "1"), ("c", "2"), ("d", "A")]
    assert [one.number for one in document.every(Table)] == ["1", "2"]
    assert [one.number for one in document.every(Picture)] == ["1", "2"]
    assert [one.number for one in document.every(Equation)] == ["1", "2"]
    with pytest.raises(ValueError, match="tables of one name: t1"):
        numbered(Document("t", "k", "s", (Chapter("a", "A", (table("t1"), table("t1"))),)))


def test_a_bridge_puts_limit_risk_damping_and_confidence_first(three) -> None:
    document = compose(material(three, sizing=sizing(modes=2, flags=("a mode beyond the tests",))))
    summary = document.chapters[0]
    said = text_of(summary.blocks[:1])
    assert "Add a damping ratio of 0.400 % to mode V1 and 0.400 % to mode V2." in said
    assert next(one for one in summary.blocks if isinstance(one, Callout)).lines == (("a mode beyond the tests",),)
    figures = next(one for one in summary.blocks if isinstance(one, KeyFigures)).items
    assert [value for _, value, _ in figures] == ["120 mm", "90.0 %", "5.00 %"]  # of any mode
    assert "limit 100 mm" in figures[0][2]
    names = {one.name for one in document.every(Table)}
    assert {"bridge_similitude", "required_damping", "dampers_1", "dampers_2", "all_modes", "digests"} <= names
    digests = next(one for one in document.every(Table) if one.name == "digests")
    assert ("bridge.toml", "ab" * 32) in digests.rows
    validity = text_of(next(c for c in document.chapters if c.key == "validity").blocks)
    assert "clause to be confirmed" in validity
    assert "a mode beyond the tests" in validity
    assert "raised a flag" not in validity


def test_a_torsional_sizing_is_printed_in_degrees_with_what_the_code_says(three) -> None:
    content = sizing() | {"amplitude_unit": "rad"}
    content["modes"][0] |= {"shares": {"needed": [{"source": "law", "first": 0.5, "total": 0.6}]}}
    content["modes"][0]["limits"][0] |= {"limit": 0.02, "reading": "median K_D = 6.2 mm/s^2, tolerable to unpleasant"}
    printed = render_text(sizing_summary(content))
    assert re.search(r"mode +limit +\[deg\]", printed)
    assert "1.146" in printed
    assert "6.9 (4.6 .. 9.7)" in printed  # 0.12 (0.08 .. 0.17) rad
    assert "rad]" not in printed
    assert "Mode V1, jtg, without added damping: median K_D = 6.2 mm/s^2" in printed
    document = compose(material(three, sizing=content))
    table = next(one for one in document.every(Table) if one.name == "required_damping")
    assert table.rows[0][2] == "1.15°"
    said = "median dynamic sensitivity parameter = 6.2 mm/s², tolerable to unpleasant"
    assert said in text_of(document.every(Listing))


def test_a_sentence_is_set_in_type() -> None:
    said = "x = -0.32 at n=-1, as `scruton fit A --effect auto` of scan-5.csv (1e-5) has it: 30 mm/s^2"
    assert set_in_type(said) == (
        "x = −0.32 at n=-1, as ", Code("scruton fit A --effect auto"), " of scan-5.csv (1e-5) has it: 30 mm/s²",
    )  # fmt: skip
    chapter = Chapter("one", "One", (Listing([said]), Callout("alarm", "head", [said]), paragraph(said)))
    listing, box, words = numbered(Document("t", "k", "s", (chapter,))).chapters[0].blocks
    assert listing.items == box.lines == (words.runs,) == (set_in_type(said),)


def test_a_damping_stands_with_its_monte_carlo_error_and_a_limit_by_its_code(three) -> None:
    content = sizing()
    content["modes"][0]["governing"] = "kd: acceptable"
    content["modes"][0]["limits"][0] |= {
        "rule": "kd: acceptable", "title": "BD 49/01: K_D = f^2 y", "required": dict.fromkeys(CONFIDENCES, 0.00392),
        "required_mcse": dict.fromkeys(CONFIDENCES, 0.000021), "probability": 0.419, "probability_mcse": 0.0021,
    }  # fmt: skip
    table = next(t for t in compose(material(three, sizing=content)).every(Table) if t.name == "required_damping")
    assert table.rows[0][1] == "BD 49/01, acceptable"
    assert table.rows[0][3:] == ("41.9 ± 0.2 %", *["0.392 ± 0.002 %"] * 4)
    assert table.note == "±: Monte Carlo standard error."
    content["modes"][0]["limits"][0] |= {
        "required_by_law": {"n=0": dict.fromkeys(CONFIDENCES, 0.0000614)},
        "required_mcse": dict.fromkeys(CONFIDENCES, 0.00001),
    }
    document = compose(material(three, sizing=content))
    by_law = next(t for t in document.every(Table) if t.name == "required_by_law_1_1")
    rows = {label: cells for label, *cells in by_law.rows}
    assert rows["laws as weighed"] == ["0.392 %"] * 4
    assert rows["under n = 0 alone"] == ["0.006 %"] * 4, "and not 0.00614 %"


def test_numbers_of_the_terminal_have_no_exponent_that_a_reader_would_stumble_over() -> None:
    assert [plain_number(value) for value in (20000.0, 137654.3, 8.24e-5, 1.5e9, 3665.0)] == [
        "20000", "137654", "8.24e-05", "1.5e+09", "3665"
    ]  # fmt: skip


def test_a_design_is_predicted_with_a_bridge_and_without(three) -> None:
    design = [predict(three.tree, scruton_number=30.0, seed=1)]
    for content in (sizing(), None):
        document = compose(material(three, design=design, sizing=content))
        predictions = next(one for one in document.chapters if one.key == "predictions")
        table = next(one for one in predictions.blocks if isinstance(one, Table) and one.name == "design")
        assert table.rows[0][0] == "30"
        assert "summary" not in text_of(predictions.blocks)


def test_the_first_page_without_a_bridge_has_the_plot_what_it_rests_on_and_what_could_overturn_it(three) -> None:
    picture = Picture("griffin", "c", "a", b"<svg/>", b"P")
    design = [predict(three.tree, scruton_number=200.0, seed=1)]
    missed = design[0].to_json() | {"amplitude": {"median": 1.0, "interval": {"0.90": [0.9, 1.1]}}}
    content = material(three, pictures=[picture], design=design, crossed={"Sc 1.9": missed}, gap=GAP)
    first, *others = compose(content).chapters
    assert [one.name for one in first.blocks if isinstance(one, Picture)] == ["griffin"]
    assert not [one for chapter in others for one in chapter.blocks if isinstance(one, Picture)]
    said = text_of(first.blocks)
    for words in (
        "What it rests on", "Law of aerodynamic damping: n = −1", "model card “default”", "extrapolation index of",
        "What could overturn it", "that the other tests give: Sc 1.9", "Diagnosis: The null model",
    ):  # fmt: skip
        assert words in said, words
    assert "was not looked for" in text_of(compose(material(three)).chapters[0].blocks)


def test_the_paper_is_cited_beside_the_program(three) -> None:
    (code,) = [one.text for one in compose(material(three)).chapters[-1].blocks if isinstance(one, Code)]
    assert "@article{gao-griffin-plots," in code
    assert "Gao, Guangzhong and Li, Suhan and Hao, Jianming and Fu, Bo and Yang, Shucheng and Zhu, Ledong" in code
    assert "@software{scruton," in code
    assert not re.search(r"journal\s*=|doi\s*=", code), "what its text does not say is not made up"


def test_a_risk_has_the_digits_that_its_draws_give(three) -> None:
    assert [counted(p) for p in (0.000824, 0.0, 0.05, 0.782)] == ["0.08 %", "0.000 %", "5.0 %", "78.2 %"]
    content = sizing()
    content["modes"][0]["damper"]["probability"] = 27 / 2**15
    assert "The risk left is 0.08 %; " in text_of(compose(material(three, sizing=content)).chapters[1].blocks)


@pytest.mark.parametrize(
    ("required", "said"),
    [
        (0.0, "Keep the bridge as it is"),
        (None, "needs an added damping ratio of more than 5.00 %, the most that is looked at"),
    ],
)
def test_the_first_page_says_what_damping_does_not_do(three, required: float | None, said: str) -> None:
    document = compose(material(three, sizing=sizing(required)))
    assert said in text_of(document.chapters[0].blocks)


def test_the_first_page_names_the_cap_that_binds_where_more_damping_is_needed_than_is_looked_at() -> None:
    content = sizing(None)
    (mode,) = content["modes"]
    mode["damper"]["mass"] = 2500.0
    assert "Enough for mode V1: one tuned mass damper of 2.50 t at 0.300 Hz." in decision_sentence(content)
    damper = mode["damper"] | {
        "achievable": False, "probability": 0.061, "mass_ratio": 0.05,
        "asked": {"risk": 0.05, "largest_mass_ratio": 0.05, "largest_stroke": 0.5},
        "map": {"mass_ratio": [0.05, 0.07, 0.1], "probability": [0.061, 0.015, 0.001], "stroke_high": [0.2, 0.6, 0.5]},
    }  # fmt: skip
    mode["damper"] = damper
    said = decision_sentence(content)
    for words in ("held to 5 %, which leaves a risk of 6.10 %; one of 10 % would leave 0.100 %", "or more of them"):
        assert words in said, said
    assert "Change the section" not in said
    mode["damper"] = damper | {"map": damper["map"] | {"probability": [0.99, 0.98, 0.97]}}
    assert decision_sentence(content).endswith("Change the section of mode V1, or its limit.")


def test_of_dampers_that_do_not_keep_the_risk_it_is_not_said_that_they_do(three) -> None:
    content = sizing()
    damper = content["modes"][0]["damper"]
    damper["asked"] |= dict.fromkeys(("frequency_tolerance", "damping_tolerance", "mass_tolerance"), 0.01)
    damper["asked"] |= {"kept_detuning": 0.02, "temperature_detuning": 0.0}
    for damper["achievable"], verb in ((True, "is"), (False, "was to be")):
        page = text_of(compose(material(three, sizing=content)).chapters[1].blocks)
        assert f"the risk {verb} kept where the bridge is 2 % off frequency, too" in page
        assert ("the frequency off by just that" in page) is not damper["achievable"]


def test_the_first_page_says_what_to_test_and_what_could_overturn_it(three) -> None:
    content = sizing()
    limit = content["modes"][0]["limits"][0]
    reach = {"scruton_number": 35.2, "extrapolation_index": 1.4, "covered_by": 1, "tests": 3, "trusted": False}
    limit |= {
        "reach": {"0.95": reach}, "required_by_hand": 0.0031,
        "required_by_law": {"n=-1": {"0.95": 0.004}, "n=2": {"0.95": None}, "law-free": {"0.95": 0.0044}},
    }  # fmt: skip
    content["laws"] = {"n=-1": 1.0}
    page = text_of(compose(material(three, sizing=content)).chapters[0].blocks)
    for said in (
        "Test a rig at a Scruton number of about 35", "index of 1.4", "transients of 1 of 3 tests",
        "0.440 %", "0.310 %",
        "n = −1 asks for 0.400 %, n = 2 asks for more than 5.00 %", "was not looked for",
    ):  # fmt: skip
        assert said in page, said
    limit |= {"reach": {}, "required_at_discrepancy": {"0.20": {"0.95": 0.009}}}
    page = text_of(compose(material(three, sizing=content)).chapters[0].blocks)
    assert "Test a second rig" in page
    assert "Where rigs miss the curve by 20 %: 0.900 %" in page


@pytest.mark.parametrize(("unit", "line"), [("m", "1/A = 13.1"), ("rad", "1/A = 0.2287 + 0.01730 Sc, A in °,")])
def test_the_line_by_hand_is_written_out(unit: str, line: str) -> None:
    content = sizing() | {"amplitude_unit": unit}
    at = {
        "intercept": 13.1039,
        "slope": 0.9911,
        "amplitude": 0.02624,
        "scruton_number": 25.23,
        "damping_ratio": 0.00274,
    }
    content["modes"][0]["limits"][0] |= {"required_by_hand": 0.00167, "by_hand": at}
    (note,) = (table.note for table in required_tables(content, PAGE))
    for part in (line, "A = 1.503° " if unit == "rad" else "A = 0.02624 D", "Sc = 25.23", "0.274 %"):
        assert part in note, (part, note)
    (plain,) = (table.note for table in required_tables(content, TERMINAL))
    assert plain.isascii()


def test_a_required_damping_that_lies_far_from_the_tests_is_marked_where_it_is_first_told(three) -> None:
    content = sizing()
    limit = content["modes"][0]["limits"][0]
    reach = {"scruton_number": 35.2, "extrapolation_index": 1.4, "covered_by": 1, "tests": 3, "trusted": False}
    limit |= {"required": dict.fromkeys(CONFIDENCES, 0.004), "reach": {"0.95": reach}}
    content["modes"][0] |= {"shares": {"needed": []}}
    for blocks in (sizing_summary(content), sizing_chapter(material(three, sizing=content))):
        table = next(one for one in blocks if getattr(one, "name", "") in ("required", "required_damping"))
        assert [cell.endswith(" !") for cell in table.rows[0][4:]] == [p == "0.95" for p in CONFIDENCES]
        assert "far from what was tested" in table.note
    limit |= {"required": limit["required"] | {"0.95": None}}
    (table,) = required_tables(content, TERMINAL)
    (there,) = (row for row in table.rows if row[0] == "Sc there")
    assert there[1 + CONFIDENCES.index("0.95")] == "> 35.2", "with all that can be added, at the least"
    (index,) = (row for row in table.rows if row[0] == "x there")
    assert index[1 + CONFIDENCES.index("0.95")] == "> 1.4 !"
    page = text_of(compose(material(three, sizing=content)).chapters[0].blocks)
    assert "The answer lies beyond Sc 35.2, an extrapolation index of at least 1.4 " in page
    note = for_any_note({"names": ["V1"], "required_for_any": {"risk": 0.05, "required": [None], "reach": [reach]}})
    assert "V1 more than 5.00 % (beyond Sc 35.2, x of at least 1.4, " in note
    limit |= {"reach": {"0.95": reach | {"trusted": True}}}
    table = next(one for one in sizing_summary(content) if getattr(one, "name", "") == "required")
    assert "!" not in "".join(table.rows[0]) + table.note


def test_the_damping_for_any_mode_says_how_far_it_lies_from_the_tests() -> None:
    reach = {"scruton_number": 35.2, "extrapolation_index": 1.4, "covered_by": 1, "tests": 3, "trusted": False}
    found = {"risk": 0.05, "required": [0.003, 0.0, None], "reach": [reach, reach | {"trusted": True}, None]}
    note = for_any_note({"names": ["V1", "V2", "V3"], "required_for_any": found})
    place = "(Sc 35.2, x 1.4, transients of 1 of 3 tests through the limit's amplitude"
    for said in (f"V1 0.300 % {place}, far from what was tested)", f"V2 none {place})", "V3 more than 5.00 %."):
        assert said in note, (said, note)


def test_risks_of_any_mode_and_the_damping_for_it_have_their_monte_carlo_errors() -> None:
    content = two_modes()
    content["amplitude_unit"] = "m"
    for mode in content["modes"]:
        mode["amplitude"] = mode["amplitude"] | {"mcse": [0.0012, 0.001, 0.002]}
        mode["shares"] = {"needed": []}
    every = content["all_modes"]
    every["without"] = {"each": [0.8, 0.8, 0.0], "any": 0.9123, "each_mcse": [0.003, 0.003, 0.0], "any_mcse": 0.0024}
    every["required_for_any"] |= {"required_mcse": [2e-5, 6e-5, 0.0]}
    blocks = {block.name: block for block in sizing_summary(content) if isinstance(block, Table)}
    table = blocks["all_modes"]
    assert table.rows[0] == ("as it is", "0.800", "0.800", "0.000", "0.912"), "to the digit of its error"
    assert "of the probabilities: at most 0.3 %" in table.note
    assert "V1 0.300 ± 0.002 %, V2 0.700 ± 0.006 %, V3 none" in table.note
    factor, _ = shown_in("m")
    wanted = [TERMINAL.number(factor * one, 2) for one in (0.0012, 0.002)]
    assert f"at most {wanted[0]} of medians, {wanted[1]} of the ends" in blocks["modes"].note
    assert exceedances(content, in_percent)[0] == ("as it is", "80.0 %", "80.0 %", "0.000 %", "91.2 %")
    del every["without"]["each_mcse"], every["without"]["any_mcse"]
    assert exceedances(content, in_percent)[0] == ("as it is", *map(counted, (0.8, 0.8, 0.0, 0.9123)))


def two_modes() -> dict:
    """V2 needs most, V1 less, V3 nothing; all dampers leave less than the damping that each mode needs by itself."""
    content = sizing(modes=3)
    damper = content["modes"][0]["damper"]
    for mode, required, mass in zip(content["modes"], (0.002, 0.006, 0.0), (2500.0, 4000.0, None), strict=True):
        limit = mode["limits"][0] | {"required": dict.fromkeys(CONFIDENCES, required)}
        one = damper["dampers"][0] | {"mass": mass}
        mode |= {"limits": [limit], "damper": damper | {"mass": mass, "dampers": [one] if mass else []}}
    content["all_modes"] |= {
        "with_required_damping": {"each": [0.05, 0.05, 0.0], "any": 0.09},
        "with_dampers": {"each": [0.01, 0.03, 0.0], "any": 0.035},
        "required_for_any": {"risk": 0.05, "confidence": 0.975, "required": [0.003, 0.007, 0.0], "reach": [None] * 3,
                             "left": {"each": [0.025, 0.026, 0.0], "any": 0.05}},
    }  # fmt: skip
    return content


def first_page(three, content) -> tuple[str, list[tuple[str, str, str]]]:
    blocks = compose(material(three, sizing=content)).chapters[0].blocks
    figures = next(one for one in blocks if isinstance(one, KeyFigures)).items
    return " ".join(str(run) for run in blocks[0].runs), list(figures)


def test_the_first_page_names_every_mode_the_worst_first_and_the_risk_of_any(three) -> None:
    said, figures = first_page(three, two_modes())
    assert said == (
        "Add a damping ratio of 0.600 % to mode V2, such as by one tuned mass damper of 4.00 t at 0.300 Hz and 0.200 % "
        "to mode V1, such as by one tuned mass damper of 2.50 t at 0.300 Hz. Mode V3 stays below its limit as the "
        "bridge is."
    )
    assert [value for _, value, _ in figures] == ["120 mm", "90.0 %", "3.50 %"]
    assert "mode V2" in figures[1][2]
    assert figures[2][0] == "Risk of any mode with all dampers"


def test_the_first_page_says_what_the_draws_know_its_numbers_to(three) -> None:
    content = two_modes()
    assert "Monte Carlo standard errors" not in text_of(compose(material(three, sizing=content)).chapters[0].blocks)
    mode = content["modes"][1]
    mode["amplitude"] = mode["amplitude"] | {"mcse": [0.0012, 0.001, 0.002]}
    mode["limits"][0] |= {"probability_mcse": 0.002, "required_mcse": dict.fromkeys(CONFIDENCES, 3e-5)}
    said = text_of(compose(material(three, sizing=content)).chapters[0].blocks)
    assert (
        "Monte Carlo standard errors (mode V2): median amplitude 120 ± 1 mm, risk as it is 80.0 ± 0.2 %, damping to "
        "add with 95 % confidence 0.600 ± 0.003 %."
    ) in said


def test_the_first_page_asks_for_the_damping_of_any_mode_where_the_bridge_does(three) -> None:
    content = two_modes()
    for mode in content["modes"]:
        mode["damper"] = mode["damper"] | {"asked": {"risk": 0.05, "risk_of": "any"}}
    said, _ = first_page(three, content)
    assert said.startswith("For a risk of 5.00 % of any mode, add a damping ratio of 0.700 % to mode V2,")
    assert "0.300 % to mode V1" in said


def test_the_first_page_has_the_modes_of_the_other_motion(three) -> None:
    content = two_modes()
    far = {"scruton_number": 6.2, "extrapolation_index": 2.8, "covered_by": 3, "tests": 3, "trusted": False}
    content["both"] = {
        "names": ["V1", "V2", "V3", "T1"], "motions": [*["heaving"] * 3, "torsional"],
        "edge": [{"median": 0.1, "low": 0.05, "high": 0.2}] * 4, "required": [0.002, 0.006, 0.0, 0.009],
        "reach": [None, None, None, far], "dampers": [[], [], [], [{"mass": 22e3, "frequency": 0.8}]],
        "trusted": [True] * 4, "without": {"each": [0.8, 0.8, 0.8, 0.7], "any": 0.95},
        "with_dampers": {"each": [0.01, 0.03, 0.0, 0.02], "any": 0.045},
    }  # fmt: skip
    said, figures = first_page(three, content)
    assert said.startswith(
        "Add a damping ratio of 0.900 % to mode T1 (torsional), such as by one tuned mass damper of 22.0 t at 0.800 Hz,"
    )
    assert "Test a rig at a Scruton number of about 6.2 (mode T1 (torsional))" in said
    assert [value for _, value, _ in figures] == ["120 mm", "95.0 %", "4.50 %"]
    content["both"]["trusted"] = [True, True, True, False]
    said, _ = first_page(three, content)
    assert "to mode T1" not in said
    assert "Decide nothing on mode T1 (torsional): the fit did not converge." in said


def test_the_limits_of_validity_hold_the_required_damping_and_what_the_sizing_applies(three) -> None:
    content, fit = two_modes(), three
    reach = {"scruton_number": 48.9, "extrapolation_index": 3.5, "covered_by": 3, "tests": 3, "trusted": False}
    content["modes"][1]["limits"][0]["reach"] = {"0.95": reach}
    design = [predict(fit.tree, scruton_number=15.0, seed=1)]
    rows, said = validity(fit, design, content)
    assert rows[0][0] == "design"
    assert rows[-1] == ("mode V2 with 0.600 % added", "48.9", "–", "–", "–", "3.5", "3 of 3", "NO")
    assert "details of the section are those of the tunnel" in said
    factor = {"mean": 1.0, "sd": 0.15}
    content["bridge"]["transfer"] = dict.fromkeys(("turbulence", "reynolds_number", "details"), factor) | {
        "assumed": True
    }
    _, said = validity(fit, design, content)
    assert "a prediction at a Scruton number is that of the model" in said
    assert "multiplies the amplitude, assumed" in said
    assert "turbulence 1.00 ± 0.15" in said


def validity(fit, design, content) -> tuple[list[tuple[str, ...]], str]:
    document = compose(material(fit, design=design, sizing=content))
    table = next(one for one in document.every(Table) if one.name == "extrapolation")
    return list(table.rows), text_of(next(c for c in document.chapters if c.key == "validity").blocks)


def test_one_mode_has_no_column_of_any_and_the_worst_stands_beside_the_risk_left() -> None:
    content = sizing()
    content["modes"][0] |= {"shares": {"needed": [{"source": "law", "first": 0.5, "total": 0.6}]}}
    content["modes"][0]["damper"] |= {"probability_worst": 0.058}
    hours = {"lock_in": [[8.0, 9.0]], "assumed": [True], "a_year": [100.0], "exceeding_a_year": [40.0],
             "exceeding_with": {"with_required_damping": [2.0], "with_dampers": [1.5]}}  # fmt: skip
    content["all_modes"] |= {"hours": hours}
    text = render_text(sizing_summary(content))
    assert re.search(r"\bany\b", text) is None
    assert "risk left 0.050 (0.058 with vibrations that only a start from above leads to)" in text
    assert re.search(r"V1 .* 40 +2 +1.5(\n|$)", text)


def test_nothing_is_decided_on_a_fit_that_did_not_converge(three) -> None:
    untrusted = replace(three, converged=False)
    content = sizing(flags=("not to be trusted: test 1 did not converge", "another"))
    for of_the_fit, verdict in (({}, untrusted), ({"unconverged": ["test 1"]}, three)):
        blocks = compose(material(verdict, sizing=content | of_the_fit)).chapters[0].blocks
        assert isinstance(blocks[0], Callout)
        assert blocks[0].lines == (("not to be trusted: test 1 did not converge",),)
        assert "Decide nothing on these numbers" in text_of(blocks)
        assert "Add a damping" not in text_of(blocks)
    # the sampling of what no sizing rests on, such as trial functions, decides nothing either way
    page = text_of(compose(material(untrusted, sizing=content | {"unconverged": []})).chapters[0].blocks)
    assert "Add a damping" in page
    assert "Decide nothing" not in page


def with_failed(tree, *names: str):
    """The tree of a fit of which these posteriors did not converge."""
    failed = tree.copy(deep=True)
    table = failed["convergence"]
    posteriors = table["posterior"].to_numpy().astype(str)
    assert all((posteriors == name).any() for name in names), sorted(set(posteriors))
    table["converged"] = table["converged"].copy(data=~np.isin(posteriors, names))
    return failed


@pytest.mark.thorough
def test_nothing_is_priced_or_judged_on_posteriors_that_did_not_converge(three) -> None:
    mode = Mode("V1", Quantity(0.3, 0.003), Quantity(2e4), 4e6, damping_ratio=Quantity(0.003, 0.001))
    bridge = Bridge(
        "b", Motion.HEAVING, 12.0, 3.0, 1.225, Quantity(1.0), (limit("0.05"),), (mode,),
        cost=Cost(per_percent=1e6, per_kg=20.0, failure=1e7),
    )  # fmt: skip
    posteriors = dict.fromkeys(three.tree["convergence"]["posterior"].to_numpy().astype(str))
    trial = next(name for name in posteriors if name.startswith("trial function of"))
    rig = next(name for name in posteriors if name.startswith("rig "))
    offer = offers("20 t, 0.3 Hz, 0.1")
    (found,) = size([(with_failed(three.tree, rig, trial), bridge)], offers=offer)
    assert found.unconverged == (rig,)
    assert "not to be trusted" in found.flags[0]
    assert rig in found.flags[0]
    assert sum("criticise" in flag for flag in found.flags) == 1
    assert found.modes[0].cost is None
    assert found.existing is None
    assert found.all_modes.with_dampers is None
    assert not found.modes[0].damper.dampers
    text = render_text(sizing_summary(found.to_json()))
    assert text.index("not to be trusted") < text.index("Added damping")
    assert "Least expected cost" not in text
    (good,) = size([(with_failed(three.tree, trial), bridge)], offers=offer)
    assert good.unconverged == ()
    assert good.modes[0].cost is not None
    assert good.existing is not None
    assert any(trial in flag and "nothing of the sizing rests on that" in flag for flag in good.flags)


@pytest.mark.thorough
def test_a_sizing_and_a_report_say_which_laws_answer_without_having_converged(three) -> None:
    """The law has its share of the weight whatever the records say: the fit is trusted, and the share is told."""
    tree = three.tree.copy(deep=True)
    share = xr.DataArray([0.9, 0.1, 0.0, 0.0], coords={"law": tree["laws"]["law"]})
    tree["laws"] = xr.DataTree(
        tree["laws"].to_dataset().assign(weight=share, common_weight=share.where(share < 0.5, 0.0))
    )
    rows = {"posterior": ["campaign, n=-1", "campaign, n=0"], "converged": [True, False]}
    tree["convergence"] = xr.DataTree(xr.Dataset({name: ("row", values) for name, values in rows.items()}))
    mode = Mode("V1", Quantity(0.3, 0.003), Quantity(2e4), 4e6, damping_ratio=Quantity(0.003, 0.001))
    bridge = Bridge("b", Motion.HEAVING, 12.0, 3.0, 1.225, Quantity(1.0), (limit("0.05"),), (mode,))
    (found,) = size([(tree, bridge)])
    assert found.unconverged == ()
    (flag,) = [flag for flag in found.flags if "did not converge" in flag]
    assert "hold 10% of the weight of the answer: n=0 (10%); to mend it raise sampler.max_steps" in flag
    assert flag in found.to_json()["flags"]
    assert "hold 10% of the weight" in " ".join(render_text(sizing_summary(found.to_json())).split())
    page = text_of(compose(material(three, sizing=found.to_json())).chapters[0].blocks)
    assert "hold 10 % of the weight of the answer: n = 0 (10 %)" in page
    (alone,) = size([(tree, bridge)], law_n=-1.0)
    assert not any("did not converge" in flag for flag in alone.flags)


def test_the_gap_is_told_with_where_and_how_far_it_shrinks(three) -> None:
    said = text_of(gap_chapter(material(three, gap=GAP)))
    for words in ("closes 94 % (90 % interval 87 % to 96 %)", "87 % (90 % interval 71 % to 93 %)", "one more decay",
                  "a gain of all channels", "8 more are in gap.json", "probability above 0.99"):  # fmt: skip
        assert words in said, words
    nothing = {**GAP, "verdict": "none", "shrink": {}, "where": [], "effects": {}, "advice": [], "invisible": []}
    nothing["probability"] = {"none": 0.9, "coulomb_friction": 0.1}
    assert "agree within their noise" in text_of(gap_chapter(material(three, gap=nothing)))
    assert list(gap_chapter(material(three))) == []
    for gap, words in ((GAP, "Diagnosis: The null model and the records part"), (nothing, "agree within their noise")):
        assert words in text_of(compose(material(three, gap=gap)).chapters[0].blocks)


def test_monte_carlo_errors_stand_beside_what_a_report_prints_for_a_decision(three) -> None:
    """Posteriors, tested Scruton numbers, predictions from others, and the first page where there is no bridge."""

    def errors(one) -> list[str]:
        return [PAGE.number(one.error(p), 2) for p in (0.5, 0.05, 0.95)]

    def at_most(one) -> str:
        ends = PAGE.number(max(one.error(0.05), one.error(0.95)), 2)
        return f"at most {errors(one)[0]} of medians, {ends} of the ends of intervals"

    one, other = (predict(three.tree, scruton_number=sc, seed=1) for sc in (30.0, 21.7))
    content = material(
        three, design=[one], at_tests={"Sc 21.7": other}, crossed={"Sc 1.9": one.to_json() | {"sc": 1.93}}
    )
    blocks = {key: chapter.blocks for key, chapter in ((one.key, one) for one in compose(content).chapters)}
    every = [block for of in blocks.values() for block in of]
    of_table = {block.name: block for block in every if isinstance(block, Table)}
    assert f"Monte Carlo errors of another setting {at_most(other)}" in of_table["stable_amplitudes"].note
    assert "Monte Carlo errors of this test at most" in of_table["stable_amplitudes"].note
    assert f"Monte Carlo errors of predictions {at_most(one)}" in of_table["crossed"].note
    table, draws = of_table["posterior_1"], joint_draws(three.tree).tests["Sc 1.9"]["a_star"].reshape(ENSEMBLES, -1)
    wanted = ", ".join(PAGE.number(monte_carlo_error(draws, p), 2) for p in (0.5, 0.05, 0.95))
    assert table.header[-1] == "MC errors"
    assert next(row for row in table.rows if row[0].startswith("stable amplitude"))[-1] == wanted
    assert "50 % intervals at most" in table.note
    said = text_of(compose(content).chapters[0].blocks)
    assert f"(Monte Carlo errors {', '.join(errors(one))})" in said
    assert f"MC errors {', '.join(errors(one))}" in said
    said = text_of(compose(material(three)).chapters[0].blocks)
    assert f"(Monte Carlo errors {wanted})" in said, "of a peak test, where nothing is designed"


def test_a_design_whose_amplitude_no_transient_saw_is_not_within_reach(three) -> None:
    """As a prediction is flagged; so are modes with their required damping."""
    near = predict(three.tree, scruton_number=25.0)
    assert abs(near.extrapolation_index) < 0.3
    cells = []
    for design in (replace(near, covered_by=3), replace(near, covered_by=0)):
        chapters = {chapter.key: chapter for chapter in compose(material(three, design=[design])).chapters}
        (table,) = (one for one in chapters["validity"].blocks if isinstance(one, Table))
        assert "Within reach: x is no farther from zero than 0.3, and a transient of some test" in table.note
        cells.append(table.rows[0][-2:])
    assert cells == [("3 of 3", "yes"), ("0 of 3", "NO")]


def test_the_chart_reads_what_predict_says(three) -> None:
    design = [predict(three.tree, scruton_number=sc, seed=1) for sc in (30.0, 12.5)]
    data = griffin_chart(three, design)
    assert data["x"]["start"] == 30.0
    for one in design:
        low, high = one.interval(0.90)
        for key, value in (("median", one.median), ("low", low), ("high", high)):
            assert np.interp(one.scruton_number, data["grid"], data["read"][key]) == pytest.approx(value, rel=2e-3)
    assert [point["y"] for point in data["points"]] == [0.06551, 0.0292, 0.01106], "measured"
    assert {line["tone"] for line in data["lines"]} == {"own", "deterministic"}
    json.dumps(data, allow_nan=False)


def test_a_risk_curve_is_read_in_per_cent_of_damping() -> None:
    mode = sizing()["modes"][0] | {"name": "V1"}
    data = risk_chart(mode, mode["limits"][0]["curve"], "probability")
    assert data["grid"] == [0.0, 0.2, 0.4]
    assert data["read"]["median"] == [0.8, 0.3, 0.05]
    assert data["read"]["also"][0]["values"] == [15.0, 25.0, 35.0]


def test_embedded_json_cannot_end_the_script() -> None:
    text = embedded({"label": "</script><!--\u2028&", "x": None})
    assert not set("<>&\u2028") & set(text)
    assert json.loads(text) == {"label": "</script><!--\u2028&", "x": None}
    with pytest.raises(ValueError, match="JSON"):
        embedded({"x": float("nan")})


FORMULAE = [(name, one) for name, one in vars(equations).items() if isinstance(one, Maths)]


@pytest.mark.parametrize(("name", "maths"), FORMULAE, ids=[name for name, _ in FORMULAE])
def test_every_formula_is_well_formed(name: str, maths: Maths) -> None:
    ElementTree.fromstring(display(maths))
    assert maths.latex.count("{") == maths.latex.count("}"), name
    assert maths.latex.count(r"\left") == maths.latex.count(r"\right")


def test_latex_escapes_what_it_would_obey() -> None:
    text = latex_text(EVIL)
    assert r"\textless{}script\textgreater{}" in text
    assert r"\& 50 \% \#1 \$x\_1\$ \textbackslash{} \textasciitilde{}\textasciicircum{} \{y\}" in text
    assert "矩形断面" in text
    found = latex_table(Table("a_b", EVIL, ("x", "[m]"), ((EVIL, "[1]"),)))
    assert not re.search(r"(?<!\\)[%$#]", found.replace("% needs \\usepackage", ""))
    assert found.count(r"\\") >= 2
    assert r"{}[m] \\" in found, "a bracket after a line break would be an argument"
    assert r"\toprule" in found


def test_methods_can_be_pasted(three) -> None:
    text = latex_chapter(compose(material(three)), "methods")
    assert text.count(r"\begin{equation}") == text.count(r"\end{equation}") == 8
    assert r"\frac{\mathrm{d}a}{\mathrm{d}t}" in text
    assert latex_chapter(compose(material(three)), "nowhere") == ""


@pytest.mark.skipif(shutil.which("xelatex") is None, reason="no xelatex here")
def test_latex_accepts_the_tables(three, tmp_path: Path) -> None:
    body = "\n".join(latex_table(one) for one in compose(material(three)).every(Table))
    (tmp_path / "a.tex").write_text(
        f"\\documentclass{{article}}\\usepackage{{booktabs}}\\begin{{document}}{body}\\end{{document}}",
        encoding="utf-8",
    )
    done = subprocess.run(["xelatex", "-interaction=batchmode", "a.tex"], cwd=tmp_path, check=False)
    assert done.returncode == 0


def test_every_table_has_a_csv_and_a_latex_file_and_every_number_is_in_the_json(three, tmp_path: Path) -> None:
    frames = tables(three)
    whole = Material(three, frames, gap=GAP, sizing=sizing())
    document = compose(whole)
    names = {path.name for path in write_tables(document, frames, tmp_path)}
    for one in document.every(Table):
        assert f"{one.name}.tex" in names
        assert f"{one.data or one.name}.csv" in names, one.name
    with (tmp_path / "gap_where.csv").open(encoding="utf-8") as file:
        assert next(csv.reader(file))[0] == "what"
    content = numbers(whole, document)
    json.dumps(content, allow_nan=False)
    row = next(one for one in content["tables"]["posterior"] if one["parameter"] == "a_star")
    draws = three.tree["posterior"]["a_star"].sel(test=row["of"]).values
    assert row["median"] == pytest.approx(np.median(draws))
    assert {"gap_where", "required_damping"} <= set(content["tables"])


def test_runs_of_a_paragraph_keep_their_blanks() -> None:
    document = Document("t", "k", "s", (Chapter("m", "M", (Paragraph(("a ", Code("b_c"), " d")),)),))
    assert latex_chapter(document, "m") == "a \\texttt{b\\_c} d\n"


def test_a_sizing_flags_what_a_bridge_can_hardly_be(three) -> None:
    mode = Mode("V1", Quantity(0.3, 0.3), Quantity(1e12), damping_ratio=Quantity(0.3))
    odd = Bridge("odd", Motion.HEAVING, 12.0, 3.0, 1.225, Quantity(0.95, 0.1, "normal"), (limit("jtg"),), (mode,))
    (found,) = size([(three.tree, odd)])
    said = "; ".join(found.flags)
    for words in (
        "of the frequency is 100 % of its mean",
        "mass over that of the air displaced",
        "lies above 1",
        "is 30 %,",
    ):
        assert words in said


def test_the_title_block_and_the_logo_are_in_page_and_pdf(three) -> None:
    logo = (
        "data:image/svg+xml;base64,"
        + base64.b64encode(
            b'<svg xmlns="http://www.w3.org/2000/svg" width="20" height="10"><rect width="20" height="10"/></svg>'
        ).decode()
    )
    block = TitleBlock(project="Crossing <of> the Sound", checker="B. Checker", colour="#005f87", logo=logo)
    document = compose(material(replace(three, campaign=replace(three.campaign, title_block=block))))
    page = render_html(document)
    assert "Crossing &lt;of&gt; the Sound" in page
    assert f'src="{logo}"' in page
    assert page.count("border-color: #005f87") == 1 + len(document.chapters)
    assert render_pdf(document).startswith(b"%PDF")
    bare = render_html(compose(material(three)))
    assert "title-block" not in bare.partition("</style>")[2]
