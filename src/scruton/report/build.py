"""A report in a folder: report.html and report.pdf with figures, tables and numbers beside them, all or nothing."""

import json
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.documents import sealed
from scruton.report.aside import Aside
from scruton.report.parts import Part

if TYPE_CHECKING:
    from scruton.griffin import Prediction
    from scruton.infer.results import Fit
    from scruton.report.chapters import Material
    from scruton.report.document import Document, Picture

HTML, PDF, JSON, FIGURES, TABLES = "report.html", "report.pdf", "report.json", "figures", "tables"
GRIFFIN = "griffin"  # name of the figure that the command line points to

Crossed = Callable[[], "Mapping[str, Prediction]"]
Waiting = Callable[[], Part]


@dataclass(frozen=True)
class ReportPaths:
    """What a report consists of.

    Attributes
    ----------
    report, pdf : Path
        The HTML file, which holds everything, and the same on paper.
    griffin : Path or None
        The Griffin plot as PNG; None for a campaign without tests in wind.
    numbers : Path
        Every number, as JSON.
    figures, tables : tuple of Path
        Figures as SVG and PNG; tables as CSV and LaTeX.
    """

    report: Path
    pdf: Path
    griffin: Path | None
    numbers: Path
    figures: tuple[Path, ...]
    tables: tuple[Path, ...]

    def moved(self, old: Path, new: Path) -> "ReportPaths":
        """The same files after their folder became another."""

        def there(path: Path) -> Path:
            return new / path.relative_to(old)

        return ReportPaths(
            report=there(self.report),
            pdf=there(self.pdf),
            griffin=None if self.griffin is None else there(self.griffin),
            numbers=there(self.numbers),
            figures=tuple(map(there, self.figures)),
            tables=tuple(map(there, self.tables)),
        )


def build_report(
    fit: "Fit",
    out: Path,
    *,
    design_sc: Sequence[float] = (),
    gap: Part | Waiting | None = None,
    sizing: Part | Waiting | None = None,
    crossed: Crossed | None = None,
    aside: Aside | None = None,
) -> ReportPaths:
    """Write the report of a fit.

    Parameters
    ----------
    fit : Fit
    out : Path
        Folder; made if it is not there. A report that lies in it is replaced once the new one is complete.
    design_sc : sequence of float
        Design Scruton numbers to predict the stable amplitude at.
    gap, sizing : Part, or callable that gives it, optional
        The diagnosis and the sizing; their content is also written as gap.json and sizing.json.
    crossed : callable, optional
        Gives the prediction of each peak test from the others, where there are two or more; computed here if left out.
    aside : Aside, optional
        Takes a share of the figures; the files do not depend on it.

    Returns
    -------
    ReportPaths

    Raises
    ------
    InputError
        If a design Scruton number is given for a campaign without tests in wind, or is not a finite number.
    """
    from scruton.report.chapters import Material, compose
    from scruton.report.charts import griffin_chart
    from scruton.report.exports import write_tables
    from scruton.report.render_html import render_html
    from scruton.report.render_typst import render_pdf
    from scruton.report.tables import tables

    design = _predictions(fit, design_sc)
    at_tests, others = _at_tests(fit, crossed)
    frames = tables(fit, [*design, *at_tests.values()])
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".report-", dir=out) as name:
        work = Path(name)
        pictures = _draw(fit, aside or Aside(beside=False))
        waiting = {name: part for name, part in (("gap", gap), ("sizing", sizing)) if part is not None}
        parts = {name: part() if callable(part) else part for name, part in waiting.items()}
        pictures += [one for part in parts.values() for one in part.pictures]
        figures = _write_pictures(pictures, work / FIGURES)
        material = Material(
            fit, frames, pictures, design, at_tests, others,
            **{name: part.content for name, part in parts.items()},
        )  # fmt: skip
        charts: dict[str, Mapping[str, Any]] = {}
        if material.in_wind:
            charts[GRIFFIN] = griffin_chart(fit, design)
        for part in parts.values():
            charts |= part.charts
        document = compose(material, charts)
        written = [path.name for path in write_tables(document, frames, work / TABLES)]
        files = {name: dict(part.content) for name, part in parts.items()}
        contents = {
            HTML: render_html(document).encode(),
            PDF: render_pdf(document),
            JSON: _json(_numbers(material, document, charts) | files),
            **{f"{name}.json": _json(sealed(content)) for name, content in files.items()},
        }
        for file, content in contents.items():
            (work / file).write_bytes(content)
        for part_name in (FIGURES, TABLES):
            _replace(work / part_name, out / part_name)
        for file in contents:
            os.replace(work / file, out / file)  # noqa: PTH105
    griffin = out / FIGURES / f"{GRIFFIN}.png"
    return ReportPaths(
        report=out / HTML,
        pdf=out / PDF,
        griffin=griffin if griffin.name in figures else None,
        numbers=out / JSON,
        figures=tuple(out / FIGURES / one for one in figures),
        tables=tuple(out / TABLES / one for one in written),
    )


def _draw(fit: "Fit", aside: Aside) -> "list[Picture]":
    """Draw every figure, the first ones here and the last ones beside, as far as there is time for it there."""
    from scruton.report.figures import all_figures
    from scruton.report.parts import drawn

    figures = all_figures(fit)
    here: list[Picture] = []
    beside: list[Callable[[], Picture]] = []
    while len(here) + len(beside) < len(figures):
        if aside.idle:
            beside.append(aside.begin(drawn, figures[-1 - len(beside)]))
        else:
            here.append(drawn(figures[len(here)]))
    return [*here, *(one() for one in reversed(beside))]


def _write_pictures(pictures: "Sequence[Picture]", folder: Path) -> list[str]:
    """Write the files of every picture; their names."""
    folder.mkdir()
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
            "predictions": [one.to_json() for one in material.design],
            "at_tests": {name: one.to_json() for name, one in material.at_tests.items()},
            "crossed": {name: one.to_json() for name, one in material.crossed.items()},
            "curves": {name: plain(one) for name, one in charts.items()},
        },
    )


def _json(content: Any) -> bytes:
    return (json.dumps(content, indent=1, ensure_ascii=False) + "\n").encode()


def _predictions(fit: "Fit", design_sc: Sequence[float]) -> "list[Prediction]":
    """Predictions at the design."""
    from scruton.griffin import predict

    seed = int(fit.summary["provenance"]["seed"])
    return [predict(fit.tree, scruton_number=float(sc), seed=seed) for sc in design_sc]


def _at_tests(fit: "Fit", crossed: Crossed | None) -> "tuple[Mapping[str, Prediction], Mapping[str, Prediction]]":
    """By peak test: prediction for another setting at its Scruton number, and of it from the other peak tests."""
    from scruton.griffin.validate import validate

    peaks = [one for one in fit.summary["tests"] if one["peak"]]
    sc = [one["parameters"]["scruton_number"]["median"] for one in peaks]
    tested = dict(zip([one["name"] for one in peaks], _predictions(fit, sc), strict=True))
    if len(tested) < 2:
        return tested, {}
    if crossed is not None:
        return tested, crossed()
    seed = int(fit.summary["provenance"]["seed"])
    return tested, {one.test: one.prediction for one in validate(fit.campaign, fit.card, seed=seed, singles=False)}


def _replace(new: Path, old: Path) -> None:
    """Put a complete folder in the place of another, which goes only when the new one is there."""
    if not new.is_dir():
        new.mkdir()
    aside = new.with_name(f"{new.name}.old")
    if old.exists():
        os.replace(old, aside)  # noqa: PTH105
    os.replace(new, old)  # noqa: PTH105
    if aside.is_dir():
        shutil.rmtree(aside)
