"""What a report leaves beside it: tables as CSV and LaTeX, methods as LaTeX, every number as JSON."""

import csv
import io
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.cells import safe_cell
from scruton.documents import as_json, write_text
from scruton.report.document import Code, Document, Equation, Paragraph, Run, Table
from scruton.report.maths import Maths

if TYPE_CHECKING:
    import pandas as pd

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
    texts = [latex_text(one) for one in cells]
    return " & ".join(f"{{}}{one}" if one.startswith("[") else one for one in texts) + r" \\"


def latex_chapter(document: Document, key: str) -> str:
    """Paragraphs and equations of a chapter in LaTeX, to be pasted; empty where there is no such chapter."""
    parts: list[str] = []
    for chapter in document.chapters:
        for block in chapter.blocks if chapter.key == key else ():
            if isinstance(block, Paragraph):
                parts.append("".join(_latex_run(one) for one in block.runs))
            elif isinstance(block, Equation):
                parts.append(f"\\begin{{equation}}\n  {block.maths.latex}\n\\end{{equation}}")
    return "\n".join(parts) + "\n" if parts else ""


def _latex_run(one: Run) -> str:
    if isinstance(one, Maths):
        return f"${one.latex}$"
    if isinstance(one, Code):
        return rf"\texttt{{{latex_text(one.text)}}}"
    # blanks at the ends part the run from its neighbours
    head, tail = (" " if one[:1].isspace() else ""), (" " if one[-1:].isspace() else "")
    return head + latex_text(one) + tail


def write_tables(document: Document, frames: "Mapping[str, pd.DataFrame]", folder: Path) -> list[Path]:
    """Write every table: CSV with all digits where a frame has them, else as shown; LaTeX as shown.

    Returns
    -------
    list of Path
        CSV files first.
    """
    from scruton.report.tables import write_csv

    paths = write_csv(frames, folder)
    shown = [one for one in document.tables() if one.data not in frames]
    paths += [_write_shown(one, folder / f"{file_name(one.name)}.csv") for one in shown]
    paths += [_write(folder / f"{file_name(one.name)}.tex", latex_table(one)) for one in document.tables()]
    if methods := latex_chapter(document, METHODS):
        paths.append(_write(folder / f"{METHODS}.tex", methods))
    return paths


def file_name(name: str) -> str:
    """A name that every file system takes."""
    return re.sub(r"[^A-Za-z0-9_-]", "-", name)


def _write_shown(table: Table, path: Path) -> Path:
    stream = io.StringIO(newline="")
    csv.writer(stream).writerows([safe_cell(one) for one in row] for row in (table.header, *table.rows))
    return _write(path, stream.getvalue())


def _write(path: Path, text: str) -> Path:
    write_text(path, text)
    return path


def numbers(frames: "Mapping[str, pd.DataFrame]", document: Document, parts: Mapping[str, Any]) -> dict[str, Any]:
    """The content of report.json: tables with all their digits, those that have no frame as shown, and the parts."""
    content: dict[str, Any] = {"format": 1, "title": document.title, "generator": document.generator}
    content |= parts
    content["tables"] = {name: _records(frame) for name, frame in frames.items()} | {
        one.name: [dict(zip(_distinct(one.header), row, strict=True)) for row in one.rows]
        for one in document.tables()
        if one.data not in frames
    }
    content["figures"] = {one.name: one.caption for one in document.pictures()}
    return content


def _distinct(header: Sequence[str]) -> list[str]:
    """Headings, a second of the same name with its place behind it."""
    return [name if header[:i].count(name) == 0 else f"{name} ({i + 1})" for i, name in enumerate(header)]


def _records(frame: "pd.DataFrame") -> list[dict[str, Any]]:
    return [as_json(row) for row in frame.to_dict("records")]
