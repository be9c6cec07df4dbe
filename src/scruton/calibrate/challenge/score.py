"""`challenge score`: confusion, figures and pictures of a run, beside those of the baselines."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from scruton.calibrate.challenge.figures import by_effect, calibration, confusion, figures, read_outcomes
from scruton.cells import aligned, csv_text
from scruton.documents import as_json, write_text
from scruton.errors import InputError
from scruton.provenance import provenance
from scruton.workspace import Workspace

SCORE = "challenge-score.json"
_ROWS_OF_BASELINES = (
    "top-1", "truth in", "no effect", "outside", "catalogued", "calibration", "mean log", "two", "seconds",
)  # fmt: skip
_DESIGNS = {"full": "three rigs with still-air decays", "one-rig": "one rig without still-air records"}
_KINDS = {
    "none": "without an effect", "catalogue": "with one of the catalogue", "two": "with two at once",
    "open": "with one outside the catalogue",
}  # fmt: skip
_NOISES = {"turbulence": "amplitude scatter", "noise": "sensor noise", "gusts": "gusts"}


@dataclass(frozen=True, eq=False)
class ChallengeScore:
    """How a diagnosis did; `baselines` are the figures of others on the same cases, by name."""

    cases: pd.DataFrame
    settings: Mapping[str, Any]
    figures: list[dict[str, Any]]
    baselines: Mapping[str, list[dict[str, Any]]]


def score_challenge(
    folder: Path,
    results: Path,
    answers: Path | None = None,
    out: Path | None = None,
    *,
    baselines: Mapping[str, Path] | None = None,
    force: bool = False,
) -> ChallengeScore:
    """Open the sealed answers of a challenge, which may lie elsewhere, and score a run.

    `out` gets challenge-score.json, challenge-score.txt, CSV tables and pictures; nothing is written without, and
    nothing over an earlier score unless with `force`.  `baselines` are folders of runs of other diagnoses by name.

    Raises
    ------
    InputError
        If the answers are not those that were sealed, there is nothing to score, or a score lies there.
    """
    if out is not None and (out / SCORE).exists() and not force:
        raise InputError(out, "-o", "an earlier score", "an empty folder, or --force to replace it")
    cases, settings = read_outcomes(folder, results, answers)
    one_rig = settings.get("design") == "one-rig"
    others = {
        name: figures(read_outcomes(folder, place, answers)[0], one_rig=one_rig)
        for name, place in (baselines or {}).items()
    }
    score = ChallengeScore(cases, settings, figures(cases, one_rig=one_rig), others)
    if out is not None:
        with Workspace(out, "challenge score", inputs={}, settings={}, results=(SCORE,), force=force) as work:
            _write(score, work.new)
            work.publish()
    return score


def score_text(score: ChallengeScore, width: int | None = None) -> str:
    """Figures, effects and baselines as aligned tables, in lines of `width` letters."""
    return "\n\n".join(f"{title}\n{aligned(rows, width)}" for title, rows in _tables(score))


def score_markdown(score: ChallengeScore, pictures: str = ".") -> str:
    """Everything as Markdown; `pictures` is their folder, as seen from the page."""
    parts = []
    for title, (header, *rows) in _tables(score):
        lines = [f"| {' | '.join(row)} |" for row in (header, *rows)]
        parts.append("\n".join([f"## {title}\n", lines[0], f"|{'---|' * len(header)}", *lines[1:]]))
    parts.append(
        "## Pictures\n\n"
        f"![Confusion matrix: truth by row, verdict by column]({pictures}/confusion.svg)\n\n"
        f"![Reliability of the verdict's probability]({pictures}/reliability.svg)"
    )
    return "\n\n".join([f"# The blind check\n\n{describe(score)}", *parts]) + "\n"


def describe(score: ChallengeScore) -> str:
    """Say in one sentence what was scored."""
    s, kinds = score.settings, score.cases.kind.tolist()
    counts = ", ".join(f"{kinds.count(kind)} {what}" for kind, what in _KINDS.items() if kind in kinds)
    ranges = ", ".join(
        f"{what} of {100 * s[key][0]:g} to {100 * s[key][1]:g} %"
        for key, what in _NOISES.items()
        if any(s.get(key, ()))
    )
    left = f" {s['not_run']} cases have not been run." if s.get("not_run") else ""
    made = f"{_DESIGNS.get(str(s.get('design')), 'any design')} (seed {s.get('seed', 'unknown')})"
    return f"{len(kinds)} campaigns of {made}: {counts}; {ranges or 'no noise that is known'}.{left}"


def _tables(score: ChallengeScore) -> list[tuple[str, list[list[str]]]]:
    """Titles and rows of text, the first of them the header."""
    rows = [["figure", "reached", "wanted", "95 % interval", "cases", "met"]]
    for entry in score.figures:
        low, high = (_shown(entry[end], entry) for end in ("low95", "high95"))
        span = f"{low} to {high}" if entry["cases"] and np.isfinite(entry["low95"]) else ""
        met = {True: "yes", False: "NO", None: ""}[entry["met"]]
        rows.append([entry["figure"], _shown(entry["reached"], entry), _wanted(entry), span, str(entry["cases"]), met])
    effects = [["truth", "severity", "cases", "right", "95 % interval", "in group", "group size", "shrink", "else"]]
    for row in by_effect(score.cases):
        effects.append([
            str(row["truth"]), "all" if row["severity"] is None else f"{row['severity']:g}", str(row["cases"]),
            _percent(row["right"]), f"{_percent(row['low95'])} to {_percent(row['high95'])}", _percent(row["in_group"]),
            f"{row['group_size']:.2f}", "" if row["shrink"] is None else f"{row['shrink']:.2f}",
            str(row["most_often_wrong"]),
        ])  # fmt: skip
    tables = [("Figures", rows), ("By effect and severity", effects)]
    if score.baselines:
        beside = [["figure", "wanted", "scruton", *score.baselines]]
        for entry, *same in zip(score.figures, score.figures, *score.baselines.values(), strict=True):
            if entry["figure"].startswith(_ROWS_OF_BASELINES):
                beside.append([entry["figure"], _wanted(entry), *(_shown(other["reached"], entry) for other in same)])
        tables.append(("Beside the baselines", beside))
    return tables


def _wanted(figure: Mapping[str, Any]) -> str:
    sign = "<=" if figure["at_most"] else ">="
    return "" if figure["wanted"] is None else f"{sign} {_shown(figure['wanted'], figure)}"


def _shown(value: float, figure: Mapping[str, Any]) -> str:
    if not np.isfinite(value):
        return "-"
    return f"{100 * value:.1f} %" if figure["percent"] else f"{value:.3g}"


def _percent(value: object) -> str:
    return "" if value is None else f"{100 * float(str(value)):.0f} %"


def _write(score: ChallengeScore, out: Path) -> None:
    from scruton.calibrate.challenge.pictures import draw

    cases = score.cases.loc[:, :"right"]  # without what follows from them
    tables: dict[str, list[Any]] = {
        "figures": _plain(score.figures),
        "effects": by_effect(score.cases),
        "confusion": confusion(score.cases).rename_axis("truth").reset_index().to_dict("records"),
        "reliability": calibration(score.cases)[0].to_dict("records"),
        "cases": cases.astype(object).where(cases.notna(), None).to_dict("records"),
    }
    settings = dict(score.settings)
    everything: dict[str, Any] = {"format": 1, "settings": settings} | tables
    everything["provenance"] = provenance("challenge score", seed=settings.get("seed", 0), sha256={}, settings=settings)
    everything["baselines"] = {name: _plain(table) for name, table in score.baselines.items()}
    for name, table in tables.items():
        write_text(out / f"{name}.csv", csv_text(table))
    write_text(out / "challenge-score.txt", f"{describe(score)}\n\n{score_text(score)}\n")
    draw(score.cases, out)
    write_text(out / SCORE, json.dumps(as_json(everything), indent=1, allow_nan=False) + "\n")


def _plain(table: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [{key: value for key, value in row.items() if key != "percent"} for row in table]
