"""What a report leaves beside it: tables as CSV and LaTeX, methods as LaTeX, every number as JSON."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.cells import safe_cell
from scruton.documents import as_json, write_text
from scruton.provenance import provenance
from scruton.report.charts import plain
from scruton.report.document import Code, Document, Equation, Paragraph, Picture, Run, Table
from scruton.report.maths import Maths
from scruton.report.tables import write_csv

if TYPE_CHECKING:
    import pandas as pd

    from scruton.report.chapters import Material

METHODS = "methods"  # chapter that goes to LaTeX as a whole
_SPECIAL = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "$": r"\$", "&": r"\&", "#": r"\#", "%": r"\%", "_": r"\_",
    "^": r"\textasciicircum{}", "~": r"\textasciitilde{}", "<": r"\textless{}", ">": r"\textgreater{}",
    "−": r"\ensuremath{-}", "±": r"\ensuremath{\pm}", "×": r"\ensuremath{\times}", "∞": r"\ensuremath{\infty}",
    "–": "--", "“": "``", "”": "''", "’": "'", "…": r"\ldots{}", "°": r"\ensuremath{^\circ}",
    "³": r"\ensuremath{^3}", "²": r"\ensuremath{^2}", "₀": r"\ensuremath{_0}", "₁": r"\ensuremath{_1}",
    "ₛ": r"\ensuremath{_s}", "|": r"\ensuremath{|}",
    "ξ": r"\ensuremath{\xi}", "λ": r"\ensuremath{\lambda}", "ω": r"\ensuremath{\omega}", "ρ": r"\ensuremath{\rho}",
    "τ": r"\ensuremath{\tau}", "ε": r"\ensuremath{\varepsilon}", "σ": r"\ensuremath{\sigma}", "π": r"\ensuremath{\pi}",
}  # fmt: skip


def latex_text(text: str) -> str:
    """Escape a text for LaTeX; scripts that it has no commands for stay as they are (XeLaTeX and LuaLaTeX set them)."""
    return "".join(_SPECIAL.get(letter, letter) for letter in " ".join(text.split()))


def latex_table(table: Table) -> str:
    """A table in LaTeX, with the rules of booktabs."""
    columns = "".join("r" if table.is_numeric(i) else "l" for i in range(len(table.header)))
    lines = [
        "% needs \\usepackage{booktabs}", "\\begin{table}", "  \\centering",
        f"  \\caption{{{latex_text(table.caption)}}}", f"  \\label{{tab:{table.name.replace('_', '-')}}}",
        f"  \\begin{{tabular}}{{{columns}}}", "    \\toprule",
        f"    {_latex_row(table.header)}", "    \\midrule",
        *(f"    {_latex_row(row)}" for row in table.rows),
        "    \\bottomrule", "  \\end{tabular}", "\\end{table}", "",
    ]  # fmt: skip
    return "\n".join(lines)


def _latex_row(cells: Sequence[str]) -> str:
    # "[" after a line break would be read as its argument
    texts = [latex_text(cell) for cell in cells]
    return " & ".join(f"{{}}{text}" if text.startswith("[") else text for text in texts) + r" \\"


def latex_chapter(document: Document, key: str) -> str:
    """Paragraphs and equations of a chapter in LaTeX, to be pasted; empty where there is no such chapter."""
    parts: list[str] = []
    for block in (item for chapter in document.chapters if chapter.key == key for item in chapter.blocks):
        if isinstance(block, Paragraph):
            parts.append("".join(map(_latex_run, block.runs)))
        elif isinstance(block, Equation):
            parts.append(f"\\begin{{equation}}\n  {block.maths.latex}\n\\end{{equation}}")
    return "\n".join(parts) + "\n" if parts else ""


def _latex_run(run: Run) -> str:
    if isinstance(run, Maths):
        return f"${run.latex}$"
    if isinstance(run, Code):
        return rf"\texttt{{{latex_text(run.text)}}}"
    # blanks at the ends part the run from its neighbours
    head, tail = (" " if run[:1].isspace() else ""), (" " if run[-1:].isspace() else "")
    return head + latex_text(run) + tail


def write_tables(document: Document, frames: "Mapping[str, pd.DataFrame]", folder: Path) -> list[Path]:
    """Write every table: first CSV, with all digits where a frame has them, else as shown; then LaTeX as shown."""
    paths = write_csv(frames, folder)
    tables = document.every(Table)
    texts = {f"{table.name}.csv": _as_shown(table) for table in tables if table.data not in frames}
    texts |= {f"{table.name}.tex": latex_table(table) for table in tables}
    if methods := latex_chapter(document, METHODS):
        texts[f"{METHODS}.tex"] = methods
    for name, text in texts.items():
        write_text(folder / name, text)
    return [*paths, *(folder / name for name in texts)]


def _as_shown(table: Table) -> str:
    """A table as CSV."""
    stream = io.StringIO(newline="")
    csv.writer(stream).writerows([safe_cell(cell) for cell in row] for row in (table.header, *table.rows))
    return stream.getvalue()


def numbers(material: "Material", document: Document) -> dict[str, Any]:
    """The content of report.json but for the other analyses: tables with all their digits where there are frames."""
    fit, fitted = material.fit, material.fit.summary["provenance"]
    return {
        "format": 1,
        "title": document.title,
        "generator": document.generator,
        "summary": fit.summary,
        # what the fit was made from, the bridge, and the design that was asked for
        "provenance": provenance(
            "report", seed=fitted["seed"], sha256={**fitted["sha256"], **material.bridge_sha256},
            settings={"tests": fitted["tests"], "sc": [prediction.scruton_number for prediction in material.design]},
            card={key: fitted["card"][key] for key in ("name", "sha256")},
        ),
        "predictions": [prediction.to_json() for prediction in material.design],
        "at_tests": {name: prediction.to_json() for name, prediction in material.at_tests.items()},
        "crossed": {**material.crossed},
        "curves": {name: plain(chart) for name, chart in material.charts.items() if "grid" in chart},
        "tables": {name: as_json(frame.to_dict("records")) for name, frame in material.frames.items()}
        | {
            table.name: [dict(zip(_distinct(table.header), row, strict=True)) for row in table.rows]
            for table in document.every(Table)
            if table.data not in material.frames
        },
        "figures": {picture.name: picture.caption for picture in document.every(Picture)},
    }  # fmt: skip


def _distinct(header: Sequence[str]) -> list[str]:
    """Headings, a second of the same name with its place behind it."""
    return [name if name not in header[:i] else f"{name} ({i + 1})" for i, name in enumerate(header)]
