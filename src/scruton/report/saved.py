"""What earlier runs left beside a fit - diagnosis, sizing, crossed predictions - as parts of a report."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.documents import read_document, read_json
from scruton.errors import InputError
from scruton.gap.results import RESULT as GAP
from scruton.infer.store import provenance_of
from scruton.report.chapters.gap import gap_sentence
from scruton.report.document import Picture
from scruton.report.figures.gap import CAPTION
from scruton.report.parts import Part, part_of_sizing, scruton_numbers_of, sizing_part
from scruton.sizing.results import RESULT as SIZING

if TYPE_CHECKING:
    from scruton.infer.results import Fit

REPORT, VALIDATION, FIGURES = "report.json", "validation.json", "figures"


def beside(
    folder: Path,
    fit: "Fit",
    *,
    bridge: Path | None,
    limits: Sequence[str],
    design_sc: Sequence[float],
    gap: bool = True,
) -> dict[str, Any]:
    """What `write_report` takes beside a fit that lies in a folder; a bridge that is named is sized anew.

    Without `gap` the diagnosis is left out, and not looked at.

    Raises
    ------
    InputError
        As `saved_gap`, `saved_sizing` and `sizing_part`.
    """
    sizing, design = saved_sizing(folder, fit.summary) if bridge is None else None, design_sc
    if bridge is not None:
        sizing = sizing_part(folder, bridge, limits, int(fit.summary["provenance"]["seed"]))
        design = design_sc or scruton_numbers_of(fit.tree, bridge)
    return {
        "gap": saved_gap(folder, fit.summary) if gap else None, "sizing": sizing, "design_sc": design,
        "crossed": partial(saved_crossed, folder),
    }  # fmt: skip


def saved_gap(folder: Path, summary: Mapping[str, Any]) -> Part | None:
    """The diagnosis that `diagnose` or `report` left in the folder of a fit; None where there is none.

    Raises
    ------
    InputError
        If it is damaged, or one of other records.
    """
    path = found_beside(folder, "gap", GAP)
    if path is None:
        return None
    content = read_document(path, "what `scruton diagnose` wrote", version=1)
    records, fitted = content["provenance"]["sha256"], summary["provenance"]["sha256"]
    other = [name for name in fitted if name in records and records[name] != fitted[name]]
    if other:
        raise InputError(path, "provenance", f"a diagnosis of another {other[0]}", "one of the records of this fit")
    for at in (path.parent / FIGURES, path.parent):
        if (at / "gap.svg").is_file() and (at / "gap.png").is_file():
            svg, png = ((at / f"gap.{kind}").read_bytes() for kind in ("svg", "png"))
            return Part(content, [Picture("gap", CAPTION, gap_sentence(content), svg, png)])
    return Part(content)


def saved_sizing(folder: Path, summary: Mapping[str, Any]) -> Part | None:
    """The sizing that `size` or `report` left in the folder of a fit; None where there is none.

    Raises
    ------
    InputError
        If it is damaged, or made from another fit.
    """
    path = found_beside(folder, "sizing", SIZING)
    if path is None:
        return None
    content = read_document(path, "what `scruton size` wrote", version=1)
    if content["provenance"].get("fit_sha256") != provenance_of(folder, summary):
        raise InputError(path, "provenance", "a sizing from another fit", "that of `scruton size` on this folder")
    return part_of_sizing(content)


def saved_crossed(folder: Path) -> dict[str, Any]:
    """Predictions of each peak test from all the others, by test, that `report` or `validate` left; else empty."""
    if (folder / REPORT).is_file():
        crossed: dict[str, Any] = read_json(folder / REPORT).get("crossed", {})
        if crossed:
            return crossed
    path = found_beside(folder, "validation", VALIDATION)
    if path is None:
        return {}
    cases = read_json(path).get("validations", [])
    tests = {case["test"] for case in cases}
    return {case["test"]: case["prediction"] for case in cases if {*case["from"]} == tests - {case["test"]}}


def found_beside(folder: Path, beside: str, name: str) -> Path | None:
    """A result in the folder of the fit, or in the one beside it that its own verb writes."""
    return next((path for path in (folder / name, folder / beside / name) if path.is_file()), None)
