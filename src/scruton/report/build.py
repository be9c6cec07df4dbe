"""A report in a folder: report.html with figures and tables beside it, all of it or nothing."""

import os
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scruton.griffin import Prediction
    from scruton.infer.results import Fit

REPORT, FIGURES, TABLES = "report.html", "figures", "tables"
GRIFFIN = "griffin"  # name of the figure that the command line points to


@dataclass(frozen=True)
class ReportPaths:
    """What a report consists of.

    Attributes
    ----------
    report : Path
        The HTML file, which holds everything.
    griffin : Path or None
        The Griffin plot as PNG; None for a campaign without tests in wind.
    figures, tables : tuple of Path
        Figures as SVG and PNG; tables as CSV.
    """

    report: Path
    griffin: Path | None
    figures: tuple[Path, ...]
    tables: tuple[Path, ...]


def build_report(fit: "Fit", out: Path, *, design_sc: Sequence[float] = ()) -> ReportPaths:
    """Write the report of a fit.

    Parameters
    ----------
    fit : Fit
    out : Path
        Folder; made if it is not there. A report that lies in it is replaced once the new one is complete.
    design_sc : sequence of float
        Design Scruton numbers to predict the stable amplitude at.

    Returns
    -------
    ReportPaths

    Raises
    ------
    InputError
        If a design Scruton number is given for a campaign without tests in wind, or is not a finite number.
    """
    from scruton.report.figures import all_figures, save
    from scruton.report.html import picture, render
    from scruton.report.tables import tables, write_csv

    design, at_tests, crossed = _predictions(fit, design_sc)
    frames = tables(fit, [*design, *at_tests.values()])
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".report-", dir=out) as name:
        work = Path(name)
        figures, pictures = [], []
        for one in all_figures(fit):
            paths = save(one, work / FIGURES, formats=("svg", "png"))
            figures += [path.name for path in paths]
            pictures.append(picture(one.name, one.caption, one.alt, paths))
        csv = [path.name for path in write_csv(frames, work / TABLES)]
        page = render(fit, frames, pictures, design=design, at_tests=at_tests, crossed=crossed)
        (work / REPORT).write_text(page, encoding="utf-8")
        for part in (FIGURES, TABLES):
            _replace(work / part, out / part)
        os.replace(work / REPORT, out / REPORT)  # noqa: PTH105
    griffin = out / FIGURES / f"{GRIFFIN}.png"
    return ReportPaths(
        report=out / REPORT,
        griffin=griffin if griffin.name in figures else None,
        figures=tuple(out / FIGURES / one for one in figures),
        tables=tuple(out / TABLES / one for one in csv),
    )


def _predictions(
    fit: "Fit", design_sc: Sequence[float]
) -> tuple[list["Prediction"], dict[str, "Prediction"], dict[str, "Prediction"]]:
    """Predictions at the design, for another setting at each test's Scruton number, and of each peak test."""
    from scruton.griffin import predict
    from scruton.griffin.validate import validate

    seed = int(fit.summary["provenance"]["seed"])

    def at(sc: float) -> "Prediction":
        return predict(fit.tree, scruton_number=sc, seed=seed)

    design = [at(float(sc)) for sc in design_sc]
    if not fit.summary["tests"]:
        return design, {}, {}
    tested = {
        one["name"]: at(one["parameters"]["scruton_number"]["median"]) for one in fit.summary["tests"] if one["peak"]
    }
    if len(tested) < 2:
        return design, tested, {}
    crossed = validate(fit.campaign, fit.card, seed=seed, singles=False)
    return design, tested, {one.test: one.prediction for one in crossed}


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
