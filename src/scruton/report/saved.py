"""What earlier runs left beside a fit - diagnosis, sizing, crossed predictions - as parts of a report."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.documents import found_beside, read_document, read_json
from scruton.errors import InputError
from scruton.gap.results import RESULT as GAP
from scruton.infer.store import provenance_of
from scruton.report.chapters.gap_words import carried_sentence, contained_sentence, gap_sentence
from scruton.report.document import Picture
from scruton.report.figures.gap import gap_caption
from scruton.report.kept import Beside, drawn_from, kept
from scruton.report.parts import Asked, Part, part_of_sizing, scruton_numbers_of, sizing_part
from scruton.sizing.results import RESULT as SIZING

if TYPE_CHECKING:
    from scruton.infer.results import Fit

REPORT, VALIDATION, FIGURES = "report.json", "validation.json", "figures"


def beside(
    folder: Path,
    fit: "Fit",
    *,
    asked: Asked | None = None,
    design_sc: Sequence[float],
    gap: bool = True,
    sizing: Path | None = None,
    out: Path | None = None,
) -> dict[str, Any]:
    """What `write_report` takes beside a fit that lies in a folder; a bridge that is `asked` for is sized anew.

    Without `gap` the diagnosis is left out, and not looked at.  `sizing` is as of `chosen_sizing`; in `out` an earlier
    report may lie, as in the folder of the fit and beside it, whose figures of the same fit are taken as they are.

    Raises
    ------
    InputError
        As `saved_gap`, `saved_sizing` and `sizing_part`.
    """
    design, fit_sha256 = design_sc, provenance_of(folder, fit.summary)
    if asked is None:
        sized = saved_sizing(chosen_sizing(folder, fit.summary, sizing))
    else:
        sized = sizing_part(folder, asked, fit.seed, fit)
        design = design_sc or scruton_numbers_of(fit.tree, asked.bridge)
    figures = kept(reports_beside(folder, out), drawn_from(fit_sha256))
    return {
        "gap": saved_gap(folder, fit.summary) if gap else None, "sizing": sized, "design_sc": design,
        "known": Beside(partial(saved_crossed, folder), fit_sha256, figures),
    }  # fmt: skip


def reports_beside(folder: Path, out: Path | None = None) -> list[tuple[Path, Path]]:
    """Where a report of a fit may lie: report.json and the folder of its figures of each place."""
    places = [*([] if out is None else [out]), folder, *sorted(folder.glob("report*"))]
    return [(place / REPORT, place / FIGURES) for place in places]


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
    if other := of_other_records(content, summary):
        raise InputError(path, "provenance", f"a diagnosis of another {other[0]}", "one of the records of this fit")
    for at in (path.parent / FIGURES, path.parent):
        if (at / "gap.svg").is_file() and (at / "gap.png").is_file():
            svg, png = ((at / f"gap.{kind}").read_bytes() for kind in ("svg", "png"))
            return Part(content, [Picture("gap", gap_caption(), gap_sentence(content), svg, png)])
    return Part(content)


def said_of_the_gap(path: Path | None, summary: Mapping[str, Any], numbers: str) -> str:
    """Whether `numbers` of a fit contain what its diagnosis found, in a sentence; empty where nothing is known of it.

    The diagnosis lies at `path`. One that is damaged, or of other records, says nothing here: `report` refuses it.
    """
    content = None
    if path is not None:
        with suppress(InputError):
            content = read_document(path, "what `scruton diagnose` wrote", version=1)
    if content is None or of_other_records(content, summary):
        return carried_sentence(summary)
    said = gap_sentence(content)
    return " ".join(["Diagnosis:", said, contained_sentence(content, summary, numbers)]).rstrip()


def of_other_records(gap: Mapping[str, Any], summary: Mapping[str, Any]) -> list[str]:
    """Records that a diagnosis has and a fit has otherwise."""
    records, fitted = gap["provenance"]["sha256"], summary["provenance"]["sha256"]
    return [name for name in fitted if name in records and records[name] != fitted[name]]


def saved_sizing(path: Path | None) -> Part | None:
    """The sizing of a file that `size` or `report` wrote; None where there is none.

    Raises
    ------
    InputError
        If it is damaged.
    """
    if path is None:
        return None
    content = read_sizing(path)
    return part_of_sizing(content, _other_motion(path, content))


def _other_motion(path: Path, content: Mapping[str, Any]) -> dict[str, Any] | None:
    """What `size --other` wrote of the other motion: below the first one, or above the second."""
    both = content.get("both")
    if not both:
        return None
    for folder in (*(path.parent / motion for motion in sorted({*both["motions"]})), path.parent.parent):
        if (folder / SIZING).is_file():
            found = read_sizing(folder / SIZING)
            if found.get("both") == both and found["bridge"]["motion"] != content["bridge"]["motion"]:
                return found
    return None


def chosen_sizing(folder: Path, summary: Mapping[str, Any], named: Path | None = None) -> Path | None:
    """The sizing.json that lies last beside a fit and was made from it, or the one of a folder that is named.

    None where there is none beside.

    Raises
    ------
    InputError
        If it is damaged, made from another fit as all others are, or not in the folder that is named.
    """
    there = sizings_beside(folder) if named is None else [named / SIZING]
    if named is not None and not there[0].is_file():
        raise InputError(named, "sizing", f"no {SIZING}", "a folder that `scruton size` wrote")
    made_from = provenance_of(folder, summary) if there else None
    for path in there:
        if read_sizing(path)["provenance"].get("fit_sha256") == made_from:
            return path
    if there:
        raise InputError(there[0], "provenance", "a sizing from another fit", "that of `scruton size` on this folder")
    return None


def sizings_beside(folder: Path) -> list[Path]:
    """Every sizing.json in the folder of a fit and in those that `size` makes in it, the last one first.

    The numbers of the folders give the order; one in the folder itself is the report's and stands behind them.
    """
    numbers = ((path.name.removeprefix("sizing-"), path) for path in folder.glob("sizing-*"))
    numbered = sorted(((int(number), path) for number, path in numbers if number.isdecimal()), reverse=True)
    places = [*(path for _, path in numbered), folder / "sizing", folder]
    return [place / SIZING for place in places if (place / SIZING).is_file()]


def sizing_remark(folder: Path, used: Path | None) -> str:
    """Which of several sizings beside a fit is used; empty where there is no other."""
    others = [path.parent for path in sizings_beside(folder) if path != used]
    if used is None or not others:
        return ""
    beside = f"{' and '.join(map(str, others))} {'holds another' if len(others) == 1 else 'hold others'}"
    return f"the sizing is that of {used.parent}; {beside}"


def read_sizing(path: Path) -> dict[str, Any]:
    """Read the content of a sizing.json (InputError where it is damaged)."""
    return read_document(path, "what `scruton size` wrote", ("provenance",), version=1)


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
