"""The report as a file: what it says, that it says it safely, and that it is never half-written."""

import itertools
import json
import math
import os
import re
import time
from concurrent.futures import CancelledError
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from fake_fit import fake_fit
from fake_parts import GAP, sizing
from matplotlib.figure import Figure

from scruton.campaign.schema import Kind, Motion
from scruton.documents import read_document
from scruton.errors import InputError
from scruton.griffin import predict
from scruton.griffin.validate import Validation, Whole
from scruton.processes import SecondProcess
from scruton.report import build_report, figures
from scruton.report.chapters import Material, compose
from scruton.report.chapters.prose import in_words
from scruton.report.charts import risk_chart
from scruton.report.document import Chapter, Document, Picture, numbered
from scruton.report.figures.griffin import griffin_plot, reciprocal_plot
from scruton.report.figures.records import record_figures
from scruton.report.parts import Part
from scruton.report.render_html import TEMPLATES, data_uri, render_html, uris
from scruton.report.tables import tables
from scruton.report.wording import column, estimate, number, stated

VOID = {"meta", "img", "br", "link", "input", "hr"}
EVIL = """<script>alert('1')</script> "B/D" & 4:1 矩形断面 ξ_s → λ 🌉 {{ 7 * 7 }}"""


class Page(HTMLParser):
    """Reads a page: its text, its tags with attributes, whether they nest."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.tags: list[tuple[str, dict]] = []
        self.texts: list[str] = []
        self.faults: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.faults.append(tag)

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in ("style", "script"):
            self.texts.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", "".join(self.texts))


def change(fit, **values):
    return SimpleNamespace(**(vars(fit) | values)) if isinstance(fit, SimpleNamespace) else replace(fit, **values)


def groups(tree: xr.DataTree, *names: str) -> xr.DataTree:
    kept = xr.DataTree.from_dict({f"/{name}": tree[name].to_dataset() for name in names if name in tree})
    kept.attrs.update(tree.attrs)
    return kept


def still_air_fit():
    fit = fake_fit(tests=2, growth=False, sweeps=False)
    tree = groups(fit.tree, "rig_posterior", "constant_data")
    constant = tree["constant_data"].to_dataset()
    tree["constant_data"] = xr.DataTree(constant[["width", "depth", "law_n", "motion", "amplitude_unit"]])
    convergence = fit.convergence[[str(one).startswith("rig") for one in fit.convergence.index.get_level_values(0)]]
    return change(
        fit, campaign=replace(fit.campaign, tests=(), sweeps=()), tree=tree, front_ends={}, convergence=convergence,
        summary=fit.summary | {"tests": [], "records": [], "laws": {}, "campaign": {}},
    )  # fmt: skip


def steady_fit():
    fit = fake_fit(tests=1, growth=False, sweeps=False)
    test = fit.campaign.tests[0]
    record = replace(test.records[0], kind=Kind.STEADY)
    flag = "test Sc 1.9: no growth or decay record, so lambda rests on the prior"
    kept = ("posterior", "campaign_posterior", "laws", "rig_posterior", "sample_stats", "constant_data")
    tree = groups(fit.tree, *kept)
    constant = tree["constant_data"].to_dataset()
    tree["constant_data"] = xr.DataTree(constant.drop_vars(["time", "standard_error", "record", "record_test"]))
    return change(
        fit, campaign=replace(fit.campaign, tests=(replace(test, records=(record,)),)), tree=tree, front_ends={},
        flags=(flag,), summary=fit.summary | {"records": [], "flags": [flag]},
    )  # fmt: skip


@pytest.fixture(scope="module")
def three():
    return fake_fit(growth=False, sweeps=False)


PICTURE = Picture("griffin", "a caption", "an alternative", b"<svg/>", b"PNG")


def page_of(fit, pictures=(PICTURE,), **kwargs) -> Page:
    return Page(render_html(compose(Material(fit, tables(fit), pictures, **kwargs))))


def spaced(page: Page) -> str:
    """Text of a page with its cells apart."""
    return re.sub(r"\s+", " ", " ".join(page.texts))


def validations(fit, level: float = 1.0) -> list[Validation]:
    """Every peak test predicted by the curve that the tests share times `level`, as if the others had given it."""
    tree = fit.tree.copy()
    group = tree["campaign_posterior"].to_dataset()
    amplitude = level * group["reference_amplitude"]
    tree["campaign_posterior"] = xr.DataTree(group.assign(reference_amplitude=amplitude))
    found, names = [], [test.name for test in fit.campaign.tests if test.peak]
    for one in fit.summary["tests"]:
        if one["name"] in names:
            prediction = predict(tree, scruton_number=one["parameters"]["scruton_number"]["median"])
            measured = fit.campaign.test(one["name"]).stable_amplitude.mean
            others = tuple(name for name in names if name != one["name"])
            found.append(Validation(one["name"], others, prediction, measured, True, True))
    return found


@pytest.fixture
def crossed(three, monkeypatch: pytest.MonkeyPatch) -> None:
    """No fits for the crossed predictions of the report of `three`: its records are made up."""
    monkeypatch.setattr("scruton.report.parts.predict_left_out", lambda *_, **__: validations(three))


@pytest.fixture
def one_figure(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw one small figure in place of all of them, to save time."""

    def drawn(*_: object) -> list[figures.FigureWithCaption]:
        figure = Figure(figsize=(2, 1))
        figure.subplots().plot([0, 1])
        return [figures.FigureWithCaption(figure, "griffin", "a caption", "an alternative")]

    monkeypatch.setattr(figures, "all_figures", drawn)


def check_page(page: Page) -> None:
    assert page.faults == []
    assert page.open == []
    ids = [one["id"] for _, one in page.tags if "id" in one]
    assert len(ids) == len(set(ids))
    policy = next(one["content"] for tag, one in page.tags if one.get("http-equiv") == "Content-Security-Policy")
    assert "default-src 'none'" in policy
    assert sum(tag == "script" and one.get("type") != "application/json" for tag, one in page.tags) <= 1
    for tag, attributes in page.tags:
        assert tag not in ("iframe", "object", "link", "base", "form")
        assert tag != "script" or "src" not in attributes
        assert not [name for name in attributes if name.startswith("on")]
        for name in ("src", "href"):
            assert attributes.get(name, "#").startswith(("#", "data:image/"))
        if tag == "img":
            assert attributes["alt"].strip()
        if tag == "a":
            assert attributes["href"][1:] in ids
    levels = [int(tag[1]) for tag, _ in page.tags if re.fullmatch(r"h[1-6]", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(below - above <= 1 for above, below in itertools.pairwise(levels))


def some_figures(fit, *_) -> list[figures.FigureWithCaption]:
    return [griffin_plot(fit), reciprocal_plot(fit), *record_figures(fit)]


@pytest.mark.parametrize("drawn", [some_figures, pytest.param(figures.all_figures, marks=pytest.mark.slow)])
def test_a_whole_report_with_its_figures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, drawn) -> None:
    monkeypatch.setattr(figures, "all_figures", drawn)
    fit = fake_fit(tests=1, sweeps=False, ringdowns=False)
    paths = build_report(fit, tmp_path, design_sc=[5.0])
    page = Page(paths.report.read_text(encoding="utf-8"))
    check_page(page)
    assert paths.griffin == tmp_path / "figures" / "griffin.png"
    assert all(path.stat().st_size > 0 for path in (*paths.figures, *paths.tables, paths.griffin))
    names = {path.stem for path in paths.figures}
    assert {one["id"] for tag, one in page.tags if tag == "figure"} == {f"figure-{name}" for name in names}
    assert paths.report.stat().st_size < 5_000_000
    files = [".scruton", "figures", "report.html", "report.json", "report.pdf", "tables"]
    assert sorted(path.name for path in tmp_path.iterdir()) == files
    assert paths.pdf.read_bytes().startswith(b"%PDF")


def test_the_answer_comes_first_and_is_the_prediction(three) -> None:
    one = predict(three.tree, scruton_number=30.0, seed=1)
    page = page_of(three, design=[one])
    low, high = one.interval(0.90)
    said = f"At the design Scruton number 30 (structural damping ratio {100 * one.damping_ratio:.3f} % on rig 1#)"
    assert said in page.text
    assert f"amplitude is {one.median:.4f} A/D, 90 % interval {low:.4f} to {high:.4f} A/D" in page.text
    assert f"{75 * one.median:.2f} ({75 * low:.2f} to {75 * high:.2f}) mm" in page.text
    assert page.text.index(said) < page.text.index("One section in heave")
    assert page.text.index(said) < page.text.index(f"Stable amplitude at Sc = 30{one.median:.4f} A/D")


def test_without_a_design_each_test_is_answered(three) -> None:
    assert page_of(three).text.count("the stable amplitude is") == 3


def test_a_title_is_text_whatever_it_holds(three) -> None:
    fit = change(three, campaign=replace(three.campaign, title=EVIL, source=EVIL))
    page = page_of(fit)
    check_page(page)
    assert page.text.count(EVIL) == 3  # title, heading, source
    assert "alert('1')</script>" not in render_html(compose(Material(fit, tables(fit))))


def test_flags_stand_in_red_before_the_answer(three) -> None:
    flag = "test Sc 1.9: not converged after <40000> steps"
    fit = change(three, flags=(flag,), converged=False)
    page = page_of(fit)
    assert any(one.get("class") == "box alarm" for _, one in page.tags)
    assert page.text.index(flag) < page.text.index("the stable amplitude is")
    assert "Not to be trusted" in page.text
    assert not any(one.get("class") == "box alarm" for _, one in page_of(three).tags)


def test_cautions_of_a_far_prediction_are_shown(three) -> None:
    one = predict(three.tree, scruton_number=300.0)
    page = page_of(three, design=[one])
    assert one.flags
    assert in_words(one.flags[0]) in page.text


def test_still_air_speaks_of_structural_damping_alone(tmp_path: Path) -> None:
    fit = still_air_fit()
    paths = build_report(fit, tmp_path)
    page = Page(paths.report.read_text(encoding="utf-8"))
    check_page(page)
    assert paths.griffin is None
    assert "Rig 1#: the structural damping ratio is" in page.text
    assert "no test in wind" in page.text
    assert "Griffin plot" not in page.text.partition("Methods in short")[0]
    with pytest.raises(InputError, match="no test in wind"):
        build_report(fit, tmp_path, design_sc=[3.0])


def test_still_air_is_diagnosed_against_a_constant_damping_ratio() -> None:
    text = page_of(still_air_fit(), gap=GAP).text
    assert "Diagnosis: The null model and the records part" in text.partition("Campaign and similitude")[2]
    assert "constant damping ratio and constant frequency" in text
    assert "one pair of aerodynamic parameters" not in text
    assert "one pair of aerodynamic parameters" in page_of(fake_fit(growth=False, sweeps=False), gap=GAP).text


@pytest.mark.usefixtures("one_figure")
def test_steady_records_alone_make_a_report_with_its_flag(tmp_path: Path) -> None:
    paths = build_report(steady_fit(), tmp_path)
    page = Page(paths.report.read_text(encoding="utf-8"))
    check_page(page)
    assert "rests on the prior" in page.text
    assert "Trial functions" not in page.text


def test_torsional_amplitudes_are_in_degrees() -> None:
    fit = fake_fit(motion=Motion.TORSIONAL, growth=False, sweeps=False, ringdowns=False)
    one = predict(fit.tree, scruton_number=0.8)
    page = page_of(fit, design=[one])
    assert f"{one.median:.4f}" not in page.text
    assert f"predicted stable amplitude is {np.rad2deg(one.median):.2f}" in page.text
    assert "median [°]" in page.text
    assert not re.search("at the model.s scale", page.text)
    assert "kg m²/m" in page.text


@pytest.mark.usefixtures("one_figure", "crossed")
def test_a_failure_leaves_the_old_report_whole(three, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    build_report(three, tmp_path)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}

    def fail(*_: object, **__: object) -> str:
        raise RuntimeError("no ink")

    monkeypatch.setattr("scruton.report.render_html.render_html", fail)
    with pytest.raises(RuntimeError, match="no ink"):
        build_report(change(three, campaign=replace(three.campaign, title="another")), tmp_path)
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


@pytest.mark.usefixtures("one_figure", "crossed")
def test_building_again_gives_the_same_bytes(three, tmp_path: Path) -> None:
    paths = build_report(three, tmp_path)
    assert {path.suffix for path in paths.figures} == {".svg", ".png"}
    first = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    (tmp_path / "figures" / "mine.png").write_bytes(b"of the user")
    build_report(three, tmp_path)
    assert (tmp_path / "figures" / "mine.png").read_bytes() == b"of the user"
    (tmp_path / "figures" / "mine.png").unlink()
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == first


@pytest.mark.usefixtures("one_figure", "crossed")
def test_what_other_analyses_bring_is_written_and_shown(three, tmp_path: Path) -> None:
    mode = sizing()["modes"][0]
    charts = {"risk": risk_chart(mode, mode["limits"][0]["curve"], "risk")}
    of_gap, of_risk = (Picture(name, f"caption of {name}", "a", b"<svg/>", b"PNG") for name in ("gap", "risk"))
    paths = build_report(three, tmp_path, gap=Part(GAP, [of_gap]), sizing=Part(sizing(), [of_risk], charts=charts))
    page = Page(paths.report.read_text(encoding="utf-8"))
    check_page(page)
    assert "caption of gap" in page.text
    assert {one["id"] for tag, one in page.tags if one.get("class") == "chart"} == {"figure-griffin", "figure-risk"}
    content = json.loads(paths.numbers.read_text(encoding="utf-8"))
    for name, part in (("gap", GAP), ("sizing", sizing())):
        assert read_document(tmp_path / f"{name}.json", name).items() >= part.items()
        assert content[name] == part
    assert content["curves"]["risk"]["median"] == [0.8, 0.3, 0.05]
    assert content["summary"] == json.loads(json.dumps(three.summary))


def test_a_second_process_does_the_same() -> None:
    with SecondProcess() as beside, SecondProcess(beside=False) as here:
        assert beside.begin(math.sqrt, 4.0)() == here.begin(math.sqrt, 4.0)() == 2.0
        failing = beside.begin(math.sqrt, -1.0)
        with pytest.raises(ValueError, match=r"domain|nonnegative"):
            failing()


def test_what_a_second_process_has_not_begun_is_done_here() -> None:
    with SecondProcess() as beside:
        slow, next_one, last = beside.begin(time.sleep, 1.0), beside.begin(os.getpid), beside.begin(os.getpid)
        assert last() == os.getpid()
        assert not beside.idle
        slow()
        assert next_one() == beside.process.result() != os.getpid()
        left = beside.begin(time.sleep, 0.1), beside.begin(os.getpid)
    assert left[1]() in (os.getpid(), beside.process.result())


def fail_with(beside: SecondProcess, sleeping: list) -> None:
    with beside:
        beside.begin(math.sqrt, 1.0)()
        sleeping.append(beside.begin(time.sleep, 600.0))
        raise RuntimeError("here")


def test_a_failure_ends_the_second_process() -> None:
    sleeping: list = []
    with pytest.raises(RuntimeError, match="here"):
        fail_with(SecondProcess(), sleeping)
    with pytest.raises((BrokenProcessPool, CancelledError)):
        sleeping[0]()


def test_each_peak_test_beside_its_prediction_from_the_others(three) -> None:
    good, bad = ({one.test: one.prediction.to_json() for one in validations(three, level)} for level in (1.0, 0.6))
    page = spaced(page_of(three, crossed=good))
    assert page.count(" % inside ") == 3
    assert "OUTSIDE" not in page
    one, measured = bad["Sc 21.7"], three.campaign.test("Sc 21.7").stable_amplitude.mean
    error = f"{100 * (one['amplitude']['median'] / measured - 1):+.0f} %".replace("-", "−")
    page = spaced(page_of(three, crossed=bad))
    assert page.count(" % OUTSIDE ") == 3
    assert " ".join([*estimate(one["amplitude"]), number(measured), "measured", error]) in page


@pytest.mark.usefixtures("one_figure")
def test_a_report_of_several_rigs_validates_its_own_campaign(
    three, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def validate(whole: Whole, **keywords: object) -> list[Validation]:
        asked.append((whole.campaign, whole.card, whole.seed, whole.tests, keywords))
        return validations(three, 0.6)

    monkeypatch.setattr("scruton.report.parts.predict_left_out", validate)
    paths = build_report(three, tmp_path, design_sc=[30.0])
    assert asked == [(three.campaign, three.card, 1, three.summary["tests"], {"singles": False})]
    assert "OUTSIDE" in Page(paths.report.read_text(encoding="utf-8")).text


def test_laws_stand_with_their_weights_and_the_unsampled_without_an_error(three) -> None:
    text = spaced(page_of(three))
    assert "weighed by the records of the peak tests" in text
    assert "n = −1 0.70 0.0 ± 0.04 0.969 0.500" in text
    assert "n = 2 0.10 −71.4 by Laplace's approximation 0.000 0.000" in text
    alone = fake_fit(tests=1, growth=False, sweeps=False, ringdowns=False, laws=False)
    assert "weighed by the records of the peak tests" not in page_of(alone).text


def test_the_discrepancy_between_settings_is_said(three) -> None:
    found = three.summary["campaign"]["parameters"]
    for key in ("discrepancy_amplitude", "discrepancy_relaxation"):
        assert "{} (90 %: {})".format(*estimate(found[key])) in page_of(three).text


def test_too_many_pictures_leave_the_names_of_their_files() -> None:
    many = tuple(Picture(f"corner_{i}", "c", "a", b"x" * 66) for i in range(5))
    kept = uris(many, limit=2 * len(data_uri(many[0])))
    assert [bool(one) for one in kept.values()] == [True, True, False, False, False]
    huge = tuple(Picture(f"corner_{i}", "c", "a", b"x" * 2_000_000, b"x" * 1_900_000) for i in range(3))
    page = Page(render_html(numbered(Document("t", "k", "s", (Chapter("one", "One", huge),)))))
    check_page(page)
    assert sum(tag == "img" for tag, _ in page.tags) == 1
    assert "keep this file small: figures/corner_1.svg" in page.text
    assert "keep this file small: figures/corner_2.svg" in page.text


def test_colours_have_the_contrast_that_wcag_aa_wants() -> None:
    css = (TEMPLATES / "report.css").read_text(encoding="utf-8")
    by_day, by_night = (dict(re.findall(r"--([\w-]+): (#\w+)", part)) for part in css.split("@media", 2)[:2])
    assert set(by_day) == set(by_night)
    pairs = [("ink", "paper"), ("soft", "paper"), ("link", "paper"), ("red", "paper"), ("amber", "paper")]
    pairs += [(f"{tone}-ink", f"{tone}-paper") for tone in ("red", "amber", "blue")]
    for names in (by_day, by_night):
        for ink, paper in pairs:
            light, dark = sorted((_luminance(names[ink]), _luminance(names[paper])), reverse=True)
            assert (light + 0.05) / (dark + 0.05) >= 4.5, (ink, paper)


def _luminance(colour: str) -> float:
    colour = colour if len(colour) == 7 else "#" + "".join(2 * letter for letter in colour[1:])
    linear = [
        part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4
        for part in (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def entry(median: float, low: float | None, high: float | None) -> dict:
    return {"median": median, "interval": {"0.90": [low, high]}}


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (entry(0.02333, 0.0214, 0.0254), ("0.0233", "0.0214 to 0.0254")),
        (entry(-8.0, -14.2, -2.91), ("−8.0", "−14.2 to −2.9")),
        (entry(0.5, 0.5, 0.5), ("0.5000", "as stated")),
        (entry(0.05, 0.01, None), ("0.050", "0.010 to ∞")),
        (entry(0.0579969, 0.0579836, 0.0580094), ("0.05800", "0.05798 to 0.05801")),
        (entry(0.05799690, 0.05799689, 0.05799691), ("0.05799690", "0.05799689 to 0.05799691")),
        (entry(0.0, 0.0, 0.021), ("0.0000", "0.0000 to 0.0210")),
        (entry(3.1, 0.0042, 11.2), ("3.1", "0.004 to 11.2")),
        (entry(3.1, 0.000042, 11.2), ("3.1", "0.0 to 11.2")),
    ],
)
def test_estimates_have_the_digits_that_they_are_worth(given: dict, text: tuple[str, str]) -> None:
    assert estimate(given) == text


def test_numbers_read_as_people_write_them() -> None:
    assert number(0.00012347) == "0.0001235"
    assert number(-1234.7) == "−1235"
    assert number(3.2e-7, 2) == "3.2 × 10⁻⁷"
    assert number(float("nan")) == "–"
    assert number(float("inf")) == "∞"
    assert stated(30.0) == "30"
    assert column([0.00058, 0.0065, 0.0234]) == ["0.00058", "0.00650", "0.02340"]
    assert column([7.97, float("nan")]) == ["7.97", "–"]
