"""A report in a folder: report.html and report.pdf with figures, tables and numbers beside them, all or nothing."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.documents import sealed, write_bytes
from scruton.errors import InputError
from scruton.processes import SecondProcess
from scruton.provenance import provenance
from scruton.report.failures import Failure, Failures, begun, guarded
from scruton.report.parts import Part
from scruton.workspace import Workspace

if TYPE_CHECKING:
    from scruton.griffin import Prediction
    from scruton.infer.results import Fit
    from scruton.report.chapters import Material
    from scruton.report.document import Document, Picture

HTML, PDF, JSON, FIGURES, TABLES = "report.html", "report.pdf", "report.json", "figures", "tables"
GRIFFIN = "griffin"  # name of the figure that the command line points to

PARTS = {"gap": "The diagnosis of the gap", "sizing": "The sizing"}  # by key of the chapter

Crossed = Callable[[], "Mapping[str, Prediction] | Failure"]
Waiting = Callable[[], Part | Failure]
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
    """

    report: Path
    pdf: Path | None
    griffin: Path | None
    numbers: Path
    figures: tuple[Path, ...]
    tables: tuple[Path, ...]
    failures: tuple[Failure, ...] = ()

    def moved(self, old: Path, new: Path) -> "ReportPaths":
        """The same files after their folder became another."""

        def there(path: Path) -> Path:
            return new / path.relative_to(old)

        return replace(
            self,
            report=there(self.report),
            pdf=None if self.pdf is None else there(self.pdf),
            griffin=None if self.griffin is None else there(self.griffin),
            numbers=there(self.numbers),
            figures=tuple(map(there, self.figures)),
            tables=tuple(map(there, self.tables)),
        )


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
    return paths.moved(work.new, out)


def write_report(
    fit: "Fit",
    out: Path,
    *,
    design_sc: Design = (),
    gap: Part | Waiting | None = None,
    sizing: Part | Waiting | None = None,
    crossed: Crossed | None = None,
    second: SecondProcess | None = None,
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
        The diagnosis and the sizing; their content is also written as gap.json and sizing.json.
    crossed : callable, optional
        Gives the prediction of each peak test from the others, where there are two or more; computed here if left out.
    second : SecondProcess, optional
        Takes a share of the figures; the files do not depend on it.

    Returns
    -------
    ReportPaths

    Raises
    ------
    InputError
        If a design Scruton number is given for a campaign without tests in wind, or is not a finite number.
    """
    from scruton.report.chapters import Material, compose, with_failures
    from scruton.report.charts import griffin_chart
    from scruton.report.exports import write_tables
    from scruton.report.render_html import render_html
    from scruton.report.render_typst import render_pdf
    from scruton.report.tables import tables

    failures = Failures()
    design = _design(fit, design_sc, failures)
    at_tests, others = _at_tests(fit, crossed, failures)
    frames = failures.attempt("campaign", "The tables", lambda: tables(fit, [*design, *at_tests.values()]), {})
    pictures = _draw(fit, second or SecondProcess(beside=False), failures)
    parts = _parts({"gap": gap, "sizing": sizing}, failures)
    pictures += [one for part in parts.values() for one in part.pictures]
    figures = _write_pictures(pictures, out / FIGURES)
    material = Material(
        fit, frames, pictures, design, at_tests, others,
        **{name: part.content for name, part in parts.items()},
    )  # fmt: skip
    charts: dict[str, Mapping[str, Any]] = {}
    if material.in_wind:
        chart = failures.attempt(
            "griffin-plot", "The chart of the Griffin plot", lambda: griffin_chart(fit, design), {}
        )
        charts |= {GRIFFIN: chart} if chart else {}
    for part in parts.values():
        charts |= part.charts
    document = compose(material, charts, failures)
    of_tables = failures.attempt("", "Writing the tables", lambda: write_tables(document, frames, out / TABLES), [])
    numbers = failures.attempt("", "Writing the numbers", lambda: _numbers(material, document, charts), {"format": 1})
    pdf = failures.attempt("", "The PDF", lambda: render_pdf(with_failures(document, failures)), None)
    files = {name: dict(part.content) for name, part in parts.items()}
    numbers |= files | {"failures": [one.to_json() for one in failures.found]}
    contents = {
        HTML: render_html(with_failures(document, failures)).encode(),
        JSON: _json(numbers),
        **({} if pdf is None else {PDF: pdf}),
        **{f"{name}.json": _json(sealed(content)) for name, content in files.items()},
    }
    for file, content in contents.items():
        write_bytes(out / file, content)
    griffin = out / FIGURES / f"{GRIFFIN}.png"
    return ReportPaths(
        report=out / HTML,
        pdf=None if pdf is None else out / PDF,
        griffin=griffin if griffin.name in figures else None,
        numbers=out / JSON,
        figures=tuple(out / FIGURES / one for one in figures),
        tables=tuple(out / TABLES / one.name for one in of_tables),
        failures=tuple(failures.found),
    )


def _parts(given: Mapping[str, Part | Waiting | None], failures: Failures) -> dict[str, Part]:
    """Wait for the other analyses; those that fail are left out."""
    found = {}
    for name, part in given.items():
        done = failures.attempt(name, PARTS[name], part, None) if callable(part) else part
        if done is not None:
            found[name] = done
            failures.found += done.failures
    return found


def _draw(fit: "Fit", second: SecondProcess, failures: Failures) -> "list[Picture]":
    """Draw every figure, the first ones here and the last ones beside, as far as there is time for it there."""
    from scruton.report.chapters.material import chapter_of
    from scruton.report.figures import all_figures
    from scruton.report.parts import drawn

    figures = failures.attempt("", "Drawing the figures", partial(all_figures, fit, failures), [])
    here: list[Picture | Failure] = []
    beside: list[Callable[[], Picture | Failure]] = []
    while len(here) + len(beside) < len(figures):
        if second.idle:
            beside.append(begun(second, drawn, figures[-1 - len(beside)]))
        else:
            here.append(guarded(drawn, figures[len(here)]))
    results = [*here, *(guarded(one) for one in reversed(beside))]
    kept = [
        failures.keep(chapter_of(figure.name), f"The figure {figure.name}", result, None)
        for figure, result in zip(figures, results, strict=True)
    ]
    return [one for one in kept if one is not None]


def _write_pictures(pictures: "Sequence[Picture]", folder: Path) -> list[str]:
    """Write the files of every picture; their names."""
    folder.mkdir(parents=True)
    names = []
    for one in pictures:
        for kind, content in (("svg", one.svg), ("png", one.png)):
            (folder / f"{one.name}.{kind}").write_bytes(content)
            names.append(f"{one.name}.{kind}")
    return names


def _numbers(material: "Material", document: "Document", charts: Mapping[str, Any]) -> dict[str, Any]:
    """The content of report.json, without that of the other analyses."""
    from scruton.report.charts import plain
    from scruton.report.exports import numbers

    fit = material.fit
    return numbers(
        material.frames,
        document,
        {
            "summary": fit.summary,
            "provenance": _origin(material),
            "predictions": [one.to_json() for one in material.design],
            "at_tests": {name: one.to_json() for name, one in material.at_tests.items()},
            "crossed": {name: one.to_json() for name, one in material.crossed.items()},
            "curves": {name: plain(one) for name, one in charts.items()},
        },
    )


def _origin(material: "Material") -> dict[str, Any]:
    """What the report was made from: what its fit was, the bridge, and the design that was asked for."""
    fitted = material.fit.summary["provenance"]
    bridge = (material.sizing or {}).get("provenance", {}).get("bridge_sha256", {})
    return provenance(
        "report", seed=fitted["seed"], sha256={**fitted["sha256"], **bridge},
        settings={"tests": fitted["tests"], "sc": [prediction.scruton_number for prediction in material.design]},
        card={key: fitted["card"][key] for key in ("name", "sha256")},
    )  # fmt: skip


def _json(content: Any) -> bytes:
    return (json.dumps(content, indent=1, ensure_ascii=False) + "\n").encode()


def _predictions(fit: "Fit", design_sc: Sequence[float]) -> "list[Prediction]":
    """Predictions at the design."""
    from scruton.griffin import predict

    seed = int(fit.summary["provenance"]["seed"])
    return [predict(fit.tree, scruton_number=float(sc), seed=seed) for sc in design_sc]


def _design(fit: "Fit", design_sc: Design, failures: Failures) -> "list[Prediction]":
    """Predictions at the design; numbers that were asked for and cannot be are bad input."""
    passing: tuple[type[Exception], ...] = () if callable(design_sc) else (InputError,)
    numbers: Sequence[float] = ()
    if callable(design_sc):
        numbers = failures.attempt("predictions", "The Scruton numbers of the bridge", design_sc, numbers)
    else:
        numbers = design_sc
    return failures.attempt(
        "predictions", "The prediction at the design", partial(_predictions, fit, numbers), [], passing
    )


def _at_tests(
    fit: "Fit", crossed: Crossed | None, failures: Failures
) -> "tuple[Mapping[str, Prediction], Mapping[str, Prediction]]":
    """By peak test: prediction for another setting at its Scruton number, and of it from the other peak tests."""
    peaks = [one for one in fit.summary["tests"] if one["peak"]]
    sc = [one["parameters"]["scruton_number"]["median"] for one in peaks]
    found = failures.attempt("predictions", "The prediction at the tests", partial(_predictions, fit, sc), None)
    tested = {} if found is None else dict(zip([one["name"] for one in peaks], found, strict=True))
    if len(peaks) < 2:
        return tested, {}
    what = "The prediction of each peak test from the others"
    return tested, failures.attempt("predictions", what, crossed or partial(_crossed, fit), {})


def _crossed(fit: "Fit") -> "Mapping[str, Prediction]":
    from scruton.griffin.validate import validate

    seed = int(fit.summary["provenance"]["seed"])
    return {one.test: one.prediction for one in validate(fit.campaign, fit.card, seed=seed, singles=False)}
