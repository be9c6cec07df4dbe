"""A report in a folder: report.html and report.pdf with figures, tables and numbers beside them, all or nothing."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.documents import write_bytes, write_document, write_text
from scruton.errors import InputError
from scruton.processes import SecondProcess, aside
from scruton.report.failures import Failure, Failures, begun, guarded
from scruton.workspace import Workspace

if TYPE_CHECKING:
    import pandas as pd

    from scruton.griffin import Prediction
    from scruton.infer.results import Fit
    from scruton.infer.sensitivity import PredictionSensitivity
    from scruton.report.document import Document, Picture
    from scruton.report.kept import Beside
    from scruton.report.parts import Part

HTML, PDF, JSON, FIGURES, TABLES = "report.html", "report.pdf", "report.json", "figures", "tables"
OFFICE = {"docx": "The Word file", "xlsx": "The Excel file"}
GRIFFIN = "griffin"  # name of the figure that the command line points to

Waiting = Callable[[], "Part | Failure"]
Design = Sequence[float] | Callable[[], Sequence[float]]


@dataclass(frozen=True)
class ReportPaths:
    """What a report consists of.

    Attributes
    ----------
    report : Path
        The HTML file, which holds everything.
    pdf : Path or None
        The same on paper; None where it could not be typeset.
    griffin : Path or None
        The Griffin plot as PNG; None for a campaign without tests in wind.
    numbers : Path
        Every number, as JSON.
    figures, tables : tuple of Path
        Figures as SVG and PNG; tables as CSV and LaTeX.
    failures : tuple of Failure
        What is missing from the report, which says so, too.
    office : tuple of Path
        The Word and Excel files that were asked for.
    """

    report: Path
    pdf: Path | None
    griffin: Path | None
    numbers: Path
    figures: tuple[Path, ...]
    tables: tuple[Path, ...]
    failures: tuple[Failure, ...] = ()
    office: tuple[Path, ...] = ()

    def moved(self, folder: Path) -> "ReportPaths":
        """Where it lies once its folder has been moved."""
        old = self.report.parent

        def there(value: Any) -> Any:
            if isinstance(value, tuple):
                return tuple(map(there, value))
            return folder / value.relative_to(old) if isinstance(value, Path) else value

        return replace(self, **{field.name: there(getattr(self, field.name)) for field in fields(self)})


def build_report(fit: "Fit", out: Path, **content: Any) -> ReportPaths:
    """Write the report of a fit into a folder of results.

    Parameters
    ----------
    fit : Fit
    out : Path
        Folder; made if it is not there. A report that lies in it is replaced once the new one is complete.
    **content
        As of `write_report`, which see for the errors, too.

    Returns
    -------
    ReportPaths
    """
    with Workspace(out, "report", inputs={}, settings={}, force=True) as work:
        paths = write_report(fit, work.new, **content)
        work.publish()
    return paths.moved(out)


def write_report(
    fit: "Fit",
    out: Path,
    *,
    design_sc: Design = (),
    gap: "Part | Waiting | None" = None,
    sizing: "Part | Waiting | None" = None,
    known: "Beside | None" = None,
    second: SecondProcess | None = None,
    office: Sequence[str] = (),
) -> ReportPaths:
    """Write the files of a report.

    Whatever part, figure or chapter fails, the rest is written, and the failure is said where it belongs.

    Parameters
    ----------
    fit : Fit
    out : Path
        Folder for the new files; made if it is not there.
    design_sc : sequence of float, or callable that gives it
        Design Scruton numbers to predict the stable amplitude at.
    gap, sizing : Part, or callable that gives it, optional
        The diagnosis and the sizing; their content is also written as gap.json and sizing.json, that of the other
        motion where both were sized in a folder of its name.
    known : Beside, optional
        What is known of the fit beside itself.
    second : SecondProcess, optional
        Takes a share of the figures; the files do not depend on it.
    office : sequence of {"docx", "xlsx"}
        Write report.docx and report.xlsx, too; they want the extra `office`.

    Returns
    -------
    ReportPaths

    Raises
    ------
    InputError
        If a design Scruton number is given for a campaign without tests in wind, or is not a finite number.
    """
    from scruton.infer.store import sha256_in
    from scruton.report.chapters import Material, compose, with_failures
    from scruton.report.charts import decision_chart, griffin_chart
    from scruton.report.exports import numbers, write_tables
    from scruton.report.kept import Beside
    from scruton.report.parts import crossed_part, whole_of
    from scruton.report.render_html import render_html
    from scruton.report.render_typst import render_pdf
    from scruton.report.tables import tables
    from scruton.sizing.results import RESULT

    failures = Failures()
    attempt = failures.attempt
    design, at_tests = _predictions(fit, design_sc, failures)
    frames = attempt("campaign", "The tables", lambda: tables(fit, [*design, *at_tests.values()]), {})
    known = known or Beside()
    pictures, drawn = _figures(fit, known.pictures, second, known.fit_sha256 or sha256_in(out), failures)
    parts: dict[str, Part] = {}
    charts: dict[str, Mapping[str, Any]] = {}
    for name, what, part in (("gap", "The diagnosis of the gap", gap), ("sizing", "The sizing", sizing)):
        done = attempt(name, what, part, None) if callable(part) else part
        if done is not None:
            parts[name] = done
            pictures += done.pictures
            charts |= done.charts
            failures.found += done.failures
    files = {f"{picture.name}.{kind}": getattr(picture, kind) for picture in pictures for kind in ("svg", "png")}
    (out / FIGURES).mkdir(parents=True)
    for name, drawing in files.items():
        (out / FIGURES / name).write_bytes(drawing)
    if fit.summary["tests"]:
        chart = attempt("griffin-plot", "The chart of the Griffin plot", lambda: griffin_chart(fit, design), None)
        charts = {GRIFFIN: chart, **charts} if chart else charts
    if "sizing" in parts:
        what = "The chart of the decision"
        chart = attempt("summary", what, lambda: decision_chart(fit, parts["sizing"].content), None)
        charts = {"decision": chart, **charts} if chart else charts
    pictures = [replace(picture, chart=charts.get(picture.name)) for picture in pictures]
    contents = {name: dict(part.content) for name, part in parts.items()}
    other = parts["sizing"].other if "sizing" in parts else None
    crossed_ones: Mapping[str, Any] = {}
    if sum(test["peak"] for test in fit.summary["tests"]) > 1:
        what = "The prediction of each peak test from the others"
        crossed_ones = attempt("predictions", what, known.crossed or partial(crossed_part, whole_of(fit)), {})
    sensitivity = attempt("predictions", "The sensitivity of predictions", partial(_sensitivity, fit, design), ())
    material = Material(
        fit, frames, pictures, design, at_tests, crossed_ones, charts=charts, other=other, sensitivity=sensitivity,
        **contents,
    )  # fmt: skip
    document = compose(material, failures)
    written = attempt("", "Writing the tables", lambda: write_tables(document, frames, out / TABLES), [])
    values = attempt("", "Writing the numbers", lambda: numbers(material, document), {"format": 1})
    pdf = attempt("", "The PDF", lambda: aside(render_pdf, with_failures(document, failures)), b"")
    others = {form: attempt("", OFFICE[form], partial(_office, form, document, frames), b"") for form in office}
    values |= contents | drawn | {"failures": [failure.to_json() for failure in failures.found]}
    write_text(out / HTML, render_html(with_failures(document, failures)))
    if pdf:
        write_bytes(out / PDF, pdf)
    for form, content in others.items():
        if content:
            write_bytes(out / f"report.{form}", content)
    write_text(out / JSON, json.dumps(values, indent=1, ensure_ascii=False) + "\n")
    for name, part_content in contents.items():
        write_document(out / f"{name}.json", part_content)
    if other is not None:
        place = out / str(other["bridge"]["motion"])
        place.mkdir()
        write_document(place / RESULT, dict(other))
    return ReportPaths(
        report=out / HTML,
        pdf=out / PDF if pdf else None,
        griffin=out / FIGURES / f"{GRIFFIN}.png" if f"{GRIFFIN}.png" in files else None,
        numbers=out / JSON,
        figures=tuple(out / FIGURES / filename for filename in files),
        tables=tuple(out / TABLES / path.name for path in written),
        failures=tuple(failures.found),
        office=tuple(out / f"report.{form}" for form, content in others.items() if content),
    )


def _office(form: str, document: "Document", frames: "Mapping[str, pd.DataFrame]") -> bytes:
    """The Word file with the whole document, or the Excel file with its tables."""
    if form == "xlsx":
        from scruton.report.render_xlsx import render_xlsx

        return render_xlsx(document, frames)
    from scruton.report.render_docx import render_docx

    return render_docx(document)


def _figures(
    fit: "Fit",
    known: "Sequence[Picture]",
    second: SecondProcess | None,
    fit_sha256: Mapping[str, str] | None,
    failures: Failures,
) -> tuple["list[Picture]", dict[str, Any]]:
    """The figures of the fit, drawn where they are not known, and what a later report has to know to take them."""
    from scruton.report.kept import drawn_from, noted

    before = len(failures.found)
    pictures = list(known)
    if not pictures:
        pictures, found = aside(_draw, fit, second or SecondProcess(beside=False))
        failures.found += found
    if not fit_sha256 or len(failures.found) > before:  # one that lacks a figure is none to take them from
        return pictures, {}
    return pictures, {"drawn": noted(pictures, drawn_from(fit_sha256))}


def _draw(fit: "Fit", second: SecondProcess) -> tuple["list[Picture]", list[Failure]]:
    """Draw every figure, here and beside, one after the other: each holds some ten megabytes until it is a file."""
    from scruton.report.figures import all_figures, chapter_of
    from scruton.report.parts import drawn

    failures = Failures()
    results: list[tuple[str, Picture | Failure | Callable[[], Picture | Failure]]] = []

    def draw() -> None:
        for figure in all_figures(fit, failures):
            result = begun(second, drawn, figure) if second.idle else guarded(drawn, figure)
            results.append((figure.name, result))

    failures.attempt("", "Drawing the figures", draw, None)
    kept = [
        failures.keep(chapter_of(name), f"The figure {name}", guarded(result) if callable(result) else result, None)
        for name, result in results
    ]
    return [picture for picture in kept if picture is not None], failures.found


def _sensitivity(fit: "Fit", design: "Sequence[Prediction]") -> "tuple[PredictionSensitivity, ...]":
    """Of the predictions at the design, or between and beyond the tests where there is none."""
    from scruton.griffin.sensitivity import points_of, prediction_sensitivity

    if not fit.summary["tests"]:
        return ()
    points = points_of(fit.tree, [prediction.scruton_number for prediction in design])
    return prediction_sensitivity(fit.tree, points, seed=fit.seed)


def _predictions(fit: "Fit", design_sc: Design, failures: Failures) -> "tuple[list[Prediction], dict[str, Prediction]]":
    """At the design; by peak test, for another setting at its Scruton number.

    Numbers that were asked for and cannot be are bad input.
    """
    from scruton.griffin import predict

    seed, attempt = fit.seed, partial(failures.attempt, "predictions")

    def predicted(numbers: Sequence[float]) -> "list[Prediction]":
        return [predict(fit.tree, scruton_number=float(sc), seed=seed) for sc in numbers]

    passing: tuple[type[Exception], ...] = (InputError,)
    if callable(design_sc):
        passing = ()
        design_sc = attempt("The Scruton numbers of the bridge", design_sc, ())
    design = attempt("The prediction at the design", partial(predicted, design_sc), [], passing)
    peaks = {t["name"]: t["parameters"]["scruton_number"]["median"] for t in fit.summary["tests"] if t["peak"]}
    predictions = attempt("The prediction at the tests", partial(predicted, [*peaks.values()]), None)
    return design, {} if predictions is None else dict(zip(peaks, predictions, strict=True))
