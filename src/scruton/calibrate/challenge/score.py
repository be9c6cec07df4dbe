"""`challenge score`: confusion, figures and pictures of a run, beside those of the baselines."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scruton.calibrate.challenge.figures import Figure, by_effect, calibration, confusion, figures
from scruton.calibrate.challenge.outcomes import Outcome, read_outcomes
from scruton.calibrate.plain import aligned, csv_text, plain
from scruton.documents import write_text
from scruton.errors import InputError
from scruton.provenance import provenance
from scruton.workspace import Workspace

SCORE = "challenge-score.json"
_ROWS_OF_BASELINES = (
    "top-1", "truth in", "no effect", "outside", "catalogued", "calibration", "mean log", "two", "seconds",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class ChallengeScore:
    """How a diagnosis did.

    Attributes
    ----------
    outcomes : tuple of Outcome
    settings : mapping
        Of the challenge; `not_run` is the number of cases without a result.
    figures : tuple of Figure
    baselines : mapping
        Figures of others on the same cases, by name.
    """

    outcomes: tuple[Outcome, ...]
    settings: Mapping[str, Any]
    figures: tuple[Figure, ...]
    baselines: Mapping[str, tuple[Figure, ...]]


def score_challenge(
    folder: Path,
    results: Path,
    answers: Path | None = None,
    out: Path | None = None,
    *,
    baselines: Mapping[str, Path] | None = None,
    force: bool = False,
) -> ChallengeScore:
    """Open the sealed answers and score a run.

    Parameters
    ----------
    folder, results : Path
        Of the challenge, and of its run.
    answers : Path, optional
        The sealed file, if it lies elsewhere.
    out : Path, optional
        Gets challenge-score.json, challenge-score.txt, CSV tables and pictures; nothing is written without.
    baselines : mapping, optional
        Folders of runs of other diagnoses by name; see `scruton.calibrate.challenge.baselines`.
    force : bool
        Replace a score that lies in the folder.

    Raises
    ------
    InputError
        If the answers are not those that were sealed, or there is nothing to score.
    """
    if out is not None and (out / SCORE).exists() and not force:
        raise InputError(out, "-o", "an earlier score", "an empty folder, or --force to replace it")
    outcomes, settings = read_outcomes(folder, results, answers)
    one_rig = settings.get("design") == "one-rig"
    others = {
        name: figures(read_outcomes(folder, place, answers)[0], one_rig=one_rig)
        for name, place in (baselines or {}).items()
    }
    score = ChallengeScore(outcomes, settings, figures(outcomes, one_rig=one_rig), others)
    if out is not None:
        with Workspace(out, "challenge score", inputs={}, settings={}, results=(SCORE,), force=force) as work:
            _write(score, work.new)
            work.publish()
    return score


def score_text(score: ChallengeScore) -> str:
    """Figures, effects and baselines as aligned tables."""
    return "\n\n".join(f"{title}\n{aligned(rows)}" for title, rows in _tables(score))


def score_markdown(score: ChallengeScore, pictures: str = ".") -> str:
    """Everything as Markdown.

    Parameters
    ----------
    score : ChallengeScore
    pictures : str
        Folder of the pictures, as seen from the page.
    """
    parts = [f"## {title}\n\n{_piped(rows)}" for title, rows in _tables(score)]
    parts.append(
        "## Pictures\n\n"
        f"![Confusion matrix: truth by row, verdict by column]({pictures}/confusion.svg)\n\n"
        f"![Reliability of the verdict's probability]({pictures}/reliability.svg)"
    )
    return "\n\n".join([f"# The blind check\n\n{describe(score)}", *parts]) + "\n"


def describe(score: ChallengeScore) -> str:
    """Say in one sentence what was scored."""
    s = score.settings
    kinds = [one.kind for one in score.outcomes]
    counts = ", ".join(
        f"{kinds.count(kind)} {what}"
        for kind, what in (
            ("none", "without an effect"), ("catalogue", "with one of the catalogue"), ("two", "with two at once"),
            ("open", "with one outside the catalogue"),
        )
        if kind in kinds
    )  # fmt: skip
    ranges = [
        f"{what} of {100 * s[key][0]:g} to {100 * s[key][1]:g} %"
        for key, what in (("turbulence", "amplitude scatter"), ("noise", "sensor noise"))
        if key in s
    ]
    left = f" {s['not_run']} cases have not been run." if s.get("not_run") else ""
    design = {"full": "three rigs with still-air decays", "one-rig": "one rig without still-air records"}
    made = design.get(str(s.get("design")), "any design")
    return (
        f"{len(kinds)} campaigns of {made} (seed {s.get('seed', 'unknown')}): {counts}; "
        f"{', '.join(ranges) or 'noise unknown'}.{left}"
    )


def _tables(score: ChallengeScore) -> list[tuple[str, list[list[str]]]]:
    rows = [["figure", "reached", "wanted", "95 % interval", "cases", "met"]]
    for one in score.figures:
        sign = "" if one.wanted is None else f"{'<=' if one.at_most else '>='} {_shown(one.wanted, one)}"
        span = " to ".join(_shown(x, one) for x in one.interval95) if np.isfinite(one.interval95[0]) else ""
        met = {True: "yes", False: "NO", None: ""}[one.met]
        rows.append([one.name, _shown(one.reached, one), sign, span if one.cases else "", str(one.cases), met])
    found = [("Figures", rows)]
    effects = [["truth", "severity", "cases", "right", "95 % interval", "in group", "group size", "shrink", "else"]]
    for row in by_effect(score.outcomes):
        severity = "all" if row["severity"] is None else f"{row['severity']:g}"
        span = f"{_percent(row['low95'])} to {_percent(row['high95'])}"
        effects.append([
            str(row["truth"]), severity, str(row["cases"]), _percent(row["right"]), span, _percent(row["in_group"]),
            f"{row['group_size']:.2f}", "" if row["shrink"] is None else f"{row['shrink']:.2f}",
            str(row["most_often_wrong"]),
        ])  # fmt: skip
    found.append(("By effect and severity", effects))
    if score.baselines:
        head = ["figure", "wanted", "scruton", *score.baselines]
        beside = [head]
        for i, one in enumerate(score.figures):
            if one.name.startswith(_ROWS_OF_BASELINES):
                sign = "" if one.wanted is None else f"{'<=' if one.at_most else '>='} {_shown(one.wanted, one)}"
                others = [_shown(table[i].reached, one) for table in score.baselines.values()]
                beside.append([one.name, sign, _shown(one.reached, one), *others])
        found.append(("Beside the baselines", beside))
    return found


def _shown(value: float, figure: Figure) -> str:
    if not np.isfinite(value):
        return "-"
    return f"{100 * value:.1f} %" if figure.percent else f"{value:.3g}"


def _percent(value: object) -> str:
    return "" if value is None else f"{100 * float(str(value)):.0f} %"


def _write(score: ChallengeScore, out: Path) -> None:
    from scruton.calibrate.challenge.pictures import draw

    rows, columns, counts = confusion(score.outcomes)
    bins = calibration(score.outcomes)
    tables: dict[str, list[dict[str, Any]]] = {
        "figures": [_figure(one) for one in score.figures],
        "effects": by_effect(score.outcomes),
        "confusion": [
            {"truth": name} | dict(zip(columns, line.tolist(), strict=True))
            for name, line in zip(rows, counts, strict=True)
        ],
        "reliability": [
            {"probability": float(p), "accuracy": float(a), "cases": int(n)}
            for p, a, n in zip(bins.probability, bins.accuracy, bins.count, strict=True)
        ],
        "cases": [_case(one) for one in score.outcomes],
    }
    settings = dict(score.settings)
    everything: dict[str, Any] = {"format": 1, "settings": settings} | tables
    everything["provenance"] = provenance("challenge score", seed=settings.get("seed", 0), sha256={}, settings=settings)
    everything["baselines"] = {name: [_figure(one) for one in table] for name, table in score.baselines.items()}
    for name, table in tables.items():
        write_text(out / f"{name}.csv", csv_text(table))
    write_text(out / "challenge-score.txt", f"{describe(score)}\n\n{score_text(score)}\n")
    draw(score.outcomes, out)
    write_text(out / SCORE, json.dumps(plain(everything), indent=1, allow_nan=False) + "\n")


def _figure(one: Figure) -> dict[str, Any]:
    return {
        "figure": one.name, "reached": one.reached, "low95": one.interval95[0], "high95": one.interval95[1],
        "cases": one.cases, "wanted": one.wanted, "at_most": one.at_most, "met": one.met,
    }  # fmt: skip


def _case(one: Outcome) -> dict[str, Any]:
    return asdict(one) | {"probability": dict(one.probability), "right": one.right}


def _piped(rows: Sequence[Sequence[str]]) -> str:
    lines = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([lines[0], f"|{'---|' * len(rows[0])}", *lines[1:]])
