"""How quantities are shown: degrees, decrements, the Eurocode's Scruton number; and no identifier in prose."""

import json
import pickle
import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from fake_fit import fake_fit
from fake_parts import GAP, sizing

from scruton import said
from scruton.campaign.schema import Motion
from scruton.griffin import predict
from scruton.infer.results import Fit
from scruton.report.chapters import Material, compose
from scruton.report.chapters.prose import in_words
from scruton.report.charts import griffin_chart, risk_chart
from scruton.report.conventions import (
    conventions,
    damping,
    damping_label,
    flag_texts,
    parameter_words,
    scruton,
    shown_in,
)
from scruton.report.document import Code, Document, Picture, Table
from scruton.report.figures import FigureWithCaption, all_figures
from scruton.report.figures.griffin import griffin_plot
from scruton.report.figures.sizing import required_plot
from scruton.report.maths import Maths
from scruton.report.render_text import render_text
from scruton.report.summaries import fit_summary, prediction_summary
from scruton.report.tables import tables
from scruton.sizing.transfer import Transfer, transfer_remarks

# Letters joined by a line to others; a name with an index; a key in brackets, which hold units and numbers else.
IDENTIFIER = re.compile(r"\b[A-Za-z]+\d*_[A-Za-z]\w*|\b[a-z]\w*\[\w[^]]*\]|\[(?!steps\])[a-z_]{4,}\]")
OTHER = {"damping": "decrement", "scruton_number": "eurocode"}


def asked(fit: Fit, **stated: str) -> Fit:
    """A fit of a campaign whose `[report]` states conventions."""
    campaign = replace(fit.campaign, title_block=replace(fit.campaign.title_block, **stated))
    return replace(fit, campaign=campaign, summary={**fit.summary, "conventions": campaign.conventions})


@cache
def drawn(fit: Fit) -> list[FigureWithCaption]:
    """Its figures, which take most of the time: once for a fit."""
    return list(all_figures(fit))


def document_of(fit: Fit, *, illustrated: bool = True, **content: Any) -> Document:
    design = [predict(fit.tree, scruton_number=30.0 if fit.campaign.section.motion is Motion.HEAVING else 0.8, seed=1)]
    figures = drawn(fit) if illustrated else []
    pictures = [Picture(one.name, one.caption, one.alt, b"<svg/>") for one in figures]
    return compose(Material(fit, tables(fit), pictures, design, **content))


def texts(value: Any, *, cells: bool = True) -> Iterator[str]:
    """Every text that a reader meets; code and formulae are none."""
    match value:
        case str():
            yield value
        case Code() | Maths():
            pass
        case tuple() | list():
            for one in value:
                yield from texts(one, cells=cells)
        case _ if is_dataclass(value):
            left_out = {"key", "name", "data", "role", "chart", "svg", "png", *(() if cells else ("rows",))}
            for field in fields(value):
                if field.name not in left_out:
                    yield from texts(getattr(value, field.name), cells=cells)


@pytest.fixture(scope="module")
def heaving() -> Fit:
    return fake_fit(growth=False, sweeps=False)


@pytest.fixture(scope="module")
def twisting() -> Fit:
    return fake_fit(motion=Motion.TORSIONAL, growth=False, sweeps=False)


@pytest.fixture(scope="module")
def plain(heaving: Fit) -> Document:
    return document_of(heaving, gap=GAP, sizing=sizing())


@pytest.fixture(scope="module")
def other(heaving: Fit) -> Document:
    content = sizing(flags=("it lies at Sc 30",)) | {"conventions": {**OTHER, "scruton_factor": 4.0}}
    return document_of(asked(heaving, **OTHER), gap=GAP, sizing=content)


def numbers(cell: str) -> list[float]:
    return [float(one.replace("−", "-")) for one in re.findall(r"[−]?\d+\.?\d*", cell)]


def table_of(document: Document, name: str) -> Table:
    return next(one for one in document.every(Table) if one.name == name)


@pytest.mark.parametrize(
    ("name", "column", "factor"),
    [
        ("similitude", 3, 4.0), ("similitude", 6, 0.02 * np.pi),
        ("stable_amplitudes", 2, 4.0), ("damping", 4, 0.02 * np.pi), ("bridge_similitude", 4, 4.0),
        ("required_damping", 6, 0.02 * np.pi), ("extrapolation", 1, 4.0), ("dampers_1", 4, 0.02 * np.pi),
        ("ring_downs", 2, 0.02 * np.pi),
    ],
)  # fmt: skip
def test_tables_show_what_was_asked_for(plain, other, name, column, factor):
    before, after = table_of(plain, name), table_of(other, name)
    found = [(numbers(a[column]), numbers(b[column])) for a, b in zip(before.rows, after.rows, strict=True)]
    assert found
    assert any(one for one, _ in found)
    for ours, theirs in found:
        np.testing.assert_allclose(theirs, factor * np.array(ours), rtol=0.03)


def test_sentences_speak_of_decrements_and_say_which_scruton_number(other):
    said = "\n".join(texts(other))
    assert "damping ratio of" not in said
    assert "Add a logarithmic decrement of 0.0251 to mode V1" in said  # 2 pi times 0.004
    assert "Scruton numbers are those of EN 1991-1-4" in said
    assert "B/D = 4 times" in said


def test_flags_follow(other):
    flags = [
        said.said("mode V1: it takes ", said.damping(0.004), " at Sc ", said.scruton_number(20.0)),
        said.said("mode Sc 20: ", said.key('damper.risk_of = "any"', "a sizing for any mode"), " asks for 5.0%"),
        "a sentence without a value, at Sc 20",
    ]
    content = json.loads(json.dumps({"flags": flags, "flag_parts": said.parts_of(flags)}))
    assert content["flags"][:2] == [
        "mode V1: it takes 0.4 % at Sc 20",
        'mode Sc 20: damper.risk_of = "any" asks for 5.0%',
    ]
    shown = ["mode Sc 20: a sizing for any mode asks for 5.0%", "a sentence without a value, at Sc 20"]
    with conventions({}):
        assert flag_texts(content["flags"], content) == ["mode V1: it takes 0.4 % at Sc 20", *shown]
        assert flag_texts(content["flags"], content, keys=True) == content["flags"]
    with conventions({"conventions": {**OTHER, "scruton_factor": 4.0}}):
        assert flag_texts(content["flags"], content) == ["mode V1: it takes δ = 0.0251 at Sc 80", *shown]


def test_a_sentence_keeps_its_values_in_another_and_in_another_process():
    inner = said.said("it takes ", said.damping(0.004))
    outer = pickle.loads(pickle.dumps(said.said("V1: ", inner, said.listed([[" a"], [" b"]], " and"))))
    assert outer == "V1: it takes 0.4 % a and b"
    assert [part for part in outer.parts if not isinstance(part, str)] == [said.damping(0.004)]


def test_figures_and_charts_follow(heaving):
    stated = asked(heaving, **OTHER)
    ours, theirs = (griffin_plot(fit).figure.axes[0] for fit in (heaving, stated))
    np.testing.assert_allclose(theirs.get_xlim(), 4.0 * np.array(ours.get_xlim()))
    np.testing.assert_allclose(theirs.get_ylim(), ours.get_ylim())
    first, second = (griffin_chart(fit) for fit in (heaving, stated))
    assert second["x"]["max"] == pytest.approx(4.0 * first["x"]["max"], rel=1e-4)
    assert second["points"][0]["x"] == pytest.approx(4.0 * first["points"][0]["x"], rel=1e-4)
    mode = sizing()["modes"][0] | {"name": "V1"}
    with conventions({"conventions": {**OTHER, "scruton_factor": 4.0}}):
        chart = risk_chart(mode, mode["limits"][0]["curve"], "probability")
    np.testing.assert_allclose(chart["grid"], [0.0, 2 * np.pi * 0.002, 2 * np.pi * 0.004], rtol=1e-5)
    assert chart["read"]["also"][0]["values"] == [60.0, 100.0, 140.0]
    axes = required_plot(sizing() | {"conventions": OTHER}).figure.axes[0]
    assert axes.get_xlabel() == "Added decrement [-]"
    assert max(bar.get_width() for bar in axes.patches) == pytest.approx(2 * np.pi * 0.004)


def test_the_terminal_follows(heaving):
    stated = asked(heaving, **OTHER)
    one = predict(heaving.tree, scruton_number=30.0)
    text = render_text(fit_summary(stated)) + render_text(prediction_summary([one], stated.summary))
    assert "Structural decrement [-]" in text
    assert "\n120 " in text
    assert "EN 1991-1-4" in text
    assert "damping ratio" not in text


def test_torsion_has_no_scruton_number_of_the_eurocode_and_says_so(twisting):
    stated = asked(twisting, **OTHER)
    assert stated.campaign.conventions["scruton_factor"] == 1.0
    said = "\n".join(texts(document_of(stated, illustrated=False)))
    assert "EN 1991-1-4 defines no Scruton number for torsion" in said


def test_torsion_is_in_degrees_everywhere(twisting):
    document = document_of(twisting)
    assert not [one for one in texts(document) if re.search(r"\brad\b|radian", one)]
    for figure in drawn(twisting):
        labels = [part for axes in figure.figure.axes for part in (axes.get_xlabel(), axes.get_ylabel())]
        assert not [one for one in labels if "rad]" in one or "1 rad" in one], figure.name
    stable = table_of(document, "stable_amplitudes")
    first = twisting.summary["tests"][0]["parameters"]["a_star"]["median"]
    assert numbers(stable.rows[0][4])[0] == pytest.approx(np.rad2deg(first), rel=0.02)


def test_files_keep_what_they_hold(heaving):
    one = predict(heaving.tree, scruton_number=30.0)
    with conventions({"conventions": {**OTHER, "scruton_factor": 4.0}}):
        assert one.to_json()["sc"] == 30.0
        assert (scruton(30.0), damping(0.01), damping_label()) == ("120.0", "0.0628", "decrement [-]")
    assert (scruton(30.0), damping(0.01), damping_label()) == ("30.00", "1.00 %", "damping ratio [%]")
    assert shown_in("m") == (1e3, "mm")
    assert shown_in("A/D") == (1.0, "A/D")


def test_no_identifier_stands_in_prose(heaving):
    gap = json.loads(json.dumps(GAP))
    gap["advice"] = ["another growth would tell setting_dependence from reduced_velocity_drift by 5 sigma"]
    gap["effects"] = {"setting_dependence": {"parameters": {
        "size[Sc 1.9]": {"median": 0.1, "interval90": [0.05, 0.15], "unit": "-", "form": "by test"}}}}  # fmt: skip
    told = Transfer(assumed=True)
    flags = ("the fit carries spanwise_coherence_loss; by law n=-1", *transfer_remarks(told, 12.0, 3.0, Motion.HEAVING))
    content = sizing(flags=flags) | {"flag_parts": said.parts_of(flags)}
    content["modes"][0]["limits"][0] |= {
        "title": "a code: gamma_v 0.04/f m",
        "reading": "K_D = 11 where V_cr is 20 m/s",
    }
    content["inputs"] = {"numbers": [
        {"name": "limits[1]", "value": "kd: 30 mm/s^2", "origin": "default",
         "source": "K_D = f^2 y, by BD 49/01; the partial factor gamma_v"},
        {"name": "modes[0].damping_ratio.mean", "value": 0.003, "origin": "stated", "source": ""},
        {"name": "modes[0].damping_ratio.sd", "value": 0.001, "origin": "default", "source": "by judgement"},
        {"name": "damper.largest_stroke", "value": 0.6, "origin": "default", "source": "room"},
        {"name": "damper.number", "value": 1.0, "origin": "stated", "source": ""},
        {"name": "damper.risk_of", "value": "mode", "origin": "default", "source": "room"},
        {"name": "transfer.turbulence.mean", "value": 1.0111874, "origin": "default", "source": "room"}]}  # fmt: skip
    document = document_of(heaving, gap=gap, sizing=content)
    files = {record.name for test in heaving.campaign.tests for record in test.records}
    files |= {record.name for rig in heaving.campaign.rigs for record in rig.records}
    named = []
    for text in texts(document.chapters):
        for name in files:
            text = text.replace(name, "a file")
        named += [(found[0], text[:80]) for found in [IDENTIFIER.search(text)] if found]
    assert not named
    assert [text for text in texts(document) if "state them with the bridge, or leave them out there" in text]
    advice = [text for text in texts(document.chapters) if "would tell" in text]
    assert advice == [
        "another growth would tell “aerodynamic parameters differ from test to test, not by the reduced velocity” from "
        "“aerodynamic parameters change with the reduced velocity” by 5 sigma"
    ]
    rows = {row[0]: row for row in table_of(document, "inputs").rows}
    assert rows["mode V1, damping ratio"][1:] == ("0.3 ± 0.10 %", "stated; sd by default", "by judgement")
    assert rows["bridge, damper, largest stroke"][1:3] == ("0.6 m", "default")
    assert rows["bridge, damper, number"][1] == "1", "as stated, without padding"
    assert rows["bridge, damper, the risk is that of"][1] == "mode"
    assert rows["bridge, transfer, turbulence"][1] == "1.011", "computed: four digits"
    assert rows["bridge, limit 2"][1] == "BD 49/01, 30 mm/s²"
    assert rows["section, depth"][1] == "0.075 m"
    assert all(row[2] and row[3] for row in rows.values())


def test_an_identifier_would_be_found():
    assert IDENTIFIER.search("it is reduced_velocity_drift")
    assert IDENTIFIER.search("gamma_v 0.04/f")
    assert IDENTIFIER.search("size[1]")
    assert IDENTIFIER.search("K_D = 30 mm/s^2")
    assert IDENTIFIER.search("state [transfer], or leave it")
    assert not IDENTIFIER.search("a width [mm] of 3 [A/D] (n = 2)")
    assert parameter_words("stable_amplitude of Sc 1.9") == "stable amplitude a* of Sc 1.9"
    assert parameter_words("trial_residual") == "standard deviation of the residual"
    assert parameter_words("never_heard_of") == "never heard of"
    assert in_words("gamma_v of none") == "γᵥ of none"
    assert in_words("takes xi_s(A) of rig 4#") == "takes ξₛ(A) of rig 4#"
    assert in_words("the risk is 7.8%; of 5 %") == "the risk is 7.8 %; of 5 %"
    assert in_words("wind_speed_drift.toml") == "wind_speed_drift.toml", "a name of a file stays"
