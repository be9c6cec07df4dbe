"""A report never loses its document because a part, a figure or a chapter failed: its place says what failed."""

import contextlib
import json
import os
import pickle
import shutil
import signal
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from fake_fit import fake_fit
from fake_parts import GAP, sizing
from matplotlib.figure import Figure

from scruton.app.batch import FAILED, Job, _missing, summarise
from scruton.app.fit import FitTask
from scruton.cli import main
from scruton.errors import InputError
from scruton.processes import SecondProcess
from scruton.report import build_report, figures
from scruton.report.chapters import CHAPTERS, Material, compose, with_failures
from scruton.report.document import ALARM, Block, Callout, Document, Picture, paragraph
from scruton.report.failures import Failure, Failures, begun, guarded
from scruton.report.figures.registry import Registered, registered
from scruton.report.parts import Part, gap_part
from scruton.report.tables import tables

FAULT = "This is a fault of the program, not of the data"


def fail(*_: object, **__: object) -> None:
    raise ZeroDivisionError("no ink left")


def refuse(*_: object, **__: object) -> None:
    raise InputError("campaign.toml", "tests", "nothing", "something")


def interrupt(*_: object, **__: object) -> None:
    raise KeyboardInterrupt


@pytest.fixture(scope="module")
def three():
    return fake_fit(growth=False, sweeps=False)


def small(name: str) -> figures.FigureWithCaption:
    figure = Figure(figsize=(2, 1))
    figure.subplots().plot([0, 1])
    return figures.FigureWithCaption(figure, name, f"caption of {name}", "an alternative")


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """One small figure, and no fits for the crossed predictions."""
    monkeypatch.setattr(figures, "all_figures", lambda *_: [small("griffin")])
    monkeypatch.setattr("scruton.report.parts.predict_left_out", lambda *_, **__: [])


def boxes(document: Document, key: str) -> list[Callout]:
    (chapter,) = [one for one in document.chapters if one.key == key]
    return [one for one in chapter.blocks if isinstance(one, Callout) and one.role == ALARM]


def test_work_that_fails_says_how_and_who_ends_the_program_is_obeyed() -> None:
    class PanicError(BaseException):
        """As compiled code raises it."""

    def panic() -> None:
        raise PanicError("index out of bounds")

    assert guarded(max, 1, 2) == 2
    fault, input_error, panicked = guarded(fail), guarded(refuse), guarded(panic)
    assert isinstance(fault, Failure)
    assert (fault.kind, fault.text, fault.fault) == ("ZeroDivisionError", "no ink left", True)
    assert "in fail" in fault.trace
    assert isinstance(input_error, Failure)
    assert not input_error.fault
    assert "found nothing; wanted something" in input_error.text
    assert isinstance(panicked, Failure)
    assert panicked.kind == "PanicError"
    for end in (KeyboardInterrupt, SystemExit):

        def leave(end: type[BaseException] = end) -> None:
            raise end

        with pytest.raises(end):
            guarded(leave)
    with pytest.raises(InputError):
        guarded(refuse, passing=(InputError,))


def fail_midway(*_: object) -> Iterator[Block]:
    yield paragraph("what is never seen")
    raise ZeroDivisionError("no ink left")


@pytest.mark.parametrize("failing", [key for key, *_ in CHAPTERS])
def test_a_chapter_that_fails_costs_itself_alone(three, monkeypatch: pytest.MonkeyPatch, failing: str) -> None:
    material = Material(three, tables(three), [Picture("griffin", "c", "a")], gap=GAP, sizing=sizing())
    whole = compose(material)
    changed = [(key, title, fail_midway if key == failing else write) for key, title, write in CHAPTERS]
    monkeypatch.setattr("scruton.report.chapters.CHAPTERS", changed)
    failures = Failures()
    document = compose(material, failures)
    before = {one.key: (one.title, one.appendix) for one in whole.chapters}
    assert before.items() <= {one.key: (one.title, one.appendix) for one in document.chapters}.items()
    (box,) = boxes(document, failing)
    assert FAULT in box.head
    assert box.lines == (("ZeroDivisionError: no ink left",),)
    head = boxes(with_failures(document, failures), "summary")[0]
    assert head.lines == [one.sentence for one in failures.found]
    assert [one.chapter for one in failures.found] == [failing]


@pytest.fixture
def quick_register(monkeypatch: pytest.MonkeyPatch) -> dict[str, Registered]:
    """The register with drawings that take no time: one page each."""
    monkeypatch.undo()
    monkeypatch.setattr("scruton.report.parts.predict_left_out", lambda *_, **__: [])
    found = {name: replace(entry, draw=lambda *_, name=name: small(name), when=None, each=None)
             for name, entry in registered().items() if entry.source == "fit"}  # fmt: skip
    monkeypatch.setattr("scruton.report.figures.registry.registered", lambda: found)
    return found


def test_a_figure_that_fails_costs_its_kind_alone(three, quick_register: dict[str, Registered]) -> None:
    names = {one.name for one in figures.all_figures(three)}
    assert names == set(quick_register)
    for failing, entry in list(quick_register.items()):
        quick_register[failing] = replace(entry, draw=fail)
        with pytest.raises(ZeroDivisionError):
            list(figures.all_figures(three))
        failures = Failures()
        assert names - {one.name for one in figures.all_figures(three, failures)} == {failing}
        (one,) = failures.found
        assert one.chapter in {key for key, *_ in CHAPTERS}
        quick_register[failing] = entry


def test_a_register_that_fails_leaves_the_document(
    three, quick_register: dict[str, Registered], tmp_path: Path
) -> None:
    quick_register["lock_in"] = replace(quick_register["lock_in"], when=fail)
    paths = build_report(three, tmp_path)
    assert [one.what for one in paths.failures] == ["Drawing the figures"]
    assert paths.report.stat().st_size > 10_000


def check_report(out: Path, chapter: str, words: str) -> None:
    """The document is there, and says in its chapter and in the summary what failed."""
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.count(words) == 2, "once in its chapter, once at the head"
    content = json.loads((out / "report.json").read_text(encoding="utf-8"))
    (one,) = content["failures"]
    assert (one["chapter"], words in one["sentence"]) == (chapter, True)
    assert (out / "report.pdf").read_bytes().startswith(b"%PDF")
    assert (out / "figures" / "griffin.png").is_file()
    assert (out / "tables" / "posterior.csv").is_file()


@pytest.fixture
def report(three, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., int]:
    """`scruton report` of a fit that is there, with parts that take no time, all in this process."""
    out = tmp_path / "out"
    out.mkdir()
    task = FitTask(three.campaign, three.card, (), 0, None, out)
    monkeypatch.setattr(FitTask, "of", lambda *_, **__: task)
    monkeypatch.setattr(FitTask, "fit", lambda *_, **__: three)
    monkeypatch.setattr("scruton.infer.store.write_fit", lambda *_: None)
    monkeypatch.setattr("scruton.processes.SecondProcess", lambda **_: SecondProcess(beside=False))
    monkeypatch.setattr("scruton.report.parts.check_bridge", lambda *_: None)
    monkeypatch.setattr("scruton.report.parts.scruton_numbers_of", lambda *_: [30.0])
    monkeypatch.setattr("scruton.report.parts.gap_part", lambda *_: Part(GAP))
    monkeypatch.setattr("scruton.report.parts.sizing_part", lambda *_: Part(sizing()))
    monkeypatch.setattr("scruton.report.parts.crossed_part", lambda *_: {})

    def run(*arguments: str) -> int:
        return main(["report", "campaign", "-o", str(out), "--bridge", "bridge.toml", "--quiet", *arguments])

    return run


def test_a_report_in_which_nothing_fails_is_trusted(report, tmp_path: Path, capsys) -> None:
    assert report() == 0
    assert capsys.readouterr().err == ""
    assert json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))["failures"] == []
    assert "missing" not in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("how", [fail, refuse])
@pytest.mark.parametrize(
    ("place", "chapter", "what"),
    [
        ("scruton.report.parts.gap_part", "gap", "The diagnosis of the gap"),
        ("scruton.report.parts.sizing_part", "sizing", "The sizing"),
        ("scruton.report.parts.crossed_part", "predictions", "The prediction of each peak test from the others"),
        ("scruton.report.parts.scruton_numbers_of", "predictions", "The Scruton numbers of the bridge"),
        ("scruton.report.charts.griffin_chart", "griffin-plot", "The chart of the Griffin plot"),
    ],
)
def test_a_part_that_fails_costs_its_chapter_alone(
    report, tmp_path: Path, capsys, monkeypatch: pytest.MonkeyPatch, place: str, chapter: str, what: str, how
) -> None:
    assert report() == 0
    monkeypatch.setattr(place, how)
    assert report("--force") == 1
    words = f"{what} failed. {FAULT}" if how is fail else f"{what} could not be made"
    check_report(tmp_path / "out", chapter, words)
    said = capsys.readouterr().err
    assert words in said
    assert ("ZeroDivisionError: no ink left" if how is fail else "found nothing; wanted something") in said
    for name in ("gap", "sizing"):
        assert (tmp_path / "out" / f"{name}.json").exists() == (chapter != name), "none that is not of this report"


def test_a_figure_that_cannot_be_drawn_is_missed_in_its_chapter(
    report, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = small("corner_1")
    monkeypatch.setattr(one.figure, "savefig", fail)
    monkeypatch.setattr(figures, "all_figures", lambda *_: [small("griffin"), one])
    assert report() == 1
    check_report(tmp_path / "out", "posterior", f"The figure corner_1 failed. {FAULT}")


def test_a_figure_of_the_gap_that_fails_leaves_the_diagnosis(
    small_campaign: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("scruton.report.figures.gap.gap_figure", fail)
    part = gap_part(small_campaign)
    assert part.content["verdict"] == "none"
    assert not part.pictures
    (one,) = part.failures
    assert (one.chapter, one.what) == ("gap", "The figure of the gap")


def test_without_a_pdf_there_is_the_page(report, tmp_path: Path, capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    assert report() == 0
    capsys.readouterr()
    monkeypatch.setattr("scruton.report.render_typst.render_pdf", fail)
    assert report("--force") == 1
    assert not (tmp_path / "out" / "report.pdf").exists()
    assert f"The PDF failed. {FAULT}" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    out, err = capsys.readouterr()
    assert "PDF" not in out
    assert "The PDF failed" in err


@pytest.mark.parametrize("place", ["scruton.report.tables.tables", "scruton.report.exports.write_tables",
                                   "scruton.report.exports.numbers", "scruton.griffin.predict"])  # fmt: skip
def test_numbers_and_tables_that_fail_leave_the_document(
    report, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    monkeypatch.setattr(place, fail)
    assert report() == 1
    assert FAULT in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert (tmp_path / "out" / "report.pdf").is_file()
    assert json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))["failures"]


def test_a_fit_that_fails_is_no_report(report, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FitTask, "fit", refuse)
    assert report() == 2
    assert not list((tmp_path / "out").iterdir())


def test_a_design_that_cannot_be_is_bad_input(report, tmp_path: Path, capsys) -> None:
    assert report("--sc", "nan") == 2
    assert not list((tmp_path / "out").iterdir())


def test_an_interrupt_ends_the_report(report, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scruton.report.parts.gap_part", interrupt)
    assert report() == 130
    assert not list((tmp_path / "out").iterdir())


def test_what_fails_in_the_second_process_comes_back_as_words(tmp_path: Path) -> None:
    with SecondProcess() as second:
        found = begun(second, gap_part, tmp_path / "nowhere")()
        assert isinstance(found, Failure)
        assert (found.kind, found.fault) == ("InputError", False)
        assert "nowhere" in found.text
        dying = begun(second, os.kill, second.process.result(), signal.SIGKILL)
        failure = guarded(dying)
        assert isinstance(failure, Failure)
        assert failure.kind == "BrokenProcessPool"
        assert begun(second, max, 1, 2)() == 2, "where the second process is dead, this one works"


def test_a_batch_counts_a_report_that_lacks_a_part_as_failed(
    small_campaign: Path, small_results: Path, tmp_path: Path
) -> None:
    folder = Path(shutil.copytree(small_results, tmp_path / "results"))
    job = Job("one", str(small_campaign), str(folder), "default", 0, (), True, True, "")
    lacking = guarded(fail)
    assert isinstance(lacking, Failure)
    failures = Failures()
    failures.keep("gap", "The diagnosis", lacking, None)
    entries, complete = [], []
    for found in ([], [one.to_json() for one in failures.found]):
        (folder / "report.json").write_text(json.dumps({"failures": found}), encoding="utf-8")
        (folder / "report.html").touch()
        entries.append(summarise(job))
        complete.append(not _missing(job))
    assert [one["state"] == FAILED for one in entries] == [False, True]
    assert entries[1]["reason"] == f"The diagnosis failed. {FAULT}: ZeroDivisionError: no ink left"
    assert complete == [True, False], "--resume makes the report again"


def test_what_a_second_process_is_given_can_be_sent_to_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """With a bridge, too, whose limits are functions."""
    sent = []

    def begin(_: SecondProcess, work: Callable[..., object], *given: object) -> None:
        pickle.dumps((work, *given))
        sent.append(given)
        raise KeyboardInterrupt

    monkeypatch.setattr("scruton.report.failures.begun", begin)
    example = Path(__file__).parents[2] / "examples" / "rectangle-4to1"
    with contextlib.suppress(KeyboardInterrupt):
        main(["report", str(example), "--bridge", str(example / "bridge.toml"), "-o", str(tmp_path / "new"), "--quiet"])
    [(_, _, model, numbers)] = sent
    assert model == "default"
    assert numbers
    assert all(number > 0.0 for number in numbers), "Scruton numbers of modes that state a mass"
